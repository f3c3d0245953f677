//! Quadrature: adaptive Gauss–Kronrod, tanh–sinh, Gauss–Legendre, and an adaptive rule over
//! rectangles.
//!
//! All rules return an [`Estimate`] with an error estimate of their own; an oracle should look at
//! both.

/// The value of an integral and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The integral.
    pub value: f64,
    /// An estimate (not a proven bound) of the absolute error.
    pub error: f64,
    /// How often the integrand was evaluated.
    pub evaluations: usize,
}

/// How many pieces the adaptive rules split an interval into before they give up and report the
/// error they reached.
pub const MAX_PIECES: usize = 4000;

/// Positive nodes of the 15-point Kronrod rule, from the outside in.
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

/// Their weights.
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

/// Weights of the embedded 7-point Gauss rule (at every second node).
const GAUSS_7: [f64; 4] = [
    0.1294849661688697,
    0.27970539148927664,
    0.3818300505051189,
    0.4179591836734694,
];

/// Positive nodes of the 31-point Kronrod rule, from the outside in.
const NODES_31: [f64; 16] = [
    0.9980022986933971,
    0.9879925180204854,
    0.9677390756791391,
    0.937273392400706,
    0.8972645323440819,
    0.8482065834104272,
    0.790418501442466,
    0.7244177313601701,
    0.650996741297417,
    0.5709721726085388,
    0.4850818636402397,
    0.3941513470775634,
    0.29918000715316884,
    0.20119409399743451,
    0.1011420669187175,
    0.0,
];

/// Their weights.
const KRONROD_31: [f64; 16] = [
    0.005377479872923349,
    0.015007947329316122,
    0.02546084732671532,
    0.03534636079137585,
    0.04458975132476488,
    0.05348152469092809,
    0.06200956780067064,
    0.06985412131872826,
    0.07684968075772038,
    0.08308050282313302,
    0.08856444305621176,
    0.09312659817082532,
    0.09664272698362368,
    0.09917359872179196,
    0.10076984552387559,
    0.10133000701479154,
];

/// Weights of the embedded 15-point Gauss rule (at every second node).
const GAUSS_15: [f64; 8] = [
    0.03075324199611727,
    0.07036604748810812,
    0.10715922046717194,
    0.13957067792615432,
    0.16626920581699392,
    0.1861610000155622,
    0.19843148532711158,
    0.2025782419255613,
];

/// One Gauss–Kronrod pair on [a, b].
#[derive(Clone, Copy, Debug)]
struct Piece {
    a: f64,
    b: f64,
    value: f64,
    error: f64,
}

/// Applies the pair (nodes and Kronrod weights from the outside in, Gauss weights at every second
/// node).
fn kronrod_pair(
    f: &mut dyn FnMut(f64) -> f64,
    a: f64,
    b: f64,
    nodes: &[f64],
    kronrod: &[f64],
    gauss: &[f64],
) -> Piece {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let last = nodes.len() - 1;
    let centre = f(middle);
    let (mut k, mut g) = (kronrod[last] * centre, 0.0);
    if last % 2 == 1 {
        g = gauss[last / 2] * centre;
    }
    let mut magnitude = kronrod[last] * centre.abs();
    for i in 0..last {
        let (low, high) = (f(middle - half * nodes[i]), f(middle + half * nodes[i]));
        k += kronrod[i] * (low + high);
        magnitude += kronrod[i] * (low.abs() + high.abs());
        if i % 2 == 1 {
            g += gauss[i / 2] * (low + high);
        }
    }
    let rounding = 4.0 * f64::EPSILON * magnitude * half.abs();
    Piece {
        a,
        b,
        value: k * half,
        error: ((k - g) * half).abs().max(rounding),
    }
}

