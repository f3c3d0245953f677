//! glTF materials.
//!
//! Metallic–roughness becomes a `substrate` with 4 % reflectance at normal incidence, a coloured
//! conductor, or their mixture, with α = roughness².

use super::Reader;
use super::buffers::load_uri;
use super::document::Document;
use super::json::Node;
use crate::error::{ErrorKind, Result, SceneError};
use crate::material::{Material, MaterialKind, Remap, Roughness};
use crate::texture::{ImageTexture, Texture, UvMapping, Wrap};
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// A material of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub(super) index: u32,
    /// Emitted radiance, if any.
    pub(super) emission: Option<DVec3>,
    pub(super) two_sided: bool,
}

impl Reader {
    pub(super) fn read_materials(&mut self, doc: &Document<'_>) -> Result<()> {
        for node in doc.list("materials")? {
            let entry = self.material(doc, node)?;
            self.materials.push(entry);
        }
        Ok(())
    }

    fn material(&mut self, doc: &Document<'_>, node: &Node) -> Result<Entry> {
        let name = doc
            .get(node, "name")
            .and(doc.string(node, "name").ok().flatten());
        let name = name.unwrap_or("material").to_owned();
        let pbr = doc.object(node, "pbrMetallicRoughness")?;
        let (mut colour, mut metallic, mut roughness) = (Texture::number(1.0), 1.0, 1.0);
        if let Some(pbr) = pbr {
            let factor = doc.vector::<4>(pbr, "baseColorFactor")?.unwrap_or([1.0; 4]);
            let factor = self.colour(doc, pbr, [factor[0], factor[1], factor[2]])?;
            colour = Texture::Constant(factor);
            if let Some(info) = doc.object(pbr, "baseColorTexture")?
                && let Some(texture) = self.texture(doc, info)?
            {
                colour = if factor == DVec3::ONE {
                    texture
                } else {
                    Texture::Product(Arc::new(texture), Arc::new(colour))
                };
            }
            metallic = doc
                .number(pbr, "metallicFactor")?
                .unwrap_or(1.0)
                .clamp(0.0, 1.0);
            roughness = doc
                .number(pbr, "roughnessFactor")?
                .unwrap_or(1.0)
                .clamp(0.0, 1.0);
            if let Some(info) = doc.get(pbr, "metallicRoughnessTexture") {
                let message = "`metallicRoughnessTexture` is not supported";
                self.warn(doc, ErrorKind::Unsupported, message, info, "left out")?;
            }
        }
        for key in ["normalTexture", "occlusionTexture"] {
            if let Some(info) = doc.get(node, key) {
                let message = format!("`{key}` is not supported");
                self.warn(doc, ErrorKind::Unsupported, &message, info, "left out")?;
            }
        }
        if let Some(mode) = doc.get(node, "alphaMode")
            && doc.string(node, "alphaMode")? != Some("OPAQUE")
        {
            let message = "transparency is not supported: shapes are opaque";
            self.warn(doc, ErrorKind::Unsupported, message, mode, "ignored")?;
        }
        let alpha = Roughness::isotropic(roughness * roughness, Remap::None);
        Ok(Entry {
            index: self.metallic_roughness(name, colour, metallic, alpha),
            emission: self.emission(doc, node)?,
            two_sided: doc.bool(node, "doubleSided")?,
        })
    }

    fn metallic_roughness(
        &mut self,
        name: String,
        colour: Texture,
        metallic: f64,
        roughness: Roughness,
    ) -> u32 {
        let conductor = MaterialKind::ColoredConductor {
            reflectance: colour.clone(),
            roughness: roughness.clone(),
        };
        let substrate = MaterialKind::Substrate {
            kd: colour,
            ks: Texture::number(0.04),
            roughness,
        };
        let mut add = |kind| {
            self.base.builder.add_material(Material {
                name: name.clone(),
                kind,
                bump: None,
                normal_map: None,
            })
        };
        if metallic <= 0.0 {
            return add(substrate);
        }
        if metallic >= 1.0 {
            return add(conductor);
        }
        let materials = [add(substrate), add(conductor)];
        add(MaterialKind::Mix {
            materials,
            amount: Texture::number(metallic),
        })
    }

    /// A colour without negative parts.
    fn colour(&self, doc: &Document<'_>, node: &Node, rgb: [f64; 3]) -> Result<DVec3> {
        let rgb = DVec3::from_array(rgb);
        if rgb.min_element() >= 0.0 {
            return Ok(rgb);
        }
        Err(doc.error(
            ErrorKind::OutOfRange,
            "a negative colour",
            node,
            "must not be negative",
        ))
    }

