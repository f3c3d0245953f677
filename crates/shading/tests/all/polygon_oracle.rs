//! Lobes over polygons: triangles of unit vectors in double-double arithmetic, halved across the
//! greatest change of the lobe until it is mild on them; there the nodes of a product rule in
//! `f64`, relative to a corner. All terms are positive: good to some 1e-13 of the result itself,
//! slivers and tails included.

use crate::oracle::{V, dd};
use linelit_testkit::dd::Dd;
use linelit_testkit::quadrature::{GaussRule, gauss_legendre};
use linelit_testkit::real::{Real, cross, dot, length, sub, vector};

/// Nodes in each of two directions.
const NODES: usize = 11;
/// The greatest change of the logarithm of the lobe over a mild triangle.
const MILD: f64 = 6.0;
/// Parts of the sum that are not looked at.
const NEGLIGIBLE: f64 = 1e-18;

/// A direction, and n and w times it.
#[derive(Clone, Copy)]
struct Corner {
    at: V,
    n: Dd,
    w: Dd,
}

impl Corner {
    fn mix(&self, a: Dd, other: &Self, b: Dd) -> Self {
        let mix = |x: Dd, y: Dd| x * a + y * b;
        Self {
            at: [0, 1, 2].map(|i| mix(self.at[i], other.at[i])),
            n: mix(self.n, other.n),
            w: mix(self.w, other.w),
        }
    }

    fn unit(&self) -> Self {
        let inverse = dd(1.0) / length(&self.at);
        self.mix(inverse, self, dd(0.0))
    }
}

/// The lobe, and the rule.
pub(crate) struct Oracle {
    rule: GaussRule,
    w: V,
    k: f64,
}

/// The part of a convex polygon with `value` ≥ 0.
fn above(polygon: &[Corner], value: impl Fn(&Corner) -> Dd) -> Vec<Corner> {
    let zero = dd(0.0);
    let mut out = Vec::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (ca, cb) = (value(a), value(b));
        if ca >= zero {
            out.push(*a);
        }
        if (ca > zero && cb < zero) || (ca < zero && cb > zero) {
            out.push(a.mix(cb / (cb - ca), b, zero - ca / (cb - ca)));
        }
    }
    out
}

impl Oracle {
    pub(crate) fn new() -> Self {
        Self {
            rule: gauss_legendre(NODES),
            w: vector::<Dd>([0.0; 3]),
            k: 0.0,
        }
    }

