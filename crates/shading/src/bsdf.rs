//! Reflection at a surface.

use linelit_geometry::{DVec3, Frame};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// A diffuse surface: f = k_d/π.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Albedo k_d, by channel.
    pub albedo: DVec3,
}

impl Lambert {
    /// The constant value k_d/π, 1/sr.
    #[must_use]
    pub fn value(&self) -> DVec3 {
        self.albedo * FRAC_1_PI
    }
}

/// The modified Phong lobe f = k_s (k + 2)/(2π) max(0, ω_i·R)ᵏ about the mirror direction R.
///
/// **Source**: Billen & Dutré 2016, eq. 9 (Lafortune & Willems 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// k_s, by channel: the albedo at normal incidence.
    pub specular: DVec3,
    /// The exponent k ≥ 0.
    pub exponent: f64,
}

impl Phong {
    /// The mirror direction R of the direction `wo` to the viewer.
    #[must_use]
    pub fn axis(wo: DVec3, n: DVec3) -> DVec3 {
        n * (2.0 * n.dot(wo)) - wo
    }

    /// k_s (k + 2)/(2π).
    #[must_use]
    pub fn scale(&self) -> DVec3 {
        self.specular * ((self.exponent + 2.0) / (2.0 * PI))
    }
}

/// Reflection of a surface, as what the estimators can do with it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Bsdf {
    /// Diffuse.
    Lambert(Lambert),
    /// Diffuse and a Phong lobe.
    Phong(Lambert, Phong),
}

impl Bsdf {
    /// f(ω_i, ω_o) in 1/sr, for unit directions on the side of the normal `n`.
    #[must_use]
    pub fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        match self {
            Self::Lambert(lambert) => lambert.value(),
            Self::Phong(lambert, phong) => {
                let cosine = Phong::axis(wo, n).dot(wi).max(0.0);
                lambert.value() + phong.scale() * cosine.powf(phong.exponent)
            }
        }
    }

    /// Draws ω_i: diffuse by the cosine, the lobe by its power of the cosine about R; one of them,
    /// with a probability in proportion to its albedo, for which `u[0]` is split and rescaled.
    /// `None` for a black surface.
    ///
    /// The direction may lie below the surface (where the lobe sinks into it): its density is right,
    /// and it contributes nothing.
    #[must_use]
    pub fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        let share = self.diffuse_share()?;
        if u[0] < share {
            let u = [(u[0] / share).min(ONE_MINUS), u[1]];
            return Some(about(n, (1.0 - u[0]).sqrt(), u[1]));
        }
        match self {
            Self::Lambert(_) => None,
            Self::Phong(_, phong) => {
                let v = ((u[0] - share) / (1.0 - share)).min(ONE_MINUS);
                let cosine = (1.0 - v).powf(1.0 / (phong.exponent + 1.0));
                Some(about(Phong::axis(wo, n), cosine, u[1]))
            }
        }
    }

    /// The density of [`Bsdf::sample`], per solid angle:
    /// α max(0, n·ω)/π + (1 − α) (k + 1)/(2π) max(0, R·ω)ᵏ with the share α of the diffuse part.
    #[must_use]
    pub fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        let Some(share) = self.diffuse_share() else {
            return 0.0;
        };
        let diffuse = share * n.dot(wi).max(0.0) * FRAC_1_PI;
        match self {
            Self::Lambert(_) => diffuse,
            Self::Phong(_, phong) => {
                let cosine = Phong::axis(wo, n).dot(wi);
                if cosine <= 0.0 {
                    return diffuse;
                }
                let k = phong.exponent;
                diffuse + (1.0 - share) * (k + 1.0) / TAU * cosine.powf(k)
            }
        }
    }

    /// The share of the diffuse part in the albedo at normal incidence; `None` for black.
    fn diffuse_share(&self) -> Option<f64> {
        let (diffuse, glossy) = match self {
            Self::Lambert(lambert) => (lambert.albedo.element_sum(), 0.0),
            Self::Phong(lambert, phong) => {
                (lambert.albedo.element_sum(), phong.specular.element_sum())
            }
        };
        let sum = diffuse + glossy;
        (sum > 0.0).then(|| diffuse / sum)
    }

    /// Whether it reflects nothing.
    #[must_use]
    pub fn is_black(&self) -> bool {
        match self {
            Self::Lambert(lambert) => lambert.albedo == DVec3::ZERO,
            Self::Phong(lambert, phong) => {
                lambert.albedo == DVec3::ZERO && phong.specular == DVec3::ZERO
            }
        }
    }
}

