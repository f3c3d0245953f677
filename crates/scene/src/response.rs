//! The reflection of a material at a point of a surface: the BSDF for the light of light sources,
//! and the directions in which mirrors and glass continue a camera ray.
//!
//! The models follow pbrt-v3 with its conventions. Plastic has the indices of refraction in its
//! Fresnel term interchanged (total reflection beyond 41.8°), glass scales transmitted radiance by
//! the square of the relative index, and roughness is α after the material's remapping.

use crate::differential::Change;
use crate::{
    Footprint, MaterialKind, RayDifferential, Roughness, SceneDescription, Surface, Texture,
};
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{
    Bsdf, Fresnel, Frostbite, Lambert, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate,
};
use linelit_geometry::DVec3;

/// The continuation of a camera ray by a perfect reflection or refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounce {
    /// The direction in which the ray continues, of unit length.
    pub direction: DVec3,
    /// The fraction of the radiance from that direction that reaches the viewer, for each channel.
    pub weight: DVec3,
    /// The continuations of the neighbouring rays, if the incident ray had differentials.
    pub beside: Option<RayDifferential>,
}

/// The reflection of a surface at a point.
#[derive(Clone, Debug)]
pub struct Response {
    /// The reflection of the light of light sources.
    pub bsdf: Bsdf,
    /// The continuations of the camera ray by perfect mirrors and glass; empty for most materials.
    pub bounces: Vec<Bounce>,
}

impl SceneDescription {
    /// Returns the reflection of a surface's material towards the unit direction `outgoing`, about
    /// the shading normal `normal` on the viewer's side. `beside` are the neighbouring rays of the
    /// camera ray that met the surface.
    #[inline]
    #[must_use]
    pub fn response(
        &self,
        surface: &Surface,
        outgoing: DVec3,
        normal: DVec3,
        beside: Option<&RayDifferential>,
    ) -> Response {
        let at = surface.footprint();
        // Take a Lambertian surface, the most common, without building layers.
        if let MaterialKind::Matte { kd, sigma } = &self.materials[surface.material as usize].kind
            && let Matte::Smooth(albedo) = Matte::new(colour(kd, at), sigma, at)
        {
            return Response {
                bsdf: Bsdf::Lambert(Lambert { albedo }),
                bounces: Vec::new(),
            };
        }
        // Add the layers and bounces of other materials.
        let mut builder = Builder {
            scene: self,
            surface,
            at,
            outgoing,
            normal,
            beside,
            layers: Layers::new(DVec3::ZERO),
            anisotropic: false,
            bounces: Vec::new(),
        };
        builder.material(surface.material, DVec3::ONE);
        // Set the tangent, if a lobe depends on it.
        let mut layers = builder.layers;
        if builder.anisotropic {
            let [dp_du, _] = self.tangents(surface.triangle);
            layers.set_tangent(dp_du);
        }
        Response {
            bsdf: layers.into(),
            bounces: builder.bounces,
        }
    }
}

/// Returns the value of a texture as a reflectance, clamped to [0, 1].
#[inline]
fn colour(texture: &Texture, at: Footprint) -> DVec3 {
    texture.evaluate(at).clamp(DVec3::ZERO, DVec3::ONE)
}

/// The reflection of a matte surface.
enum Matte {
    /// A Lambertian surface with this albedo.
    Smooth(DVec3),
    /// A rough surface.
    Rough(OrenNayar),
}

impl Matte {
    /// Creates the reflection for a roughness `sigma` in degrees.
    #[inline]
    fn new(albedo: DVec3, sigma: &Texture, at: Footprint) -> Self {
        let degrees = sigma.evaluate_number(at).clamp(0.0, 90.0);
        if degrees > 0.0 {
            Self::Rough(OrenNayar::new(albedo, degrees.to_radians()))
        } else {
            Self::Smooth(albedo)
        }
    }
}

/// Collects the lobes and bounces of a material, and of the parts of mixtures, at a point.
struct Builder<'a> {
    scene: &'a SceneDescription,
    surface: &'a Surface,
    at: Footprint,
    outgoing: DVec3,
    normal: DVec3,
    beside: Option<&'a RayDifferential>,
    layers: Layers,
    /// Whether a lobe has different roughness along and across the tangent.
    anisotropic: bool,
    bounces: Vec<Bounce>,
}

