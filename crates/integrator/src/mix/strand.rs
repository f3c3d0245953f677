//! One technique of a mix, made ready for a shading point and a light.

use super::{LineDirection, LineMeasure, LineTechnique, Mix, Pieces, Technique};
use crate::ShadingPoint;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{
    AngularLines, AreaSampler, LineSample, LineSampler, OffsetDensity, SolidAngleSampler,
};
use std::f64::consts::PI;

/// A technique, the samples expected of it and the samples it gets.
#[derive(Clone, Debug)]
pub(super) struct Strand {
    pub kind: Kind,
    /// The expected number of samples N_i, which stands in weights and contributions.
    pub expected: f64,
    /// The number drawn this time; its mean is `expected`.
    pub count: u32,
}

/// What a technique draws from.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum Kind {
    Area(AreaSampler),
    SolidAngle(SolidAngleSampler),
    Bsdf,
    Line(Lines, Pieces),
}

/// Lines of one direction.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum Lines {
    Area(LineSampler),
    Angular(AngularLines),
}

/// A point on the light as seen from the shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub point: DVec3,
    pub direction: DVec3,
    pub square: f64,
    pub cos_light: f64,
}

impl Seen {
    pub(super) fn new(point: DVec3, from: &ShadingPoint, light: &ConvexPolygon) -> Self {
        let to_light = point - from.position;
        let square = to_light.length_squared();
        let direction = to_light / square.sqrt();
        Self {
            point,
            direction,
            square,
            cos_light: light.normal().dot(direction).abs(),
        }
    }
}

impl Strand {
    /// The strands of a mix over the part `light` of a polygon, whose angles are `turn` radians
    /// ahead of the part's; `u(k)` are independent random numbers.
    pub(super) fn all(
        mix: &Mix,
        samples: u32,
        (light, turn): (&ConvexPolygon, f64),
        point: &ShadingPoint,
        u: impl Fn(u32) -> f64,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        let total: u32 = mix.parts().map(|p| p.share).sum();
        for (index, part) in (0u32..).zip(mix.parts()) {
            let expected = f64::from(samples) * f64::from(part.share) / f64::from(total);
            let mut push = |kind, expected| {
                out.push(Self {
                    kind,
                    expected,
                    count: 0,
                });
            };
            match part.technique {
                Technique::PointArea => push(Kind::Area(AreaSampler::new(light)), expected),
                Technique::PointSolidAngle => push(
                    Kind::SolidAngle(SolidAngleSampler::new(light, point.position)),
                    expected,
                ),
                Technique::PointBsdf => push(Kind::Bsdf, expected),
                Technique::Line(line) => {
                    let (first, count) = match line.direction {
                        LineDirection::Fixed(fraction) => (fraction, 1),
                        LineDirection::Parallel => (u(index + 1), 1),
                        LineDirection::Spread(count) => (u(index + 1), count),
                    };
                    for k in 0..count {
                        let fraction = first + f64::from(k) / f64::from(count);
                        let lines = Lines::new(line, light, fraction * PI + turn, point);
                        push(Kind::Line(lines, line.pieces), expected / f64::from(count));
                    }
                }
            }
        }
        allot(out, u(0));
    }

    /// The density per solid angle of a point technique at a visible point; zero for a line.
    pub(super) fn point_density(&self, at: &Seen, point: &ShadingPoint) -> f64 {
        match &self.kind {
            Kind::Area(sampler) => sampler
                .pdf(at.point)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Kind::SolidAngle(sampler) => sampler.pdf(at.point).value(),
            Kind::Bsdf => point.bsdf.pdf(at.direction, point.outgoing, point.normal),
            Kind::Line(..) => 0.0,
        }
    }
}

/// The line of a family through a point of the light.
pub(super) fn through(lines: &ParallelLines, point: DVec3) -> Segment {
    let (a, b) = lines.range();
    let (offset, _) = lines.coordinates(point);
    lines.segment(offset.clamp(a, b)).unwrap_or_default()
}

/// Gives whole numbers of samples with the expected means: systematic rounding of the running sum.
fn allot(strands: &mut [Strand], u: f64) {
    let (mut sum, mut given) = (u, 0.0);
    for strand in strands {
        sum += strand.expected;
        let upto = sum.floor();
        strand.count = whole(upto - given);
        given = upto;
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a difference of whole numbers between 0 and the number of samples"
)]
fn whole(number: f64) -> u32 {
    number as u32
}

impl Lines {
    fn new(
        technique: LineTechnique,
        light: &ConvexPolygon,
        angle: f64,
        point: &ShadingPoint,
    ) -> Self {
        let x = point.position;
        match technique.measure {
            LineMeasure::Area => Self::Area(LineSampler::new(light, angle, OffsetDensity::Length)),
            LineMeasure::SolidAngle => Self::Angular(AngularLines::by_solid_angle(light, angle, x)),
            LineMeasure::Warped => {
                Self::Angular(AngularLines::by_warped_solid_angle(light, angle, x))
            }
            LineMeasure::Projected => Self::Angular(AngularLines::by_projected_solid_angle(
                light,
                angle,
                x,
                point.normal,
            )),
        }
    }

    fn parallel(&self) -> &ParallelLines {
        match self {
            Self::Area(sampler) => sampler.lines(),
            Self::Angular(lines) => lines.lines(),
        }
    }

    pub(super) fn sample(&self, u: f64) -> LineSample {
        match self {
            Self::Area(sampler) => sampler.sample(u),
            Self::Angular(lines) => lines.sample(u),
        }
    }

    /// A point of the visible parts of a line, and its density per solid angle: the joint one.
    pub(super) fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        seen: impl Fn(DVec3) -> Seen,
    ) -> (Seen, f64) {
        match self {
            Self::Area(sampler) => {
                let sample = sampler.point(line, visible, u);
                let at = seen(sample.point);
                let density = sample.pdf.to_solid_angle(at.square, at.cos_light);
                (at, density.value())
            }
            Self::Angular(lines) => {
                let sample = lines.point(line, visible, u);
                (seen(sample.point), sample.pdf.value())
            }
        }
    }

    /// The line through a point of the light.
    pub(super) fn through(&self, point: DVec3) -> Segment {
        through(self.parallel(), point)
    }

    /// The unit direction of the lines.
    pub(super) fn direction(&self) -> DVec3 {
        self.parallel().direction()
    }

    /// The joint density per solid angle at a point whose line has these visible parts.
    pub(super) fn density(&self, at: &Seen, visible: &[Interval]) -> f64 {
        match self {
            Self::Area(sampler) => sampler
                .joint_pdf(at.point, visible)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Self::Angular(lines) => lines.joint_pdf(at.point, visible).value(),
        }
    }
}
