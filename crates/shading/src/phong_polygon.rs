//! A Phong or cosine lobe over a convex polygon: Arvo's double-axis moment.
//!
//! Symbols: vertices relative to the shading point; n shading normal, w the lobe's axis, k its
//! exponent (any real number ≥ 0), z = w·ω; the polygon is clipped to n·ω ≥ 0 and w·ω ≥ 0. For
//! each edge, G is the inward unit normal of its plane through the shading point, g = G·w, x the
//! angle along the edge from the point nearest to the axis, ψ the azimuth about the axis.

use crate::exact::{dot, settle};
use crate::fan::Fan;
use crate::gauss::{NODE, NODES, WEIGHT};
use crate::horizon::crossing;
use crate::lobe::{log_axis_length, window};
use crate::polygon::{clip_with, irradiance as lambert};
use crate::solid_angle;
use crate::span::power_of_two_unit;
use linelit_geometry::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

const CAPACITY: usize = 32;

/// `∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over the polygon, dimensionless. Times
/// [`normalisation`](crate::phong::normalisation) and k_s it is the radiance that a Phong surface
/// reflects for each unit of the light's radiance.
///
/// **Formula**: Stokes' theorem twice,
///
/// ```text
/// (k + 2) T = Σ_edges ∫ [ (w·n) g (1 − zᵏ)/(1 − z²) + (G·n) zᵏ ] dx
/// ```
///
/// Within the lobe's window along an edge the bracket is smooth and integrated on two panels of 24
/// Gauss–Legendre nodes; beyond it zᵏ has vanished and the rest, ∫ g dx/(1 − z²) = Δψ, is an
/// arctangent. Where the axis passes well outside, the ones add up to nothing over all edges and
/// are left out, which keeps the tails accurate relative to themselves. The cost does not depend
/// on k.
///
/// **Domain**: convex, either order, at most 24 vertices; w of unit length but for rounding.
///
/// **Error**: 1e-10 relative to [`condition`] (`docs/accuracy.md`).
///
/// **Source**: Arvo 1995, "Applications of Irradiance Tensors", whose recursion costs O(k) for each
/// edge and needs an integer; this form is our own.
///
/// ```
/// use linelit_geometry::DVec3;
/// use linelit_shading::phong_polygon;
/// // A huge square overhead, the lobe straight up: 2π/(k + 2).
/// let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
///     .map(|(x, y)| DVec3::new(1e6 * x, 1e6 * y, 1.0));
/// let t = phong_polygon::irradiance(&square, DVec3::Z, DVec3::Z, 1000.0);
/// assert!((t * 1002.0 / (2.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn irradiance(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let Some((polygon, count)) = clip(vertices, n, w) else {
        return 0.0;
    };
    let polygon = &polygon[..count];
    if k <= 0.0 {
        return lambert(polygon, n);
    }
    let unit_axis = w.normalize_or_zero();
    let length = (k * log_axis_length(w)).exp();
    if is_mild(polygon, unit_axis, k) {
        return settle(length * cubature(polygon, n, unit_axis, k));
    }
    let turn = orientation(polygon);
    let edges = || {
        (0..count)
            .filter_map(|i| Edge::new(polygon[i], polygon[(i + 1) % count], n, unit_axis, turn))
    };
    // How far the axis is outside of the polygon, at most.
    let outside = edges().map(|e| -e.distance).fold(0.0, f64::max);
    let tail = k * outside * outside > 2.0;
    let facing = n.dot(unit_axis);
    let sum: f64 = edges().map(|e| e.integral(k, facing, tail)).sum();
    settle(sum / (k + 2.0) * length)
}

/// What the error of [`irradiance`] is relative to (times distance over height where the light is seen
/// edge-on): the lobe's whole mass 2π/(k + 2), or the solid angle where that is less, times the lobe's
/// highest value on the polygon to the power k. A sliver, which the horizon may leave of any polygon, errs
/// more, by its distance times its perimeter over its area.
#[must_use]
pub fn condition(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let Some((polygon, count)) = clip(vertices, n, w) else {
        return 0.0;
    };
    let polygon = &polygon[..count];
    let omega = solid_angle::polygon(polygon);
    omega.min(2.0 * PI / (k + 2.0)) * peak(polygon, w).powf(k)
}