/// Globally adaptive integration with one Kronrod pair.
fn adaptive(
    f: &mut dyn FnMut(f64) -> f64,
    a: f64,
    b: f64,
    [rel_tol, abs_tol]: [f64; 2],
    rule: (&[f64], &[f64], &[f64]),
) -> Estimate {
    let per_piece = 2 * rule.0.len() - 1;
    let mut pieces = vec![kronrod_pair(f, a, b, rule.0, rule.1, rule.2)];
    let mut evaluations = per_piece;
    loop {
        let value: f64 = pieces.iter().map(|p| p.value).sum();
        let error: f64 = pieces.iter().map(|p| p.error).sum();
        let worst = (0..pieces.len())
            .max_by(|&i, &j| pieces[i].error.total_cmp(&pieces[j].error))
            .unwrap_or(0);
        let Piece { a: lo, b: hi, .. } = pieces[worst];
        let middle = 0.5 * (lo + hi);
        let exhausted = pieces.len() >= MAX_PIECES || middle <= lo.min(hi) || middle >= lo.max(hi);
        if error <= abs_tol.max(rel_tol * value.abs())
            || error == 0.0
            || exhausted
            || !error.is_finite()
        {
            return Estimate {
                value,
                error,
                evaluations,
            };
        }
        pieces[worst] = kronrod_pair(f, lo, middle, rule.0, rule.1, rule.2);
        pieces.push(kronrod_pair(f, middle, hi, rule.0, rule.1, rule.2));
        evaluations += 2 * per_piece;
    }
}

/// ∫ₐᵇ f by globally adaptive Gauss–Kronrod 7/15, until the estimated error is below
/// `rel_tol`·|value|.
///
/// Bisects the piece of largest estimated error; the error of a piece is |K₁₅ − G₇|, a pessimistic
/// measure for smooth integrands. Stops at [`MAX_PIECES`] pieces or when a piece has no midpoint
/// left, and then reports the error it has. Jumps cost about 50 bisections each; split the interval
/// at known kinks when speed matters.
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

/// As [`gauss_kronrod`], until the estimated error is below `rel_tol`·|value| or below `abs_tol`:
/// for integrands that are small differences, whose rounding is not relative to themselves and
/// would be followed without end.
pub fn gauss_kronrod_to(
    mut f: impl FnMut(f64) -> f64,
    a: f64,
    b: f64,
    rel_tol: f64,
    abs_tol: f64,
) -> Estimate {
    let rule = (&NODES_15[..], &KRONROD_15[..], &GAUSS_7[..]);
    adaptive(&mut f, a, b, [rel_tol, abs_tol], rule)
}

/// As [`gauss_kronrod`] with the pair 15/31: fewer pieces for smooth, strongly curved or
/// oscillating integrands.
pub fn gauss_kronrod_31(mut f: impl FnMut(f64) -> f64, a: f64, b: f64, rel_tol: f64) -> Estimate {
    let rule = (&NODES_31[..], &KRONROD_31[..], &GAUSS_15[..]);
    adaptive(&mut f, a, b, [rel_tol, 0.0], rule)
}

/// ∬ f(x, y) dy dx over the rectangle `x` × `y` by nested adaptive Gauss–Kronrod 7/15.
///
/// The inner integrals run at a tenth of the tolerance. For smooth integrands; for integrands with
/// jumps along curves use [`cubature`], which is content with less.
pub fn gauss_kronrod_2d(
    mut f: impl FnMut(f64, f64) -> f64,
    x: [f64; 2],
    y: [f64; 2],
    rel_tol: f64,
) -> Estimate {
    let (mut inner_error, mut evaluations) = (0.0_f64, 0);
    let mut outer = gauss_kronrod(
        |u| {
            let line = gauss_kronrod(|v| f(u, v), y[0], y[1], 0.1 * rel_tol);
            inner_error = inner_error.max(line.error);
            evaluations += line.evaluations;
            line.value
        },
        x[0],
        x[1],
        rel_tol,
    );
    outer.error += inner_error * (x[1] - x[0]).abs();
    outer.evaluations = evaluations;
    outer
}

/// ∫ₐᵇ f by tanh–sinh (double-exponential) quadrature, for integrands with singular ends.
///
/// x = (a+b)/2 + (b−a)/2·tanh(π/2·sinh t); the step halves until two levels agree to `rel_tol`, or
/// at level 12. Non-finite values (at an end reached by rounding) count as zero. When the integrand
/// is singular at an end, its distance from the end is rounded with `x`: use [`tanh_sinh_ends`]
/// then.
///
/// Source: Takahasi, Mori, "Double exponential formulas for numerical integration" (1974).
pub fn tanh_sinh(mut f: impl FnMut(f64) -> f64, a: f64, b: f64, rel_tol: f64) -> Estimate {
    tanh_sinh_ends(|x, _| f(x), a, b, rel_tol)
}

