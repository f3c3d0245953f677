//! This module computes the integrals in double-double arithmetic (31 digits), from their
//! definitions or from forms that lose less than fifteen digits.

use linelit_testkit::dd::Dd;
use linelit_testkit::real::{Real, cross, dot, length, sub, vector};

pub(crate) type V = [Dd; 3];

pub(crate) fn dd(x: f64) -> Dd {
    Dd::new(x)
}

/// A clipped segment in double-double: ends and cosines.
pub(crate) fn clip(p0: [f64; 3], p1: [f64; 3], planes: &[[f64; 3]]) -> Option<(V, V)> {
    let (mut a, mut b) = (vector::<Dd>(p0), vector::<Dd>(p1));
    for k in planes {
        let k = vector::<Dd>(*k);
        let (ca, cb) = (dot(&k, &a), dot(&k, &b));
        let zero = dd(0.0);
        if ca <= zero && cb <= zero {
            return None;
        }
        if ca >= zero && cb >= zero {
            continue;
        }
        let q = [0, 1, 2].map(|i| (a[i] * cb - b[i] * ca) / (cb - ca));
        if ca < zero { a = q } else { b = q }
    }
    Some((a, b))
}

/// What all line models need: cosines, radii, length, sine, angle.
struct Line {
    c: [Dd; 2],
    r: [Dd; 2],
    length: Dd,
    sine: Dd,
    angle: Dd,
}

fn seen([a, b]: [V; 2], n: &V) -> Line {
    let x = length(&cross(&a, &b));
    let (ra, rb) = (length(&a), length(&b));
    Line {
        c: [dot(n, &a), dot(n, &b)],
        r: [ra, rb],
        length: length(&sub(&b, &a)),
        sine: x / (ra * rb),
        angle: x.atan2(dot(&a, &b)),
    }
}

/// δ − sin δ cos δ over sin³ δ.
fn lune(l: &Line) -> Dd {
    if l.angle > dd(0.02) {
        return (l.angle - l.angle.sin() * l.angle.cos()) / l.sine.powi(3);
    }
    // Σ binom(2k, k)/4ᵏ/(k + 3/2) sin²ᵏ: 20 terms of ratio below 4e-4.
    let y = l.sine * l.sine;
    let mut sum = dd(0.0);
    let mut power = dd(1.0);
    for k in 0..20 {
        let k = f64::from(k);
        sum = sum + power / dd(k + 1.5);
        power = power * y * (dd(2.0 * k + 1.0) / dd(2.0 * k + 2.0));
    }
    sum
}

/// Billen & Dutré's integral, by the crate's own algebra in double-double (that the algebra is
/// right is for the reference vectors to say), with the angle from atan2.
pub(crate) fn ribbon(p0: [f64; 3], p1: [f64; 3], n: [f64; 3]) -> Dd {
    match clip(p0, p1, &[n]) {
        Some((a, b)) => along([a, b], &vector::<Dd>(n)),
        None => dd(0.0),
    }
}

/// ∫ n·p/|p|⁴ dt between two points above the horizon.
fn along(ends: [V; 2], n: &V) -> Dd {
    let l = seen(ends, n);
    let product = l.r[0] * l.r[1];
    let cos = l.angle.cos();
    let g = lune(&l);
    let w0 = dd(1.0) + g * (l.r[1] / l.r[0] - cos);
    let w1 = dd(1.0) + g * (l.r[0] / l.r[1] - cos);
    l.length * (l.c[0] * w0 + l.c[1] * w1) / (dd(2.0) * product * product)
}

/// Twice the line's distance times the ribbon.
pub(crate) fn cylinder(p0: [f64; 3], p1: [f64; 3], n: [f64; 3]) -> Dd {
    let (a, b) = (vector::<Dd>(p0), vector::<Dd>(p1));
    let h = length(&cross(&a, &b)) / length(&sub(&b, &a));
    dd(2.0) * h * ribbon(p0, p1, n)
}

/// The solid angle of a thin cylinder for each unit of radius.
pub(crate) fn cylinder_solid_angle(p0: [f64; 3], p1: [f64; 3]) -> Dd {
    let (a, b) = (vector::<Dd>(p0), vector::<Dd>(p1));
    let (x, ra, rb, d) = (length(&cross(&a, &b)), length(&a), length(&b), dot(&a, &b));
    // Where the line passes the shading point the sum of r0 r1 and p0·p1 cancels.
    let below = if d > dd(0.0) {
        ra * rb + d
    } else {
        x * x / (ra * rb - d)
    };
    dd(2.0) * x * (ra + rb) / (ra * rb * below)
}

