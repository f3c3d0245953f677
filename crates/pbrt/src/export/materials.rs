//! Materials and their textures as pbrt text.

use super::{Quoted, Triple, Writer};
use linelit_geometry::DVec3;
use linelit_scene::{
    ImageTexture, Material, MaterialKind, NormalMap, Parameter, Remap, Roughness, Texture,
    TextureFilter, UvMapping, Wrap, index_of_refraction,
};
use std::fmt::{self, Write as _};
use std::sync::Arc;

/// The parameters of a filter.
pub(super) fn filter(filter: TextureFilter) -> String {
    let name = match filter {
        TextureFilter::Point => "point",
        TextureFilter::Bilinear => "bilinear",
        TextureFilter::Trilinear => "trilinear",
        TextureFilter::Ewa { max_anisotropy } => {
            return format!(
                " \"string filter\" \"ewa\" \"float maxanisotropy\" [ {max_anisotropy} ]"
            );
        }
    };
    format!(" \"string filter\" \"{name}\"")
}

/// The refractive index of a coat: its own, or what reflects as much at normal incidence.
fn coat_index(kind: &MaterialKind) -> f64 {
    let usual = index_of_refraction(0.0);
    match kind {
        MaterialKind::Uber { eta, .. } => eta
            .as_constant()
            .map_or(usual, |eta| index_of_refraction(eta.x)),
        MaterialKind::Substrate { ks, .. } | MaterialKind::Frostbite { ks, .. } => {
            match ks.as_constant() {
                Some(ks) if ks.max_element() < 1.0 => {
                    let root = ks.element_sum().max(0.0).sqrt() / 3.0_f64.sqrt();
                    (1.0 + root) / (1.0 - root)
                }
                _ => usual,
            }
        }
        _ => usual,
    }
}

/// What [`write_pbrt`](crate::write_pbrt) writes in place of a material that
/// pbrt-v4 does not have, as linelit reads it; `None` for those that it has.
#[must_use]
pub fn nearest_in_pbrt_v4(material: &Material) -> Option<Material> {
    let one = || Texture::number(1.0);
    let kind = match &material.kind {
        MaterialKind::Matte { kd, sigma } if sigma.as_constant() != Some(DVec3::ZERO) => matte(kd),
        MaterialKind::Plastic { kd, roughness, .. }
        | MaterialKind::Substrate { kd, roughness, .. }
        | MaterialKind::Uber { kd, roughness, .. } => MaterialKind::CoatedDiffuse {
            reflectance: kd.clone(),
            roughness: roughness.clone(),
            eta: Texture::number(coat_index(&material.kind)),
            thickness: 0.01,
        },
        MaterialKind::Phong { kd, .. } => matte(kd),
        MaterialKind::Frostbite { kd, roughness, .. } => {
            let square = || {
                let root = Arc::new(roughness.clone());
                Texture::Product(Arc::clone(&root), root)
            };
            MaterialKind::CoatedDiffuse {
                reflectance: kd.clone(),
                roughness: Roughness {
                    u: square(),
                    v: square(),
                    remap: Remap::None,
                },
                eta: Texture::number(coat_index(&material.kind)),
                thickness: 0.01,
            }
        }
        MaterialKind::Mirror { kr } => MaterialKind::ColoredConductor {
            reflectance: kr.clone(),
            roughness: Roughness::isotropic(0.0, Remap::None),
            schlick: false,
        },
        MaterialKind::Dielectric {
            kr,
            kt,
            eta,
            roughness,
            thin,
        } if [kr, kt].iter().any(|k| k.as_constant() != Some(DVec3::ONE)) => {
            MaterialKind::Dielectric {
                kr: one(),
                kt: one(),
                eta: eta.clone(),
                roughness: roughness.clone(),
                thin: *thin,
            }
        }
        MaterialKind::Matte { .. }
        | MaterialKind::CoatedDiffuse { .. }
        | MaterialKind::Conductor { .. }
        | MaterialKind::ColoredConductor { .. }
        | MaterialKind::Dielectric { .. }
        | MaterialKind::DiffuseTransmission { .. }
        | MaterialKind::Mix { .. } => return None,
    };
    Some(Material {
        kind,
        ..material.clone()
    })
}

