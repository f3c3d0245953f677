//! This module computes Lambert's sum over the edges of a region, eight edges at a time.

use crate::fast_path::{self, LONGEST_ARC};
use crate::polygon;
use linelit_geometry::{DVec3, finite::nonnegative};
use linelit_simd::{Isa, Simd, dispatch};

/// The number of edges that a kernel takes at once.
const LANES: usize = 8;

/// A sum that is smaller than this fraction of the sum of its terms' magnitudes is not used, since
/// too much has cancelled: 8 ε divided by this number is 5e-13.
const CANCELLED: f64 = 4e-3;

/// The range of |n|² within which no product overflows or underflows.
const NORMALS: std::ops::Range<f64> = 1e-100..1e100;

/// The contribution of eight edges to Lambert's sum.
struct Round {
    /// The sum of the terms of the edges for which the fast path holds.
    sum: f64,
    /// Σ (|b − a|/|b|)² over these edges.
    squares: f64,
    /// A mask with one bit for each edge for which the fast path holds.
    held: u8,
}

/// Sums the terms of eight edges for which the fast path holds and `also` is set.
#[inline(always)]
fn add_up<S: Simd>(s: S, a: [S::D; 3], b: [S::D; 3], n: [S::D; 3], also: S::M) -> Round {
    let (value, square, held) = fast_path::edge(s, a, b, n);
    let (held, zero) = (held & also, s.dsplat(0.0));
    Round {
        sum: s.dsum(s.select(held, zero, value)),
        squares: s.dsum(s.select(held, zero, square)),
        held: s.bits(held),
    }
}

/// Adds up the edges from corners to the corners that follow them; only corners above the horizon
/// count as held.
#[inline(always)]
fn corners_kernel<S: Simd>(
    s: S,
    corners: &[[f64; LANES]; 3],
    next: &[[f64; LANES]; 3],
    n: DVec3,
) -> Round {
    let a = [
        s.dload(&corners[0]),
        s.dload(&corners[1]),
        s.dload(&corners[2]),
    ];
    let b = [s.dload(&next[0]), s.dload(&next[1]), s.dload(&next[2])];
    let n = [s.dsplat(n.x), s.dsplat(n.y), s.dsplat(n.z)];
    let height = a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
    add_up(s, a, b, n, s.dle(s.dsplat(0.0), height))
}

dispatch! {
    fn corners = corners_kernel(
        corners: &[[f64; LANES]; 3],
        next: &[[f64; LANES]; 3],
        n: DVec3,
    ) -> Round
}

/// Adds up edges in a plane that is given by its origin and axes. `ends` holds the first and second
/// coordinates of the starts, and then of the ends.
#[inline(always)]
fn flat_kernel<S: Simd>(s: S, ends: &[[f64; LANES]; 4], plane: &[DVec3; 3], n: DVec3) -> Round {
    let [p0, q0, p1, q1] = [
        s.dload(&ends[0]),
        s.dload(&ends[1]),
        s.dload(&ends[2]),
        s.dload(&ends[3]),
    ];
    let [o, u, v] = plane;
    let a = [
        p0 * u.x + q0 * v.x + o.x,
        p0 * u.y + q0 * v.y + o.y,
        p0 * u.z + q0 * v.z + o.z,
    ];
    let b = [
        p1 * u.x + q1 * v.x + o.x,
        p1 * u.y + q1 * v.y + o.y,
        p1 * u.z + q1 * v.z + o.z,
    ];
    let n = [s.dsplat(n.x), s.dsplat(n.y), s.dsplat(n.z)];
    add_up(s, a, b, n, s.dle(s.dsplat(0.0), s.dsplat(0.0)))
}

dispatch! {
    fn flat = flat_kernel(ends: &[[f64; LANES]; 4], plane: &[DVec3; 3], n: DVec3) -> Round
}

