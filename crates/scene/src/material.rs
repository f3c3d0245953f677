//! Materials: the models of pbrt-v3 and pbrt-v4 with their parameters as textures. A scene has all
//! parameters of its file, also those that the renderer does not use
//! ([`Material::is_drawn_in_full`]); `response.rs` makes reflections of them.

use crate::footprint::Footprint;
use crate::texture::{ImageTexture, Texture};
use linelit_elementary::ln;
use linelit_geometry::DVec3;

/// A material with its name in the file (or its type, if it has none).
#[derive(Clone, Debug)]
pub struct Material {
    /// The name, which messages use.
    pub name: String,
    /// The model and its parameters.
    pub kind: MaterialKind,
    /// The bump map, if any.
    pub bump: Option<BumpMap>,
    /// The normal map, if any; it is ignored if there is a bump map.
    pub normal_map: Option<NormalMap>,
}

/// A bump map: a height over the surface, by whose slopes the shading normal is tilted.
#[derive(Clone, Debug)]
pub struct BumpMap {
    /// The height, in units of the scene.
    pub height: Texture,
    /// Whether meshes with vertex normals have bumps as in pbrt-v3 (and v2). There the slope of a
    /// bump is the slope of its height over the texture coordinates, for any scale of these on the
    /// surface, and bumps are inverted.
    pub as_v3: bool,
}

/// A normal map: normals in the tangent space of a surface, stored as colours. The component of the
/// normal is `2 c − 1` for the component `c` of the colour.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The colours: red is x along the first texture coordinate, green y along the second
    /// (upwards), and blue z outwards.
    pub texture: Texture,
    /// A factor on x and y.
    pub scale: f64,
}

/// The roughness of microfacets along the two tangents.
#[derive(Clone, Debug)]
pub struct Roughness {
    /// The roughness along u.
    pub u: Texture,
    /// The roughness along v.
    pub v: Texture,
    /// The map from the values of `u` and `v` to the α of the Trowbridge–Reitz distribution.
    pub remap: Remap,
}

/// The map from a roughness to the α of a microfacet distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remap {
    /// The roughness is α itself.
    None,
    /// The polynomial in the logarithm of the roughness that pbrt-v3 uses.
    V3,
    /// The square root, which pbrt-v4 uses.
    V4,
}

impl Remap {
    /// Returns the α of the microfacet distribution for a roughness.
    ///
    /// pbrt-v3: α = 1.62142 + 0.819955 x + 0.1734 x² + 0.0171201 x³ + 0.000640711 x⁴ with
    /// x = ln max(r, 1e-3); pbrt-v4: α = √r.
    pub fn alpha(self, roughness: f64) -> f64 {
        match self {
            Self::None => roughness,
            Self::V3 => {
                let x = ln(roughness.max(1e-3));
                1.62142 + x * (0.819_955 + x * (0.1734 + x * (0.017_120_1 + x * 0.000_640_711)))
            }
            Self::V4 => roughness.max(0.0).sqrt(),
        }
    }
}

impl Roughness {
    /// Creates a roughness that is the same along both tangents.
    pub fn isotropic(value: f64, remap: Remap) -> Self {
        Self {
            u: Texture::number(value),
            v: Texture::number(value),
            remap,
        }
    }

    /// Returns the α of the microfacet distribution along the tangents u and v.
    pub fn alpha(&self, at: impl Into<Footprint>) -> [f64; 2] {
        let at = at.into();
        [&self.u, &self.v].map(|r| self.remap.alpha(r.evaluate_number(at)))
    }
}

