//! Quadrature: adaptive Gauss–Kronrod, Gauss–Legendre, and an adaptive rule over rectangles.
//!
//! All adaptive rules return an [`Estimate`] with an error estimate; an oracle should check both.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

/// The value of an integral with an estimate of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The integral.
    pub value: f64,
    /// An estimate (not a proven bound) of the absolute error.
    pub error: f64,
    /// The number of evaluations of the integrand.
    pub evaluations: usize,
}

/// The largest number of pieces into which the adaptive rules split an interval. With that many,
/// they return the error that they have reached.
pub const MAX_PIECES: usize = 4000;

/// The nonnegative nodes of the 15-point Kronrod rule, from the outside in.
const NODES_15: [f64; 8] = [
    0.9914553711208126,
    0.9491079123427585,
    0.8648644233597691,
    0.7415311855993945,
    0.5860872354676911,
    0.4058451513773972,
    0.20778495500789848,
    0.0,
];

/// The weights of the 15 nodes.
const KRONROD_15: [f64; 8] = [
    0.022935322010529224,
    0.06309209262997856,
    0.10479001032225019,
    0.14065325971552592,
    0.1690047266392679,
    0.19035057806478542,
    0.20443294007529889,
    0.20948214108472782,
];

/// The weights of the embedded 7-point Gauss rule (at every second node).
const GAUSS_7: [f64; 4] = [
    0.1294849661688697,
    0.27970539148927664,
    0.3818300505051189,
    0.4179591836734694,
];

/// The result of a Gauss–Kronrod pair on [a, b].
#[derive(Clone, Copy, Debug)]
struct Piece {
    a: f64,
    b: f64,
    value: f64,
    error: f64,
}

/// Applies the pair of rules.
fn kronrod_pair(f: &mut impl FnMut(f64) -> f64, a: f64, b: f64) -> Piece {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let centre = f(middle);
    let (mut k, mut g) = (KRONROD_15[7] * centre, GAUSS_7[3] * centre);
    let mut magnitude = KRONROD_15[7] * centre.abs();
    for (i, (node, weight)) in NODES_15.iter().zip(KRONROD_15).take(7).enumerate() {
        let (low, high) = (f(middle - half * node), f(middle + half * node));
        k += weight * (low + high);
        magnitude += weight * (low.abs() + high.abs());
        if i % 2 == 1 {
            g += GAUSS_7[i / 2] * (low + high);
        }
    }
    // The error is the difference of both rules, but at least the rounding of the sum.
    let rounding = 4.0 * f64::EPSILON * magnitude * half.abs();
    Piece {
        a,
        b,
        value: k * half,
        error: ((k - g) * half).abs().max(rounding),
    }
}

/// Computes ∫ₐᵇ f by globally adaptive Gauss–Kronrod 7/15, until the estimated error is below
/// `rel_tol`·|value|.
///
/// It bisects the piece with the largest estimated error; the error of a piece is |K₁₅ − G₇|, a
/// pessimistic measure for smooth integrands. It stops at [`MAX_PIECES`] pieces or when a piece has
/// no midpoint left, and then reports the error it has. Jumps cost about 50 bisections each; split
/// the interval at known kinks when speed matters.
///
/// `a > b` gives the negative integral. Source: Piessens et al., QUADPACK (1983), routines
/// QAG/QK15.
///
/// ```
/// use linelit_testkit::quadrature::gauss_kronrod;
/// let e = gauss_kronrod(f64::exp, 0.0, 1.0, 1e-14);
/// assert!((e.value - (1f64.exp() - 1.0)).abs() < 4.0 * f64::EPSILON);
/// ```
pub fn gauss_kronrod(mut f: impl FnMut(f64) -> f64, a: f64, b: f64, rel_tol: f64) -> Estimate {
    gauss_kronrod_to(&mut f, a, b, rel_tol, 0.0)
}

/// Integrates as [`gauss_kronrod`] does until the estimated error is below `rel_tol`·|value| or
/// below `abs_tol`. Use it for integrands that are small differences, whose rounding is not
/// relative to themselves and would be refined without end.
pub fn gauss_kronrod_to(
    mut f: impl FnMut(f64) -> f64,
    a: f64,
    b: f64,
    rel_tol: f64,
    abs_tol: f64,
) -> Estimate {
    // Bisect the piece with the largest error, until the sum is good enough or a piece cannot be
    // bisected.
    let mut pieces = vec![kronrod_pair(&mut f, a, b)];
    loop {
        let value: f64 = pieces.iter().map(|p| p.value).sum();
        let error: f64 = pieces.iter().map(|p| p.error).sum();
        let worst = (0..pieces.len())
            .max_by(|&i, &j| pieces[i].error.total_cmp(&pieces[j].error))
            .unwrap_or(0);
        let Piece { a: lo, b: hi, .. } = pieces[worst];
        let middle = 0.5 * (lo + hi);
        let exhausted = pieces.len() >= MAX_PIECES || middle <= lo.min(hi) || middle >= lo.max(hi);
        let reached = error <= abs_tol.max(rel_tol * value.abs()) || error == 0.0;
        if reached || exhausted || !error.is_finite() {
            return Estimate {
                value,
                error,
                evaluations: 15 * (2 * pieces.len() - 1),
            };
        }
        pieces[worst] = kronrod_pair(&mut f, lo, middle);
        pieces.push(kronrod_pair(&mut f, middle, hi));
    }
}