/// Returns Lambert's sum over the edges of a polygon with at most eight corners above the horizon,
/// and Σ (|b − a|/|b|)² over them; `None` if the fast path does not hold for all of them.
pub(crate) fn sum(vertices: &[DVec3], n: DVec3) -> Option<[f64; 2]> {
    let count = vertices.len();
    if !(3..=LANES).contains(&count) || !NORMALS.contains(&n.length_squared()) {
        return None;
    }
    // Fill the remaining lanes with edges from the first corner to itself.
    let [mut from, mut to] = [vertices[0].to_array().map(|x| [x; LANES]); 2];
    for (i, v) in vertices.iter().enumerate() {
        let before = if i == 0 { count - 1 } else { i - 1 };
        for (k, x) in v.to_array().into_iter().enumerate() {
            from[k][i] = x;
            to[k][before] = x;
        }
    }
    let round = corners(Isa::best(), &from, &to, n);
    (round.held == u8::MAX).then_some([round.sum, round.squares])
}

/// The smallest ratio of the squared edge length to the squared distance for which the fast sum is
/// used; below it too much cancels.
const SMALL: f64 = 1e-4;

/// Returns half of the [`sum`]; `None` if its relative error may be above 5e-13.
pub(crate) fn polygon(vertices: &[DVec3], n: DVec3) -> Option<f64> {
    let [first, second, ..] = vertices else {
        return None;
    };
    // Small polygons, and polygons that reach below the horizon, are not worth a try.
    let is_small = first.distance_squared(*second) < SMALL * first.length_squared();
    if is_small || vertices.iter().any(|v| n.dot(*v) < 0.0) {
        return None;
    }
    let [sum, squares] = sum(vertices, n)?;
    // By Cauchy and Schwarz, the sum of the lengths is at most the root of their number times the
    // sum of their squares.
    #[allow(clippy::cast_precision_loss, reason = "at most eight")]
    let count = vertices.len() as f64;
    let least = CANCELLED * LONGEST_ARC;
    let lengths = least * least * n.length_squared() * squares * count;
    (sum * sum >= lengths).then_some(0.5 * sum)
}

/// Returns half of Lambert's sum over the boundary of a region in a plane in front of the shading
/// point. It is the sum of [`edge`](polygon::edge) over all edges, computed faster.
///
/// `plane` holds the point of the plane with the coordinates zero, relative to the shading point,
/// and the axes. `edges` holds the two ends of each edge; the region is on the left of all edges,
/// or on the right of all.
///
/// **Formula**: ½ |Σ Θ (a × b)·n/|a × b||. **Domain**: regions above the horizon of `n`.
///
/// **Error**: 8 ε |n| Σ |b − a|/|b|, absolute. For a region that fills a small angle s this is 32
/// ε/s relative to the result. Numbers that are not finite give 0.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::polygon;
/// // A square at unit distance, of four edges in a plane.
/// let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
/// let edges = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]);
/// let flat = polygon::boundary_irradiance(edges, &[DVec3::Z, DVec3::X, DVec3::Y], DVec3::Z);
/// let square = corners.map(|[x, y]| DVec3::new(x, y, 1.0));
/// assert!((flat - polygon::irradiance(&square, DVec3::Z)).abs() < 1e-15);
/// ```
#[must_use]
pub fn boundary_irradiance(
    edges: impl IntoIterator<Item = [[f64; 2]; 2]>,
    plane: &[DVec3; 3],
    n: DVec3,
) -> f64 {
    let isa = Isa::best();
    let is_fast = NORMALS.contains(&n.length_squared());
    let mut edges = edges.into_iter();
    let mut sum = 0.0;
    loop {
        // Fill the remaining lanes with edges from a point to itself.
        let mut ends = [[0.0; LANES]; 4];
        let mut count = 0;
        for [[p0, q0], [p1, q1]] in edges.by_ref().take(LANES) {
            for (column, x) in ends.iter_mut().zip([p0, q0, p1, q1]) {
                column[count] = x;
            }
            count += 1;
        }
        // Repeat the edges for which the fast path does not hold by their robust form.
        let round = flat(isa, &ends, plane, n);
        let held = if is_fast { round.held } else { 0 };
        if is_fast {
            sum += round.sum;
        }
        if held != u8::MAX {
            sum += one_by_one(&ends, !held, plane, n);
        }
        if count < LANES {
            return 0.5 * nonnegative(f64::abs(sum));
        }
    }
}