/// As [`tanh_sinh`]; `f(x, d)` also gets the signed, exactly computed distance to the nearer end:
/// `d = x − a ≥ 0` in the left half, `d = x − b ≤ 0` in the right half, free of cancellation.
///
/// ```
/// use linelit_testkit::quadrature::tanh_sinh_ends;
/// let f = |_: f64, d: f64| if d > 0.0 { d.powf(-0.9) } else { (1.0 + d).powf(-0.9) };
/// let e = tanh_sinh_ends(f, 0.0, 1.0, 1e-12);
/// assert!((e.value - 10.0).abs() < 1e-10);
/// ```
pub fn tanh_sinh_ends(
    mut f: impl FnMut(f64, f64) -> f64,
    a: f64,
    b: f64,
    rel_tol: f64,
) -> Estimate {
    const FIRST_STEP: f64 = 0.5;
    /// At |t| = 6.1 the weight has fallen to e^-700, the smallest that is a normal number.
    const LIMIT: f64 = 6.1;
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut evaluations = 0;
    let mut term = |t: f64| {
        let u = std::f64::consts::FRAC_PI_2 * t.sinh().abs();
        // 1 − tanh u and 1/cosh² u, both through exp(−2u) so that they neither cancel nor overflow.
        let decay = (-2.0 * u).exp();
        let gap = half * 2.0 * decay / (1.0 + decay);
        let weight =
            std::f64::consts::FRAC_PI_2 * t.cosh() * 4.0 * decay / ((1.0 + decay) * (1.0 + decay));
        let (x, d) = if t == 0.0 {
            (middle, half)
        } else if t < 0.0 {
            (a + gap, gap)
        } else {
            (b - gap, -gap)
        };
        evaluations += 1;
        let y = f(x, d) * weight;
        if y.is_finite() { y } else { 0.0 }
    };
    let mut step = FIRST_STEP;
    let mut sum = term(0.0);
    let mut k = 1.0;
    while k * step <= LIMIT {
        sum += term(k * step) + term(-k * step);
        k += 1.0;
    }
    let mut value = sum * step * half;
    let mut error = f64::INFINITY;
    for level in 1..=12 {
        step *= 0.5;
        let mut k = 1.0;
        while k * step <= LIMIT {
            sum += term(k * step) + term(-k * step);
            k += 2.0;
        }
        let next = sum * step * half;
        error = (next - value).abs();
        value = next;
        if level >= 3 && error <= rel_tol * value.abs() {
            break;
        }
    }
    Estimate {
        value,
        error: error.max(4.0 * f64::EPSILON * value.abs()),
        evaluations,
    }
}

/// Nodes and weights of a Gauss rule on [−1, 1], nodes ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussRule {
    /// Where to evaluate.
    pub nodes: Vec<f64>,
    /// With which weight; they sum to 2.
    pub weights: Vec<f64>,
}

impl GaussRule {
    /// ∫ₐᵇ f with this rule.
    pub fn integrate(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        half * self
            .nodes
            .iter()
            .zip(&self.weights)
            .map(|(x, w)| w * f(middle + half * x))
            .sum::<f64>()
    }

    /// ∬ f over the rectangle `x` × `y` with the tensor product of this rule.
    pub fn integrate_2d(
        &self,
        x: [f64; 2],
        y: [f64; 2],
        mut f: impl FnMut(f64, f64) -> f64,
    ) -> f64 {
        self.integrate(x[0], x[1], |u| self.integrate(y[0], y[1], |v| f(u, v)))
    }
}

/// The Gauss–Legendre rule with `n ≥ 1` nodes: exact for polynomials up to degree 2n − 1.
///
/// Nodes are the roots of Pₙ by Newton's method from Tricomi's approximation; weights 2 / ((1 − x²)
/// Pₙ′(x)²). Nodes are good to an ulp or two, weights to about n·ε relative near the ends
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
        if 2 * i + 1 == n {
            x = 0.0;
            slope = count * legendre(n, x).1;
        }
        nodes[i] = -x;
        nodes[n - 1 - i] = x;
        weights[i] = 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope);
        weights[n - 1 - i] = weights[i];
    }
    GaussRule { nodes, weights }
}

