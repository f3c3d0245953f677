//! glTF materials.
//!
//! Metallic–roughness becomes a `substrate` with 4 % reflectance at normal incidence (or what
//! `KHR_materials_ior` and `KHR_materials_specular` say; nothing: Lambert), a coloured conductor, or
//! their mixture, with α = roughness².

use super::Reader;
use super::document::Document;
use super::json::Node;
use super::textures::Channel;
use crate::diagnostics::{ErrorKind, Result};
use linelit_geometry::DVec3;
use linelit_scene::{Material, MaterialKind, NormalMap, Remap, Roughness, Texture};
use std::sync::Arc;

/// A material of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub(super) index: u32,
    /// Emitted radiance, if any.
    pub(super) emission: Option<DVec3>,
    /// Factor on the emission over the surface: an index into the builder's list.
    pub(super) emission_map: Option<u32>,
    pub(super) two_sided: bool,
    /// The set of texture coordinates that its textures are for.
    pub(super) uv_set: usize,
}

/// Extensions of materials that change more than a detail, and what is drawn instead.
const EXTENSIONS: &[(&str, &str)] = &[
    ("KHR_materials_unlit", "drawn as a lit surface"),
    (
        "KHR_materials_pbrSpecularGlossiness",
        "drawn by its metallic-roughness values",
    ),
    ("KHR_materials_transmission", "drawn without transmission"),
    ("KHR_materials_volume", "drawn without its inside"),
    ("KHR_materials_clearcoat", "drawn without its coat"),
    ("KHR_materials_sheen", "drawn without sheen"),
    ("KHR_materials_iridescence", "drawn without iridescence"),
    ("KHR_materials_anisotropy", "drawn isotropic"),
];

