//! The parameters of materials under the names that pbrt files have for them: one table by which
//! materials are read, and by which all textures of a material are found.

use crate::material::{MaterialKind, Roughness};
use crate::texture::Texture;

/// A parameter of a material: its name in files and the field that a reader sets.
#[derive(Debug)]
pub enum Parameter<'a> {
    /// A colour.
    Colour(&'static str, &'a mut Texture),
    /// A number.
    Number(&'static str, &'a mut Texture),
    /// A switch that only linelit has; in pbrt's files it is false.
    Own(&'static str, &'a mut bool),
    /// The index of refraction of a dielectric: `eta`, or pbrt-v3's `index`.
    Index(&'a mut Texture),
    /// The `eta` or `k` of a conductor: a colour, or the name of a metal.
    Metal(&'static str, &'a mut Texture),
    /// The roughness: `uroughness`, `vroughness` and `remaproughness`.
    Rough(&'a mut Roughness),
    /// The two materials of a mixture, which files name.
    Parts(&'a mut [u32; 2]),
}
use Parameter::{Colour, Index, Metal, Number, Own, Parts, Rough};

/// Defines `NAMES` and `parameters` from a table. Each entry has a model with its fields, and then
/// its type in pbrt text with its parameters; before that there may be other types and parameters
/// for the case that a condition holds.
macro_rules! table {
    ($self:ident, $v4:ident; $($model:ident($($field:ident),+):
        $(if $when:expr => $other:literal [$($p:ident($($k:literal,)? $f:ident)),+],)*
        $name:literal [$($parameter:ident($($key:literal,)? $value:ident)),+];)+) => {
        /// The types of all models in pbrt text, with repetitions.
        pub const NAMES: &[&str] = &[$($($other,)* $name),+];

        /// Returns the model's type in pbrt text, and its parameters. With `v4` they have the names
        /// of pbrt-v4, for the models that it has; otherwise the names of pbrt-v3 and linelit.
        ///
        /// ```
        /// use linelit_scene::geometry::DVec3;
        /// use linelit_scene::Material;
        ///
        /// let mut grey = Material::matte("grey", DVec3::splat(0.5));
        /// let (name, parameters) = grey.kind.parameters(true);
        /// assert_eq!((name, parameters.len()), ("diffuse", 2));
        /// ```
        pub fn parameters(&mut $self, $v4: bool) -> (&'static str, Vec<Parameter<'_>>) {
            match $self {
                $(Self::$model { $($field),+ } => {
                    $(if $when {
                        return ($other, vec![$($p($($k,)? $f)),+]);
                    })*
                    ($name, vec![$($parameter($($key,)? $value)),+])
                })+
            }
        }
    };
}

impl MaterialKind {
    table! { self, v4;
        Matte(kd, sigma):
            if v4 => "diffuse" [Colour("reflectance", kd), Number("sigma", sigma)],
            "matte" [Colour("Kd", kd), Number("sigma", sigma)];
        Plastic(kd, ks, roughness):
            "plastic" [Colour("Kd", kd), Colour("Ks", ks), Rough(roughness)];
        Substrate(kd, ks, roughness):
            "substrate" [Colour("Kd", kd), Colour("Ks", ks), Rough(roughness)];
        Conductor(eta, k, roughness):
            if v4 => "conductor" [Metal("eta", eta), Metal("k", k), Rough(roughness)],
            "metal" [Metal("eta", eta), Metal("k", k), Rough(roughness)];
        ColoredConductor(reflectance, roughness, schlick):
            "conductor" [Colour("reflectance", reflectance), Rough(roughness),
                Own("schlick", schlick)];
        Uber(kd, ks, kr, kt, roughness, eta, opacity):
            "uber" [Colour("Kd", kd), Colour("Ks", ks), Colour("Kr", kr), Colour("Kt", kt),
                Colour("opacity", opacity), Index(eta), Rough(roughness)];
        Mirror(kr): "mirror" [Colour("Kr", kr)];
        Dielectric(kr, kt, eta, roughness, thin):
            if *thin && v4 => "thindielectric" [Index(eta)],
            if *thin => "thindielectric" [Colour("Kr", kr), Colour("Kt", kt), Index(eta)],
            if v4 => "dielectric" [Index(eta), Rough(roughness)],
            "glass" [Colour("Kr", kr), Colour("Kt", kt), Index(eta), Rough(roughness)];
        CoatedDiffuse(reflectance, roughness, eta):
            "coateddiffuse" [Colour("reflectance", reflectance), Index(eta), Rough(roughness)];
        DiffuseTransmission(reflectance, transmittance):
            "diffusetransmission" [Colour("reflectance", reflectance),
                Colour("transmittance", transmittance)];
        // pbrt-v4 mixes by a number, pbrt-v3 by a colour.
        Mix(materials, amount):
            if v4 => "mix" [Parts(materials), Number("amount", amount)],
            "mix" [Parts(materials), Colour("amount", amount)];
        Phong(kd, ks, exponent):
            "phong" [Colour("Kd", kd), Colour("Ks", ks), Number("exponent", exponent)];
        Frostbite(kd, ks, roughness):
            "frostbite" [Colour("Kd", kd), Colour("Ks", ks), Number("roughness", roughness)];
    }

    /// Returns the model's name in pbrt-v3 or linelit, or in pbrt-v4 if only that has the model.
    pub fn name(&self) -> &'static str {
        self.clone().parameters(false).0
    }

    /// Returns the textures of all parameters.
    pub(crate) fn textures(&self) -> Vec<Texture> {
        let mut kind = self.clone();
        let mut all = Vec::new();
        for parameter in kind.parameters(false).1 {
            match parameter {
                Colour(_, t) | Number(_, t) | Metal(_, t) | Index(t) => all.push(t.clone()),
                Rough(roughness) => all.extend([roughness.u.clone(), roughness.v.clone()]),
                Own(..) | Parts(_) => {}
            }
        }
        all
    }
}
