//! The reading and writing of [`Document`]s as EXR files by the `exr` crate, whose types occur here
//! and in `picture.rs` only.
//!
//! Files are written with one part, whose channels are named `layer.channel`. Blocks of rows are
//! compressed on all threads and written in order.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::{Mutex, MutexGuard, PoisonError};

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::compression::Compression as Method;
use exr::image::write::layers::{LayersWriter, WritableLayers as _};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{ReadChannels as _, ReadLayers as _, SmallVec};

use crate::compression::Zip;
use crate::document::{Channel, Document, Layer, Placement, Samples};
use crate::{Compression, FilmError, FormatError};
use crate::{header_order, pool};

/// The prefix of the names of attributes that are linelit's metadata.
const PREFIX: &str = "linelit:";
/// The name of the format in messages.
pub(crate) const FORMAT: &str = "OpenEXR";

/// The number of blocks of rows that each thread compresses before all compressed blocks are
/// written to the file.
const BLOCKS_OF_THREAD: usize = 8;

/// Returns the bytes of an EXR file of a document.
pub(crate) fn encode(document: Document, packing: Compression) -> Result<Vec<u8>, FilmError> {
    // Convert the channels.
    let size = Vec2(document.width as usize, document.height as usize);
    let mut channels = SmallVec::new();
    let mut values = 0;
    for layer in document.layers {
        for channel in layer.channels {
            values += channel.samples.len();
            channels.push(encode_channel(&layer.name, channel));
        }
    }
    // Set the attributes. OpenEXR's matrices are by rows for row vectors, which is the same order
    // of numbers as by columns for column vectors.
    let [world_to_camera, world_to_normalized_device] = document.world_to;
    let mut attributes = LayerAttributes {
        software_name: Some(text("linelit")),
        world_to_camera,
        world_to_normalized_device,
        ..LayerAttributes::default()
    };
    for (name, value) in &document.metadata {
        attributes.other.insert(
            text(&format!("{PREFIX}{name}")),
            AttributeValue::Text(text(value)),
        );
    }
    let mut display = IntegerBounds::from_dimensions(size);
    if let Some(Placement {
        origin,
        full,
        corner,
    }) = document.placement
    {
        let at = |k: usize| origin[k].saturating_add(corner[k]);
        attributes.layer_position = Vec2(at(0), at(1));
        let size = Vec2(full[0] as usize, full[1] as usize);
        display = IntegerBounds::new(Vec2(corner[0], corner[1]), size);
    }
    // Write the header and the blocks of rows.
    let compression = match packing {
        Compression::None => Method::Uncompressed,
        Compression::Rle => Method::RLE,
        Compression::Zip(_) => Method::ZIP16,
    };
    let encoding = Encoding {
        compression,
        ..Encoding::UNCOMPRESSED
    };
    let layer = exr::image::Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let headers = layer.infer_headers(&ImageAttributes::new(display));
    let rows = layer.create_writer(&headers);
    // Reserve the memory at once: a file has at most 4 bytes for each value, as rows that do not
    // shrink are stored uncompressed, and growing would take twice as much.
    let mut bytes = Cursor::new(Vec::with_capacity(4 * values));
    exr::block::write(&mut bytes, headers, true, |meta, file| {
        write_blocks(&meta.headers, &rows, file, packing)
    })
    .map_err(|e| FilmError::Invalid(e.to_string()))?;
    let mut bytes = bytes.into_inner();
    header_order::sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Compresses all blocks of rows, some at a time on all threads, and writes them in their order.
fn write_blocks(
    headers: &[Header],
    rows: &impl LayersWriter,
    file: &mut impl ChunksWriter,
    packing: Compression,
) -> exr::error::UnitResult {
    // A list of the compressors that no thread is using: each has much memory, and making a new one
    // for each block would clear it every time.
    let zips = Mutex::new(Vec::new());
    let pack = |&(_, index): &(usize, BlockIndex)| {
        let data = rows.extract_uncompressed_block(headers, index);
        let Compression::Zip(level) = packing else {
            return UncompressedBlock { index, data }.compress_to_chunk(headers);
        };
        let free = lock(&zips).pop();
        let mut zip = free.unwrap_or_else(|| Zip::new(level));
        let chunk = zip_chunk(headers, index, data, &mut zip);
        lock(&zips).push(zip);
        chunk
    };
    // Compress some blocks on all threads, then write them.
    let blocks: Vec<_> = enumerate_ordered_header_block_indices(headers).collect();
    for some in blocks.chunks(BLOCKS_OF_THREAD * pool::threads()) {
        for ((place, _), chunk) in some.iter().zip(pool::map(some, pack)) {
            file.write_chunk(*place, chunk?)?;
        }
    }
    Ok(())
}

/// Locks the list of compressors, also after a panic in another thread.
fn lock(zips: &Mutex<Vec<Zip>>) -> MutexGuard<'_, Vec<Zip>> {
    zips.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the block of rows in the file for `data`, whose values are in this machine's byte order.
/// (With the compressor of the `exr` crate, the level could not be chosen.)
fn zip_chunk(
    headers: &[Header],
    index: BlockIndex,
    mut data: Vec<u8>,
    zip: &mut Zip,
) -> exr::error::Result<Chunk> {
    for value in data.as_chunks_mut::<4>().0 {
        *value = u32::from_ne_bytes(*value).to_le_bytes();
    }
    let first_row = i32::try_from(index.pixel_position.1)
        .map_err(|_| exr::error::Error::Invalid("more than 2³¹ rows".into()))?;
    Ok(Chunk {
        layer_index: index.layer,
        compressed_block: CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: first_row + headers[index.layer].own_attributes.layer_position.1,
            compressed_pixels_le: zip.pack(data),
        }),
    })
}

