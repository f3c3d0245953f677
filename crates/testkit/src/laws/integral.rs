//! The laws of a closed form: it agrees with quadrature, and its parts add up.

use super::technique::masses_2d;
use super::{Broken, Surface};
use crate::quadrature::gauss_kronrod_to;

/// A check of the laws of a closed form of an integral; create it by [`Integral::new`] and its
/// setter.
///
/// ```
/// use linelit_testkit::laws::{Integral, surface};
/// // ∫ cos x dx = sin b − sin a, of either sign.
/// Integral::new("sine").check_1d([0.3, 4.0], |a, b| b.sin() - a.sin(), f64::cos);
/// let off = |a: f64, b: f64| b.sin() - 1.001 * a.sin();
/// assert!(Integral::new("sine").try_1d([0.3, 4.0], off, f64::cos).is_err());
///
/// // ∫ z dω over the hemisphere = π.
/// Integral::new("cosine").check_2d(&surface::hemisphere(), std::f64::consts::PI, |w| w[2]);
/// ```
#[derive(Clone, Debug)]
pub struct Integral {
    name: String,
    tolerance: f64,
}

/// The measurements of a check that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// The integral by the closed form.
    pub closed: f64,
    /// The integral by quadrature.
    pub quadrature: f64,
    /// The quadrature's own estimate of its error.
    pub error: f64,
}

/// The relative error to which quadrature integrates, as a fraction of the integral of the
/// magnitude.
const QUADRATURE: f64 = 1e-13;

/// The number of parts that a domain is cut into.
const PARTS: u32 = 7;

