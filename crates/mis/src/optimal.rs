//! This module computes optimal weights for multiple importance sampling from a linear system
//! (Kondapaneni et al. 2019).

use crate::heuristics::{balance_density, finite, score};

/// Returns one sample's contribution wᵢf/(Nᵢpᵢ) under the optimal heuristic.
///
/// **Formula.** αᵢ/Nᵢ + (f − Σₖ αₖpₖ)/Σₖ Nₖpₖ: the balance estimator of f minus the control variate
/// Σ αₖpₖ, plus the integral of the variate. Sum it over all Nᵢ samples of all techniques. It is
/// defined where f = 0, too; α = 0 is the balance heuristic.
///
/// **Measure.** α is in the unit of the integral, and `ps` are in one measure. **Domain.** Every
/// technique with Nₖ > 0 must report its density; a technique with Nₖ = 0 is ignored. If no density
/// is positive (the sample cannot exist), or the result is not finite, it is 0.
///
/// **Reference.** Kondapaneni, Vévoda, Grittmann, Skřivan, Slusallek & Křivánek 2019, *Optimal
/// multiple importance sampling*, eqs. 13 and 14. The α that minimise variance solve the
/// [`OptimalSystem`]; any are unbiased.
///
/// # Panics
/// If `i` is not below T.
///
/// ```
/// use linelit_mis::optimal_contribution;
/// // f = 2 p₀: the optimal α are (2, 0), and each sample of technique 0 is exact.
/// assert_eq!(optimal_contribution(&[2.0, 0.0], &[1.0, 1.0], &[0.25, 4.0], 0.5, 0), 2.0);
/// assert_eq!(optimal_contribution(&[2.0, 0.0], &[1.0, 1.0], &[0.25, 4.0], 0.5, 1), 0.0);
/// ```
#[inline]
#[must_use]
pub fn optimal_contribution<const T: usize>(
    alphas: &[f64; T],
    ns: &[f64; T],
    ps: &[f64; T],
    f: f64,
    i: usize,
) -> f64 {
    let density = balance_density(ns, ps);
    if density <= 0.0 || !density.is_finite() || ns[i] <= 0.0 {
        return 0.0;
    }
    finite(alphas[i] / ns[i] + (f - control(alphas, ns, ps)) / density)
}

/// Returns Σₖ αₖpₖ over the techniques that take samples.
#[inline]
fn control<const T: usize>(alphas: &[f64; T], ns: &[f64; T], ps: &[f64; T]) -> f64 {
    (0..T)
        .filter(|&k| score(ns[k], ps[k]) > 0.0)
        .map(|k| alphas[k] * ps[k])
        .sum()
}

/// The linear system A α = b of the optimal heuristic, estimated from samples, for T techniques and
/// C colour channels.
///
/// **Formula.** Aᵢₖ = ∫ pᵢpₖ/Σⱼ Nⱼpⱼ, bᵢ = ∫ f pᵢ/Σⱼ Nⱼpⱼ (Kondapaneni et al. 2019, eqs. 10 to 12),
/// both estimated with the balance heuristic from the very samples of the estimator: with W = p/Σⱼ
/// Nⱼpⱼ each sample adds W Wᵀ to A and f W/Σⱼ Nⱼpⱼ to b (their Algorithm 1). At the solution the
/// integral is Σₖ αₖ.
///
/// ```
/// use linelit_mis::OptimalSystem;
/// // On [0, 1]: p₀ = 1, p₁ = 2x, f = 3 + 4x = 3 p₀ + 2 p₁, any sample points.
/// let mut system = OptimalSystem::<2, 1>::new();
/// for x in [0.1, 0.3, 0.8, 0.9] {
///     system.add(&[1.0, 1.0], &[1.0, 2.0 * x], [3.0 + 4.0 * x]);
/// }
/// let [[a, b]] = system.alphas();
/// assert!((a - 3.0).abs() < 1e-12 && (b - 2.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OptimalSystem<const T: usize, const C: usize> {
    a: [[f64; T]; T],
    b: [[f64; T]; C],
}

