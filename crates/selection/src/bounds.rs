//! Bounds and moments of groups of lights.

use crate::LARGEST;
use crate::contribution::{Receiver, positive_part};
use core::f64::consts::PI;
use linelit_elementary::{atan2, cos, sin, sin_cos};
use linelit_geometry::DVec3;
use linelit_lights::{Light, Normals};

/// Whether the lights of a group can light a surface point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reach {
    /// No light of the group can.
    None,
    /// The group does not tell; its members must be asked.
    Unknown,
    /// Every one of them can.
    All,
}

/// The bounds of a group of lights: a box, a cone that holds all normals, the power; and the first
/// two moments of where the power is and whereto it shines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    lo: DVec3,
    hi: DVec3,
    /// The square of half the box's diagonal.
    radius2: f64,
    /// Axis and half angle of the cone of normals; each light shines up to 90° off its normal.
    axis: DVec3,
    spread: f64,
    /// (sin, cos) of the half angle.
    cone: (f64, f64),
    /// The least and the largest coordinates of the normals, if all shine on one side alone.
    normals: Option<[DVec3; 2]>,
    /// Whether all shine in all directions.
    around: bool,
    /// Whether some are at infinity, so that a box tells nothing of them.
    endless: bool,
    /// Whether some are points, whose profile may send nothing in a direction.
    dim: bool,
    /// Whether some are neither polygons nor lines: their heights are found otherwise than their
    /// box's.
    round: bool,
    pub(crate) power: f64,
    /// Power-weighted mean position, mean squared distance from it, and mean normal (of two-sided
    /// lights: zero).
    mean: DVec3,
    variance: f64,
    normal: DVec3,
}

impl LightBounds {
    /// One light; `None` if it emits nothing. Powers above [`LARGEST`] count as that, so that those
    /// of groups are finite.
    pub(crate) fn new(light: &Light) -> Option<Self> {
        let power = light.power();
        if power.is_nan() || power <= 0.0 {
            return None;
        }
        // Turn the normals into a cone, and their mean.
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
        // Weight both by their power.
        let power = self.power + other.power;
        let (a, b) = (self.power / power, other.power / power);
        // Join boxes and cones.
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

    /// Cost of a group for the surface area orientation heuristic (Conty & Kulla 2018, §4.3, eq.
    /// 1): power × area of the box × the measure of the directions that are lit.
    pub(crate) fn cost(&self) -> f64 {
        let d = self.hi - self.lo;
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
        // A flat or point-like box still costs: its diagonal stands in.
        let area = area.max(1e-3 * d.length_squared());
        self.power * area * self.orientation_measure()
    }

    fn orientation_measure(&self) -> f64 {
        let o = self.spread;
        let w = (o + 0.5 * PI).min(PI);
        let (so, co) = sin_cos(o);
        2.0 * PI * (1.0 - co) + 0.5 * PI * (2.0 * w * so - cos(o - 2.0 * w) - 2.0 * o * so + co)
    }

    /// Whether the group is small for its distance from `x`: its box has a radius below `ratio`
    /// times the distance, or a quarter of that if it straddles the horizon, where a mean says
    /// little of its lights.
    pub(crate) fn is_far(&self, x: DVec3, n: DVec3, ratio: f64) -> bool {
        let to = self.center() - x;
        let height = n.dot(to);
        let straddles = height * height < self.radius2;
        let ratio = if straddles { 0.25 * ratio } else { ratio };
        self.radius2 < ratio * ratio * to.length_squared()
    }

    /// Whether lights of the group can contribute to a surface at `x` with the unit normal `n`, as
    /// [`can_contribute`](super::can_contribute) decides it for each.
    ///
    /// [`Reach::None`] and [`Reach::All`] are true whatever was rounded. Heights over the tangent
    /// plane: rounding is monotonic and a box's corners are reached by the same operations as a
    /// light's, so the highest corner is never below a vertex in it, bit for bit; round lights,
    /// whose heights are found otherwise, get a slack of 8 ε of the terms (2 ε each for both sums
    /// and the box, 4 ε for a unit normal). Angles: 10⁻⁹, where those of normals have
    /// some 10⁻¹⁴ after 64 unions and that of the box is widened by 4 ε of the coordinates.
    pub(crate) fn reach(&self, x: DVec3, n: DVec3) -> Reach {
        if self.endless {
            return Reach::Unknown;
        }
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
        if self.is_behind(x) {
            return Reach::None;
        }
        let to = self.center() - x;
        let d2 = to.length_squared();
        let radius = self.radius2.sqrt() + 4.0 * f64::EPSILON * sum(largest.max(x.abs()));
        let d = d2.sqrt();
        // Inside, or where squares overflow or lose digits.
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

    /// Whether a point lies behind all lights of the group, which shine on one side alone: no
    /// normal and no place within their boxes has it in front. Products and their sum lose at most
    /// 8 ε of the coordinates.
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

    /// Upper-bound importance at `x` with the unit normal `n` (Conty & Kulla 2018, §5, eq. 3), with
    /// cosines of at least 10⁻³.
    pub(crate) fn bound(&self, x: DVec3, n: DVec3) -> f64 {
        let to = self.center() - x;
        let d2 = to.length_squared();
        let near = d2.max(self.radius2).max(f64::MIN_POSITIVE);
        if d2 <= self.radius2 {
            return self.power / near;
        }
        let d = d2.sqrt();
        // Angles as (sin, cos): the box as seen from x, off the axis of the normals, off the
        // surface normal.
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

    /// Expected contribution from the moments: the group as a blurred light, smooth and positive
    /// everywhere.
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

/// The square of half a box's diagonal.
fn radius2(lo: DVec3, hi: DVec3) -> f64 {
    0.25 * (hi - lo).length_squared()
}

/// (sin, cos) of the half angle under which a ball is seen whose centre is at the distance `d`
/// beyond its radius.
fn box_angle(radius: f64, d: f64) -> (f64, f64) {
    let sine = (radius / d).min(1.0);
    (sine, ((1.0 - sine) * (1.0 + sine)).sqrt())
}

/// a + b for angles given as (sin, cos); any angle beyond 90° becomes 180°.
fn more(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if a.1 > 0.0 && b.1 > 0.0 {
        (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0)
    } else {
        (0.0, -1.0)
    }
}

/// max(0, a − b) for angles in [0, π] given as (sin, cos).
fn less(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if a.1 >= b.1 {
        (0.0, 1.0)
    } else {
        (a.0 * b.1 - a.1 * b.0, a.1 * b.1 + a.0 * b.0)
    }
}

/// The smallest cone, nearly, that holds two cones (Conty & Kulla 2018, algorithm 1).
fn union_of_cones(a: (DVec3, f64), b: (DVec3, f64)) -> (DVec3, f64) {
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = atan2(a.0.cross(b.0).length(), a.0.dot(b.0));
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    let spread = 0.5 * (a.1 + between + b.1);
    if spread >= PI {
        return (a.0, PI);
    }
    let turn = spread - a.1;
    let side = b.0 - a.0 * a.0.dot(b.0);
    // Of nearly opposite axes little but rounding is left, which points anywhere, even along them.
    if side.length() < 1e-5 && a.0.dot(b.0) < 0.0 {
        return (a.0, PI);
    }
    match side.try_normalize() {
        Some(t) => ((a.0 * cos(turn) + t * sin(turn)).normalize(), spread),
        // The axes are the same to rounding.
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
