//! Linear lights on reflections without a closed form: quadrature is good to 1e-6.

use crate::round::{Rectangle, estimates, nothing, rectangles};
use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{
    Bsdf, Fresnel, Frostbite, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate,
};
use linelit_estimators::ShadingPoint;
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{Light, LinearLight};
use linelit_testkit::cases::cases;
use linelit_testkit::chi2::sidak;
use linelit_testkit::quadrature::gauss_kronrod;
use linelit_testkit::ztest::{critical_z, z_score};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// The promised error of `exact` and similar estimators along lines, relative to the sum over the
/// channels.
const PROMISED: f64 = 1e-6;

/// A diffuse part and lobes.
fn layers(diffuse: f64, lobes: &[Lobe]) -> Bsdf {
    let mut layers = Layers::new(DVec3::new(0.8, 0.6, 0.0));
    layers.add_diffuse(DVec3::splat(diffuse));
    for lobe in lobes {
        assert!(layers.add(DVec3::new(1.0, 0.5, 0.25), *lobe));
    }
    Bsdf::Layers(layers)
}

fn facets(f0: f64, alpha: [f64; 2]) -> Lobe {
    Lobe::Reflector(Reflector {
        reflectance: DVec3::ONE,
        facets: TrowbridgeReitz::new(alpha),
        fresnel: Fresnel::Schlick {
            f0: DVec3::splat(f0),
            f90: 1.0,
        },
    })
}

fn coated(alpha: [f64; 2]) -> Lobe {
    Lobe::Substrate(Substrate {
        diffuse: DVec3::splat(0.3),
        specular: DVec3::splat(0.05),
        facets: TrowbridgeReitz::new(alpha),
    })
}

fn frostbite(roughness: f64) -> Lobe {
    let (flat, f0) = (DVec3::splat(0.3), DVec3::splat(0.04));
    Lobe::Frostbite(Frostbite::new(flat, f0, roughness))
}

fn rough_diffuse(sigma: f64) -> Lobe {
    Lobe::OrenNayar(OrenNayar::new(DVec3::splat(0.6), sigma))
}

fn phong(exponent: f64) -> Lobe {
    let specular = DVec3::splat(0.4);
    Lobe::Phong(Phong { specular, exponent })
}

/// Reflections with kinks (rough diffuse, coated, a wide Phong lobe), with peaks, and rough in one
/// direction alone.
pub(crate) fn reflections() -> [Bsdf; 10] {
    [
        layers(0.0, &[rough_diffuse(0.35)]),
        layers(0.0, &[rough_diffuse(1.0)]),
        layers(0.0, &[facets(0.8, [0.5; 2])]),
        layers(0.0, &[facets(0.8, [0.05; 2])]),
        layers(0.0, &[facets(0.8, [0.005; 2])]),
        layers(0.1, &[facets(0.8, [0.3, 0.03])]),
        layers(0.4, &[facets(0.04, [0.1; 2])]),
        layers(0.0, &[coated([0.2; 2])]),
        layers(0.0, &[frostbite(0.5), phong(1.0)]),
        layers(0.0, &[rough_diffuse(0.5), facets(0.9, [0.1; 2])]),
    ]
}

/// A viewer, a shading normal and a linear light, with occluders that hide a part of it.
struct Case {
    outgoing: DVec3,
    normal: DVec3,
    line: Segment,
    occluder: Option<Rectangle>,
    /// The fractions of the line that are visible and above both horizons.
    parts: &'static [[f64; 2]],
}

/// In all cases, kinks of rough diffuse reflections are on the light: where it crosses the plane of
/// viewer and normal, or the cone of directions that are as steep as the viewer's.
fn some_cases() -> [Case; 4] {
    let line = |p0: [f64; 3], p1: [f64; 3]| Segment::new(p0.into(), p1.into());
    [
        Case {
            outgoing: DVec3::new(-0.2, 0.1, 0.9).normalize(),
            normal: DVec3::Z,
            line: line([-0.5, -0.4, 1.5], [0.8, 0.3, 2.0]),
            occluder: None,
            parts: &[[0.0, 1.0]],
        },
        // A rectangle half as high hides x from −.25 to .5: fractions 3/8 to 3/4, to the bit.
        Case {
            outgoing: DVec3::new(0.4, -0.2, 0.6).normalize(),
            normal: DVec3::Z,
            line: line([-1.0, 0.25, 1.0], [1.0, 0.25, 1.0]),
            occluder: Some(([-0.125, 0.25], [-1.0, 1.0], 0.5)),
            parts: &[[0.0, 0.375], [0.75, 1.0]],
        },
        // The viewer is near the horizon, and a fourth of the line is below it.
        Case {
            outgoing: DVec3::new(-0.5, 0.87, 0.05).normalize(),
            normal: DVec3::Z,
            line: line([0.5, -0.9, -0.25], [-0.75, 1.0, 0.75]),
            occluder: None,
            parts: &[[0.25, 1.0]],
        },
        // The shading normal sees x < 4/3 z, which is all but the last third.
        Case {
            outgoing: DVec3::new(0.1, 0.3, 0.8).normalize(),
            normal: DVec3::new(-0.6, 0.0, 0.8),
            line: line([0.0, 0.5, 1.0], [1.5, -0.25, 0.625]),
            occluder: None,
            parts: &[[0.0, 2.0 / 3.0]],
        },
    ]
}