/// Returns a channel for the `exr` crate, whose name begins with the layer's.
fn encode_channel(layer: &str, channel: Channel) -> AnyChannel<FlatSamples> {
    let name = if layer.is_empty() {
        channel.name
    } else {
        format!("{layer}.{}", channel.name)
    };
    let samples = match channel.samples {
        Samples::Float(values) => FlatSamples::F32(values),
        Samples::Count(values) => FlatSamples::U32(values),
    };
    AnyChannel::new(text(&name), samples)
}

/// Returns a text in UTF-8, as the format's specification demands. Zero bytes, which would end a
/// name, are replaced.
fn text(string: &str) -> Text {
    let bytes = string
        .bytes()
        .map(|byte| if byte == 0 { b'?' } else { byte });
    Text::from_bytes_unchecked(bytes.collect())
}

/// Returns a text of a file as a string; bytes that are not UTF-8 are replaced.
fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Returns the error for a file that the `exr` crate cannot read.
pub(crate) fn broken(error: &exr::error::Error) -> FormatError {
    FormatError::new(FORMAT, "a whole file", error.to_string())
}

/// Refuses bytes that do not begin as an EXR file does.
pub(crate) fn check_magic(bytes: &[u8]) -> Result<(), FormatError> {
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Ok(());
    }
    let found = format!("another file of {} bytes", bytes.len());
    Err(FormatError::new(
        FORMAT,
        "the magic number [76, 2f, 31, 01]",
        found,
    ))
}

/// Reads a document from the bytes of an EXR file.
///
/// # Errors
/// The bytes are not an EXR file, the file is damaged, or it has a feature that is not supported
/// (deep pixels, subsampled channels, parts with different sizes or positions).
pub fn decode(bytes: &[u8]) -> Result<Document, FormatError> {
    check_magic(bytes)?;
    let chunks = exr::block::read(Cursor::new(bytes), false).map_err(|e| broken(&e))?;
    check_headers(chunks.headers())?;
    check_memory(chunks.headers(), bytes.len())?;
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(|e| broken(&e))?;
    gather(&image)
}

/// The `exr` crate's image with any layers and channels.
type AnyImage = exr::image::FlatImage;

/// The largest size, in bytes, of a tile that is larger than the picture; files with larger tiles
/// are refused.
const MOST_OF_A_TILE: usize = 1 << 26;

/// Refuses files with features that a [`Document`] cannot have, and tiles that are far too large.
pub(crate) fn check_headers(headers: &[Header]) -> Result<(), FormatError> {
    let first = headers
        .first()
        .ok_or_else(|| FormatError::new(FORMAT, "a part", "none"))?;
    for header in headers {
        // Check that the pixels are flat, and that all parts have one size and one position.
        if header.deep {
            return Err(FormatError::new(FORMAT, "flat pixels", "deep pixels"));
        }
        if header.layer_size != first.layer_size {
            let found = format!("{:?} and {:?}", first.layer_size, header.layer_size);
            return Err(FormatError::new(FORMAT, "parts of one size", found));
        }
        let positions = [first, header].map(|part| part.own_attributes.layer_position);
        if positions[0] != positions[1] {
            let found = format!("{:?} and {:?}", positions[0], positions[1]);
            return Err(FormatError::new(FORMAT, "parts at one place", found));
        }
        // Limit the size of tiles, as the `exr` crate allocates memory for the largest block. A
        // tile may be larger than a small picture, but not by much.
        if let BlockDescription::Tiles(tiles) = header.blocks {
            let Vec2(width, height) = tiles.tile_size;
            let pixels = width.saturating_mul(height);
            let bytes = pixels.saturating_mul(header.channels.bytes_per_pixel);
            let fits = width <= header.layer_size.0 && height <= header.layer_size.1;
            if !fits && bytes > MOST_OF_A_TILE {
                let found = format!("{width} × {height}");
                return Err(FormatError::new(FORMAT, "tiles within the picture", found));
            }
        }
        // Check that each channel has a value for each pixel.
        for channel in &header.channels.list {
            if channel.sampling != Vec2(1, 1) {
                let found = format!("channel `{}` sampled {:?}", channel.name, channel.sampling);
                return Err(FormatError::new(FORMAT, "a value per pixel", found));
            }
        }
    }
    Ok(())
}

