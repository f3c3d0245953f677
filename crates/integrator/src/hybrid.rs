//! Estimators that look into the shaft before they choose what to do.

use crate::exact::visible_light;
use crate::lines::{Along, LineBuffers};
use crate::pair::Pair;
use crate::shaft_points::ShaftPoints;
use crate::{LineOptions, Plan, Renderer, Workspace, closed_form};
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

/// With fewer lines than this, asking for a shaft at all takes longer than rays do to the same
/// error.
const FEW_LINES: u32 = 4;

/// The same for a crowded light, and for a dense shaft.
const FEW_LINES_IN_CROWDS: u32 = 16;

/// Rays that take about as long as a line where `FEW_LINES` decides.
const RAYS_FOR_A_LINE: u32 = 2;

/// The same where `FEW_LINES_IN_CROWDS` does.
const RAYS_FOR_A_LINE_IN_CROWDS: u32 = 4;

/// A light is crowded if more than this share of its shafts is dense.
const CROWDED: f64 = 0.2;

/// Camera rays across and down that look for crowds.
const PROBES: u32 = 8;

/// The most lights that are looked at.
const MOST_PROBED: usize = 16;

/// Which lights of the plan are crowded, seen from a few points that the camera sees; empty where
/// there are too many to ask.
pub(crate) fn crowded(renderer: &Renderer<'_>) -> Vec<bool> {
    let lights = renderer.plan().lights();
    if lights.len() > MOST_PROBED {
        return Vec::new();
    }
    let film = &renderer.scene().film;
    let mut workspace = Workspace::new();
    let mut counts = vec![(0u32, 0u32); lights.len()];
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
        for (light, (dense, all)) in lights.iter().zip(&mut counts) {
            let Light::Area(area) = &light.light else {
                continue;
            };
            if !Plan::reaches(light, &point, &mut workspace.plan) {
                continue;
            }
            let query = ShaftQuery {
                point: point.position,
                light: area.polygon.vertices(),
                exclude: light.triangles.clone(),
            };
            let shaft = renderer.occluders().shaft(query, &mut workspace.scratch);
            *all += 1;
            *dense += u32::from(shaft.is_dense());
        }
    }
    let crowded = |(dense, all): (u32, u32)| f64::from(dense) > CROWDED * f64::from(all);
    counts.into_iter().map(crowded).collect()
}

/// What to do about a partly hidden light, by what the shaft and the number of lines say.
fn cheapest(shaft: &Shaft<'_>, lines: u32) -> Way {
    if shaft.is_dense() {
        return if lines < FEW_LINES_IN_CROWDS {
            Way::Rays
        } else {
            Way::Lines
        };
    }
    // Measured: as many lines take the time of the closed form. Meshes, whose triangles share
    // edges, take half of that, loose triangles up to twice as much; a shaft that is not dense has
    // a few hundred candidates at most.
    let candidates = u32::try_from(shaft.candidates()).unwrap_or(u32::MAX);
    let squared = candidates.saturating_mul(candidates);
    let lines_of_exact = candidates.saturating_mul(2).saturating_add(squared / 30);
    if lines_of_exact <= lines {
        Way::Exact
    } else {
        Way::Lines
    }
}

impl Pair<'_> {
    /// Rays where looking for everything in between does not pay; else what the shaft suggests.
    pub(crate) fn hybrid(&self, area: &AreaLight, workspace: &mut Workspace) -> DVec3 {
        let lines = self.count();
        if self.light.crowded && lines < FEW_LINES_IN_CROWDS {
            let each = RAYS_FOR_A_LINE_IN_CROWDS;
            if 2 * lines < FEW_LINES_IN_CROWDS {
                return self.many_rays(area, each, workspace);
            }
            let points = Way::Points(ShaftPoints::SolidAngle);
            return Pair { each, ..*self }.by_shaft(area, workspace, |_| points);
        }
        if lines < FEW_LINES {
            return self.many_rays(area, RAYS_FOR_A_LINE, workspace);
        }
        self.by_shaft(area, workspace, |shaft| cheapest(shaft, lines))
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
        let way = match shaft.class() {
            ShaftClass::Blocked => {
                plan.hidden += 1;
                return DVec3::ZERO;
            }
            ShaftClass::Empty => {
                plan.unoccluded += 1;
                if self.light.has_closed_form(&self.point.bsdf)
                    && let Some(value) = closed_form::whole_light(area, self.point)
                {
                    plan.closed_form += 1;
                    return value;
                }
                choose(&shaft)
            }
            ShaftClass::Partial => choose(&shaft),
        };
        if way == Way::Exact
            && self.light.has_closed_form(&self.point.bsdf)
            && let Some(images) = shaft.images()
        {
            plan.exact_penumbrae += 1;
            return visible_light(area, self.point, &images, penumbra);
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

    /// Without a closed form, one point of each line's visible part.
    fn along(&self) -> Along {
        if self.light.has_closed_form(&self.point.bsdf) {
            Along::Analytic
        } else {
            Along::Point
        }
    }
}
