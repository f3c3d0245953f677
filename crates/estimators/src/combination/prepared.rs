//! One technique of a combination, made ready for a shading point and a light.

use crate::{
    EmissionTexture, Estimator, Integration, LineBy, LineDirection, Lines, Pieces, PointBy,
    ShadingPoint, Technique, Weights,
};
use linelit_bsdf::Reflection;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{
    AngularLines, AreaSampler, ImportanceImage, LineSample, LineSampler, SolidAngleSampler,
    TextureAxis, TexturedLines, TexturedSampler,
};
use std::f64::consts::PI;

/// A technique, the samples expected of it and the samples it gets.
#[derive(Clone, Debug)]
pub(super) struct PreparedTechnique<'t> {
    pub source: Source<'t>,
    /// The expected number of samples N_i, which stands in weights and contributions; of a line
    /// technique, points on a piece.
    pub expected: f64,
    /// The number drawn this time; its mean is `expected` over `each`.
    pub count: u32,
    /// Samples that each draw is good for: points on a piece of a line.
    pub each: u8,
}

/// What a technique draws from.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum Source<'t> {
    Area(AreaSampler),
    SolidAngle(SolidAngleSampler),
    /// By lines through it, of which any is wholly drawn from.
    Projected(AngularLines),
    /// With the light, where points may fall beside it.
    Texture(TexturedSampler<'t>, Option<ConvexPolygon>),
    Bsdf,
    Line(LineFamily<'t>, Pieces),
}

/// Lines of one direction.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum LineFamily<'t> {
    Area(LineSampler),
    Angular(AngularLines),
    Texture(TexturedLines<'t>),
}

/// A point of the light, relative to the shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightPoint {
    pub point: DVec3,
    pub direction: DVec3,
    pub square: f64,
    pub cos_light: f64,
}

impl LightPoint {
    pub(super) fn new(point: DVec3, from: DVec3, light: &ConvexPolygon) -> Self {
        let to_light = point - from;
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

/// The part of a light that techniques draw from.
pub(super) struct LightPart<'t, T> {
    /// What is above the horizons.
    pub polygon: ConvexPolygon,
    /// What angles on the whole light are ahead of those on this part.
    pub turn: f64,
    /// The texture of the whole light.
    pub texture: Option<&'t T>,
    /// Whether so much stands in between that `hybrid` takes points in place of lines.
    pub dense: bool,
}

impl<'t> PreparedTechnique<'t> {
    /// The techniques of a combination with this many samples in the mean; `u(k)` are independent
    /// random numbers.
    pub(super) fn all<R, T: EmissionTexture>(
        estimator: &Estimator,
        samples: f64,
        part: &LightPart<'t, T>,
        point: &ShadingPoint<R>,
        u: impl Fn(u32) -> f64,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        let polygon = &part.polygon;
        let total: f64 = estimator.parts().map(|p| f64::from(p.share)).sum();
        for (index, entry) in (0u32..).zip(estimator.parts()) {
            let expected = samples * f64::from(entry.share) / total;
            let mut push = |source, expected, each: u8| {
                out.push(Self {
                    source,
                    expected: expected * f64::from(each),
                    count: 0,
                    each,
                });
            };
            let lines = match entry.technique {
                Technique::Points(points) => {
                    push(Source::points(points.by, part, point), expected, 1);
                    continue;
                }
                Technique::Lines(lines) => lines,
            };
            if part.dense && lines.integration == Integration::Cheapest {
                push(Source::Area(AreaSampler::new(polygon)), expected, 1);
                continue;
            }
            let (first, count) = match lines.direction {
                LineDirection::Fixed(fraction) => (fraction, 1),
                LineDirection::Parallel | LineDirection::UniformPerLine => (u(index + 1), 1),
                LineDirection::Spread(count) => (u(index + 1), count),
            };
            let fixed = matches!(lines.direction, LineDirection::Fixed(_));
            for k in 0..count {
                let mut fraction = first + f64::from(k) / f64::from(count);
                if lines.measure() == LineBy::Texture && !fixed {
                    fraction = 0.5 * ((2.0 * first).floor() + f64::from(k));
                }
                let family = LineFamily::new(&lines, part, fraction, point);
                let each = match estimator.weights() {
                    Weights::Optimal(_) => 1,
                    Weights::Alone
                    | Weights::Balance
                    | Weights::Power
                    | Weights::Maximum
                    | Weights::Average
                    | Weights::Smooth(_)
                    | Weights::Unoccluded => lines.points,
                };
                let source = Source::Line(family, lines.pieces);
                push(source, expected / f64::from(count), each);
            }
        }
    }