/// Refuses sizes for which the file is much too short, so that a damaged header does not lead to
/// the allocation of terabytes.
fn check_memory(headers: &[Header], file_size: usize) -> Result<(), FormatError> {
    let decoded = headers.iter().fold(0_usize, |sum, header| {
        let pixels = header.layer_size.0.saturating_mul(header.layer_size.1);
        sum.saturating_add(pixels.saturating_mul(header.channels.bytes_per_pixel))
    });
    // Deflate shrinks data by a factor of at most 1032, and other methods by less on real pictures.
    let limit = file_size.saturating_mul(2000).max(1 << 20);
    if decoded > limit {
        return Err(FormatError::new(
            FORMAT,
            format!("at most {limit} bytes of pixels in a file of {file_size} bytes"),
            format!("{decoded} bytes"),
        ));
    }
    Ok(())
}

/// Returns the layer of a channel, and its name in that layer: `diffuse.R` is the channel `R` of
/// the layer `diffuse`. In a file with several parts, the layer is `part.diffuse`.
pub(crate) fn layer_and_name(
    part: Option<&Text>,
    channel: &Text,
    several: bool,
) -> (String, String) {
    let part_name = part.filter(|_| several).map_or_else(String::new, string);
    let full = string(channel);
    let (group, name) = full.rsplit_once('.').unwrap_or(("", &full));
    let layer = match (part_name.is_empty(), group.is_empty()) {
        (true, _) => group.to_owned(),
        (false, true) => part_name,
        (false, false) => format!("{part_name}.{group}"),
    };
    (layer, name.to_owned())
}

/// Returns the layer that is the picture of a file. `channels` has the layer and the name of each
/// channel.
///
/// The picture is the layer without a name if that has colour (`R`, `G`, `B`) or luminance (`Y`);
/// otherwise the layer `estimate` if that has; otherwise the only layer with colour; otherwise the
/// layer of the only channel, if that is not a depth. `None` if there is no such layer or several
/// could be the picture.
pub(crate) fn main_layer<'a>(channels: &[(&'a str, &'a str)]) -> Option<&'a str> {
    let has = |layer: &str, name: &str| channels.contains(&(layer, name));
    let has_colour = |layer: &str| ["R", "G", "B"].iter().all(|name| has(layer, name));
    // Look for the usual names.
    let usual = ["", "estimate"].into_iter();
    if let Some(usual) = usual
        .clone()
        .find(|layer| has_colour(layer) || has(layer, "Y"))
    {
        return Some(usual);
    }
    // Look for a single layer with colour, or a single channel.
    let reds = channels.iter().filter(|(_, name)| *name == "R");
    let mut coloured = reds
        .map(|(layer, _)| *layer)
        .filter(|layer| has_colour(layer));
    match (coloured.next(), coloured.next(), channels) {
        (Some(only), None, _) => Some(only),
        (None, _, &[(layer, name)]) => {
            let words = layer.split('.').chain([name]);
            let is_depth = |word: &str| {
                let depths = ["z", "zback", "depth"].iter();
                depths.clone().any(|depth| word.eq_ignore_ascii_case(depth))
            };
            (!words.into_iter().any(is_depth)).then_some(layer)
        }
        _ => None,
    }
}

/// Returns the position of the pixels of a part in the full picture; `None` if they are all of it.
/// `position` and `size` are the data window, and `display` is the display window.
pub(crate) fn placement(
    position: Vec2<i32>,
    size: Vec2<usize>,
    display: IntegerBounds,
) -> Result<Option<Placement>, FormatError> {
    if position == Vec2(0, 0) && display == IntegerBounds::from_dimensions(size) {
        return Ok(None);
    }
    let corner = display.position;
    Ok(Some(Placement {
        origin: [
            position.0.saturating_sub(corner.0),
            position.1.saturating_sub(corner.1),
        ],
        full: [side(display.size.0)?, side(display.size.1)?],
        corner: [corner.0, corner.1],
    }))
}

