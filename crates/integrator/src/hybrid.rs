//! Estimators that look into the shaft before they choose what to do.

use crate::exact::visible_light;
use crate::lines::{Along, LineBuffers};
use crate::pair::Pair;
use crate::shaft_points::ShaftPoints;
use crate::{
    Crowd, LineOptions, Plan, PlanCounters, PlannedLight, Renderer, ShadingPoint, Workspace,
    closed_form,
};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, Light};
use linelit_visibility::{Shaft, ShaftClass, ShaftQuery};

/// What is done about a light that is partly hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// The closed form over the visible part.
    Exact,
    /// Line samples.
    Lines,
    /// Points that share the shaft.
    Points(ShaftPoints),
    /// Points with a shadow ray each.
    Rays,
}

/// With fewer lines than this, asking for a shaft may take longer than rays do to the same error;
/// if it does not, points that share it do better than lines.
const FEW_LINES: u32 = 4;

/// Rays that take about as long as a line where `FEW_LINES` decides.
const RAYS_FOR_A_LINE: u32 = 2;

/// What a shaft may hold on average, for each line after the first, to be asked for in place of
/// rays.
const CANDIDATES_FOR_A_LINE: f64 = 24.0;

/// Points that share a shaft in place of a line where `FEW_LINES` decides.
const POINTS_FOR_A_LINE: u32 = 4;

/// The same as `FEW_LINES` for a crowded light, and for a dense shaft.
const FEW_LINES_IN_CROWDS: u32 = 17;

/// The same as `RAYS_FOR_A_LINE` where `FEW_LINES_IN_CROWDS` decides.
const RAYS_FOR_A_LINE_IN_CROWDS: u32 = 4;

/// Points that share a shaft in place of a line towards crowded lights.
pub(crate) const POINTS_FOR_A_LINE_IN_CROWDS: u32 = 8;

/// Where the solid angle of a piece of the light differs by no more than this from corner to
/// corner, points uniform on the area are as good as points uniform in the solid angle, and cost
/// two thirds.
const FLAT: f64 = 16.0;

/// A light is crowded if more than this share of its shafts is dense.
const CROWDED: f64 = 0.2;

/// Camera rays across and down that look for crowds.
const PROBES: u32 = 8;

/// The most lights that are looked at.
const MOST_PROBED: usize = 16;

/// Seen from a few points.
#[derive(Clone, Copy, Debug, Default)]
struct Census {
    /// Shafts towards the light.
    shafts: u32,
    /// Of which were dense.
    dense: u32,
    /// Candidates of the others.
    candidates: usize,
    /// And the edges that bound what they hide.
    edges: usize,
}

/// What stands before the lights of the plan, seen from a few points that the camera sees; empty
/// where there are too many to ask.
pub(crate) fn crowds(renderer: &Renderer<'_>) -> Vec<Crowd> {
    let lights = renderer.plan().lights();
    if lights.len() > MOST_PROBED {
        return Vec::new();
    }
    let film = &renderer.scene().film;
    let mut workspace = Workspace::new();
    let mut counts = vec![Census::default(); lights.len()];
    let place = |k: u32, size: u32| {
        let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * PROBES);
        u32::try_from(middle).unwrap_or(0)
    };
    for i in 0..PROBES * PROBES {
        let pixel = [
            place(i % PROBES, film.width),
            place(i / PROBES, film.height),
        ];
        let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
            continue;
        };
        for (light, census) in lights.iter().zip(&mut counts) {
            let Light::Area(area) = &*light.light else {
                continue;
            };
            if Plan::reaches(light, &point, &mut workspace.plan) {
                census.take(renderer, (light, area), &point, &mut workspace);
            }
        }
    }
    counts.into_iter().map(Census::crowd).collect()
}

impl Census {
    /// Looks at a light from a point.
    fn take(
        &mut self,
        renderer: &Renderer<'_>,
        (light, area): (&PlannedLight, &AreaLight),
        point: &ShadingPoint,
        workspace: &mut Workspace,
    ) {
        let query = ShaftQuery {
            point: point.position,
            light: (&area.polygon).into(),
            exclude: light.triangles.clone(),
        };
        let shaft = renderer.occluders().shaft(query, &mut workspace.scratch);
        self.shafts += 1;
        self.dense += u32::from(shaft.is_dense());
        if let Some(images) = shaft.images() {
            let penumbra = &mut workspace.penumbra;
            penumbra.boundary(images.light(), images.triangles());
            self.candidates += shaft.candidates();
            self.edges += penumbra.edge_count();
        }
    }