/// The material models of pbrt-v3 and pbrt-v4 that linelit reads, and two of its own (`Phong`,
/// `Frostbite`).
///
/// Below, v3 and v4 are the versions of pbrt. Reflectances are linear RGB colours in [0, 1];
/// indices of refraction are relative to vacuum.
#[derive(Clone, Debug)]
pub enum MaterialKind {
    /// A Lambertian surface (v3 `matte`, v4 `diffuse`), or Oren and Nayar's if `sigma` is not zero.
    Matte {
        /// The diffuse reflectance.
        kd: Texture,
        /// The roughness of the model of Oren and Nayar, in degrees.
        sigma: Texture,
    },
    /// A Lambertian surface with a glossy lobe of dielectric microfacets (v3 `plastic`).
    Plastic {
        /// The diffuse reflectance.
        kd: Texture,
        /// The factor on the glossy lobe.
        ks: Texture,
        /// The roughness of the glossy lobe.
        roughness: Roughness,
    },
    /// Microfacets of a conductor (v3 `metal`, v4 `conductor`).
    Conductor {
        /// The index of refraction.
        eta: Texture,
        /// The absorption coefficient.
        k: Texture,
        /// The roughness of the microfacets.
        roughness: Roughness,
    },
    /// Microfacets of a conductor that is given by its colour (v4 `conductor`). Its η is 1 and its
    /// k follows from the reflectance; or the Fresnel term is Schlick's, as in glTF.
    ColoredConductor {
        /// The reflectance at normal incidence.
        reflectance: Texture,
        /// The roughness of the microfacets.
        roughness: Roughness,
        /// Whether the Fresnel term is Schlick's.
        schlick: bool,
    },
    /// A diffuse base under a glossy coat, by the model of Ashikhmin and Shirley (v3 `substrate`).
    Substrate {
        /// The diffuse reflectance.
        kd: Texture,
        /// The reflectance of the coat at normal incidence.
        ks: Texture,
        /// The roughness of the coat.
        roughness: Roughness,
    },
    /// Diffuse and glossy reflection, with perfect reflection and transmission (v3 `uber`).
    Uber {
        /// The diffuse reflectance.
        kd: Texture,
        /// The reflectance of the glossy lobe.
        ks: Texture,
        /// The reflectance of the mirror.
        kr: Texture,
        /// The transmittance of the refraction.
        kt: Texture,
        /// The roughness of the glossy lobe.
        roughness: Roughness,
        /// The index of refraction.
        eta: Texture,
        /// The factor on all of the above; one minus this factor is the fraction of light that
        /// passes straight through the surface.
        opacity: Texture,
    },
    /// A perfect mirror (v3 `mirror`).
    Mirror {
        /// The reflectance.
        kr: Texture,
    },
    /// Glass: the smooth or rough surface of a dielectric, or a thin sheet of it (v3 `glass`, v4
    /// `dielectric` and `thindielectric`).
    Dielectric {
        /// The factor on reflection.
        kr: Texture,
        /// The factor on transmission.
        kt: Texture,
        /// The index of refraction.
        eta: Texture,
        /// The roughness of the interface; an interface of roughness zero is smooth.
        roughness: Roughness,
        /// Whether the surface is a sheet without thickness, through which light passes straight
        /// on.
        thin: bool,
    },
    /// A Lambertian surface under a rough dielectric coat (v4 `coateddiffuse`).
    CoatedDiffuse {
        /// The diffuse reflectance of the base.
        reflectance: Texture,
        /// The roughness of the coat.
        roughness: Roughness,
        /// The index of refraction of the coat.
        eta: Texture,
    },
    /// A surface that reflects and transmits light diffusely (v4 `diffusetransmission`).
    DiffuseTransmission {
        /// The diffuse reflectance.
        reflectance: Texture,
        /// The diffuse transmittance.
        transmittance: Texture,
    },
    /// A mixture of two materials of the scene (v3 and v4 `mix`).
    Mix {
        /// The indices into the scene's materials; both are smaller than the mixture's own.
        materials: [u32; 2],
        /// The weight of the second material.
        amount: Texture,
    },
    /// A Lambertian surface with a normalised Phong lobe, a model of linelit's own:
    /// f = kd/π + ks (e + 2)/(2π) max(0, ωi·R)^e.
    Phong {
        /// The diffuse reflectance.
        kd: Texture,
        /// The reflectance of the lobe at normal incidence.
        ks: Texture,
        /// The exponent e, any real number ≥ 0.
        exponent: Texture,
    },
    /// The standard material of the Frostbite engine, a model of linelit's own: Disney's diffuse
    /// reflection and a coat of microfacets.
    Frostbite {
        /// The diffuse reflectance.
        kd: Texture,
        /// The reflectance of the coat at normal incidence.
        ks: Texture,
        /// The linear roughness, in [0, 1]; α is its square.
        roughness: Texture,
    },
}

