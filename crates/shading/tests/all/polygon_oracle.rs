//! Polygons seen by a diffuse surface, by terms that are not negative: triangles of unit vectors in
//! double-double arithmetic, halved until their sides are short; there the nodes of a product rule
//! in `f64`, relative to a corner. Good to some 1e-13 of the result itself, slivers included.

use crate::oracle::{V, dd};
use linelit_testkit::dd::Dd;
use linelit_testkit::quadrature::{GaussRule, gauss_legendre};
use linelit_testkit::real::{Real, cross, dot, length, sub, vector};

/// Nodes in each of two directions.
const NODES: usize = 11;
/// Parts of the sum that are not looked at.
const NEGLIGIBLE: f64 = 1e-18;

/// A direction, and n times it.
#[derive(Clone, Copy)]
struct Corner {
    at: V,
    n: Dd,
}

impl Corner {
    fn mix(&self, a: Dd, other: &Self, b: Dd) -> Self {
        let mix = |x: Dd, y: Dd| x * a + y * b;
        Self {
            at: [0, 1, 2].map(|i| mix(self.at[i], other.at[i])),
            n: mix(self.n, other.n),
        }
    }

    fn unit(&self) -> Self {
        let inverse = dd(1.0) / length(&self.at);
        self.mix(inverse, self, dd(0.0))
    }
}

/// The rule.
pub(crate) struct Oracle(GaussRule);

/// The part of a convex polygon above the horizon.
fn above(polygon: &[Corner]) -> Vec<Corner> {
    let zero = dd(0.0);
    let mut out = Vec::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if a.n >= zero {
            out.push(*a);
        }
        if (a.n > zero && b.n < zero) || (a.n < zero && b.n > zero) {
            out.push(a.mix(b.n / (b.n - a.n), b, zero - a.n / (b.n - a.n)));
        }
    }
    out
}

impl Oracle {
    pub(crate) fn new() -> Self {
        Self(gauss_legendre(NODES))
    }

    /// ∫ max(0, n·ω) dω over a convex polygon.
    pub(crate) fn irradiance(&self, vertices: &[[f64; 3]], n: [f64; 3]) -> f64 {
        let n = vector::<Dd>(n);
        let corner = |at: V| Corner {
            at,
            n: dot(&n, &at),
        };
        let whole: Vec<Corner> = vertices.iter().map(|v| corner(vector::<Dd>(*v))).collect();
        let polygon: Vec<Corner> = above(&whole).iter().map(Corner::unit).collect();
        if polygon.len() < 3 {
            return 0.0;
        }
        let facing = |t: &[Corner; 3]| t.iter().map(|c| c.n.to_f64()).fold(0.0, f64::max);
        let mut waiting: Vec<([Corner; 3], u32)> = (1..polygon.len() - 1)
            .flat_map(|i| thirds([polygon[0], polygon[i], polygon[i + 1]], &n))
            .map(|t| (t, 0))
            .collect();
        waiting.sort_by(|a, b| facing(&a.0).total_cmp(&facing(&b.0)));
        let mut sum = 0.0;
        while let Some((t, depth)) = waiting.pop() {
            let volume = volume(&t);
            let least = {
                // Of triangles with an obtuse side, the flat one is nearer to the origin.
                let middle =
                    [0, 1, 2].map(|i| (t[0].at[i] + t[1].at[i] + t[2].at[i]).to_f64() / 3.0);
                middle.iter().map(|x| x * x).sum::<f64>().powi(2).max(1e-3)
            };
            if volume * facing(&t) / least <= NEGLIGIBLE * sum {
                continue;
            }
            match longest(&t) {
                Some(side) if depth < 400 => {
                    let [a, b, c] = [side, (side + 1) % 3, (side + 2) % 3].map(|i| t[i]);
                    let middle = b.mix(dd(1.0), &c, dd(1.0)).unit();
                    let parts = [[a, b, middle], [a, middle, c]];
                    let higher = b.n < c.n;
                    for part in [parts[usize::from(!higher)], parts[usize::from(higher)]] {
                        waiting.push((part, depth + 1));
                    }
                }
                _ => sum += volume * self.leaf(&t),
            }
        }
        sum
    }

    /// ∫∫ t (n·p)/|p|⁴ over the flat triangle, t counted from the first corner.
    fn leaf(&self, t: &[Corner; 3]) -> f64 {
        let [a, b, c] = t;
        let (u, v) = (sub(&b.at, &a.at), sub(&c.at, &b.at));
        let [au, av, uu, uv, vv] = [
            dot(&a.at, &u),
            dot(&a.at, &v),
            dot(&u, &u),
            dot(&u, &v),
            dot(&v, &v),
        ]
        .map(|x| x.to_f64());
        let (n0, nu, nv) = (a.n.to_f64(), b.n.to_f64(), c.n.to_f64());
        let mut sum = 0.0;
        for (s, ws) in self.0.nodes.iter().zip(&self.0.weights) {
            let s = 0.5 * (s + 1.0);
            for (q, wq) in self.0.nodes.iter().zip(&self.0.weights) {
                let q = 0.5 * (q + 1.0);
                let r = s * (2.0 * (au + q * av) + s * (uu + 2.0 * q * uv + q * q * vv));
                let facing = n0 * (1.0 - s) + s * (nu * (1.0 - q) + nv * q);
                sum += ws * wq * s * facing / ((1.0 + r) * (1.0 + r));
            }
        }
        0.25 * sum
    }
}

/// From the centre of the circumcircle, if that is inside: of nearly half a sphere, the middle of a
/// side may be beyond what is opposite the third corner.
fn thirds(t: [Corner; 3], n: &V) -> Vec<[Corner; 3]> {
    let normal = cross(&sub(&t[1].at, &t[0].at), &sub(&t[2].at, &t[0].at));
    let size = length(&normal);
    let side = |i: usize| dot(&cross(&t[i].at, &t[(i + 1) % 3].at), &normal);
    let zero = dd(0.0);
    let long = (0..3).any(|i| chord(&t[i], &t[(i + 1) % 3]) > 2.0);
    if !(long && size > zero && (0..3).all(|i| side(i) > zero)) {
        return vec![t];
    }
    let up = if dot(&normal, &t[0].at) < zero {
        dd(-1.0)
    } else {
        dd(1.0)
    };
    let at = normal.map(|x| x * up / size);
    let n = dot(n, &at);
    // It is in what is lit: below the horizon are only its roundings.
    let n = if n < zero { zero } else { n };
    let centre = Corner { at, n };
    (0..3).map(|i| [centre, t[i], t[(i + 1) % 3]]).collect()
}

/// The square of the distance of two corners.
fn chord(a: &Corner, b: &Corner) -> f64 {
    let step = sub(&a.at, &b.at);
    dot(&step, &step).to_f64()
}

/// The corner opposite the longest side, unless all are short enough for the rule.
fn longest(t: &[Corner; 3]) -> Option<usize> {
    let mut worst = (0.1, None);
    for i in 0..3 {
        let chord = chord(&t[(i + 1) % 3], &t[(i + 2) % 3]);
        if chord > worst.0 {
            worst = (chord, Some(i));
        }
    }
    worst.1
}

fn volume(t: &[Corner; 3]) -> f64 {
    let normal = cross(&sub(&t[1].at, &t[0].at), &sub(&t[2].at, &t[0].at));
    dot(&normal, &t[0].at).abs().to_f64()
}
