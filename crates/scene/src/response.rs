//! From a material of the scene at a surface to its reflection: the lobes that lights reflect
//! in, and the directions into which mirrors and glass send the view on.
//!
//! The models are pbrt-v3's, with its conventions: plastic has its Fresnel term the wrong way round
//! (total reflection beyond 41.8°), glass scales transmitted radiance by the square of the relative
//! index, roughness is α after the material's remapping.

use crate::differential::Change;
use crate::{
    Footprint, MaterialKind, RayDifferential, Roughness, SceneDescription, Surface, Texture,
};
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{
    Bsdf, Fresnel, Frostbite, Lambert, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate,
};
use linelit_geometry::DVec3;

/// A perfect reflection or refraction of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounce {
    /// The direction in which the view continues, unit length.
    pub direction: DVec3,
    /// The fraction of the light from there that reaches the viewer, by channel.
    pub weight: DVec3,
    /// The rays beside it, if the ray that met the surface had some.
    pub beside: Option<RayDifferential>,
}

/// The reflection of a surface at a point.
#[derive(Clone, Debug)]
pub struct Response {
    /// The lobes that lights reflect in.
    pub bsdf: Bsdf,
    /// The continuations of the view by perfect mirrors and glass; empty for most materials.
    pub bounces: Vec<Bounce>,
}

