//! This module holds Fresnel's factor: the fraction of light that an interface reflects.

use crate::microfacet::schlick;
use linelit_elementary::hypot;
use linelit_geometry::DVec3;
use linelit_geometry::finite::{fraction, nonnegative_vector};

/// The fraction of light that an interface reflects, by the cosine of incidence and by channel.
///
/// **Domain**: cosines in [0, 1] (others are clamped). **Range**: [0, 1]. **Source**: Lagarde 2013,
/// "Memo on Fresnel equations"; Schlick 1994.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fresnel {
    /// All light is reflected.
    Full,
    /// Schlick's approximation F0 + (F90 − F0)(1 − cos)⁵.
    Schlick {
        /// F0, the reflectance at normal incidence.
        f0: DVec3,
        /// F90, the reflectance at grazing incidence.
        f90: f64,
    },
    /// Unpolarised light at a dielectric.
    Dielectric {
        /// The index of refraction beyond the interface divided by the index in front of it. If it
        /// is below one, there is total reflection at grazing incidence.
        eta: f64,
    },
    /// Unpolarised light at a conductor.
    Conductor {
        /// The index of refraction relative to the outside.
        eta: DVec3,
        /// The absorption coefficient relative to the outside.
        k: DVec3,
    },
}

impl Fresnel {
    /// Returns the reflected fraction at a cosine of incidence.
    ///
    /// ```
    /// use linelit_bsdf::Fresnel;
    /// // ((1 − η)/(1 + η))² at normal incidence, everything at a grazing one.
    /// let glass = Fresnel::Dielectric { eta: 1.5 };
    /// assert!((glass.at(1.0).x - 0.04).abs() < 1e-15 && glass.at(0.0).x > 1.0 - 1e-15);
    /// ```
    #[must_use]
    pub fn at(&self, cosine: f64) -> DVec3 {
        let c = fraction(cosine);
        let share = match *self {
            Self::Full => DVec3::ONE,
            Self::Schlick { f0, f90 } => f0 + (DVec3::splat(f90) - f0) * schlick(c),
            Self::Dielectric { eta } => DVec3::splat(dielectric(c, eta)),
            Self::Conductor { eta, k } => DVec3::new(
                conductor(c, eta.x, k.x),
                conductor(c, eta.y, k.y),
                conductor(c, eta.z, k.z),
            ),
        };
        nonnegative_vector(share)
    }
}

/// Returns the reflectance ½ (r∥² + r⊥²) of a dielectric for unpolarised light, at the cosine of
/// incidence c, for the relative index of refraction η.
fn dielectric(c: f64, eta: f64) -> f64 {
    let sine_square = (1.0 - c) * (1.0 + c);
    let inside = (eta * eta - sine_square).max(0.0);
    if inside <= 0.0 {
        return 1.0;
    }
    // This is η times the cosine of the refracted direction.
    let g = inside.sqrt();
    let perpendicular = (c - g) / (c + g);
    let e2 = eta * eta;
    let parallel = (e2 * c - g) / (e2 * c + g);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Returns the reflectance ½ (r∥² + r⊥²) of a conductor for unpolarised light, at the cosine of
/// incidence c, for the relative index of refraction η and the absorption coefficient k.
fn conductor(c: f64, eta: f64, k: f64) -> f64 {
    let (c2, s2) = (c * c, (1.0 - c) * (1.0 + c));
    let difference = eta * eta - k * k - s2;
    // These are a² + b² and a of the complex refracted cosine a + ib, scaled.
    let modulus = hypot(difference, 2.0 * eta * k);
    let a = (0.5 * (modulus + difference)).max(0.0).sqrt();
    let cross = 2.0 * a * c;
    let perpendicular = ratio(modulus + c2, cross);
    let parallel = perpendicular * ratio(c2 * modulus + s2 * s2, cross * s2);
    0.5 * (parallel + perpendicular)
}

/// Returns (x − y)/(x + y) for 0 ≤ y ≤ x; one where both are zero.
fn ratio(x: f64, y: f64) -> f64 {
    let sum = x + y;
    if sum > 0.0 {
        ((x - y) / sum).max(0.0)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;

    /// Computes the reflectance in complex arithmetic, from Snell's law: an independent route.
    fn complex(c: f64, eta: f64, k: f64) -> f64 {
        type C = [f64; 2];
        let mul = |a: C, b: C| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
        let square = |a: C| a[0] * a[0] + a[1] * a[1];
        let m: C = [eta, -k];
        let m2 = mul(m, m);
        // √(m² − sin²), the root in the right half-plane.
        let w = [m2[0] - (1.0 - c * c), m2[1]];
        let r = w[0].hypot(w[1]).sqrt();
        let half = 0.5 * w[1].atan2(w[0]);
        let g = [r * half.cos(), r * half.sin()];
        let share =
            |p: C, q: C| square([p[0] - q[0], p[1] - q[1]]) / square([p[0] + q[0], p[1] + q[1]]);
        let perpendicular = share([c, 0.0], g);
        let parallel = share([m2[0] * c, m2[1] * c], g);
        0.5 * (perpendicular + parallel)
    }

    #[test]
    fn conductors_and_dielectrics_follow_snell() {
        for (eta, k) in [(0.2, 3.9), (1.66, 9.2), (4.4, 5.2), (1.5, 0.0), (1.0, 1e-3)] {
            for i in 1..=50 {
                let c = f64::from(i) / 50.0;
                let got = Fresnel::Conductor {
                    eta: DVec3::splat(eta),
                    k: DVec3::splat(k),
                };
                // Reflectances near zero come from differences of numbers of size one.
                let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b + 1e-14;
                let want = complex(c, eta, k);
                assert!(near(got.at(c).y, want), "{eta} {k} {c}");
                if k <= 0.0 {
                    assert!(near(Fresnel::Dielectric { eta }.at(c).x, want), "{eta} {c}");
                }
            }
        }
    }

    #[test]
    fn total_reflection_beyond_the_critical_angle() {
        let out = Fresnel::Dielectric { eta: 1.0 / 1.5 };
        let critical = (1.0f64 - 1.0 / 2.25).sqrt();
        assert_close!(out.at(critical - 1e-9).x, 1.0, rel = 1e-15, "total");
        assert!(out.at(critical + 1e-3).x < 0.95);
        assert_close!(out.at(1.0).x, 0.04, rel = 1e-14, "the same from both sides");
    }

    #[test]
    fn stays_between_nothing_and_all() {
        let mut all = vec![Fresnel::Full];
        for f in [0.0, 1e-8, 0.04, 0.999, 1.0, 1.5, 100.0, 1e8] {
            let v = DVec3::splat(f);
            all.push(Fresnel::Schlick {
                f0: v.min(DVec3::ONE),
                f90: 1.0,
            });
            all.push(Fresnel::Dielectric { eta: f });
            for k in [0.0, 1e-8, 1.0, 1e8] {
                all.push(Fresnel::Conductor {
                    eta: v,
                    k: DVec3::splat(k),
                });
            }
        }
        for f in all {
            for c in [-1.0, 0.0, 1e-300, 1e-9, 0.1, 0.5, 1.0 - 1e-16, 1.0, 2.0] {
                let r = f.at(c).x;
                assert!((0.0..=1.0).contains(&r), "{f:?} at {c}: {r}");
            }
        }
    }
}
