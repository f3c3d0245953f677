//! Parts of elliptic cones against quadrature of what they are defined as: whole, cut by a chord,
//! with a hole, in sectors; circles and narrow ellipses, tiny and wide, above the horizon and cut
//! by it, also where it touches the rim.

use linelit_geometry::{DVec3, EllipticCone, Frame};
use linelit_shading::elliptic_cone::PartOfCone;
use linelit_shading::polygon;
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use linelit_testkit::quadrature::gauss_kronrod_to;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The tolerance of both integrals of the quadrature.
const QUADRATURE: f64 = 1e-12;

/// A cone and the normal of a surface.
#[derive(Clone, Copy, Debug)]
struct Seen {
    cone: EllipticCone,
    n: DVec3,
}

impl Seen {
    /// The point of the ellipse at unit distance along the axis with these coordinates, of which
    /// squares sum up to one on the rim.
    fn place(&self, [x, y]: [f64; 2]) -> DVec3 {
        let EllipticCone {
            axes: [u, v, w],
            tan: [a, b],
        } = self.cone;
        u * (a * x) + v * (b * y) + w
    }

    fn rim(&self, turn: f64) -> DVec3 {
        let (y, x) = turn.sin_cos();
        self.place([x, y])
    }

    /// ∫ max(0, n·p) ab/|p|⁴ dx dy over the part of the unit disk on the left of the chord from the
    /// second of two turns to the first, if any; and a bound of the error.
    ///
    /// Outside over q, the coordinate up to which n·p grows, as a sine; inside over the other one:
    /// all smooth between the horizon, the chord's ends and the middle.
    fn integral(&self, cut: Option<[f64; 2]>) -> (f64, f64) {
        let ([a, b], [nx, ny, nz]) = (self.cone.tan, self.cone.axes.map(|k| k.dot(self.n)));
        let (gx, gy) = (nx * a, ny * b);
        let steep = gx.hypot(gy);
        let (c, s) = if steep > 0.0 {
            (gx / steep, gy / steep)
        } else {
            (1.0, 0.0)
        };
        let turned = |turn: f64| {
            let (y, x) = turn.sin_cos();
            [c * x + s * y, c * y - s * x]
        };
        let ends = cut.map(|turns| turns.map(turned));
        let value = |q: f64, r: f64| {
            let (x, y) = (c * q - s * r, s * q + c * r);
            let square = 1.0 + (a * x).powi(2) + (b * y).powi(2);
            (nz + steep * q).max(0.0) * a * b / (square * square)
        };
        let across = |angle: f64| {
            let (q, half) = angle.sin_cos();
            let (mut low, mut high) = (-half, half);
            if let Some([[q0, r0], [q1, r1]]) = ends {
                // (e₀ − e₁) × (x − e₁) ≥ 0.
                let (dq, dr) = (q0 - q1, r0 - r1);
                let at = r1 + dr * (q - q1) / dq;
                if dq > 0.0 {
                    low = low.max(at);
                } else if dq < 0.0 {
                    high = high.min(at);
                } else if dr * (q - q1) > 0.0 {
                    return 0.0;
                }
            }
            let middle = 0.0_f64.max(low).min(high);
            let parts = [(low, middle), (middle, high)];
            let part = |(from, to): (f64, f64)| {
                if from < to {
                    gauss_kronrod_to(|r| value(q, r), from, to, QUADRATURE, 1e-17 * a * b).value
                } else {
                    0.0
                }
            };
            half * parts.into_iter().map(part).sum::<f64>()
        };
        let horizon = (-nz / steep).clamp(-1.0, 1.0).asin();
        let mut marks = vec![horizon, FRAC_PI_2, 0.0];
        marks.extend(
            ends.iter()
                .flatten()
                .map(|[q, _]| q.clamp(-1.0, 1.0).asin()),
        );
        marks.retain(|m| *m >= horizon);
        marks.sort_by(f64::total_cmp);
        marks.windows(2).fold((0.0, 0.0), |(sum, error), pair| {
            let e = gauss_kronrod_to(across, pair[0], pair[1], QUADRATURE, 1e-16 * a * b);
            (sum + e.value, error + e.error)
        })
    }

    /// How often the rim meets the horizon, at most.
    fn meetings(&self) -> u32 {
        let ([a, b], [nx, ny, nz]) = (self.cone.tan, self.cone.axes.map(|k| k.dot(self.n)));
        if nz.abs() <= 1.01 * (nx * a).hypot(ny * b) {
            2
        } else {
            0
        }
    }

    /// The rounding error is 16 ε of the angle of the rim (at most π, and less for small cones)
    /// plus 4 ε, for a cone of any size, times the ratio of its angles for each point where pieces
    /// join or meet the horizon. These points have about unit length and are rounded across the
    /// narrower angle, which moves them by as much along the rim, so that the boundary has a gap
    /// there.
    fn compare(&self, name: &str, got: f64, places: u32, (want, error): (f64, f64)) {
        let ratio = self.cone.tan[0] / self.cone.tan[1];
        let [a, b] = self.cone.tan.map(|t| t.min(1.0));
        let rounding = f64::EPSILON * (16.0 * PI * a + 4.0 * ratio * f64::from(places));
        let tolerance = error + 8.0 * QUADRATURE * PI * a * b + rounding;
        assert_close!(got, want, tolerance, "{name}: {self:?}");
    }
}