impl Material {
    /// Creates the default material of pbrt: a Lambertian surface with reflectance one half.
    pub fn default_matte() -> Self {
        Self::matte("default", DVec3::splat(0.5))
    }

    /// Creates a Lambertian surface with a constant reflectance.
    pub fn matte(name: impl Into<String>, kd: DVec3) -> Self {
        Self {
            name: name.into(),
            kind: MaterialKind::Matte {
                kd: Texture::Constant(kd),
                sigma: Texture::number(0.0),
            },
            bump: None,
            normal_map: None,
        }
    }

    /// Returns the reflectance of the diffuse part alone, a linear RGB colour in [0, 1]; zero for
    /// mirrors, metals and glass. It is also zero for a `mix`, whose parts only
    /// [`crate::SceneDescription::diffuse_reflectance`] knows.
    ///
    /// ```
    /// use linelit_scene::geometry::{DVec2, DVec3};
    /// use linelit_scene::Material;
    ///
    /// let red = Material::matte("red", DVec3::new(0.5, 0.0, 0.0));
    /// assert_eq!(red.diffuse_reflectance(DVec2::ZERO).x, 0.5);
    /// ```
    pub fn diffuse_reflectance(&self, at: impl Into<Footprint>) -> DVec3 {
        let at = at.into();
        let value = match &self.kind {
            MaterialKind::Matte { kd, .. }
            | MaterialKind::Plastic { kd, .. }
            | MaterialKind::Substrate { kd, .. }
            | MaterialKind::Phong { kd, .. }
            | MaterialKind::Frostbite { kd, .. } => kd.evaluate(at),
            MaterialKind::Uber { kd, opacity, .. } => kd.evaluate(at) * opacity.evaluate(at),
            MaterialKind::CoatedDiffuse { reflectance, .. }
            | MaterialKind::DiffuseTransmission { reflectance, .. } => reflectance.evaluate(at),
            MaterialKind::Conductor { .. }
            | MaterialKind::ColoredConductor { .. }
            | MaterialKind::Mirror { .. }
            | MaterialKind::Dielectric { .. }
            | MaterialKind::Mix { .. } => DVec3::ZERO,
        };
        value.clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Returns all textures of the model's parameters and of bump and normal maps.
    fn textures(&self) -> impl Iterator<Item = Texture> {
        let relief = self.normal_map.iter().map(|map| &map.texture);
        let relief = relief.chain(self.bump.iter().map(|map| &map.height));
        self.kind.textures().into_iter().chain(relief.cloned())
    }

    /// Calls a function with every image of the material's textures.
    pub(crate) fn for_each_image(&self, f: &mut dyn FnMut(&ImageTexture)) {
        self.textures()
            .for_each(|texture| texture.for_each_image(f));
    }

    /// Returns whether any texture varies over a surface, so that lookups need the footprint of a
    /// pixel.
    pub(crate) fn varies(&self) -> bool {
        self.textures().any(|texture| texture.varies())
    }

    /// Returns whether renderings show all of the material. Of a coated diffuse surface the coat is
    /// missing, and light from behind is missing where a surface transmits diffusely or is rough
    /// glass. For a mixture it is true, as its materials are checked separately.
    pub fn is_drawn_in_full(&self) -> bool {
        match &self.kind {
            MaterialKind::CoatedDiffuse { .. } => false,
            MaterialKind::DiffuseTransmission { transmittance, .. } => {
                transmittance.as_constant() == Some(DVec3::ZERO)
            }
            // Rough glass reflects, but shows no light from behind.
            MaterialKind::Dielectric { roughness, .. } => [&roughness.u, &roughness.v]
                .iter()
                .all(|r| r.as_constant() == Some(DVec3::ZERO)),
            _ => true,
        }
    }
}