impl Builder<'_> {
    /// Adds a material, scaled by a factor.
    fn material(&mut self, index: u32, scale: DVec3) {
        let at = self.at;
        let colour = |t: &Texture| colour(t, at);
        match &self.scene.materials[index as usize].kind {
            // The parts of a mixture have smaller indices, so this ends.
            MaterialKind::Mix { materials, amount } => {
                let share = colour(amount);
                self.material(materials[0], scale * (DVec3::ONE - share));
                self.material(materials[1], scale * share);
            }
            MaterialKind::Matte { kd, sigma } => self.matte(scale, colour(kd), sigma),
            MaterialKind::Phong { kd, ks, exponent } => {
                self.phong(scale, [colour(kd), ks.evaluate(at)], exponent);
            }
            MaterialKind::Frostbite { kd, ks, roughness } => {
                self.frostbite(scale, [kd, ks].map(colour), roughness);
            }
            MaterialKind::Plastic { kd, ks, roughness } => {
                self.plastic([kd, ks].map(|t| scale * colour(t)), roughness);
            }
            MaterialKind::Substrate { kd, ks, roughness } => {
                self.substrate(scale, colour(kd), colour(ks), roughness);
            }
            MaterialKind::Conductor { eta, k, roughness } => {
                let [eta, k] = [eta, k].map(|t| t.evaluate(at).max(DVec3::ZERO));
                self.reflector(scale, roughness, Fresnel::Conductor { eta, k });
            }
            MaterialKind::ColoredConductor {
                reflectance,
                roughness,
                schlick,
            } => {
                let fresnel = coloured(colour(reflectance), *schlick);
                self.reflector(scale, roughness, fresnel);
            }
            MaterialKind::Uber {
                kd,
                ks,
                kr,
                kt,
                roughness,
                eta,
                opacity,
            } => self.uber(scale, [kd, ks, kr, kt, opacity], roughness, eta),
            MaterialKind::Mirror { kr } => self.mirror(scale * colour(kr)),
            MaterialKind::Dielectric {
                kr,
                kt,
                eta,
                roughness,
                thin,
            } => {
                let colours = [kr, kt].map(|t| scale * colour(t));
                self.glass(colours, eta, (!thin).then_some(roughness));
            }
            // Add the diffuse part only: see `Material::is_drawn_in_full`.
            MaterialKind::CoatedDiffuse { .. } | MaterialKind::DiffuseTransmission { .. } => {
                self.layers
                    .add_diffuse(scale * self.scene.diffuse_reflectance(index, at));
            }
        }
    }

    /// Adds a smooth or rough matte surface.
    fn matte(&mut self, scale: DVec3, albedo: DVec3, sigma: &Texture) {
        match Matte::new(albedo, sigma, self.at) {
            Matte::Smooth(albedo) => self.layers.add_diffuse(scale * albedo),
            Matte::Rough(rough) => self.lobe(scale, Lobe::OrenNayar(rough)),
        }
    }

    /// Adds plastic, a diffuse reflection and a glossy coat: the colours are `Kd` and `Ks`.
    fn plastic(&mut self, [kd, ks]: [DVec3; 2], roughness: &Roughness) {
        self.layers.add_diffuse(kd);
        self.reflector(ks, roughness, Fresnel::Dielectric { eta: 1.0 / 1.5 });
    }

    /// Adds a diffuse base under a glossy coat.
    fn substrate(&mut self, scale: DVec3, diffuse: DVec3, specular: DVec3, roughness: &Roughness) {
        let facets = self.facets(roughness);
        if diffuse != DVec3::ZERO || specular != DVec3::ZERO {
            let coat = Substrate {
                diffuse,
                specular,
                facets,
            };
            self.lobe(scale, Lobe::Substrate(coat));
        }
    }

    /// Adds pbrt's `uber`: diffuse and glossy reflection and a smooth interface. The colours are
    /// `Kd`, `Ks`, `Kr`, `Kt` and `opacity`; the ray goes straight on with one minus the opacity.
    fn uber(&mut self, scale: DVec3, colours: [&Texture; 5], roughness: &Roughness, eta: &Texture) {
        let colour = |t: &Texture| colour(t, self.at);
        let [kd, ks, kr, kt, opaque] = colours.map(colour);
        self.straight_on(scale * (DVec3::ONE - opaque));
        let scale = scale * opaque;
        let eta = index_of_refraction(eta.evaluate_number(self.at));
        self.layers.add_diffuse(scale * kd);
        self.reflector(scale * ks, roughness, Fresnel::Dielectric { eta });
        self.dielectric(scale * kr, scale * kt, eta);
    }

    /// Adds a diffuse reflection and a Phong lobe.
    fn phong(&mut self, scale: DVec3, [diffuse, specular]: [DVec3; 2], exponent: &Texture) {
        self.layers.add_diffuse(scale * diffuse);
        let exponent = exponent.evaluate_number(self.at).max(0.0);
        self.lobe(scale, Lobe::Phong(Phong { specular, exponent }));
    }

    /// Adds Frostbite's standard material.
    fn frostbite(&mut self, scale: DVec3, [diffuse, f0]: [DVec3; 2], roughness: &Texture) {
        let frostbite = Frostbite::new(diffuse, f0, roughness.evaluate_number(self.at));
        self.lobe(scale, Lobe::Frostbite(frostbite));
    }

    /// Adds glass: a smooth or rough interface, or a thin sheet, for which `roughness` is `None`.
    /// A rough interface only reflects: light from behind it is left out.
    fn glass(&mut self, [kr, kt]: [DVec3; 2], eta: &Texture, roughness: Option<&Roughness>) {
        let eta = index_of_refraction(eta.evaluate_number(self.at));
        let Some(roughness) = roughness else {
            return self.thin(kr, kt, eta);
        };
        if is_zero(&roughness.u, self.at) && is_zero(&roughness.v, self.at) {
            self.dielectric(kr, kt, eta);
        } else {
            let eta = if self.surface.outside { eta } else { 1.0 / eta };
            self.reflector(kr, roughness, Fresnel::Dielectric { eta });
        }
    }

    /// Adds a lobe. The layers of a surface have enough memory for the lobes of every mixture that
    /// readers accept.
    fn lobe(&mut self, scale: DVec3, lobe: Lobe) {
        let fits = self.layers.add(scale, lobe);
        debug_assert!(fits, "mixtures are bounded by the loader");
    }

    /// Returns the microfacets of a roughness, and remembers whether they need a tangent.
    fn facets(&mut self, roughness: &Roughness) -> TrowbridgeReitz {
        let facets = TrowbridgeReitz::new(roughness.alpha(self.at));
        self.anisotropic |= !facets.is_isotropic();
        facets
    }

    /// Adds a reflector: a lobe of microfacets, or a perfect mirror if the roughness is zero.
    fn reflector(&mut self, reflectance: DVec3, roughness: &Roughness, fresnel: Fresnel) {
        if roughness.alpha(self.at).iter().all(|a| *a <= 0.0) {
            let cosine = self.normal.dot(self.outgoing).abs();
            self.mirror(reflectance * fresnel.at(cosine));
        } else {
            let facets = self.facets(roughness);
            self.lobe(
                DVec3::ONE,
                Lobe::Reflector(Reflector {
                    reflectance,
                    facets,
                    fresnel,
                }),
            );
        }
    }

    /// Adds a continuation of the ray. `changes` are the differences between the directions of the
    /// neighbouring rays and this one. Continuations in the same direction are added up.
    fn bounce(&mut self, direction: DVec3, weight: DVec3, changes: Option<[DVec3; 2]>) {
        let Some(unit) = direction.try_normalize() else {
            return;
        };
        if weight == DVec3::ZERO {
            return;
        }
        let point = self.surface.point;
        let beside = changes.map(|changes| RayDifferential {
            origins: self.surface.covered.point.map(|change| point + change),
            directions: changes.map(|change| unit + change),
        });
        match self.bounces.iter_mut().find(|b| b.direction == unit) {
            Some(same) => same.weight += weight,
            None => self.bounces.push(Bounce {
                direction: unit,
                weight,
                beside,
            }),
        }
    }

    /// Returns the changes of the ray's direction and of the normal from one pixel to the next, if
    /// the ray has differentials.
    fn changes(&self) -> Option<[Change; 2]> {
        let beside = self.beside?;
        let turned = self.normal.dot(self.surface.shading_normal) < 0.0;
        let side = if turned { -1.0 } else { 1.0 };
        Some([0, 1].map(|k| Change {
            direction: beside.directions[k] + self.outgoing,
            normal: side * self.surface.covered.normal[k],
        }))
    }

    /// Adds a perfect reflection.
    fn mirror(&mut self, weight: DVec3) {
        let (n, wo) = (self.normal, self.outgoing);
        let changes = self.changes();
        let changes = changes.map(|two| two.map(|change| change.reflected(n, wo)));
        self.bounce(n * (2.0 * n.dot(wo)) - wo, weight, changes);
    }

    /// Adds the continuation of the ray in its own direction.
    fn straight_on(&mut self, weight: DVec3) {
        let changes = self.changes().map(|two| two.map(|change| change.direction));
        self.bounce(-self.outgoing, weight, changes);
    }

    /// Adds a smooth interface; `eta` is the index of refraction of the medium inside.
    fn dielectric(&mut self, kr: DVec3, kt: DVec3, eta: f64) {
        // Reflect by the Fresnel term.
        let relative = if self.surface.outside { eta } else { 1.0 / eta };
        let cosine = self.normal.dot(self.outgoing).abs();
        let reflected = Fresnel::Dielectric { eta: relative }.at(cosine);
        self.mirror(kr * reflected);
        // Refract, unless the reflection is total.
        let sine_square = (1.0 - cosine * cosine).max(0.0) / (relative * relative);
        if sine_square < 1.0 {
            let inner = (1.0 - sine_square).sqrt();
            let n = self.normal;
            // The cosine keeps its sign here: a shading normal may point away from the viewer.
            let refracted =
                n * (n.dot(self.outgoing) / relative - inner) - self.outgoing / relative;
            let weight = kt * (DVec3::ONE - reflected) / (relative * relative);
            let changes = self.changes();
            let changes =
                changes.map(|two| two.map(|c| c.refracted(n, self.outgoing, [relative, inner])));
            self.bounce(refracted, weight, changes);
        }
    }

    /// Adds a thin smooth sheet, with the sum of all reflections between its two sides.
    fn thin(&mut self, kr: DVec3, kt: DVec3, eta: f64) {
        let cosine = self.normal.dot(self.outgoing).abs();
        let r = Fresnel::Dielectric { eta }.at(cosine).x;
        let reflected = if r < 1.0 { 2.0 * r / (1.0 + r) } else { 1.0 };
        self.mirror(kr * reflected);
        self.straight_on(kt * (1.0 - reflected));
    }
}

/// Returns the Fresnel term for a reflectance r at normal incidence: Schlick's approximation, or
/// the term of the conductor that pbrt-v4 uses, with η = 1 and k = 2 √r / √(1 − r), where r is at
/// most 0.9999.
fn coloured(reflectance: DVec3, schlick: bool) -> Fresnel {
    if schlick {
        let (f0, f90) = (reflectance, 1.0);
        return Fresnel::Schlick { f0, f90 };
    }
    let k = |r: f64| {
        let r = r.min(0.9999);
        2.0 * r.sqrt() / (1.0 - r).sqrt()
    };
    Fresnel::Conductor {
        eta: DVec3::ONE,
        k: DVec3::from(reflectance.to_array().map(k)),
    }
}

/// Returns whether a roughness is zero at a point.
fn is_zero(roughness: &Texture, at: Footprint) -> bool {
    roughness.evaluate_number(at) <= 0.0
}

/// Returns the index of refraction of a material: the number `eta`, or 1.5 if that is not positive
/// or not finite, such as the 0 that pbrt-v4 writes for its default.
#[must_use]
pub fn index_of_refraction(eta: f64) -> f64 {
    if eta > 0.0 && eta.is_finite() {
        eta
    } else {
        1.5
    }
}
