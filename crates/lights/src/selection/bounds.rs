//! Bounds and moments of groups of lights.

use crate::light::Light;
use core::f64::consts::PI;
use linelit_geometry::DVec3;

/// What a group of lights looks like from outside: a box, a cone that holds all normals, the power; and the first two
/// moments of where the power is and whereto it shines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    lo: DVec3,
    hi: DVec3,
    /// Axis and half angle of the cone of normals; each light shines up to 90° off its normal.
    axis: DVec3,
    spread: f64,
    pub(crate) power: f64,
    /// Power-weighted mean position, mean squared distance from it, and mean normal (of two-sided lights: zero).
    mean: DVec3,
    variance: f64,
    normal: DVec3,
}

impl LightBounds {
    /// One light; `None` if it emits nothing.
    pub(crate) fn new(light: &Light) -> Option<Self> {
        let power = light.power();
        if power <= 0.0 || !power.is_finite() {
            return None;
        }
        let around = |points: &[DVec3]| {
            points
                .iter()
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, p| {
                    (b.0.min(*p), b.1.max(*p))
                })
        };
        let one_side = |normal: DVec3, two_sided: bool| {
            if two_sided {
                (normal, PI, DVec3::ZERO)
            } else {
                (normal, 0.0, normal)
            }
        };
        let ((lo, hi), mean, variance, (axis, spread, normal)) = match light {
            Light::Area(l) => {
                let vertices = l.polygon.vertices();
                let c = l.polygon.centroid();
                // A triangle's second moment is 1/12 of the sum of its corners'; near enough for any polygon.
                let spread: f64 = vertices.iter().map(|v| (*v - c).length_squared()).sum();
                let sides = one_side(l.polygon.normal(), l.emission.two_sided);
                (around(vertices), c, spread / 12.0, sides)
            }
            Light::Linear(l) => {
                let ends = [l.segment.p0, l.segment.p1];
                let variance = l.segment.vector().length_squared() / 12.0;
                (
                    around(&ends),
                    l.segment.at(0.5),
                    variance,
                    (DVec3::Z, PI, DVec3::ZERO),
                )
            }
            Light::Sphere(l) => {
                let (c, r) = (l.sphere.center, DVec3::splat(l.sphere.radius));
                let variance = l.sphere.radius * l.sphere.radius;
                ((c - r, c + r), c, variance, (DVec3::Z, PI, DVec3::ZERO))
            }
            Light::Disk(l) => {
                let n = l.disk.normal;
                let r = (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt) * l.disk.radius;
                let (c, variance) = (l.disk.center, 0.5 * l.disk.radius * l.disk.radius);
                (
                    (c - r, c + r),
                    c,
                    variance,
                    one_side(n, l.emission.two_sided),
                )
            }
        };
        Some(Self {
            lo,
            hi,
            axis,
            spread,
            power,
            mean,
            variance,
            normal,
        })
    }

    /// Both groups together.
    pub(crate) fn union(&self, other: &Self) -> Self {
        let power = self.power + other.power;
        let (a, b) = (self.power / power, other.power / power);
        let (axis, spread) = union_of_cones((self.axis, self.spread), (other.axis, other.spread));
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
            axis,
            spread,
            power,
            mean: self.mean * a + other.mean * b,
            variance: self.variance * a
                + other.variance * b
                + a * b * (self.mean - other.mean).length_squared(),
            normal: self.normal * a + other.normal * b,
        }
    }

    pub(crate) fn center(&self) -> DVec3 {
        0.5 * (self.lo + self.hi)
    }

    /// Cost of a group for the surface area orientation heuristic (Conty & Kulla 2018, §4.3, eq. 1): power × area of the
    /// box × the measure of the directions that are lit.
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
        let (so, co) = o.sin_cos();
        2.0 * PI * (1.0 - co) + 0.5 * PI * (2.0 * w * so - (o - 2.0 * w).cos() - 2.0 * o * so + co)
    }

    /// Whether the group is small for its distance from `x`: its box has a radius below `ratio` times the distance, or a
    /// quarter of that if it straddles the horizon, where a mean says little of its lights.
    pub(crate) fn is_far(&self, x: DVec3, n: DVec3, ratio: f64) -> bool {
        let radius2 = 0.25 * (self.hi - self.lo).length_squared();
        let to = self.center() - x;
        let height = n.dot(to);
        let straddles = height * height < radius2;
        let ratio = if straddles { 0.25 * ratio } else { ratio };
        radius2 < ratio * ratio * to.length_squared()
    }

    /// Upper-bound importance at `x` with the unit normal `n` (Conty & Kulla 2018, §5, eq. 3): zero only if no light of the
    /// group can contribute.
    pub(crate) fn bound(&self, x: DVec3, n: DVec3) -> f64 {
        let to = self.center() - x;
        let d2 = to.length_squared();
        let radius2 = 0.25 * (self.hi - self.lo).length_squared();
        let near = d2.max(radius2).max(f64::MIN_POSITIVE);
        if d2 <= radius2 {
            return self.power / near;
        }
        let inverse = 1.0 / d2.sqrt();
        // Angles as (sin, cos): the box as seen from x, off the axis of the normals, off the surface normal.
        let angle = |cosine: f64| {
            let c = cosine.clamp(-1.0, 1.0);
            (((1.0 - c) * (1.0 + c)).sqrt(), c)
        };
        let sine = (radius2.sqrt() * inverse).min(1.0);
        let uncertain = (sine, ((1.0 - sine) * (1.0 + sine)).sqrt());
        let off_axis = angle(-self.axis.dot(to) * inverse);
        let emit = less(less(off_axis, self.spread.sin_cos()), uncertain).1;
        let incident = less(angle(n.dot(to) * inverse), uncertain).1;
        // Rounding near the right angle must not make a false zero.
        if emit <= -1e-9 || incident <= -1e-9 {
            return 0.0;
        }
        let floor = 1e-3;
        self.power * emit.max(floor) * incident.max(floor) / near
    }

    /// Expected contribution at `x` from the moments: the group as a blurred light, smooth and positive everywhere.
    ///
    /// The mean of max(0, c) over a spread s about c is taken as (c + √(c² + s²/4))/2, exact for no spread (then it is
    /// max(0, c)) and for normals of all directions (¼).
    pub(crate) fn expected(&self, x: DVec3, n: DVec3) -> f64 {
        let to = self.mean - x;
        let d2 = to.length_squared() + self.variance;
        if d2 <= 0.0 {
            return self.power;
        }
        let d = d2.sqrt();
        let positive_part = |c: f64, s2: f64| 0.5 * (c + (c * c + 0.25 * s2).sqrt());
        let blur = self.variance / d2;
        let emit = positive_part(
            -self.normal.dot(to) / d,
            (1.0 - self.normal.length_squared()).max(0.0) + blur,
        );
        let incident = positive_part(n.dot(to) / d, blur);
        let floor = 1e-6;
        self.power * emit.max(floor) * incident.max(floor) / d2
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
    let between = a.0.cross(b.0).length().atan2(a.0.dot(b.0));
    if (between + b.1).min(PI) <= a.1 {
        return a;
    }
    let spread = 0.5 * (a.1 + between + b.1);
    if spread >= PI {
        return (a.0, PI);
    }
    let turn = spread - a.1;
    let side = (b.0 - a.0 * a.0.dot(b.0)).try_normalize();
    match side {
        Some(t) => ((a.0 * turn.cos() + t * turn.sin()).normalize(), spread),
        None => (a.0, PI),
    }
}
