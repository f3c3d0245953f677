//! These tests compare lines by projected solid angle, for shading points near the light's plane,
//! with 77 digits.

use crate::precise;
use linelit_geometry::{ConvexPolygon, DVec3, intervals::Interval};
use linelit_lights::{AngularLines, LineTechnique};
use linelit_testkit::cases::cases;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;

/// Where the foot of the shading point is.
#[derive(Clone, Copy, Debug)]
enum Foot {
    Inside,
    OnEdge,
    Outside,
    /// So far, relative to the light, from a point of an edge, or from the first corner; outside if
    /// negative.
    ByEdge(f64),
    ByCorner(f64),
}

/// 10ᵃ to 10ᵇ.
fn log(a: f64, b: f64) -> impl Strategy<Value = f64> {
    (a..b).prop_map(|e| 10f64.powf(e))
}

fn foot() -> impl Strategy<Value = Foot> {
    let signed = |b| (log(-12.0, b), any::<bool>()).prop_map(|(d, out)| if out { -d } else { d });
    prop_oneof![
        Just(Foot::Inside),
        Just(Foot::OnEdge),
        Just(Foot::Outside),
        signed(-1.0).prop_map(Foot::ByEdge),
        signed(-1.0).prop_map(Foot::ByCorner),
    ]
}

/// A triangle of size one, a shading point next to its plane, and a normal.
#[derive(Clone, Copy, Debug)]
struct Seen {
    light: ConvexPolygon,
    x: DVec3,
    n: DVec3,
    angle: f64,
}

/// `tilted`: the plane and the shading point are anywhere; otherwise the plane is z = const and the
/// shading point the origin of coordinates but for its height.
fn seen(tilted: bool) -> impl Strategy<Value = Seen> {
    let turned = prop::array::uniform3(unit_vector().prop_map(DVec3::from));
    let inner = (0.1..0.9f64, 0.1..0.9f64);
    (foot(), log(-8.0, -3.0), turned, inner, -4.0..4.0f64).prop_filter_map(
        "a light",
        move |(foot, z, [across, shift, n], (s, t), angle)| {
            let normal = if tilted { across } else { DVec3::Z };
            let (a, b) = normal.any_orthonormal_pair();
            let at = |turn: f64| (a * turn.cos() + b * turn.sin()) * (0.4 + s);
            let corners = [at(angle), at(angle + 1.2 + t), at(angle + 3.6 + s)];
            let edge = corners[0] + (corners[1] - corners[0]) * s;
            let inside = edge + (corners[2] - edge) * t;
            let place = match foot {
                Foot::Inside => inside,
                Foot::OnEdge => edge,
                Foot::Outside => edge + 2.0 * (edge - inside),
                Foot::ByEdge(d) => edge + d * (inside - edge),
                Foot::ByCorner(d) => corners[0] + d * (inside - corners[0]),
            };
            let x = place + z * normal;
            // The origin at the foot, and the point at a distance that rounding does not see.
            let moved = if tilted { 3.0 * shift } else { -place };
            let corners = corners.map(|c| c + moved);
            let n = if n.dot(normal) > 0.0 { -n } else { n };
            Some(Seen {
                light: ConvexPolygon::new(&corners).ok()?,
                x: if tilted { x + moved } else { z * normal },
                n: (n - 0.2 * normal).normalize(),
                angle,
            })
        },
    )
}

/// 1e-12, and what the input says less exactly: sums over edges cancel to ε over the square of the
/// thickness over the length of what the horizon leaves, and to ε over its size (the shading point
/// is at a distance of about one). Axes are rounded to ε, which tilts a normal that is nearly the
/// plane's.
fn tolerance(seen: &Seen) -> f64 {
    let Some(above) = seen.light.clip(seen.x, seen.n) else {
        return 1.0;
    };
    let size = above.diameter();
    let thin = above.area() / (size * size);
    let tilt = seen.n.cross(above.normal()).length();
    1e-12 + f64::EPSILON * (4.0 / (thin * thin) + 8.0 / size + 8.0 / tilt)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(400)))]

    /// The whole, of any plane and any shading point: also where an edge or the horizon passes the
    /// foot by less than the rounding of the coordinates.
    #[test]
    fn the_total_is_lamberts_sum(seen in seen(true)) {
        let Seen { light, x, n, angle } = seen;
        let lines = AngularLines::by_projected_solid_angle(&light, angle, x, n);
        let want = precise::precise_irradiance(light.vertices(), x, n);
        let error = (lines.total() - want).abs();
        prop_assert!(error <= tolerance(&seen) * want, "{:e} {want:e}", error / want);
    }

    /// Its parts, in a plane that rounding does not tilt.
    #[test]
    fn the_cdf_is_lamberts_sum(seen in seen(false), xi in 0.0..1.0f64, xj in 0.0..1.0f64) {
        holds(&seen, [xi, xj])?;
    }
}

