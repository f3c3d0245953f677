//! `render --tev`: a picture shown in the viewer tev while it is computed.
//!
//! A separate thread sends the tiles, so that a viewer that reads slowly, or not at all, does not
//! delay the render. An error ends the connection, not the render.
#![allow(
    clippy::disallowed_methods,
    reason = "speaks to tev on a thread of its own"
)]

use crate::output::note;
use anyhow::{Context, Result, bail};
use linelit_film::{Image, Tile};
use std::io;
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// The channels of a pixel, in the order in which they are sent.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// The longest time that tev may take to answer, to read any data, and to read the rest once the
/// picture is computed.
const PATIENCE: Duration = Duration::from_secs(5);

/// A connection to tev, which shows one image.
pub(super) struct Viewer {
    tiles: Sender<Pixels>,
    /// Receives whether tev answers; it is closed once no more tiles will be sent.
    answers: Receiver<io::Result<()>>,
    /// The column and row of the image's upper left pixel.
    corner: [u32; 2],
}

/// The pixels of a tile, and the position of the tile in the image.
struct Pixels {
    corner: [u32; 2],
    size: [u32; 2],
    data: Vec<f32>,
}

impl Viewer {
    /// Connects to the tev that listens at `address`, and opens a black image there.
    pub(super) fn new(address: &str, name: &str, window: Tile) -> Result<Self> {
        let ((tiles, received), (answer, answers)) = (channel(), channel());
        let [to, name] = [address, name].map(str::to_owned);
        // Connect on a thread of its own, which then sends the tiles that come.
        thread::spawn(move || {
            // An answer that comes too late is not received by anyone.
            let mut client = match connect(&to, &name, window) {
                Ok(client) => client,
                Err(error) => return drop(answer.send(Err(error))),
            };
            let _ = answer.send(Ok(()));
            if let Err(error) = received
                .iter()
                .try_for_each(|p| send(&mut client, &name, &p))
            {
                note(format_args!("note: tev is gone: {error}"));
            }
        });
        // Wait for the answer.
        match answers.recv_timeout(PATIENCE) {
            Ok(answer) => answer.with_context(|| format!("no tev answers at {address}"))?,
            Err(_) => bail!("no tev answers at {address} within {PATIENCE:?}"),
        }
        Ok(Self {
            tiles,
            answers,
            corner: [window.x0, window.y0],
        })
    }

    /// Shows a tile of the image.
    pub(super) fn show(&self, tile: Tile, image: &Image) {
        let [x, y] = [tile.x0 - self.corner[0], tile.y0 - self.corner[1]];
        let rows = (y..y + tile.height()).flat_map(|row| {
            let first = row as usize * image.width as usize + x as usize;
            &image.rgb[first..first + tile.width() as usize]
        });
        // If tev is gone, the tile is dropped.
        let _ = self.tiles.send(Pixels {
            corner: [x, y],
            size: [tile.width(), tile.height()],
            data: rows.flatten().copied().collect(),
        });
    }

    /// Waits for tev to read the tiles that are still being sent.
    pub(super) fn finish(self) {
        drop(self.tiles);
        if matches!(
            self.answers.recv_timeout(PATIENCE),
            Err(RecvTimeoutError::Timeout)
        ) {
            note(format_args!(
                "note: tev is gone: it has not read all of the picture within {PATIENCE:?}"
            ));
        }
    }
}

/// Connects to tev and opens a black image there.
fn connect(address: &str, name: &str, window: Tile) -> io::Result<TevClient> {
    let stream = TcpStream::connect(address)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut client = TevClient::wrap(stream);
    client.send(PacketCreateImage {
        image_name: name,
        grab_focus: true,
        width: window.width(),
        height: window.height(),
        channel_names: &CHANNELS,
    })?;
    Ok(client)
}

/// Sends a tile to tev.
fn send(client: &mut TevClient, name: &str, pixels: &Pixels) -> io::Result<()> {
    let ([x, y], [width, height]) = (pixels.corner, pixels.size);
    let sent = client.send(PacketUpdateImage {
        image_name: name,
        grab_focus: false,
        channel_names: &CHANNELS,
        channel_offsets: &[0, 1, 2],
        channel_strides: &[3; 3],
        x,
        y,
        width,
        height,
        data: &pixels.data,
    });
    sent.map_err(|error| match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
            io::Error::other(format!("it has read nothing for {PATIENCE:?}"))
        }
        _ => error,
    })
}