/// The lobe's highest cosine on the polygon's boundary, or 1 where the axis is within.
fn peak(polygon: &[DVec3], w: DVec3) -> f64 {
    let count = polygon.len();
    let turn = orientation(polygon);
    let mut best: f64 = 0.0;
    let mut inside = true;
    for i in 0..count {
        let Some(edge) = Edge::new(polygon[i], polygon[(i + 1) % count], w, w, turn) else {
            continue;
        };
        inside &= edge.distance >= 0.0;
        let x = 0.0f64.clamp(edge.from, edge.to);
        best = best.max(edge.reach * x.cos());
    }
    if inside { 1.0 } else { best.min(1.0) }
}

/// 1 where the vertices are counter-clockwise seen from the shading point, else −1.
fn orientation(polygon: &[DVec3]) -> f64 {
    let fan = |pair: &[DVec3]| solid_angle::volume(polygon[0], pair[0], pair[1]);
    1f64.copysign(polygon[1..].windows(2).map(fan).sum())
}

/// Whether the polygon is small enough, and the lobe flat enough over it, for cubature; there the
/// sum over the edges would cancel.
fn is_mild(polygon: &[DVec3], w: DVec3, k: f64) -> bool {
    let first = polygon[0];
    let reach = polygon
        .iter()
        .map(|p| (*p - first).length_squared())
        .fold(0.0, f64::max);
    if reach > 0.16 * first.length_squared() {
        return false;
    }
    let cosines = || polygon.iter().map(|p| dot(w, *p) / p.length());
    let (low, high) = cosines().fold((f64::INFINITY, 0.0f64), |(a, b), c| (a.min(c), b.max(c)));
    low > 0.0 && k * (high / low).ln() < 6.0 && k * reach / first.length_squared() < 6.0
}

/// ∫ (n·p)(w·p)ᵏ height/|p|^(4 + k) dA over a fan of triangles, by 24 × 24 nodes each.
fn cubature(polygon: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let mut sum = 0.0;
    for pair in polygon[1..].windows(2) {
        let (a, u, v) = (polygon[0], pair[0] - polygon[0], pair[1] - pair[0]);
        // Twice the area times the height above the plane.
        let weight = solid_angle::volume(a, pair[0], pair[1]);
        let mut inner = 0.0;
        for i in 0..NODES {
            for j in 0..NODES {
                let p = a + (u + v * NODE[j]) * NODE[i];
                let r2 = p.length_squared();
                let lobe = (k * (w.dot(p) / r2.sqrt()).ln()).exp();
                inner += WEIGHT[i] * WEIGHT[j] * NODE[i] * n.dot(p).max(0.0) * lobe / (r2 * r2);
            }
        }
        sum += weight * inner;
    }
    sum.abs()
}

fn clip(vertices: &[DVec3], n: DVec3, w: DVec3) -> Option<([DVec3; CAPACITY], usize)> {
    if vertices.len() < 3 || vertices.len() > 24 {
        return None;
    }
    let largest = vertices
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f64::max);
    let unit = power_of_two_unit(largest)?;
    let mut first = [DVec3::ZERO; CAPACITY];
    for (to, from) in first.iter_mut().zip(vertices) {
        *to = *from * unit;
    }
    let mut count = vertices.len();
    for plane in [n, w] {
        let source = first;
        let source = &source[..count];
        let cut = |i: usize, j: usize, ci, cj| crossing(source[i], source[j], plane, ci, cj);
        count = clip_with(source, plane, |i| source[i], cut, &mut first);
        if count < 3 {
            return None;
        }
    }
    Some((first, count))
}

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
}

