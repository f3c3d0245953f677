//! One technique of a mix, made ready for a shading point and a light.

use super::{LineDirection, LineMeasure, LineTechnique, Mix, MixHeuristic, Pieces, Technique};
use crate::ShadingPoint;
use linelit_bsdf::Reflection;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{
    AngularLines, AreaSampler, ImportanceImage, LineSample, LineSampler, OffsetDensity,
    SolidAngleSampler, TextureAxis, TexturedLines, TexturedSampler,
};
use linelit_scene::EmissionTexture;
use std::f64::consts::PI;

/// A technique, the samples expected of it and the samples it gets.
#[derive(Clone, Debug)]
pub(super) struct Strand<'t> {
    pub kind: Kind<'t>,
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
pub(super) enum Kind<'t> {
    Area(AreaSampler),
    SolidAngle(SolidAngleSampler),
    /// With the light, where points may fall beside it.
    Texture(TexturedSampler<'t>, Option<ConvexPolygon>),
    Bsdf,
    Line(Lines<'t>, Pieces),
}

/// Lines of one direction.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum Lines<'t> {
    Area(LineSampler),
    Angular(AngularLines),
    Texture(TexturedLines<'t>),
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

/// The part of a light that techniques draw from.
pub(super) struct Lit<'t> {
    /// What is above the horizons.
    pub light: ConvexPolygon,
    /// What angles on the whole light are ahead of those on this part.
    pub turn: f64,
    /// The texture of the whole light.
    pub texture: Option<&'t EmissionTexture>,
    /// Whether so much stands in between that `hybrid` takes points in place of lines.
    pub crowded: bool,
}

impl<'t> Strand<'t> {
    /// The strands of a mix with this many samples in the mean; `u(k)` are independent random numbers.
    pub(super) fn all(
        mix: &Mix,
        samples: f64,
        lit: &Lit<'t>,
        point: &ShadingPoint,
        u: impl Fn(u32) -> f64,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        let light = &lit.light;
        let total: f64 = mix.parts().map(|p| f64::from(p.share)).sum();
        for (index, part) in (0u32..).zip(mix.parts()) {
            let expected = samples * f64::from(part.share) / total;
            let mut push = |kind, expected, each: u8| {
                out.push(Self {
                    kind,
                    expected: expected * f64::from(each),
                    count: 0,
                    each,
                });
            };
            match part.technique {
                Technique::PointArea => push(Kind::Area(AreaSampler::new(light)), expected, 1),
                Technique::PointSolidAngle => push(
                    Kind::SolidAngle(SolidAngleSampler::new(light, point.position)),
                    expected,
                    1,
                ),
                Technique::PointTexture => push(Kind::texture(lit), expected, 1),
                Technique::PointBsdf => push(Kind::Bsdf, expected, 1),
                Technique::Line(line) if lit.crowded && line.measure == LineMeasure::Hybrid => {
                    push(Kind::Area(AreaSampler::new(light)), expected, 1);
                }
                Technique::Line(line) => {
                    let (first, count) = match line.direction {
                        LineDirection::Fixed(fraction) => (fraction, 1),
                        LineDirection::Parallel => (u(index + 1), 1),
                        LineDirection::Spread(count) => (u(index + 1), count),
                    };
                    for k in 0..count {
                        let mut fraction = first + f64::from(k) / f64::from(count);
                        if line.measure == LineMeasure::Texture && !line.direction.is_fixed() {
                            fraction = 0.5 * ((2.0 * first).floor() + f64::from(k));
                        }
                        let lines = Lines::new(line, lit, fraction, point);
                        let each = match mix.heuristic() {
                            MixHeuristic::Optimal(_) => 1,
                            _ => line.points,
                        };
                        let kind = Kind::Line(lines, line.pieces);
                        push(kind, expected / f64::from(count), each);
                    }
                }
            }
        }
    }

    /// The density per solid angle of a point technique at a visible point; zero for a line.
    pub(super) fn point_density(&self, at: &Seen, point: &ShadingPoint) -> f64 {
        match &self.kind {
            Kind::Area(sampler) => sampler
                .pdf(at.point)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Kind::SolidAngle(sampler) => sampler.pdf(at.point).value(),
            Kind::Texture(sampler, _) => sampler
                .pdf(at.point)
                .to_solid_angle(at.square, at.cos_light)
                .value(),
            Kind::Bsdf => point.bsdf.pdf(at.direction, point.outgoing, point.normal),
            Kind::Line(..) => 0.0,
        }
    }
}

/// Lines by the texture: along the edges of the light unless a direction is asked for.
fn textured<'t>(
    light: &ConvexPolygon,
    image: &'t ImportanceImage,
    technique: LineTechnique,
    fraction: f64,
) -> Option<TexturedLines<'t>> {
    if technique.direction.is_fixed() {
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
pub(super) fn allot(strands: &mut [Strand<'_>], u: f64) {
    let (mut sum, mut given) = (u, 0.0);
    for strand in strands {
        sum += strand.expected / f64::from(strand.each);
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

impl<'t> Kind<'t> {
    fn texture(lit: &Lit<'t>) -> Self {
        match lit.texture.and_then(|t| Some((t, t.points()?))) {
            Some((texture, sampler)) => {
                Self::Texture(sampler, (!texture.fits()).then_some(lit.light))
            }
            None => Self::Area(AreaSampler::new(&lit.light)),
        }
    }
}

impl<'t> Lines<'t> {
    /// Lines in a direction that is a fraction of a half turn from the light's first edge.
    fn new(technique: LineTechnique, lit: &Lit<'t>, fraction: f64, point: &ShadingPoint) -> Self {
        let (light, x) = (&lit.light, point.position);
        let angle = fraction * PI + lit.turn;
        match technique.measure {
            LineMeasure::Area | LineMeasure::Analytic | LineMeasure::Hybrid => {
                Self::Area(LineSampler::new(light, angle, OffsetDensity::Length))
            }
            LineMeasure::Texture => {
                let image = lit.texture.and_then(|t| t.over(light));
                match image.and_then(|image| textured(light, image, technique, fraction)) {
                    Some(lines) => Self::Texture(lines),
                    None => Self::Area(LineSampler::new(light, angle, OffsetDensity::Length)),
                }
            }
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
        seen: impl Fn(DVec3) -> Seen,
    ) -> (Seen, f64) {
        let sample = match self {
            Self::Angular(lines) => {
                let sample = lines.point(line, visible, u);
                return (seen(sample.point), sample.pdf.value());
            }
            Self::Area(sampler) => sampler.point(line, visible, u),
            Self::Texture(lines) => lines.point(line, visible, u),
        };
        let at = seen(sample.point);
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
    pub(super) fn density(&self, at: &Seen, visible: &[Interval]) -> f64 {
        let by_area = match self {
            Self::Angular(lines) => return lines.joint_pdf(at.point, visible).value(),
            Self::Area(sampler) => sampler.joint_pdf(at.point, visible),
            Self::Texture(lines) => lines.joint_pdf(at.point, visible),
        };
        by_area.to_solid_angle(at.square, at.cos_light).value()
    }
}
