//! The probe finds the best direction of lines for a light.

use crate::penumbrae::rough;
use linelit_bsdf::{Bsdf, Lambert};
use linelit_estimators::{Buffers, Estimator, LightSource, NoTexture, OcclusionProbe, Query};
use linelit_estimators::{RandomNumbers, ShadingPoint, estimate};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_samplers::SamplerKind;
use linelit_testkit::ztest::Welford;
use linelit_visibility::Occluders;

/// A polygon two units above that faces down, and whose first edge is along y.
fn light(corners: &[[f64; 2]]) -> Light {
    let corners: Vec<DVec3> = corners
        .iter()
        .map(|c| DVec3::new(c[0], c[1], 2.0))
        .collect();
    let polygon = ConvexPolygon::new(&corners).expect("convex");
    Light::Area(AreaLight {
        polygon,
        emission: Emission::one_sided(DVec3::ONE),
    })
}

fn square() -> Light {
    light(&[[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]])
}

/// A half plane halfway up, beyond an edge in the direction `angle` that passes near the middle.
fn half_plane(angle: f32) -> Occluders {
    let (sin, cos) = angle.sin_cos();
    let at = |along: f32, across: f32| {
        let (x, y) = (
            0.03 + along * cos - across * sin,
            along * sin + across * cos,
        );
        [x, y, 1.0]
    };
    let corners = [at(-9.0, 0.0), at(9.0, 0.0), at(0.0, 30.0)];
    Occluders::build(&corners, &[[0, 1, 2]])
}

/// The direction that a probe finds from some points, and the variances of `line-analytic` with 16
/// lines: first in that direction, then in each of the directions in `fractions`.
fn probed(light: &Light, occluders: &Occluders, fractions: &[f64]) -> (Option<f64>, Vec<f64>) {
    let Light::Area(area) = light else {
        unreachable!("an area light")
    };
    let (mut probe, mut buffers) = (OcclusionProbe::default(), Buffers::default());
    let mut source = LightSource::new(light);
    let bsdf = Bsdf::Lambert(Lambert {
        albedo: DVec3::splat(0.5),
    });
    let position = |i: i32| DVec3::new(0.04 * f64::from(i), -0.07 * f64::from(i % 3), 0.0);
    let points: Vec<ShadingPoint> = (-3..4)
        .map(|i| ShadingPoint::new(position(i), DVec3::Z, DVec3::Z, bsdf.clone()))
        .collect();
    let numbers = |seed| RandomNumbers::new(SamplerKind::Stratified, seed, [0, 0], 0);
    let lines = Estimator::analytic();
    for point in &points {
        let query = Query::<_, NoTexture>::new(occluders, &source, point, &lines, numbers(0), 1);
        probe.look(&query, area, &mut buffers);
        probe.look_along_lines(&query, area, &mut buffers);
    }
    // Narrow lobes, which mirror a part of the light at fewer points, do not count.
    for point in &points[1..] {
        let point = ShadingPoint::new(point.position, DVec3::Z, DVec3::Z, rough(0.01));
        let query = Query::<_, NoTexture>::new(occluders, &source, &point, &lines, numbers(0), 1);
        probe.look_along_lines(&query, area, &mut buffers);
    }
    source.occlusion = probe.stats();
    let estimators = std::iter::once(lines).chain(fractions.iter().map(|f| lines.fixed(*f)));
    let mut variance = |estimator: Estimator| {
        let of = |point| {
            let one = |seed| {
                let numbers = numbers(seed);
                let query =
                    Query::<_, NoTexture>::new(occluders, &source, point, &estimator, numbers, 16);
                estimate(&query, &mut buffers).x
            };
            (0..64).map(one).collect::<Welford>().variance()
        };
        points.iter().map(of).sum()
    };
    let variances = estimators.map(&mut variance).collect();
    (source.occlusion.direction, variances)
}

/// Lines across an edge of the shadow see a smooth change, and lines along it see a jump. So the
/// best direction is across that edge: along the light's other edge if the shadow's edge is
/// parallel to one, and along the other diagonal or an edge if it is parallel to a diagonal.
#[test]
fn lines_run_across_the_shadow_of_an_edge() {
    let quarter = std::f32::consts::FRAC_PI_4;
    let directions = [0.0, 0.25, 0.5, 0.75];
    for (angle, along) in [
        (0.0, 0.5),
        (quarter, 0.25),
        (2.0 * quarter, 0.0),
        (3.0 * quarter, 0.75),
    ] {
        let (found, variances) = probed(&square(), &half_plane(angle), &directions);
        let found = found.expect("something is hidden");
        assert!((found - along).abs() > 0.2, "{angle}: {found}");
        // With 64 · 7 estimates, the standard error of a ratio of variances is about √(4/448) =
        // .095 for normal distributions, and twice that for others.
        let best = variances[1..].iter().copied().fold(f64::INFINITY, f64::min);
        assert!(variances[0] < 1.4 * best, "{angle}: {found}, {variances:?}");
        let worst = variances[1..].iter().copied().fold(0.0, f64::max);
        assert!(worst > 4.0 * best, "{angle}: {variances:?}");
    }
}

/// For a triangle, edges are compared; for a pentagon, its first edge and directions at even angles
/// to it.
#[test]
fn any_polygon_has_directions() {
    let triangle = light(&[[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.0]]);
    let pentagon = light(&[
        [-0.5, -0.4],
        [-0.5, 0.4],
        [0.2, 0.6],
        [0.6, 0.0],
        [0.2, -0.6],
    ]);
    let third = (0.5f64.atan2(1.0) + std::f64::consts::FRAC_PI_2) / std::f64::consts::PI;
    for (light, all) in [
        (triangle, vec![0.0, third, 1.0 - third]),
        (pentagon, vec![0.0, 0.25, 0.5, 0.75]),
    ] {
        for angle in [0.0f32, 0.4, 1.1, 1.9, 2.7] {
            let (found, _) = probed(&light, &half_plane(angle), &[]);
            let found = found.expect("something is hidden");
            assert!(all.iter().any(|f| (f - found).abs() < 1e-12), "{found}");
        }
    }
}

/// If no occluder is in between, no direction is known, and it is random.
#[test]
fn an_open_light_has_no_direction() {
    let (found, _) = probed(&square(), &Occluders::default(), &[]);
    assert_eq!(found, None);
}