    /// ∫ max(0, n·ω) max(0, w·ω)ᵏ dω over a convex polygon, for a w of about unit length.
    pub(crate) fn phong(&mut self, vertices: &[[f64; 3]], n: [f64; 3], w: [f64; 3], k: f64) -> f64 {
        (self.w, self.k) = (vector::<Dd>(w), k);
        let n = vector::<Dd>(n);
        let whole: Vec<Corner> = vertices
            .iter()
            .map(|v| {
                let at = vector::<Dd>(*v);
                let (n, w) = (dot(&n, &at), dot(&self.w, &at));
                Corner { at, n, w }
            })
            .collect();
        let polygon: Vec<Corner> = above(&above(&whole, |c| c.n), |c| c.w)
            .iter()
            .map(Corner::unit)
            .collect();
        if polygon.len() < 3 {
            return 0.0;
        }
        let fan: Vec<[Corner; 3]> = (1..polygon.len() - 1)
            .flat_map(|i| self.thirds([polygon[0], polygon[i], polygon[i + 1]], &n))
            .collect();
        let peak = fan.iter().map(|t| self.highest(t)).fold(0.0, f64::max);
        let mut waiting: Vec<([Corner; 3], f64, u32)> =
            fan.into_iter().map(|t| (t, volume(&t), 0)).collect();
        waiting.sort_by(|a, b| self.highest(&a.0).total_cmp(&self.highest(&b.0)));
        let mut sum = 0.0;
        while let Some((t, volume, depth)) = waiting.pop() {
            let highest = self.highest(&t);
            let facing = t.iter().map(|c| c.n.to_f64()).fold(0.0, f64::max);
            let least = {
                // Of triangles with an obtuse side, the flat one is nearer to the origin.
                let middle =
                    [0, 1, 2].map(|i| (t[0].at[i] + t[1].at[i] + t[2].at[i]).to_f64() / 3.0);
                middle.iter().map(|x| x * x).sum::<f64>().powi(2).max(1e-3)
            };
            let lobe = if self.k > 0.0 {
                (self.k * (highest / peak).ln()).exp()
            } else {
                1.0
            };
            if volume * facing / least * lobe <= NEGLIGIBLE * sum {
                continue;
            }
            match self.greatest_change(&t, highest, peak) {
                Some(side) if depth < 400 => {
                    let [a, b, c] = [side, (side + 1) % 3, (side + 2) % 3].map(|i| t[i]);
                    let middle = b.mix(dd(1.0), &c, dd(1.0)).unit();
                    let parts = [[a, b, middle], [a, middle, c]];
                    let higher = b.w < c.w;
                    for part in [parts[usize::from(!higher)], parts[usize::from(higher)]] {
                        waiting.push((part, self::volume(&part), depth + 1));
                    }
                }
                _ => sum += volume * self.leaf(&t, peak),
            }
        }
        // In four parts: the result may be near the end of the range, or the lobe beyond it.
        let quarter = if k > 0.0 {
            (dd(0.25 * k) * dd(peak).ln()).exp().to_f64()
        } else {
            1.0
        };
        sum * quarter * quarter * quarter * quarter
    }

    /// From the centre of the circumcircle, if that is inside: of nearly half a sphere, the middle
    /// of a side may be beyond what is opposite the third corner.
    fn thirds(&self, t: [Corner; 3], n: &V) -> Vec<[Corner; 3]> {
        let normal = cross(&sub(&t[1].at, &t[0].at), &sub(&t[2].at, &t[0].at));
        let size = length(&normal);
        let side = |i: usize| dot(&cross(&t[i].at, &t[(i + 1) % 3].at), &normal);
        let zero = dd(0.0);
        let chord = |i: usize| {
            let step = sub(&t[i].at, &t[(i + 1) % 3].at);
            dot(&step, &step)
        };
        let long = (0..3).any(|i| chord(i) > dd(2.0));
        if !(long && size > zero && (0..3).all(|i| side(i) > zero)) {
            return vec![t];
        }
        let up = if dot(&normal, &t[0].at) < zero {
            dd(-1.0)
        } else {
            dd(1.0)
        };
        let at = normal.map(|x| x * up / size);
        let (n, w) = (dot(n, &at), dot(&self.w, &at));
        // It is in what is lit: below one of the horizons are only its roundings.
        let centre = Corner {
            at,
            n: if n < zero { zero } else { n },
            w: if w < zero { zero } else { w },
        };
        (0..3).map(|i| [centre, t[i], t[(i + 1) % 3]]).collect()
    }

    /// The side opposite a corner to be halved, if the triangle is not mild.
    fn greatest_change(&self, t: &[Corner; 3], highest: f64, peak: f64) -> Option<usize> {
        let polynomial = self.k.fract() <= 0.0 && self.k <= 8.0;
        let mut worst = (1.0, None);
        for i in 0..3 {
            let (b, c) = (&t[(i + 1) % 3], &t[(i + 2) % 3]);
            let step = sub(&b.at, &c.at);
            let chord = dot(&step, &step).to_f64();
            // Sides of more than 90° first: what is between nearly opposite corners may be
            // anything.
            let mut change = if chord > 2.0 { f64::MAX } else { chord / 0.1 };
            if self.k > 0.0 {
                change = change.max(chord * self.k / 2.0);
            }
            if !polynomial && self.k > 0.0 {
                // What the lobe does far below its peak is of no importance.
                let floor = self.k * (highest / peak).ln() - 60.0;
                let log = |x: Dd| (self.k * (x.to_f64() / peak).ln()).max(floor);
                // A power of what is nearly nothing is no polynomial.
                let mild = MILD.min(self.k * std::f64::consts::LN_2);
                change = change.max((log(b.w) - log(c.w)).abs() / mild);
            }
            if change > worst.0 {
                worst = (change, Some(i));
            }
        }
        worst.1
    }

