//! This module computes how the sides and the two triangles of a quadrilateral are seen from a
//! shading point, in parallel lanes. The results are to the bit the ones that
//! [`Corner`](super::spherical_triangle::Corner) and [`Side`] compute one by one.
//!
//! ```text
//!    d───cd───c     lanes 0–4: the sides ab, ac, ad, bc, cd
//!    │      ╱ │     lanes 5, 6: the normals ab × ac and ac × ad of the triangles, for their
//!   ad   ac  bc                determinants
//!    │ ╱      │     lane 7: padding
//!    a───ab───b
//! ```

use crate::polygon::fan::Vector;
use crate::polygon::spherical_triangle::Side;
use linelit_geometry::DVec3;
use linelit_simd::{Isa, Simd, dispatch};

/// The view of the corners a, b, c, d of a quadrilateral, whose fan has the triangles abc and acd.
#[derive(Debug)]
pub(crate) struct Quadrilateral {
    /// The corners relative to the shading point, and their distances from it.
    pub(crate) corners: [DVec3; 4],
    pub(crate) lengths: [f64; 4],
    /// ab, ac, ad, bc, cd.
    pub(crate) sides: [Side; 5],
    /// For each of the two triangles, the distance of its plane from the shading point times twice
    /// its area.
    pub(crate) det: [f64; 2],
}

/// The indices of the corners at the ends of each side.
const ENDS: [[usize; 2]; 5] = [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]];

/// The inputs in rows of eight lanes: the corners, relative to the shading point, where a side
/// starts and ends, and then the two factors of a cross product. In lanes 5 and 6 these factors are
/// two edges of a triangle.
type Rows = [[[f64; 8]; 3]; 4];

/// The results, in this order: the cross products, their lengths, the two numbers of [`Side`], the
/// distances of the corners where a side starts and ends, and the determinants.
type Results = [[f64; 8]; 9];

impl Quadrilateral {
    /// Computes the view; `None` where squares of lengths underflow or overflow.
    pub(crate) fn new(isa: Isa, vertices: &[DVec3; 4], x: DVec3) -> Option<Self> {
        let corners = vertices.map(|v| v - x);
        let mut rows: Rows = [[[0.0; 8]; 3]; 4];
        let mut put = |lane: usize, vectors: [DVec3; 4]| {
            for (row, v) in rows.iter_mut().zip(vectors) {
                for (row, x) in row.iter_mut().zip(v.to_array()) {
                    row[lane] = x;
                }
            }
        };
        for (lane, [i, j]) in ENDS.into_iter().enumerate() {
            // Form edges before the shading point is subtracted, so that they keep their digits.
            let edge = vertices[j] - vertices[i];
            put(lane, [corners[i], corners[j], corners[i], edge]);
        }
        // Lanes 5 and 6 compute the determinants of the triangles; lane 7 only fills the vector.
        let [ab, ac, ad] = [1, 2, 3].map(|i| vertices[i] - vertices[0]);
        put(5, [corners[0], corners[1], ab, ac]);
        put(6, [corners[0], corners[1], ac, ad]);
        put(7, [corners[0], corners[1], corners[0], ab]);
        let mut out = [[0.0; 8]; 9];
        if !look(isa, &rows, corners[0], &mut out) {
            return None;
        }
        let [x, y, z, length, one_plus, tan_half, from, to, det] = &out;
        let side = |i: usize| Side {
            one_plus: one_plus[i],
            tan_half: tan_half[i],
            cross: DVec3::new(x[i], y[i], z[i]),
            length: length[i],
        };
        Some(Self {
            corners,
            lengths: [from[0], to[0], to[1], to[2]],
            sides: std::array::from_fn(side),
            det: [det[5].abs(), det[6].abs()],
        })
    }
}