/// Whether a material that uses the extension is warned about by name.
pub(super) fn names_extension(name: &str) -> bool {
    EXTENSIONS.iter().any(|(known, _)| *known == name)
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
        let mut uv_set = None;
        let surface = self.metallic_roughness(doc, node, &mut uv_set)?;
        let normal_map = self.normal_map(doc, node, &mut uv_set)?;
        let (emission, emission_map) = self.emission(doc, node, &mut uv_set)?;
        self.warn_about_rest(doc, node)?;
        let mut add = |kind| {
            self.base.builder.add_material(Material {
                name: name.clone(),
                kind,
                bump: None,
                normal_map: normal_map.clone(),
            })
        };
        let mut indices = surface.parts.into_iter().map(&mut add);
        let index = match (indices.next(), indices.next()) {
            (Some(base), Some(metal)) => add(MaterialKind::Mix {
                materials: [base, metal],
                amount: surface.metalness,
            }),
            (one, _) => one.unwrap_or(0),
        };
        Ok(Entry {
            index,
            emission,
            emission_map,
            two_sided: doc.bool(node, "doubleSided")?,
            uv_set: uv_set.unwrap_or(0),
        })
    }

    /// Names what is not drawn.
    fn warn_about_rest(&mut self, doc: &Document<'_>, node: &Node) -> Result<()> {
        if let Some(mode) = doc.get(node, "alphaMode")
            && doc.string(node, "alphaMode")? != Some("OPAQUE")
        {
            let message = "transparency is not supported: shapes are opaque";
            self.warn(doc, ErrorKind::Unsupported, message, mode, "ignored")?;
        }
        // Occlusion textures darken ambient light, of which there is none here.
        let Some(extensions) = doc.object(node, "extensions")? else {
            return Ok(());
        };
        for (name, instead) in EXTENSIONS {
            if let Some(extension) = doc.get(extensions, name) {
                let message = format!("`{name}` is not supported");
                self.warn(doc, ErrorKind::Unsupported, &message, extension, instead)?;
            }
        }
        Ok(())
    }

    /// Base colour, metalness and roughness.
    fn metallic_roughness(
        &mut self,
        doc: &Document<'_>,
        node: &Node,
        uv_set: &mut Option<usize>,
    ) -> Result<Surface> {
        let specular = self.specular(doc, node)?;
        let Some(pbr) = doc.object(node, "pbrMetallicRoughness")? else {
            let one = Texture::number(1.0);
            let roughness = constant_roughness(1.0);
            return Ok(surface(one.clone(), specular, one, roughness));
        };
        let [r, g, b, _] = doc.vector::<4>(pbr, "baseColorFactor")?.unwrap_or([1.0; 4]);
        let factor = self.colour(doc, pbr, [r, g, b])?;
        let mut colour = Texture::Constant(factor);
        if let Some(info) = doc.object(pbr, "baseColorTexture")?
            && let Some(texture) = self.texture(doc, info, Channel::Colour, 1.0, uv_set)?
        {
            colour = if factor == DVec3::ONE {
                texture
            } else {
                Texture::Product(Arc::new(texture), Arc::new(colour))
            };
        }
        let share =
            |key: &str| -> Result<f64> { Ok(doc.number(pbr, key)?.unwrap_or(1.0).clamp(0.0, 1.0)) };
        let (metallic, roughness) = (share("metallicFactor")?, share("roughnessFactor")?);
        let (mut metalness, mut alpha) = (Texture::number(metallic), constant_roughness(roughness));
        if let Some(info) = doc.object(pbr, "metallicRoughnessTexture")? {
            if metallic > 0.0
                && let Some(map) = self.texture(doc, info, Channel::Blue, metallic, uv_set)?
            {
                metalness = map;
            }
            if let Some(map) = self.texture(doc, info, Channel::Green, roughness, uv_set)? {
                let map = Arc::new(map);
                // α is the square.
                let square = Texture::Product(Arc::clone(&map), map);
                alpha = Roughness {
                    u: square.clone(),
                    v: square,
                    remap: Remap::None,
                };
            }
        }
        Ok(surface(colour, specular, metalness, alpha))
    }

    /// The reflectance at normal incidence of the base.
    fn specular(&mut self, doc: &Document<'_>, node: &Node) -> Result<DVec3> {
        const DEFAULT: DVec3 = DVec3::splat(0.04);
        let Some(extensions) = doc.object(node, "extensions")? else {
            return Ok(DEFAULT);
        };
        let mut reflectance = DEFAULT;
        if let Some(extension) = doc.object(extensions, "KHR_materials_ior")?
            && let Some(eta) = doc.number(extension, "ior")?
        {
            let root = (eta - 1.0) / (eta + 1.0);
            reflectance = DVec3::splat(if eta >= 1.0 { root * root } else { 1.0 });
        }
        let Some(extension) = doc.object(extensions, "KHR_materials_specular")? else {
            return Ok(reflectance);
        };
        for key in ["specularTexture", "specularColorTexture"] {
            if let Some(info) = doc.get(extension, key) {
                let message = format!("`{key}` is not supported");
                self.warn(doc, ErrorKind::Unsupported, &message, info, "left out")?;
            }
        }
        let factor = doc.number(extension, "specularFactor")?.unwrap_or(1.0);
        let colour = doc
            .vector::<3>(extension, "specularColorFactor")?
            .unwrap_or([1.0; 3]);
        let colour = self.colour(doc, extension, colour)? * factor.max(0.0);
        Ok((reflectance * colour).min(DVec3::ONE))
    }

    fn normal_map(
        &mut self,
        doc: &Document<'_>,
        node: &Node,
        uv_set: &mut Option<usize>,
    ) -> Result<Option<NormalMap>> {
        let Some(info) = doc.object(node, "normalTexture")? else {
            return Ok(None);
        };
        let scale = doc.number(info, "scale")?.unwrap_or(1.0);
        let texture = self.texture(doc, info, Channel::Linear, 1.0, uv_set)?;
        Ok(texture.map(|texture| NormalMap { texture, scale }))
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

    fn emission(
        &mut self,
        doc: &Document<'_>,
        node: &Node,
        uv_set: &mut Option<usize>,
    ) -> Result<(Option<DVec3>, Option<u32>)> {
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
        if radiance == DVec3::ZERO {
            return Ok((None, None));
        }
        let Some(info) = doc.object(node, "emissiveTexture")? else {
            return Ok((Some(radiance), None));
        };
        let Some(map) = self.texture(doc, info, Channel::Colour, 1.0, uv_set)? else {
            return Ok((Some(radiance), None));
        };
        let map = self.base.builder.add_emission_map(Arc::new(map));
        Ok((Some(radiance), Some(map)))
    }
}

/// What a metallic–roughness surface is made of.
struct Surface {
    /// The base, the metal, or both.
    parts: Vec<MaterialKind>,
    /// The share of the second part.
    metalness: Texture,
}

fn constant_roughness(roughness: f64) -> Roughness {
    Roughness::isotropic(roughness * roughness, Remap::None)
}

fn surface(colour: Texture, specular: DVec3, metalness: Texture, roughness: Roughness) -> Surface {
    let metal = MaterialKind::ColoredConductor {
        reflectance: colour.clone(),
        roughness: roughness.clone(),
    };
    let base = if specular == DVec3::ZERO {
        MaterialKind::Matte {
            kd: colour,
            sigma: Texture::number(0.0),
        }
    } else {
        MaterialKind::Substrate {
            kd: colour,
            ks: Texture::Constant(specular),
            roughness,
        }
    };
    let parts = match metalness.as_constant() {
        Some(share) if share.x <= 0.0 => vec![base],
        Some(share) if share.x >= 1.0 => vec![metal],
        _ => vec![base, metal],
    };
    Surface { parts, metalness }
}