/// The largest number below one.
const ONE_MINUS: f64 = 1.0 - f64::EPSILON / 2.0;

/// The direction at a cosine from `axis`, at the azimuth `turn` (in turns).
fn about(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (s, c) = (TAU * turn).sin_cos();
    Frame::from_normal(axis).to_world(DVec3::new(sine * c, sine * s, cosine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::{chi2, rng::SplitMix64};

    /// χ² of 200 000 directions on a grid of (cos θ, φ) over the whole sphere against midpoints of
    /// the density in each cell, at a family-wise level of 1e-3 over the cases.
    #[test]
    fn samples_follow_their_density() {
        const CELLS: [u32; 2] = [24, 16];
        const COUNT: u32 = 200_000;
        let cases = [(0.0, 1.0), (1.0, 0.0), (3.5, 0.5), (20.0, 0.7), (0.0, 0.4)];
        let alpha = chi2::sidak(1e-3, cases.len());
        let n = DVec3::new(0.3, -0.5, 0.8).normalize();
        let frame = Frame::from_normal(n);
        let wo = (n + 0.6 * frame.x).normalize();
        for (k, (exponent, diffuse)) in cases.into_iter().enumerate() {
            let bsdf = Bsdf::Phong(
                Lambert {
                    albedo: DVec3::splat(diffuse),
                },
                Phong {
                    specular: DVec3::splat(1.0 - diffuse),
                    exponent,
                },
            );
            let mut random = SplitMix64::new(k as u64);
            let mut observed = vec![0u64; (CELLS[0] * CELLS[1]) as usize];
            for _ in 0..COUNT {
                let u = [random.next_f64(), random.next_f64()];
                let w = frame.to_local(bsdf.sample(u, wo, n).expect("not black"));
                let turn = (w.y.atan2(w.x) / TAU).rem_euclid(1.0);
                let at = |v: f64, cells: u32| {
                    #[allow(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "a cell"
                    )]
                    let cell = (v * f64::from(cells)) as usize;
                    cell.min(cells as usize - 1)
                };
                observed
                    [at(0.5 * (w.z + 1.0), CELLS[0]) * CELLS[1] as usize + at(turn, CELLS[1])] += 1;
            }
            let fine = 24u32;
            let mut expected = Vec::new();
            for cell in 0..CELLS[0] * CELLS[1] {
                let (i, j) = (cell / CELLS[1], cell % CELLS[1]);
                let mut sum = 0.0;
                for a in 0..fine * fine {
                    let place = |c: u32, s: u32, cells: u32| {
                        (f64::from(c) + (f64::from(s) + 0.5) / f64::from(fine)) / f64::from(cells)
                    };
                    let z = 2.0 * place(i, a / fine, CELLS[0]) - 1.0;
                    let w = about(DVec3::Z, z, place(j, a % fine, CELLS[1]));
                    sum += bsdf.pdf(frame.to_world(w), wo, n);
                }
                let area = 2.0 * TAU / f64::from(CELLS[0] * CELLS[1]);
                expected.push(f64::from(COUNT) * area * sum / f64::from(fine * fine));
            }
            // The density integrates to one over the sphere: midpoints of a density with kinks at
            // the horizons are off by the square of a cell's 1/24 at most.
            let total = expected.iter().sum::<f64>() / f64::from(COUNT);
            assert!((total - 1.0).abs() < 2e-3, "{exponent}: {total}");
            let test = chi2::chi2_test(&observed, &expected, 5.0);
            assert!(
                test.p_value > alpha,
                "{exponent}, {diffuse}: p = {}",
                test.p_value
            );
        }
    }

    #[test]
    fn black_is_not_sampled() {
        let black = Bsdf::Lambert(Lambert {
            albedo: DVec3::ZERO,
        });
        assert!(black.sample([0.5; 2], DVec3::Z, DVec3::Z).is_none());
        assert!(black.pdf(DVec3::Z, DVec3::Z, DVec3::Z) <= 0.0);
    }
}
