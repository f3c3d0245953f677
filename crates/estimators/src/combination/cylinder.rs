//! Combinations, and lines of any kind, on cylinders.

use super::domain::Domain;
use super::smooth::Smooth;
use super::visibility::Visibility;
use super::{Combination, instead};
use crate::closed_form::{by_quadrature, whole_cylinder};
use crate::techniques::lines::DrawLines;
use crate::techniques::points::LightPoint;
use crate::techniques::points::round::RoundPoints;
use crate::{Buffers, EmissionTexture, Lines, PointBy, Queries, Query, SampleBuffers};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{CylinderLight, CylinderLines, CylinderView, LineSample};
use linelit_shading::quadrature::Model;
use linelit_visibility::{Shaft, ShaftClass};

/// Any estimator but points with rays, on what is seen of a cylinder: as
/// [`combined`](super::combined), with lines along the axis. Integrals over what lines find visible
/// are the closed form along them, or quadrature where the peaks of the reflection are known.
pub(crate) fn on_cylinder<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &CylinderLight,
    view: &CylinderView,
    buffers: &mut Buffers,
) -> DVec3 {
    let Buffers { scratch, samples } = buffers;
    let point = query.point;
    let outline = view.outline();
    let shaft = query.occluders.shaft(query.shaft(&outline), scratch);
    let class = shaft.class();
    samples.plan.unoccluded += u64::from(class == ShaftClass::Empty);
    let closed = query.estimator.closed(query.samples);
    let closed = closed.and_then(|(lines, _, count)| {
        let along = Along::of(query, &view.cylinder().axis)?;
        Some((lines, count, along))
    });
    if query.skip
        && class == ShaftClass::Empty
        && let Some((.., Along::Closed(reflection))) = &closed
        && let Some(value) = whole_cylinder(view, light.radiance, point, reflection)
    {
        samples.plan.closed_form += 1;
        return value;
    }
    let told = is_told_by(view, &shaft);
    let mut visibility = if told && query.queries == Queries::OneShaft {
        Visibility::Outline(shaft, view, std::mem::take(&mut samples.outlined))
    } else {
        if class == ShaftClass::Blocked {
            let front = view.front();
            let before = query.occluders.shaft(query.shaft(&front), scratch);
            if before.class() == ShaftClass::Blocked {
                samples.plan.hidden += 1;
                return DVec3::ZERO;
            }
        }
        samples.plan.cylinders_by_rays += u64::from(!told);
        Visibility::SeparateRays {
            occluders: query.occluders,
            scratch,
            query: query.shaft(&outline),
        }
    };
    let part = CylinderPart {
        view: *view,
        horizons: point.horizons(),
    };
    match closed {
        Some((lines, count, along)) => {
            let query = query.with_samples(count);
            let family = part.lines_of(&lines);
            let draw = |_, u| family.sample(u);
            samples.draws.draw_integrated(&query, lines.control, draw);
            let integral = (light.radiance, &along);
            let value = along_lines(&query, &family, integral, &mut visibility, samples);
            if let Visibility::Outline(.., memory) = visibility {
                samples.outlined = memory;
            }
            value
        }
        None => weighted(query, &part, visibility, samples),
    }
}

/// How light is integrated along the visible parts of lines.
enum Along<'p> {
    Closed(ClosedForm<'p>),
    Quadrature,
}

impl<'p> Along<'p> {
    /// `None` where a line with its peaks unknown has no integral.
    fn of<R: Reflection, T: EmissionTexture>(
        query: &Query<'p, R, T>,
        line: &Segment,
    ) -> Option<Self> {
        let point = query.point;
        if let Some(reflection) = query.light.closed_form(point) {
            return Some(Self::Closed(reflection));
        }
        let line = line.relative_to(point.position);
        let peaks = point.bsdf.peaks(&line, point.outgoing, point.normal);
        peaks.map(|_| Self::Quadrature)
    }
}

/// Whether a shaft towards the outline tells what is visible of the cylinder: where nothing that
/// was found reaches between the two. A shaft that is blocked or too dense to keep does not tell
/// what is in it.
fn is_told_by(view: &CylinderView, shaft: &Shaft<'_>) -> bool {
    match (shaft.class(), shaft.candidate_corners()) {
        (ShaftClass::Blocked, _) | (_, None) => false,
        (_, Some(mut corners)) => corners.all(|corners| view.is_clear_of(corners)),
    }
}

/// All techniques, weighted.
fn weighted<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    part: &CylinderPart,
    mut visibility: Visibility<'_>,
    samples: &mut SampleBuffers,
) -> DVec3 {
    let (instead, known) = instead(query, &mut visibility, None, samples, |_, _, _| None);
    let mut own = std::mem::take(&mut samples.cylinder);
    let mut combination = Combination {
        query,
        light: &part.view,
        visibility,
        smoothing: Smooth::new(query.estimator.weights(), &part.view),
        instead,
        known,
        buffers: samples,
    };
    combination.gather(part, &mut own);
    let sum = combination.sum(&own);
    if let Visibility::Outline(.., memory) = combination.visibility {
        samples.outlined = memory;
    }
    samples.cylinder = own.emptied();
    sum
}

/// The mean over the lines drawn, the integral along what is visible of each.
fn along_lines<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    family: &CylinderLines,
    (radiance, along): (DVec3, &Along<'_>),
    visibility: &mut Visibility<'_>,
    buffers: &mut SampleBuffers,
) -> DVec3 {
    visibility.visible(&buffers.draws.lines, &mut buffers.visible);
    buffers.count_lines();
    let SampleBuffers { draws, visible, .. } = buffers;
    let (drawn, pieces) = draws.weighted();
    let mut sum = DVec3::ZERO;
    for (i, (line, weight)) in drawn.enumerate() {
        let parts = visible.line(i);
        // Each line has a plane of its own.
        let weight = family.height(line) * weight;
        match along {
            Along::Closed(_) => pieces.add(query.point, &line.segment, parts, weight),
            Along::Quadrature => {
                let of_line = by_quadrature(&line.segment, query.point, parts, Model::Ribbon);
                sum += radiance * of_line * weight;
            }
        }
    }
    if let Along::Closed(reflection) = along {
        sum = pieces.light(radiance, 1.0, query.point, reflection);
    }
    sum / f64::from(query.samples)
}

/// What is seen of a cylinder, and the normals of the horizons, the shading normal first.
struct CylinderPart {
    view: CylinderView,
    horizons: [DVec3; 2],
}

impl CylinderPart {
    /// Along the axis, whatever the direction asked for.
    fn lines_of(&self, lines: &Lines) -> CylinderLines {
        let measure = lines.measure().on_cylinder(lines.offset);
        CylinderLines::of(&self.view, &self.horizons, measure)
    }
}

impl Domain for CylinderPart {
    type Surface = CylinderView;
    type Points = RoundPoints;
    type Lines = CylinderLines;

    fn points(&self, by: PointBy) -> RoundPoints {
        RoundPoints::on_cylinder(by, &self.view, &self.horizons)
    }

    fn lines(&self, lines: &Lines, _: f64) -> Option<CylinderLines> {
        Some(self.lines_of(lines))
    }
}

impl DrawLines<CylinderView> for CylinderLines {
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
        light: &CylinderView,
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
