//! What an estimator asks of the reflection at a shading point.

use crate::{Lambert, Layers, Lobe, Peaks, Phong, TransformedCosines};
use linelit_geometry::{DVec3, Segment};

/// The reflection of a surface at one point: implement it for a BSDF of your own, and every
/// estimator works on it.
///
/// Directions are unit vectors in the world: ω_i to the light, ω_o to the viewer, n the shading
/// normal on the viewer's side. Three methods are needed. Estimators that integrate over the
/// reflection ask what is [`known`](Self::known) of it, and for its
/// [transformed cosines](Self::transformed_cosines); given neither, they take points instead.
pub trait Reflection {
    /// f(ω_i, ω_o) in 1/sr by channel, for ω_i above the surface. Finite and not negative.
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3;

    /// Draws ω_i from two uniform numbers in [0, 1). `None` where the draw fails: it counts as a
    /// sample of no light.
    ///
    /// The direction may lie below the surface: it then contributes nothing, and its density is
    /// still that of [`pdf`](Self::pdf).
    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3>;

    /// The density of [`sample`](Self::sample) per solid angle; integrates to one less the share of
    /// draws that fail.
    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64;

    /// Whether nothing is reflected in any direction. `false` is always allowed.
    fn is_black(&self) -> bool {
        false
    }

    /// Returns what closed forms know of the reflection for light that goes to ω_o:
    /// [`Known::Nothing`], the default, is always allowed.
    fn known(&self, wo: DVec3, n: DVec3) -> Known<'_> {
        let _ = (wo, n);
        Known::Nothing
    }

    /// Returns the places along a segment, given relative to the point, where the reflection peaks
    /// or has a kink: between them adaptive quadrature resolves it, to 1e-6 if no kink is left out.
    /// `None`, the default, if that is not known: estimators then take points of the segment.
    fn peaks(&self, line: &Segment, wo: DVec3, n: DVec3) -> Option<Peaks> {
        let _ = (line, wo, n);
        None
    }

    /// About f cos for light that goes to ω_o as a sum of linearly transformed cosines, by which
    /// lights are sampled and samples weighed (Peters 2021, section 4). Only noise depends on it:
    /// the default is that of the closed form; `None` if nothing is known.
    fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> Option<TransformedCosines> {
        let form = self.known(wo, n).closed_form()?;
        Some(form.transformed_cosines(wo, n))
    }
}

/// The knowledge that integrals in closed form have of a reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known<'a> {
    /// Nothing but its transformed cosines, if it gives any: without, estimators take points.
    Nothing,
    /// All of it: a sum whose integrals over lines and polygons are known. Without lobes the value
    /// is that of its diffuse part in all directions above the surface.
    All(ClosedForm<'a>),
    /// [Transformed cosines](Reflection::transformed_cosines) that look like it.
    Cosines {
        /// Whether samples by these cosines alone would have rare and large values, since the
        /// reflection has much where they are next to nothing: estimators then draw by
        /// [`Reflection::sample`], too. Of this crate's reflections, that of facets that are rough
        /// in one direction alone: seen from beside it, its light lies along a curve.
        are_unlike: bool,
    },
}

impl<'a> Known<'a> {
    /// The sum whose integrals are known, if there is one.
    #[must_use]
    pub const fn closed_form(self) -> Option<ClosedForm<'a>> {
        match self {
            Self::All(form) => Some(form),
            Self::Nothing | Self::Cosines { .. } => None,
        }
    }

    /// f in 1/sr by channel, where it is the same for all directions above the surface.
    #[must_use]
    pub fn constant(self) -> Option<DVec3> {
        let form = self.closed_form().filter(|form| form.is_diffuse());
        form.map(|form| form.diffuse.value())
    }

    /// Whether the reflection is unlike its transformed cosines.
    #[must_use]
    pub const fn is_unlike_cosines(self) -> bool {
        matches!(self, Self::Cosines { are_unlike: true })
    }
}

/// A reflection that integrals in closed form know: diffuse, and any number of lobes.
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
    /// Layers whose lobes are all Phong's.
    Layers(&'a Layers),
    Own(&'a [ClosedLobe]),
}

/// One lobe of a reflection whose integral along a line is known: a function of the direction ω to
/// the light alone, the viewer being where it is, on the part of it above the surface. Reciprocal
/// only if its axis and scale follow the viewer so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClosedLobe {
    /// scale · max(0, axis·ω)ᵏ: Phong's, and Lafortune's about any direction. Known over polygons,
    /// too, at the cost of a line for each edge that the lobe meets (of two below an exponent of
    /// some hundred).
    Power {
        /// The factor by channel, 1/sr.
        scale: DVec3,
        /// The unit vector in the world where the lobe is largest.
        axis: DVec3,
        /// k ≥ 0.
        exponent: f64,
    },
    /// A spherical Gaussian, scale · exp(λ(axis·ω − 1)): known along lines alone.
    Gaussian {
        /// The factor by channel, 1/sr.
        scale: DVec3,
        /// The unit vector in the world where the lobe is largest.
        axis: DVec3,
        /// λ ≥ 0.
        sharpness: f64,
    },
}

impl ClosedLobe {
    /// Returns the factor of the lobe's function of the direction, by channel, 1/sr.
    #[must_use]
    pub const fn scale(&self) -> DVec3 {
        match self {
            Self::Power { scale, .. } | Self::Gaussian { scale, .. } => *scale,
        }
    }
}

impl<'a> ClosedForm<'a> {
    /// A diffuse part and lobes, which may be none.
    #[must_use]
    pub const fn new(diffuse: Lambert, lobes: &'a [ClosedLobe]) -> Self {
        let lobes = Lobes::Own(lobes);
        Self { diffuse, lobes }
    }

    /// Diffuse and Phong's lobe.
    #[must_use]
    pub const fn phong(diffuse: Lambert, lobe: &'a Phong) -> Self {
        let lobes = Lobes::Phong(lobe);
        Self { diffuse, lobes }
    }

    /// `None` unless all lobes are Phong's.
    pub(crate) fn layers(layers: &'a Layers) -> Option<Self> {
        let closed = |(_, lobe): (DVec3, &Lobe)| matches!(lobe, Lobe::Phong(_));
        layers.lobes().all(closed).then_some(Self {
            diffuse: Lambert {
                albedo: layers.diffuse(),
            },
            lobes: Lobes::Layers(layers),
        })
    }

    /// The lobes for a direction to the viewer and a normal.
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