    /// The lobe's highest cosine on a triangle.
    fn highest(&self, t: &[Corner; 3]) -> f64 {
        let mut best: f64 = 0.0;
        let mut foot = false;
        for i in 0..3 {
            let (a, b) = (&t[i], &t[(i + 1) % 3]);
            let (za, zb) = (a.w.to_f64(), b.w.to_f64());
            best = best.max(za);
            let step = sub(&b.at, &a.at);
            let chord = dot(&step, &step).to_f64();
            let rise = (b.w - a.w).to_f64();
            let (up, down) = (rise + 0.5 * za * chord, -rise + 0.5 * zb * chord);
            if up > 0.0 && down > 0.0 && chord > 0.0 {
                foot = true;
                let sine2 = chord * (1.0 - 0.25 * chord);
                best = best.max(((rise * rise + za * zb * chord) / sine2).sqrt());
            }
        }
        if foot {
            let side = |i: usize| dot(&cross(&t[i].at, &t[(i + 1) % 3].at), &self.w).to_f64();
            let s = [side(0), side(1), side(2)];
            if s.iter().all(|x| *x >= 0.0) || s.iter().all(|x| *x <= 0.0) {
                return length(&self.w).to_f64();
            }
        }
        best
    }

    /// ∫∫ t (n·p)(w·p/peak)ᵏ/|p|^(4 + k) over the flat triangle, t counted from the first corner.
    fn leaf(&self, t: &[Corner; 3], peak: f64) -> f64 {
        // From the corner where the lobe is highest, so that it is not zero there.
        let first = (0..3).fold(0, |best, i| if t[i].w > t[best].w { i } else { best });
        let [a, b, c] = [first, (first + 1) % 3, (first + 2) % 3].map(|i| &t[i]);
        let start = if self.k > 0.0 {
            (dd(self.k) * (a.w / dd(peak)).ln()).to_f64()
        } else {
            0.0
        };
        let (u, v) = (sub(&b.at, &a.at), sub(&c.at, &b.at));
        let [au, av, uu, uv, vv] = [
            dot(&a.at, &u),
            dot(&a.at, &v),
            dot(&u, &u),
            dot(&u, &v),
            dot(&v, &v),
        ]
        .map(|x| x.to_f64());
        let change = |b: &Corner, a: &Corner| ((b.w - a.w) / t[first].w).to_f64();
        let (wu, wv) = (change(b, a), change(c, b));
        let (n0, nu, nv) = (a.n.to_f64(), b.n.to_f64(), c.n.to_f64());
        let mut sum = 0.0;
        for (s, ws) in self.rule.nodes.iter().zip(&self.rule.weights) {
            let s = 0.5 * (s + 1.0);
            for (q, wq) in self.rule.nodes.iter().zip(&self.rule.weights) {
                let q = 0.5 * (q + 1.0);
                let r = s * (2.0 * (au + q * av) + s * (uu + 2.0 * q * uv + q * q * vv));
                let facing = n0 * (1.0 - s) + s * (nu * (1.0 - q) + nv * q);
                let lobe = if self.k > 0.0 {
                    let log = (s * (wu + q * wv)).ln_1p() - 0.5 * r.ln_1p();
                    (start + self.k * log).exp()
                } else {
                    1.0
                };
                sum += ws * wq * s * facing * lobe / ((1.0 + r) * (1.0 + r));
            }
        }
        0.25 * sum
    }
}

fn volume(t: &[Corner; 3]) -> f64 {
    let normal = cross(&sub(&t[1].at, &t[0].at), &sub(&t[2].at, &t[0].at));
    dot(&normal, &t[0].at).abs().to_f64()
}
