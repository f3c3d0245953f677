//! This module measures lines on a cylinder or disk by length, solid angle or projected solid
//! angle, and places points on their visible parts.

use crate::linear::{LineView, ProjectedLine, ThinLine};
use linelit_geometry::finite::fraction;
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec3, Segment};

/// The measure by which lines along a cylinder, and points on them, are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChordMeasure {
    /// Offsets are uniform between the first line and the last, and points uniform in length.
    Uniform,
    /// Offsets are proportional to length, and points uniform in length: this is uniform in area.
    Length,
    /// Offsets are proportional to solid angle, and points uniform in solid angle.
    SolidAngle,
    /// Offsets and points are proportional to projected solid angle, for the first horizon.
    Projected,
}

/// The shading point from which lines are seen, and the measure along them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Along {
    /// The shading point.
    pub x: DVec3,
    /// The normal for projected solid angles.
    pub normal: DVec3,
    pub measure: ChordMeasure,
}

impl Along {
    /// Returns a line or a part of one as the shading point sees it.
    pub(crate) fn thin(&self, line: &Segment) -> Option<ThinLine> {
        let [p0, p1] = [line.p0, line.p1].map(|p| p - self.x);
        if self.measure == ChordMeasure::Projected {
            ProjectedLine::new(p0, p1, self.normal).map(ThinLine::Projected)
        } else {
            LineView::new(p0, p1).map(ThinLine::Solid)
        }
    }

    /// Returns the measure of the visible parts: length, or (projected) solid angle per radius.
    pub(crate) fn visible_measure(&self, line: &Segment, visible: &[Interval]) -> f64 {
        let measure = |part: &Interval| self.part_measure(line, *part);
        visible.iter().map(measure).sum()
    }

    /// Returns the measure of a part of a line.
    fn part_measure(&self, line: &Segment, part: Interval) -> f64 {
        match self.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => {
                (part.hi - part.lo).max(0.0) * line.length()
            }
            ChordMeasure::SolidAngle | ChordMeasure::Projected => self
                .thin(&line.piece(part.lo, part.hi))
                .map_or(0.0, |thin| thin.measure()),
        }
    }

    /// Returns the line parameter below which the fraction `xi` of the visible measure lies, and
    /// that measure; `None` where no part is visible.
    pub(crate) fn place(
        &self,
        line: &Segment,
        visible: &[Interval],
        xi: f64,
    ) -> Option<(f64, f64)> {
        let total = self.visible_measure(line, visible);
        let mut rest = fraction(xi) * total;
        let mut chosen = None;
        for part in visible {
            let measure = self.part_measure(line, *part);
            if measure > 0.0 {
                chosen = Some((*part, fraction(rest / measure)));
                if rest < measure {
                    break;
                }
                rest -= measure;
            }
        }
        let (part, place) = chosen?;
        let t = part.lo + (part.hi - part.lo) * self.place_on(line, part, place);
        Some((t, total))
    }

    /// Returns the fraction of a part below which the fraction `xi` of the part's measure lies.
    fn place_on(&self, line: &Segment, part: Interval, xi: f64) -> f64 {
        match self.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => xi,
            ChordMeasure::SolidAngle | ChordMeasure::Projected => {
                self.thin(&line.piece(part.lo, part.hi)).map_or(xi, |thin| {
                    thin.view().whole_fraction(thin.sample(xi).lambda)
                })
            }
        }
    }

    /// Returns the fraction of a whole line's measure below a parameter; `None` outside the line.
    pub(crate) fn below(&self, line: &Segment, t: f64) -> Option<f64> {
        match self.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => Some(t),
            ChordMeasure::SolidAngle | ChordMeasure::Projected => {
                let thin = self.thin(line)?;
                Some(thin.invert(thin.view().clipped_fraction(t)?))
            }
        }
    }
}
