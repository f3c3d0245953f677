//! Linear lights past occluders without noise, on reflections that have no closed form.

use crate::agreement::Opaque;
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Fresnel, Frostbite, Layers, Lobe, Reflection, Reflector, Substrate};
use linelit_estimators::{Buffers, LightSource, NoTexture, Query, RandomNumbers};
use linelit_estimators::{ShadingPoint, estimate};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{Light, LinearLight};
use linelit_samplers::SamplerKind;
use linelit_testkit::cases::cases;
use linelit_visibility::Occluders;
use proptest::prelude::*;

/// A diffuse part and one rough lobe.
fn rough(lobe: Lobe, tangent: DVec3) -> Bsdf {
    let mut layers = Layers::new(tangent);
    layers.add_diffuse(DVec3::splat(0.2));
    assert!(layers.add(DVec3::new(1.0, 0.5, 0.25), lobe));
    Bsdf::Layers(layers)
}

fn lobe(model: u8, alpha: [f64; 2]) -> Lobe {
    let facets = TrowbridgeReitz::new(alpha);
    let (flat, f0) = (DVec3::splat(0.3), DVec3::splat(0.04));
    match model {
        0 => Lobe::Frostbite(Frostbite::new(flat, f0, alpha[0].sqrt())),
        1 => Lobe::Substrate(Substrate {
            diffuse: flat,
            specular: f0,
            facets,
        }),
        _ => Lobe::Reflector(Reflector {
            reflectance: DVec3::ONE,
            facets,
            fresnel: Fresnel::Schlick { f0, f90: 1.0 },
        }),
    }
}

fn direction() -> impl Strategy<Value = DVec3> {
    (0.02f64..1.0, 0.0..std::f64::consts::TAU).prop_map(|(z, turn): (f64, f64)| {
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * turn.cos(), sine * turn.sin(), z)
    })
}

/// 2/h ∫ f cos sin ψ dφ over the angle that the line spans, by the rule of midpoints: ψ is the
/// angle between line and direction, h the line's distance.
fn by_midpoints(point: &ShadingPoint, line: &Segment) -> DVec3 {
    const NODES: u32 = 400_000;
    let (p, e) = (line.p0, line.vector());
    let (a, b) = (p.normalize(), line.p1.normalize());
    let angle = a.cross(b).length().atan2(a.dot(b));
    let side = (b - a * a.dot(b)).normalize();
    let foot = (p - e * (p.dot(e) / e.length_squared())).length();
    let mut sum = DVec3::ZERO;
    for i in 0..NODES {
        let (s, c) = (angle * (f64::from(i) + 0.5) / f64::from(NODES)).sin_cos();
        let w = a * c + side * s;
        sum += point.reflected(DVec3::ONE, w) * w.cross(e).length();
    }
    sum * (2.0 * angle / (f64::from(NODES) * foot * e.length()))
}

proptest! {
    // Long runs reject more than the 1,024 lines that are allowed below the horizon.
    #![proptest_config(ProptestConfig { cases: cases(48), max_global_rejects: 100_000, ..ProptestConfig::default() })]

    /// Lobes as narrow as 1e-4, also along one axis only: of all lines, half pass near the mirror
    /// direction. The bound is what quadrature asks of its own estimate, of each of two parts.
    #[test]
    fn quadrature_finds_every_peak(
        model in 0u8..3,
        (narrow, wide) in (-4.0f64..0.0, -4.0f64..0.0),
        (wo, tangent, far, off) in (direction(), direction(), direction(), direction()),
        (near, length, miss) in (0.2f64..3.0, 0.1f64..4.0, prop_oneof![Just(0.0), 0.0f64..0.5]),
    ) {
        let bsdf = rough(lobe(model, [10f64.powf(narrow), 10f64.powf(wide)]), tangent);
        let mirrored = DVec3::new(-wo.x, -wo.y, wo.z);
        let middle = (mirrored + (off - mirrored) * miss) * near;
        let line = Segment::new(middle, middle + (far - middle).normalize() * length);
        let line = Segment::new(line.at(-0.3), line.p1);
        prop_assume!(line.p0.z > 1e-3 && line.p1.z > 1e-3);
        prop_assume!(line.p0.normalize().cross(line.p1.normalize()).length() > 1e-3);
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, bsdf);
        let light = Light::Linear(LinearLight { segment: line, radiance_radius: DVec3::ONE });
        let source = LightSource::new(&light);
        let none = Occluders::build(&[[9.0, 9.0, -9.0]; 3], &[[0, 1, 2]]);
        let estimator = "line-analytic".parse().expect("one");
        let numbers = RandomNumbers::new(SamplerKind::Independent, 0, [0, 0], 0);
        let query = Query::<_, NoTexture>::new(&none, &source, &point, &estimator, numbers, 1);
        let got = estimate(&query, &mut Buffers::default());
        let want = by_midpoints(&point, &line);
        let error = ((got - want).abs() / want.max_element()).max_element();
        prop_assert!(error < 2e-3, "{error:e}: {got} for {want}");
    }
}

/// A reflection that says nothing of its peaks gets points, and a closed form none.
#[test]
fn points_where_nothing_is_known() {
    fn two_seeds<R: Reflection>(bsdf: R) -> [DVec3; 2] {
        let wo = DVec3::new(0.6, 0.0, 0.8);
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, bsdf);
        let segment = Segment::new(DVec3::new(-1.0, 0.1, 1.0), DVec3::new(0.5, 0.0, 1.0));
        let radiance_radius = DVec3::ONE;
        let light = Light::Linear(LinearLight {
            segment,
            radiance_radius,
        });
        let source = LightSource::new(&light);
        let corners = [[-0.5, -0.5, 0.5], [-0.2, -0.5, 0.5], [-0.2, 0.8, 0.5]];
        let blocker = Occluders::build(&corners, &[[0, 1, 2]]);
        let estimator = "line-analytic".parse().expect("one");
        [0, 1].map(|seed| {
            let numbers = RandomNumbers::new(SamplerKind::Independent, seed, [0, 0], 0);
            let query =
                Query::<_, NoTexture>::new(&blocker, &source, &point, &estimator, numbers, 4);
            estimate(&query, &mut Buffers::default())
        })
    }
    let bsdf = rough(lobe(2, [0.1; 2]), DVec3::ZERO);
    let [a, b] = two_seeds(bsdf.clone());
    assert_eq!(a, b);
    let [a, b] = two_seeds(Opaque(bsdf));
    assert_ne!(a, b);
}