    fn crowd(self) -> Crowd {
        let dense = f64::from(self.dense) > CROWDED * f64::from(self.shafts);
        if self.candidates == 0 {
            let none = Crowd::default();
            return Crowd { dense, ..none };
        }
        #[allow(clippy::cast_precision_loss, reason = "a few hundred shafts")]
        let (edges, candidates) = (self.edges as f64, self.candidates as f64);
        Crowd {
            dense,
            candidates: candidates / f64::from(self.shafts),
            edges: edges / candidates,
        }
    }
}

/// Lines that take as long as the closed form, for each candidate and for each edge that bounds
/// what candidates hide: measured.
const LINES_FOR_A_CANDIDATE: f64 = 0.6;
const LINES_FOR_AN_EDGE: f64 = 1.4;

/// The same for each edge where the surface has a lobe, before a light that is narrow for the lobe, and
/// before a wide one.
const LINES_FOR_A_NARROW_LOBE: f64 = 2.0;
const LINES_FOR_A_WIDE_LOBE: f64 = 80.0;

/// A light is wide for a lobe from this many times its width, 1/√(k + 1), on.
const WIDE_FOR_LOBES: f64 = 3.0;

/// What to do about a partly hidden light, by what the shaft and the number of lines say.
fn cheapest(shaft: &Shaft<'_>, edges: f64, for_an_edge: f64, lines: u32) -> Way {
    if shaft.is_dense() {
        return if lines < FEW_LINES_IN_CROWDS {
            Way::Rays
        } else {
            Way::Lines
        };
    }
    let each = LINES_FOR_A_CANDIDATE + for_an_edge * edges;
    #[allow(clippy::cast_precision_loss, reason = "a few hundred")]
    let lines_of_exact = each * shaft.candidates() as f64;
    if lines_of_exact <= f64::from(lines) {
        Way::Exact
    } else {
        Way::Lines
    }
}