/// Returns the sum of the terms of the edges whose bits are set in `which`, by the robust formula.
#[cold]
#[inline(never)]
fn one_by_one(ends: &[[f64; LANES]; 4], which: u8, [o, u, v]: &[DVec3; 3], n: DVec3) -> f64 {
    let term = |i: usize| {
        let at = |p: f64, q: f64| *o + *u * p + *v * q;
        polygon::edge(at(ends[0][i], ends[1][i]), at(ends[2][i], ends[3][i]), n)
    };
    (0..LANES).filter(|i| which >> i & 1 == 1).map(term).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    fn random_plane(rng: &mut SplitMix64) -> [DVec3; 3] {
        let size = 10f64.powf(rng.in_range(-2.0, 1.0));
        let mut vector = |size: f64| DVec3::from_array(rng.unit_vector()) * size;
        [vector(1.0), vector(size), vector(size)]
    }

    #[test]
    fn edges_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(11);
        let mut seen = [false; 2];
        for _ in 0..2000 {
            let plane = random_plane(&mut rng);
            let n = DVec3::from_array(rng.unit_vector());
            let ends = std::array::from_fn(|_| std::array::from_fn(|_| rng.in_range(-1.0, 1.5)));
            let rows: [[f64; LANES]; 6] =
                std::array::from_fn(|_| ends[usize::from(rng.next_u64() & 1 == 1)]);
            let ([a, b, c], [d, e, f]) = ([rows[0], rows[1], rows[2]], [rows[3], rows[4], rows[5]]);
            let results = InstructionSet::ALL.map(|set| {
                let isa = Isa::detect(set);
                [
                    flat(isa, &ends, &plane, n),
                    corners(isa, &[a, b, c], &[d, e, f], n),
                ]
                .map(|r| (r.sum.to_bits(), r.squares.to_bits(), r.held))
            });
            assert!(
                results.iter().all(|r| *r == results[0]),
                "{ends:?} {plane:?} {n}"
            );
            seen[usize::from(results[0][0].2 == u8::MAX)] = true;
        }
        assert_eq!(
            seen, [true; 2],
            "rounds with and without edges of more than 104 degrees"
        );
    }

    #[test]
    fn many_edges_are_the_sum_of_each() {
        let mut rng = SplitMix64::new(12);
        for count in (0..40).cycle().take(4000) {
            let plane = random_plane(&mut rng);
            let n = DVec3::from_array(rng.unit_vector()) * 10f64.powf(rng.in_range(-3.0, 3.0));
            let edges: Vec<[[f64; 2]; 2]> = (0..count)
                .map(|_| std::array::from_fn(|_| std::array::from_fn(|_| rng.in_range(-1.0, 1.0))))
                .collect();
            let [o, u, v] = plane;
            let (mut want, mut error) = (0.0, 0.0);
            for [a, b] in edges
                .iter()
                .map(|ends| ends.map(|[p, q]| o + u * p + v * q))
            {
                want += 0.5 * polygon::edge(a, b, n);
                // Points of the plane are off by 3 ε of the products' sizes here and there.
                let size = o.length() + u.length() + v.length();
                let angle = (b.distance(a) + size) / a.length().min(b.length());
                error += 8.0 * f64::EPSILON * angle * n.length();
            }
            let got = boundary_irradiance(edges, &plane, n);
            assert!(
                (got - want.abs()).abs() <= error,
                "{got:e} for {want:e}, {error:e}"
            );
        }
    }
}
