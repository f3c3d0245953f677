//! Peters' algorithms 1 and 2 as they are printed, in single precision. `linelit-lights` is
//! compared with them in the table of its accuracy and in the papers' figures.
#![allow(
    clippy::disallowed_methods,
    reason = "as it is printed, and as it was run"
)]

/// Samples a linear light in proportion to projected solid angle by Peters 2021, algorithms 1 and
/// 2, word for word in `f32`, with two iterations and the interpolated clip of §3.2. Returns a
/// direction (of unit length up to rounding), or `None` below the horizon.
///
/// **Error**: in exact arithmetic 1.58e-5 in ξ; in `f32` the antiderivative of eq. 2 cancels for
/// lines that are short, far or nearly collinear with the shading point, until no digit is left
/// (`docs/accuracy-lights.md`).
#[must_use]
pub fn sample_as_printed(p0: [f32; 3], p1: [f32; 3], n: [f32; 3], xi: f32) -> Option<[f32; 3]> {
    Line::new(p0, p1, n).map(|line| line.sample(xi))
}

/// The per-light part of algorithm 1.
#[derive(Debug)]
pub struct Line {
    l0: [f32; 3],
    s: [f32; 3],
    along: f32,
    inverse: f32,
    l0s: f32,
    l1s: f32,
    ns: f32,
    nt: f32,
    f0: f32,
    total: f32,
}

impl Line {
    /// Clips the line to the horizon, and computes all values that do not depend on ξ; `None` if it
    /// is below the horizon.
    #[must_use]
    pub fn new(p0: [f32; 3], p1: [f32; 3], n: [f32; 3]) -> Option<Self> {
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let lerp =
            |a: [f32; 3], b: [f32; 3], t: f32| [0, 1, 2].map(|i| a[i] * (1.0 - t) + b[i] * t);
        // Clip to the horizon.
        let (c0, c1) = (dot(n, p0), dot(n, p1));
        let (l0, l1) = match (c0 < 0.0, c1 < 0.0) {
            (true, true) => return None,
            (true, false) => (lerp(p0, p1, c0 / (c0 - c1)), p1),
            (false, true) => (p0, lerp(p0, p1, c0 / (c0 - c1))),
            _ => (p0, p1),
        };
        // The direction and length of the line, its distance 1/`inverse` from the shading point,
        // and the sines of its ends.
        let e = [0, 1, 2].map(|i| l1[i] - l0[i]);
        let length = dot(e, e).sqrt();
        let s = e.map(|x| x / length);
        let along = dot(l0, s);
        let q2 = dot(l0, l0) - along * along;
        let inverse = 1.0 / q2.sqrt();
        let l0s = along / dot(l0, l0).sqrt();
        let end = along + length;
        let l1s = end / (end * end + q2).sqrt();
        // The normal along the line and towards it, and the antiderivative at both ends.
        let ns = dot(n, s);
        let nt = inverse * (dot(n, l0) - ns * along);
        let f0 = antiderivative(ns, nt, l0s);
        Some(Self {
            l0,
            s,
            along,
            inverse,
            l0s,
            l1s,
            ns,
            nt,
            f0,
            total: antiderivative(ns, nt, l1s) - f0,
        })
    }

    /// Returns the direction for a random number: algorithm 2.
    #[must_use]
    pub fn sample(&self, xi: f32) -> [f32; 3] {
        let (ns, nt) = (self.ns, self.nt);
        let target = xi * self.total + self.f0;
        // Start at a sine linear in ξ.
        let mut ws = (self.l0s + xi * (self.l1s - self.l0s)).clamp(-1.0, 1.0);
        let mut wt = (1.0 - ws * ws).sqrt();
        if (1e-5..=1.0 - 1e-5).contains(&xi) {
            // Iterate twice.
            let mut alpha = ws.asin();
            for _ in 0..2 {
                let n = ns * ws + nt * wt;
                let g = n * ws + nt * alpha - target;
                let g1 = 2.0 * n * wt;
                let g2 = 2.0 * (ns * wt - nt * ws) * wt - 2.0 * n * ws;
                let root = (g1 * g1 - 2.0 * g2 * g).max(0.0).sqrt();
                let sum = g1 + root.copysign(g1);
                let beta = if sum.abs() > 0.0 { -2.0 * g / sum } else { 0.0 };
                let quarter = core::f32::consts::FRAC_PI_2;
                alpha = (alpha + beta).clamp(-quarter, quarter);
                (ws, wt) = alpha.sin_cos();
            }
        }
        // Convert the angle to a direction.
        let (a, b) = (ws - self.inverse * wt * self.along, self.inverse * wt);
        [0, 1, 2].map(|i| a * self.s[i] + b * self.l0[i])
    }
}

/// F of eq. 3.
fn antiderivative(ns: f32, nt: f32, w: f32) -> f32 {
    ns * w * w + nt * ((1.0 - w * w).max(0.0).sqrt() * w + w.clamp(-1.0, 1.0).asin())
}
