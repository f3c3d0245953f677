//! The reading of one picture from an EXR file, which may have many layers. The size of the picture
//! is checked before anything is unpacked, only the channels of the picture are stored, and its
//! colours are converted to linear RGB with the primaries of Rec. 709.

use std::io::Cursor;

use exr::block::reader::Reader;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;

use crate::openexr::{self, FORMAT};
use crate::primaries;
use crate::{FormatError, Image, Placement};

/// An EXR file whose headers have been read.
pub(crate) struct Picture<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
    channels: Vec<NamedChannel>,
}

/// A channel of the file.
struct NamedChannel {
    layer: String,
    name: String,
    /// The index of the part of the file that has the channel.
    part: usize,
    /// The index of the channel in this part.
    index: usize,
}

/// The number of bytes of a pixel of an [`Image`].
const PIXEL: usize = 12;

impl<'a> Picture<'a> {
    /// Reads the headers of a file.
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, FormatError> {
        // Read and check the headers.
        openexr::check_magic(bytes)?;
        let reader =
            exr::block::read(Cursor::new(bytes), false).map_err(|e| openexr::broken(&e))?;
        openexr::check_headers(reader.headers())?;
        // List the channels of all parts.
        let mut channels = Vec::new();
        for (part, header) in reader.headers().iter().enumerate() {
            for (index, channel) in header.channels.list.iter().enumerate() {
                let several = reader.headers().len() > 1;
                let part_name = header.own_attributes.layer_name.as_ref();
                let (layer, name) = openexr::layer_and_name(part_name, &channel.name, several);
                channels.push(NamedChannel {
                    layer,
                    name,
                    part,
                    index,
                });
            }
        }
        Ok(Self { reader, channels })
    }

