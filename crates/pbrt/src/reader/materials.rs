//! `Material`, `MakeNamedMaterial` and `NamedMaterial`: the material models of both versions, with
//! pbrt's default values.

use super::lexer::{Lexer, Token};
use super::params::{Params, Type};
use super::state::Target;
use super::textures::{COLOUR, NUMBER};
use super::{Loader, is_one_of};
use crate::color;
use linelit_assembly::{ErrorKind, Result, nearest, shorten};
use linelit_geometry::DVec3;
use linelit_scene::{
    BumpMap, ImageTexture, Material, MaterialKind, NormalMap, Parameter, Remap, Roughness, Texture,
};
use std::sync::Arc;

/// The largest number of materials in a mixture that are not mixtures themselves; mixtures of more
/// are refused. The limit keeps the evaluation cheap, and the lobes fit into the layers of a
/// surface.
const MOST_PARTS: usize = 8;

/// The material types of pbrt for which there is no [`MaterialKind`].
const NOT_DRAWN: &str = "\
    coatedconductor disney fourier hair interface kdsubsurface measured none subsurface translucent";

/// The materials whose parameters have the names and the roughness of pbrt-v4.
const OF_V4: &str = "coateddiffuse conductor dielectric diffuse diffusetransmission thindielectric";

/// Returns the map from roughness to the α of microfacets in the model's version of pbrt.
fn remap(kind: &str) -> Remap {
    if is_one_of(kind, OF_V4) {
        Remap::V4
    } else {
        Remap::V3
    }
}

/// Returns a model by its type, with pbrt's default values; `None` for types that are not
/// supported.
#[allow(clippy::too_many_lines, reason = "a list")]
fn with_defaults(kind: &str) -> Option<MaterialKind> {
    // Find the model: there is one entry for each model of `MaterialKind`, except those that
    // `model` makes of other models.
    let number = Texture::number;
    let rough = |value| Roughness::isotropic(value, remap(kind));
    Some(match kind {
        "matte" | "diffuse" => MaterialKind::Matte {
            kd: number(0.5),
            sigma: number(0.0),
        },
        "plastic" => MaterialKind::Plastic {
            kd: number(0.25),
            ks: number(0.25),
            roughness: rough(0.1),
        },
        "metal" | "conductor" => MaterialKind::Conductor {
            eta: number(1.0),
            k: number(1.0),
            roughness: rough(if kind == "metal" { 0.01 } else { 0.0 }),
        },
        "substrate" => MaterialKind::Substrate {
            kd: number(0.5),
            ks: number(0.5),
            roughness: rough(0.1),
        },
        "uber" => MaterialKind::Uber {
            kd: number(0.25),
            ks: number(0.25),
            kr: number(0.0),
            kt: number(0.0),
            roughness: rough(0.1),
            eta: number(1.5),
            opacity: number(1.0),
        },
        "mirror" => MaterialKind::Mirror { kr: number(0.9) },
        "glass" | "dielectric" | "thindielectric" => MaterialKind::Dielectric {
            kr: number(1.0),
            kt: number(1.0),
            eta: number(1.5),
            roughness: rough(0.0),
            thin: kind == "thindielectric",
        },
        "coateddiffuse" => MaterialKind::CoatedDiffuse {
            reflectance: number(0.5),
            roughness: rough(0.0),
            eta: number(1.5),
        },
        "diffusetransmission" => MaterialKind::DiffuseTransmission {
            reflectance: number(0.25),
            transmittance: number(0.25),
        },
        "mix" => MaterialKind::Mix {
            materials: [0; 2],
            amount: number(0.5),
        },
        "phong" => MaterialKind::Phong {
            kd: number(0.5),
            ks: number(0.5),
            exponent: number(10.0),
        },
        "frostbite" => MaterialKind::Frostbite {
            kd: number(0.5),
            ks: number(0.04),
            roughness: number(0.5),
        },
        _ => return None,
    })
}

