//! glTF textures: images with sampler and transform.

use super::Reader;
use super::buffers::load_uri;
use super::document::Document;
use super::json::Node;
use crate::diagnostics::{ErrorKind, Result, SceneError};
use linelit_geometry::DVec2;
use linelit_scene::{ImageData, ImageTexture, Texture, TextureFilter, UvMapping, Wrap};
use std::sync::Arc;

/// Pixels, and the name of their file if they have one.
pub(super) type NamedImage = (Arc<ImageData>, String);

/// What a texture is for.
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
}

impl Reader {
    /// A texture; `None` after a warning if it cannot be drawn. All textures of a material share
    /// one set of texture coordinates, which the first names.
    pub(super) fn texture(
        &mut self,
        doc: &Document<'_>,
        info: &Node,
        channel: Channel,
        scale: f64,
        uv_set: &mut Option<usize>,
    ) -> Result<Option<Texture>> {
        let index = doc.require(doc.index(info, "index", "textures")?, info, "index")?;
        let transform = match doc.object(info, "extensions")? {
            Some(extensions) => doc.object(extensions, "KHR_texture_transform")?,
            None => None,
        };
        let mut set = doc.size(info, "texCoord")?.unwrap_or(0);
        if let Some(transform) = transform {
            set = doc.size(transform, "texCoord")?.unwrap_or(set);
        }
        if *uv_set.get_or_insert(set) != set {
            let message =
                "textures of a material with different texture coordinates are not supported";
            let label = "drawn with those of the first";
            self.warn(doc, ErrorKind::Unsupported, message, info, label)?;
        }
        let node = &doc.list("textures")?[index];
        let Some(image) = doc.index(node, "source", "images")? else {
            let message = "a texture without an image that can be read";
            self.warn(doc, ErrorKind::Unsupported, message, node, "left out")?;
            return Ok(None);
        };
        let (wrap, filter) = match doc.index(node, "sampler", "samplers")? {
            Some(sampler) => {
                let sampler = &doc.list("samplers")?[sampler];
                (wraps(doc, sampler)?, filter(doc, sampler)?)
            }
            None => ([Wrap::Repeat; 2], TextureFilter::default()),
        };
        let mapping = match transform {
            Some(transform) => mapping(doc, transform)?,
            None => UvMapping::IDENTITY,
        };
        let data = self.image(doc, image, channel)?;
        Ok(data.map(|(data, filename)| {
            Texture::Image(Arc::new(ImageTexture {
                data,
                mapping,
                wrap,
                filter,
                scale,
                invert: false,
                filename,
            }))
        }))
    }

    /// The pixels of an image, decoded once, and the name of its file if it is the file's own
    /// pixels.
    fn image(
        &mut self,
        doc: &Document<'_>,
        index: usize,
        channel: Channel,
    ) -> Result<Option<NamedImage>> {
        if let Some(known) = self.images.get(&(index, channel)) {
            return Ok(known.clone());
        }
        let image = match channel {
            Channel::Green | Channel::Blue => {
                let component = if channel == Channel::Green { 1 } else { 2 };
                let whole = self.image(doc, index, Channel::Linear)?;
                whole.map(|(image, _)| (Arc::new(image.component(component)), String::new()))
            }
            Channel::Colour | Channel::Linear => {
                self.decode(doc, index, channel == Channel::Colour)?
            }
        };
        self.images.insert((index, channel), image.clone());
        Ok(image)
    }