/// Computes a product and its rounding error as `linelit_geometry::predicates` does, in each lane.
#[inline(always)]
fn two_product<S: Simd>(a: S::D, b: S::D) -> (S::D, S::D) {
    /// Dekker's factor 2²⁷ + 1, by which a number is split into two halves of 26 bits.
    const SPLITTER: f64 = 134_217_729.0;
    let (p, c, d) = (a * b, a * SPLITTER, b * SPLITTER);
    let (ah, bh) = (c - (c - a), d - (d - b));
    let (al, bl) = (a - ah, b - bh);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// Computes a sum and its rounding error in each lane.
#[inline(always)]
fn two_sum<S: Simd>(a: S::D, b: S::D) -> (S::D, S::D) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Computes ab − cd with an error little larger than one rounding of the result, in each lane.
#[inline(always)]
fn diff_of_products<S: Simd>(a: S::D, b: S::D, c: S::D, d: S::D) -> S::D {
    let (p, ep) = two_product::<S>(a, b);
    let (q, eq) = two_product::<S>(c, d);
    let (s, es) = two_sum::<S>(p, q * -1.0);
    s + (es + (ep - eq))
}

/// Computes a dot product in twice the working precision, in each lane.
#[inline(always)]
fn exact_dot<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> S::D {
    let (p0, e0) = two_product::<S>(a[0], b[0]);
    let (p1, e1) = two_product::<S>(a[1], b[1]);
    let (p2, e2) = two_product::<S>(a[2], b[2]);
    let (s1, r1) = two_sum::<S>(p0, p1);
    let (s2, r2) = two_sum::<S>(s1, p2);
    s2 + (((e0 + e1) + e2) + (r1 + r2))
}

#[inline(always)]
fn dot<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> S::D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Computes all results; returns false where the square of a length is outside the range that
/// `predicates::length` handles without scaling.
#[inline(always)]
fn look_kernel<S: Simd>(s: S, rows: &Rows, first: DVec3, out: &mut Results) -> bool {
    let load = |row: &[[f64; 8]; 3]| [s.dload(&row[0]), s.dload(&row[1]), s.dload(&row[2])];
    let [from, to, a, b] = [
        load(&rows[0]),
        load(&rows[1]),
        load(&rows[2]),
        load(&rows[3]),
    ];
    // Compute the cross products with one rounding, and the squares of all lengths.
    let cross: Vector<S> = [
        diff_of_products::<S>(a[1], b[2], a[2], b[1]),
        diff_of_products::<S>(a[2], b[0], a[0], b[2]),
        diff_of_products::<S>(a[0], b[1], a[1], b[0]),
    ];
    let squares = [
        dot::<S>(&cross, &cross),
        dot::<S>(&from, &from),
        dot::<S>(&to, &to),
    ];
    let least = s.dmin(s.dmin(squares[0], squares[1]), squares[2]);
    let most = s.dmax(s.dmax(squares[0], squares[1]), squares[2]);
    // A minimum or maximum may drop a NaN, but the sum of the squares keeps it.
    let number = squares[0] + squares[1] + squares[2];
    let safe = s.dlt(s.dsplat(1e-270), least)
        & s.dlt(most, s.dsplat(f64::INFINITY))
        & s.dle(number, s.dsplat(f64::INFINITY));
    // Ignore the range in lanes 5 and 6, where there are no sides.
    if s.bits(safe) | 0b0110_0000 != 0xff {
        return false;
    }
    let [length, from_length, to_length] = [
        s.dsqrt(squares[0]),
        s.dsqrt(squares[1]),
        s.dsqrt(squares[2]),
    ];
    // Compute 1 + cos θ and tan(θ/2) of each side by the branch that does not cancel.
    let (dot, product) = (dot::<S>(&from, &to), from_length * to_length);
    let one_minus = product - dot;
    let ahead = s.dle(s.dsplat(0.0), dot);
    let one_plus = s.select(
        ahead,
        (length / product) * (length / one_minus),
        dot / product + 1.0,
    );
    let tan_half = s.select(ahead, one_minus / length, length / (product + dot));
    let first = [s.dsplat(first.x), s.dsplat(first.y), s.dsplat(first.z)];
    let det = exact_dot::<S>(&cross, &first);
    let [x, y, z] = cross;
    let results = [
        x,
        y,
        z,
        length,
        one_plus,
        tan_half,
        from_length,
        to_length,
        det,
    ];
    for (row, result) in out.iter_mut().zip(results) {
        s.dstore(result, row);
    }
    true
}
dispatch! {
    fn look = look_kernel(rows: &Rows, first: DVec3, out: &mut Results) -> bool
}
