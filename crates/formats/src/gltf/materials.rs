//! The materials of glTF.
//!
//! The metallic-roughness model becomes a `substrate` where it is not metallic, a coloured
//! conductor where it is, or a mixture of both, with α = roughness². The substrate has 4 %
//! reflectance at normal incidence, or the reflectance that `KHR_materials_ior` and
//! `KHR_materials_specular` give; if that is zero, it becomes a Lambertian surface.

use super::Reader;
use super::document::Raw;
use super::textures::Channel;
use linelit_assembly::{ErrorKind, Holes, Result};
use linelit_geometry::DVec3;
use linelit_scene::{Material, MaterialKind, NormalMap, Remap, Roughness, Texture};
use serde::Deserialize;
use std::collections::HashMap;
use std::sync::Arc;

/// A material of the scene, with the properties that glTF has in materials and a scene in meshes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    /// The index of the material in the scene.
    pub(super) index: u32,
    /// The emitted radiance, if any.
    pub(super) emission: Option<DVec3>,
    /// The texture that is a factor on the emission: an index into the builder's list.
    pub(super) emission_map: Option<u32>,
    pub(super) two_sided: bool,
    pub(super) holes: Holes,
    /// The index of the set of texture coordinates that the material's textures use.
    pub(super) uv_set: u32,
}

/// The extensions of materials that are not supported and change a picture visibly, each with a
/// text that says what is drawn instead.
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

/// Returns whether there is a warning about each material that uses this extension.
pub(super) fn names_extension(name: &str) -> bool {
    EXTENSIONS.iter().any(|(known, _)| *known == name)
}

/// A material of the file, with numbers in `f64` (the crate gltf has `f32`), and parts whose
/// positions are known.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonMaterial<'a> {
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

