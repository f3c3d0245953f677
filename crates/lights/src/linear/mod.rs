//! This module holds the techniques for linear lights: thin cylinders that are given by radiance ×
//! radius (Peters 2021).
//!
//! Start with [`LinearSampler`]: choose a [`LinearTechnique`], set it up once per light and shading
//! point, and then take samples. The kernels behind it are [`LineView`] and [`ProjectedLine`].
//!
//! Densities are per solid angle and times the radius, [`ThinSolidAngle`], in m/sr, so that for a
//! light of radiance × radius `LR` the estimate of reflected radiance is `LR · f_r · (n·ω)/pdf`.

mod batch;
mod bisection;
mod lobes;
mod ltc;
mod numbers;
mod projected;
mod view;
mod warps;

pub use lobes::SegmentLtc;
pub use ltc::LtcSampler;
pub use projected::{ProjectedLine, ThinLine};
pub use view::{ArcPoint, LineView};

use crate::LinearPointTechnique;
use crate::density::{Length, Pdf, ThinSolidAngle};
pub use crate::samples::LinearSample;
use batch::{BLOCK, Batch};
use bisection::LineIntegral;
use linelit_geometry::finite::below_one;
use linelit_geometry::{DVec3, Segment, predicates};
use numbers::Bounds;
use projected::Inversion;
use warps::Warp;

/// The techniques that sample a linear light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LinearTechnique {
    /// The samples are uniform along the line.
    Area,
    /// The samples are uniform in solid angle, also below the horizon.
    SolidAngle,
    /// The samples are uniform in the solid angle above the horizon.
    ClippedSolidAngle,
    /// Clipped solid angle with a linear warp of the random number (Hart et al. 2020).
    LinearCosine,
    /// Clipped solid angle with a quadratic warp (Hart et al. 2020).
    QuadraticCosine,
    /// Projected solid angle by Newton–bisection (Li et al. 2018).
    NewtonBisection,
    /// Projected solid angle (Peters 2021, algorithms 1 and 2, in the cancellation-free form).
    ProjectedSolidAngle,
}

impl LinearTechnique {
    /// All techniques, in the order of Peters 2021, Table 1.
    pub const ALL: [Self; 7] = [
        Self::Area,
        Self::SolidAngle,
        Self::ClippedSolidAngle,
        Self::LinearCosine,
        Self::QuadraticCosine,
        Self::NewtonBisection,
        Self::ProjectedSolidAngle,
    ];

    /// Returns a short name in kebab case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::SolidAngle => "solid-angle",
            Self::ClippedSolidAngle => "clipped-solid-angle",
            Self::LinearCosine => "linear-cosine",
            Self::QuadraticCosine => "quadratic-cosine",
            Self::NewtonBisection => "newton-bisection",
            Self::ProjectedSolidAngle => "projected-solid-angle",
        }
    }
}

/// The set-up of each technique; several techniques share the solid angle.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Area,
    SolidAngle,
    Warped(Warp),
    Bisection(LineIntegral),
    Projected(Inversion),
}

/// One technique set up for one linear light and one shading point.
///
/// ```
/// use linelit_lights::geometry::{DVec3, Segment};
/// use linelit_lights::LinearPointTechnique;
/// use linelit_lights::linear::{LinearSampler, LinearTechnique};
/// let tube = Segment::new(DVec3::new(-1.0, 0.5, 1.0), DVec3::new(2.0, 0.5, 1.5));
/// let (x, n) = (DVec3::ZERO, DVec3::Z);
/// let sampler = LinearSampler::new(LinearTechnique::ProjectedSolidAngle, &tube, x, n).unwrap();
/// // Perfect for a diffuse receiver: every sample gives the same estimate.
/// let estimate = |xi| {
///     let s = sampler.sample(xi);
///     s.direction.dot(n) / s.pdf.value()
/// };
/// assert!((estimate(0.1) / estimate(0.9) - 1.0).abs() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LinearSampler {
    kind: Kind,
    view: LineView,
    /// The factor of the density: one over the length, the solid angle or the projected
    /// solid angle.
    density: f64,
}

impl LinearSampler {
    /// Sets the technique up for one light and the shading point `x`. `None` if the technique
    /// cannot give a sample: the light has no length, the shading point is on its infinite line, or
    /// either is beyond the domain of [`LineView`]. Techniques other than [`LinearTechnique::Area`]
    /// and [`LinearTechnique::SolidAngle`] also return `None` if no part of the light is above the
    /// horizon of the unit `normal`.
    #[inline]
    #[must_use]
    pub fn new(
        technique: LinearTechnique,
        light: &Segment,
        x: DVec3,
        normal: DVec3,
    ) -> Option<Self> {
        use LinearTechnique as T;
        // Clip the line to the horizon where the technique does so.
        let clip = !matches!(technique, T::Area | T::SolidAngle);
        let view = view_from(light, x, clip.then_some(normal))?;
        let kind = match technique {
            T::Area => Kind::Area,
            T::SolidAngle | T::ClippedSolidAngle => Kind::SolidAngle,
            T::LinearCosine => Kind::Warped(Warp::linear(&view)?),
            T::QuadraticCosine => Kind::Warped(Warp::quadratic(&view)?),
            T::NewtonBisection => Kind::Bisection(LineIntegral::new(&view, normal)?),
            T::ProjectedSolidAngle => Kind::Projected(Inversion::of(&view)?),
        };
        // The density is in proportion to the inverse of the total measure.
        let whole = match &kind {
            Kind::Area => view.length(),
            Kind::SolidAngle | Kind::Warped(_) => view.solid_angle(),
            Kind::Bisection(integral) => integral.projected_solid_angle(),
            Kind::Projected(p) => p.projected_solid_angle(&view),
        };
        whole.is_usable().then_some(Self {
            kind,
            view,
            density: 1.0 / whole,
        })
    }

