//! This module holds the trait [`Reflection`], by which estimators use the reflection at a shading
//! point, and the types that describe its closed forms.

use crate::{Lambert, Layers, Lobe, LtcMixture, Peaks, Phong};
use linelit_geometry::{DVec3, Segment};

/// The reflection of a surface at one point: implement it for a BSDF of your own, and every
/// estimator works on it.
///
/// Directions are unit vectors in the world: ω_i points to the light, ω_o to the viewer, and n is
/// the shading normal on the viewer's side. Three methods are required. Estimators that integrate
/// over the reflection call [`known`](Self::known) and
/// [`transformed_cosines`](Self::transformed_cosines); if both return `Nothing` or `None`, they
/// sample points instead.
pub trait Reflection {
    /// Returns f(ω_i, ω_o) in 1/sr by channel, for ω_i above the surface; finite and not negative.
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3;

    /// Draws ω_i from two uniform random numbers in [0, 1). `None` where the draw fails; it counts
    /// as a sample without light.
    ///
    /// The direction may lie below the surface. It then contributes zero, and its density is still
    /// [`pdf`](Self::pdf).
    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3>;

    /// Returns the density of [`sample`](Self::sample) per solid angle. It integrates to one minus
    /// the fraction of draws that fail.
    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64;

    /// Whether no light is reflected in any direction. `false` is always allowed.
    fn is_black(&self) -> bool {
        false
    }

    /// Returns which closed forms are known for the reflection towards ω_o. The default,
    /// [`Known::Nothing`], is always allowed.
    fn known(&self, wo: DVec3, n: DVec3) -> Known<'_> {
        let _ = (wo, n);
        Known::Nothing
    }

    /// Returns the positions along a segment, given relative to the point, at which the reflection
    /// has a peak or a kink. Adaptive quadrature between them resolves the reflection, to 1e-6 if
    /// no kink is missing. `None`, the default, if the positions are not known: estimators then
    /// sample points of the segment.
    fn peaks(&self, line: &Segment, wo: DVec3, n: DVec3) -> Option<Peaks> {
        let _ = (line, wo, n);
        None
    }

    /// Returns an approximation of f cos towards ω_o by a sum of LTCs, by which lights are sampled
    /// and samples weighted (Peters 2021, section 4). Its accuracy affects only the noise. The
    /// default is the approximation of the closed form; `None` if there is none.
    fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> Option<LtcMixture> {
        let form = self.known(wo, n).closed_form()?;
        Some(form.transformed_cosines(wo, n))
    }
}

/// The closed forms that are known for a reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known<'a> {
    /// No closed form, and LTCs only if [`Reflection::transformed_cosines`] returns any; without
    /// them estimators sample points.
    Nothing,
    /// The whole reflection is a sum whose integrals over lines and polygons are known. If there
    /// are no lobes, its value is the value of the diffuse part in all directions above the
    /// surface.
    All(ClosedForm<'a>),
    /// [LTCs](Reflection::transformed_cosines) that approximate the reflection.
    Cosines {
        /// Whether samples by these LTCs alone would have rare and large values, since the
        /// reflection is large where they are almost zero: estimators then draw by
        /// [`Reflection::sample`], too. Among the reflections of this crate this holds for facets
        /// that are rough in one direction only: if they are seen from the side, the reflected
        /// light lies along a curve.
        are_unlike: bool,
    },
}

impl<'a> Known<'a> {
    /// Returns the sum whose integrals are known, if there is one.
    #[must_use]
    pub const fn closed_form(self) -> Option<ClosedForm<'a>> {
        match self {
            Self::All(form) => Some(form),
            Self::Nothing | Self::Cosines { .. } => None,
        }
    }

    /// Returns f in 1/sr by channel if it is the same for all directions above the surface.
    #[must_use]
    pub fn constant(self) -> Option<DVec3> {
        let form = self.closed_form().filter(|form| form.is_diffuse());
        form.map(|form| form.diffuse.value())
    }

    /// Whether samples by the LTCs alone would have rare and large values.
    #[must_use]
    pub const fn is_unlike_cosines(self) -> bool {
        matches!(self, Self::Cosines { are_unlike: true })
    }
}

