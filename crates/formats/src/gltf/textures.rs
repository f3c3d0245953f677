//! glTF textures: images with sampler and transform.

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

/// `KHR_texture_transform`, which gltf has in `f32` and for some textures only.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transform {
    offset: [f64; 2],
    rotation: f64,
    scale: Option<[f64; 2]>,
    tex_coord: Option<u32>,
}

/// The channel that a texture is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    /// sRGB-encoded colour.
    Colour,
    /// Three linear numbers.
    Linear,
    /// The second of three linear numbers.
    Green,
    /// The third.
    Blue,
    /// The coverage of the surface, if the image has an alpha channel.
    Alpha,
}

impl<'a> Reader<'a> {
    /// A texture; `None` after a warning if it cannot be drawn. All textures of a material share
    /// one set of texture coordinates, which the first names.
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
        let set = transform.as_ref().and_then(|t| t.tex_coord);
        let set = set.unwrap_or(info.tex_coord);
        if *uv_set.get_or_insert(set) != set {
            let message =
                "textures of a material with different texture coordinates are not supported";
            let label = "drawn with those of the first";
            self.base.unsupported(message, label, doc.at(named))?;
        }
        let node: JsonTexture = doc.read(raw)?;
        let image = node.source.value();
        // What gltf has for none.
        if image == u32::MAX as usize {
            let message = "a texture without an image that can be read";
            self.base.unsupported(message, "left out", doc.at(raw))?;
            return Ok(None);
        }
        doc.element(List::Images, image, raw, "source")?;
        let (wrap, filter) = match node.sampler {
            Some(index) => {
                let sampler = doc.element(List::Samplers, index.value(), raw, "sampler")?;
                let sampler: Sampler = doc.read(sampler)?;
                ([sampler.wrap_s, sampler.wrap_t].map(wrap), filter(&sampler))
            }
            None => ([Wrap::Repeat; 2], TextureFilter::default()),
        };
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

    /// The pixels of an image, decoded once.
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

    fn decode(&mut self, index: usize, srgb: bool) -> Result<Option<Arc<ImageData>>> {
        let raw = self.doc.known(List::Images, index);
        let at = self.doc.at(raw);
        match self.image_bytes(raw) {
            Ok((name, bytes)) => self.base.decode(&name, &bytes, srgb, at),
            // A missing image is common; the shapes are still worth seeing.
            Err(error) if error.kind() == ErrorKind::Io => {
                self.base
                    .warn(ErrorKind::Io, error.message(), "left out", at)?;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Returns the alpha channel of an image; if it cannot be read, its colour reports the error.
    fn alpha_channel(&mut self, index: usize) -> Result<Option<Arc<ImageData>>> {
        let raw = self.doc.known(List::Images, index);
        let at = self.doc.at(raw);
        let Ok((name, bytes)) = self.image_bytes(raw) else {
            return Ok(None);
        };
        self.base.alpha_channel(&name, &bytes, at)
    }

    /// A name of an image file that ends in its type, and its bytes.
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
        if let Some(uri) = &node.uri {
            let bytes = self.load_uri(uri, doc.find(raw, &["uri"]))?;
            let name = match uri.strip_prefix("data:") {
                Some(data) => by_type(&data.chars().take(40).collect::<String>()),
                None => percent_decode(uri),
            };
            return Ok((name, bytes));
        }
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

/// Returns the filter for images that are minified: `minFilter`, which names the mip levels too.
/// Where it names none, or is missing (then it is the renderer's choice), the footprint is still
/// averaged. `magFilter` is ignored: magnified images are bilinear.
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

/// `KHR_texture_transform`. glTF counts v from the top: the mesh reader turns it over, and the
/// mapping here is the extension's in the turned coordinates.
///
/// With w = 1 − v, u' = o₁ + s₁ u cos r + s₂ v sin r and v' = o₂ − s₁ u sin r + s₂ v cos r become
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
