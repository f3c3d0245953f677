//! This crate holds reflection models behind one trait, which also says which closed forms of
//! integrals are known for a reflection.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod facet_cosine;
mod fit;
mod fresnel;
mod frostbite;
mod lambert;
mod layers;
mod lobe;
pub mod microfacet;
mod peaks;
mod phong;
mod reflection;
mod reflector;
mod substrate;
#[cfg(test)]
mod tests;
mod transformed_cosine;

pub use fit::{LtcFit, minimise};
pub use fresnel::Fresnel;
pub use frostbite::Frostbite;
pub use lambert::{Lambert, OrenNayar};
pub use layers::Layers;
pub use lobe::Lobe;
pub use peaks::Peaks;
pub use phong::Phong;
pub use reflection::{ClosedForm, ClosedLobe, Known, Reflection};
pub use reflector::Reflector;
pub use substrate::Substrate;

// The geometry types appear in public signatures: with this export a caller needs one dependency.
pub use linelit_geometry as geometry;
pub use linelit_shading::ltc::{LtcLobe, LtcMixture};

use linelit_geometry::finite::{nonnegative, nonnegative_vector};
use linelit_geometry::{DVec3, Frame, Segment};
use std::f64::consts::{FRAC_1_PI, TAU};

/// A reflection of a surface, classified by what the estimators can do with it.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// A diffuse reflection, for which most integrals have closed forms.
    Lambert(Lambert),
    /// A diffuse reflection and a Phong lobe, with closed forms along lines and over polygons.
    Phong(Lambert, Phong),
    /// Any sum of lobes.
    Layers(Layers),
}

impl From<Layers> for Bsdf {
    /// Converts to the simplest variant that is the same reflection.
    #[inline]
    fn from(layers: Layers) -> Self {
        let lambert = Lambert {
            albedo: layers.diffuse(),
        };
        match layers.as_slice() {
            [] => Self::Lambert(lambert),
            [(scale, Lobe::Phong(phong))] => Self::Phong(
                lambert,
                Phong {
                    specular: phong.specular * scale,
                    ..*phong
                },
            ),
            _ => Self::Layers(layers),
        }
    }
}

impl Bsdf {
    /// Returns the fraction of the diffuse part in the albedo at normal incidence; `None` for
    /// black.
    fn diffuse_share(&self) -> Option<f64> {
        let (diffuse, glossy) = match self {
            Self::Lambert(lambert) => (lambert.albedo.element_sum(), 0.0),
            Self::Phong(lambert, phong) => {
                (lambert.albedo.element_sum(), phong.specular.element_sum())
            }
            Self::Layers(_) => return None,
        };
        let sum = diffuse + glossy;
        (sum > 0.0).then(|| diffuse / sum)
    }
}

impl Reflection for Bsdf {
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        match self {
            Self::Lambert(lambert) => lambert.value(),
            Self::Phong(lambert, phong) => {
                nonnegative_vector(lambert.value() + phong.value(Phong::axis(wo, n).dot(wi)))
            }
            Self::Layers(layers) => layers.eval(wi, wo, n),
        }
    }

    /// Draws ω_i: diffuse by the cosine, Phong's lobe by its power of the cosine about R, and
    /// microfacets by their visible normals. One of them is chosen with a probability about in
    /// proportion to its albedo, for which `u[0]` is split and rescaled. `None` for a black
    /// surface, and where a microfacet reflects into the surface.
    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        if let Self::Layers(layers) = self {
            return layers.sample(u, wo, n);
        }
        let share = self.diffuse_share()?;
        if u[0] < share {
            let u = [(u[0] / share).min(ONE_MINUS), u[1]];
            return numbers(about(n, (1.0 - u[0]).sqrt(), u[1]));
        }
        match self {
            Self::Phong(_, phong) => {
                let v = ((u[0] - share) / (1.0 - share)).min(ONE_MINUS);
                numbers(about(Phong::axis(wo, n), phong.sample_cosine(v), u[1]))
            }
            _ => None,
        }
    }

    /// Returns, for diffuse and Phong, α max(0, n·ω)/π + (1 − α) (k + 1)/(2π) max(0, R·ω)ᵏ, where α
    /// is the fraction of the diffuse part. For microfacets the integral is less than one, by the
    /// fraction that they reflect into the surface.
    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        if let Self::Layers(layers) = self {
            return layers.pdf(wi, wo, n);
        }
        let Some(share) = self.diffuse_share() else {
            return 0.0;
        };
        let diffuse = share * n.dot(wi).max(0.0) * FRAC_1_PI;
        nonnegative(match self {
            Self::Phong(_, phong) => {
                diffuse + (1.0 - share) * phong.pdf(Phong::axis(wo, n).dot(wi))
            }
            _ => diffuse,
        })
    }

    fn is_black(&self) -> bool {
        match self {
            Self::Lambert(lambert) => lambert.albedo == DVec3::ZERO,
            Self::Phong(lambert, phong) => {
                lambert.albedo == DVec3::ZERO && phong.specular == DVec3::ZERO
            }
            Self::Layers(layers) => layers.is_black(),
        }
    }

    fn known(&self, wo: DVec3, n: DVec3) -> Known<'_> {
        match self {
            Self::Lambert(diffuse) => Known::All(ClosedForm::new(*diffuse, &[])),
            Self::Phong(diffuse, lobe) => Known::All(ClosedForm::phong(*diffuse, lobe)),
            Self::Layers(layers) => match ClosedForm::layers(layers) {
                Some(form) => Known::All(form),
                None => Known::Cosines {
                    are_unlike: layers.is_unlike_cosines(wo, n),
                },
            },
        }
    }

    fn peaks(&self, line: &Segment, wo: DVec3, n: DVec3) -> Option<Peaks> {
        let mut peaks = Peaks::default();
        match self {
            Self::Lambert(_) => {}
            Self::Phong(_, phong) => peaks.add_power(line, Phong::axis(wo, n), phong.exponent),
            Self::Layers(layers) => layers.add_peaks(line, wo, n, &mut peaks),
        }
        Some(peaks)
    }

    fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> Option<LtcMixture> {
        match self {
            Self::Layers(layers) => Some(layers.transformed_cosines(wo, n)),
            Self::Lambert(_) | Self::Phong(..) => {
                let form = self.known(wo, n).closed_form()?;
                Some(form.transformed_cosines(wo, n))
            }
        }
    }
}

/// The largest number below one.
const ONE_MINUS: f64 = 1.0 - f64::EPSILON / 2.0;

/// Returns the direction at a cosine from `axis`, at the azimuth `turn` (in turns).
fn about(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (s, c) = linelit_elementary::sin_cos(TAU * turn);
    Frame::from_normal(axis).to_world(DVec3::new(sine * c, sine * s, cosine))
}

/// Returns the direction if it is finite, which it is unless the input was not a direction.
fn numbers(direction: DVec3) -> Option<DVec3> {
    direction.is_finite().then_some(direction)
}
