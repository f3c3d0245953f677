//! glTF materials.
//!
//! Metallic–roughness becomes a `substrate` with 4 % reflectance at normal incidence (or what
//! `KHR_materials_ior` and `KHR_materials_specular` say; nothing: Lambert), a coloured conductor,
//! or their mixture, with α = roughness².

use super::Reader;
use super::document::{Document, Raw};
use super::textures::{Channel, Use};
use gltf::json::material as json;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use linelit_assembly::{ErrorKind, Result};
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

impl Reader {
    pub(super) fn read_materials(&mut self, doc: &Document<'_>) -> Result<()> {
        for raw in &doc.lists.materials {
            let entry = self.material(doc, raw)?;
            self.materials.push(entry);
        }
        Ok(())
    }

    fn material<'a>(&mut self, doc: &Document<'a>, raw: Raw<'a>) -> Result<Entry> {
        let node: json::Material = doc.read(raw)?;
        let name = node.name.clone().unwrap_or_else(|| "material".to_owned());
        let mut uv_set = None;
        let surface = self.metallic_roughness(doc, &node, raw, &mut uv_set)?;
        let normal_map = self.normal_map(doc, &node, raw, &mut uv_set)?;
        let (emission, emission_map) = self.emission(doc, &node, raw, &mut uv_set)?;
        self.warn_about_rest(doc, &node, raw)?;
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
            two_sided: node.double_sided,
            uv_set: uv_set.unwrap_or(0),
        })
    }

    /// Names what is not drawn.
    fn warn_about_rest<'a>(
        &mut self,
        doc: &Document<'a>,
        node: &json::Material,
        raw: Raw<'a>,
    ) -> Result<()> {
        if node.alpha_mode != Checked::Valid(AlphaMode::Opaque) {
            let message = "transparency is not supported: shapes are opaque";
            let place = doc.span(doc.find(raw, &["alphaMode"]));
            self.warn(doc, ErrorKind::Unsupported, message, place, "ignored")?;
        }
        // Occlusion textures darken ambient light, of which there is none here.
        let Some(extensions) = doc.get(raw, "extensions") else {
            return Ok(());
        };
        for (name, instead) in EXTENSIONS {
            if let Some(extension) = doc.get(extensions, name) {
                let message = format!("`{name}` is not supported");
                let place = doc.span(extension);
                self.warn(doc, ErrorKind::Unsupported, &message, place, instead)?;
            }
        }
        Ok(())
    }

    /// Base colour, metalness and roughness.
    fn metallic_roughness<'a>(
        &mut self,
        doc: &Document<'a>,
        node: &json::Material,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Surface> {
        let specular = self.specular(doc, node, raw)?;
        let pbr = &node.pbr_metallic_roughness;
        let factors = doc.find(raw, &["pbrMetallicRoughness"]);
        let [r, g, b, _] = doc.numbers(
            raw,
            &["pbrMetallicRoughness", "baseColorFactor"],
            [1.0_f64; 4],
        )?;
        let factor = self.colour(doc, factors, [r, g, b])?;
        let mut colour = Texture::Constant(factor);
        if let Some(info) = &pbr.base_color_texture {
            let place = doc.find(raw, &["pbrMetallicRoughness", "baseColorTexture"]);
            let info = Use::new(info, place);
            if let Some(texture) = self.texture(doc, &info, Channel::Colour, 1.0, uv_set)? {
                colour = if factor == DVec3::ONE {
                    texture
                } else {
                    Texture::Product(Arc::new(texture), Arc::new(colour))
                };
            }
        }
        let share = |key: &str| doc.numbers(raw, &["pbrMetallicRoughness", key], 1.0_f64);
        let metallic = share("metallicFactor")?.clamp(0.0, 1.0);
        let roughness = share("roughnessFactor")?.clamp(0.0, 1.0);
        let (mut metalness, mut alpha) = (Texture::number(metallic), constant_roughness(roughness));
        if let Some(info) = &pbr.metallic_roughness_texture {
            let place = doc.find(raw, &["pbrMetallicRoughness", "metallicRoughnessTexture"]);
            let info = &Use::new(info, place);
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
    fn specular<'a>(
        &mut self,
        doc: &Document<'a>,
        node: &json::Material,
        raw: Raw<'a>,
    ) -> Result<DVec3> {
        let mut reflectance = DVec3::splat(0.04);
        let Some(extensions) = &node.extensions else {
            return Ok(reflectance);
        };
        if extensions.ior.is_some() {
            let eta = doc.numbers(raw, &["extensions", "KHR_materials_ior", "ior"], 1.5_f64)?;
            let root = (eta - 1.0) / (eta + 1.0);
            let is_index = (1.0..=f64::from(f32::MAX)).contains(&eta);
            reflectance = DVec3::splat(if is_index { root * root } else { 1.0 });
        }
        let Some(extension) = &extensions.specular else {
            return Ok(reflectance);
        };
        let place = doc.find(raw, &["extensions", "KHR_materials_specular"]);
        for (key, texture) in [
            ("specularTexture", &extension.specular_texture),
            ("specularColorTexture", &extension.specular_color_texture),
        ] {
            if texture.is_some() {
                let message = format!("`{key}` is not supported");
                let place = doc.span(doc.find(place, &[key]));
                self.warn(doc, ErrorKind::Unsupported, &message, place, "left out")?;
            }
        }
        let factor = doc.numbers(place, &["specularFactor"], 1.0_f64)?;
        let factor = factor.clamp(0.0, f64::from(f32::MAX));
        let colour = doc.numbers(place, &["specularColorFactor"], [1.0_f64; 3])?;
        let colour = self.colour(doc, place, colour)? * factor;
        Ok((reflectance * colour).min(DVec3::ONE))
    }

    fn normal_map<'a>(
        &mut self,
        doc: &Document<'a>,
        node: &json::Material,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<NormalMap>> {
        if node.normal_texture.is_none() {
            return Ok(None);
        }
        let place = doc.find(raw, &["normalTexture"]);
        let info = doc.read(place)?;
        let info = Use::new(&info, place);
        let texture = self.texture(doc, &info, Channel::Linear, 1.0, uv_set)?;
        let scale = doc.numbers(place, &["scale"], 1.0_f64)?;
        Ok(texture.map(|texture| NormalMap { texture, scale }))
    }

    /// A finite colour without negative parts.
    fn colour<'a>(&self, doc: &Document<'a>, place: Raw<'a>, rgb: [f64; 3]) -> Result<DVec3> {
        let rgb = DVec3::from_array(rgb);
        if rgb.min_element() >= 0.0 && rgb.is_finite() {
            return Ok(rgb);
        }
        let (message, label) = if rgb.is_finite() {
            ("a negative colour", "must not be negative")
        } else {
            ("a colour that is not finite", "must be finite")
        };
        Err(doc.error(ErrorKind::OutOfRange, message, place, label))
    }

    fn emission<'a>(
        &mut self,
        doc: &Document<'a>,
        node: &json::Material,
        raw: Raw<'a>,
        uv_set: &mut Option<u32>,
    ) -> Result<(Option<DVec3>, Option<u32>)> {
        let factor = doc.numbers(raw, &["emissiveFactor"], [0.0_f64; 3])?;
        let mut radiance = self.colour(doc, raw, factor)?;
        let strength = node
            .extensions
            .as_ref()
            .and_then(|e| e.emissive_strength.as_ref());
        if strength.is_some() {
            let path = [
                "extensions",
                "KHR_materials_emissive_strength",
                "emissiveStrength",
            ];
            let strength = doc.numbers(raw, &path, 1.0_f64)?;
            if !strength.is_finite() {
                let message = "`emissiveStrength` is not finite";
                return Err(doc.error(ErrorKind::OutOfRange, message, raw, "must be finite"));
            }
            radiance *= strength.max(0.0);
        }
        if radiance == DVec3::ZERO {
            return Ok((None, None));
        }
        let Some(info) = &node.emissive_texture else {
            return Ok((Some(radiance), None));
        };
        let info = Use::new(info, doc.find(raw, &["emissiveTexture"]));
        let Some(map) = self.texture(doc, &info, Channel::Colour, 1.0, uv_set)? else {
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
