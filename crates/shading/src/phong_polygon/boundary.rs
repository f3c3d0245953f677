//! The lobe by its boundary: Stokes' theorem twice, one integral for each edge.

use crate::exact::dot;
use crate::fan::Fan;
use crate::gauss::{NODE, NODES, WEIGHT};
use crate::lobe::{SMOOTH, window};
use crate::solid_angle::volume;
use linelit_elementary::{atan2, cos, exp, exp_m1, hypot, ln, ln_1p, pow, sin, tan};
use linelit_geometry::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::ops::{Add, Mul};

/// An angle of which the sine is a hundredth, close to π.
const NEARLY_STRAIGHT: f64 = 3.13;

/// The normals of edges are rounded: by 4 ε, of the 2000 ε of [`error`].
const PLANE: f64 = 2e-3;
/// Along an edge that is nowhere higher above the lobe's horizon, rounding tells how high.
const LOW: f64 = 1e-4;

/// An edge as an arc about its point nearest to the axis.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Angles of its ends.
    from: f64,
    to: f64,
    /// g = G·w, positive inside.
    distance: f64,
    /// √(1 − g²).
    reach: f64,
    /// G·n.
    lean: f64,
    /// z at the higher end.
    highest: f64,
}

impl Edge {
    fn new(a: DVec3, b: DVec3, n: DVec3, w: DVec3, turn: f64) -> Option<Self> {
        let fan = Fan::new(a, b, &[])?;
        if fan.sine <= 0.0 {
            return None;
        }
        let start = dot(w, a) / fan.radii[0];
        let rise = fan.slope(w, 0);
        let centre = atan2(rise, start);
        Some(
            Self {
                from: -centre,
                to: fan.angle - centre,
                distance: turn * dot(fan.normal, w),
                reach: hypot(start, rise),
                lean: turn * dot(fan.normal, n),
                highest: start.max(dot(w, b) / fan.radii[1]),
            }
            .oriented(turn),
        )
    }

    /// Runs the other way round where the polygon does.
    fn oriented(self, turn: f64) -> Self {
        if turn > 0.0 {
            self
        } else {
            Self {
                from: -self.to,
                to: -self.from,
                ..self
            }
        }
    }

    /// 1 − z² at x.
    fn gap(&self, x: f64) -> f64 {
        let s = self.reach * sin(x);
        self.distance * self.distance + s * s
    }

    fn integral(&self, k: f64, facing: f64, tail: bool) -> Sum {
        let (from, to) = (self.from, self.to);
        if to - from > NEARLY_STRAIGHT {
            // Of a cut edge, the rounded ends do not know the plane.
            return Sum {
                value: 0.0,
                size: f64::INFINITY,
            };
        }
        if self.highest <= 4.0 * f64::EPSILON {
            // On the lobe's own horizon, where the clip has cut: z = 0 all along, and z⁰ = 1.
            let ones = if tail || k <= 0.0 {
                0.0
            } else {
                facing * self.distance
            };
            let power = if k > 0.0 { 0.0 } else { self.lean };
            let sum = Sum::of((ones + power) * (to - from));
            // A small power of what is no more than rounding decides nothing.
            let size = if k > 0.0 && k < 1.0 {
                f64::INFINITY
            } else {
                sum.size
            };
            return Sum { size, ..sum };
        }
        if self.reach < LOW {
            return Sum {
                value: 0.0,
                size: f64::INFINITY,
            };
        }
        // The highest point of the lobe on the edge, and the window about it.
        let peak = 0.0f64.clamp(from, to);
        let width = window(k, tan(peak.abs()));
        let (low, high) = ((peak - width).max(from), (peak + width).min(to));
        let panel = |a: f64, b: f64| self.panel(a, b, k, facing, tail);
        let mut sum = panel(low, peak) + panel(peak, high);
        if !tail {
            for (a, b) in [(from, low), (high, to)] {
                sum = sum + Sum::of(facing * self.azimuth(a, b));
            }
        }
        sum
    }

    /// ∫ g dx/(1 − z²) between two angles: the azimuth about the axis.
    fn azimuth(&self, a: f64, b: f64) -> f64 {
        if b <= a {
            return 0.0;
        }
        let g = self.distance;
        atan2(g * sin(b - a), g * g * cos(a) * cos(b) + sin(a) * sin(b))
    }

