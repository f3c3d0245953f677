//! glTF materials.
//!
//! Metallic–roughness becomes a `substrate` with 4 % reflectance at normal incidence (or what
//! `KHR_materials_ior` and `KHR_materials_specular` say; nothing: Lambert), a coloured conductor,
//! or their mixture, with α = roughness².

use super::Reader;
use super::document::Raw;
use super::textures::Channel;
use linelit_assembly::{ErrorKind, Holes, Result};
use linelit_geometry::DVec3;
use linelit_scene::{Material, MaterialKind, NormalMap, Remap, Roughness, Texture};
use serde::Deserialize;
use std::collections::HashMap;
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
    pub(super) holes: Holes,
    /// The set of texture coordinates that its textures are for.
    pub(super) uv_set: u32,
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

/// A material as the file has it: numbers in `f64`, where those of gltf are `f32`, and parts with
/// their places.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Node<'a> {
    name: Option<String>,
    #[serde(borrow)]
    pbr_metallic_roughness: Option<Raw<'a>>,
    normal_texture: Option<Raw<'a>>,
    emissive_texture: Option<Raw<'a>>,
    emissive_factor: [f64; 3],
    alpha_mode: Option<Raw<'a>>,
    alpha_cutoff: Option<f64>,
    double_sided: bool,
    extensions: HashMap<String, Raw<'a>>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct MetallicRoughness<'a> {
    base_color_factor: Option<[f64; 4]>,
    #[serde(borrow)]
    base_color_texture: Option<Raw<'a>>,
    metallic_factor: Option<f64>,
    roughness_factor: Option<f64>,
    metallic_roughness_texture: Option<Raw<'a>>,
}

/// The values of the supported extensions, and the scale of a normal map.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Details<'a> {
    emissive_strength: Option<f64>,
    ior: Option<f64>,
    scale: Option<f64>,
    specular_factor: Option<f64>,
    specular_color_factor: Option<[f64; 3]>,
    #[serde(borrow)]
    specular_texture: Option<Raw<'a>>,
    specular_color_texture: Option<Raw<'a>>,
}

impl<'a> Reader<'a> {
    pub(super) fn read_materials(&mut self) -> Result<()> {
        for raw in &self.doc.lists.materials {
            let entry = self.material(raw)?;
            self.materials.push(entry);
        }
        Ok(())
    }

