//! This module bounds groups of lights: it answers whether a group can light a point, and estimates
//! how much light it gives.

use crate::LARGEST;
use crate::contribution::{Receiver, positive_part};
use core::f64::consts::PI;
use linelit_elementary::{atan2, cos, sin, sin_cos};
use linelit_geometry::DVec3;
use linelit_lights::{Light, Normals};

/// Whether the lights of a group can light a surface point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reach {
    /// No light of the group can light the point.
    None,
    /// The bounds do not decide it; the members have to be tested.
    Unknown,
    /// Every light of the group can light the point.
    All,
}

/// The bounds of a group of lights: a box around them, a cone that contains all normals, and the
/// power; also the first two moments of the distribution of power over positions and directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    lo: DVec3,
    hi: DVec3,
    /// The square of half the box's diagonal.
    radius2: f64,
    /// The axis of the cone that contains all normals; the next field is the cone's half angle in
    /// radians. Each light shines up to 90° off its normal.
    axis: DVec3,
    spread: f64,
    /// (sin, cos) of the half angle of the cone.
    cone: (f64, f64),
    /// The smallest and the largest coordinates of the normals, if all lights shine on one side
    /// only.
    normals: Option<[DVec3; 2]>,
    /// Whether all lights shine in all directions.
    around: bool,
    /// Whether some lights are at infinity, so that the box says nothing about them.
    endless: bool,
    /// Whether some lights are points, whose profile may be zero in a direction.
    dim: bool,
    /// Whether some lights are neither polygons nor linear lights. The heights of such lights are
    /// computed by other operations than the heights of the box, and need a tolerance.
    round: bool,
    pub(crate) power: f64,
    /// The power-weighted mean position; the next two fields are the mean squared distance from it,
    /// and the mean normal (which is zero for two-sided lights).
    mean: DVec3,
    variance: f64,
    normal: DVec3,
}

impl LightBounds {
    /// Makes the bounds of one light; `None` if it emits no light. Powers above [`LARGEST`] are
    /// clamped to it, so that the powers of groups are finite.
    pub(crate) fn new(light: &Light) -> Option<Self> {
        let power = light.power();
        if power.is_nan() || power <= 0.0 {
            return None;
        }
        // Represent the normals by a cone and by their mean.
        let extent = light.extent();
        let (lo, hi) = extent.bounds;
        let (axis, spread, normal) = match extent.normals {
            Normals::Around => (DVec3::Z, PI, DVec3::ZERO),
            Normals::One(normal) => (normal, 0.0, normal),
            Normals::Both(normal) => (normal, PI, DVec3::ZERO),
        };
        Some(Self {
            lo,
            hi,
            radius2: radius2(lo, hi),
            axis,
            spread,
            cone: sin_cos(spread),
            normals: match extent.normals {
                Normals::One(normal) => Some([normal; 2]),
                Normals::Both(_) | Normals::Around => None,
            },
            around: extent.normals == Normals::Around,
            endless: matches!(light, Light::Distant(_) | Light::Sky(_)),
            dim: matches!(light, Light::Point(_)),
            round: !matches!(light, Light::Area(_) | Light::Linear(_)),
            power: power.min(LARGEST),
            mean: extent.mean,
            variance: extent.variance,
            normal,
        })
    }

    /// Returns the bounds of both groups together.
    pub(crate) fn union(&self, other: &Self) -> Self {
        // Weight the moments of both groups by power.
        let power = self.power + other.power;
        let (a, b) = (self.power / power, other.power / power);
        // Join the boxes and the cones.
        let (axis, spread) = union_of_cones((self.axis, self.spread), (other.axis, other.spread));
        let (lo, hi) = (self.lo.min(other.lo), self.hi.max(other.hi));
        Self {
            lo,
            hi,
            radius2: radius2(lo, hi),
            axis,
            spread,
            cone: sin_cos(spread),
            normals: (self.normals.zip(other.normals)).map(|([a, b], [c, d])| [a.min(c), b.max(d)]),
            around: self.around && other.around,
            endless: self.endless || other.endless,
            dim: self.dim || other.dim,
            round: self.round || other.round,
            power,
            mean: self.mean * a + other.mean * b,
            variance: self.variance * a
                + other.variance * b
                + a * b * (self.mean - other.mean).length_squared(),
            normal: self.normal * a + other.normal * b,
        }
    }

    pub(crate) fn center(&self) -> DVec3 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// Returns the cost of a group for the surface area orientation heuristic (Conty & Kulla 2018,
    /// §4.3, eq. 1): power × area of the box × the measure of the directions that are lit.
    pub(crate) fn cost(&self) -> f64 {
        let d = self.hi - self.lo;
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
        // A box that is a line or a point has no area: use its diagonal.
        let area = area.max(1e-3 * d.length_squared());
        self.power * area * self.orientation_measure()
    }