impl<const T: usize, const C: usize> Default for OptimalSystem<T, C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const T: usize, const C: usize> OptimalSystem<T, C> {
    /// Makes the empty system; its α are zero, which is the balance heuristic.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            a: [[0.0; T]; T],
            b: [[0.0; T]; C],
        }
    }

    /// Adds a sample of any technique, given the densities of all techniques there and the value of
    /// the integrand.
    ///
    /// A sample that no technique can draw, or whose numbers or their products are not finite, is
    /// ignored.
    pub fn add(&mut self, ns: &[f64; T], ps: &[f64; T], f: [f64; C]) {
        let density = balance_density(ns, ps);
        if density <= 0.0 || !density.is_finite() || !f.iter().all(|v| v.is_finite()) {
            return;
        }
        let w: [f64; T] = std::array::from_fn(|k| {
            if score(ns[k], ps[k]) > 0.0 {
                ps[k] / density
            } else {
                0.0
            }
        });
        // Bound the products below, up to a factor of the number of terms.
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let most = largest(&w);
        if !(most * most).is_finite() || !(largest(&f) / density * most).is_finite() {
            return;
        }
        for (row, wi) in self.a.iter_mut().zip(w) {
            for (entry, wk) in row.iter_mut().zip(w) {
                *entry += wi * wk;
            }
        }
        for (side, value) in self.b.iter_mut().zip(f) {
            for (entry, wi) in side.iter_mut().zip(w) {
                *entry += value / density * wi;
            }
        }
    }

    /// Adds the samples with f = 0 that [`OptimalSystem::add`] did not get, by their expectation,
    /// as if all of them were drawn where no other technique draws.
    ///
    /// **Formula.** Σₖ Nₖ Aᵢₖ = ∫ pᵢ is one. The samples of all techniques, `ns` on average, sum up
    /// to a part of this, and the rest is added as Aᵢᵢ = (1/Nᵢ) ∫ pᵢ. It depends neither on how
    /// many samples technique i had this time, nor on whether it had any.
    ///
    /// ```
    /// use linelit_mis::OptimalSystem;
    /// // Technique 1 seldom meets the light, whose value technique 0 knows.
    /// let mut system = OptimalSystem::<2, 1>::new();
    /// system.add(&[1.0, 1.0], &[4.0, 0.01], [8.0]);
    /// system.complete(&[1.0, 1.0]);
    /// let [[a, b]] = system.alphas();
    /// assert!((a - 2.0).abs() < 0.01 && b.abs() < 0.01);
    /// ```
    pub fn complete(&mut self, ns: &[f64; T]) {
        for (i, row) in self.a.iter_mut().enumerate() {
            let told: f64 = ns.iter().zip(&*row).map(|(&n, &a)| score(n, a)).sum();
            let whole = row[i] + (1.0 - told) / ns[i];
            if ns[i] > 0.0 && told < 1.0 && whole.is_finite() {
                row[i] = whole;
            }
        }
    }

    /// Adds the samples of another system with the same sample counts.
    pub fn merge(&mut self, other: &Self) {
        for (row, others) in self
            .a
            .iter_mut()
            .chain(&mut self.b)
            .zip(other.a.iter().chain(&other.b))
        {
            for (entry, value) in row.iter_mut().zip(others) {
                *entry += value;
            }
        }
    }

    /// Returns the coefficients α of each channel.
    ///
    /// **Method.** Cholesky factorisation with diagonal scaling and complete pivoting. If the
    /// scaled pivot of a technique is below √ε, the technique is a combination of the others as far
    /// as the samples can show (the system is a normal equation, which squares the condition), and
    /// it gets α = 0. Any α is unbiased, so that this affects only the variance. All α are 0 if one
    /// is not finite, which happens for sums of numbers near the largest.
    #[must_use]
    pub fn alphas(&self) -> [[f64; T]; C] {
        self.damped_alphas(0.0)
    }

    /// Returns [`alphas`](Self::alphas) with `ridge` ≥ 0 added to the scaled diagonal, whose
    /// entries are one. This pulls α towards zero, the balance heuristic, and the more so the less
    /// the samples determine α. The estimate is unbiased for any ridge. NaN and negative numbers
    /// count as 0.
    ///
    /// Each batch of samples may be weighted by the α of all before it (Algorithm 2). Undamped, α
    /// from few samples are so noisy that the early batches are *worse* than the balance heuristic.
    /// Measured on three techniques with six samples a batch, variance relative to balance after 2,
    /// 4, 16, 64, 256 batches: undamped 2.10, 1.83, 1.20, 1.04, 0.99; with a ridge of 3T/(samples
    /// so far) 1.00, 0.99, 0.99, 0.97, 0.97.
    #[must_use]
    pub fn damped_alphas(&self, ridge: f64) -> [[f64; T]; C] {
        let factor = Factor::new(&self.a, ridge.max(0.0));
        self.b.map(|side| {
            let alphas = factor.solve(&side);
            if alphas.iter().all(|a| a.is_finite()) {
                alphas
            } else {
                [0.0; T]
            }
        })
    }
}

