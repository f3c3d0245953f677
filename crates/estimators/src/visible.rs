//! This module answers queries about the visibility between one shading point and one light, from
//! one shaft or by a traversal of the hierarchy for each query.

use crate::view::{LightView, Shape};
use crate::{PlanCounters, ShaftAnswer, VisibilityBy};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{CylinderView, LightPoint};
use linelit_visibility::{
    LightCorners, Occluders, Scratch, Shaft, ShaftClass, ShaftQuery, VisibleLines,
};

/// The visibility between one shading point and one light.
pub(crate) struct Visible<'a> {
    occluders: &'a Occluders,
    view: &'a LightView<'a>,
    source: Source<'a>,
}

/// Where the answers come from.
enum Source<'a> {
    /// Each line and each point traverses the hierarchy by itself.
    Rays(&'a mut Scratch),
    /// One shaft answers all queries. If it leads to the outline of a cylinder, lines are mapped to
    /// where the shading point sees them on the outline.
    Shaft(Shaft<'a>, Option<&'a CylinderView>),
}

/// The way in which visibility queries give the position of a point of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// The vector from the shading point to the point.
    ToLight,
    /// The point in world space.
    Point,
}

impl Target {
    /// Returns the position of a point in this form.
    #[inline]
    pub(crate) const fn of(self, at: &LightPoint) -> DVec3 {
        match self {
            Self::ToLight => at.to_light,
            Self::Point => at.point,
        }
    }
}

impl<'a> Visible<'a> {
    /// Prepares for queries. A shaft traverses the hierarchy here, once; it leads to the part of a
    /// polygon above the horizons, if the view has it.
    pub(crate) fn new(
        occluders: &'a Occluders,
        view: &'a LightView<'a>,
        ask: VisibilityBy,
        scratch: &'a mut Scratch,
        counters: &mut PlanCounters,
    ) -> Self {
        if ask == VisibilityBy::Rays {
            return Self::rays(occluders, view, scratch);
        }
        let shaft = |corners: LightCorners<'_>, scratch: &'a mut Scratch| {
            Source::Shaft(occluders.shaft(query(view, corners), scratch), None)
        };
        let source = match view.shape {
            // A sky has all directions and a delta light has one; no shaft leads to either.
            Shape::Sky(_) | Shape::DeltaSample(_) => Source::Rays(scratch),
            Shape::Polygon(polygon) => {
                let polygon = view.above.map_or(polygon, |above| &above.polygon);
                shaft(polygon.into(), scratch)
            }
            Shape::Segment(line) => shaft((&[line.p0, line.p1]).into(), scratch),
            Shape::Disk(disk) => shaft((&disk.around()).into(), scratch),
            // A sphere is its outline if no triangle reaches between the outline and the sphere.
            Shape::Sphere(sphere) => match sphere.outline(view.at.position) {
                None => Source::Rays(scratch),
                Some(disk) => {
                    let before = sphere.before(view.at.position).map(|disk| disk.around());
                    let before = before.as_ref().map(Into::into);
                    let (around, is_clear) = (disk.around(), |c| sphere.is_clear_of(c));
                    let source =
                        outlined(occluders, view, (&around).into(), before, is_clear, scratch);
                    counters.spheres_by_rays += u64::from(matches!(source, Source::Rays(_)));
                    source
                }
            },
            // So is a cylinder.
            Shape::Cylinder(cylinder) => {
                let (outline, front) = (cylinder.outline(), cylinder.front());
                let (ends, before) = ((&outline).into(), Some((&front).into()));
                let is_clear = |corners| cylinder.is_clear_of(corners);
                match outlined(occluders, view, ends, before, is_clear, scratch) {
                    Source::Shaft(shaft, _) => Source::Shaft(shaft, Some(cylinder)),
                    source => {
                        counters.cylinders_by_rays += 1;
                        source
                    }
                }
            }
        };
        Self {
            occluders,
            view,
            source,
        }
    }

    /// Answers each query by a traversal of its own.
    pub(crate) const fn rays(
        occluders: &'a Occluders,
        view: &'a LightView<'a>,
        scratch: &'a mut Scratch,
    ) -> Self {
        Self {
            occluders,
            view,
            source: Source::Rays(scratch),
        }
    }

    /// Returns what the shaft found between the point and the light.
    pub(crate) fn between(&self) -> ShaftAnswer {
        match &self.source {
            Source::Rays(_) => ShaftAnswer {
                class: ShaftClass::Partial,
                is_dense: false,
                candidates: 0,
                has_region: false,
            },
            Source::Shaft(shaft, cylinder) => {
                let is_empty = shaft.class() == ShaftClass::Empty;
                ShaftAnswer {
                    class: shaft.class(),
                    is_dense: shaft.is_dense(),
                    candidates: shaft.candidates(),
                    has_region: match cylinder {
                        Some(cylinder) => is_empty && self.view.is_above(cylinder),
                        None => is_empty || shaft.has_front(),
                    },
                }
            }
        }
    }

