//! Materials with the parameters of the files, whether or not the renderer uses all of them.

use crate::footprint::Footprint;
use crate::texture::{ImageTexture, Texture};
use linelit_elementary::ln;
use linelit_geometry::DVec3;

/// A material with its name in the file (or its type, if it has none).
#[derive(Clone, Debug)]
pub struct Material {
    /// The name that messages give it.
    pub name: String,
    /// The model and its parameters.
    pub kind: MaterialKind,
    /// A bump map.
    pub bump: Option<BumpMap>,
    /// A normal map; a bump map goes before.
    pub normal_map: Option<NormalMap>,
}

/// A height over the surface.
#[derive(Clone, Debug)]
pub struct BumpMap {
    /// The height, in units of the scene.
    pub height: Texture,
    /// Whether bumps are as in pbrt-v3 (and v2) on meshes with vertex normals: as if the texture's
    /// coordinates ran over the surface at unit speed, backwards. The slope of a bump is then that
    /// of its height over texture coordinates, whatever their scale on the surface, and inverted.
    pub as_v3: bool,
}

/// Normals in the tangent space of a surface, as colours: component `c` is `2 c − 1`.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// x along the first texture coordinate, y along the second (upwards), z outwards.
    pub texture: Texture,
    /// Factor on x and y.
    pub scale: f64,
}

/// Microfacet roughness along the two tangents.
#[derive(Clone, Debug)]
pub struct Roughness {
    /// Along u.
    pub u: Texture,
    /// Along v.
    pub v: Texture,
    /// Whether the numbers are to be remapped to the Trowbridge–Reitz α. pbrt-v3:
    /// a polynomial in ln r ([`Roughness::alpha`]); pbrt-v4: √r.
    pub remap: Remap,
}

/// The map from a roughness to the α of a microfacet distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remap {
    /// The number is α.
    None,
    /// pbrt-v3's polynomial in the logarithm.
    V3,
    /// pbrt-v4's square root.
    V4,
}

impl Remap {
    /// The α of a roughness.
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

    /// α along u and v.
    pub fn alpha(&self, at: impl Into<Footprint>) -> [f64; 2] {
        let at = at.into();
        [&self.u, &self.v].map(|r| self.remap.alpha(r.evaluate_number(at)))
    }
}

/// The material models of pbrt-v3 and pbrt-v4 that linelit reads, and two of its own (`Phong`,
/// `Frostbite`).
///
/// Reflectances are linear RGB in [0, 1]; indices of refraction are relative to vacuum.
#[derive(Clone, Debug)]
pub enum MaterialKind {
    /// Lambert (v3 `matte`, v4 `diffuse`), or Oren–Nayar if `sigma` is not zero.
    Matte {
        /// Diffuse reflectance.
        kd: Texture,
        /// Oren–Nayar roughness in degrees.
        sigma: Texture,
    },
    /// v3 `plastic`: Lambert plus a dielectric microfacet lobe.
    Plastic {
        /// Diffuse reflectance.
        kd: Texture,
        /// Factor on the glossy lobe.
        ks: Texture,
        /// Roughness of the glossy lobe.
        roughness: Roughness,
    },
    /// v3 `metal`, v4 `conductor`: microfacets of a conductor.
    Conductor {
        /// Index of refraction.
        eta: Texture,
        /// Absorption coefficient.
        k: Texture,
        /// Roughness of the microfacets.
        roughness: Roughness,
    },
    /// v4 `conductor` with a colour: microfacets of a conductor with η = 1 and the k of this
    /// reflectance, or with Schlick's Fresnel term, as in glTF.
    ColoredConductor {
        /// Reflectance at normal incidence.
        reflectance: Texture,
        /// Roughness of the microfacets.
        roughness: Roughness,
        /// Whether the Fresnel term is Schlick's.
        schlick: bool,
    },
    /// v3 `substrate`: Ashikhmin and Shirley's diffuse base under a glossy coat.
    Substrate {
        /// Diffuse reflectance.
        kd: Texture,
        /// Reflectance of the coat at normal incidence.
        ks: Texture,
        /// Roughness of the coat.
        roughness: Roughness,
    },
    /// v3 `uber`.
    Uber {
        /// Diffuse reflectance.
        kd: Texture,
        /// Glossy reflectance.
        ks: Texture,
        /// Mirror reflectance.
        kr: Texture,
        /// Specular transmittance.
        kt: Texture,
        /// Roughness of the glossy lobe.
        roughness: Roughness,
        /// Index of refraction.
        eta: Texture,
        /// The surface scales by this; the rest passes straight through.
        opacity: Texture,
    },
    /// v3 `mirror`.
    Mirror {
        /// Reflectance.
        kr: Texture,
    },
    /// v3 `glass`, v4 `dielectric` and `thindielectric`.
    Dielectric {
        /// Factor on reflection.
        kr: Texture,
        /// Factor on transmission.
        kt: Texture,
        /// Index of refraction.
        eta: Texture,
        /// Roughness of the interface; zero: smooth.
        roughness: Roughness,
        /// A sheet without thickness: transmission goes straight on.
        thin: bool,
    },
    /// v4 `coateddiffuse`: Lambert under a rough dielectric.
    CoatedDiffuse {
        /// Diffuse reflectance of the base.
        reflectance: Texture,
        /// Roughness of the coat.
        roughness: Roughness,
        /// Index of refraction of the coat.
        eta: Texture,
    },
    /// v4 `diffusetransmission`.
    DiffuseTransmission {
        /// Diffuse reflectance.
        reflectance: Texture,
        /// Diffuse transmittance.
        transmittance: Texture,
    },
    /// A mixture of two materials of the scene.
    Mix {
        /// Indices into the scene's materials; both are smaller than the mixture's own.
        materials: [u32; 2],
        /// Share of the second.
        amount: Texture,
    },
    /// Our own: Lambert plus a normalised Phong lobe,
    /// f = kd/π + ks (e + 2)/(2π) max(0, ωi·R)^e.
    Phong {
        /// Diffuse reflectance.
        kd: Texture,
        /// Reflectance of the lobe at normal incidence.
        ks: Texture,
        /// e, any real number ≥ 0.
        exponent: Texture,
    },
    /// Our own: Frostbite's standard material, Disney's diffuse reflection and a coat of
    /// microfacets.
    Frostbite {
        /// Diffuse reflectance.
        kd: Texture,
        /// Reflectance of the coat at normal incidence.
        ks: Texture,
        /// Linear roughness, in [0, 1]: α is its square.
        roughness: Texture,
    },
}

impl Material {
    /// pbrt's default: Lambert with reflectance one half.
    pub fn default_matte() -> Self {
        Self::matte("default", DVec3::splat(0.5))
    }

    /// Lambert with a constant reflectance.
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

    /// Reflectance of the diffuse part alone, in [0, 1], linear RGB; zero for mirrors, metals and
    /// glass. A `mix` is black here: [`crate::SceneDescription::diffuse_reflectance`] resolves it.
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

    /// All textures: of the model's parameters, and of bump and normal maps.
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

    /// Whether a texture is not the same everywhere, so that it matters what a pixel covers.
    pub(crate) fn varies(&self) -> bool {
        self.textures().any(|texture| texture.varies())
    }

    /// Whether the estimators draw all of the material: no coat is missing, nor light from behind.
    /// Of a mixture, its parts say so themselves.
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
