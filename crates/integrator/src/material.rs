//! From a material of the scene at a surface to what estimators ask: the lobes that lights reflect
//! in, and the directions into which mirrors and glass send the view on.
//!
//! The models are pbrt-v3's, with its conventions: plastic has its Fresnel term the wrong way round
//! (total reflection beyond 41.8°), glass scales transmitted radiance by the square of the relative
//! index, roughness is α after the material's remapping.

use crate::differential::Change;
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Fresnel, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate};
use linelit_geometry::DVec3;
use linelit_scene::{Footprint, MaterialKind, RayDifferential, Roughness, Scene, Surface, Texture};

/// A perfect reflection or refraction of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounce {
    /// Where the view goes on, unit length.
    pub direction: DVec3,
    /// What is left of the light from there, by channel.
    pub weight: DVec3,
    /// The rays beside it, if the ray that met the surface had some.
    pub beside: Option<RayDifferential>,
}

/// What a surface does with light.
pub(crate) struct Response {
    /// The lobes that lights reflect in.
    pub bsdf: Bsdf,
    /// Perfect mirrors and glass.
    pub bounces: Vec<Bounce>,
}

/// What the material of a surface does with light towards `outgoing`, about the shading normal
/// `normal` on the viewer's side; `beside` are the rays beside the one that met it.
#[inline]
pub(crate) fn response(
    scene: &Scene,
    surface: &Surface,
    outgoing: DVec3,
    normal: DVec3,
    beside: Option<&RayDifferential>,
) -> Response {
    let mut builder = Builder {
        scene,
        surface,
        at: surface.footprint(),
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
        layers.set_tangent(surface.dp_du);
    }
    Response {
        bsdf: layers.into(),
        bounces: builder.bounces,
    }
}

