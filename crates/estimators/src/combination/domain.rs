//! What the techniques of a combination draw from: the part of a light above the horizon, a polygon
//! or a round light as the shading point sees it.

use super::smooth::Bordered;
use crate::round::{RoundSource, RoundView};
use crate::techniques::lines::{DrawLines, LineFamily};
use crate::techniques::points::{DrawPoints, LightPoint, PointSource, Polygon};
use crate::{EmissionTexture, Lines, PointBy};
use linelit_bsdf::TransformedCosines;
use linelit_geometry::{ConvexPolygon, DVec3, Segment, intervals::Interval};
use linelit_lights::LineSample;
use linelit_spheres::DiskChords;
use std::f64::consts::PI;
use std::fmt::Debug;

pub(super) trait Domain {
    /// The light's surface, on which points lie.
    type Surface: Bordered;
    /// What draws points of it.
    type Points: DrawPoints<Self::Surface> + Clone + Debug;
    /// What draws lines on it.
    type Lines: DrawLines<Self::Surface> + Clone + Debug;

    /// Points of a technique.
    fn points(&self, by: PointBy) -> Self::Points;

    /// Lines of a technique in a direction that is a fraction of a half turn; `None` where no line
    /// is asked for its visible parts: points by solid angle then.
    fn lines(&self, lines: &Lines, fraction: f64) -> Option<Self::Lines>;
}

impl<'t, T: EmissionTexture> Domain for Polygon<'t, T> {
    type Surface = ConvexPolygon;
    type Points = PointSource<'t>;
    type Lines = LineFamily<'t>;

    fn points(&self, by: PointBy) -> PointSource<'t> {
        PointSource::new(by, self)
    }

    fn lines(&self, lines: &Lines, fraction: f64) -> Option<LineFamily<'t>> {
        Some(LineFamily::new(lines, self, fraction))
    }
}

/// A round light, and who looks at it.
pub(super) struct RoundPart {
    pub view: RoundView,
    /// The normals of the horizons, the shading normal first.
    pub horizons: [DVec3; 2],
    /// What the point reflects, if that is known and a technique asks for it.
    pub cosines: Option<TransformedCosines>,
    /// Whether lines may be asked for their visible parts.
    pub by_lines: bool,
}

impl RoundPart {
    /// Chords by the measure of lines, whether or not they may be asked about.
    pub(super) fn chords(&self, lines: &Lines, fraction: f64) -> DiskChords {
        let measure = lines.measure().on_disk(lines.offset);
        let horizons = match self.horizons[0] == self.horizons[1] {
            true => &self.horizons[..1],
            false => &self.horizons,
        };
        let (disk, x) = (&self.view.disk, self.view.x);
        DiskChords::new(disk, fraction * PI, x, horizons, measure)
    }
}

impl Domain for RoundPart {
    type Surface = RoundView;
    type Points = RoundSource;
    type Lines = DiskChords;

    fn points(&self, by: PointBy) -> RoundSource {
        RoundSource {
            points: self
                .view
                .points(by, self.horizons[0], self.cosines.as_ref()),
            view: self.view,
        }
    }

    fn lines(&self, lines: &Lines, fraction: f64) -> Option<DiskChords> {
        self.by_lines.then(|| self.chords(lines, fraction))
    }
}

impl DrawLines<RoundView> for DiskChords {
    fn direction(&self) -> DVec3 {
        self.direction()
    }

    fn sample(&self, u: f64) -> LineSample {
        self.sample(u)
    }

    fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        x: DVec3,
        light: &RoundView,
    ) -> (LightPoint, f64) {
        let sample = self.point(line, visible, u);
        (LightPoint::new(sample.point, x, light), sample.pdf.value())
    }

    fn through(&self, point: DVec3) -> Segment {
        self.through(point)
    }

    fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64 {
        self.joint_pdf(at.point, visible).value()
    }
}
