//! Materials and their textures as pbrt text.

use super::{Quoted, Triple, Writer};
use linelit_geometry::DVec3;
use linelit_scene::{
    ImageTexture, Material, MaterialKind, NormalMap, Remap, Roughness, Texture, TextureFilter, Wrap,
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
    const USUAL: f64 = 1.5;
    match kind {
        MaterialKind::Uber { eta, .. } => eta.as_constant().map_or(USUAL, |eta| eta.x),
        MaterialKind::Substrate { ks, .. } => match ks.as_constant() {
            Some(ks) if ks.max_element() < 1.0 => {
                let root = ks.element_sum().max(0.0).sqrt() / 3.0_f64.sqrt();
                (1.0 + root) / (1.0 - root)
            }
            _ => USUAL,
        },
        _ => USUAL,
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

impl Writer<'_> {
    /// Writes the textures that a parameter needs and gives the parameter.
    fn parameter(
        &mut self,
        name: &str,
        texture: &Texture,
        is_number: bool,
    ) -> Result<String, fmt::Error> {
        if let Texture::Constant(value) = texture {
            return Ok(if is_number {
                format!(" \"float {name}\" [ {} ]", value.x)
            } else {
                format!(" \"rgb {name}\" [ {} ]", Triple(*value))
            });
        }
        let ty = if is_number { "float" } else { "spectrum" };
        let body = match texture {
            Texture::Constant(_) => String::new(),
            Texture::Image(image) => self.image(image),
            Texture::Product(a, b) => {
                let a = self.parameter("tex", a, is_number)?;
                // pbrt-v4 scales by a number only; a colour is for readers like ours.
                match b.as_constant() {
                    Some(v) if v.x.to_bits() == v.y.to_bits() && v.x.to_bits() == v.z.to_bits() => {
                        format!("\"scale\"{a} \"float scale\" [ {} ]", v.x)
                    }
                    _ => {
                        let b = self.parameter("scale", b, is_number)?;
                        format!("\"scale\"{a}{b}")
                    }
                }
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
                let (s, o) = (mapping.scale, mapping.offset);
                // pbrt-v4 has no other mode.
                let own = if self.options.extensions && !filtered {
                    " \"string aamode\" \"none\""
                } else {
                    ""
                };
                format!(
                    "\"checkerboard\"{even}{odd} \"float uscale\" [ {} ] \"float vscale\" [ {} ] \
                     \"float udelta\" [ {} ] \"float vdelta\" [ {} ]{own}",
                    s.x, s.y, o.x, o.y
                )
            }
        };
        self.textures += 1;
        let label = format!("t{}", self.textures);
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
        let filter = filter(image.filter);
        let (s, o) = (image.mapping.scale, image.mapping.offset);
        let encoding = if image.data.is_srgb() {
            "sRGB"
        } else {
            "linear"
        };
        format!(
            "\"imagemap\" \"string filename\" {} \"string wrap\" \"{wrap}\" \"string encoding\" \"{encoding}\"{filter} \
             \"float scale\" [ {} ] \"bool invert\" {} \"float uscale\" [ {} ] \"float vscale\" [ {} ] \
             \"float udelta\" [ {} ] \"float vdelta\" [ {} ]{own}",
            Quoted(&(self.options.image_name)(image)),
            image.scale,
            image.invert,
            s.x,
            s.y,
            o.x,
            o.y
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
        let mut comment = "";
        let body = if self.options.extensions
            && let Some(body) = self.own_material(&material.kind)?
        {
            body
        } else {
            self.plain_material(&material.kind, &mut comment)?
        };
        let relief = self.relief(material)?;
        let name: String = material.name.chars().filter(|c| !c.is_control()).collect();
        write!(
            self.text,
            "MakeNamedMaterial \"m{index}\" \"string type\" {body}{relief} # {name}"
        )?;
        if comment.is_empty() {
            writeln!(self.text)
        } else {
            writeln!(self.text, ": {comment}")
        }
    }

    /// A material under pbrt-v3's or our own name, if pbrt-v4 does not have it.
    fn own_material(&mut self, kind: &MaterialKind) -> Result<Option<String>, fmt::Error> {
        let parameters = |writer: &mut Self, list: &[(&str, &Texture, bool)]| {
            list.iter().try_fold(String::new(), |text, (n, t, number)| {
                Ok(text + &writer.parameter(n, t, *number)?)
            })
        };
        Ok(Some(match kind {
            MaterialKind::Matte { kd, sigma } => {
                let list = [("Kd", kd, false), ("sigma", sigma, true)];
                format!("\"matte\"{}", parameters(self, &list)?)
            }
            MaterialKind::Plastic { kd, ks, roughness } => {
                let list = [("Kd", kd, false), ("Ks", ks, false)];
                let list = parameters(self, &list)?;
                format!("\"plastic\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Substrate { kd, ks, roughness } => {
                let list = [("Kd", kd, false), ("Ks", ks, false)];
                let list = parameters(self, &list)?;
                format!(
                    "\"substrate\"{list}{}",
                    self.roughness(roughness, Remap::V3)?
                )
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
                let list = [
                    ("Kd", kd, false),
                    ("Ks", ks, false),
                    ("Kr", kr, false),
                    ("Kt", kt, false),
                    ("eta", eta, true),
                    ("opacity", opacity, false),
                ];
                let list = parameters(self, &list)?;
                format!("\"uber\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Conductor { eta, k, roughness } if roughness.remap == Remap::V3 => {
                let list = parameters(self, &[("eta", eta, false), ("k", k, false)])?;
                format!("\"metal\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Mirror { kr } => {
                format!("\"mirror\"{}", parameters(self, &[("Kr", kr, false)])?)
            }
            MaterialKind::Dielectric {
                kr,
                kt,
                eta,
                roughness,
                thin: false,
            } if roughness.remap != Remap::V4 => {
                let list = [("Kr", kr, false), ("Kt", kt, false), ("eta", eta, true)];
                let list = parameters(self, &list)?;
                format!("\"glass\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Phong { kd, ks, exponent } => {
                let list = [
                    ("Kd", kd, false),
                    ("Ks", ks, false),
                    ("exponent", exponent, true),
                ];
                format!("\"phong\"{}", parameters(self, &list)?)
            }
            _ => return Ok(None),
        }))
    }

    /// A material as pbrt-v4 has it, or the nearest thing and a remark.
    fn plain_material(
        &mut self,
        kind: &MaterialKind,
        comment: &mut &'static str,
    ) -> Result<String, fmt::Error> {
        Ok(match kind {
            MaterialKind::Matte { kd, .. } => {
                format!("\"diffuse\"{}", self.parameter("reflectance", kd, false)?)
            }
            MaterialKind::Plastic { kd, roughness, .. }
            | MaterialKind::Substrate { kd, roughness, .. }
            | MaterialKind::Uber { kd, roughness, .. } => {
                *comment = "the nearest that pbrt-v4 has";
                let eta = Texture::number(coat_index(kind));
                let kd = self.parameter("reflectance", kd, false)?;
                let eta = self.parameter("eta", &eta, true)?;
                format!(
                    "\"coateddiffuse\"{kd}{}{eta}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::CoatedDiffuse {
                reflectance,
                roughness,
                eta,
                thickness,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                let eta = self.parameter("eta", eta, true)?;
                let roughness = self.roughness(roughness, Remap::V4)?;
                format!("\"coateddiffuse\"{r}{roughness}{eta} \"float thickness\" [ {thickness} ]")
            }
            MaterialKind::Phong { kd, .. } => {
                *comment = "the diffuse part of `phong`";
                format!("\"diffuse\"{}", self.parameter("reflectance", kd, false)?)
            }
            MaterialKind::Conductor { eta, k, roughness } => {
                let eta = self.parameter("eta", eta, false)?;
                let k = self.parameter("k", k, false)?;
                format!(
                    "\"conductor\"{eta}{k}{}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::ColoredConductor {
                reflectance,
                roughness,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                format!("\"conductor\"{r}{}", self.roughness(roughness, Remap::V4)?)
            }
            MaterialKind::Mirror { kr } => {
                format!(
                    "\"conductor\"{} \"float roughness\" [ 0 ]",
                    self.parameter("reflectance", kr, false)?
                )
            }
            MaterialKind::Dielectric {
                eta, thin: true, ..
            } => {
                format!("\"thindielectric\"{}", self.parameter("eta", eta, true)?)
            }
            MaterialKind::Dielectric {
                eta,
                roughness,
                thin: false,
                ..
            } => {
                let eta = self.parameter("eta", eta, true)?;
                format!(
                    "\"dielectric\"{eta}{}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::DiffuseTransmission {
                reflectance,
                transmittance,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                let t = self.parameter("transmittance", transmittance, false)?;
                format!("\"diffusetransmission\"{r}{t}")
            }
            MaterialKind::Mix {
                materials: [a, b],
                amount,
            } => {
                // pbrt-v4 mixes by a number, pbrt-v3 by a colour.
                let amount = self.parameter("amount", amount, !self.options.extensions)?;
                format!("\"mix\" \"string materials\" [ \"m{a}\" \"m{b}\" ]{amount}")
            }
        })
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