    /// The density per solid angle of a point technique at a visible point; zero for a line.
    pub(super) fn point_density<R: Reflection>(
        &self,
        at: &LightPoint,
        point: &ShadingPoint<R>,
    ) -> f64 {
        match &self.source {
            Source::Area(sampler) => sampler
                .pdf(at.point)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Source::SolidAngle(sampler) => sampler.pdf(at.point).value(),
            Source::Projected(lines) => lines.joint_pdf(at.point, &[Interval::UNIT]).value(),
            Source::Texture(sampler, _) => sampler
                .pdf(at.point)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Source::Bsdf => point.bsdf.pdf(at.direction, point.outgoing, point.normal),
            Source::Line(..) => 0.0,
        }
    }
}

/// Lines by the texture: along the edges of the light unless a direction is asked for.
fn textured<'t>(
    light: &ConvexPolygon,
    image: &'t ImportanceImage,
    direction: LineDirection,
    fraction: f64,
) -> Option<TexturedLines<'t>> {
    if matches!(direction, LineDirection::Fixed(_)) {
        return TexturedLines::new(light, image, fraction * PI);
    }
    let across = (2.0 * fraction).rem_euclid(2.0) >= 1.0;
    let axis = if across {
        TextureAxis::V
    } else {
        TextureAxis::U
    };
    TexturedLines::along(light, image, axis)
}

/// The line of a family through a point of the light.
pub(super) fn through(lines: &ParallelLines, point: DVec3) -> Segment {
    let (a, b) = lines.range();
    let (offset, _) = lines.coordinates(point);
    lines.segment(offset.clamp(a, b)).unwrap_or_default()
}

/// Gives whole numbers of samples with the expected means: systematic rounding of the running sum.
pub(super) fn allot(techniques: &mut [PreparedTechnique<'_>], u: f64) {
    let (mut sum, mut given) = (u, 0.0);
    for technique in techniques {
        sum += technique.expected / f64::from(technique.each);
        let upto = sum.floor();
        technique.count = whole(upto - given);
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

impl<'t> Source<'t> {
    fn points<R, T: EmissionTexture>(
        by: PointBy,
        part: &LightPart<'t, T>,
        point: &ShadingPoint<R>,
    ) -> Self {
        let (polygon, x) = (&part.polygon, point.position);
        match by {
            PointBy::Area | PointBy::VisibleArea => Self::Area(AreaSampler::new(polygon)),
            PointBy::SolidAngle | PointBy::Linear(_) => {
                Self::SolidAngle(SolidAngleSampler::new(polygon, x))
            }
            PointBy::ProjectedSolidAngle => Self::Projected(
                AngularLines::by_projected_solid_angle(polygon, 0.0, x, point.normal),
            ),
            PointBy::Texture => match part.texture.and_then(|t| Some((t, t.points()?))) {
                Some((texture, sampler)) => {
                    Self::Texture(sampler, (!texture.fits()).then_some(*polygon))
                }
                None => Self::Area(AreaSampler::new(polygon)),
            },
            PointBy::Bsdf => Self::Bsdf,
        }
    }
}

impl<'t> LineFamily<'t> {
    /// Lines in a direction that is a fraction of a half turn from the light's first edge.
    fn new<R, T: EmissionTexture>(
        lines: &Lines,
        part: &LightPart<'t, T>,
        fraction: f64,
        point: &ShadingPoint<R>,
    ) -> Self {
        let (polygon, x) = (&part.polygon, point.position);
        let angle = fraction * PI + part.turn;
        let by_area = || Self::Area(LineSampler::new(polygon, angle, lines.offset));
        match lines.measure() {
            LineBy::Area => by_area(),
            LineBy::Texture => {
                let image = part.texture.and_then(|t| t.over(polygon));
                image
                    .and_then(|image| textured(polygon, image, lines.direction, fraction))
                    .map_or_else(by_area, Self::Texture)
            }
            LineBy::SolidAngle => Self::Angular(AngularLines::by_solid_angle(polygon, angle, x)),
            LineBy::Warped => Self::Angular(AngularLines::by_warped_solid_angle(polygon, angle, x)),
            LineBy::Projected => {
                let n = point.normal;
                Self::Angular(AngularLines::by_projected_solid_angle(polygon, angle, x, n))
            }
        }
    }

    fn parallel(&self) -> &ParallelLines {
        match self {
            Self::Area(sampler) => sampler.lines(),
            Self::Angular(lines) => lines.lines(),
            Self::Texture(lines) => lines.lines(),
        }
    }

    pub(super) fn sample(&self, u: f64) -> LineSample {
        match self {
            Self::Area(sampler) => sampler.sample(u),
            Self::Angular(lines) => lines.sample(u),
            Self::Texture(lines) => lines.sample(u),
        }
    }

    /// A point of the visible parts of a line, and its density per solid angle: the joint one.
    pub(super) fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        at: impl Fn(DVec3) -> LightPoint,
    ) -> (LightPoint, f64) {
        let sample = match self {
            Self::Angular(lines) => {
                let sample = lines.point(line, visible, u);
                return (at(sample.point), sample.pdf.value());
            }
            Self::Area(sampler) => sampler.point(line, visible, u),
            Self::Texture(lines) => lines.point(line, visible, u),
        };
        let at = at(sample.point);
        let density = sample.pdf.to_solid_angle(at.square, at.cos_light);
        (at, density.value())
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
    pub(super) fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64 {
        let by_area = match self {
            Self::Angular(lines) => return lines.joint_pdf(at.point, visible).value(),
            Self::Area(sampler) => sampler.joint_pdf(at.point, visible),
            Self::Texture(lines) => lines.joint_pdf(at.point, visible),
        };
        by_area.to_solid_angle(at.square, at.cos_light).value()
    }
}