/// Cones with half angles from 1e-6 to nearly a right one, round or up to a thousand times as wide
/// as high; and normals: any, nearly the axis, and some whose horizon passes within 1e-12 to 0.1 of
/// a point of the rim.
fn seen() -> impl Strategy<Value = Seen> {
    let size = prop_oneof![3 => -1.0..0.7f64, 1 => -6.0..-1.0f64, 1 => 0.7..3.0f64];
    let ratio = prop_oneof![1 => Just(0.0), 3 => -1.0..0.0f64, 1 => -3.0..0.0f64];
    let normal = (unit_vector(), 0..5_u8, -12.0..-1.0f64, 0.0..TAU);
    (unit_vector(), unit_vector(), size, ratio, normal).prop_map(
        |(axis, side, size, ratio, (away, kind, little, turn))| {
            let Frame { x, y, z } = Frame::from_normal_and_tangent(axis.into(), side.into());
            let wide = 10f64.powf(size);
            let cone = EllipticCone {
                axes: [x, y, z],
                tan: [wide, wide * 10f64.powf(ratio)],
            };
            let mut seen = Seen {
                cone,
                n: away.into(),
            };
            let (on_rim, little) = (seen.rim(turn).normalize(), 10f64.powf(little));
            match kind {
                0 => seen.n = (z + seen.n * little).normalize(),
                1 => seen.n = (seen.n - on_rim * (on_rim.dot(seen.n) - little)).normalize(),
                _ if seen.n.dot(z) < -0.5 => seen.n = -seen.n,
                _ => {}
            }
            seen
        },
    )
}

/// Two turns of the rim, apart by something between 1e-4 and all but 1e-4 of it.
fn turns() -> impl Strategy<Value = [f64; 2]> {
    let apart = prop_oneof![
        3 => 0.1..6.1f64,
        1 => (-4.0..-1.0f64).prop_map(|e| 10f64.powf(e)),
        1 => (-4.0..-1.0f64).prop_map(|e| TAU - 10f64.powf(e)),
    ];
    (0.0..TAU, apart).prop_map(|(turn, apart)| [turn, turn + apart])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(256), ..ProptestConfig::default() })]

    #[test]
    fn whole_cones_and_their_sectors(seen in seen(), first in 0.0..TAU, shares in [0.1..1.0f64, 0.1..1.0, 0.1..1.0], inside in [-0.6..0.6f64, -0.6..0.6]) {
        let want = seen.integral(None);
        let mut whole = PartOfCone::new(&seen.cone, seen.n);
        whole.add_rim();
        seen.compare("all", whole.irradiance(), seen.meetings(), want);
        // From a point within to three of the rim.
        let total: f64 = shares.iter().sum();
        let centre = seen.place(inside);
        let mut turn = first;
        let mut sum = 0.0;
        let rim: Vec<DVec3> = shares.iter().map(|s| { turn += s / total * TAU; seen.rim(turn) }).collect();
        for k in 0..3 {
            let (from, to) = (rim[k], rim[(k + 1) % 3]);
            let mut sector = PartOfCone::new(&seen.cone, seen.n);
            sector.add_segment(centre, from);
            sector.add_arc(from, to, shares[(k + 1) % 3] > 0.5 * total);
            sector.add_segment(to, centre);
            sum += sector.irradiance();
        }
        seen.compare("three sectors", sum, 9 + 2 * 6, want);
    }

    /// The chord's ends may be nearer or farther than the ellipse: only directions matter.
    #[test]
    fn parts_beside_a_chord(seen in seen(), turns in turns(), scales in [-3..=3_i32, -3..=3]) {
        let [from, to] = [0, 1].map(|k| seen.rim(turns[k]) * 2f64.powi(scales[k]));
        let mut part = PartOfCone::new(&seen.cone, seen.n);
        part.add_arc(from, to, turns[1] - turns[0] > PI);
        part.add_segment(to, from);
        seen.compare("a part", part.irradiance(), 2 + 4, seen.integral(Some(turns)));
    }

    /// With a hole of four corners, the way round that leaves it out.
    #[test]
    fn holes_are_left_out(seen in seen(), turn in 0.0..TAU, shares in [0.1..0.9f64, 0.1..0.9, 0.1..0.9, 0.1..0.9]) {
        let corner = |k: usize| {
            let (y, x) = (turn + TAU / 4.0 * k as f64).sin_cos();
            seen.place([shares[k] * x, shares[k] * y])
        };
        let corners = [corner(0), corner(1), corner(2), corner(3)];
        let mut part = PartOfCone::new(&seen.cone, seen.n);
        part.add_rim();
        for k in (0..4).rev() {
            part.add_segment(corners[(k + 1) % 4], corners[k]);
        }
        // Not convex: two triangles of either sign from the middle.
        let middle = seen.place([0.0, 0.0]);
        let hole: f64 = (0..4).map(|k| polygon::irradiance(&[middle, corners[k], corners[(k + 1) % 4]], seen.n)).sum();
        let (want, error) = seen.integral(None);
        seen.compare("a hole", part.irradiance(), 4 + 2 * 5, (want - hole, error));
    }
}
