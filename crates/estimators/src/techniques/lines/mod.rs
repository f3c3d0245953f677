//! Techniques of lines: what each draws from on a polygon.
//!
//! Spheres and disks have no lines. A linear light is one line whatever
//! the technique, taken in closed form or by quadrature, and by points where nothing is known of
//! the reflection.

pub(crate) mod area;
pub(crate) mod projected;
pub(crate) mod solid_angle;
pub(crate) mod texture;
pub(crate) mod warped;

use super::points::{LightPoint, Polygon};
use crate::techniques::line_techniques;
use crate::text::{Options, Result};
use crate::{EmissionTexture, Integration, LineBy, MOST_TECHNIQUES};
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{ChordMeasure, LineSample, LineTechnique, OffsetDensity};
use std::f64::consts::PI;

/// Lines on area lights, and what is done with their visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// The measure in which lines, and points on them, are uniform; where they are integrated in
    /// closed form, area whatever this says.
    pub by: LineBy,
    /// How light is integrated over what is visible; by a point of it unless said.
    pub integration: Option<Integration>,
    /// Direction of the lines.
    pub direction: LineDirection,
    /// Density of the offsets of parallel lines by [`LineBy::Area`].
    pub offset: OffsetDensity,
    /// What is done against the noise of lines whose integrals are known.
    pub control: LineControl,
    /// Where points are drawn in a combination.
    pub pieces: Pieces,
    /// How many there, evenly spread from a random first one; 1 with optimal weights. They cost
    /// less than the line where visibility does.
    pub points: u8,
}

/// The directions of the lines of one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineDirection {
    /// The direction in which what is visible of the light changes least from one line to the
    /// next, among those of its edges and diagonals, where it is known
    /// ([`OcclusionStats::direction`](crate::OcclusionStats::direction)); else, for disks and
    /// spheres, and for lines by texture, as [`LineDirection::Parallel`].
    Adaptive,
    /// This fraction of a half turn from the light's first edge.
    Fixed(f64),
    /// One random direction for each shading point (what Billen & Dutré 2016 prefer).
    Parallel,
    /// A direction for each line, independent of the others', while offsets follow the pattern:
    /// this brings back the rate N^-1/2. Only for a technique that stands alone.
    UniformPerLine,
    /// A direction for each line, direction and offset by one pattern of two dimensions (Billen &
    /// Dutré 2016, §5.1.1). Only for a technique that stands alone.
    Stratified,
    /// Lines from one corner of the light to its border, from a random one for each shading point,
    /// as many over equal areas ([`AreaSampler::line`](linelit_lights::AreaSampler::line); Billen &
    /// Dutré 2016, §8): [`Lines::offset`] does not count. Only for a technique that stands alone.
    Origin,
    /// So many directions, evenly spread from a random first one, each a technique of its own: the
    /// continuum of directions by the balance heuristic over those drawn (stochastic MIS, West et
    /// al. 2020). As every direction covers the whole light, each draw of directions is unbiased by
    /// itself.
    Spread(u8),
}

/// What is done against the noise of lines that are integrated in closed form, or by quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineControl {
    /// The slope between the lines on either side of each is a control variate: light that changes
    /// linearly from line to line has noise in the first and last stratum only, and the variance
    /// falls as N⁻⁴ where the plain mean's falls as N⁻³ (Chopin & Gerber 2024). Unbiased.
    ///
    /// For all lines of one direction or one origin, by patterns of
    /// [independent strata](linelit_samplers::SampleSet::has_independent_strata); where the pattern
    /// has none, and for lines of which a point is drawn, as [`LineControl::None`].
    Slopes,
    /// None: the mean over lines, as published.
    None,
}

/// Where on a line points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// On all visible pieces, in proportion to their measure, as published.
    One,
    /// In each visible piece, all at the same place within their piece: the estimate then stays
    /// smooth where a piece appears or ends, which one point that jumps between pieces is not.
    Each,
}

impl Lines {
    /// Lines uniform in the area, a point of what is visible of each.
    pub const AREA: Self = Self::by(LineBy::Area);

    /// Lines of a measure with points of their visible parts, in the direction that suits the
    /// shading point best, offsets in proportion to length.
    #[must_use]
    pub const fn by(by: LineBy) -> Self {
        Self {
            by,
            integration: None,
            direction: LineDirection::Adaptive,
            offset: OffsetDensity::Length,
            control: LineControl::Slopes,
            pieces: Pieces::Each,
            points: 1,
        }
    }

    /// Lines uniform in the area, integrated in closed form.
    #[must_use]
    pub const fn integrated(integration: Integration) -> Self {
        Self {
            integration: Some(integration),
            ..Self::AREA
        }
    }

    /// The measure that counts.
    pub(crate) fn measure(&self) -> LineBy {
        match self.integration {
            None => self.by,
            Some(_) => LineBy::Area,
        }
    }

    /// Whether the density of offsets counts.
    fn has_offsets(&self) -> bool {
        self.measure() == LineBy::Area && self.direction != LineDirection::Origin
    }