/// A reflection whose integrals have closed forms: a diffuse part and any number of lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedForm<'a> {
    /// The diffuse part.
    pub diffuse: Lambert,
    lobes: Lobes<'a>,
}

/// The lobes of a [`ClosedForm`].
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lobes<'a> {
    Phong(&'a Phong),
    /// Layers whose lobes are all Phong lobes.
    Layers(&'a Layers),
    Own(&'a [ClosedLobe]),
}

/// One lobe of a reflection whose integral along a line is known. For a fixed viewer it is a
/// function of the direction ω to the light alone, on the part above the surface. It is reciprocal
/// only if its axis and its scale depend on the viewer accordingly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClosedLobe {
    /// A power of a cosine, scale · max(0, axis·ω)ᵏ: Phong's lobe, and Lafortune's about any
    /// direction. Its integral over polygons is known, too, at the cost of one line integral for
    /// each edge that meets the lobe (of two for exponents below some hundred).
    Power {
        /// The factor by channel, in 1/sr.
        scale: DVec3,
        /// The unit vector in the world where the lobe is largest.
        axis: DVec3,
        /// The exponent k ≥ 0.
        exponent: f64,
    },
    /// A spherical Gaussian, scale · exp(λ(axis·ω − 1)). Its integral is known along lines only.
    Gaussian {
        /// The factor by channel, in 1/sr.
        scale: DVec3,
        /// The unit vector in the world where the lobe is largest.
        axis: DVec3,
        /// The sharpness λ ≥ 0.
        sharpness: f64,
    },
}

impl ClosedLobe {
    /// Returns the factor of the lobe by channel, in 1/sr.
    #[must_use]
    pub const fn scale(&self) -> DVec3 {
        match self {
            Self::Power { scale, .. } | Self::Gaussian { scale, .. } => *scale,
        }
    }
}

impl<'a> ClosedForm<'a> {
    /// Makes a closed form of a diffuse part and lobes; there may be no lobes.
    #[must_use]
    pub const fn new(diffuse: Lambert, lobes: &'a [ClosedLobe]) -> Self {
        let lobes = Lobes::Own(lobes);
        Self { diffuse, lobes }
    }

    /// Makes a closed form of a diffuse part and a Phong lobe.
    #[must_use]
    pub const fn phong(diffuse: Lambert, lobe: &'a Phong) -> Self {
        let lobes = Lobes::Phong(lobe);
        Self { diffuse, lobes }
    }

    /// Makes the closed form of layers; `None` unless all lobes are Phong lobes.
    pub(crate) fn layers(layers: &'a Layers) -> Option<Self> {
        let closed = |(_, lobe): (DVec3, &Lobe)| matches!(lobe, Lobe::Phong(_));
        layers.lobes().all(closed).then_some(Self {
            diffuse: Lambert {
                albedo: layers.diffuse(),
            },
            lobes: Lobes::Layers(layers),
        })
    }

    /// Returns the lobes for a direction to the viewer and a normal.
    pub fn lobes(self, wo: DVec3, n: DVec3) -> impl Iterator<Item = ClosedLobe> + 'a {
        let phong = move |scale: DVec3, lobe: &Phong, axis: DVec3| ClosedLobe::Power {
            scale: scale * lobe.scale(),
            axis,
            exponent: lobe.exponent,
        };
        let at = move |i: usize| match self.lobes {
            Lobes::Phong(lobe) => (i == 0).then(|| phong(DVec3::ONE, lobe, Phong::axis(wo, n))),
            Lobes::Layers(layers) => match layers.lobes().nth(i)? {
                // Layers mirror a viewer below the horizon above it.
                (scale, Lobe::Phong(lobe)) if n.dot(wo) < 0.0 => Some(phong(scale, lobe, -wo)),
                (scale, Lobe::Phong(lobe)) => Some(phong(scale, lobe, Phong::axis(wo, n))),
                _ => None,
            },
            Lobes::Own(lobes) => lobes.get(i).copied(),
        };
        (0..).map_while(at)
    }

    /// Whether there is no lobe.
    #[must_use]
    pub fn is_diffuse(&self) -> bool {
        match self.lobes {
            Lobes::Phong(_) => false,
            Lobes::Layers(layers) => layers.lobes().next().is_none(),
            Lobes::Own(lobes) => lobes.is_empty(),
        }
    }
}