impl Integral {
    /// Creates a check with a tolerance of 10⁻¹² of the integral of the magnitude.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            tolerance: 1e-12,
        }
    }

    /// Sets the tolerance of the closed form against quadrature, in addition to the quadrature's
    /// own error, and of the whole against the sum of its parts. It is relative to the integral of
    /// the magnitude, and allows for the rounding of the closed form's arguments.
    #[must_use]
    pub fn tolerance(mut self, relative: f64) -> Self {
        self.tolerance = relative;
        self
    }

    /// Checks a closed form on an interval; see [`Integral::try_1d`].
    ///
    /// # Panics
    /// If a law is broken.
    pub fn check_1d(
        &self,
        domain: [f64; 2],
        closed: impl FnMut(f64, f64) -> f64,
        integrand: impl FnMut(f64) -> f64,
    ) -> Agreement {
        self.try_1d(domain, closed, integrand)
            .unwrap_or_else(|broken| panic!("{broken}"))
    }

    /// Checks the laws as [`Integral::check_1d`] does, and returns a broken one.
    ///
    /// The laws of `closed(a, b)`, the integral of `integrand` from a to b: over the whole domain
    /// and over each of seven parts it agrees with adaptive Gauss–Kronrod quadrature, the parts sum
    /// to the whole, and over an empty interval it is zero.
    ///
    /// # Errors
    /// The first broken law.
    pub fn try_1d(
        &self,
        [a, b]: [f64; 2],
        mut closed: impl FnMut(f64, f64) -> f64,
        mut integrand: impl FnMut(f64) -> f64,
    ) -> Result<Agreement, Broken> {
        // Compare with quadrature, to a tolerance relative to the integral of the magnitude.
        let magnitude = gauss_kronrod_to(|x| integrand(x).abs(), a, b, 1e-9, 0.0)
            .value
            .abs();
        let allowed = self.tolerance * magnitude;
        let mut held = |a: f64, b: f64| {
            let numeric =
                gauss_kronrod_to(&mut integrand, a, b, QUADRATURE, QUADRATURE * magnitude);
            let agreement = Agreement {
                closed: closed(a, b),
                quadrature: numeric.value,
                error: numeric.error,
            };
            self.agrees(agreement, allowed, || format!("over [{a:?}, {b:?}]"))
                .map(|()| agreement)
        };
        // Compare the whole and each part, and sum the parts.
        let whole = held(a, b)?;
        let cut = |i: u32| a + (b - a) * (f64::from(i) / f64::from(PARTS));
        let mut sum = 0.0;
        for i in 0..PARTS {
            let last = if i + 1 == PARTS { b } else { cut(i + 1) };
            sum += held(cut(i), last)?.closed;
        }
        if (sum - whole.closed).abs() > allowed {
            return self.broken(format!("the parts sum to {sum:?}, not {:?}", whole.closed));
        }
        // Integrate over an empty interval.
        let nothing = closed(b, b);
        if nothing.is_nan() || nothing.abs() > allowed {
            return self.broken(format!("over nothing it is {nothing:?}"));
        }
        Ok(whole)
    }

    /// Checks a closed form over a surface; see [`Integral::try_2d`].
    ///
    /// # Panics
    /// If the law is broken.
    pub fn check_2d<P, L>(
        &self,
        surface: &Surface<P, L>,
        closed: f64,
        integrand: impl FnMut([f64; 3]) -> f64,
    ) -> Agreement
    where
        P: Fn([f64; 2]) -> ([f64; 3], f64),
    {
        self.try_2d(surface, closed, integrand)
            .unwrap_or_else(|broken| panic!("{broken}"))
    }

    /// Checks the law as [`Integral::check_2d`] does, and returns it if it is broken.
    ///
    /// The law of `closed`, the integral of `integrand` over the surface: it agrees with the
    /// Gauss–Legendre rule of 12 × 12 nodes in 16 × 16 cells, whose error is estimated by the
    /// difference from the rule of 8 × 8 nodes.
    ///
    /// # Errors
    /// If it is broken.
    pub fn try_2d<P, L>(
        &self,
        surface: &Surface<P, L>,
        closed: f64,
        integrand: impl FnMut([f64; 3]) -> f64,
    ) -> Result<Agreement, Broken>
    where
        P: Fn([f64; 2]) -> ([f64; 3], f64),
    {
        let (masses, error) = masses_2d(surface, 16, integrand);
        let magnitude: f64 = masses.iter().map(|m| m.abs()).sum();
        let agreement = Agreement {
            closed,
            quadrature: masses.iter().sum(),
            error,
        };
        self.agrees(agreement, self.tolerance * magnitude, || {
            "over the surface".into()
        })?;
        Ok(agreement)
    }

    /// Checks an agreement against a tolerance; `place` describes the domain.
    fn agrees(
        &self,
        Agreement {
            closed,
            quadrature,
            error,
        }: Agreement,
        allowed: f64,
        place: impl Fn() -> String,
    ) -> Result<(), Broken> {
        let apart = (closed - quadrature).abs();
        if apart.is_nan() || apart > allowed + error {
            return self.broken(format!(
                "{closed:?} {}, where quadrature finds {quadrature:?} ± {error:.1e}: {apart:.1e} apart, {allowed:.1e} allowed",
                place()
            ));
        }
        // If quadrature cannot follow the integrand, its large error must not allow any closed
        // form.
        if error > allowed.max(1e-3 * closed.abs()) {
            return self.broken(format!(
                "quadrature {} is off by {error:.1e} itself",
                place()
            ));
        }
        Ok(())
    }

    /// Returns the error of a broken law.
    fn broken<T>(&self, story: String) -> Result<T, Broken> {
        Err(Broken {
            message: format!("{}: {story}", self.name),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface;
    use super::*;

    fn cubic() -> Integral {
        Integral::new("cubic")
    }

    #[test]
    fn closed_forms_agree() {
        let found = cubic().check_1d(
            [-1.0, 2.0],
            |a, b| (b.powi(4) - a.powi(4)) / 4.0,
            |x| x.powi(3),
        );
        assert!((found.closed - 3.75).abs() < 1e-15);
        // The moment of a triangle: its area, ½, times its mean x, 1/3.
        let triangle = surface::triangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        cubic().check_2d(&triangle, 1.0 / 6.0, |p| p[0]);
        let skew = surface::parallelogram([1.0; 3], [2.0, 0.0, 0.0], [1.0, 3.0, 0.0]);
        cubic().check_2d(&skew, 6.0, |_| 1.0);
    }

    #[test]
    fn wrong_forms_are_seen() {
        let story = |closed: fn(f64, f64) -> f64| {
            let broken = cubic().try_1d([-1.0, 2.0], closed, |x| x.powi(3));
            broken.unwrap_err().message
        };
        // A relative error of 4·10⁻¹¹; a form that is right only over the whole domain; a form that
        // is right except over an empty interval.
        assert!(story(|a, b| (b.powi(4) - a.powi(4)) * (0.25 + 1e-11)).contains("apart"));
        let whole_only = |a: f64, b: f64| if b - a > 2.9 { 3.75 } else { 0.0 };
        assert!(story(whole_only).contains("apart"));
        let nothing = |a: f64, b: f64| {
            if a < b {
                (b.powi(4) - a.powi(4)) / 4.0
            } else {
                f64::NAN
            }
        };
        assert!(story(nothing).contains("nothing"));
        let triangle = surface::triangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(cubic().try_2d(&triangle, 0.166_666, |p| p[0]).is_err());
        // A jump that quadrature has not found is not accepted either.
        assert!(
            cubic()
                .try_2d(&triangle, 0.25, |p| f64::from(p[0] > 0.3))
                .is_err()
        );
    }
}