/// The nodes and weights of a Gauss rule on [−1, 1]; nodes are ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussRule {
    /// The nodes in [−1, 1].
    pub nodes: Vec<f64>,
    /// The weights of the nodes; they sum to 2.
    pub weights: Vec<f64>,
}

impl GaussRule {
    /// Returns ∫ₐᵇ f by this rule.
    pub fn integrate(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        half * self
            .nodes
            .iter()
            .zip(&self.weights)
            .map(|(x, w)| w * f(middle + half * x))
            .sum::<f64>()
    }

    /// Returns ∬ f over the rectangle `x` × `y` by the tensor product of this rule.
    pub fn integrate_2d(
        &self,
        x: [f64; 2],
        y: [f64; 2],
        mut f: impl FnMut(f64, f64) -> f64,
    ) -> f64 {
        self.integrate(x[0], x[1], |u| self.integrate(y[0], y[1], |v| f(u, v)))
    }
}

/// Returns the Gauss–Legendre rule with `n ≥ 1` nodes, which is exact for polynomials up to degree
/// 2n − 1.
///
/// Nodes are the roots of Pₙ by Newton's method from Tricomi's approximation; weights are 2 / ((1 −
/// x²) Pₙ′(x)²). Nodes are accurate to an ulp or two, weights to about n·ε relative near the ends
/// (measured: 1e-14 at n = 64).
///
/// ```
/// let rule = linelit_testkit::quadrature::gauss_legendre(4);
/// assert!((rule.integrate(0.0, 1.0, |x| x.powi(7)) - 0.125).abs() < 1e-16);
/// ```
pub fn gauss_legendre(n: usize) -> GaussRule {
    let count = n as f64;
    let (mut nodes, mut weights) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n.div_ceil(2) {
        // Find the i-th root from the right by Newton's method.
        let mut x = ((i as f64 + 0.75) * std::f64::consts::PI / (count + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, previous) = legendre(n, x);
            slope = count * (previous - x * value) / ((1.0 - x) * (1.0 + x));
            let step = value / slope;
            x -= step;
            if step.abs() <= f64::EPSILON {
                break;
            }
        }
        // The middle root of an odd rule is zero.
        if 2 * i + 1 == n {
            x = 0.0;
            slope = count * legendre(n, x).1;
        }
        // Mirror it.
        nodes[i] = -x;
        nodes[n - 1 - i] = x;
        weights[i] = 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope);
        weights[n - 1 - i] = weights[i];
    }
    GaussRule { nodes, weights }
}

/// Returns (Pₙ(x), Pₙ₋₁(x)) by the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut value, mut previous) = (1.0, 0.0);
    for j in 1..=n {
        let j = j as f64;
        (value, previous) = (
            ((2.0 * j - 1.0) * x * value - (j - 1.0) * previous) / j,
            value,
        );
    }
    (value, previous)
}