/// At three ten-thousandths of the way to the light over its plane, where the rounding of the
/// normal alone would be 2.1e-12 of the total.
#[test]
fn the_total_does_not_know_the_rounded_normal() {
    let corners = [
        [1.7384491979554353, 1.319692189584543, -2.169980538422578],
        [1.3102225707191213, 0.12913460594210568, -1.8864564721144954],
        [2.6813361881541677, 0.19497014694029302, -2.476929623442324],
    ];
    let seen = Seen {
        light: ConvexPolygon::new(&corners.map(DVec3::from)).unwrap(),
        x: DVec3::new(0.22054492921353241, 1.5321253738763765, -1.5393830644109083),
        n: DVec3::new(
            -0.10943685360195948,
            0.8138448787479531,
            -0.5706838778250467,
        ),
        angle: 1.8614444647602875,
    };
    let Seen { light, x, n, angle } = seen;
    let total = AngularLines::by_projected_solid_angle(&light, angle, x, n).total();
    let want = precise::precise_irradiance(light.vertices(), x, n);
    let error = (total / want - 1.0).abs();
    assert!(error <= tolerance(&seen), "{error:e}");
}

/// The CDF at an offset is the fraction of the light before the line, and lines and points are
/// recovered from their random numbers.
fn holds(seen: &Seen, [xi, xj]: [f64; 2]) -> Result<(), TestCaseError> {
    let &Seen { light, x, n, angle } = seen;
    let lines = AngularLines::by_projected_solid_angle(&light, angle, x, n);
    let want = precise::precise_irradiance(light.vertices(), x, n);
    prop_assume!(want > 0.0);
    let most = tolerance(seen);
    let error = (lines.total() / want - 1.0).abs();
    prop_assert!(error <= most, "{error:e}");
    let line = lines.sample(xi);
    let back = lines.invert(line.offset).unwrap();
    prop_assert!((back - xi).abs() <= most, "{back} {xi} {:e}", back - xi);
    let axis = lines.lines().across();
    let least = line.offset + axis.dot(lines.lines().frame().origin - x);
    let beyond = precise::precise_irradiance_beyond(light.vertices(), x, n, axis, least);
    let excess = 1.0 - back - beyond / want;
    prop_assert!(excess.abs() <= most, "{xi} {excess:e}");
    // Unoccluded, every point has the weight of the whole; the cosine is rounded to ε, and so is
    // the point, which may be below the horizon.
    let point = lines.point(&line, &[Interval::UNIT], xj);
    let cosine = n.dot((point.point - x).normalize());
    let weight = cosine / point.pdf.value();
    let rounding = 16.0 * f64::EPSILON / cosine.abs();
    let is_whole = (weight / want - 1.0).abs() <= most + rounding;
    prop_assert!(rounding > 1e-3 || is_whole, "{weight:e} {want:e}");
    Ok(())
}

/// Found by the property: the last Newton step rounds to none, at an end of its bracket, half of
/// which is not the next step.
#[test]
fn a_step_of_nothing_is_the_last() {
    let corners = [
        [-0.176_661_570_903_084_4, -0.201_373_384_061_880_38, 0.0],
        [0.443_725_164_338_787_84, 0.569_935_135_294_217_8, 0.0],
        [-0.704_971_298_977_607_9, 0.939_801_924_207_099_4, 0.0],
    ];
    let n = [
        0.745_714_511_148_976_2,
        0.622_242_383_223_617_2,
        -0.238_168_604_946_236_96,
    ];
    let seen = Seen {
        light: ConvexPolygon::try_from(corners).unwrap(),
        x: DVec3::new(0.0, 0.0, 1.634_189_332_118_875e-6),
        n: DVec3::from(n),
        angle: -1.503_093_877_148_039_5,
    };
    for xi in [0.720_088_747_496_078_1, 0.0] {
        holds(&seen, [xi, 0.643_370_511_543_674_8]).unwrap();
        holds(&seen, [xi, 0.0]).unwrap();
    }
}