    /// Returns the names of the layers, in alphabetical order.
    pub(crate) fn layers(&self) -> Vec<String> {
        let mut names: Vec<String> = self.channels.iter().map(|c| c.layer.clone()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Returns the channels `R`, `G` and `B` of a layer, or three times its only channel or its
    /// channel `Y`.
    fn colours(&self, layer: &str) -> Option<[&NamedChannel; 3]> {
        let of_layer = || self.channels.iter().filter(|c| c.layer == layer);
        let named = |name: &str| of_layer().find(|c| c.name == name);
        match (named("R"), named("G"), named("B")) {
            (Some(r), Some(g), Some(b)) => Some([r, g, b]),
            _ if of_layer().count() == 1 => of_layer().next().map(|only| [only; 3]),
            _ => named("Y").map(|y| [y; 3]),
        }
    }

    /// Returns the position of the pixels in the full picture; `None` if the pixels are the full
    /// picture.
    pub(crate) fn placement(&self) -> Result<Option<Placement>, FormatError> {
        let header = &self.reader.headers()[0];
        openexr::placement(
            header.own_attributes.layer_position,
            header.layer_size,
            header.shared_attributes.display_window,
        )
    }

    /// Decodes a layer; for `None`, the layer that is the picture of the file
    /// ([`openexr::main_layer`]). The result is `Ok(None)` if there is no such layer. The picture
    /// and the largest block of the file together may take `limit` bytes.
    pub(crate) fn decode(
        self,
        layer: Option<&str>,
        limit: usize,
    ) -> Result<Option<Image>, FormatError> {
        // Find the three channels.
        let colours = match layer {
            Some(name) => self.colours(name),
            None => {
                let names = self.channels.iter();
                let names: Vec<(&str, &str)> = names.map(|c| (&*c.layer, &*c.name)).collect();
                openexr::main_layer(&names).and_then(|name| self.colours(name))
            }
        };
        let Some(colours) = colours.map(|c| c.map(|c| (c.part, c.index))) else {
            return Ok(None);
        };
        // Check how much memory the picture takes.
        let header = &self.reader.headers()[colours[0].0];
        let size = header.layer_size;
        let mut image = Image {
            width: openexr::side(size.0)?,
            height: openexr::side(size.1)?,
            rgb: Vec::new(),
        };
        let parts = colours.map(|(part, _)| part);
        let blocks = parts.map(|part| block_bytes(&self.reader.headers()[part]));
        let pixels = size.0.saturating_mul(size.1);
        let needed = pixels
            .saturating_mul(PIXEL)
            .saturating_add(blocks.into_iter().max().unwrap_or(0));
        if needed > limit {
            let size = [image.width, image.height];
            return Err(FormatError::too_large(FORMAT, size, needed, limit));
        }
        // Unpack the channels, and convert the colours; luminance has no primaries.
        let to_rec709 = match header.shared_attributes.chromaticities {
            Some(c) if colours[0] != colours[1] => {
                let [r, g, b, w] = [c.red, c.green, c.blue, c.white];
                primaries::to_rec709([r, g, b, w].map(|v| [f64::from(v.0), f64::from(v.1)]))?
            }
            _ => None,
        };
        image.rgb = vec![[0.0; 3]; pixels];
        self.read_into(&mut image.rgb, size.0, colours)?;
        if let Some(matrix) = to_rec709 {
            for pixel in &mut image.rgb {
                *pixel = matrix.apply(*pixel);
            }
        }
        Ok(Some(image))
    }

    /// Unpacks the file block by block, and copies the values of three channels, each given by the
    /// indices of its part and of the channel in it.
    fn read_into(
        self,
        rgb: &mut [[f32; 3]],
        width: usize,
        colours: [(usize, usize); 3],
    ) -> Result<(), FormatError> {
        // Choose the blocks at full resolution of the parts that have the channels.
        let wanted = |part: usize, level: Vec2<usize>| {
            level == Vec2(0, 0) && colours.iter().any(|c| c.0 == part)
        };
        let chunks = self
            .reader
            .filter_chunks(false, |_, _, block| wanted(block.layer, block.level))
            .map_err(|e| openexr::broken(&e))?;
        let meta = exr::block::reader::ChunksReader::meta_data(&chunks).clone();
        for chunk in chunks {
            // Unpack a block.
            let block = chunk.and_then(|chunk| {
                exr::block::UncompressedBlock::decompress_chunk(chunk, &meta, false)
            });
            let block = block.map_err(|e| openexr::broken(&e))?;
            // In a damaged file, the block may be another than its table of offsets says.
            if !wanted(block.index.layer, block.index.level) {
                continue;
            }
            // Copy the rows of the channels.
            let channels = &meta.headers[block.index.layer].channels;
            for line in block.lines(channels) {
                let row_location = line.location;
                let start = row_location.position.1 * width + row_location.position.0;
                let Some(row) = rgb.get_mut(start..start + row_location.sample_count) else {
                    let found = format!("a row of {} at {start}", row_location.sample_count);
                    return Err(FormatError::new(FORMAT, "rows within the picture", found));
                };
                for (k, colour) in colours.iter().enumerate() {
                    if *colour == (row_location.layer, row_location.channel) {
                        let kind = channels.list[row_location.channel].sample_type;
                        copy(row, k, kind, line.value);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns the number of bytes of the largest block of a part, which has all channels of some rows
/// or of a tile.
fn block_bytes(header: &Header) -> usize {
    let Vec2(width, height) = match header.blocks {
        BlockDescription::ScanLines => Vec2(
            header.layer_size.0,
            header.compression.scan_lines_per_block(),
        ),
        BlockDescription::Tiles(tiles) => tiles.tile_size,
    };
    let rows = height.min(header.layer_size.1);
    let columns = width.min(header.layer_size.0);
    columns
        .saturating_mul(rows)
        .saturating_mul(header.channels.bytes_per_pixel)
}

/// Copies a row of a channel, whose bytes are in this machine's order, to component `k` of the
/// pixels.
fn copy(row: &mut [[f32; 3]], k: usize, kind: SampleType, bytes: &[u8]) {
    match kind {
        SampleType::F16 => {
            for (pixel, b) in row.iter_mut().zip(bytes.as_chunks::<2>().0) {
                pixel[k] = f16::from_ne_bytes(*b).to_f32();
            }
        }
        SampleType::F32 => {
            for (pixel, b) in row.iter_mut().zip(bytes.as_chunks::<4>().0) {
                pixel[k] = f32::from_ne_bytes(*b);
            }
        }
        SampleType::U32 => {
            for (pixel, b) in row.iter_mut().zip(bytes.as_chunks::<4>().0) {
                pixel[k] = crate::moments::to_f32(f64::from(u32::from_ne_bytes(*b)));
            }
        }
    }
}
