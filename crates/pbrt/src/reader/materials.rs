//! Materials.

use super::lexer::{Lexer, Token};
use super::params::{Params, Type};
use super::state::Target;
use super::{Loader, is_one_of, unknown};
use crate::color;
use linelit_assembly::{ErrorKind, Result, nearest, shorten};
use linelit_geometry::DVec3;
use linelit_scene::{
    BumpMap, ImageTexture, Material, MaterialKind, NormalMap, Remap, Roughness, Texture,
};
use std::sync::Arc;

/// Parts that a mixture may have in all, so that evaluating it stays cheap and each finds its place
/// among the lobes of a surface.
const MOST_PARTS: usize = 8;

const MATERIALS: &str = "\
    coateddiffuse coatedconductor conductor dielectric diffuse \
    diffusetransmission disney fourier glass hair interface kdsubsurface matte \
    measured metal mirror mix none phong plastic substrate subsurface \
    thindielectric translucent uber";

impl Loader {
    /// `Material "matte" …`
    pub(super) fn material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (kind, mut params) = self.named_params(lexer, token, "material")?;
        params.add_defaults(&self.state.defaults(Target::Material));
        self.state.material = self.build_material(&kind, &kind, &params)?;
        Ok(())
    }

    /// `MakeNamedMaterial "name" "string type" "matte" …`
    pub(super) fn make_named_material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, mut params) = self.named_params(lexer, token, "material")?;
        params.add_defaults(&self.state.defaults(Target::Material));
        let kind = params.require("type", params.string("type")?)?.to_owned();
        let index = self.build_material(&name, &kind, &params)?;
        self.materials.insert(name, index);
        Ok(())
    }

    /// `NamedMaterial "name"`
    pub(super) fn named_material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, params) = self.named_params(lexer, token, "material")?;
        self.state.material = self.material_index(&params, &name)?;
        Ok(())
    }

    fn material_index(&self, params: &Params, name: &str) -> Result<Option<u32>> {
        if let Some(index) = self.materials.get(name) {
            return Ok(*index);
        }
        let names = self.materials.keys().map(String::as_str);
        let message = format!("unknown material `{}`", shorten(name));
        Err(params
            .error(
                ErrorKind::UnknownName,
                message,
                "not defined by `MakeNamedMaterial`",
            )
            .suggest(nearest(name, names)))
    }

    /// Adds a material to the scene; `None` for `interface`, which is no surface.
    fn build_material(&mut self, name: &str, kind: &str, params: &Params) -> Result<Option<u32>> {
        if ["", "none", "interface"].contains(&kind) {
            return Ok(None);
        }
        let built = match self.v3_material(kind, params)? {
            Some(built) => built,
            None => self.v4_material(kind, params)?,
        };
        let bump = self.bump(params)?;
        let normal_map = self.normal_map(params)?;
        self.warn_unused(params)?;
        let material = Material {
            name: name.to_owned(),
            kind: built,
            bump,
            normal_map,
        };
        if !material.is_drawn_in_full() {
            let message = format!("material `{kind}` is drawn in part");
            self.warn_at(
                params,
                ErrorKind::Unsupported,
                message,
                "without its coat or what shines through it",
            )?;
        }
        Ok(Some(self.base.builder.add_material(material)))
    }

    /// v3's `bumpmap` or v4's `displacement`.
    fn bump(&mut self, params: &Params) -> Result<Option<BumpMap>> {
        for (name, as_v3) in [("bumpmap", true), ("displacement", false)] {
            if params.find(name, &[Type::Texture, Type::Float])?.is_some() {
                let height = self.texture_param(params, name, Texture::number(0.0), true)?;
                return Ok(Some(BumpMap { height, as_v3 }));
            }
        }
        Ok(None)
    }

    /// pbrt-v4's `normalmap`, an image of its own.
    fn normal_map(&mut self, params: &Params) -> Result<Option<NormalMap>> {
        let Some(param) = params.text("normalmap")? else {
            return Ok(None);
        };
        let name = param.strings()[0].clone();
        let data = self.base.image(&name, false, &param.at_value())?;
        Ok(data.map(|data| NormalMap {
            texture: Texture::Image(Arc::new(ImageTexture::new(data, name))),
            scale: 1.0,
        }))
    }

    fn colour(&mut self, params: &Params, name: &'static str, default: f64) -> Result<Texture> {
        self.texture_param(params, name, Texture::number(default), false)
    }

    fn number(&mut self, params: &Params, name: &'static str, default: f64) -> Result<Texture> {
        self.texture_param(params, name, Texture::number(default), true)
    }

    /// `roughness`, or `uroughness` and `vroughness`.
    fn roughness(&mut self, params: &Params, default: f64, remap: Remap) -> Result<Roughness> {
        let both = self.number(params, "roughness", default)?;
        Ok(Roughness {
            u: self.texture_param(params, "uroughness", both.clone(), true)?,
            v: self.texture_param(params, "vroughness", both, true)?,
            remap: if params.bool_or("remaproughness", true)? {
                remap
            } else {
                Remap::None
            },
        })
    }

    /// v3's `index` or `eta`.
    fn index_of_refraction(&mut self, params: &Params) -> Result<Texture> {
        let index = self.number(params, "index", 1.5)?;
        let named = params.find("eta", &[Type::Float, Type::Texture, Type::Spectrum])?;
        if named.is_some_and(|p| p.ty == Type::Spectrum) {
            let message = "a spectral index of refraction is not supported".to_owned();
            self.warn_at(params, ErrorKind::Unsupported, message, "read as 1.5")?;
            return Ok(Texture::number(1.5));
        }
        self.texture_param(params, "eta", index, true)
    }

    /// The materials of pbrt-v3, and our `phong`.
    fn v3_material(&mut self, kind: &str, params: &Params) -> Result<Option<MaterialKind>> {
        Ok(Some(match kind {
            "matte" => MaterialKind::Matte {
                kd: self.colour(params, "Kd", 0.5)?,
                sigma: self.number(params, "sigma", 0.0)?,
            },
            "plastic" => MaterialKind::Plastic {
                kd: self.colour(params, "Kd", 0.25)?,
                ks: self.colour(params, "Ks", 0.25)?,
                roughness: self.roughness(params, 0.1, Remap::V3)?,
            },
            "metal" => self.conductor(params, 0.01, Remap::V3)?,
            "substrate" => MaterialKind::Substrate {
                kd: self.colour(params, "Kd", 0.5)?,
                ks: self.colour(params, "Ks", 0.5)?,
                roughness: self.roughness(params, 0.1, Remap::V3)?,
            },
            "uber" => MaterialKind::Uber {
                kd: self.colour(params, "Kd", 0.25)?,
                ks: self.colour(params, "Ks", 0.25)?,
                kr: self.colour(params, "Kr", 0.0)?,
                kt: self.colour(params, "Kt", 0.0)?,
                roughness: self.roughness(params, 0.1, Remap::V3)?,
                eta: self.index_of_refraction(params)?,
                opacity: self.colour(params, "opacity", 1.0)?,
            },
            "mirror" => MaterialKind::Mirror {
                kr: self.colour(params, "Kr", 0.9)?,
            },
            "glass" => MaterialKind::Dielectric {
                kr: self.colour(params, "Kr", 1.0)?,
                kt: self.colour(params, "Kt", 1.0)?,
                eta: self.index_of_refraction(params)?,
                roughness: self.roughness(params, 0.0, Remap::V3)?,
                thin: false,
            },
            "phong" => MaterialKind::Phong {
                kd: self.colour(params, "Kd", 0.5)?,
                ks: self.colour(params, "Ks", 0.5)?,
                exponent: self.number(params, "exponent", 10.0)?,
            },
            "mix" => self.mix(params)?,
            _ => return Ok(None),
        }))
    }

    /// The materials of pbrt-v4, and those that neither linelit draws.
    fn v4_material(&mut self, kind: &str, params: &Params) -> Result<MaterialKind> {
        Ok(match kind {
            "diffuse" => MaterialKind::Matte {
                kd: self.colour(params, "reflectance", 0.5)?,
                sigma: self.number(params, "sigma", 0.0)?,
            },
            "conductor" => self.conductor(params, 0.0, Remap::V4)?,
            "dielectric" | "thindielectric" => MaterialKind::Dielectric {
                kr: Texture::number(1.0),
                kt: Texture::number(1.0),
                eta: self.index_of_refraction(params)?,
                roughness: self.roughness(params, 0.0, Remap::V4)?,
                thin: kind == "thindielectric",
            },
            "coateddiffuse" => {
                params.ignore(&["maxdepth", "nsamples", "g", "albedo"]);
                MaterialKind::CoatedDiffuse {
                    reflectance: self.colour(params, "reflectance", 0.5)?,
                    roughness: self.roughness(params, 0.0, Remap::V4)?,
                    eta: self.index_of_refraction(params)?,
                    thickness: params.float_or("thickness", 0.01)?,
                }
            }
            "diffusetransmission" => {
                let scale = params.float_or("scale", 1.0)?;
                let scaled = |t| Texture::Product(Arc::new(t), Arc::new(Texture::number(scale)));
                MaterialKind::DiffuseTransmission {
                    reflectance: scaled(self.colour(params, "reflectance", 0.25)?),
                    transmittance: scaled(self.colour(params, "transmittance", 0.25)?),
                }
            }
            _ if is_one_of(kind, MATERIALS) => {
                let message = format!("material `{kind}` is not supported");
                self.warn_at(
                    params,
                    ErrorKind::Unsupported,
                    message,
                    "replaced by its diffuse colour, or grey",
                )?;
                let given = ["Kd", "reflectance", "color"]
                    .into_iter()
                    .find(|n| params.list.iter().any(|p| p.name == *n));
                let kd = self.colour(params, given.unwrap_or("Kd"), 0.5)?;
                params.ignore_all();
                MaterialKind::Matte {
                    kd,
                    sigma: Texture::number(0.0),
                }
            }
            _ => return Err(unknown(params, "material", kind, MATERIALS)),
        })
    }

    /// A conductor by its index of refraction (default: copper), a named metal, or a colour.
    fn conductor(&mut self, params: &Params, roughness: f64, remap: Remap) -> Result<MaterialKind> {
        let roughness = self.roughness(params, roughness, remap)?;
        if params.list.iter().any(|p| p.name == "reflectance") {
            return Ok(MaterialKind::ColoredConductor {
                reflectance: self.colour(params, "reflectance", 0.5)?,
                roughness,
            });
        }
        let (mut eta, mut k) = color::named_metal("metal-Cu").unwrap_or((DVec3::ONE, DVec3::ONE));
        let types = [
            Type::Spectrum,
            Type::Rgb,
            Type::Xyz,
            Type::Float,
            Type::Texture,
            Type::Blackbody,
        ];
        let mut named = [false; 2];
        for (slot, (name, suffix)) in [("eta", "-eta"), ("k", "-k")].into_iter().enumerate() {
            let Some(param) = params.find(name, &types)? else {
                named[slot] = true;
                continue;
            };
            let metal = param.strings().first().and_then(|s| s.strip_suffix(suffix));
            if let Some((e, ks)) = metal.and_then(color::named_metal) {
                named[slot] = true;
                if slot == 0 { eta = e } else { k = ks }
            }
        }
        let mut texture = |name: &'static str, is_named: bool, value: DVec3| {
            if is_named {
                return Ok(Texture::Constant(value));
            }
            self.texture_param(params, name, Texture::Constant(value), false)
        };
        Ok(MaterialKind::Conductor {
            eta: texture("eta", named[0], eta)?,
            k: texture("k", named[1], k)?,
            roughness,
        })
    }

    /// v3: `namedmaterial1` has the share `amount`; v4: `materials`, the second has it.
    fn mix(&mut self, params: &Params) -> Result<MaterialKind> {
        let names: [String; 2] = match params.find("materials", &[Type::String])? {
            Some(param) => match param.strings() {
                [a, b] => [a.clone(), b.clone()],
                _ => {
                    let message = format!("`materials` of {} takes two names", params.owner);
                    return Err(param.error(
                        ErrorKind::BadParameter,
                        message,
                        "expected two names",
                    ));
                }
            },
            None => {
                let first = params.require("namedmaterial1", params.string("namedmaterial1")?)?;
                let second = params.require("namedmaterial2", params.string("namedmaterial2")?)?;
                [second.to_owned(), first.to_owned()]
            }
        };
        let amount = self.colour(params, "amount", 0.5)?;
        let mut materials = [0; 2];
        for (slot, name) in materials.iter_mut().zip(&names) {
            *slot = self.material_index(params, name)?.unwrap_or(0);
        }
        // Evaluating a mixture visits both parts, so nesting must stay shallow.
        let cost: usize = materials.iter().map(|m| self.mix_cost(*m)).sum();
        if cost > MOST_PARTS {
            let message = format!("{} is nested too deeply", params.owner);
            return Err(params.error(
                ErrorKind::Limit,
                message,
                &format!("more than {MOST_PARTS} parts"),
            ));
        }
        Ok(MaterialKind::Mix { materials, amount })
    }

    fn mix_cost(&self, material: u32) -> usize {
        match &self.base.builder.materials[material as usize].kind {
            MaterialKind::Mix { materials, .. } => {
                materials.iter().map(|m| self.mix_cost(*m)).sum()
            }
            _ => 1,
        }
    }
}