fn matte(kd: &Texture) -> MaterialKind {
    MaterialKind::Matte {
        kd: kd.clone(),
        sigma: Texture::number(0.0),
    }
}

/// Scale and offset of texture coordinates.
struct Mapping<'a>(&'a UvMapping);

impl fmt::Display for Mapping<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, offset) = (self.0.scale, self.0.offset);
        let list = [("scale", scale), ("delta", offset)];
        list.iter().try_for_each(|(name, pair)| {
            let (u, v) = (pair.x, pair.y);
            write!(f, " \"float u{name}\" [ {u} ] \"float v{name}\" [ {v} ]")
        })
    }
}

impl Writer<'_> {
    /// Writes the textures that a parameter needs and gives the parameter.
    pub(super) fn parameter(
        &mut self,
        name: &str,
        texture: &Texture,
        is_number: bool,
    ) -> Result<String, fmt::Error> {
        let body = match texture {
            Texture::Constant(value) if is_number => {
                return Ok(format!(" \"float {name}\" [ {} ]", value.x));
            }
            Texture::Constant(value) => {
                return Ok(format!(" \"rgb {name}\" [ {} ]", Triple(*value)));
            }
            Texture::Image(image) => self.image(image),
            Texture::Product(a, b) => {
                let a = self.parameter("tex", a, is_number)?;
                // pbrt-v4 scales by a number only; a colour is for readers like ours.
                let grey = b
                    .as_constant()
                    .filter(|v| [v.y, v.z].iter().all(|c| c.to_bits() == v.x.to_bits()));
                let b = self.parameter("scale", b, is_number || grey.is_some())?;
                format!("\"scale\"{a}{b}")
            }
            Texture::Mix { a, b, amount } => {
                let a = self.parameter("tex1", a, is_number)?;
                let b = self.parameter("tex2", b, is_number)?;
                let amount = self.parameter("amount", amount, true)?;
                format!("\"mix\"{a}{b}{amount}")
            }
            Texture::Checkerboard {
                mapping,
                filtered,
                even,
                odd,
            } => {
                let even = self.parameter("tex1", even, is_number)?;
                let odd = self.parameter("tex2", odd, is_number)?;
                // pbrt-v4 has no other mode.
                let own = if self.options.extensions && !filtered {
                    " \"string aamode\" \"none\""
                } else {
                    ""
                };
                format!("\"checkerboard\"{even}{odd}{}{own}", Mapping(mapping))
            }
        };
        self.textures += 1;
        let label = format!("t{}", self.textures);
        let ty = if is_number { "float" } else { "spectrum" };
        writeln!(self.text, "Texture \"{label}\" \"{ty}\" {body}")?;
        Ok(format!(" \"texture {name}\" \"{label}\""))
    }

    /// The class and the parameters of an image texture.
    fn image(&self, image: &ImageTexture) -> String {
        let [wrap, v_wrap] = image.wrap.map(|wrap| match wrap {
            Wrap::Repeat => "repeat",
            // The nearest that pbrt has.
            Wrap::Mirror if !self.options.extensions => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Black => "black",
            Wrap::Clamp => "clamp",
        });
        let mut own = String::new();
        if self.options.extensions && image.mapping.rotation != 0.0 {
            own = format!(" \"float uvrotation\" [ {} ]", image.mapping.rotation);
        }
        if self.options.extensions && wrap != v_wrap {
            own += &format!(" \"string vwrap\" \"{v_wrap}\"");
        }
        let encoding = if image.data.is_srgb() {
            "sRGB"
        } else {
            "linear"
        };
        let name = (self.options.image_name)(image);
        format!(
            "\"imagemap\" \"string filename\" {} \"string wrap\" \"{wrap}\" \
             \"string encoding\" \"{encoding}\"{} \"float scale\" [ {} ] \"bool invert\" {}{}{own}",
            Quoted(&name),
            filter(image.filter),
            image.scale,
            image.invert,
            Mapping(&image.mapping)
        )
    }

    /// Roughness for a material of pbrt-v4 or v3: as it is, if it is remapped so, else as α.
    /// Textures that pbrt-v4 remaps in another way than the file did stay as they are.
    fn roughness(&mut self, roughness: &Roughness, v4: bool) -> Result<String, fmt::Error> {
        let as_is = roughness.remap == if v4 { Remap::V4 } else { Remap::V3 };
        let mut out = String::new();
        for (name, texture) in [("uroughness", &roughness.u), ("vroughness", &roughness.v)] {
            let texture = match texture.as_constant() {
                // Zero is smooth, whatever the remapping.
                Some(value) if !as_is && value.x > 0.0 => {
                    Texture::number(roughness.remap.alpha(value.x))
                }
                _ => texture.clone(),
            };
            out += &self.parameter(name, &texture, true)?;
        }
        let textured = roughness.u.as_constant().is_none() || roughness.v.as_constant().is_none();
        let remap = as_is || textured && roughness.remap != Remap::None;
        Ok(out + &format!(" \"bool remaproughness\" {remap}"))
    }

    /// A named material, `m` and its index.
    pub(super) fn material(&mut self, index: usize, material: &Material) -> fmt::Result {
        let v4 = !self.options.extensions || material.kind.is_of_v4();
        let nearest = nearest_in_pbrt_v4(material).filter(|_| v4);
        let mut kind = nearest.as_ref().unwrap_or(material).kind.clone();
        let (name, parameters) = kind.parameters(v4);
        let mut body = format!("\"{name}\"");
        for parameter in parameters {
            body += &match parameter {
                // pbrt-v4 has none, and the nearest that it has is smooth.
                Parameter::Number("sigma", _) if v4 => continue,
                Parameter::Colour(name, texture) | Parameter::Metal(name, texture) => {
                    self.parameter(name, texture, false)?
                }
                Parameter::Number(name, texture) => self.parameter(name, texture, true)?,
                Parameter::Index(eta) => self.parameter("eta", eta, true)?,
                Parameter::Value(name, value) => format!(" \"float {name}\" [ {value} ]"),
                Parameter::Own(name, true) if self.options.extensions => {
                    format!(" \"bool {name}\" true")
                }
                Parameter::Own(..) => continue,
                Parameter::Rough(roughness) => self.roughness(roughness, v4)?,
                Parameter::Parts([a, b]) => format!(" \"string materials\" [ \"m{a}\" \"m{b}\" ]"),
            };
        }
        let relief = self.relief(material)?;
        let name: String = material.name.chars().filter(|c| !c.is_control()).collect();
        let comment = match (&material.kind, nearest) {
            (_, None) => "",
            (MaterialKind::Phong { .. }, _) => ": the diffuse part of `phong`",
            _ => ": the nearest that pbrt-v4 has",
        };
        writeln!(
            self.text,
            "MakeNamedMaterial \"m{index}\" \"string type\" {body}{relief} # {name}{comment}"
        )
    }

    /// Bump or normal map; pbrt's normal maps have no factor, ours is then lost.
    fn relief(&mut self, material: &Material) -> Result<String, fmt::Error> {
        if let Some(map) = &material.bump {
            // pbrt-v4 knows no other bumps than its own.
            let name = if map.as_v3 && self.options.extensions {
                "bumpmap"
            } else {
                "displacement"
            };
            return self.parameter(name, &map.height, true);
        }
        Ok(match &material.normal_map {
            Some(NormalMap {
                texture: Texture::Image(image),
                ..
            }) => {
                let name = (self.options.image_name)(image);
                format!(" \"string normalmap\" {}", Quoted(&name))
            }
            _ => String::new(),
        })
    }
}
