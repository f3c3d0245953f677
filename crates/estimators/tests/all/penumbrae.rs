//! Soft shadows on reflections without a closed form have little noise.

use linelit_bsdf::microfacet::TrowbridgeReitz;
use linelit_bsdf::{Bsdf, Fresnel, Layers, Lobe, Reflector};
use linelit_estimators::{Buffers, LightSource, NoTexture, Query, RandomNumbers};
use linelit_estimators::{ShadingPoint, estimate};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_visibility::Occluders;

/// A rough reflector on a diffuse base.
pub(crate) fn rough(alpha: f64) -> Bsdf {
    let mut layers = Layers::default();
    layers.add_diffuse(DVec3::splat(0.3));
    let rough = Reflector {
        reflectance: DVec3::splat(0.5),
        facets: TrowbridgeReitz::isotropic(alpha),
        fresnel: Fresnel::Dielectric { eta: 1.5 },
    };
    assert!(layers.add(DVec3::ONE, Lobe::Reflector(rough)));
    Bsdf::Layers(layers)
}

/// A metal.
fn brushed(alpha: [f64; 2]) -> Bsdf {
    let mut layers = Layers::default();
    let rough = Reflector {
        reflectance: DVec3::splat(0.5),
        facets: TrowbridgeReitz::new(alpha),
        fresnel: Fresnel::Full,
    };
    assert!(layers.add(DVec3::ONE, Lobe::Reflector(rough)));
    Bsdf::Layers(layers)
}

/// Estimates with four samples each at a point of such a reflector, under a square light behind a
/// plate of this width.
fn estimates(text: &str, alpha: f64, x: f64, plate: f32) -> Welford {
    estimates_on((rough(alpha), x), 1.0, text, plate)
}

/// The same at any point of a surface, under a square light of this size.
fn estimates_on((bsdf, x): (Bsdf, f64), size: f64, text: &str, plate: f32) -> Welford {
    let wo = DVec3::new(-0.6, 0.0, 0.8);
    let position = DVec3::new(x, 0.0, 0.0);
    let point = ShadingPoint::new(position, DVec3::Z, wo, bsdf);
    let corner = DVec3::new(1.0 - 0.5 * size, -0.5 * size, 2.0);
    let (u, v) = (DVec3::Y * size, DVec3::X * size);
    let polygon = ConvexPolygon::parallelogram(corner, u, v).expect("a square");
    let emission = Emission::one_sided(DVec3::ONE);
    let light = Light::Area(AreaLight { polygon, emission });
    let at = |dx: f32, y: f32| [0.8 + dx * plate, y, 1.0];
    let corners = [at(-1.0, -3.0), at(0.0, -3.0), at(0.0, 3.0), at(-1.0, 3.0)];
    let occluders = Occluders::build(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let source = LightSource::new(&light);
    let (estimator, mut buffers) = (text.parse().expect("one"), Buffers::default());
    let one = |seed| {
        let numbers = RandomNumbers::new(SamplerKind::Sobol, seed, [0, 0], 0);
        let query = Query::<_, NoTexture>::new(&occluders, &source, &point, &estimator, numbers, 4);
        estimate(&query, &mut buffers).x
    };
    (0..512).map(one).collect()
}

/// Across a penumbra, for narrow and wide lobes, the variance is at most four times the variance
/// without the plate (the edge takes from stratified points what they gain on the smooth
/// difference: 1.0 to 3.1), and at most a hundredth of the variance of lines (1/360 and less).
#[test]
fn penumbrae_are_as_smooth_as_light() {
    for alpha in [0.05, 0.1, 0.2, 0.5] {
        let mut variances = [0.0; 3];
        for i in 0..12 {
            let x = 0.15 + 0.08 * f64::from(i);
            let behind = estimates("exact", alpha, x, 1.0);
            let free = estimates("exact", alpha, x, 1e-3);
            let lines = estimates("line-area", alpha, x, 1.0);
            for (sum, of) in variances.iter_mut().zip([behind, free, lines]) {
                *sum += of.variance();
            }
        }
        let [behind, free, lines] = variances;
        assert!(behind < 4.0 * free && behind < 0.01 * lines, "{alpha}");
    }
}

/// Without occluders, `hybrid` takes points by area where the light is smooth. It does not do so
/// where a lobe is on the light but so narrow that it contains neither the light's corners nor its
/// middle (deviations of .0007 to .0023 of the mean, 11 and more by area).
#[test]
fn narrow_lobes_on_wide_lights_are_seen() {
    for alpha in [0.001, 0.005, 0.02, 0.1] {
        for x in [-0.95, -0.8, -0.6, -0.3] {
            let got = estimates("hybrid", alpha, x, 0.0);
            assert!(
                got.variance().sqrt() < 0.05 * got.mean(),
                "{alpha}, {x}: {got:?}"
            );
        }
    }
}

/// A surface that is rough along y alone reflects along a curve, which no LTC resembles. The points
/// that sample the rest are then combined with samples of the BSDF, and have no rare and large
/// values. In full and in half light, deviations are .44 to .72 (for `exact` 1.0 to 2.0) of the
/// deviations of points by both densities; points by LTCs alone have up to nine times as much.
#[test]
fn curved_lobes_are_left_to_bsdf_samples() {
    for alpha in [[0.001, 0.1], [0.01, 1.0], [0.02, 0.5]] {
        for x in [-0.95, -0.6, -0.3] {
            for plate in [0.0, 0.5] {
                let of = |text| estimates_on((brushed(alpha), x), 6.0, text, plate).variance();
                let points = of("point-ltc+point-bsdf");
                let what = format!("{alpha:?}, {x}, {plate}");
                assert!(
                    of("hybrid") < points && of("exact") < 6.0 * points,
                    "{what}"
                );
            }
        }
    }
}

/// In combinations, too, `exact` and `hybrid` integrate LTCs in closed form, in light, penumbra and
/// shadow. The mean is the mean of points and of `exact` alone, and the variance is less than a
/// thousandth of the variance of points by the same techniques (1/2,600 and less).
#[test]
fn combinations_leave_the_rest_to_points() {
    const ALPHAS: [f64; 3] = [0.02, 0.1, 0.5];
    const TEXTS: [&str; 5] = [
        "exact+point-bsdf",
        "hybrid+point-bsdf",
        "hybrid:3+point-bsdf+point-area[mis=power]",
        "exact+line-analytic+point-bsdf[mis=smooth]",
        "exact+point-bsdf[mis=optimal]",
    ];
    let bound = critical_z(sidak(1e-4, ALPHAS.len() * TEXTS.len() * 12 * 2));
    for alpha in ALPHAS {
        let mut variances = [0.0; 6];
        for i in 0..12 {
            let x = 0.15 + 0.08 * f64::from(i);
            let plate = if i % 4 == 0 { 1e-3 } else { 1.0 };
            let points = estimates("point-ltc+point-bsdf", alpha, x, plate);
            // The error of the estimate with which it is compared: one part in 100,000.
            let alone = estimates("exact", alpha, x, plate);
            variances[0] += points.variance();
            for (sum, text) in variances[1..].iter_mut().zip(TEXTS) {
                let got = estimates(text, alpha, x, plate);
                *sum += got.variance();
                for want in [&points, &alone] {
                    let z = z_score_two(&got, want);
                    assert!(z.abs() < bound, "{text}, {alpha}, {x}: {z}");
                }
            }
        }
        let [points, closed @ ..] = variances;
        assert!(
            closed.iter().all(|v| *v < 0.001 * points),
            "{alpha}: {variances:?}"
        );
    }
}