    /// Whether its samples need no weights as an estimator's only technique, which is then
    /// [`Weights::Alone`](crate::Weights::Alone): by area, one direction at a time, and a point in
    /// each visible piece. Any other is a combination of one.
    pub(crate) fn can_stand_alone(&self) -> bool {
        self.measure() == LineBy::Area
            && self.pieces == Pieces::Each
            && self.points == 1
            && !matches!(self.direction, LineDirection::Spread(_))
    }

    /// With the options that a text says, and whether one was said that only weighted techniques
    /// have.
    pub(crate) fn read(mut self, options: &mut Options<'_>) -> Result<(Self, bool)> {
        match self.integration {
            None => self.by = self.by.read(options)?,
            Some(integration) => self.integration = Some(integration.read(options)?),
        }
        options.read("orientation", DIRECTIONS, direction, &mut self.direction)?;
        if self.has_offsets() {
            options.choose("offset", OFFSETS, &mut self.offset)?;
        }
        if self.integration.is_some() {
            options.choose("control", CONTROLS, &mut self.control)?;
        }
        let pieces = options.choose("pieces", PIECES, &mut self.pieces)?;
        let count = |text: &str| text.parse().ok().filter(|k| (1..=MOST_POINTS).contains(k));
        let points = options.read("points", POINTS, count, &mut self.points)?;
        let spread = matches!(self.direction, LineDirection::Spread(_));
        Ok((self, pieces || points || spread))
    }

    /// The options that are not the default, as `key=value`.
    pub(crate) fn write(self, out: &mut Vec<String>) {
        match self.integration {
            None => self.by.write(out),
            Some(integration) => integration.write(out),
        }
        match self.direction {
            LineDirection::Adaptive => {}
            LineDirection::Parallel => out.push("orientation=parallel".to_owned()),
            LineDirection::Fixed(fraction) => out.push(format!("orientation=fixed:{fraction}")),
            LineDirection::UniformPerLine => out.push("orientation=uniform".to_owned()),
            LineDirection::Stratified => out.push("orientation=stratified".to_owned()),
            LineDirection::Origin => out.push("orientation=origin".to_owned()),
            LineDirection::Spread(count) => out.push(format!("orientation=spread:{count}")),
        }
        if self.offset == OffsetDensity::Uniform && self.has_offsets() {
            out.push("offset=uniform".to_owned());
        }
        if self.control == LineControl::None && self.integration.is_some() {
            out.push("control=none".to_owned());
        }
        if self.pieces == Pieces::One {
            out.push("pieces=one".to_owned());
        }
        if self.points != 1 {
            out.push(format!("points={}", self.points));
        }
    }
}

/// The most points that a piece of a line gets.
const MOST_POINTS: u8 = 64;

/// What `points` may be.
const POINTS: &str = "a whole number from 1 to 64";

/// What `offset` may be.
const OFFSETS: [(&str, OffsetDensity); 2] = [
    ("uniform", OffsetDensity::Uniform),
    ("length", OffsetDensity::Length),
];

/// What `control` may be.
const CONTROLS: [(&str, LineControl); 2] =
    [("slopes", LineControl::Slopes), ("none", LineControl::None)];

/// What `pieces` may be.
const PIECES: [(&str, Pieces); 2] = [("one", Pieces::One), ("each", Pieces::Each)];

/// What `orientation` may be.
const DIRECTIONS: &str = "adaptive, parallel, uniform, stratified, origin, fixed:FRACTION (of a half turn) or spread:COUNT (at most 8)";

fn direction(value: &str) -> Option<LineDirection> {
    match value.split_once(':') {
        None if value == "adaptive" => Some(LineDirection::Adaptive),
        None if value == "parallel" => Some(LineDirection::Parallel),
        None if value == "uniform" => Some(LineDirection::UniformPerLine),
        None if value == "stratified" => Some(LineDirection::Stratified),
        None if value == "origin" => Some(LineDirection::Origin),
        Some(("spread", count)) => {
            let count = count.parse().ok()?;
            let fits = (1..=MOST_TECHNIQUES).contains(&usize::from(count));
            fits.then_some(LineDirection::Spread(count))
        }
        _ => fixed(value).map(LineDirection::Fixed),
    }
}

/// The fraction of a half turn in `fixed:FRACTION`, 0 if it is not said; `None` for anything else,
/// and for fractions so large that there is no number for the angle.
fn fixed(value: &str) -> Option<f64> {
    let fraction: f64 = match value.strip_prefix("fixed")? {
        "" => 0.0,
        rest => rest.strip_prefix(':')?.parse().ok()?,
    };
    (fraction * PI).is_finite().then_some(fraction)
}

/// A measure of lines on polygons: all there is to know about one technique.
///
/// Options are those of [`Lines`], the same for all, but that [`Lines::read`] gives `offset` to
/// lines by area only; and only these may stand alone ([`Lines::can_stand_alone`]): any other
/// measure draws as part of a combination, though of one.
pub(crate) trait LineMeasure: Copy + Default {
    /// The name in texts.
    const NAME: &'static str;