    fn emission(&mut self, doc: &Document<'_>, node: &Node) -> Result<Option<DVec3>> {
        let factor = doc.vector::<3>(node, "emissiveFactor")?.unwrap_or_default();
        let mut radiance = self.colour(doc, node, factor)?;
        if let Some(extensions) = doc.object(node, "extensions")?
            && let Some(extension) = doc.object(extensions, "KHR_materials_emissive_strength")?
        {
            radiance *= doc
                .number(extension, "emissiveStrength")?
                .unwrap_or(1.0)
                .max(0.0);
        }
        if let Some(info) = doc.get(node, "emissiveTexture")
            && radiance != DVec3::ZERO
        {
            let message = "textured emission is not supported";
            self.warn(
                doc,
                ErrorKind::Unsupported,
                message,
                info,
                "emits `emissiveFactor` everywhere",
            )?;
        }
        Ok((radiance != DVec3::ZERO).then_some(radiance))
    }

    /// A texture; `None` after a warning if it cannot be drawn.
    fn texture(&mut self, doc: &Document<'_>, info: &Node) -> Result<Option<Texture>> {
        let index = doc.require(doc.index(info, "index", "textures")?, info, "index")?;
        if doc.size(info, "texCoord")?.unwrap_or(0) != 0 {
            let message = "only the first set of texture coordinates is supported";
            self.warn(
                doc,
                ErrorKind::Unsupported,
                message,
                info,
                "drawn with the first",
            )?;
        }
        let node = &doc.list("textures")?[index];
        let Some(image) = doc.index(node, "source", "images")? else {
            let message = "a texture without an image";
            self.warn(doc, ErrorKind::Unsupported, message, node, "left out")?;
            return Ok(None);
        };
        let wrap = match doc.index(node, "sampler", "samplers")? {
            Some(sampler) => match doc.size(&doc.list("samplers")?[sampler], "wrapS")? {
                Some(33071) => Wrap::Clamp,
                _ => Wrap::Repeat,
            },
            None => Wrap::Repeat,
        };
        let mapping = self.mapping(doc, info)?;
        let image_node = &doc.list("images")?[image];
        let (name, bytes) = self.image_bytes(doc, image_node)?;
        let at = |e: SceneError, label: &str| e.at(doc.source, image_node.span, label);
        let data = self.base.decode(&name, &bytes, true, &at)?;
        Ok(data.map(|data| {
            Texture::Image(Arc::new(ImageTexture {
                data,
                mapping,
                wrap,
                scale: 1.0,
                invert: false,
                filename: name,
            }))
        }))
    }

    /// glTF counts v from the top: the mesh reader turns it over, and the mapping here is that of
    /// `KHR_texture_transform` in the turned coordinates.
    fn mapping(&mut self, doc: &Document<'_>, info: &Node) -> Result<UvMapping> {
        let extensions = doc.object(info, "extensions")?;
        let extension = match extensions {
            Some(e) => doc.object(e, "KHR_texture_transform")?,
            None => None,
        };
        let Some(extension) = extension else {
            return Ok(UvMapping::IDENTITY);
        };
        let [sx, sy] = doc.vector::<2>(extension, "scale")?.unwrap_or([1.0; 2]);
        let [ox, oy] = doc.vector::<2>(extension, "offset")?.unwrap_or([0.0; 2]);
        if doc.number(extension, "rotation")?.is_some_and(|r| r != 0.0) {
            let message = "rotated textures are not supported";
            self.warn(
                doc,
                ErrorKind::Unsupported,
                message,
                extension,
                "drawn unrotated",
            )?;
        }
        // v' = oy + sy v with v counted from the top is 1 − oy − sy + sy v from the bottom.
        Ok(UvMapping {
            scale: DVec2::new(sx, sy),
            offset: DVec2::new(ox, 1.0 - oy - sy),
        })
    }

    /// The bytes of an image file and a name that ends in its type.
    fn image_bytes(&mut self, doc: &Document<'_>, node: &Node) -> Result<(String, Vec<u8>)> {
        let mime = doc.string(node, "mimeType")?.unwrap_or("");
        let by_mime = |data: &str| match data {
            m if m.contains("image/png") => "image.png".to_owned(),
            m if m.contains("image/jpeg") => "image.jpeg".to_owned(),
            _ => "image".to_owned(),
        };
        if let Some(uri) = doc.string(node, "uri")? {
            let place = doc.require(doc.get(node, "uri"), node, "uri")?;
            let bytes = load_uri(doc, &self.base, uri, place)?;
            let name = match uri.strip_prefix("data:") {
                Some(data) => by_mime(&data.chars().take(40).collect::<String>()),
                None => uri.to_owned(),
            };
            return Ok((name, bytes));
        }
        let view = doc.require(doc.index(node, "bufferView", "bufferViews")?, node, "uri")?;
        let view = self.buffers.view(doc, &self.base, view)?;
        Ok((by_mime(mime), view.bytes().to_vec()))
    }
}
