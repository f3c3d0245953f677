//! Films for renderers whose errors are measured: pictures in linear radiance, moments per pixel,
//! and the files in which they are stored.
//!
//! - [`Image`]: a picture of linear radiance in `f32`.
//! - [`Moments`]: count, mean and sum of squared deviations in `f64`, merged by the formula of Chan
//!   in a fixed order.
//! - [`tiles`]: the rectangles into which work on a picture is divided, in a fixed order.
//! - [`Document`]: named layers and metadata, which are read from and written to EXR files.
//! - [`decode_picture`]: the reader of PNG, TGA, EXR, PFM and, with the feature `jpeg`, JPEG files.
//! - [`write_png`] and [`HeatMap`]: pictures for a screen.
//!
//! Every file is written under a temporary name and renamed ([`write_atomically`]); equal contents
//! give equal bytes. Damaged input is an error that says what was expected and found, never a
//! panic. This crate does not know scenes, lights or samples.
//!
//! ```
//! use linelit_film::{Document, Moments};
//!
//! let mut pixel = Moments::default();
//! for radiance in [1.0, 2.0, 6.0] {
//!     pixel.push([radiance; 3]);
//! }
//! let mut document = Document::new(1, 1);
//! document.add_scalar("variance", vec![pixel.variance_of_mean()[0] as f32])?;
//! document.set("seed", 7);
//! let bytes = document.encode()?;
//! assert_eq!(linelit_film::decode_exr(&bytes)?, document);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [guide](https://github.com/linelit/linelit/blob/HEAD/docs/guide.md)
//! leads from one integral to a study of a scene.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod atomic;
mod compression;
mod decode;
mod display;
mod document;
mod error;
mod header_order;
mod image;
#[cfg(feature = "jpeg")]
mod jpeg;
mod moments;
mod openexr;
mod pfm;
mod picture;
mod png;
mod pool;
mod primaries;
mod read;
mod tga;
mod tiles;

pub use atomic::{check_writable, write_atomically, write_atomically_by};
pub use compression::Compression;
pub use decode::{
    ByteImage, DecodeError, Decoded, IntegerImage, Pixels, WordImage, decode_alpha, decode_picture,
};
pub use display::{
    Exposure, HeatMap, encode_png, heat_colour, srgb_decode, srgb_encode, write_png,
};
pub use document::{Channel, Document, Layer, Placement, Samples};
pub use error::{FilmError, FormatError};
pub use image::Image;
pub use moments::Moments;
pub use openexr::decode as decode_exr;
pub use pfm::encode_pfm;
pub use tiles::{Tile, tiles};