impl Loader {
    /// Executes `Material "matte" …`.
    pub(super) fn material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (kind, mut params) = self.named_params(lexer, token, "material")?;
        params.add_defaults(&self.state.defaults(Target::Material));
        self.state.material = self.build_material(&kind, &kind, &params)?;
        Ok(())
    }

    /// Executes `MakeNamedMaterial "name" "string type" "matte" …`.
    pub(super) fn make_named_material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, mut params) = self.named_params(lexer, token, "material")?;
        params.add_defaults(&self.state.defaults(Target::Material));
        let kind = params.require("type", params.string("type")?)?.to_owned();
        let index = self.build_material(&name, &kind, &params)?;
        self.materials.insert(name, index);
        Ok(())
    }

    /// Executes `NamedMaterial "name"`.
    pub(super) fn named_material(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, params) = self.named_params(lexer, token, "material")?;
        self.state.material = self.material_index(&params, &name)?;
        self.warn_unused(&params)
    }

    /// Returns the index of a named material; `None` if it is an `interface`.
    fn material_index(&self, params: &Params, name: &str) -> Result<Option<u32>> {
        if let Some(index) = self.materials.get(name) {
            return Ok(*index);
        }
        let names = self.materials.keys().map(String::as_str);
        let message = format!("unknown material `{}`", shorten(name));
        let label = "not defined by `MakeNamedMaterial`";
        let error = params.error(ErrorKind::UnknownName, message, label);
        Err(error.suggest(nearest(name, names)))
    }

    /// Adds a material of a type to the scene and returns its index; `None` for `interface`, which
    /// has no surface.
    fn build_material(&mut self, name: &str, kind: &str, params: &Params) -> Result<Option<u32>> {
        if ["", "none", "interface"].contains(&kind) {
            return self.warn_unused(params).map(|()| None);
        }
        let built = self.model(kind, params)?;
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
            let label = "without its coat or what shines through it";
            self.base.unsupported(message, label, params.at())?;
        }
        Ok(Some(self.base.builder.add_material(material)))
    }

    /// Reads a bump map: v3's `bumpmap` or v4's `displacement`.
    fn bump(&mut self, params: &Params) -> Result<Option<BumpMap>> {
        for (name, as_v3) in [("bumpmap", true), ("displacement", false)] {
            if params.find(name, NUMBER)?.is_some() {
                let height = self.texture_param(params, name, Texture::number(0.0), true)?;
                return Ok(Some(BumpMap { height, as_v3 }));
            }
        }
        Ok(None)
    }

    /// Reads pbrt-v4's `normalmap`, which is an image and not a texture.
    fn normal_map(&mut self, params: &Params) -> Result<Option<NormalMap>> {
        let Some(param) = params.text("normalmap")? else {
            return Ok(None);
        };
        let name = &param.strings()[0];
        let data = self.base.image(name, false, param.at_value(0))?;
        Ok(data.map(|data| NormalMap {
            texture: Texture::Image(Arc::new(ImageTexture::new(data))),
            scale: 1.0,
        }))
    }

    /// Reads the model of a type with its parameters.
    fn model(&mut self, kind: &str, params: &Params) -> Result<MaterialKind> {
        // Take the model with its defaults.
        let Some(mut model) = with_defaults(kind) else {
            return self.unsupported_material(kind, params);
        };
        if let MaterialKind::Conductor { roughness, .. } = &model
            && kind == "conductor"
            && params.has("reflectance")
        {
            model = MaterialKind::ColoredConductor {
                reflectance: Texture::number(0.5),
                roughness: roughness.clone(),
                schlick: false,
            };
        }
        // Ignore the medium inside a coat, and the number of its samples.
        if matches!(model, MaterialKind::CoatedDiffuse { .. }) {
            params.ignore(&["maxdepth", "nsamples", "g", "albedo", "thickness"]);
        }
        // Read the parameters.
        for parameter in model.parameters(is_one_of(kind, OF_V4)).1 {
            match parameter {
                Parameter::Colour(name, texture) => {
                    *texture = self.texture_param(params, name, texture.clone(), false)?;
                }
                Parameter::Number(name, texture) => {
                    *texture = self.texture_param(params, name, texture.clone(), true)?;
                }
                Parameter::Own(name, value) => *value = params.bool_or(name, *value)?,
                Parameter::Index(eta) => *eta = self.index_of_refraction(params)?,
                Parameter::Metal(name, texture) => *texture = self.metal(params, name)?,
                Parameter::Rough(roughness) => self.roughness(params, roughness)?,
                Parameter::Parts(parts) => *parts = self.parts(params)?,
            }
        }
        // Scale both colours of a diffuse transmission.
        if let MaterialKind::DiffuseTransmission {
            reflectance,
            transmittance,
        } = &mut model
        {
            let scale = Arc::new(Texture::number(params.float_or("scale", 1.0)?));
            for texture in [reflectance, transmittance] {
                *texture = Texture::Product(Arc::new(texture.clone()), Arc::clone(&scale));
            }
        }
        Ok(model)
    }

    /// Replaces a material that is not supported by a matte of its diffuse colour, with a warning.
    fn unsupported_material(&mut self, kind: &str, params: &Params) -> Result<MaterialKind> {
        if !is_one_of(kind, NOT_DRAWN) {
            let names = MaterialKind::NAMES.iter().copied();
            return Err(params.unknown("material", kind, names.chain(NOT_DRAWN.split(' '))));
        }
        let message = format!("material `{kind}` is not supported");
        let label = "replaced by its diffuse colour, or grey";
        self.base.unsupported(message, label, params.at())?;
        let mut names = ["Kd", "reflectance", "color"].into_iter();
        let given = names.find(|name| params.has(name)).unwrap_or("Kd");
        let kd = self.texture_param(params, given, Texture::number(0.5), false)?;
        params.ignore_all();
        let sigma = Texture::number(0.0);
        Ok(MaterialKind::Matte { kd, sigma })
    }

    /// Reads `roughness`, or `uroughness` and `vroughness`, and `remaproughness`.
    fn roughness(&mut self, params: &Params, roughness: &mut Roughness) -> Result<()> {
        let both = self.texture_param(params, "roughness", roughness.u.clone(), true)?;
        roughness.u = self.texture_param(params, "uroughness", both.clone(), true)?;
        roughness.v = self.texture_param(params, "vroughness", both, true)?;
        if !params.bool_or("remaproughness", true)? {
            roughness.remap = Remap::None;
        }
        Ok(())
    }

    /// Reads the index of refraction, `index` or `eta`.
    fn index_of_refraction(&mut self, params: &Params) -> Result<Texture> {
        let index = self.texture_param(params, "index", Texture::number(1.5), true)?;
        let named = params.find("eta", &[Type::Float, Type::Texture, Type::Spectrum])?;
        if named.is_some_and(|p| p.ty == Type::Spectrum) {
            let message = "a spectral index of refraction is not supported";
            self.base.unsupported(message, "read as 1.5", params.at())?;
            return Ok(Texture::number(1.5));
        }
        self.texture_param(params, "eta", index, true)
    }

    /// Reads `eta` or `k` of a conductor: a colour, or the name of a metal. The default is copper.
    fn metal(&mut self, params: &Params, name: &'static str) -> Result<Texture> {
        let given = params.find(name, COLOUR)?.and_then(|p| p.strings().first());
        let metal = match given {
            Some(value) => value
                .strip_suffix(name)
                .and_then(|metal| metal.strip_suffix('-')),
            None => Some("metal-Cu"),
        };
        let of_metal = metal.and_then(color::named_metal);
        let of_metal = of_metal.map(|(eta, k)| if name == "eta" { eta } else { k });
        match of_metal {
            Some(value) if given.is_some() => Ok(Texture::Constant(value)),
            value => {
                let default = Texture::Constant(value.unwrap_or(DVec3::ONE));
                self.texture_param(params, name, default, false)
            }
        }
    }

    /// Reads the two materials of a mixture. The weight `amount` is for v3's `namedmaterial1`, and
    /// for the second of v4's `materials`; the material with this weight comes second in the
    /// result.
    fn parts(&mut self, params: &Params) -> Result<[u32; 2]> {
        // Read the names.
        let names: [String; 2] = match params.find("materials", &[Type::String])? {
            Some(param) => match param.strings() {
                [a, b] => [a.clone(), b.clone()],
                _ => {
                    let message = format!("`materials` of {} takes two names", params.owner);
                    return Err(param.bad(message, "expected two names"));
                }
            },
            None => {
                let first = params.require("namedmaterial1", params.string("namedmaterial1")?)?;
                let second = params.require("namedmaterial2", params.string("namedmaterial2")?)?;
                [second.to_owned(), first.to_owned()]
            }
        };
        // Find the materials, which must not have too many parts themselves.
        let mut materials = [0; 2];
        for (slot, name) in materials.iter_mut().zip(&names) {
            *slot = self.material_index(params, name)?.unwrap_or(0);
        }
        // Evaluating a mixture visits all of its parts, so that their number must be small.
        let cost: usize = materials.iter().map(|m| self.mix_cost(*m)).sum();
        if cost > MOST_PARTS {
            let message = format!("{} is nested too deeply", params.owner);
            let label = format!("more than {MOST_PARTS} parts");
            return Err(params.error(ErrorKind::Limit, message, &label));
        }
        Ok(materials)
    }

    /// Returns the number of parts of a material that are not mixtures.
    fn mix_cost(&self, material: u32) -> usize {
        match &self.base.builder.materials[material as usize].kind {
            MaterialKind::Mix { materials, .. } => {
                materials.iter().map(|m| self.mix_cost(*m)).sum()
            }
            _ => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each name of a model is read as this model, with the parameters and the roughness of the
    /// right version.
    #[test]
    fn models_are_read_by_their_names() {
        for name in MaterialKind::NAMES {
            let mut model = with_defaults(name).expect(name);
            let of_v4 = is_one_of(name, OF_V4);
            assert_eq!(model.parameters(of_v4).0, *name);
        }
        for name in NOT_DRAWN.split(' ') {
            assert!(with_defaults(name).is_none(), "{name}");
        }
    }
}
