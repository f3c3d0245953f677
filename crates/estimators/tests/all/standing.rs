//! A triangle that touches the shading point hides the same part of a light for all methods.

use linelit_bsdf::{Bsdf, Lambert};
use linelit_estimators::{
    Buffers, Estimator, LightSource, Query, RandomNumbers, SURFACE_OFFSET, ShadingPoint, estimate,
};
use linelit_geometry::{ConvexPolygon, DVec3, Margins, Segment};
use linelit_lights::{AreaLight, Emission, Light, LinearLight};
use linelit_samplers::SamplerKind;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z};
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines};

/// Coordinates that range from where the lift off the surface is far below the margin near the
/// point, to where it is far above that.
const PLACES: [f64; 6] = [0.0, 1.0, 4096.0, 8192.0, 65536.0, 1e6];

/// The horizontal extent by which triangles lean, at a height of 0.7.
const LEANS: [f64; 4] = [0.0, 0.3, -0.3, 0.05];

/// A triangle with a point on one of its edges, and lights above the point.
struct Standing {
    occluders: Occluders,
    positions: [[f32; 3]; 3],
    point: ShadingPoint,
    line: Segment,
    across: DVec3,
}

fn standing(place: f64, lean: f64) -> Standing {
    let at = DVec3::new(place, -place, 0.5 * place);
    let normal = DVec3::new(0.1, 0.2, 1.0).normalize();
    let (along, across) = normal.any_orthonormal_pair();
    let corners = [
        at - along * 0.5,
        at + along * 0.25,
        at + normal * 0.7 + across * lean,
    ];
    let positions = corners.map(|v| v.as_vec3().to_array());
    let [a, b] = [0, 1].map(|k| DVec3::from(positions[k].map(f64::from)));
    // The point is on the edge as it is stored.
    let foot = a + (b - a) * 0.6;
    let line = Segment::new(
        foot + normal - across * 0.5 + along * 0.1,
        foot + normal * 1.3 + across * 0.8 - along * 0.05,
    );
    let lift = SURFACE_OFFSET * foot.abs().max_element();
    let white = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    Standing {
        occluders: Occluders::build(&positions, &[[0, 1, 2]]),
        positions,
        point: ShadingPoint::new(foot + normal * lift, normal, normal, white),
        line,
        across: along * 0.7,
    }
}

/// Rays to points of a line agree with the visible parts of the line, and these agree with brute
/// force.
///
/// The point is the same for both. Corners are stored in single precision relative to an origin
/// near the point, so that depths are rounded by a few ε. With a margin of 1e-10, this moves the
/// end of a visible part by some 1e-5. Points within 1e-4 of an end may be on either side.
#[test]
fn rays_and_lines_agree_about_what_stands_on_the_point() {
    let (mut scratch, mut out) = (Scratch::new(), VisibleLines::new());
    let mut partial = 0;
    for place in PLACES {
        for lean in LEANS {
            let Standing {
                occluders,
                point,
                line,
                ..
            } = standing(place, lean);
            let x = point.position;
            let ends = [line.p0, line.p1];
            let query = ShaftQuery::new(x, &ends);
            occluders
                .shaft(query, &mut scratch)
                .visible(&[line], &mut out);
            let near_end = 1e-4;
            for k in 0..1000 {
                let t = (f64::from(k) + 0.5) / 1000.0;
                let parts = out.line(0);
                let is_visible = parts.iter().any(|part| (part.lo..part.hi).contains(&t));
                let is_clear = |end: f64| (end - t).abs() > near_end;
                if !parts
                    .iter()
                    .all(|part| is_clear(part.lo) && is_clear(part.hi))
                {
                    continue;
                }
                let to = [line.at(t) - x];
                let fan = occluders.shadow_rays(x, &to, Margins::DEFAULT);
                let hidden = occluders.any_hits(&fan, &(0..0), &mut scratch);
                assert_eq!(hidden == 0, is_visible, "{place} {lean} {t} {parts:?}");
                partial += u32::from(hidden != 0);
            }
        }
    }
    assert!(partial > 500, "{partial}");
}

/// Points, lines and closed forms have the same mean past a triangle that touches the point.
#[test]
fn methods_agree_about_what_stands_on_the_point() {
    const RUNS: u32 = 64;
    const SAMPLES: u32 = 256;
    let of_line = ["hybrid", "point-linear", "line-area"];
    let of_square = [
        "hybrid",
        "line-analytic",
        "line-solid-angle",
        "point-solid-angle",
        "point-area",
    ];
    let tests = PLACES.len() * LEANS.len() * (of_line.len() + of_square.len());
    let alpha = sidak(1e-3, tests);
    let limit = critical_z(alpha);
    // A part that no sample meets with this probability, of twice the mean of the light.
    let unseen = 2.0 * -alpha.ln() / f64::from(RUNS * SAMPLES);
    let mut buffers = Buffers::default();
    for place in PLACES {
        for lean in LEANS {
            let case = standing(place, lean);
            let line = Light::Linear(LinearLight {
                segment: case.line,
                radiance_radius: DVec3::ONE,
            });
            let half = case.line.vector() * 0.5;
            let square = ConvexPolygon::parallelogram(case.line.p0, half, case.across).unwrap();
            let emission = Emission {
                radiance: DVec3::ONE,
                two_sided: true,
            };
            let square = Light::Area(AreaLight {
                polygon: square,
                emission,
            });
            for (light, texts) in [(line, &of_line[..]), (square, &of_square[..])] {
                let source = LightSource::new(&light);
                let mut value = |text: &str, seed: u64| {
                    let estimator: Estimator = text.parse().unwrap();
                    let kind = SamplerKind::Independent;
                    let numbers = RandomNumbers::new(kind, seed, [0, 0], 0);
                    let (occluders, point) = (&case.occluders, &case.point);
                    let query = Query::new(occluders, &source, point, &estimator, numbers, SAMPLES);
                    estimate(&query, &mut buffers).x
                };
                let want = value("exact", 0);
                for text in texts {
                    let mut runs = Welford::new();
                    (0..RUNS).for_each(|seed| runs.push(value(text, seed.into())));
                    // Values without noise are as good as densities, which are good to 3e-7; the
                    // margin magnifies the rounding of the position.
                    let rounding = unseen + 3e-7 + f64::EPSILON * place / Margins::DEFAULT.point;
                    let error = (runs.mean() - want).abs() - rounding * want;
                    assert!(
                        error <= limit * runs.standard_error(),
                        "{text} at {place}, {lean}: {} {want} of {:?}",
                        runs.mean(),
                        case.positions
                    );
                }
            }
        }
    }
}