/// A map of vectors by rows.
type Rows = [V; 3];

/// The inverse of a matrix given by columns, and its determinant.
fn inverse(columns: [[f64; 3]; 3]) -> Rows {
    let [a, b, c] = columns.map(vector::<Dd>);
    let (x, y, z) = (cross(&b, &c), cross(&c, &a), cross(&a, &b));
    let det = dot(&a, &x);
    [x, y, z].map(|row| row.map(|e| e / det))
}

fn apply(m: &Rows, p: &V) -> V {
    [dot(&m[0], p), dot(&m[1], p), dot(&m[2], p)]
}

/// A linearly transformed cosine over a polygon, both in the surface's frame (z up), times π; and
/// the mapped polygon's solid angle times distance over height and times distance × perimeter over
/// area, which the error is relative to.
pub(crate) fn ltc_polygon(columns: [[f64; 3]; 3], vertices: &[[f64; 3]]) -> (Dd, f64) {
    let m = inverse(columns);
    let zero = dd(0.0);
    let points: Vec<V> = vertices.iter().map(|v| vector::<Dd>(*v)).collect();
    let up = vector::<Dd>([0.0, 0.0, 1.0]);
    let mapped: Vec<V> = above(&points, &up).iter().map(|p| apply(&m, p)).collect();
    // The cosine has a horizon of its own.
    let mapped = above(&mapped, &up);
    if mapped.len() < 3 {
        return (zero, 0.0);
    }
    let mut solid = zero;
    for i in 1..mapped.len() - 1 {
        let [a, b, c] = [&mapped[0], &mapped[i], &mapped[i + 1]];
        let (ra, rb, rc) = (length(a), length(b), length(c));
        let below = ra * rb * rc + dot(a, b) * rc + dot(b, c) * ra + dot(c, a) * rb;
        solid = solid + dd(2.0) * dot(&cross(a, b), c).atan2(below);
    }
    let normal = cross(&sub(&mapped[1], &mapped[0]), &sub(&mapped[2], &mapped[0]));
    let height = (dot(&normal, &mapped[0]) / length(&normal)).abs().to_f64();
    let nearest = mapped
        .iter()
        .map(|p| length(p).to_f64())
        .fold(f64::INFINITY, f64::min);
    let value = lambert(&mapped, &up);
    // Rounding the mapped vertices moves the edges by ε times the distance.
    let count = mapped.len();
    let around: f64 = (0..count)
        .map(|i| length(&sub(&mapped[(i + 1) % count], &mapped[i])).to_f64())
        .sum();
    let farthest = mapped
        .iter()
        .map(|p| length(p).to_f64())
        .fold(0.0, f64::max);
    let mut area = 0.0;
    for i in 1..count - 1 {
        let x = cross(
            &sub(&mapped[i], &mapped[0]),
            &sub(&mapped[i + 1], &mapped[0]),
        );
        area += 0.5 * length(&x).to_f64();
    }
    let slender = (farthest * around / area).max(1.0);
    (
        value,
        solid.abs().to_f64() * (nearest / height).max(1.0) * slender,
    )
}

/// The same along a thin cylinder, and the value over the sine of the angle that the mapped line
/// subtends: rounding the mapped ends moves it by that much.
pub(crate) fn ltc_line(columns: [[f64; 3]; 3], p0: [f64; 3], p1: [f64; 3]) -> (Dd, f64) {
    let Some((a, b)) = clip(p0, p1, &[[0.0, 0.0, 1.0]]) else {
        return (dd(0.0), 0.0);
    };
    let m = inverse(columns);
    let side = cross(&a, &b);
    let side = side.map(|x| x / length(&side));
    let columns = columns.map(vector::<Dd>);
    let width = length(&columns.map(|c| dot(&c, &side)));
    let (a, b) = (apply(&m, &a), apply(&m, &b));
    // The mapped line may dip below the cosine's own horizon.
    let zero = dd(0.0);
    let cut = |a: &V, b: &V| [0, 1, 2].map(|j| (a[j] * b[2] - b[j] * a[2]) / (b[2] - a[2]));
    let (a, b) = match (a[2] >= zero, b[2] >= zero) {
        (true, true) => (a, b),
        (true, false) => (a, cut(&a, &b)),
        (false, true) => (cut(&a, &b), b),
        (false, false) => return (zero, 0.0),
    };
    let x = length(&cross(&a, &b));
    let h = x / length(&sub(&b, &a));
    let value = dd(2.0) * h * along([a, b], &vector::<Dd>([0.0, 0.0, 1.0])) / width;
    let sine = x / (length(&a) * length(&b));
    (value, (value / sine).to_f64())
}