    /// Returns the measure of the directions that are lit, by the cone of normals (Conty & Kulla
    /// 2018, eq. 1).
    fn orientation_measure(&self) -> f64 {
        let o = self.spread;
        let w = (o + 0.5 * PI).min(PI);
        let (so, co) = sin_cos(o);
        2.0 * PI * (1.0 - co) + 0.5 * PI * (2.0 * w * so - cos(o - 2.0 * w) - 2.0 * o * so + co)
    }

    /// Whether the group is small compared with its distance from `x`: half the diagonal of its box
    /// is below `ratio` times the distance. If the box crosses the horizon, where a mean says
    /// little about single lights, it has to be below a quarter of that.
    pub(crate) fn is_far(&self, x: DVec3, n: DVec3, ratio: f64) -> bool {
        let to = self.center() - x;
        let height = n.dot(to);
        let straddles = height * height < self.radius2;
        let ratio = if straddles { 0.25 * ratio } else { ratio };
        self.radius2 < ratio * ratio * to.length_squared()
    }

    /// Whether lights of the group can contribute to a surface at `x` with the unit normal `n`, in
    /// the sense in which [`can_contribute`](super::can_contribute) decides it for each light.
    ///
    /// [`Reach::None`] and [`Reach::All`] are true in spite of rounding. Heights above the tangent
    /// plane: rounding is monotonic, and the heights of a box's corners are computed by the same
    /// operations as the heights of a light's vertices, so that the highest corner is never below a
    /// vertex in the box, bit for bit. Round lights, whose heights are computed otherwise, get a
    /// slack of 8 ε of the terms (2 ε each for both sums and the box, 4 ε for a unit normal).
    /// Angles have a slack of 10⁻⁹; the angles of normals have an error of some 10⁻¹⁴ after 64
    /// unions, and the angle of the box is widened by 4 ε of the coordinates.
    pub(crate) fn reach(&self, x: DVec3, n: DVec3) -> Reach {
        if self.endless {
            return Reach::Unknown;
        }
        // Compare the heights of the lowest and the highest corner with the tangent plane.
        let (a, b) = (n * (self.lo - x), n * (self.hi - x));
        let sum = |v: DVec3| v.x + v.y + v.z;
        let largest = self.lo.abs().max(self.hi.abs());
        let slack = if self.round {
            8.0 * f64::EPSILON * (sum(a.abs().max(b.abs())) + sum(largest))
        } else {
            0.0
        };
        if sum(a.max(b)) <= -slack {
            return Reach::None;
        }
        let above = sum(a.min(b)) > slack && !self.dim;
        if self.around {
            return if above { Reach::All } else { Reach::Unknown };
        }
        // Compare the angle between the normals and the direction to the point with 90°.
        if self.is_behind(x) {
            return Reach::None;
        }
        let to = self.center() - x;
        let d2 = to.length_squared();
        let radius = self.radius2.sqrt() + 4.0 * f64::EPSILON * sum(largest.max(x.abs()));
        let d = d2.sqrt();
        // The point is inside, or squares overflow or lose digits.
        if !(d > radius && d2 > 1e-280 && d2 < 1e280) {
            return Reach::Unknown;
        }
        let seen = box_angle(radius, d);
        let off_axis = (self.axis.cross(to).length() / d, -self.axis.dot(to) / d);
        if less(less(off_axis, self.cone), seen).1 <= -1e-9 {
            return Reach::None;
        }
        let facing = more(more(off_axis, self.cone), seen).1 > 1e-9;
        if above && facing {
            Reach::All
        } else {
            Reach::Unknown
        }
    }

    /// Whether a point lies behind all lights of the group, which shine on one side only: for no
    /// normal and no position within their boxes is it in front. Products and their sum lose at
    /// most 8 ε of the coordinates.
    fn is_behind(&self, x: DVec3) -> bool {
        let Some([least, most]) = self.normals else {
            return false;
        };
        let (from, to) = (x - self.hi, x - self.lo);
        let highest = (least * from)
            .max(least * to)
            .max(most * from)
            .max(most * to);
        let largest = self.lo.abs().max(self.hi.abs()).max(x.abs());
        highest.element_sum() < -16.0 * f64::EPSILON * largest.element_sum()
    }

