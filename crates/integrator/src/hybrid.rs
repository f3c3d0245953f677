//! Estimators that look into the shaft before they choose what to do.

use crate::exact::visible_light;
use crate::lines::{self, Along, Streams};
use crate::pair::Pair;
use crate::shaft_points::ShaftPoints;
use crate::{LineOptions, Workspace, closed_form};
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_samplers::{Sampler, SamplerKind};
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

/// The way that takes the least time to a given error, by what the shaft and the number of samples
/// say.
pub(crate) fn cheapest(shaft: &Shaft<'_>, samples: u32) -> Way {
    if shaft.is_dense() {
        return if samples < 64 { Way::Rays } else { Way::Lines };
    }
    if shaft.candidates() <= 2 * samples as usize {
        Way::Exact
    } else {
        Way::Lines
    }
}

impl Pair<'_> {
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
        let query = ShaftQuery {
            point: self.point.position,
            light: area.polygon.vertices(),
            exclude: self.light.triangles.clone(),
        };
        let Workspace {
            scratch,
            plan,
            penumbra,
            draws,
            visible,
            segments,
            ..
        } = workspace;
        let mut shaft = self.occluders.shaft(query, scratch);
        let way = match shaft.class() {
            ShaftClass::Blocked => {
                plan.hidden += 1;
                return DVec3::ZERO;
            }
            ShaftClass::Empty => {
                plan.unoccluded += 1;
                if let Some(value) = closed_form::whole_light(area, self.point) {
                    plan.closed_form += 1;
                    return value;
                }
                choose(&shaft)
            }
            ShaftClass::Partial => choose(&shaft),
        };
        if way == Way::Exact
            && closed_form::has_closed_form(&self.point.bsdf)
            && let Some(images) = shaft.images()
        {
            plan.exact_penumbrae += 1;
            return visible_light(area, self.point, &images, penumbra);
        }
        match way {
            Way::Points(points) => self.points_in_shaft(area, points, &mut shaft),
            Way::Rays => self.points_by_solid_angle(area, workspace),
            Way::Exact | Way::Lines => {
                plan.exact_fallbacks += u64::from(way == Way::Exact);
                let along = self.along();
                let set = self.samples();
                let orientations = Sampler::new(SamplerKind::Independent, self.settings.seed);
                let streams = Streams {
                    samples: &set,
                    two_dimensional: along == Along::Point,
                    orientations: &orientations,
                    key: (self.pixel, self.dimension),
                    count: self.count(),
                };
                draws.draw(area, LineOptions::default(), &streams);
                shaft.visible(&draws.lines, visible);
                let gathered = lines::gather(area, self.point, along, draws, |i| visible.line(i));
                *segments += gathered.segments;
                plan.hidden_lines += gathered.hidden;
                gathered.sum / f64::from(self.count())
            }
        }
    }

    /// Without a closed form, one point of each line's visible part.
    fn along(&self) -> Along {
        if closed_form::has_closed_form(&self.point.bsdf) {
            Along::Analytic
        } else {
            Along::Point
        }
    }
}
