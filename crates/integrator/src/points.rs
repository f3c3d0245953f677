//! Point samples: one shadow ray each.

use crate::pair::Pair;
use crate::{PlannedLight, ShadingPoint, Workspace};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, LIGHT_MARGIN};
use linelit_lights::{AngularLines, AreaLight, AreaSampler, SolidAngleSampler};
use linelit_visibility::Ray;

impl Pair<'_> {
    /// Points uniform on the light's area.
    ///
    /// Billen & Dutré 2016, eqs. 1–2: the mean of L f_r V cos θ cos θ'/(r² p_A).
    pub(crate) fn points_by_area(&self, area: &AreaLight, workspace: &mut Workspace) -> DVec3 {
        let sampler = AreaSampler::new(&area.polygon);
        self.mean(area, workspace, |u| {
            let sample = sampler.sample(u);
            let to_light = sample.point - self.point.position;
            let square = to_light.length_squared();
            let w = to_light / square.sqrt();
            let cos_light = area.polygon.normal().dot(w);
            let pdf = sample.pdf.to_solid_angle(square, cos_light).value();
            Some((w, sample.point, pdf))
        })
    }

    /// Points uniform in the light's solid angle: the mean of L f_r V cos θ/p_ω.
    pub(crate) fn points_by_solid_angle(
        &self,
        area: &AreaLight,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let sampler = SolidAngleSampler::new(&area.polygon, self.point.position);
        self.mean(area, workspace, |u| {
            let sample = sampler.sample(u);
            let w = (sample.point - self.point.position).normalize_or_zero();
            Some((w, sample.point, sample.pdf.value()))
        })
    }

    /// Points uniform in the light's projected solid angle, by lines through it: the mean of
    /// L f_r V cos θ/p_ω.
    pub(crate) fn points_by_projected_solid_angle(
        &self,
        area: &AreaLight,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let (x, n) = (self.point.position, self.point.normal);
        let sampler = AngularLines::by_projected_solid_angle(&area.polygon, 0.0, x, n);
        self.mean(area, workspace, |[u, v]| {
            let sample = sampler.point(&sampler.sample(u), &[Interval::UNIT], v);
            let w = (sample.point - x).normalize_or_zero();
            Some((w, sample.point, sample.pdf.value()))
        })
    }

    /// Directions drawn from the BSDF: the mean of L f_r V cos θ/p_ω over those that meet the light.
    pub(crate) fn points_by_bsdf(&self, area: &AreaLight, workspace: &mut Workspace) -> DVec3 {
        let point = self.point;
        self.mean(area, workspace, |u| {
            let w = point.bsdf.sample(u, point.outgoing, point.normal)?;
            let on_light = meets(&area.polygon, point.position, w)?;
            Some((w, on_light, point.bsdf.pdf(w, point.outgoing, point.normal)))
        })
    }

    /// The mean of L f_r V cos θ/p_ω over samples: direction, point on the light, density p_ω.
    fn mean(
        &self,
        area: &AreaLight,
        workspace: &mut Workspace,
        sample: impl Fn([f64; 2]) -> Option<(DVec3, DVec3, f64)>,
    ) -> DVec3 {
        let set = self.samples();
        let mut sum = DVec3::ZERO;
        for i in 0..self.count() {
            let Some((w, on_light, pdf)) = sample(set.get_2d(i)) else {
                continue;
            };
            let value = self.light.unshadowed(area, self.point, on_light, w);
            if pdf > 0.0 && value != DVec3::ZERO && self.sees(on_light, workspace) {
                sum += value * (1.0 / pdf);
            }
        }
        sum / f64::from(self.count())
    }

    /// Whether nothing stands between the shading point and a point of the light.
    fn sees(&self, on_light: DVec3, workspace: &mut Workspace) -> bool {
        self.is_free(on_light - self.point.position, workspace)
    }

    /// The same for a point given relative to the shading point.
    pub(crate) fn is_free(&self, to_light: DVec3, workspace: &mut Workspace) -> bool {
        let ray = Ray {
            origin: self.point.position,
            direction: to_light,
            t_min: 0.0,
            t_max: 1.0 - LIGHT_MARGIN,
        };
        !self
            .occluders
            .any_hit(&ray, &self.light.triangles, &mut workspace.scratch)
    }
}

/// Where a ray meets a convex polygon.
pub(crate) fn meets(polygon: &ConvexPolygon, x: DVec3, w: DVec3) -> Option<DVec3> {
    let vertices = polygon.vertices();
    let n = polygon.normal();
    let t = n.dot(vertices[0] - x) / n.dot(w);
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let hit = x + w * t;
    let next = vertices.iter().cycle().skip(1);
    let inside = |(a, b): (&DVec3, &DVec3)| n.dot((*b - *a).cross(hit - *a)) >= 0.0;
    vertices.iter().zip(next).all(inside).then_some(hit)
}

impl PlannedLight {
    /// L f_r cos θ towards a point of the light in direction `w`, whatever stands between; `area`
    /// is the light itself.
    #[inline]
    pub(crate) fn unshadowed(
        &self,
        area: &AreaLight,
        point: &ShadingPoint,
        on_light: DVec3,
        w: DVec3,
    ) -> DVec3 {
        let cosine = point.cosine(w);
        if cosine <= 0.0 {
            return DVec3::ZERO;
        }
        let side = -area.polygon.normal().dot(w);
        let emitted = match &self.texture {
            None => area.emission.towards(side),
            Some(_) if area.emission.towards(side) == DVec3::ZERO => DVec3::ZERO,
            Some(texture) => texture.radiance(on_light),
        };
        emitted * point.bsdf.eval(w, point.outgoing, point.normal) * cosine
    }

    /// The reflection of a point where the light's integral over it has a closed form along a line
    /// and over a polygon.
    pub(crate) fn closed_form(&self, point: &ShadingPoint) -> Option<ClosedForm> {
        match self.texture {
            None => point.bsdf.closed_form(),
            Some(_) => None,
        }
    }
}
