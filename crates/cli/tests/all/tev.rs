//! `render --tev`, against a listener in tev's place.

use crate::common::{folder, linelit, path, succeeded, text};
use linelit_film::Image;
use std::io::Read as _;
use std::net::TcpListener;
use std::thread;

/// A packet's fields, from its beginning on.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk().expect("a whole packet");
        self.0 = rest;
        *head
    }

    fn number(&mut self) -> usize {
        u32::from_le_bytes(self.bytes()) as usize
    }

    fn name(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).expect("an end");
        let name = String::from_utf8(self.0[..end].to_vec()).expect("text");
        self.0 = &self.0[end + 1..];
        name
    }
}

#[test]
fn tiles_arrive_as_they_are_written() {
    let image = folder("tev").join("x.pfm");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let received = thread::spawn(move || {
        let mut bytes = Vec::new();
        let mut stream = listener.accept().expect("the program").0;
        stream.read_to_end(&mut bytes).expect("packets");
        bytes
    });
    let line = "render cornell-box-small --resolution 50x40 --crop 0.1,0.9,0,1 --tev";
    let words = line.split(' ').chain([&*address, "-o", path(&image)]);
    succeeded(&words.collect::<Vec<_>>());
    let written = Image::read(&image).expect("a picture");

    let bytes = received.join().expect("a listener");
    let (mut rest, mut shown, mut size) = (Fields(&bytes), Vec::new(), [0; 2]);
    let mut count = 0;
    while !rest.0.is_empty() {
        let length = rest.number() - 4;
        let (packet, after) = rest.0.split_at(length);
        rest.0 = after;
        let mut packet = Fields(packet);
        let [kind, _focus] = packet.bytes();
        assert_eq!(packet.name(), path(&image));
        if kind == 4 {
            size = [packet.number(), packet.number()];
            shown = vec![[f32::NAN; 3]; size[0] * size[1]];
            continue;
        }
        assert_eq!((kind, packet.number()), (6, 3));
        assert_eq!(
            [packet.name(), packet.name(), packet.name()],
            ["R", "G", "B"]
        );
        let [x, y, width, height] = [0; 4].map(|_| packet.number());
        // Offsets and strides of three channels.
        let _: [u8; 48] = packet.bytes();
        for row in y..y + height {
            for column in x..x + width {
                shown[row * size[0] + column] = [0; 3].map(|_| f32::from_le_bytes(packet.bytes()));
                count += 1;
            }
        }
        assert!(packet.0.is_empty());
    }
    assert_eq!(
        size,
        [written.width, written.height].map(|side| side as usize)
    );
    assert_eq!((count, shown), (written.rgb.len(), written.rgb));
}

#[test]
fn without_tev_nothing_is_rendered() {
    let image = folder("no-tev").join("x.exr");
    // A port that was just free.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    drop(listener);
    let output = linelit(&["render", "plates", "--tev", &address, "-o", path(&image)]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(
        said.contains(&format!("no tev answers at {address}")),
        "{said}"
    );
    assert!(!image.exists());
}