    /// Returns the line as the shading point sees it, clipped if the technique clips.
    #[must_use]
    pub const fn view(&self) -> &LineView {
        &self.view
    }

    /// Returns the irradiance of a diffuse receiver for a unit of radiance × radius and without
    /// occluders, that is the projected solid angle per radius in sr/m. Only
    /// [`LinearTechnique::ProjectedSolidAngle`] and [`LinearTechnique::NewtonBisection`] know it;
    /// the other techniques return `None`.
    #[must_use]
    pub fn irradiance(&self) -> Option<f64> {
        match &self.kind {
            Kind::Projected(p) => Some(p.projected_solid_angle(&self.view)),
            Kind::Bisection(integral) => Some(integral.projected_solid_angle()),
            Kind::Area | Kind::SolidAngle | Kind::Warped(_) => None,
        }
    }

    /// Fills `out` with the samples of the random numbers `xi`, until one of the two slices ends.
    /// The samples are the ones of [`LinearSampler::sample`] to rounding; for the projected solid
    /// angle each of them is cheaper.
    pub fn sample_into(&self, xi: &[f64], out: &mut [LinearSample]) {
        let mut done = 0;
        // Sample the projected solid angle in blocks, and other techniques one by one.
        if let Kind::Projected(p) = &self.kind {
            let mut batch = Batch::default();
            for (numbers, slots) in xi.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
                let n = numbers.len().min(slots.len());
                batch.fill(p, &self.view, &numbers[..n]);
                for (i, slot) in slots[..n].iter_mut().enumerate() {
                    let at = |v: &[[f64; BLOCK]; 3]| DVec3::new(v[0][i], v[1][i], v[2][i]);
                    *slot = LinearSample {
                        t: self.view.whole_fraction(batch.lambda[i]),
                        offset: at(&batch.point),
                        direction: at(&batch.direction),
                        pdf: Pdf::new(batch.cosine[i] * self.density),
                    };
                }
                done += n;
            }
        }
        for (sample, &xi) in out.iter_mut().zip(xi).skip(done) {
            *sample = self.sample(xi);
        }
    }

    /// Returns the density at a position on the clipped line.
    fn pdf_at(&self, lambda: f64) -> Pdf<ThinSolidAngle> {
        match &self.kind {
            Kind::Area => Pdf::<Length>::new(self.density)
                .to_thin_solid_angle(self.view.distance(lambda), self.view.line_distance()),
            Kind::SolidAngle => Pdf::new(self.density),
            Kind::Warped(w) => {
                let xi = self.view.invert_solid_angle(lambda);
                Pdf::new(w.pdf(xi) * self.density)
            }
            Kind::Bisection(_) | Kind::Projected(_) => {
                Pdf::new(self.view.cosine(lambda) * self.density)
            }
        }
    }

    /// Returns the sample at a position on the clipped line.
    fn at_place(&self, lambda: f64) -> LinearSample {
        let offset = self.view.at(lambda);
        LinearSample {
            t: self.view.whole_fraction(lambda),
            offset,
            direction: predicates::normalize(offset).unwrap_or(DVec3::ZERO),
            pdf: self.pdf_at(lambda),
        }
    }
}

impl LinearPointTechnique for LinearSampler {
    fn sample(&self, xi: f64) -> LinearSample {
        let ((second, s, c), per_density) = match &self.kind {
            Kind::Area => return self.at_place(xi),
            Kind::SolidAngle => (self.view.solid_angle_arc(xi), 1.0),
            Kind::Warped(w) => {
                let warped = w.sample(xi);
                (self.view.solid_angle_arc(warped), w.pdf(warped))
            }
            Kind::Bisection(integral) => return self.at_place(integral.sample(xi)),
            Kind::Projected(p) => p.arc_with_cosine(&self.view, xi),
        };
        let arc = self.view.arc_point(second, s, c);
        LinearSample {
            // This is in [0, 1]: a quotient of two numbers ≥ 0, the second of which is the larger.
            t: self.view.whole_fraction_of(arc.lambda),
            offset: arc.point,
            direction: arc.direction,
            pdf: Pdf::new(per_density * self.density),
        }
    }

    fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle> {
        self.view
            .clipped_fraction(t)
            .map_or(Pdf::ZERO, |lambda| self.pdf_at(lambda))
    }

    fn invert(&self, t: f64) -> Option<f64> {
        let lambda = self.view.clipped_fraction(t)?;
        let xi = match &self.kind {
            Kind::Area => lambda,
            Kind::SolidAngle => self.view.invert_solid_angle(lambda),
            Kind::Warped(w) => w.cdf(self.view.invert_solid_angle(lambda)),
            Kind::Bisection(integral) => integral.cdf(lambda),
            Kind::Projected(p) => p.cdf(self.view.angle_of(lambda)),
        };
        Some(below_one(xi))
    }
}

/// Returns the view of a segment from `x`; its edge is formed before the subtraction.
#[inline(always)]
pub(crate) fn view_from(light: &Segment, x: DVec3, normal: Option<DVec3>) -> Option<LineView> {
    LineView::with_edge(light.p0 - x, light.p1 - x, light.vector(), normal)
}
