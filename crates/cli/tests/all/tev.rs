//! `render --tev`, with a listener that takes the part of tev.

use crate::common::{PROGRAM, folder, linelit, path, succeeded, text};
use linelit_film::Image;
use std::io::Read as _;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

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

/// The behaviour of a listener on the connection that it has accepted.
type Viewer = fn(TcpStream);

/// Reads a kilobyte ten times a second.
fn reads_slowly(mut stream: TcpStream) {
    let mut some = [0; 1024];
    while stream.read(&mut some).is_ok_and(|count| count > 0) {
        thread::sleep(Duration::from_millis(100));
    }
}

/// Reads a little, and leaves.
fn closes(mut stream: TcpStream) {
    stream.read_exact(&mut [0; 1000]).expect("a packet");
}

/// The arguments of a picture that the buffers of the system do not hold.
fn large_picture(image: &Path) -> Vec<&str> {
    let line = "render floating-quad --resolution 1280x1024 --samples 1 --estimator point-area -o";
    line.split(' ').chain([path(image)]).collect()
}

/// Renders for a viewer, and returns the messages.
fn render_for(viewer: Viewer, image: &Path) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    thread::spawn(move || viewer(listener.accept().expect("the program").0));
    let mut command = Command::new(PROGRAM);
    command.args(large_picture(image)).args(["--tev", &address]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program");
    // Longer than it takes on any machine, and no end is no answer.
    let end = Instant::now() + Duration::from_secs(300);
    while child.try_wait().expect("a status").is_none() {
        if Instant::now() > end {
            child.kill().expect("an end");
        }
        thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("its output");
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    said
}

/// The same picture is written, whatever the viewer does.
#[test]
fn a_viewer_that_does_not_read_loses_no_picture() {
    let dir = folder("tev-stalled");
    let whole = dir.join("whole.pfm");
    succeeded(&large_picture(&whole));
    let whole = std::fs::read(whole).expect("a picture");
    let viewers: [(&str, Viewer); 3] = [
        ("stalls", |stream| {
            thread::sleep(Duration::from_secs(300));
            drop(stream);
        }),
        ("slow", reads_slowly),
        ("closes", closes),
    ];
    thread::scope(|scope| {
        for (name, viewer) in viewers {
            let (dir, whole) = (&dir, &whole);
            scope.spawn(move || {
                let image = dir.join(format!("{name}.pfm"));
                let said = render_for(viewer, &image);
                assert!(said.contains("note: tev is gone: "), "{name}: {said}");
                assert!(std::fs::read(image).expect("a picture") == *whole, "{name}");
            });
        }
    });
}

#[test]
fn addresses_that_lead_nowhere_are_refused() {
    let image = folder("tev-nowhere").join("x.exr");
    // A domain that is never registered (RFC 2606), and an address without a port.
    for address in ["tev.invalid:14158", "127.0.0.1"] {
        let output = linelit(&["render", "plates", "--tev", address, "-o", path(&image)]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        let what = format!("no tev answers at {address}");
        assert!(said.contains(&what), "{said}");
        assert!(!image.exists());
    }
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