impl SceneDescription {
    /// Returns the reflection of a surface's material towards the unit direction `outgoing`, about
    /// the shading normal `normal` on the viewer's side; `beside` are the rays through the
    /// neighbouring pixels.
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
        // Most surfaces, for which there is nothing to build.
        if let MaterialKind::Matte { kd, sigma } = &self.materials[surface.material as usize].kind
            && let Matte::Smooth(albedo) = Matte::new(colour(kd, at), sigma, at)
        {
            return Response {
                bsdf: Bsdf::Lambert(Lambert { albedo }),
                bounces: Vec::new(),
            };
        }
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

/// A texture as a colour.
#[inline]
fn colour(texture: &Texture, at: Footprint) -> DVec3 {
    texture.evaluate(at).clamp(DVec3::ZERO, DVec3::ONE)
}

/// The reflection of a matte surface.
enum Matte {
    /// A Lambertian surface with this albedo.
    Smooth(DVec3),
    Rough(OrenNayar),
}

impl Matte {
    /// Roughness in degrees.
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

struct Builder<'a> {
    scene: &'a SceneDescription,
    surface: &'a Surface,
    at: Footprint,
    outgoing: DVec3,
    normal: DVec3,
    beside: Option<&'a RayDifferential>,
    layers: Layers,
    anisotropic: bool,
    bounces: Vec<Bounce>,
}

impl Builder<'_> {
    /// Adds a material, scaled.
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
            // Their diffuse part only: see `Material::is_drawn_in_full`.
            MaterialKind::CoatedDiffuse { .. } | MaterialKind::DiffuseTransmission { .. } => {
                self.layers
                    .add_diffuse(scale * self.scene.diffuse_reflectance(index, at));
            }
        }
    }

    fn matte(&mut self, scale: DVec3, albedo: DVec3, sigma: &Texture) {
        match Matte::new(albedo, sigma, self.at) {
            Matte::Smooth(albedo) => self.layers.add_diffuse(scale * albedo),
            Matte::Rough(rough) => self.lobe(scale, Lobe::OrenNayar(rough)),
        }
    }

    /// Diffuse under pbrt's glossy coat of plastic: colours are `Kd` and `Ks`.
    fn plastic(&mut self, [kd, ks]: [DVec3; 2], roughness: &Roughness) {
        self.layers.add_diffuse(kd);
        self.reflector(ks, roughness, Fresnel::Dielectric { eta: 1.0 / 1.5 });
    }

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

    /// Diffuse and glossy reflection with a smooth interface: colours are `Kd`, `Ks`, `Kr`, `Kt`
    /// and `opacity`, without which the view goes straight on.
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

    fn phong(&mut self, scale: DVec3, [diffuse, specular]: [DVec3; 2], exponent: &Texture) {
        self.layers.add_diffuse(scale * diffuse);
        let exponent = exponent.evaluate_number(self.at).max(0.0);
        self.lobe(scale, Lobe::Phong(Phong { specular, exponent }));
    }

    fn frostbite(&mut self, scale: DVec3, [diffuse, f0]: [DVec3; 2], roughness: &Texture) {
        let frostbite = Frostbite::new(diffuse, f0, roughness.evaluate_number(self.at));
        self.lobe(scale, Lobe::Frostbite(frostbite));
    }

    /// A smooth or rough interface, or a sheet, which has no roughness; of a rough interface, light
    /// from behind is not asked for.
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

    /// Adds a lobe. There is room for the parts of every mixture that loaders admit.
    fn lobe(&mut self, scale: DVec3, lobe: Lobe) {
        let fits = self.layers.add(scale, lobe);
        debug_assert!(fits, "mixtures are bounded by the loader");
    }

    fn facets(&mut self, roughness: &Roughness) -> TrowbridgeReitz {
        let facets = TrowbridgeReitz::new(roughness.alpha(self.at));
        self.anisotropic |= !facets.is_isotropic();
        facets
    }

    /// A rough mirror, or a perfect one.
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

    /// Adds a direction, with the differences to it of the rays beside.
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

    /// Returns how the view's direction and normal change by pixel, if the ray has differentials.
    fn changes(&self) -> Option<[Change; 2]> {
        let beside = self.beside?;
        let turned = self.normal.dot(self.surface.shading_normal) < 0.0;
        let side = if turned { -1.0 } else { 1.0 };
        Some([0, 1].map(|k| Change {
            direction: beside.directions[k] + self.outgoing,
            normal: side * self.surface.covered.normal[k],
        }))
    }

    fn mirror(&mut self, weight: DVec3) {
        let (n, wo) = (self.normal, self.outgoing);
        let changes = self.changes();
        let changes = changes.map(|two| two.map(|change| change.reflected(n, wo)));
        self.bounce(n * (2.0 * n.dot(wo)) - wo, weight, changes);
    }

    fn straight_on(&mut self, weight: DVec3) {
        let changes = self.changes().map(|two| two.map(|change| change.direction));
        self.bounce(-self.outgoing, weight, changes);
    }

    /// A smooth interface; η is the index of what is behind the outside.
    fn dielectric(&mut self, kr: DVec3, kt: DVec3, eta: f64) {
        let relative = if self.surface.outside { eta } else { 1.0 / eta };
        let cosine = self.normal.dot(self.outgoing).abs();
        let reflected = Fresnel::Dielectric { eta: relative }.at(cosine);
        self.mirror(kr * reflected);
        let sine_square = (1.0 - cosine * cosine).max(0.0) / (relative * relative);
        if sine_square < 1.0 {
            let inner = (1.0 - sine_square).sqrt();
            let n = self.normal;
            // Its sign counts: a shading normal may be turned away from the viewer.
            let refracted =
                n * (n.dot(self.outgoing) / relative - inner) - self.outgoing / relative;
            let weight = kt * (DVec3::ONE - reflected) / (relative * relative);
            let changes = self.changes();
            let changes =
                changes.map(|two| two.map(|c| c.refracted(n, self.outgoing, [relative, inner])));
            self.bounce(refracted, weight, changes);
        }
    }

    /// A smooth sheet: reflections between its sides summed up.
    fn thin(&mut self, kr: DVec3, kt: DVec3, eta: f64) {
        let cosine = self.normal.dot(self.outgoing).abs();
        let r = Fresnel::Dielectric { eta }.at(cosine).x;
        let reflected = if r < 1.0 { 2.0 * r / (1.0 + r) } else { 1.0 };
        self.mirror(kr * reflected);
        self.straight_on(kt * (1.0 - reflected));
    }
}

/// Schlick's term of a reflectance r at normal incidence, or that of the conductor that pbrt-v4 has
/// for it: η = 1, k = 2 √r / √(1 − r), of r up to .9999.
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

fn is_zero(roughness: &Texture, at: Footprint) -> bool {
    roughness.evaluate_number(at) <= 0.0
}

/// The index of refraction that a material's number stands for: itself, or 1.5 for what is none, as
/// for the 0 that pbrt-v4 writes for its default.
#[must_use]
pub fn index_of_refraction(eta: f64) -> f64 {
    if eta > 0.0 && eta.is_finite() {
        eta
    } else {
        1.5
    }
}
