//! This module integrates lobes along lines for comparison, to some 1e-14: the terms that decide
//! about cancellation are in double-double arithmetic, and the nodes of composite Gauss–Legendre
//! rules in `f64`, relative to the lobe's peak.

use crate::oracle::{V, clip, dd};
use linelit_testkit::dd::Dd;
use linelit_testkit::quadrature::{GaussRule, gauss_legendre};
use linelit_testkit::real::{Real, cross, dot, length, sub, vector};

/// What is dropped at the end of a window: e⁻⁴⁶ = 1e-20.
const DEPTH: f64 = 46.0;

/// The rule on each piece.
pub(crate) struct Rule(GaussRule);

impl Default for Rule {
    fn default() -> Self {
        Self(gauss_legendre(20))
    }
}

/// The integrals of both models of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Models {
    pub(crate) ribbon: f64,
    pub(crate) cylinder: f64,
}

/// The clipped arc: functionals by their values at the first end and a right angle further.
struct Arc {
    first: V,
    tangent: V,
    cosine: [Dd; 2],
    closeness: [Dd; 2],
    angle: Dd,
    /// 1/h.
    inverse: Dd,
}

impl Arc {
    fn new(p0: [f64; 3], p1: [f64; 3], n: [f64; 3], planes: &[[f64; 3]]) -> Option<Self> {
        let (a, b) = clip(p0, p1, planes)?;
        let n = vector::<Dd>(n);
        let x = cross(&a, &b);
        let (ra, rb, size) = (length(&a), length(&b), length(&x));
        let angle = size.atan2(dot(&a, &b));
        let side = cross(&x, &a);
        let first = a.map(|c| c / ra);
        let tangent = side.map(|c| c / (size * ra));
        let inverse = dd(1.0) / ra;
        let (s, c) = angle.sin_cos();
        Some(Self {
            cosine: [dot(&n, &first), dot(&n, &tangent)],
            closeness: [inverse, (dd(1.0) / rb - inverse * c) / s],
            first,
            tangent,
            angle,
            inverse: length(&sub(&b, &a)) / size,
        })
    }

    fn functional(&self, k: [f64; 3]) -> [Dd; 2] {
        let k = vector::<Dd>(k);
        [dot(&k, &self.first), dot(&k, &self.tangent)]
    }

    /// ∫ (n·ω) lobe and ∫ (n·ω)/|p| lobe from `from` over `width` in the direction `sign`; the lobe
    /// by the angle from `from`.
    fn piece(
        &self,
        rule: &Rule,
        from: Dd,
        width: f64,
        sign: f64,
        lobe: impl Fn(f64) -> f64,
    ) -> [f64; 2] {
        let ends = [from, from + dd(sign * width)].map(|v| {
            let (s, c) = v.sin_cos();
            [self.cosine, self.closeness].map(|f| (f[0] * c + f[1] * s).to_f64().max(0.0))
        });
        let (mut plain, mut emitted) = (0.0, 0.0);
        let sine = width.sin();
        for (node, weight) in rule.0.nodes.iter().zip(&rule.0.weights) {
            let y = width * 0.5 * (node + 1.0);
            let (near, far) = ((width - y).sin() / sine, y.sin() / sine);
            let value = |i: usize| near * ends[0][i] + far * ends[1][i];
            let term = weight * value(0) * lobe(y);
            plain += term;
            emitted += term * value(1);
        }
        [0.5 * width * plain, 0.5 * width * emitted]
    }

    fn models(&self, sums: [f64; 2], power: impl Fn(f64) -> f64) -> Models {
        let inverse = self.inverse.to_f64();
        Models {
            ribbon: power(sums[1] * inverse),
            cylinder: power(2.0 * sums[1]),
        }
    }
}

/// Fractions that divide a side: thirds, or pieces that halve towards the far end, where the lobe
/// may end like a power.
fn division(rough: bool) -> Vec<f64> {
    if rough {
        (0..40).map(|j| 1.0 - 0.5f64.powi(j)).chain([1.0]).collect()
    } else {
        vec![0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]
    }
}