/// Computes ∬ f over the rectangle `x` × `y` by adaptive quartering, for integrands that may jump
/// along curves.
///
/// A cell is done when a 4×4 Gauss rule on it and on its quarters differ by at most
/// `abs_tol`·2^−depth, or at `max_depth` quarterings. The reported error is the sum of these
/// differences: an overestimate for smooth integrands (where the quarters are far better than the
/// cell), a fair estimate along jumps.
pub fn cubature(
    mut f: impl FnMut(f64, f64) -> f64,
    x: [f64; 2],
    y: [f64; 2],
    abs_tol: f64,
    max_depth: u32,
) -> Estimate {
    let rule = gauss_legendre(4);
    let mut total = Estimate {
        value: 0.0,
        error: 0.0,
        evaluations: 16,
    };
    let whole = rule.integrate_2d(x, y, &mut f);
    let mut open = vec![(x, y, whole, max_depth, abs_tol)];
    while let Some((x, y, coarse, depth, tol)) = open.pop() {
        let (mx, my) = (0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
        // Compare the cell with its quarters.
        let quarters = [
            ([x[0], mx], [y[0], my]),
            ([mx, x[1]], [y[0], my]),
            ([x[0], mx], [my, y[1]]),
            ([mx, x[1]], [my, y[1]]),
        ];
        let values = quarters.map(|(qx, qy)| rule.integrate_2d(qx, qy, &mut f));
        total.evaluations += 64;
        // Accept the quarters, or divide them further.
        let fine: f64 = values.iter().sum();
        let difference = (fine - coarse).abs();
        if difference <= tol || depth == 0 || !difference.is_finite() {
            total.value += fine;
            total.error += difference;
        } else {
            for ((qx, qy), value) in quarters.into_iter().zip(values) {
                open.push((qx, qy, value, depth - 1, 0.5 * tol));
            }
        }
    }
    total
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that are exact by construction")]
mod tests {
    use super::*;
    use std::f64::consts::{LN_2, PI, SQRT_2};

    /// The pair is exact for monomials up to degree 3n + 1 (n Gauss nodes), and not beyond.
    #[test]
    fn kronrod_degrees() {
        let monomial = |d: i32| kronrod_pair(&mut |x: f64| x.powi(d), 0.0, 1.0).value;
        for d in 0..=23 {
            let (got, want) = (monomial(d), 1.0 / (f64::from(d) + 1.0));
            let tolerance = 8.0 * f64::EPSILON * want.max(0.1);
            assert!((got - want).abs() <= tolerance, "degree {d}: {got}");
        }
        assert!((monomial(92) - 1.0 / 93.0).abs() > 1e-14);
    }

    /// The embedded Gauss rule is the one found by Newton's method.
    #[test]
    fn embedded_gauss_rule() {
        let rule = gauss_legendre(7);
        for (i, weight) in GAUSS_7.iter().enumerate() {
            assert!((rule.nodes[i] + NODES_15[2 * i + 1]).abs() < 4.0 * f64::EPSILON);
            assert!((rule.weights[i] - weight).abs() < 1e-15 * 15.0);
        }
    }

    #[test]
    fn known_integrals() {
        type Case = (fn(f64) -> f64, f64, f64, f64);
        let cases: [Case; 5] = [
            (|x| x.cos(), 0.0, PI / 2.0, 1.0),
            (|x| 1.0 / (1.0 + x), 0.0, 1.0, LN_2),
            (
                |x| 1.0 / (1.0 + 1e6 * x * x),
                -1.0,
                1.0,
                2e-3 * 1e3_f64.atan(),
            ),
            (|x| (20.0 * x).sin() * (20.0 * x).sin(), 0.0, PI, PI / 2.0),
            (
                |x| if x < 1.0 / SQRT_2 { 1.0 } else { 3.0 },
                0.0,
                1.0,
                3.0 - 2.0 / SQRT_2,
            ),
        ];
        for (i, (f, a, b, want)) in cases.into_iter().enumerate() {
            let e = gauss_kronrod(f, a, b, 1e-12);
            // The requested tolerance, plus a few rounding errors of the sum.
            let off = (e.value - want).abs();
            assert!(
                off <= 1e-12 * want + 16.0 * f64::EPSILON,
                "case {i}: {e:?}, want {want}"
            );
            let sure = e.error + 16.0 * f64::EPSILON * want;
            assert!(off <= sure, "case {i}: error estimate");
        }
    }

    #[test]
    fn orientation_and_empty_interval() {
        assert!((gauss_kronrod(|x| x, 1.0, 0.0, 1e-10).value + 0.5).abs() < 1e-15);
        assert_eq!(gauss_kronrod(|x| x, 2.0, 2.0, 1e-10).value, 0.0);
    }

    #[test]
    fn gives_up_and_says_so() {
        let e = gauss_kronrod(|x| 1.0 / x, 0.0, 1.0, 1e-10);
        assert!(
            e.error > 1e-3,
            "a divergent integral must not look converged: {e:?}"
        );
    }

    #[test]
    fn legendre_rules_are_exact_to_their_degree() {
        for n in [1_usize, 2, 3, 8, 33, 64] {
            let rule = gauss_legendre(n);
            assert!((rule.weights.iter().sum::<f64>() - 2.0).abs() < 1e-13);
            for degree in 0..2 * n {
                let d = i32::try_from(degree).unwrap();
                let want = 1.0 / (f64::from(d) + 1.0);
                assert!(
                    (rule.integrate(0.0, 1.0, |x| x.powi(d)) - want).abs() < 1e-14,
                    "n {n}, degree {d}"
                );
            }
        }
    }

    #[test]
    fn two_dimensions() {
        let disk = cubature(
            |x, y| f64::from(x * x + y * y < 1.0),
            [-1.0, 1.0],
            [-1.0, 1.0],
            1e-6,
            9,
        );
        assert!(
            (disk.value - PI).abs() < 1e-3 && disk.error < 0.05,
            "{disk:?}"
        );
        assert!((disk.value - PI).abs() <= disk.error);
    }
}