    /// What draws lines in one estimate; `'t` is the life of a texture.
    type OnPolygon<'t>: LineTechnique;

    /// On the part of a light above the horizon, in a direction; `None` is lines by area.
    fn on_polygon<'t, T: EmissionTexture>(
        self,
        part: &Polygon<'t, T>,
        setup: LineSetup,
    ) -> Option<Self::OnPolygon<'t>>;

    /// The measure of lines along cylinders; area unless said.
    fn on_cylinder(self, offset: OffsetDensity) -> ChordMeasure {
        match offset {
            OffsetDensity::Uniform => ChordMeasure::Uniform,
            OffsetDensity::Length => ChordMeasure::Length,
        }
    }

    /// The direction, in half turns from the light's first edge, of line technique `k` of a spread
    /// of `count` whose first was drawn as `first`, in [0, 1).
    fn spread(self, first: f64, k: u8, count: u8) -> f64 {
        first + f64::from(k) / f64::from(count)
    }
}

/// Parallel lines on a light, but for the density of their offsets by measures other than area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineSetup {
    /// The direction in half turns from the first edge of the whole light, as it was asked for or
    /// drawn: for what is laid out on that light, such as its texture.
    pub fraction: f64,
    /// The same direction in radians from the first edge of the part: for what is set up with the
    /// part's polygon.
    pub angle: f64,
    /// Whether the direction was asked for, not drawn.
    pub fixed: bool,
    /// The density of offsets by area, which is what the option says.
    pub offset: OffsetDensity,
}

impl LineBy {
    /// The measure of lines along cylinders.
    pub(crate) fn on_cylinder(self, offset: OffsetDensity) -> ChordMeasure {
        line_techniques! { dispatch [self, technique => technique.on_cylinder(offset)] }
    }

    /// The direction, in half turns from the light's first edge, of one line technique of a spread.
    pub(crate) fn spread(self, first: f64, k: u8, count: u8) -> f64 {
        line_techniques! { dispatch [self, technique => technique.spread(first, k, count)] }
    }
}

line_techniques! { sources [
    /// Lines of one direction, ready for a shading point.
    LineFamily
] }

/// The same of whichever lines they are.
macro_rules! of {
    ($family:expr, $lines:ident => $code:expr) => {
        line_techniques! { with_source [$family, LineFamily, $lines => $code] }
    };
}

impl<'t> LineFamily<'t> {
    /// Lines in a direction that is a fraction of a half turn from the light's first edge.
    pub(crate) fn new<T: EmissionTexture>(
        lines: &Lines,
        part: &Polygon<'t, T>,
        fraction: f64,
    ) -> Self {
        let setup = LineSetup {
            fraction,
            angle: fraction * PI + part.turn,
            fixed: matches!(lines.direction, LineDirection::Fixed(_)),
            offset: lines.offset,
        };
        let family = line_techniques! { prepare
            [lines.measure(), LineFamily, technique => technique.on_polygon(part, setup)]
        };
        family.unwrap_or_else(|| Self::Area(area::lines(part.polygon, setup)))
    }

    fn parallel(&self) -> &ParallelLines {
        of!(self, lines => lines.lines())
    }
}

/// What draws lines of one direction on a surface, and points on them, ready for a shading point.
pub(crate) trait DrawLines<S> {
    /// The unit direction of the lines.
    fn direction(&self) -> DVec3;

    /// A line from one random number.
    fn sample(&self, u: f64) -> LineSample;

    /// A point of the visible parts of a line, and its density per solid angle: the joint one.
    fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        x: DVec3,
        light: &S,
    ) -> (LightPoint, f64);

    /// The line through a point of the light.
    fn through(&self, point: DVec3) -> Segment;

    /// The joint density per solid angle at a point whose line has these visible parts.
    fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64;
}

impl DrawLines<ConvexPolygon> for LineFamily<'_> {
    fn direction(&self) -> DVec3 {
        self.parallel().direction()
    }

    fn sample(&self, u: f64) -> LineSample {
        of!(self, lines => lines.sample(u))
    }

    fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        x: DVec3,
        light: &ConvexPolygon,
    ) -> (LightPoint, f64) {
        of!(self, lines => {
            let sample = lines.point(line, visible, u);
            let at = LightPoint::new(sample.point, x, light);
            (at, at.density(sample.pdf))
        })
    }

    fn through(&self, point: DVec3) -> Segment {
        through(self.parallel(), point)
    }

    fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64 {
        of!(self, lines => at.density(lines.joint_pdf(at.point, visible)))
    }
}

/// The line of a family through a point of the light.
pub(crate) fn through(lines: &ParallelLines, point: DVec3) -> Segment {
    let (a, b) = lines.range();
    let (offset, _) = lines.coordinates(point);
    lines.segment(offset.clamp(a, b)).unwrap_or_default()
}