/// The signed solid angle of a triangle.
pub(crate) fn triangle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> Dd {
    let [a, b, c] = [a, b, c].map(vector::<Dd>);
    let (ra, rb, rc) = (length(&a), length(&b), length(&c));
    let below = ra * rb * rc + dot(&a, &b) * rc + dot(&b, &c) * ra + dot(&c, &a) * rb;
    dd(2.0) * dot(&cross(&a, &b), &c).atan2(below)
}

/// Lambert's sum over a clipped polygon.
pub(crate) fn polygon(vertices: &[[f64; 3]], n: [f64; 3]) -> Dd {
    let n = vector::<Dd>(n);
    let zero = dd(0.0);
    let points: Vec<V> = vertices.iter().map(|v| vector::<Dd>(*v)).collect();
    let mut above: Vec<V> = Vec::new();
    for (i, a) in points.iter().enumerate() {
        let b = &points[(i + 1) % points.len()];
        let (ca, cb) = (dot(&n, a), dot(&n, b));
        if ca >= zero {
            above.push(*a);
        }
        if (ca > zero && cb < zero) || (ca < zero && cb > zero) {
            above.push([0, 1, 2].map(|j| (a[j] * cb - b[j] * ca) / (cb - ca)));
        }
    }
    lambert(&above, &n)
}

/// Lambert's sum.
fn lambert(above: &[V], n: &V) -> Dd {
    let zero = dd(0.0);
    let mut sum = zero;
    for (i, a) in above.iter().enumerate() {
        let b = &above[(i + 1) % above.len()];
        let x = cross(a, b);
        let size = length(&x);
        if size > zero {
            sum = sum + size.atan2(dot(a, b)) * dot(&x, n) / size;
        }
    }
    sum.abs() * dd(0.5)
}

/// What of a polygon is above a horizon.
fn above<R: Real>(points: &[[R; 3]], n: &[R; 3]) -> Vec<[R; 3]> {
    let zero = R::new(0.0);
    let mut above: Vec<[R; 3]> = Vec::new();
    for (i, a) in points.iter().enumerate() {
        let b = &points[(i + 1) % points.len()];
        let (ca, cb) = (dot(n, a), dot(n, b));
        if ca >= zero {
            above.push(a.clone());
        }
        if (ca > zero && cb < zero) || (ca < zero && cb > zero) {
            let span = cb.clone() - ca.clone();
            above.push(
                [0, 1, 2].map(|i| {
                    (a[i].clone() * cb.clone() - b[i].clone() * ca.clone()) / span.clone()
                }),
            );
        }
    }
    above
}

/// Lambert's sum over what is above the horizon, and the solid angle of the whole fan of triangles,
/// in arithmetic of many digits.
pub(crate) fn wide_polygon<R: Real>(vertices: &[[f64; 3]], n: [f64; 3]) -> [f64; 2] {
    let n = vector::<R>(n);
    let zero = R::new(0.0);
    let points: Vec<[R; 3]> = vertices.iter().map(|v| vector::<R>(*v)).collect();
    let above = above(&points, &n);
    let mut sum = zero.clone();
    for (i, a) in above.iter().enumerate() {
        let b = &above[(i + 1) % above.len()];
        let x = cross(a, b);
        let size = length(&x);
        if size > zero {
            sum = sum + size.atan2(&dot(a, b)) * dot(&x, &n) / size;
        }
    }
    let mut solid = zero;
    for pair in points[1..].windows(2) {
        let [a, b, c] = [&points[0], &pair[0], &pair[1]];
        let (ra, rb, rc) = (length(a), length(b), length(c));
        let below =
            ra.clone() * rb.clone() * rc.clone() + dot(a, b) * rc + dot(b, c) * ra + dot(c, a) * rb;
        solid = solid + dot(&cross(a, b), c).atan2(&below);
    }
    [0.5 * sum.abs().to_f64(), 2.0 * solid.abs().to_f64()]
}