    /// Returns the same visibility, with a traversal for each query from now on.
    pub(crate) fn into_rays(self) -> Self {
        let scratch = match self.source {
            Source::Rays(scratch) => scratch,
            Source::Shaft(shaft, _) => shaft.into_scratch(),
        };
        Self::rays(self.occluders, self.view, scratch)
    }

    /// The shaft that answers all queries; `None` if there is none.
    pub(crate) const fn shaft(&mut self) -> Option<&mut Shaft<'a>> {
        match &mut self.source {
            Source::Shaft(shaft, _) => Some(shaft),
            Source::Rays(_) => None,
        }
    }

    /// Finds the visible parts of lines on the light.
    pub(crate) fn lines(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        let scratch = match &mut self.source {
            Source::Shaft(shaft, None) => return shaft.visible(lines, out),
            Source::Shaft(shaft, Some(cylinder)) => {
                let flat: Vec<_> = lines
                    .iter()
                    .map(|line| cylinder.onto_outline(line))
                    .collect();
                return shaft.visible(&flat, out);
            }
            Source::Rays(scratch) => scratch,
        };
        out.clear();
        let mut one = VisibleLines::new();
        for line in lines {
            // A shaft towards one line is a triangle, which holds less than a shaft towards the
            // light.
            let ends = [line.p0, line.p1];
            let mut shaft = self.occluders.shaft(query(self.view, &ends), scratch);
            shaft.visible(std::slice::from_ref(line), &mut one);
            out.append(&one);
        }
    }

    /// The form in which [`points`](Self::points) takes the positions of points.
    pub(crate) const fn target(&self) -> Target {
        match self.source {
            Source::Rays(_) => Target::ToLight,
            Source::Shaft(..) => Target::Point,
        }
    }

    /// Returns a bit for each of up to 64 points of the light, which is set if the point is
    /// visible. The points are given in the form of [`target`](Self::target).
    pub(crate) fn points(&mut self, targets: &[DVec3]) -> u64 {
        match &mut self.source {
            Source::Rays(scratch) => {
                let view = self.view;
                let fan = self
                    .occluders
                    .shadow_rays(view.at.position, targets, view.margins);
                fan.all() & !self.occluders.any_hits(&fan, view.own, scratch)
            }
            Source::Shaft(shaft, _) => {
                let bit = |(i, at): (u32, &DVec3)| u64::from(shaft.point_visible(*at)) << i;
                (0..u64::BITS).zip(targets).map(bit).fold(0, |a, b| a | b)
            }
        }
    }
}

/// The query for the shaft between the shading point and these corners.
pub(crate) fn query<'b>(
    view: &LightView<'_>,
    corners: impl Into<LightCorners<'b>>,
) -> ShaftQuery<'b> {
    ShaftQuery {
        point: view.at.position,
        light: corners.into(),
        exclude: view.own.clone(),
        margins: view.margins,
    }
}

/// Finds how to answer queries about a light that is seen as its outline, which is flat.
///
/// The shaft towards the outline answers them if none of its triangles reaches between the outline
/// and the light, where it could hide a part of one but not of the other. If that shaft is blocked,
/// a triangle may still be behind the near side of the light; so a second shaft leads to `before`,
/// a shape in front of the light. If that is blocked, the light is wholly hidden. In all other
/// cases each query has rays of its own.
fn outlined<'a>(
    occluders: &'a Occluders,
    view: &LightView<'_>,
    outline: LightCorners<'_>,
    before: Option<LightCorners<'_>>,
    is_clear: impl FnMut([DVec3; 3]) -> bool,
    scratch: &'a mut Scratch,
) -> Source<'a> {
    let shaft = occluders.shaft(query(view, outline), scratch);
    let is_blocked = shaft.class() == ShaftClass::Blocked;
    // The triangles of a blocked or dense shaft are not collected, so that they cannot be checked.
    let corners = shaft.candidate_corners().filter(|_| !is_blocked);
    if corners.is_some_and(|mut corners| corners.all(is_clear)) {
        return Source::Shaft(shaft, None);
    }
    let scratch = shaft.into_scratch();
    let (true, Some(before)) = (is_blocked, before) else {
        return Source::Rays(scratch);
    };
    let shaft = occluders.shaft(query(view, before), scratch);
    match shaft.class() {
        ShaftClass::Blocked => Source::Shaft(shaft, None),
        ShaftClass::Empty | ShaftClass::Partial => Source::Rays(shaft.into_scratch()),
    }
}