    fn material(&mut self, raw: Raw<'a>) -> Result<Entry> {
        let node: Node<'a> = self.doc.read(raw)?;
        let mut uv_set = None;
        let surface = self.metallic_roughness(&node, raw, &mut uv_set)?;
        let normal_map = self.normal_map(&node, &mut uv_set)?;
        let (emission, emission_map) = self.emission(&node, raw, &mut uv_set)?;
        let holes = self.holes(&node, &mut uv_set)?;
        self.warn_about_rest(&node)?;
        let mut add = |kind| {
            self.base.builder.add_material(Material {
                name: node.name.clone().unwrap_or_else(|| "material".to_owned()),
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
            two_sided: node.double_sided,
            holes,
            uv_set: uv_set.unwrap_or(0),
        })
    }

    /// `alphaMode`: MASK as it says; BLEND, of which nothing shines through here, with an image as
    /// a mask that cuts at a half, without one as opaque.
    fn holes(&mut self, node: &Node<'a>, uv_set: &mut Option<u32>) -> Result<Holes> {
        let doc = self.doc;
        let Some(mode) = node.alpha_mode else {
            return Ok(Holes::None);
        };
        let is_mask = match mode.get() {
            "\"OPAQUE\"" => return Ok(Holes::None),
            "\"MASK\"" => true,
            _ => false,
        };
        let factors = match node.pbr_metallic_roughness {
            Some(raw) => doc.read(raw)?,
            None => MetallicRoughness::default(),
        };
        let [.., factor] = factors.base_color_factor.unwrap_or([1.0; 4]);
        let texture = match factors.base_color_texture {
            Some(named) => self.texture(named, Channel::Alpha, factor, uv_set)?,
            None => None,
        };
        let cutoff = if is_mask {
            node.alpha_cutoff.unwrap_or(0.5)
        } else {
            let message = "blending is not supported: what shines through is not drawn";
            let label = "an image cuts where its alpha is below 0.5";
            self.base.unsupported(message, label, doc.at(mode))?;
            0.5
        };
        if !factor.is_finite() || !cutoff.is_finite() {
            let message = "an alpha that is not finite";
            let kind = ErrorKind::OutOfRange;
            return Err(doc.error(kind, message, mode, "its material"));
        }
        match texture {
            Some(texture) => self.base.alpha(texture, cutoff, doc.at(mode)),
            None if is_mask && factor < cutoff => Ok(Holes::All),
            None => Ok(Holes::None),
        }
    }

    /// Names what is not drawn.
    fn warn_about_rest(&mut self, node: &Node<'a>) -> Result<()> {
        let doc = self.doc;
        // Occlusion textures darken ambient light, of which there is none here.
        for (name, instead) in EXTENSIONS {
            if let Some(extension) = node.extensions.get(*name) {
                let message = format!("`{name}` is not supported");
                self.base.unsupported(message, instead, doc.at(extension))?;
            }
        }
        Ok(())
    }

    /// Reads an extension of a material.
    fn details(&self, node: &Node<'a>, extension: &str) -> Result<Details<'a>> {
        let raw = node.extensions.get(extension).copied();
        raw.map_or(Ok(Details::default()), |raw| self.doc.read(raw))
    }

    /// Base colour, metalness and roughness.
    fn metallic_roughness(
        &mut self,
        node: &Node<'a>,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Surface> {
        let specular = self.specular(node, raw)?;
        let place = node.pbr_metallic_roughness.unwrap_or(raw);
        let factors = match node.pbr_metallic_roughness {
            Some(raw) => self.doc.read(raw)?,
            None => MetallicRoughness::default(),
        };
        let [r, g, b, _] = factors.base_color_factor.unwrap_or([1.0; 4]);
        let factor = self.colour(place, [r, g, b])?;
        let mut colour = Texture::Constant(factor);
        if let Some(named) = factors.base_color_texture
            && let Some(texture) = self.texture(named, Channel::Colour, 1.0, uv_set)?
        {
            colour = if factor == DVec3::ONE {
                texture
            } else {
                Texture::Product(Arc::new(texture), Arc::new(colour))
            };
        }
        let share = |factor: Option<f64>| factor.unwrap_or(1.0).clamp(0.0, 1.0);
        let metallic = share(factors.metallic_factor);
        let roughness = share(factors.roughness_factor);
        let mut metalness = Texture::number(metallic);
        let mut alpha = Roughness::isotropic(roughness * roughness, Remap::None);
        if let Some(named) = factors.metallic_roughness_texture {
            if metallic > 0.0
                && let Some(map) = self.texture(named, Channel::Blue, metallic, uv_set)?
            {
                metalness = map;
            }
            if let Some(map) = self.texture(named, Channel::Green, roughness, uv_set)? {
                let map = Arc::new(map);
                // α is the square.
                let square = Texture::Product(Arc::clone(&map), map);
                alpha.u = square.clone();
                alpha.v = square;
            }
        }
        Ok(surface(colour, specular, metalness, alpha))
    }

    /// The reflectance at normal incidence of the base.
    fn specular(&mut self, node: &Node<'a>, raw: Raw<'a>) -> Result<DVec3> {
        let reflectance = match self.details(node, "KHR_materials_ior")?.ior {
            Some(eta) if (1.0..=f64::from(f32::MAX)).contains(&eta) => {
                let root = (eta - 1.0) / (eta + 1.0);
                root * root
            }
            Some(_) => 1.0,
            None => 0.04,
        };
        let details = self.details(node, "KHR_materials_specular")?;
        for (key, texture) in [
            ("specularTexture", details.specular_texture),
            ("specularColorTexture", details.specular_color_texture),
        ] {
            if let Some(texture) = texture {
                let message = format!("`{key}` is not supported");
                let at = self.doc.at(texture);
                self.base.unsupported(message, "left out", at)?;
            }
        }
        let place = node.extensions.get("KHR_materials_specular");
        let colour = details.specular_color_factor.unwrap_or([1.0; 3]);
        let colour = self.colour(place.unwrap_or(&raw), colour)?;
        let factor = details.specular_factor.unwrap_or(1.0);
        let factor = factor.clamp(0.0, f64::from(f32::MAX));
        Ok((reflectance * (colour * factor)).min(DVec3::ONE))
    }

    fn normal_map(
        &mut self,
        node: &Node<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<NormalMap>> {
        let Some(named) = node.normal_texture else {
            return Ok(None);
        };
        let texture = self.texture(named, Channel::Linear, 1.0, uv_set)?;
        let scale = self.doc.read::<Details<'_>>(named)?.scale.unwrap_or(1.0);
        Ok(texture.map(|texture| NormalMap { texture, scale }))
    }

    /// A finite colour without negative parts.
    fn colour(&self, place: Raw<'a>, rgb: [f64; 3]) -> Result<DVec3> {
        let rgb = DVec3::from_array(rgb);
        if rgb.min_element() >= 0.0 && rgb.is_finite() {
            return Ok(rgb);
        }
        let (message, label) = if rgb.is_finite() {
            ("a negative colour", "must not be negative")
        } else {
            ("a colour that is not finite", "must be finite")
        };
        Err(self.doc.error(ErrorKind::OutOfRange, message, place, label))
    }

    /// The radiance that is emitted, if any, and its texture.
    fn emission(
        &mut self,
        node: &Node<'a>,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<(Option<DVec3>, Option<u32>)> {
        let details = self.details(node, "KHR_materials_emissive_strength")?;
        let strength = details.emissive_strength.unwrap_or(1.0);
        let factor = self.colour(raw, node.emissive_factor)?;
        if !strength.is_finite() {
            let message = "`emissiveStrength` is not finite";
            let kind = ErrorKind::OutOfRange;
            return Err(self.doc.error(kind, message, raw, "must be finite"));
        }
        let radiance = factor * strength.max(0.0);
        if radiance == DVec3::ZERO {
            self.base.has_lights |= factor != DVec3::ZERO;
            return Ok((None, None));
        }
        let map = match node.emissive_texture {
            Some(named) => self.texture(named, Channel::Colour, 1.0, uv_set)?,
            None => None,
        };
        let map = map.map(|map| self.base.builder.add_emission_map(Arc::new(map)));
        Ok((Some(radiance), map))
    }
}

/// The components of a metallic–roughness surface.
struct Surface {
    /// The base, the metal, or both.
    parts: Vec<MaterialKind>,
    /// The share of the second part.
    metalness: Texture,
}

fn surface(colour: Texture, specular: DVec3, metalness: Texture, roughness: Roughness) -> Surface {
    let metal = MaterialKind::ColoredConductor {
        reflectance: colour.clone(),
        roughness: roughness.clone(),
        schlick: true,
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
