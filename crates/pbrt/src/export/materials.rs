//! Materials and their textures as pbrt text.

use super::{Quoted, Triple, Writer};
use linelit_geometry::DVec3;
use linelit_scene::{
    ImageTexture, Material, MaterialKind, NormalMap, Remap, Roughness, Texture, TextureFilter,
    UvMapping, Wrap, index_of_refraction,
};
use std::fmt::{self, Write as _};

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
        MaterialKind::Substrate { ks, .. } => match ks.as_constant() {
            Some(ks) if ks.max_element() < 1.0 => {
                let root = ks.element_sum().max(0.0).sqrt() / 3.0_f64.sqrt();
                (1.0 + root) / (1.0 - root)
            }
            _ => usual,
        },
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
        MaterialKind::Mirror { kr } => MaterialKind::ColoredConductor {
            reflectance: kr.clone(),
            roughness: Roughness::isotropic(0.0, Remap::None),
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

/// A parameter of a material.
enum Part<'a> {
    Colour(&'static str, &'a Texture),
    Number(&'static str, &'a Texture),
    Value(&'static str, f64),
    /// Roughness for a material that remaps it so.
    Rough(&'a Roughness, Remap),
    /// The names of two materials.
    Two([u32; 2]),
}
use Part::{Colour, Number, Rough, Two, Value};

/// A material's type and parameters.
type Body<'a> = (&'static str, Vec<Part<'a>>);

/// A material under pbrt-v3's or our own name, if pbrt-v4 does not have it.
fn own_material(kind: &MaterialKind) -> Option<Body<'_>> {
    Some(match kind {
        MaterialKind::Matte { kd, sigma } => {
            ("matte", vec![Colour("Kd", kd), Number("sigma", sigma)])
        }
        MaterialKind::Plastic { kd, ks, roughness } => {
            let rough = Rough(roughness, Remap::V3);
            ("plastic", vec![Colour("Kd", kd), Colour("Ks", ks), rough])
        }
        MaterialKind::Substrate { kd, ks, roughness } => {
            let rough = Rough(roughness, Remap::V3);
            ("substrate", vec![Colour("Kd", kd), Colour("Ks", ks), rough])
        }
        MaterialKind::Uber {
            kd,
            ks,
            kr,
            kt,
            roughness,
            eta,
            opacity,
        } => {
            let names = ["Kd", "Ks", "Kr", "Kt", "opacity"];
            let colours = names.into_iter().zip([kd, ks, kr, kt, opacity]);
            let mut parts: Vec<_> = colours.map(|(name, t)| Colour(name, t)).collect();
            parts.extend([Number("eta", eta), Rough(roughness, Remap::V3)]);
            ("uber", parts)
        }
        MaterialKind::Conductor { eta, k, roughness } if roughness.remap == Remap::V3 => {
            let rough = Rough(roughness, Remap::V3);
            ("metal", vec![Colour("eta", eta), Colour("k", k), rough])
        }
        MaterialKind::Mirror { kr } => ("mirror", vec![Colour("Kr", kr)]),
        MaterialKind::Dielectric {
            kr,
            kt,
            eta,
            roughness,
            thin: false,
        } if roughness.remap != Remap::V4 => {
            let mut parts = vec![Colour("Kr", kr), Colour("Kt", kt)];
            parts.extend([Number("eta", eta), Rough(roughness, Remap::V3)]);
            ("glass", parts)
        }
        MaterialKind::Phong { kd, ks, exponent } => {
            let exponent = Number("exponent", exponent);
            ("phong", vec![Colour("Kd", kd), Colour("Ks", ks), exponent])
        }
        MaterialKind::Mix { materials, amount } => {
            ("mix", vec![Two(*materials), Colour("amount", amount)])
        }
        MaterialKind::CoatedDiffuse { .. }
        | MaterialKind::Conductor { .. }
        | MaterialKind::ColoredConductor { .. }
        | MaterialKind::Dielectric { .. }
        | MaterialKind::DiffuseTransmission { .. } => return None,
    })
}

/// A material as pbrt-v4 has it; of those that it does not have ([`nearest_in_pbrt_v4`]), the
/// diffuse part.
fn v4_material(kind: &MaterialKind) -> Body<'_> {
    match kind {
        MaterialKind::Matte { kd, .. }
        | MaterialKind::Phong { kd, .. }
        | MaterialKind::Plastic { kd, .. }
        | MaterialKind::Substrate { kd, .. }
        | MaterialKind::Uber { kd, .. }
        | MaterialKind::Mirror { kr: kd } => ("diffuse", vec![Colour("reflectance", kd)]),
        MaterialKind::CoatedDiffuse {
            reflectance,
            roughness,
            eta,
            thickness,
        } => {
            let mut parts = vec![Colour("reflectance", reflectance), Number("eta", eta)];
            parts.extend([Rough(roughness, Remap::V4), Value("thickness", *thickness)]);
            ("coateddiffuse", parts)
        }
        MaterialKind::Conductor { eta, k, roughness } => {
            let rough = Rough(roughness, Remap::V4);
            ("conductor", vec![Colour("eta", eta), Colour("k", k), rough])
        }
        MaterialKind::ColoredConductor {
            reflectance,
            roughness,
        } => {
            let rough = Rough(roughness, Remap::V4);
            ("conductor", vec![Colour("reflectance", reflectance), rough])
        }
        MaterialKind::Dielectric {
            eta, thin: true, ..
        } => ("thindielectric", vec![Number("eta", eta)]),
        MaterialKind::Dielectric {
            eta,
            roughness,
            thin: false,
            ..
        } => {
            let rough = Rough(roughness, Remap::V4);
            ("dielectric", vec![Number("eta", eta), rough])
        }
        MaterialKind::DiffuseTransmission {
            reflectance,
            transmittance,
        } => {
            let parts = [
                ("reflectance", reflectance),
                ("transmittance", transmittance),
            ];
            let parts = parts.map(|(name, t)| Colour(name, t));
            ("diffusetransmission", parts.into())
        }
        // pbrt-v4 mixes by a number, pbrt-v3 by a colour.
        MaterialKind::Mix { materials, amount } => {
            ("mix", vec![Two(*materials), Number("amount", amount)])
        }
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
    fn parameter(
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

    /// Roughness for a material that remaps it by `reader`: as it is, if it is remapped so, else
    /// as α. Textures that pbrt-v4 remaps in another way than the file did stay as they are.
    fn roughness(&mut self, roughness: &Roughness, reader: Remap) -> Result<String, fmt::Error> {
        let as_is = roughness.remap == reader;
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
        let own = own_material(&material.kind).filter(|_| self.options.extensions);
        let nearest = nearest_in_pbrt_v4(material).filter(|_| own.is_none());
        let (kind, parts) = match &nearest {
            Some(nearest) => v4_material(&nearest.kind),
            None => own.unwrap_or_else(|| v4_material(&material.kind)),
        };
        let mut body = format!("\"{kind}\"");
        for part in parts {
            body += &match part {
                Colour(name, texture) => self.parameter(name, texture, false)?,
                Number(name, texture) => self.parameter(name, texture, true)?,
                Value(name, value) => format!(" \"float {name}\" [ {value} ]"),
                Rough(roughness, reader) => self.roughness(roughness, reader)?,
                Two([a, b]) => format!(" \"string materials\" [ \"m{a}\" \"m{b}\" ]"),
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
