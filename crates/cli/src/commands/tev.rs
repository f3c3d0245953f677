//! `render --tev`: a picture shown in the viewer tev while it is computed.

use crate::output::note;
use anyhow::{Context, Result};
use linelit_film::{Image, Tile};
use std::io;
use std::net::TcpStream;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// The channels of a pixel, one after the other.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// A connection to tev, which shows one image. What goes wrong ends the connection, not the render.
pub(super) struct Viewer {
    client: Option<TevClient>,
    name: String,
    /// The column and row of the image's upper left pixel.
    corner: [u32; 2],
}

impl Viewer {
    /// Connects to the tev that listens at `address`, and opens a black image there.
    pub(super) fn new(address: &str, name: &str, window: Tile) -> Result<Self> {
        let connect = || -> io::Result<TevClient> {
            let mut client = TevClient::wrap(TcpStream::connect(address)?);
            client.send(PacketCreateImage {
                image_name: name,
                grab_focus: true,
                width: window.width(),
                height: window.height(),
                channel_names: &CHANNELS,
            })?;
            Ok(client)
        };
        let client = connect().with_context(|| format!("no tev answers at {address}"))?;
        Ok(Self {
            client: Some(client),
            name: name.to_owned(),
            corner: [window.x0, window.y0],
        })
    }

    /// Shows a tile of the image.
    pub(super) fn show(&mut self, tile: Tile, image: &Image) {
        let Some(client) = &mut self.client else {
            return;
        };
        let [x, y] = [tile.x0 - self.corner[0], tile.y0 - self.corner[1]];
        let rows = (y..y + tile.height()).flat_map(|row| {
            let first = row as usize * image.width as usize + x as usize;
            &image.rgb[first..first + tile.width() as usize]
        });
        let data: Vec<f32> = rows.flatten().copied().collect();
        let sent = client.send(PacketUpdateImage {
            image_name: &self.name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3; 3],
            x,
            y,
            width: tile.width(),
            height: tile.height(),
            data: &data,
        });
        if let Err(error) = sent {
            note(format_args!("note: tev is gone: {error}"));
            self.client = None;
        }
    }
}
