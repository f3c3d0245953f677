//! The textures of glTF: images with a sampler and a transform of their coordinates.

use super::Reader;
use super::buffers::percent_decode;
use super::document::{List, Raw};
use gltf::json::image;
use gltf::json::texture::{MinFilter, Sampler, Texture as JsonTexture, WrappingMode};
use gltf::json::validation::Checked;
use linelit_assembly::{ErrorKind, Result};
use linelit_elementary::sin_cos;
use linelit_geometry::DVec2;
use linelit_scene::{ImageData, ImageTexture, Texture, TextureFilter, UvMapping, Wrap};
use serde::Deserialize;
use std::collections::HashMap;
use std::sync::Arc;

/// A material's reference to a texture.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Info<'a> {
    index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(borrow, default)]
    extensions: HashMap<String, Raw<'a>>,
}

/// The extension `KHR_texture_transform`, which the crate gltf has in `f32` and for some textures
/// only.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transform {
    offset: [f64; 2],
    rotation: f64,
    scale: Option<[f64; 2]>,
    tex_coord: Option<u32>,
}

/// The channel of an image that a texture uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    /// A colour that is sRGB-encoded.
    Colour,
    /// Three linear numbers.
    Linear,
    /// The second of three linear numbers.
    Green,
    /// The third of three linear numbers.
    Blue,
    /// The alpha channel, if the image has one.
    Alpha,
}