/// Returns the number of pixels along a side of a picture.
pub(crate) fn side(length: usize) -> Result<u32, FormatError> {
    u32::try_from(length)
        .map_err(|_| FormatError::new(FORMAT, "a side below 2³²", length.to_string()))
}

/// Converts an image of the `exr` crate to a document.
fn gather(image: &AnyImage) -> Result<Document, FormatError> {
    // Take size, position and matrices from the first part.
    let parts = &image.layer_data;
    let first = parts
        .first()
        .ok_or_else(|| FormatError::new(FORMAT, "a part", "none"))?;
    let mut document = Document::new(side(first.size.0)?, side(first.size.1)?);
    let (position, display) = (
        first.attributes.layer_position,
        image.attributes.display_window,
    );
    document.placement = placement(position, first.size, display)?;
    let own = &first.attributes;
    document.world_to = [own.world_to_camera, own.world_to_normalized_device];
    // Collect the channels of each layer, and the metadata.
    let mut layers: BTreeMap<String, Vec<Channel>> = BTreeMap::new();
    for part in parts {
        let part_name = part.attributes.layer_name.as_ref();
        for channel in &part.channel_data.list {
            let (layer, name) = layer_and_name(part_name, &channel.name, parts.len() > 1);
            layers.entry(layer).or_default().push(Channel {
                name,
                samples: decode_samples(&channel.sample_data),
            });
        }
        for (name, value) in &part.attributes.other {
            if let (Some(name), AttributeValue::Text(value)) =
                (string(name).strip_prefix(PREFIX), value)
            {
                document.metadata.insert(name.to_owned(), string(value));
            }
        }
    }
    // Put the channels in their usual order.
    document.layers = layers
        .into_iter()
        .map(|(name, mut channels)| {
            channels.sort_by_key(|channel| usual_position(&channel.name));
            Layer { name, channels }
        })
        .collect();
    Ok(document)
}

/// Returns the rank by which channels are sorted: red, green, blue and alpha come first, and others
/// after them in the order of the file.
fn usual_position(name: &str) -> usize {
    ["R", "G", "B", "A"]
        .iter()
        .position(|&usual| usual == name)
        .unwrap_or(4)
}

/// Converts the values of a channel.
fn decode_samples(samples: &FlatSamples) -> Samples {
    match samples {
        FlatSamples::F16(values) => {
            Samples::Float(values.iter().map(|value| value.to_f32()).collect())
        }
        FlatSamples::F32(values) => Samples::Float(values.clone()),
        FlatSamples::U32(values) => Samples::Count(values.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_no_picture_and_of_several_layers_none_is_guessed() {
        for (channels, want) in [
            ("R G B", Some("")),
            ("A B G R Z", Some("")),
            ("Y Z", Some("")),
            ("Y", Some("")),
            // A single channel that is not a depth is grey.
            ("R", Some("")),
            ("a.V", Some("a")),
            // The unnamed layer goes before all others, and `estimate` before the rest.
            ("R G B diffuse.R diffuse.G diffuse.B", Some("")),
            ("estimate.Y a.R a.G a.B", Some("estimate")),
            (
                "estimate.R estimate.G estimate.B a.R a.G a.B",
                Some("estimate"),
            ),
            // The only one with colour.
            ("Z diffuse.R diffuse.G diffuse.B", Some("diffuse")),
            (
                "View.Depth.Z View.Combined.R View.Combined.G View.Combined.B",
                Some("View.Combined"),
            ),
            ("R a.R a.G a.B", Some("a")),
            // Depth, by any of its names, and channels that are not a colour.
            ("Z", None),
            ("zback", None),
            ("depth.Y", None),
            ("View.Depth.V", None),
            ("Z A", None),
            ("normal.X normal.Y normal.Z", None),
            ("R G", None),
            ("", None),
            // Several: both eyes of a pair, and the passes of a renderer.
            ("left.R left.G left.B right.R right.G right.B", None),
            ("Z a.R a.G a.B b.R b.G b.B", None),
        ] {
            let split = |full: &'static str| full.rsplit_once('.').unwrap_or(("", full));
            let channels: Vec<_> = channels.split_whitespace().map(split).collect();
            assert_eq!(main_layer(&channels), want, "{channels:?}");
        }
    }
}