/// ∫ f cos 2h/r³ dt along a part of a line, summed over the channels, as 2/h ∫ f cos sin ψ dφ over
/// the angle φ along the line: ψ is the angle between line and direction, h the line's distance.
///
/// The integral is computed on each of this many equal parts to 1e-10, without any tested code but
/// the reflection.
fn by_many_parts(point: &ShadingPoint, line: &Segment, parts: u32) -> f64 {
    let (p, e) = (line.p0, line.vector());
    let (a, b) = (p.normalize(), line.p1.normalize());
    let angle = a.cross(b).length().atan2(a.dot(b));
    let side = (b - a * a.dot(b)).normalize();
    let foot = (p - e * (p.dot(e) / e.length_squared())).length();
    let along = |phi: f64| {
        let (s, c) = phi.sin_cos();
        let w = a * c + side * s;
        point.reflected(DVec3::ONE, w).element_sum() * w.cross(e).length()
    };
    let at = |i: u32| angle * f64::from(i) / f64::from(parts);
    let of = |i| gauss_kronrod(along, at(i), at(i + 1), 1e-10).value;
    (0..parts).map(of).sum::<f64>() * (2.0 / (foot * e.length()))
}

/// Compares `exact` and `hybrid` with quadrature, for any number of samples, and points with
/// quadrature: by z tests at α = 1e-4 for all together, after Šidák.
fn hold(samples: u32, times: u64) {
    let (reflections, cases) = (reflections(), some_cases());
    let bound = critical_z(sidak(1e-4, reflections.len() * cases.len()));
    for (k, bsdf) in reflections.iter().enumerate() {
        for (j, case) in cases.iter().enumerate() {
            let mut point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, case.outgoing, bsdf.clone());
            point.normal = case.normal;
            let light = Light::Linear(LinearLight {
                segment: case.line,
                radiance_radius: DVec3::ONE,
            });
            let occluders = case.occluder.map_or_else(nothing, |r| rectangles(&[r]));
            let estimate = |text, samples, times| {
                estimates(&occluders, &light, &point, text, samples, 0..times).0
            };
            let parts = case.parts.iter().map(|[lo, hi]| case.line.piece(*lo, *hi));
            let want: f64 = parts.map(|part| by_many_parts(&point, &part, 256)).sum();
            for (text, n) in ["exact", "hybrid"].iter().flat_map(|t| [(t, 1), (t, 256)]) {
                let got = estimate(text, n, 2);
                let error = (got.mean() / want - 1.0).abs();
                let what = format!("reflection {k}, case {j}, {text}, N = {n}");
                assert!(
                    error < PROMISED && got.variance() == 0.0,
                    "{what}: {error:e}"
                );
            }
            let points = estimate("point-ltc", samples, times);
            let z = z_score(points.mean(), want, points.standard_error());
            assert!(z.abs() < bound, "{k}, {j}: z {z}, {points:?} for {want}");
        }
    }
}

#[test]
fn kinks_and_peaks_are_known_to_a_millionth_and_points_agree() {
    hold(64, 128);
}

#[test]
#[ignore = "long: a million points on each light, for each reflection"]
fn a_million_points_agree_with_quadrature() {
    hold(256, 3907);
}

fn direction() -> impl Strategy<Value = DVec3> {
    (0.02f64..1.0, 0.0..TAU).prop_map(|(z, turn): (f64, f64)| {
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * turn.cos(), sine * turn.sin(), z)
    })
}

proptest! {
    // Long runs reject more than the 1,024 lines that may be below the horizon.
    #![proptest_config(ProptestConfig { cases: cases(96), max_global_rejects: 100_000, ..ProptestConfig::default() })]

    /// Lobes as narrow as 1e-4, some of them along one axis only. Half of all lines pass near the
    /// mirror direction.
    #[test]
    fn quadrature_finds_every_kink_and_peak(
        model in 0u8..5,
        (narrow, wide) in (-4.0f64..0.0, -4.0f64..0.0),
        (wo, tangent, far, off) in (direction(), direction(), direction(), direction()),
        (near, length, miss) in (0.2f64..3.0, 0.1f64..4.0, prop_oneof![Just(0.0), 0.0f64..0.5]),
    ) {
        let alpha = [10f64.powf(narrow), 10f64.powf(wide)];
        let lobe = match model {
            0 => frostbite(alpha[0].sqrt()),
            1 => coated(alpha),
            2 => rough_diffuse(alpha[0].sqrt()),
            3 => phong(1.0 / alpha[0]),
            _ => facets(0.04, alpha),
        };
        let mut layers = Layers::new(tangent);
        layers.add_diffuse(DVec3::splat(0.2));
        let colour = DVec3::new(1.0, 0.5, 0.25);
        prop_assert!(layers.add(colour, lobe) && layers.add(colour, frostbite(0.9)));
        let mirrored = DVec3::new(-wo.x, -wo.y, wo.z);
        let middle = (mirrored + (off - mirrored) * miss) * near;
        let line = Segment::new(middle, middle + (far - middle).normalize() * length);
        let line = Segment::new(line.at(-0.3), line.p1);
        prop_assume!(line.p0.z > 1e-3 && line.p1.z > 1e-3);
        prop_assume!(line.p0.normalize().cross(line.p1.normalize()).length() > 1e-3);
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, Bsdf::Layers(layers));
        let light = Light::Linear(LinearLight { segment: line, radiance_radius: DVec3::ONE });
        let got = estimates(&nothing(), &light, &point, "line-analytic", 1, 0..1).0.mean();
        // With 4,096 parts, the nodes of each part resolve lobes as narrow as α cos_o = 2e-6.
        let want = by_many_parts(&point, &line, 4096);
        let error = (got / want - 1.0).abs();
        prop_assert!(error < PROMISED, "{error:e}: {got} for {want}");
    }
}