    fn value(&self, x: f64, k: f64, facing: f64, tail: bool) -> Sum {
        let gap = self.gap(x).min(1.0);
        let log = if k <= 0.0 {
            0.0
        } else if gap < 0.5 {
            0.5 * k * ln_1p(-gap)
        } else {
            k * ln((self.reach * cos(x)).max(f64::MIN_POSITIVE))
        };
        let power = exp(log);
        let share = if tail {
            -power / gap
        } else if gap > 0.0 {
            -exp_m1(log) / gap
        } else {
            0.5 * k
        };
        let (turn, push) = (facing * self.distance * share, self.lean * power);
        Sum {
            value: turn + push,
            size: turn.abs() + push.abs() + PLANE * ((facing * share).abs() + power),
        }
    }

    fn panel(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> Sum {
        if b <= a {
            return Sum::default();
        }
        let rough = k < SMOOTH && k.fract() != 0.0;
        if rough && FRAC_PI_2 - b.abs().max(a.abs()) < b - a {
            let middle = 0.5 * (a + b);
            let (inner, outer) = if b.abs() >= a.abs() {
                ((a, middle), (middle, b))
            } else {
                ((middle, b), (a, middle))
            };
            return self.plain(inner.0, inner.1, k, facing, tail)
                + self.near_horizon(outer.0, outer.1, k, facing, tail);
        }
        self.plain(a, b, k, facing, tail)
    }

    fn plain(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> Sum {
        let node = |i: usize| self.value(a + (b - a) * NODE[i], k, facing, tail) * WEIGHT[i];
        (0..NODES).map(node).fold(Sum::default(), Add::add) * (b - a)
    }

    /// With π/2 − |x| = y⁸, for a lobe that ends like (π/2 − |x|)ᵏ with a k that is no integer.
    fn near_horizon(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> Sum {
        let root = |x: f64| pow((FRAC_PI_2 - x.abs()).max(0.0), 0.125);
        let (y0, y1) = (root(a).min(root(b)), root(a).max(root(b)));
        let sign = 1f64.copysign(a + b);
        let node = |i: usize| {
            let y = y0 + (y1 - y0) * NODE[i];
            let seventh = y.powi(7);
            let x = sign * (FRAC_PI_2 - seventh * y);
            self.value(x, k, facing, tail) * (8.0 * seventh * WEIGHT[i])
        };
        (0..NODES).map(node).fold(Sum::default(), Add::add) * (y1 - y0)
    }
}

/// A sum, and that of its terms' magnitudes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    pub(super) value: f64,
    pub(super) size: f64,
}

impl Sum {
    fn of(value: f64) -> Self {
        Self {
            value,
            size: value.abs(),
        }
    }
}

impl Add for Sum {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            size: self.size + other.size,
        }
    }
}

/// Times a number that is not negative.
impl Mul<f64> for Sum {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            size: self.size * factor,
        }
    }
}

/// `(k + 2) ∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over a polygon that is above both horizons, for a w of
/// length one.
///
/// Where the axis passes well outside, the ones add up to nothing over all edges and are left out,
/// which keeps the tails accurate relative to themselves.
pub(super) fn integral(polygon: &[DVec3], n: DVec3, w: DVec3, k: f64) -> Sum {
    let count = polygon.len();
    let turn = orientation(polygon);
    let edges =
        || (0..count).filter_map(|i| Edge::new(polygon[i], polygon[(i + 1) % count], n, w, turn));
    // How far the axis is outside of the polygon, at most; a side of rounding's length does not
    // know.
    let outside = edges()
        .filter(|e| e.to - e.from > 1e-10)
        .map(|e| -e.distance)
        .fold(0.0, f64::max);
    let tail = k * outside * outside > 12.0;
    let facing = n.dot(w);
    edges()
        .map(|e| e.integral(k, facing, tail))
        .fold(Sum::default(), Add::add)
}

/// The error of [`integral`] relative to the sum of its terms' magnitudes, at most, for a polygon
/// with sides up to `size` of its distance: nodes (5e-13), the lobe's exponent, which is at most
/// 645 and then has a slope of √(1300 k), times the rounding of directions, and that of cut
/// corners, which turns short sides.
pub(super) fn error(k: f64, size: f64) -> f64 {
    (2000.0 + 2.0 * k.min((1300.0 * k).sqrt())) * (1.0 + 1.0 / size) * f64::EPSILON
}

/// 1 where the vertices are counter-clockwise seen from the shading point, else −1.
fn orientation(polygon: &[DVec3]) -> f64 {
    let fan = |pair: &[DVec3]| volume(polygon[0], pair[0], pair[1]);
    1f64.copysign(polygon[1..].windows(2).map(fan).sum())
}
