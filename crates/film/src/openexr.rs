//! The bridge to the `exr` crate, whose types stay in here.

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
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{ReadChannels as _, ReadLayers as _, SmallVec};

use crate::compression::Zip;
use crate::document::{Channel, Document, Layer, Placement, Samples};
use crate::{Compression, FilmError, FormatError};
use crate::{header_order, pool};

const PREFIX: &str = "linelit:";
pub(crate) const FORMAT: &str = "OpenEXR";

/// Blocks that each thread packs before what is packed goes into the file.
const BLOCKS_OF_THREAD: usize = 8;

pub(crate) fn encode(document: Document, packing: Compression) -> Result<Vec<u8>, FilmError> {
    let size = Vec2(document.width as usize, document.height as usize);
    let mut channels = SmallVec::new();
    let mut values = 0;
    for layer in document.layers {
        for channel in layer.channels {
            values += channel.samples.len();
            channels.push(encode_channel(&layer.name, channel));
        }
    }
    let mut attributes = LayerAttributes {
        software_name: Some(text("linelit")),
        ..LayerAttributes::default()
    };
    for (name, value) in &document.metadata {
        attributes.other.insert(
            text(&format!("{PREFIX}{name}")),
            AttributeValue::Text(text(value)),
        );
    }
    let mut display = IntegerBounds::from_dimensions(size);
    if let Some(Placement { origin, full }) = document.placement {
        attributes.layer_position = Vec2(origin[0], origin[1]);
        display = IntegerBounds::from_dimensions(Vec2(full[0] as usize, full[1] as usize));
    }
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
    // Rows that do not shrink are stored as they are: 4 bytes a value are the most, and growing
    // would take twice that.
    let mut bytes = Cursor::new(Vec::with_capacity(4 * values));
    exr::block::write(&mut bytes, headers, true, |meta, file| {
        write_blocks(&meta.headers, &rows, file, packing)
    })
    .map_err(|e| FilmError::Invalid(e.to_string()))?;
    let mut bytes = bytes.into_inner();
    header_order::sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Packs all blocks of rows, some at a time on all threads, and writes them in their order.
fn write_blocks(
    headers: &[Header],
    rows: &impl LayersWriter,
    file: &mut impl ChunksWriter,
    packing: Compression,
) -> exr::error::UnitResult {
    // Those that no thread has in its hands: each has much memory, which must not be cleared anew.
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
    let blocks: Vec<_> = enumerate_ordered_header_block_indices(headers).collect();
    for some in blocks.chunks(BLOCKS_OF_THREAD * pool::threads()) {
        for ((place, _), chunk) in some.iter().zip(pool::map(some, pack)) {
            file.write_chunk(*place, chunk?)?;
        }
    }
    Ok(())
}

/// What is not broken by a panic elsewhere.
fn lock(zips: &Mutex<Vec<Zip>>) -> MutexGuard<'_, Vec<Zip>> {
    zips.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A block of rows as it stands in the file, of values in this machine's order. (By `exr`'s own
/// deflate the level could not be chosen.)
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

/// UTF-8, as the format's specification asks for; a zero byte would end a name early.
fn text(string: &str) -> Text {
    let bytes = string
        .bytes()
        .map(|byte| if byte == 0 { b'?' } else { byte });
    Text::from_bytes_unchecked(bytes.collect())
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

pub(crate) fn broken(error: &exr::error::Error) -> FormatError {
    FormatError::new(FORMAT, "a whole file", error.to_string())
}

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

pub(crate) fn decode(bytes: &[u8]) -> Result<Document, FormatError> {
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

type AnyImage = exr::image::FlatImage;

/// Refuses what would not fit our document.
pub(crate) fn check_headers(headers: &[Header]) -> Result<(), FormatError> {
    let first = headers
        .first()
        .ok_or_else(|| FormatError::new(FORMAT, "a part", "none"))?;
    for header in headers {
        if header.deep {
            return Err(FormatError::new(FORMAT, "flat pixels", "deep pixels"));
        }
        if header.layer_size != first.layer_size {
            let found = format!("{:?} and {:?}", first.layer_size, header.layer_size);
            return Err(FormatError::new(FORMAT, "parts of one size", found));
        }
        for channel in &header.channels.list {
            if channel.sampling != Vec2(1, 1) {
                let found = format!("channel `{}` sampled {:?}", channel.name, channel.sampling);
                return Err(FormatError::new(FORMAT, "a value per pixel", found));
            }
        }
    }
    Ok(())
}

/// Refuses sizes that such a short file cannot fill: a damaged header must not make us ask for
/// terabytes.
fn check_memory(headers: &[Header], file_size: usize) -> Result<(), FormatError> {
    let decoded = headers.iter().fold(0_usize, |sum, header| {
        let pixels = header.layer_size.0.saturating_mul(header.layer_size.1);
        sum.saturating_add(pixels.saturating_mul(header.channels.bytes_per_pixel))
    });
    // Deflate shrinks at most 1032 to 1, the others less on real pictures.
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

/// The layer of a channel and its name there: `diffuse.R` is `R` of `diffuse`; in a file of
/// several parts, of `part.diffuse`.
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

fn gather(image: &AnyImage) -> Result<Document, FormatError> {
    let parts = &image.layer_data;
    let first = parts
        .first()
        .ok_or_else(|| FormatError::new(FORMAT, "a part", "none"))?;
    let size = |length: usize| {
        u32::try_from(length)
            .map_err(|_| FormatError::new(FORMAT, "a side below 2³²", length.to_string()))
    };
    let mut document = Document::new(size(first.size.0)?, size(first.size.1)?);
    let display = image.attributes.display_window;
    let position = first.attributes.layer_position;
    if position != display.position || first.size != display.size {
        document.placement = Some(Placement {
            origin: [
                position.0.saturating_sub(display.position.0),
                position.1.saturating_sub(display.position.1),
            ],
            full: [size(display.size.0)?, size(display.size.1)?],
        });
    }
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
    document.layers = layers
        .into_iter()
        .map(|(name, mut channels)| {
            channels.sort_by_key(|channel| usual_position(&channel.name));
            Layer { name, channels }
        })
        .collect();
    Ok(document)
}

/// Red, green, blue, alpha first, whatever else after, stably.
fn usual_position(name: &str) -> usize {
    ["R", "G", "B", "A"]
        .iter()
        .position(|&usual| usual == name)
        .unwrap_or(4)
}

fn decode_samples(samples: &FlatSamples) -> Samples {
    match samples {
        FlatSamples::F16(values) => {
            Samples::Float(values.iter().map(|value| value.to_f32()).collect())
        }
        FlatSamples::F32(values) => Samples::Float(values.clone()),
        FlatSamples::U32(values) => Samples::Count(values.clone()),
    }
}