/// ∫ (n·ω)(r·ω)ᵏ along a line.
pub(crate) fn phong(
    rule: &Rule,
    p0: [f64; 3],
    p1: [f64; 3],
    n: [f64; 3],
    r: [f64; 3],
    k: f64,
) -> Option<Models> {
    let arc = Arc::new(p0, p1, n, &[n, r])?;
    let [z0, rise] = arc.functional(r);
    let centre = rise.atan2(z0);
    let start = if centre < dd(0.0) {
        dd(0.0)
    } else if centre > arc.angle {
        arc.angle
    } else {
        centre
    };
    let (s, c) = start.sin_cos();
    let high = z0 * c + rise * s;
    let lean = (z0 * s - rise * c) / high;
    let mut sums = [0.0; 2];
    for (whole, sign) in [(arc.angle - start, 1.0), (start, -1.0)] {
        if whole <= dd(0.0) {
            continue;
        }
        let slope = (sign * lean.to_f64()).max(0.0);
        let steep = k * slope;
        let window = 2.0 * DEPTH / (steep + (steep * steep + 2.0 * k * DEPTH).sqrt());
        let width = if whole.to_f64() <= window {
            whole
        } else {
            dd(window)
        };
        let rough = k.fract() > 0.0 && k < 12.0;
        for ends in division(rough).windows(2) {
            let from = start + width * dd(sign * ends[0]);
            let before = width.to_f64() * ends[0];
            let step = width.to_f64() * (ends[1] - ends[0]);
            let bottom = {
                let (s, c) = (from + dd(sign * step)).sin_cos();
                ((z0 * c + rise * s) / high).to_f64().max(0.0)
            };
            let top = {
                let (s, c) = from.sin_cos();
                ((z0 * c + rise * s) / high).to_f64().max(0.0)
            };
            let sine = step.sin();
            let lobe = |y: f64| {
                let x = before + y;
                let half = (0.5 * x).sin();
                let fall = 2.0 * half * half + slope * x.sin();
                if fall < 0.5 {
                    (k * (-fall).ln_1p()).exp()
                } else if k > 0.0 {
                    let z = ((step - y).sin() * top + y.sin() * bottom) / sine;
                    (k * z.ln()).exp()
                } else {
                    1.0
                }
            };
            let part = arc.piece(rule, from, step, sign, lobe);
            sums = [sums[0] + part[0], sums[1] + part[1]];
        }
    }
    // In four parts: the result may be near the end of the range, or the lobe beyond it.
    let quarter = (dd(0.25 * k) * high.ln()).exp().to_f64();
    Some(arc.models(sums, |x| x * quarter * quarter * quarter * quarter))
}

/// ∫ (n·ω) exp(λ(ω·ξ − 1)) along a line.
pub(crate) fn gaussian(
    rule: &Rule,
    p0: [f64; 3],
    p1: [f64; 3],
    n: [f64; 3],
    xi: [f64; 3],
    lambda: f64,
) -> Option<Models> {
    let arc = Arc::new(p0, p1, n, &[n])?;
    let [z0, rise] = arc.functional(xi);
    let centre = rise.atan2(z0);
    let rho = (z0 * z0 + rise * rise).sqrt();
    // Monotone between centre, antipode and ends.
    let mut marks = vec![dd(0.0)];
    let mut inner = [centre - Dd::PI, centre, centre + Dd::PI]
        .into_iter()
        .filter(|v| *v > dd(0.0) && *v < arc.angle);
    marks.extend(inner.by_ref());
    marks.push(arc.angle);
    // The greatest exponent; all others are relative to it.
    let off = |v: Dd| {
        let d = (v - centre).abs();
        if d > Dd::PI { Dd::PI + Dd::PI - d } else { d }
    };
    let level = |v: Dd| dd(lambda) * (rho * off(v).cos() - dd(1.0));
    let top = marks
        .iter()
        .map(|v| level(*v))
        .fold(dd(f64::MIN / 4.0), |a, b| if b > a { b } else { a });
    let mut sums = [0.0; 2];
    for pair in marks.windows(2) {
        let forward = off(pair[0]) <= off(pair[1]);
        let (start, sign) = if forward {
            (pair[0], 1.0)
        } else {
            (pair[1], -1.0)
        };
        let width = (pair[1] - pair[0]).to_f64();
        let x0 = off(start).to_f64();
        let peak = (level(start) - top).to_f64().exp();
        let strength = 2.0 * lambda * rho.to_f64();
        let end = (0.5 * x0).sin().powi(2) + DEPTH / strength;
        let window = if end < 1.0 {
            2.0 * end.sqrt().asin() - x0
        } else {
            width
        };
        let width = width.min(window);
        if !(width > 0.0) || peak <= 0.0 {
            continue;
        }
        let pieces = 4;
        for j in 0..pieces {
            let step = width / f64::from(pieces);
            let before = step * f64::from(j);
            let lobe = |y: f64| {
                let x = before + y;
                peak * (-strength * (x0 + 0.5 * x).sin() * (0.5 * x).sin()).exp()
            };
            let part = arc.piece(rule, start + dd(sign * before), step, sign, lobe);
            sums = [sums[0] + part[0], sums[1] + part[1]];
        }
    }
    let quarter = (top * dd(0.25)).exp().to_f64();
    Some(arc.models(sums, |x| x * quarter * quarter * quarter * quarter))
}