impl Edge {
    fn new(a: DVec3, b: DVec3, n: DVec3, w: DVec3, turn: f64) -> Option<Self> {
        let fan = Fan::new(a, b, &[])?;
        if fan.sine <= 0.0 {
            return None;
        }
        let start = dot(w, a) / fan.radii[0];
        let rise = fan.slope(w);
        let centre = rise.atan2(start);
        Some(
            Self {
                from: -centre,
                to: fan.angle - centre,
                distance: turn * dot(fan.normal, w),
                reach: start.hypot(rise),
                lean: turn * dot(fan.normal, n),
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
        let s = self.reach * x.sin();
        self.distance * self.distance + s * s
    }

    fn integral(&self, k: f64, facing: f64, tail: bool) -> f64 {
        let (from, to) = (self.from, self.to);
        if self.reach < 1e-12 {
            // On the lobe's own horizon, where the clip has cut: z = 0 all along.
            return if tail {
                0.0
            } else {
                facing * self.distance * (to - from)
            };
        }
        // The highest point of the lobe on the edge, and the window about it.
        let peak = 0.0f64.clamp(from, to);
        let width = window(k, peak.abs().tan());
        let (low, high) = ((peak - width).max(from), (peak + width).min(to));
        let mut sum =
            self.panel(low, peak, k, facing, tail) + self.panel(peak, high, k, facing, tail);
        if !tail {
            sum += facing * (self.azimuth(from, low) + self.azimuth(high, to));
        }
        sum
    }

    /// ∫ g dx/(1 − z²) between two angles: the azimuth about the axis.
    fn azimuth(&self, a: f64, b: f64) -> f64 {
        if b <= a {
            return 0.0;
        }
        let g = self.distance;
        (g * (b - a).sin()).atan2(g * g * a.cos() * b.cos() + a.sin() * b.sin())
    }

    fn value(&self, x: f64, k: f64, facing: f64, tail: bool) -> f64 {
        let gap = self.gap(x).min(1.0);
        let log = 0.5 * k * (-gap).ln_1p();
        let power = log.exp();
        let share = if tail {
            -power / gap
        } else if gap > 0.0 {
            -log.exp_m1() / gap
        } else {
            0.5 * k
        };
        facing * self.distance * share + self.lean * power
    }

    fn panel(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> f64 {
        if b <= a {
            return 0.0;
        }
        let rough = k < 6.0 && k.fract() != 0.0;
        if rough && FRAC_PI_2 - b.abs().max(a.abs()) < b - a {
            let middle = 0.5 * (a + b);
            let inner = if b.abs() >= a.abs() {
                (a, middle)
            } else {
                (middle, b)
            };
            let outer = if b.abs() >= a.abs() {
                (middle, b)
            } else {
                (a, middle)
            };
            return self.plain(inner.0, inner.1, k, facing, tail)
                + self.near_horizon(outer.0, outer.1, k, facing, tail);
        }
        self.plain(a, b, k, facing, tail)
    }

    fn plain(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> f64 {
        let node = |i: usize| WEIGHT[i] * self.value(a + (b - a) * NODE[i], k, facing, tail);
        (b - a) * (0..NODES).map(node).sum::<f64>()
    }

    /// With π/2 − |x| = y⁸, for a lobe that ends like (π/2 − |x|)ᵏ with a k that is no integer.
    fn near_horizon(&self, a: f64, b: f64, k: f64, facing: f64, tail: bool) -> f64 {
        let root = |x: f64| (FRAC_PI_2 - x.abs()).max(0.0).powf(0.125);
        let (y0, y1) = (root(a).min(root(b)), root(a).max(root(b)));
        let sign = 1f64.copysign(a + b);
        let mut sum = 0.0;
        for i in 0..NODES {
            let y = y0 + (y1 - y0) * NODE[i];
            let seventh = y.powi(7);
            let x = sign * (FRAC_PI_2 - seventh * y);
            sum += WEIGHT[i] * 8.0 * seventh * self.value(x, k, facing, tail);
        }
        sum * (y1 - y0)
    }
}