impl<'a> Reader<'a> {
    /// Reads a texture, to which the object `named` refers; `None`, after a warning, if it has no
    /// image that can be read. All textures of a material use the same set of texture coordinates,
    /// the set of the first one, which `uv_set` remembers.
    pub(super) fn texture(
        &mut self,
        named: Raw<'a>,
        channel: Channel,
        scale: f64,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<Texture>> {
        let doc = self.doc;
        let info: Info<'a> = doc.read(named)?;
        let raw = doc.element(List::Textures, info.index, named, "index")?;
        let transform = info.extensions.get("KHR_texture_transform");
        let transform: Option<Transform> = transform.map(|t| doc.read(t)).transpose()?;
        // Check the set of texture coordinates, in place of which the transform may have another.
        let set = transform.as_ref().and_then(|t| t.tex_coord);
        let set = set.unwrap_or(info.tex_coord);
        if *uv_set.get_or_insert(set) != set {
            let message =
                "textures of a material with different texture coordinates are not supported";
            let label = "drawn with those of the first";
            self.base.unsupported(message, label, doc.at(named))?;
        }
        // Find the image. The crate gltf has the largest number for a missing one.
        let node: JsonTexture = doc.read(raw)?;
        let image = node.source.value();
        if image == u32::MAX as usize {
            let message = "a texture without an image that can be read";
            self.base.unsupported(message, "left out", doc.at(raw))?;
            return Ok(None);
        }
        doc.element(List::Images, image, raw, "source")?;
        // Read the sampler.
        let (wrap, filter) = match node.sampler {
            Some(index) => {
                let sampler = doc.element(List::Samplers, index.value(), raw, "sampler")?;
                let sampler: Sampler = doc.read(sampler)?;
                ([sampler.wrap_s, sampler.wrap_t].map(wrap), filter(&sampler))
            }
            None => ([Wrap::Repeat; 2], TextureFilter::default()),
        };
        // Load the image.
        let mapping = transform.map_or(UvMapping::IDENTITY, |t| mapping(&t));
        let data = self.image(image, channel)?;
        Ok(data.map(|data| {
            Texture::Image(Arc::new(ImageTexture {
                mapping,
                wrap,
                filter,
                scale,
                ..ImageTexture::new(data)
            }))
        }))
    }

    /// Returns a channel of an image, which is decoded once.
    fn image(&mut self, index: usize, channel: Channel) -> Result<Option<Arc<ImageData>>> {
        if let Some(known) = self.images.get(&(index, channel)) {
            return Ok(known.clone());
        }
        let image = match channel {
            Channel::Green | Channel::Blue => {
                let component = if channel == Channel::Green { 1 } else { 2 };
                let whole = self.image(index, Channel::Linear)?;
                whole.map(|image| Arc::new(image.component(component)))
            }
            Channel::Colour | Channel::Linear => self.decode(index, channel == Channel::Colour)?,
            Channel::Alpha => self.alpha_channel(index)?,
        };
        self.images.insert((index, channel), image.clone());
        Ok(image)
    }

    /// Decodes an image; a missing file is a warning.
    fn decode(&mut self, index: usize, srgb: bool) -> Result<Option<Arc<ImageData>>> {
        let raw = self.doc.known(List::Images, index);
        let at = self.doc.at(raw);
        match self.image_bytes(raw) {
            Ok((name, bytes)) => self.base.decode(&name, &bytes, srgb, at),
            // Only warn about missing images, which are common.
            Err(error) if error.kind() == ErrorKind::Io => {
                self.base
                    .warn(ErrorKind::Io, error.message(), "left out", at)?;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Decodes the alpha channel of an image. If it cannot be read, the reading of its colours
    /// reports the error.
    fn alpha_channel(&mut self, index: usize) -> Result<Option<Arc<ImageData>>> {
        let raw = self.doc.known(List::Images, index);
        let at = self.doc.at(raw);
        let Ok((name, bytes)) = self.image_bytes(raw) else {
            return Ok(None);
        };
        self.base.alpha_channel(&name, &bytes, at)
    }

    /// Returns the bytes of an image file, and a name whose extension is the type of the file.
    fn image_bytes(&mut self, raw: Raw<'a>) -> Result<(String, Vec<u8>)> {
        let doc = self.doc;
        let node: image::Image = doc.read(raw)?;
        let by_type = |mime: &str| match mime {
            m if m.contains("image/png") => "image.png".to_owned(),
            m if m.contains("image/jpeg") => "image.jpeg".to_owned(),
            m => {
                let kind = m.split(['/', ';', ',']).nth(1).unwrap_or("unknown");
                format!("image.{kind}")
            }
        };
        // Load a file or a data URI.
        if let Some(uri) = &node.uri {
            let bytes = self.load_uri(uri, doc.find(raw, &["uri"]))?;
            let name = match uri.strip_prefix("data:") {
                Some(data) => by_type(&data.chars().take(40).collect::<String>()),
                None => percent_decode(uri),
            };
            return Ok((name, bytes));
        }
        // Take a part of a buffer.
        let mime = node.mime_type.as_ref().map_or("", |mime| &mime.0);
        let index = doc.require(node.buffer_view, raw, "uri")?.value();
        let view = doc.element(List::BufferViews, index, raw, "bufferView")?;
        let view = self.view(view)?;
        Ok((by_type(mime), view.bytes().to_vec()))
    }
}

/// Returns the wrap mode of a sampler.
const fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

/// Returns the filter for minified images, from `minFilter`, which also says how mip levels are
/// used. If `minFilter` uses no mip levels, or is missing (which leaves the choice to the
/// renderer), images are averaged over the footprint by the default filter. `magFilter` is ignored:
/// magnified images are bilinear.
fn filter(sampler: &Sampler) -> TextureFilter {
    match sampler.min_filter {
        Some(Checked::Valid(
            MinFilter::Nearest | MinFilter::NearestMipmapNearest | MinFilter::NearestMipmapLinear,
        )) => TextureFilter::Point,
        Some(Checked::Valid(MinFilter::LinearMipmapNearest)) => TextureFilter::Bilinear,
        Some(Checked::Valid(MinFilter::LinearMipmapLinear)) => TextureFilter::Trilinear,
        Some(Checked::Valid(MinFilter::Linear) | Checked::Invalid) | None => {
            TextureFilter::default()
        }
    }
}

/// Returns the mapping of `KHR_texture_transform`. glTF counts v from the top; the mesh reader
/// replaces it by w = 1 − v, and the result here is the extension's mapping in these coordinates.
///
/// The extension's u' = o₁ + s₁ u cos r + s₂ v sin r and v' = o₂ − s₁ u sin r + s₂ v cos r become
/// (u', w') = R(r) (s₁ u, s₂ w) + (o₁ + s₂ sin r, 1 − o₂ − s₂ cos r).
fn mapping(transform: &Transform) -> UvMapping {
    let [sx, sy] = transform.scale.unwrap_or([1.0; 2]);
    let [ox, oy] = transform.offset;
    let (sin, cos) = sin_cos(transform.rotation);
    UvMapping {
        scale: DVec2::new(sx, sy),
        offset: DVec2::new(ox + sy * sin, 1.0 - oy - sy * cos),
        rotation: transform.rotation,
    }
}