/// The parameters of the metallic-roughness model.
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
    /// Reads all materials of the file, and adds them to the scene.
    pub(super) fn read_materials(&mut self) -> Result<()> {
        for raw in &self.doc.lists.materials {
            let entry = self.material(raw)?;
            self.materials.push(entry);
        }
        Ok(())
    }

    /// Reads a material, and adds it to the scene.
    fn material(&mut self, raw: Raw<'a>) -> Result<Entry> {
        // Read its parts.
        let node: JsonMaterial<'a> = self.doc.read(raw)?;
        let mut uv_set = None;
        let surface = self.metallic_roughness(&node, raw, &mut uv_set)?;
        let normal_map = self.normal_map(&node, &mut uv_set)?;
        let (emission, emission_map) = self.emission(&node, raw, &mut uv_set)?;
        let holes = self.holes(&node, &mut uv_set)?;
        self.warn_about_rest(&node)?;
        // Add it: as one model, or as two and their mixture.
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

    /// Reads the holes of `alphaMode`. MASK is supported. BLEND is read as a mask with the cutoff
    /// one half if there is an image, and otherwise as opaque, as there is no partial transparency.
    fn holes(&mut self, node: &JsonMaterial<'a>, uv_set: &mut Option<u32>) -> Result<Holes> {
        // Read the mode.
        let doc = self.doc;
        let Some(mode) = node.alpha_mode else {
            return Ok(Holes::None);
        };
        let is_mask = match mode.get() {
            "\"OPAQUE\"" => return Ok(Holes::None),
            "\"MASK\"" => true,
            _ => false,
        };
        // Read alpha, which is a part of the base colour, and the cutoff.
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
        // Cut holes by the image; without one, all of the surface is cut away or none.
        match texture {
            Some(texture) => self.base.alpha(texture, cutoff, doc.at(mode)),
            None if is_mask && factor < cutoff => Ok(Holes::All),
            None => Ok(Holes::None),
        }
    }

    /// Warns about extensions of a material that are not supported. (Occlusion textures are ignored
    /// silently: they darken ambient light, which does not exist here.)
    fn warn_about_rest(&mut self, node: &JsonMaterial<'a>) -> Result<()> {
        let doc = self.doc;
        for (name, instead) in EXTENSIONS {
            if let Some(extension) = node.extensions.get(*name) {
                let message = format!("`{name}` is not supported");
                self.base.unsupported(message, instead, doc.at(extension))?;
            }
        }
        Ok(())
    }

    /// Reads an extension of a material.
    fn details(&self, node: &JsonMaterial<'a>, extension: &str) -> Result<Details<'a>> {
        let raw = node.extensions.get(extension).copied();
        raw.map_or(Ok(Details::default()), |raw| self.doc.read(raw))
    }

    /// Reads base colour, metalness and roughness.
    fn metallic_roughness(
        &mut self,
        node: &JsonMaterial<'a>,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Surface> {
        // Read the base colour, times its texture.
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
        // Read metalness and roughness, which are two channels of one texture.
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
                // Multiply the map by itself, as α is the square of the roughness.
                let square = Texture::Product(Arc::clone(&map), map);
                alpha.u = square.clone();
                alpha.v = square;
            }
        }
        Ok(surface(colour, specular, metalness, alpha))
    }

    /// Returns the reflectance of the base at normal incidence, from the extensions for the index
    /// of refraction and for specular reflection.
    fn specular(&mut self, node: &JsonMaterial<'a>, raw: Raw<'a>) -> Result<DVec3> {
        // Take the reflectance of the index of refraction, ((η − 1)/(η + 1))².
        let reflectance = match self.details(node, "KHR_materials_ior")?.ior {
            Some(eta) if (1.0..=f64::from(f32::MAX)).contains(&eta) => {
                let root = (eta - 1.0) / (eta + 1.0);
                root * root
            }
            Some(_) => 1.0,
            None => 0.04,
        };
        // Warn about textures of the specular reflection.
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
        // Multiply by its colour and its factor.
        let place = node.extensions.get("KHR_materials_specular");
        let colour = details.specular_color_factor.unwrap_or([1.0; 3]);
        let colour = self.colour(place.unwrap_or(&raw), colour)?;
        let factor = details.specular_factor.unwrap_or(1.0);
        let factor = factor.clamp(0.0, f64::from(f32::MAX));
        Ok((reflectance * (colour * factor)).min(DVec3::ONE))
    }

    /// Reads the normal map, if there is one.
    fn normal_map(
        &mut self,
        node: &JsonMaterial<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<NormalMap>> {
        let Some(named) = node.normal_texture else {
            return Ok(None);
        };
        let texture = self.texture(named, Channel::Linear, 1.0, uv_set)?;
        let scale = self.doc.read::<Details<'_>>(named)?.scale.unwrap_or(1.0);
        Ok(texture.map(|texture| NormalMap { texture, scale }))
    }

    /// Checks that a colour is finite and not negative.
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

    /// Reads the emitted radiance, if any, and the index of its texture.
    fn emission(
        &mut self,
        node: &JsonMaterial<'a>,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<(Option<DVec3>, Option<u32>)> {
        // Read the radiance, the product of a factor and a strength.
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
        // Read the texture.
        let map = match node.emissive_texture {
            Some(named) => self.texture(named, Channel::Colour, 1.0, uv_set)?,
            None => None,
        };
        let map = map.map(|map| self.base.builder.add_emission_map(Arc::new(map)));
        Ok((Some(radiance), map))
    }
}

/// The materials of a metallic-roughness surface.
struct Surface {
    /// The base, the metal, or both.
    parts: Vec<MaterialKind>,
    /// The weight of the metal.
    metalness: Texture,
}

/// Makes the materials of a metallic-roughness surface: the base and the metal, of which one is
/// left out if its weight is zero everywhere.
fn surface(colour: Texture, specular: DVec3, metalness: Texture, roughness: Roughness) -> Surface {
    // Make the metal, and the base, which is Lambertian without specular reflection.
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
    // Leave one out, unless the metalness is between zero and one.
    let parts = match metalness.as_constant() {
        Some(share) if share.x <= 0.0 => vec![base],
        Some(share) if share.x >= 1.0 => vec![metal],
        _ => vec![base, metal],
    };
    Surface { parts, metalness }
}
