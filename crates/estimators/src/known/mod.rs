//! The integral of the known part of the light is found here, along lines or over the visible
//! region of a light. The folder has one file for each kind of integral.

pub(crate) mod boundary;
pub(crate) mod disk;
pub(crate) mod lines;
pub(crate) mod region;
pub(crate) mod segment;

use crate::draw::lines::Use;
use crate::streams::Samples;
use crate::view::{LightView, Shape};
use crate::visible::Visible;
use crate::{EmissionTexture, KnownIntegrand, KnownOver, Lines, Query, ShadingPoint, WorkCounters};
use linelit_bsdf::{ClosedForm, LtcMixture, Reflection};
use linelit_geometry::DVec3;
use linelit_lights::{
    DeltaSample, LineDensity, LineFamily, LineSample, LineSetup, NoTexture, Surface,
};
use linelit_shading::quadrature::Model;
use linelit_visibility::ShaftClass;
use lines::LineMemory;
use region::{KnownLight, RegionMemory};

/// The memory of integrals, which is reused.
#[derive(Debug, Default)]
pub(crate) struct KnownMemory {
    pub lines: LineMemory,
    pub region: RegionMemory,
}

/// Integrates the known part of the light of a query, as its method says. `None` if the visible
/// region of a round light is too narrow for that ([`Method::otherwise`](crate::Method)). LTCs are
/// integrated over the part of a polygon above the horizons, if the view has that part.
pub(crate) fn over<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    view: &LightView<'_>,
    known: &KnownOver<'_>,
    cosines: Option<&LtcMixture>,
    visible: &mut Visible<'_>,
    memory: &mut KnownMemory,
    counts: &mut WorkCounters,
) -> Option<KnownLight> {
    let KnownMemory { lines, region } = memory;
    let form = || query.point.known().closed_form();
    let (emitted, _) = view.emitted();
    let mut plane = None;
    let light = match known {
        KnownOver::Nothing => DVec3::ZERO,
        KnownOver::Ray => match &view.shape {
            Shape::DeltaSample(of) => beam(query.point, of, visible),
            _ => return None,
        },
        KnownOver::Lines {
            lines: options,
            count,
            of,
        } => {
            // Draw lines, find their visible parts, and integrate along them.
            draw(query, view, options, *count, lines);
            lines.ask(visible, counts);
            let sum = match of {
                KnownIntegrand::Quadrature => by_quadrature(query, view, options, lines),
                KnownIntegrand::Reflection | KnownIntegrand::Cosines => {
                    closed(view, &form()?, options, lines)
                }
            };
            sum / f64::from(*count)
        }
        KnownOver::Region(KnownIntegrand::Cosines) => {
            // Integrate LTCs over the visible region of a polygon, or of the disk of a round light.
            let (cosines, shaft) = (cosines?, visible.shaft()?);
            let over = match (view.polygon(), view.above) {
                (Some(polygon), None) => region::cosines(view, polygon, cosines, shaft, region),
                (_, Some(above)) => region::cosines(view, &above.polygon, cosines, shaft, region),
                (None, None) => disk::cosines(view, cosines, shaft, region),
            };
            let over = over?;
            plane = over.plane;
            emitted * over.light
        }
        KnownOver::Region(of) => {
            // Integrate the reflection itself over the visible region.
            let (lines, region) = (&mut *lines, &mut *region);
            reflected_of_region(query, view, *of, visible, (lines, region, counts))?
        }
    };
    Some(KnownLight { light, plane })
}

