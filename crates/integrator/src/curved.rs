//! Spheres and disks as they are, by points.

use crate::pair::Pair;
use crate::{Estimator, ShadingPoint, Workspace};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{DiskLight, Sphere, SphereCap, SphereCone, SphereLight, SphereProjected};
use std::fmt;
use std::str::FromStr;

/// What stands for an emissive sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spheres {
    /// `facets`: its triangles, which are what the camera sees and what lines can be drawn on.
    #[default]
    Facets,
    /// `exact`: the sphere itself, sampled by points whatever the estimator: by area
    /// (`point-area`), by the area that is seen (`point-visible-area`), by directions of the BSDF
    /// (`point-bsdf`), by solid angle (all others). Spheres that emit inwards or an image keep their facets.
    Exact,
}

impl fmt::Display for Spheres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Facets => "facets",
            Self::Exact => "exact",
        })
    }
}

impl FromStr for Spheres {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "facets" => Ok(Self::Facets),
            "exact" => Ok(Self::Exact),
            _ => Err(format!("spheres `{text}`; expected facets or exact")),
        }
    }
}

impl Pair<'_> {
    /// A sphere that emits outwards, by one of the three densities of Shirley & Wang 1991, by projected
    /// solid angle or by directions of the BSDF.
    pub(crate) fn sphere_light(&self, light: &SphereLight, workspace: &mut Workspace) -> DVec3 {
        let (sphere, x) = (light.sphere, self.point.position);
        if (x - sphere.center).length() <= sphere.radius {
            return DVec3::ZERO;
        }
        let by_area = |cap: SphereCap| {
            move |u: [f64; 2]| {
                let sample = cap.sample(u);
                let to_light = sample.point - x;
                let square = to_light.length_squared();
                let cos_light = -sphere.normal(sample.point).dot(to_light) / square.sqrt();
                let pdf = sample.pdf.to_solid_angle(square, cos_light);
                (cos_light > 0.0).then_some((to_light, pdf.value()))
            }
        };
        match *self.estimator() {
            Estimator::PointArea => self.toward(
                light.radiance,
                by_area(SphereCap::whole(&sphere)),
                workspace,
            ),
            Estimator::PointVisibleArea => {
                let cap = SphereCap::visible(&sphere, x);
                self.toward(light.radiance, by_area(cap), workspace)
            }
            Estimator::PointBsdf => {
                let point = self.point;
                let by_bsdf = |u| {
                    let w = point.bsdf.sample(u, point.outgoing, point.normal)?;
                    let pdf = point.bsdf.pdf(w, point.outgoing, point.normal);
                    Some((w * enters(&sphere, x, w)?, pdf))
                };
                self.toward(light.radiance, by_bsdf, workspace)
            }
            Estimator::PointProjectedSolidAngle => {
                let Some(above) = SphereProjected::new(&sphere, x, self.point.normal) else {
                    return DVec3::ZERO;
                };
                let by_cosine = |u| {
                    let sample = above.sample(u);
                    Some((sample.point - x, sample.pdf.value()))
                };
                self.toward(light.radiance, by_cosine, workspace)
            }
            _ => {
                let cone = SphereCone::new(&sphere, x);
                let by_cone = |u| {
                    let sample = cone.sample(u);
                    Some((sample.point - x, sample.pdf.value()))
                };
                self.toward(light.radiance, by_cone, workspace)
            }
        }
    }

    /// A disk: directions of the BSDF, or points by its area.
    pub(crate) fn disk_light(&self, light: &DiskLight, workspace: &mut Workspace) -> DVec3 {
        let (disk, x) = (light.disk, self.point.position);
        let emitted = light.emission.towards(disk.normal.dot(x - disk.center));
        let point = self.point;
        if *self.estimator() == Estimator::PointBsdf {
            let by_bsdf = |u| {
                let w = point.bsdf.sample(u, point.outgoing, point.normal)?;
                let t = disk.normal.dot(disk.center - x) / disk.normal.dot(w);
                let inside = (x + w * t - disk.center).length() <= disk.radius;
                let pdf = point.bsdf.pdf(w, point.outgoing, point.normal);
                (t > 0.0 && inside).then_some((w * t, pdf))
            };
            return self.toward(emitted, by_bsdf, workspace);
        }
        let by_area = |u| {
            let sample = disk.sample(u);
            let to_light = sample.point - x;
            let square = to_light.length_squared();
            let cosine = disk.normal.dot(to_light) / square.sqrt();
            Some((to_light, sample.pdf.to_solid_angle(square, cosine).value()))
        };
        self.toward(emitted, by_area, workspace)
    }

    /// The mean of L f_r V cos θ/p_ω for a light of one radiance; `sample` gives the vector to a
    /// point of the light and the density of its direction.
    fn toward(
        &self,
        radiance: DVec3,
        sample: impl Fn([f64; 2]) -> Option<(DVec3, f64)>,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let set = self.samples();
        let mut sum = DVec3::ZERO;
        for i in 0..self.count() {
            let Some((to_light, pdf)) = sample(set.get_2d(i)) else {
                continue;
            };
            let value = radiance * reflected(self.point, to_light.normalize_or_zero());
            if pdf > 0.0 && value != DVec3::ZERO && self.is_free(to_light, workspace) {
                sum += value * (1.0 / pdf);
            }
        }
        sum / f64::from(self.count())
    }
}

/// f_r cos θ.
fn reflected(point: &ShadingPoint, w: DVec3) -> DVec3 {
    let cosine = point.cosine(w);
    if cosine > 0.0 {
        point.bsdf.eval(w, point.outgoing, point.normal) * cosine
    } else {
        DVec3::ZERO
    }
}

/// The distance at which a unit direction from outside enters a sphere.
fn enters(sphere: &Sphere, x: DVec3, w: DVec3) -> Option<f64> {
    let to_center = sphere.center - x;
    let along = to_center.dot(w);
    // The distance of the ray from the centre, without the cancellation of d² − along².
    let across = (to_center - w * along).length();
    if along <= 0.0 || across > sphere.radius {
        return None;
    }
    let half = ((sphere.radius - across) * (sphere.radius + across)).sqrt();
    Some(along - half)
}
