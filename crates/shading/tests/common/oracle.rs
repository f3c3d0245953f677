//! The integrals in double-double arithmetic (31 digits), from their definitions or from forms that
//! lose less than fifteen of them.

use linelit_testkit::dd::Dd;
use linelit_testkit::quadrature::{GaussRule, gauss_legendre};
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

fn line(p0: [f64; 3], p1: [f64; 3], n: [f64; 3]) -> Option<Line> {
    let (a, b) = clip(p0, p1, &[n])?;
    let n = vector::<Dd>(n);
    let x = length(&cross(&a, &b));
    let (ra, rb) = (length(&a), length(&b));
    Some(Line {
        c: [dot(&n, &a), dot(&n, &b)],
        r: [ra, rb],
        length: length(&sub(&b, &a)),
        sine: x / (ra * rb),
        angle: x.atan2(dot(&a, &b)),
    })
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

/// Billen & Dutré's integral, by the crate's own algebra in double-double (that the algebra is right is
/// for the reference vectors to say), with the angle from atan2.
pub(crate) fn ribbon(p0: [f64; 3], p1: [f64; 3], n: [f64; 3]) -> Dd {
    let Some(l) = line(p0, p1, n) else {
        return dd(0.0);
    };
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

/// Twice the distance of the line.
pub(crate) fn twice_distance(p0: [f64; 3], p1: [f64; 3]) -> Dd {
    let (a, b) = (vector::<Dd>(p0), vector::<Dd>(p1));
    dd(2.0) * length(&cross(&a, &b)) / length(&sub(&b, &a))
}

/// Picott's integral.
pub(crate) fn point_line(p0: [f64; 3], p1: [f64; 3], n: [f64; 3]) -> Dd {
    let Some(l) = line(p0, p1, n) else {
        return dd(0.0);
    };
    let product = l.r[0] * l.r[1];
    let half = l.angle * dd(0.5);
    let cos = half.cos();
    l.length * (l.c[0] / l.r[0] + l.c[1] / l.r[1]) / (product * dd(2.0) * cos * cos)
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
    let mut sum = zero;
    for (i, a) in above.iter().enumerate() {
        let b = &above[(i + 1) % above.len()];
        let x = cross(a, b);
        let size = length(&x);
        if size > zero {
            sum = sum + size.atan2(dot(a, b)) * dot(&x, &n) / size;
        }
    }
    sum.abs() * dd(0.5)
}

/// Quadrature rule of the lobes, and how its window is divided.
pub(crate) struct Rule(GaussRule);

impl Default for Rule {
    fn default() -> Self {
        Self(gauss_legendre(20))
    }
}

/// ∫ (n·p)(r·p)ᵏ/|p|^(4 + k) dt by composite Gauss–Legendre over the angle, from the definition:
/// directions, logarithms and exponentials in double-double.
pub(crate) fn phong(
    rule: &Rule,
    p0: [f64; 3],
    p1: [f64; 3],
    n: [f64; 3],
    r: [f64; 3],
    k: f64,
) -> f64 {
    let Some((a, b)) = clip(p0, p1, &[n, r]) else {
        return 0.0;
    };
    let (n, r) = (vector::<Dd>(n), vector::<Dd>(r));
    let x = cross(&a, &b);
    let (ra, rb, size) = (length(&a), length(&b), length(&x));
    let angle = size.atan2(dot(&a, &b));
    let side = cross(&x, &a);
    let u = a.map(|c| c / ra);
    let t = side.map(|c| c / (size * ra));
    let (z0, rise) = (dot(&r, &u), dot(&r, &t));
    let (c0, c1) = (dot(&n, &u), dot(&n, &t));
    // 1/|p| as a cosine: its value and slope at the first end, from both ends.
    let inverse = dd(1.0) / ra;
    let slope = (dd(1.0) / rb - inverse * angle.cos()) / angle.sin();
    let centre = rise.atan2(z0);
    let start = if centre < dd(0.0) {
        dd(0.0)
    } else if centre > angle {
        angle
    } else {
        centre
    };
    let (s, c) = (start.sin(), start.cos());
    let peak = (z0 * c + rise * s).ln();
    let steep = (start - centre).abs().to_f64().tan() * k;
    let window = 2.0 * 46.0 / (steep + (steep * steep + 2.0 * k * 46.0).sqrt());
    let mut sum = dd(0.0);
    for (width, sign) in [((angle - start).to_f64(), 1.0), (start.to_f64(), -1.0)] {
        let whole = sign > 0.0 && start == dd(0.0) || sign < 0.0 && start == angle;
        let width = if width <= window && whole {
            angle
        } else {
            dd(width.min(window))
        };
        if width <= dd(0.0) {
            continue;
        }
        // Thirds, or pieces that halve towards the far end, where the lobe may end like a power.
        let rough = k.fract() > 0.0 && k < 12.0;
        let edges: Vec<f64> = if rough {
            (0..40).map(|j| 1.0 - 0.5f64.powi(j)).chain([1.0]).collect()
        } else {
            vec![0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]
        };
        for piece in edges.windows(2) {
            let mut part = dd(0.0);
            let (from, step) = (piece[0], piece[1] - piece[0]);
            for (node, weight) in rule.0.nodes.iter().zip(&rule.0.weights) {
                let fraction = from + step * 0.5 * (node + 1.0);
                let v = start + width * dd(sign * fraction);
                let (s, c) = (v.sin(), v.cos());
                let z = z0 * c + rise * s;
                if z <= dd(0.0) {
                    continue;
                }
                let lobe = (dd(k) * (z.ln() - peak)).exp();
                part = part + dd(*weight) * (c0 * c + c1 * s) * (inverse * c + slope * s) * lobe;
            }
            sum = sum + part * width * dd(0.5 * step);
        }
    }
    // 1/h = l/|X|.
    let reach = length(&sub(&b, &a)) / size;
    // In four parts: the result may be near the end of the range, or the lobe beyond it.
    let quarter = (dd(0.25 * k) * peak).exp();
    (sum * quarter * reach * quarter * quarter * quarter).to_f64()
}