    /// Returns an upper bound of the importance at `x` with the unit normal `n` (Conty & Kulla
    /// 2018, §5, eq. 3), with cosines of at least 10⁻³.
    pub(crate) fn bound(&self, x: DVec3, n: DVec3) -> f64 {
        let to = self.center() - x;
        let d2 = to.length_squared();
        let near = d2.max(self.radius2).max(f64::MIN_POSITIVE);
        if d2 <= self.radius2 {
            return self.power / near;
        }
        let d = d2.sqrt();
        // Represent angles by (sin, cos): the half angle of the box as seen from x, the angle off
        // the axis of the normals, and the angle off the surface normal.
        let angle = |cosine: f64| {
            let c = cosine.clamp(-1.0, 1.0);
            (((1.0 - c) * (1.0 + c)).sqrt(), c)
        };
        let seen = box_angle(self.radius2.sqrt(), d);
        let off_axis = angle(-self.axis.dot(to) / d);
        let emit = less(less(off_axis, self.cone), seen).1;
        let incident = less(angle(n.dot(to) / d), seen).1;
        let floor = 1e-3;
        self.power * emit.max(floor) * incident.max(floor) / near
    }

    /// Returns the expected contribution by the moments, which treat the group as a blurred light;
    /// it is smooth and positive everywhere.
    pub(crate) fn expected(&self, at: &Receiver<impl Fn(DVec3) -> DVec3>) -> f64 {
        let to = self.mean - at.position;
        let d2 = to.length_squared() + self.variance;
        if d2 <= 0.0 {
            return self.power;
        }
        let d = d2.sqrt();
        let blur = self.variance / d2;
        let emit = positive_part(
            -self.normal.dot(to) / d,
            (1.0 - self.normal.length_squared()).max(0.0) + blur,
        );
        let reflected = (at.reflected)(to / d).element_sum() / 3.0;
        let floor = 1e-6;
        self.power * emit.max(floor) * reflected.max(floor) / d2
    }
}

/// Returns the square of half a box's diagonal.
fn radius2(lo: DVec3, hi: DVec3) -> f64 {
    0.25 * (hi - lo).length_squared()
}

/// Returns (sin, cos) of the half angle under which a ball is seen whose centre is at the distance
/// `d`, which is larger than its radius.
fn box_angle(radius: f64, d: f64) -> (f64, f64) {
    let sine = (radius / d).min(1.0);
    (sine, ((1.0 - sine) * (1.0 + sine)).sqrt())
}

/// Returns a + b for angles given as (sin, cos); if either is beyond 90°, the result is 180°.
fn more(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if a.1 > 0.0 && b.1 > 0.0 {
        (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0)
    } else {
        (0.0, -1.0)
    }
}

/// Returns max(0, a − b) for angles in [0, π] given as (sin, cos).
fn less(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if a.1 >= b.1 {
        (0.0, 1.0)
    } else {
        (a.0 * b.1 - a.1 * b.0, a.1 * b.1 + a.0 * b.0)
    }
}

/// Returns almost the smallest cone that contains two cones (Conty & Kulla 2018, algorithm 1).
fn union_of_cones(a: (DVec3, f64), b: (DVec3, f64)) -> (DVec3, f64) {
    // Return the wider cone if it contains the other.
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = atan2(a.0.cross(b.0).length(), a.0.dot(b.0));
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    // Otherwise turn its axis towards the other cone, so that it touches both.
    let spread = 0.5 * (a.1 + between + b.1);
    if spread >= PI {
        return (a.0, PI);
    }
    let turn = spread - a.1;
    let side = b.0 - a.0 * a.0.dot(b.0);
    // If the axes are nearly opposite, the difference is mostly rounding, which may point anywhere.
    if side.length() < 1e-5 && a.0.dot(b.0) < 0.0 {
        return (a.0, PI);
    }
    match side.try_normalize() {
        Some(t) => ((a.0 * cos(turn) + t * sin(turn)).normalize(), spread),
        // The axes are equal up to rounding.
        None => (a.0, spread),
    }
}

#[cfg(test)]
mod tests {
    use super::union_of_cones;
    use core::f64::consts::PI;
    use linelit_geometry::DVec3;
    use linelit_testkit::strategies::unit_vector;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::default()
        })]

        /// Axes of all kinds, many nearly the same or nearly opposite, where the plane of both is
        /// lost in rounding.
        #[test]
        fn unions_hold_both_cones(
            a in unit_vector().prop_map(DVec3::from),
            towards in unit_vector().prop_map(DVec3::from),
            shift in (-18i32..1).prop_map(|e| 10f64.powi(e)),
            opposite in any::<bool>(),
            spreads in [0.0..1.6f64, 0.0..0.1f64],
        ) {
            let b = ((if opposite { -a } else { a }) + towards * shift).try_normalize().unwrap_or(a);
            for spreads in [spreads, [0.0; 2]] {
                let (axis, spread) = union_of_cones((a, spreads[0]), (b, spreads[1]));
                for (other, inner) in [(a, spreads[0]), (b, spreads[1])] {
                    let between = axis.cross(other).length().atan2(axis.dot(other));
                    // What `reach` allows for.
                    prop_assert!((between + inner).min(PI) <= spread + 1e-10);
                }
            }
        }
    }
}