    fn decode(
        &mut self,
        doc: &Document<'_>,
        index: usize,
        srgb: bool,
    ) -> Result<Option<NamedImage>> {
        let node = &doc.list("images")?[index];
        let at = |e: SceneError, label: &str| e.at(doc.source, node.span, label);
        match self.image_bytes(doc, node) {
            Ok((name, filename, bytes)) => {
                let data = self.base.decode(&name, &bytes, srgb, &at)?;
                Ok(data.map(|data| (data, filename)))
            }
            // A missing image is common; the shapes are still worth seeing.
            Err(error) if error.kind() == ErrorKind::Io => {
                let message = error.message().to_owned();
                self.warn(doc, ErrorKind::Io, &message, node, "left out")?;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// The bytes of an image file, a name that ends in its type, and its file name if it has one.
    fn image_bytes(
        &mut self,
        doc: &Document<'_>,
        node: &Node,
    ) -> Result<(String, String, Vec<u8>)> {
        let by_type = |mime: &str| match mime {
            m if m.contains("image/png") => "image.png".to_owned(),
            m if m.contains("image/jpeg") => "image.jpeg".to_owned(),
            m => {
                let kind = m.split(['/', ';', ',']).nth(1).unwrap_or("unknown");
                format!("image.{kind}")
            }
        };
        if let Some(uri) = doc.string(node, "uri")? {
            let place = doc.require(doc.get(node, "uri"), node, "uri")?;
            let bytes = load_uri(doc, &mut self.base, uri, place)?;
            return Ok(match uri.strip_prefix("data:") {
                Some(data) => (
                    by_type(&data.chars().take(40).collect::<String>()),
                    String::new(),
                    bytes,
                ),
                None => {
                    let name = super::buffers::percent_decode(uri);
                    (name.clone(), name, bytes)
                }
            });
        }
        let mime = doc.string(node, "mimeType")?.unwrap_or("");
        let view = doc.require(doc.index(node, "bufferView", "bufferViews")?, node, "uri")?;
        let view = self.buffers.view(doc, &mut self.base, view)?;
        Ok((by_type(mime), String::new(), view.bytes().to_vec()))
    }
}

/// What lies beyond the edges of an image.
fn wraps(doc: &Document<'_>, sampler: &Node) -> Result<[Wrap; 2]> {
    let wrap = |key: &str| -> Result<Wrap> {
        Ok(match doc.size(sampler, key)? {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        })
    };
    Ok([wrap("wrapS")?, wrap("wrapT")?])
}

/// How an image is looked up where it is smaller than on the screen: `minFilter`, which names the
/// copies too. Where it names none, or nothing (then it is the renderer's choice), the footprint is
/// still averaged. `magFilter` is not asked: magnified images are bilinear.
fn filter(doc: &Document<'_>, sampler: &Node) -> Result<TextureFilter> {
    Ok(match doc.size(sampler, "minFilter")? {
        // NEAREST, NEAREST_MIPMAP_NEAREST, NEAREST_MIPMAP_LINEAR.
        Some(9728 | 9984 | 9986) => TextureFilter::Point,
        // LINEAR_MIPMAP_NEAREST.
        Some(9985) => TextureFilter::Bilinear,
        // LINEAR_MIPMAP_LINEAR.
        Some(9987) => TextureFilter::Trilinear,
        // LINEAR, and what the format does not know.
        Some(_) | None => TextureFilter::default(),
    })
}

/// `KHR_texture_transform`. glTF counts v from the top: the mesh reader turns it over, and the
/// mapping here is the extension's in the turned coordinates.
///
/// With w = 1 − v, u' = o₁ + s₁ u cos r + s₂ v sin r and v' = o₂ − s₁ u sin r + s₂ v cos r become
/// (u', w') = R(r) (s₁ u, s₂ w) + (o₁ + s₂ sin r, 1 − o₂ − s₂ cos r).
fn mapping(doc: &Document<'_>, transform: &Node) -> Result<UvMapping> {
    let [sx, sy] = doc.vector::<2>(transform, "scale")?.unwrap_or([1.0; 2]);
    let [ox, oy] = doc.vector::<2>(transform, "offset")?.unwrap_or([0.0; 2]);
    let rotation = doc.number(transform, "rotation")?.unwrap_or(0.0);
    let (sin, cos) = rotation.sin_cos();
    Ok(UvMapping {
        scale: DVec2::new(sx, sy),
        offset: DVec2::new(ox + sy * sin, 1.0 - oy - sy * cos),
        rotation,
    })
}