impl Pair<'_> {
    /// Rays where looking for everything in between does not pay; else what the shaft suggests.
    pub(crate) fn hybrid(&self, area: &AreaLight, workspace: &mut Workspace) -> DVec3 {
        let lines = self.count();
        if self.light.crowd.dense && lines < FEW_LINES {
            return self.many_rays(area, RAYS_FOR_A_LINE_IN_CROWDS, workspace);
        }
        if self.light.crowd.dense && lines < FEW_LINES_IN_CROWDS {
            let each = POINTS_FOR_A_LINE_IN_CROWDS;
            let points = Way::Points(self.cheap_points(area));
            return Pair { each, ..*self }.by_shaft(area, workspace, |_| points);
        }
        let affordable = CANDIDATES_FOR_A_LINE * f64::from(lines - 1);
        if lines < FEW_LINES && self.light.crowd.candidates < affordable {
            let each = POINTS_FOR_A_LINE;
            let points = Way::Points(ShaftPoints::Area);
            return Pair { each, ..*self }.by_shaft(area, workspace, |_| points);
        }
        if lines < FEW_LINES {
            return self.many_rays(area, RAYS_FOR_A_LINE, workspace);
        }
        let for_an_edge = self.lines_for_an_edge(area);
        self.by_shaft(area, workspace, |shaft| {
            cheapest(shaft, self.light.crowd.edges, for_an_edge, lines)
        })
    }

    /// Lines that take as long as an edge in the closed form.
    fn lines_for_an_edge(&self, area: &AreaLight) -> f64 {
        let reflection = self.point.bsdf.closed_form();
        let Some(phong) = reflection.and_then(|reflection| reflection.lobe) else {
            return LINES_FOR_AN_EDGE;
        };
        let vertices = area.polygon.vertices();
        let first = (vertices[0] - self.point.position).normalize_or_zero();
        let chord = |v: &DVec3| first.distance((*v - self.point.position).normalize_or_zero());
        let size = vertices.iter().map(chord).fold(0.0, f64::max);
        let for_a_lobe = if size * (phong.exponent + 1.0).sqrt() < WIDE_FOR_LOBES {
            LINES_FOR_A_NARROW_LOBE
        } else {
            LINES_FOR_A_WIDE_LOBE
        };
        LINES_FOR_AN_EDGE + for_a_lobe
    }

    /// Points that reach an error first.
    fn cheap_points(&self, area: &AreaLight) -> ShaftPoints {
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for corner in area.polygon.vertices() {
            let to_corner = *corner - self.point.position;
            let square = to_corner.length_squared();
            let density = area.polygon.normal().dot(to_corner).abs() / (square * square.sqrt());
            (least, most) = (least.min(density), most.max(density));
        }
        if most <= FLAT * least {
            ShaftPoints::Area
        } else {
            ShaftPoints::SolidAngle
        }
    }

    /// Rays in place of lines, `each` for one: to crowded lights uniform in the solid angle.
    fn many_rays(&self, area: &AreaLight, each: u32, workspace: &mut Workspace) -> DVec3 {
        let pair = Pair { each, ..*self };
        if each == RAYS_FOR_A_LINE {
            pair.points_by_area(area, workspace)
        } else {
            pair.points_by_solid_angle(area, workspace)
        }
    }

    /// Asks for the shaft and goes the way that `choose` picks by it where the light is partly
    /// hidden; elsewhere the answer needs no samples.
    ///
    /// What `choose` is told (the candidates, or that there are too many to keep) depends on
    /// geometry alone, never on random numbers: whatever it picks, the estimate stays unbiased.
    pub(crate) fn by_shaft(
        &self,
        area: &AreaLight,
        workspace: &mut Workspace,
        choose: impl FnOnce(&Shaft<'_>) -> Way,
    ) -> DVec3 {
        let Workspace {
            scratch,
            plan,
            penumbra,
            draws,
            visible,
            segments,
            ..
        } = workspace;
        let mut shaft = self.occluders.shaft(self.query(area), scratch);
        if let Some(value) = self.without_samples(area, shaft.class(), self.along(), plan) {
            return value;
        }
        let way = choose(&shaft);
        if way == Way::Exact
            && let Some(reflection) = self.light.closed_form(self.point)
            && let Some(images) = shaft.images()
        {
            plan.exact_penumbrae += 1;
            let tolerance = self.tolerance();
            return visible_light(area, self.point, &reflection, &images, penumbra, tolerance);
        }
        match way {
            Way::Points(points) => self.points_in_shaft(area, points, &mut shaft),
            Way::Rays => self.many_rays(area, RAYS_FOR_A_LINE_IN_CROWDS, workspace),
            Way::Exact | Way::Lines => {
                plan.exact_fallbacks += u64::from(way == Way::Exact);
                let buffers = LineBuffers {
                    draws,
                    visible,
                    plan,
                    segments,
                };
                let lines = (LineOptions::default(), self.along());
                self.lines_in_shaft(area, lines, &mut shaft, buffers)
            }
        }
    }

    /// The light where the shaft's class says it all: nothing, or the whole light in closed form if
    /// there is one.
    pub(crate) fn without_samples(
        &self,
        area: &AreaLight,
        class: ShaftClass,
        along: Along,
        plan: &mut PlanCounters,
    ) -> Option<DVec3> {
        match class {
            ShaftClass::Blocked => {
                plan.hidden += 1;
                Some(DVec3::ZERO)
            }
            ShaftClass::Empty => {
                plan.unoccluded += 1;
                let Along::Analytic(reflection) = along else {
                    return None;
                };
                plan.closed_form += 1;
                let tolerance = self.tolerance();
                Some(closed_form::whole_light(
                    area,
                    self.point,
                    &reflection,
                    tolerance,
                ))
            }
            ShaftClass::Partial => None,
        }
    }

    /// Without a closed form, one point of each line's visible part.
    pub(crate) fn along(&self) -> Along {
        self.light
            .closed_form(self.point)
            .map_or(Along::Point, Along::Analytic)
    }
}