struct Builder<'a> {
    scene: &'a Scene,
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
        let colour = |t: &Texture| t.evaluate(at).clamp(DVec3::ZERO, DVec3::ONE);
        match &self.scene.materials[index as usize].kind {
            // The parts of a mixture have smaller indices, so this ends.
            MaterialKind::Mix { materials, amount } => {
                let share = colour(amount);
                self.material(materials[0], scale * (DVec3::ONE - share));
                self.material(materials[1], scale * share);
            }
            MaterialKind::Matte { kd, sigma } => {
                let degrees = sigma.evaluate_number(at).clamp(0.0, 90.0);
                if degrees > 0.0 {
                    let rough = OrenNayar::new(colour(kd), degrees.to_radians());
                    self.lobe(scale, Lobe::OrenNayar(rough));
                } else {
                    self.layers.add_diffuse(scale * colour(kd));
                }
            }
            MaterialKind::Phong { kd, ks, exponent } => {
                self.layers.add_diffuse(scale * colour(kd));
                let phong = Phong {
                    specular: ks.evaluate(at),
                    exponent: exponent.evaluate_number(at).max(0.0),
                };
                self.lobe(scale, Lobe::Phong(phong));
            }
            MaterialKind::Plastic { kd, ks, roughness } => {
                self.layers.add_diffuse(scale * colour(kd));
                let fresnel = Fresnel::Dielectric { eta: 1.0 / 1.5 };
                self.reflector(scale * colour(ks), roughness, fresnel);
            }
            MaterialKind::Substrate { kd, ks, roughness } => {
                let facets = self.facets(roughness);
                let coat = Substrate {
                    diffuse: colour(kd),
                    specular: colour(ks),
                    facets,
                };
                if coat.diffuse != DVec3::ZERO || coat.specular != DVec3::ZERO {
                    self.lobe(scale, Lobe::Substrate(coat));
                }
            }
            MaterialKind::Conductor { eta, k, roughness } => {
                let fresnel = Fresnel::Conductor {
                    eta: eta.evaluate(at).max(DVec3::ZERO),
                    k: k.evaluate(at).max(DVec3::ZERO),
                };
                self.reflector(scale, roughness, fresnel);
            }
            MaterialKind::ColoredConductor {
                reflectance,
                roughness,
            } => {
                let fresnel = Fresnel::Schlick {
                    f0: colour(reflectance),
                    f90: 1.0,
                };
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
            } => {
                let opaque = colour(opacity);
                let eta = index_of_refraction(eta.evaluate_number(at));
                self.straight_on(scale * (DVec3::ONE - opaque));
                let scale = scale * opaque;
                self.layers.add_diffuse(scale * colour(kd));
                let fresnel = Fresnel::Dielectric { eta };
                self.reflector(scale * colour(ks), roughness, fresnel);
                self.dielectric(scale * colour(kr), scale * colour(kt), eta);
            }
            MaterialKind::Mirror { kr } => self.mirror(scale * colour(kr)),
            MaterialKind::Dielectric {
                kr,
                kt,
                eta,
                roughness,
                thin,
            } => {
                let eta = index_of_refraction(eta.evaluate_number(at));
                let (kr, kt) = (scale * colour(kr), scale * colour(kt));
                if *thin {
                    self.thin(kr, kt, eta);
                } else if is_zero(&roughness.u, at) && is_zero(&roughness.v, at) {
                    self.dielectric(kr, kt, eta);
                } else {
                    // Light from behind is not asked for.
                    let eta = if self.surface.outside { eta } else { 1.0 / eta };
                    self.reflector(kr, roughness, Fresnel::Dielectric { eta });
                }
            }
            // Their diffuse part only: see `Material::is_drawn_in_full`.
            MaterialKind::CoatedDiffuse { .. } | MaterialKind::DiffuseTransmission { .. } => {
                let albedo = self.scene.diffuse_reflectance(index, at);
                self.layers.add_diffuse(scale * albedo);
            }
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

    /// How the view's direction and the normal change, if the view has rays beside it.
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
            let refracted = n * (cosine / relative - inner) - self.outgoing / relative;
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

fn is_zero(roughness: &Texture, at: Footprint) -> bool {
    roughness.evaluate_number(at) <= 0.0
}

/// A usable index of refraction; pbrt-v4 writes 0 for the default.
fn index_of_refraction(eta: f64) -> f64 {
    if eta > 0.0 && eta.is_finite() {
        eta
    } else {
        1.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Renderer, ShadingPoint, Workspace};
    use linelit_bsdf::Reflection;
    use linelit_formats::LoadOptions;

    /// The shading point in the middle of a floor of some material, seen from 45° along −x.
    fn floor(materials: &str) -> ShadingPoint {
        let text = format!(
            r#"
            LookAt -2 0 2  0 0 0  0 0 1
            Camera "perspective" "float fov" [ 20 ]
            Film "image" "integer xresolution" [ 3 ] "integer yresolution" [ 3 ]
            WorldBegin
            AttributeBegin
                AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
                Shape "quad" "point o" [ 0 0 5 ] "vector u" [ 0 1 0 ] "vector v" [ 1 0 0 ]
            AttributeEnd
            {materials}
            Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
                "point3 P" [ -5 -5 0  5 -5 0  5 5 0  -5 5 0 ]
            "#
        );
        let options = LoadOptions::default();
        let scene = linelit_formats::from_pbrt_str(&text, "floor.pbrt", &options)
            .unwrap()
            .scene;
        let mut workspace = Workspace::new();
        Renderer::new(&scene)
            .shading_point([1, 1], &mut workspace)
            .unwrap()
    }

    fn albedo(point: &ShadingPoint) -> DVec3 {
        match &point.bsdf {
            Bsdf::Lambert(lambert) => lambert.albedo,
            other => panic!("not diffuse: {other:?}"),
        }
    }

    #[test]
    fn diffuse_parts_of_a_mixture_add_up_to_lambert() {
        let point = floor(
            r#"
            MakeNamedMaterial "a" "string type" "matte" "rgb Kd" [ 1 0 0 ]
            MakeNamedMaterial "b" "string type" "plastic" "rgb Kd" [ 0 0 1 ] "rgb Ks" [ 0 0 0 ]
            Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b" "rgb amount" [ .25 .25 .25 ]
            "#,
        );
        assert!((albedo(&point) - DVec3::new(0.25, 0.0, 0.75)).length() < 1e-15);
        assert!(point.bounces.is_empty());
    }

    #[test]
    fn mirrors_send_the_view_on_and_reflect_no_light() {
        let point = floor(r#"Material "mirror" "rgb Kr" [ .5 .5 .5 ]"#);
        assert!(point.bsdf.is_black());
        let [bounce] = point.bounces[..] else {
            panic!("one bounce: {:?}", point.bounces)
        };
        let want = DVec3::new(1.0, 0.0, 1.0).normalize();
        assert!((bounce.direction - want).length() < 1e-7, "{bounce:?}");
        assert_eq!(bounce.weight, DVec3::splat(0.5));
    }

    /// Snell, from outside: sin t = sin 45°/1.5; radiance falls by η².
    #[test]
    fn glass_reflects_and_refracts() {
        let point = floor(r#"Material "glass" "float index" 1.5"#);
        let [mirrored, refracted] = point.bounces[..] else {
            panic!("two bounces: {:?}", point.bounces)
        };
        let reflectance = Fresnel::Dielectric { eta: 1.5 }.at(0.5f64.sqrt()).x;
        // The camera's ray is at 45° but for the f32 of the transform.
        assert!((mirrored.weight.x - reflectance).abs() < 1e-7);
        assert!((refracted.direction.x - 0.5f64.sqrt() / 1.5).abs() < 1e-7);
        assert!(refracted.direction.z < 0.0);
        let energy = refracted.weight.x * 2.25 + mirrored.weight.x;
        assert!((energy - 1.0).abs() < 1e-12);
    }

    #[test]
    fn opacity_lets_the_view_straight_through() {
        let point = floor(
            r#"Material "uber" "rgb Kd" [ .8 .8 .8 ] "rgb Ks" [ 0 0 0 ] "rgb opacity" [ .25 .25 .25 ]"#,
        );
        assert!((albedo(&point) - DVec3::splat(0.2)).length() < 1e-15);
        let [through] = point.bounces[..] else {
            panic!("one bounce: {:?}", point.bounces)
        };
        assert!((through.direction + point.outgoing).length() < 1e-15);
        assert_eq!(through.weight, DVec3::splat(0.75));
    }

    #[test]
    fn roughness_is_remapped_and_follows_the_tangents() {
        let facets = |text: &str| match floor(text).bsdf {
            Bsdf::Layers(layers) => match layers.lobes().next() {
                Some((_, Lobe::Reflector(lobe))) => lobe.facets.alpha(),
                other => panic!("{other:?}"),
            },
            other => panic!("{other:?}"),
        };
        let plain = facets(
            r#"Material "metal" "bool remaproughness" "false" "float uroughness" .1 "float vroughness" .4"#,
        );
        assert_eq!(plain.map(f64::to_bits), [0.1f64, 0.4].map(f64::to_bits));
        let remapped = facets(r#"Material "metal" "float roughness" .1"#);
        // pbrt-v3's polynomial at ln 0.1, by hand.
        assert!((remapped[0] - 0.461_760_032).abs() < 1e-9, "{remapped:?}");
    }
}