/// A pivoted Cholesky factor of S A S with S = diag(A)^−½.
struct Factor<const T: usize> {
    scale: [f64; T],
    order: [usize; T],
    rank: usize,
    lower: [[f64; T]; T],
}

impl<const T: usize> Factor<T> {
    /// Factorises the scaled matrix A, with a ridge added to its diagonal.
    fn new(a: &[[f64; T]; T], ridge: f64) -> Self {
        // Scale the matrix to a diagonal of ones, and add the ridge.
        let scale: [f64; T] = std::array::from_fn(|k| {
            if a[k][k] > 0.0 {
                1.0 / a[k][k].sqrt()
            } else {
                0.0
            }
        });
        let mut m: [[f64; T]; T] =
            std::array::from_fn(|i| std::array::from_fn(|k| a[i][k] * scale[i] * scale[k]));
        for (k, row) in m.iter_mut().enumerate() {
            row[k] += if scale[k] > 0.0 { ridge } else { 0.0 };
        }
        // Factorise, with the largest remaining diagonal entry as the pivot.
        let mut order: [usize; T] = std::array::from_fn(|k| k);
        let mut lower = [[0.0; T]; T];
        let mut rank = 0;
        while rank < T {
            let pivot = (rank..T).fold(rank, |best, j| {
                if m[order[j]][order[j]] > m[order[best]][order[best]] {
                    j
                } else {
                    best
                }
            });
            order.swap(rank, pivot);
            let p = order[rank];
            if m[p][p] <= f64::EPSILON.sqrt() {
                break;
            }
            let root = m[p][p].sqrt();
            for &i in &order[rank..] {
                lower[i][rank] = m[i][p] / root;
            }
            for &i in &order[rank + 1..] {
                for &k in &order[rank + 1..] {
                    m[i][k] -= lower[i][rank] * lower[k][rank];
                }
            }
            rank += 1;
        }
        Self {
            scale,
            order,
            rank,
            lower,
        }
    }

    /// Solves the system by forward substitution and back substitution.
    fn solve(&self, b: &[f64; T]) -> [f64; T] {
        let mut y = [0.0; T];
        for r in 0..self.rank {
            let i = self.order[r];
            let known: f64 = (0..r).map(|c| self.lower[i][c] * y[c]).sum();
            y[r] = (b[i] * self.scale[i] - known) / self.lower[i][r];
        }
        let mut x = [0.0; T];
        for r in (0..self.rank).rev() {
            let known: f64 = (r + 1..self.rank)
                .map(|c| self.lower[self.order[c]][r] * x[self.order[c]])
                .sum();
            x[self.order[r]] = (y[r] - known) / self.lower[self.order[r]][r];
        }
        for (value, scale) in x.iter_mut().zip(self.scale) {
            *value *= scale;
        }
        x
    }
}