/// (Pₙ(x), Pₙ₋₁(x)) by the three-term recurrence.
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

/// ∬ f over the rectangle `x` × `y` by adaptive quartering, for integrands that may jump along
/// curves.
///
/// A cell is done when a 4×4 Gauss rule on it and on its quarters differ by at most
/// `abs_tol`·2^−depth, or at `max_depth` quarterings. The reported error is the sum of those
/// differences: an overestimate for smooth integrands (where the quarters are far better than the
/// cell), a fair one along jumps.
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
        let quarters = [
            ([x[0], mx], [y[0], my]),
            ([mx, x[1]], [y[0], my]),
            ([x[0], mx], [my, y[1]]),
            ([mx, x[1]], [my, y[1]]),
        ];
        let values = quarters.map(|(qx, qy)| rule.integrate_2d(qx, qy, &mut f));
        total.evaluations += 64;
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

    /// The pairs are exact for monomials up to degree 3n + 1 (n Gauss nodes), and not beyond.
    #[test]
    fn kronrod_degrees() {
        for (nodes, kronrod, gauss, degree) in [
            (&NODES_15[..], &KRONROD_15[..], &GAUSS_7[..], 23),
            (&NODES_31[..], &KRONROD_31[..], &GAUSS_15[..], 47),
        ] {
            for d in 0..=degree {
                let piece = kronrod_pair(&mut |x| x.powi(d), 0.0, 1.0, nodes, kronrod, gauss);
                let want = 1.0 / (f64::from(d) + 1.0);
                assert!(
                    (piece.value - want).abs() <= 8.0 * f64::EPSILON * want.max(0.1),
                    "degree {d}: {}",
                    piece.value
                );
            }
            let too_far =
                kronrod_pair(&mut |x| x.powi(4 * degree), 0.0, 1.0, nodes, kronrod, gauss);
            assert!((too_far.value - 1.0 / (4.0 * f64::from(degree) + 1.0)).abs() > 1e-14);
        }
    }

    /// The embedded Gauss rules are the ones found by Newton's method.
    #[test]
    fn embedded_gauss_rules() {
        for (n, nodes, weights) in [
            (7, &NODES_15[..], &GAUSS_7[..]),
            (15, &NODES_31[..], &GAUSS_15[..]),
        ] {
            let rule = gauss_legendre(n);
            for (i, weight) in weights.iter().enumerate() {
                assert!((rule.nodes[i] + nodes[2 * i + 1]).abs() < 4.0 * f64::EPSILON);
                assert!((rule.weights[i] - weight).abs() < 1e-15 * 15.0);
            }
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
            for e in [
                gauss_kronrod(f, a, b, 1e-12),
                gauss_kronrod_31(f, a, b, 1e-12),
            ] {
                // The requested tolerance, plus a few rounding errors of the sum.
                assert!(
                    (e.value - want).abs() <= 1e-12 * want + 16.0 * f64::EPSILON,
                    "case {i}: {e:?}, want {want}"
                );
                assert!(
                    (e.value - want).abs() <= e.error + 16.0 * f64::EPSILON * want,
                    "case {i}: error estimate"
                );
            }
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
    fn tanh_sinh_singular_ends() {
        let e = tanh_sinh(|x| 1.0 / (x * (1.0 - x)).sqrt(), 0.0, 1.0, 1e-12);
        // The right end is rounded with x: mass √ε is lost there.
        assert!((e.value - PI).abs() < 4.0 * f64::EPSILON.sqrt());
        let exact = tanh_sinh_ends(
            |_, d| 1.0 / (d.abs() * (1.0 - d.abs())).sqrt(),
            0.0,
            1.0,
            1e-13,
        );
        assert!((exact.value - PI).abs() < 1e-12, "{exact:?}");
        let log = tanh_sinh(|x| x.ln(), 0.0, 1.0, 1e-13);
        assert!((log.value + 1.0).abs() < 1e-13, "{log:?}");
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
        let smooth = gauss_kronrod_2d(|x, y| (x * y).exp(), [0.0, 1.0], [0.0, 1.0], 1e-12);
        // Ei(1) − γ.
        assert!(
            (smooth.value - 1.317_902_151_454_404).abs() < 1e-12,
            "{smooth:?}"
        );
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
