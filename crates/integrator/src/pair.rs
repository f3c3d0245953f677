//! One shading point and one light: where an estimator is chosen.

use crate::hybrid::Way;
use crate::lines::{Along, LineBuffers};
use crate::{
    Estimator, LineOptions, LinearOptions, PlannedLight, Settings, ShadingPoint, ShaftPoints,
    Workspace, closed_form,
};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::DVec3;
use linelit_lights::linear::LinearTechnique;
use linelit_lights::{AreaLight, Light, LinearLight};
use linelit_samplers::{SampleSet, Sampler};
use linelit_visibility::{Occluders, ShaftQuery};

/// One shading point and one light: what an estimator works on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<'a> {
    /// What may stand between.
    pub occluders: &'a Occluders,
    /// Estimator, pattern, samples, seed.
    pub settings: &'a Settings,
    /// The light.
    pub light: &'a PlannedLight,
    /// The shading point.
    pub point: &'a ShadingPoint,
    /// The pixel and the first dimension name the pair's random numbers.
    pub pixel: [u32; 2],
    /// See `pixel`.
    pub dimension: u32,
    /// How many samples are taken in place of each that was asked for.
    pub each: u32,
}

impl Pair<'_> {
    /// What the light sends from the shading point to its viewer.
    pub(crate) fn estimate(&self, workspace: &mut Workspace) -> DVec3 {
        match &*self.light.light {
            Light::Area(area) => self.area_light(area, workspace),
            Light::Linear(linear) => self.linear_light(linear, workspace),
            Light::Sphere(sphere) => self.sphere_light(sphere, workspace),
            Light::Disk(disk) => self.disk_light(disk, workspace),
        }
    }

    /// The light's estimator.
    pub(crate) fn estimator(&self) -> &Estimator {
        self.light
            .estimator
            .as_ref()
            .unwrap_or(&self.settings.estimator)
    }

    /// The relative accuracy of closed forms.
    pub(crate) fn tolerance(&self) -> f64 {
        match self.estimator() {
            Estimator::Exact(options) => options.tolerance,
            _ => closed_form::TOLERANCE,
        }
    }

    /// The number of samples.
    pub(crate) fn count(&self) -> u32 {
        self.settings.samples.max(1).saturating_mul(self.each)
    }

    /// The samples.
    pub(crate) fn samples(&self) -> SampleSet {
        Sampler::new(self.settings.sampler, self.settings.seed).points(
            self.pixel,
            self.dimension,
            self.count(),
        )
    }

    fn area_light(&self, area: &AreaLight, workspace: &mut Workspace) -> DVec3 {
        match *self.estimator() {
            Estimator::PointArea | Estimator::PointVisibleArea => {
                self.points_by_area(area, workspace)
            }
            Estimator::PointSolidAngle | Estimator::PointLinear(_) => {
                self.points_by_solid_angle(area, workspace)
            }
            Estimator::PointProjectedSolidAngle => {
                self.points_by_projected_solid_angle(area, workspace)
            }
            Estimator::PointBsdf => self.points_by_bsdf(area, workspace),
            Estimator::LineArea(options) => self.lines(area, options, Along::Point, workspace),
            Estimator::LineAnalytic(options) => self.lines(area, options, self.along(), workspace),
            Estimator::Mix(mix) => self.mix(area, &mix, workspace),
            Estimator::ShaftPoints(points) => {
                self.by_shaft(area, workspace, |_| Way::Points(points))
            }
            Estimator::Exact(options) => self.by_shaft(area, workspace, |shaft| options.way(shaft)),
            Estimator::Hybrid => self.hybrid(area, workspace),
        }
    }

    /// Line samples: all of them in one query.
    pub(crate) fn lines(
        &self,
        area: &AreaLight,
        options: LineOptions,
        along: Along,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let Workspace {
            scratch,
            visible,
            draws,
            plan,
            segments,
            ..
        } = workspace;
        let mut shaft = self.occluders.shaft(self.query(area), scratch);
        if self.settings.skip
            && let Some(value) = self.without_samples(area, shaft.class(), along, plan)
        {
            return value;
        }
        let buffers = LineBuffers {
            draws,
            visible,
            plan,
            segments,
        };
        self.lines_in_shaft(area, (options, along), &mut shaft, buffers)
    }

    /// What is asked about an area light.
    pub(crate) fn query<'b>(&self, area: &'b AreaLight) -> ShaftQuery<'b> {
        ShaftQuery {
            point: self.point.position,
            light: (&area.polygon).into(),
            exclude: self.light.triangles.clone(),
        }
    }

    fn linear_light(&self, linear: &LinearLight, workspace: &mut Workspace) -> DVec3 {
        match *self.estimator() {
            Estimator::PointArea
            | Estimator::PointVisibleArea
            | Estimator::ShaftPoints(ShaftPoints::Area) => {
                let by_length = LinearOptions::Technique(LinearTechnique::Area);
                self.points_on_line(linear, by_length, workspace)
            }
            Estimator::PointSolidAngle | Estimator::ShaftPoints(ShaftPoints::SolidAngle) => {
                let clipped = LinearOptions::Technique(LinearTechnique::ClippedSolidAngle);
                self.points_on_line(linear, clipped, workspace)
            }
            Estimator::PointProjectedSolidAngle | Estimator::PointBsdf => {
                self.points_on_line(linear, LinearOptions::default(), workspace)
            }
            Estimator::PointLinear(options) => self.points_on_line(linear, options, workspace),
            Estimator::LineArea(_)
            | Estimator::LineAnalytic(_)
            | Estimator::Mix(_)
            | Estimator::Exact(_)
            | Estimator::Hybrid => match self.point.bsdf.closed_form() {
                Some(reflection) => self.whole_linear_light(linear, &reflection, workspace),
                None => self.points_on_line(linear, LinearOptions::default(), workspace),
            },
        }
    }

    /// One line query finds all there is to know of a linear light.
    fn whole_linear_light(
        &self,
        linear: &LinearLight,
        reflection: &ClosedForm,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let ends = [linear.segment.p0, linear.segment.p1];
        let query = ShaftQuery {
            point: self.point.position,
            light: (&ends).into(),
            exclude: self.light.triangles.clone(),
        };
        let mut shaft = self.occluders.shaft(query, &mut workspace.scratch);
        shaft.visible(&[linear.segment], &mut workspace.visible);
        workspace.segments.lines += 1;
        workspace.segments.pieces += workspace.visible.line(0).len() as u64;
        closed_form::linear(linear, self.point, reflection, workspace.visible.line(0))
    }
}