/// Integrates the reflection itself over the visible region of a light: of a linear light, or of
/// any light on a reflection with a closed form.
fn reflected_of_region<R: Reflection, T>(
    query: &Query<'_, R, T>,
    view: &LightView<'_>,
    of: KnownIntegrand,
    visible: &mut Visible<'_>,
    (lines, region, counts): (&mut LineMemory, &mut RegionMemory, &mut WorkCounters),
) -> Option<DVec3> {
    let form = || query.point.known().closed_form();
    let (emitted, _) = view.emitted();
    // The visible region of a linear light is the visible parts of one line.
    if let Shape::Segment(line) = view.shape {
        visible.lines(&[*line], &mut lines.visible);
        counts.count_lines(&lines.visible, 1);
        let (parts, point) = (lines.visible.line(0), query.point);
        let sum = match of {
            KnownIntegrand::Quadrature => {
                segment::by_quadrature(line, point, parts, Model::Cylinder)
            }
            KnownIntegrand::Reflection | KnownIntegrand::Cosines => {
                segment::closed(view, line, &form()?, parts)
            }
        };
        return Some(emitted * sum);
    }
    // On a surface, take the closed form for its shape.
    let (form, shaft) = (form()?, visible.shaft()?);
    let diffuse = form.diffuse.value();
    let irradiance = match view.shape {
        // A cylinder gets here only where all of it is visible and above the horizons, and round
        // lights only on a diffuse surface.
        Shape::Cylinder(cylinder) => segment::whole_cylinder(view, cylinder),
        Shape::Sphere(_) | Shape::Disk(_) => disk::irradiance(view, query.skip, shaft, region)?,
        _ if shaft.class() == ShaftClass::Empty => {
            // The order of the factors matters for the last bits of the product.
            return Some(emitted * region::whole(view, &form));
        }
        _ => {
            let (flat, lobes) = region::reflected(view, &form, shaft, region)?;
            return Some(emitted * diffuse * flat + emitted * lobes);
        }
    };
    Some(emitted * diffuse * irradiance)
}

/// The light of a delta light, with one shadow ray if it shines on the point.
pub(crate) fn beam<R: Reflection>(
    point: &ShadingPoint<R>,
    beam: &DeltaSample,
    visible: &mut Visible<'_>,
) -> DVec3 {
    let light = point.reflected(beam.irradiance, beam.direction);
    if light == DVec3::ZERO || visible.points(&[beam.to_light]) == 0 {
        return DVec3::ZERO;
    }
    light
}

/// Draws lines with integrals on a polygon, or along the axis of a cylinder.
fn draw<R, T>(
    query: &Query<'_, R, T>,
    view: &LightView<'_>,
    options: &Lines,
    count: u32,
    memory: &mut LineMemory,
) {
    let (numbers, draws) = (&query.numbers, &mut memory.draws);
    let from = Samples { numbers, count };
    if let Some(polygon) = view.polygon() {
        draws.draw(
            polygon,
            options,
            &query.light.occlusion,
            from,
            Use::Integrals,
        );
    } else if let Some(family) = on_cylinder(view, options) {
        let line = |_, u| family.sample(u);
        draws.draw_each(from, Use::Integrals, options.control, line);
    }
}

/// The family of lines along the axis of a cylinder, for any direction of the lines' options;
/// `None` for other lights.
fn on_cylinder<'v>(view: &'v LightView<'_>, lines: &Lines) -> Option<LineFamily<'v>> {
    let Shape::Cylinder(cylinder) = view.shape else {
        return None;
    };
    let setup = LineSetup {
        fraction: 0.0,
        angle: 0.0,
        fixed: false,
        offset: lines.offset,
    };
    let (surface, viewer) = (Surface::Cylinder(cylinder), view.at.viewer());
    LineFamily::new::<NoTexture>(LineDensity::Area, surface, None, setup, &viewer)
}

/// The sum over lines of their integrals in closed form.
fn closed(
    view: &LightView<'_>,
    form: &ClosedForm<'_>,
    options: &Lines,
    memory: &mut LineMemory,
) -> DVec3 {
    let (pieces, visible) = (&mut memory.pieces, &memory.visible);
    let family = on_cylinder(view, options);
    // Each line of a cylinder is seen in a plane of its own.
    let height = |line: &LineSample| family.as_ref().map_or(1.0, |family| family.height(line));
    lines::gather(view, form, height, &memory.draws, pieces, |i| {
        visible.line(i)
    })
}

/// The sum over the lines of a cylinder of their integrals by quadrature.
fn by_quadrature<R: Reflection, T>(
    query: &Query<'_, R, T>,
    view: &LightView<'_>,
    options: &Lines,
    memory: &LineMemory,
) -> DVec3 {
    let Some(family) = on_cylinder(view, options) else {
        return DVec3::ZERO;
    };
    let (radiance, _) = view.emitted();
    let each = memory.draws.samples.iter().enumerate().map(|(i, drawn)| {
        let (line, parts) = (&drawn.line, memory.visible.line(i));
        let of_line = segment::by_quadrature(&line.segment, query.point, parts, Model::Ribbon);
        radiance * of_line * (family.height(line) * (drawn.share / line.pdf.value()))
    });
    each.sum()
}
