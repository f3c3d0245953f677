//! Spheres and disks as they are, by points.

use crate::point_sum::{DrawnPoint, by_bsdf, mean};
use crate::{Buffers, EmissionTexture, PointBy, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{
    DiskLight, Pdf, PointSample, PointTechnique, SolidAngle, Sphere, SphereLight,
};
use linelit_spheres::{DiskArea, SphereCap, SphereCone, SphereProjected};

/// A sphere that emits outwards: by one of the three densities of Shirley & Wang 1991, by projected
/// solid angle or by directions of the BSDF.
pub(crate) fn sphere<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &SphereLight,
    by: PointBy,
    buffers: &mut Buffers,
) -> DVec3 {
    let (sphere, point) = (light.sphere, query.point);
    let x = point.position;
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
            (cos_light > 0.0).then(|| towards(sample.point, x, pdf))
        }
    };
    let by_angle = |sample: PointSample<SolidAngle>| Some(towards(sample.point, x, sample.pdf));
    let even = light.radiance;
    match by {
        PointBy::Area => toward(query, even, by_area(SphereCap::whole(&sphere)), buffers),
        PointBy::VisibleArea => toward(
            query,
            even,
            by_area(SphereCap::visible(&sphere, x)),
            buffers,
        ),
        PointBy::Bsdf => {
            let meets = |w| Some(x + w * enters(&sphere, x, w)?);
            toward(query, even, |u| by_bsdf(point, u, meets), buffers)
        }
        PointBy::ProjectedSolidAngle => match SphereProjected::new(&sphere, x, point.normal) {
            Some(above) => toward(query, even, |u| by_angle(above.sample(u)), buffers),
            None => DVec3::ZERO,
        },
        PointBy::SolidAngle | PointBy::Texture | PointBy::Linear(_) => {
            let cone = SphereCone::new(&sphere, x);
            toward(query, even, |u| by_angle(cone.sample(u)), buffers)
        }
    }
}

/// A disk: directions of the BSDF, or points by its area.
pub(crate) fn disk<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &DiskLight,
    by: PointBy,
    buffers: &mut Buffers,
) -> DVec3 {
    let (disk, point) = (light.disk, query.point);
    let x = point.position;
    let emitted = light.emission.towards(disk.normal.dot(x - disk.center));
    match by {
        PointBy::Bsdf => {
            let meets = |w| {
                let t = disk.normal.dot(disk.center - x) / disk.normal.dot(w);
                let inside = (x + w * t - disk.center).length() <= disk.radius;
                (t > 0.0 && inside).then(|| x + w * t)
            };
            toward(query, emitted, |u| by_bsdf(point, u, meets), buffers)
        }
        PointBy::Area
        | PointBy::VisibleArea
        | PointBy::SolidAngle
        | PointBy::ProjectedSolidAngle
        | PointBy::Texture
        | PointBy::Linear(_) => {
            let technique = DiskArea::new(&disk);
            let by_area = |u| {
                let sample = technique.sample(u);
                let to_light = sample.point - x;
                let square = to_light.length_squared();
                let cosine = disk.normal.dot(to_light) / square.sqrt();
                let pdf = sample.pdf.to_solid_angle(square, cosine);
                Some(towards(sample.point, x, pdf))
            };
            toward(query, emitted, by_area, buffers)
        }
    }
}

/// The mean for a light of one radiance, a shadow ray for each point.
fn toward<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    radiance: DVec3,
    draw: impl Fn([f64; 2]) -> Option<DrawnPoint>,
    buffers: &mut Buffers,
) -> DVec3 {
    let unshadowed = |at: &DrawnPoint| radiance * query.point.reflected(DVec3::ONE, at.direction);
    mean(query, draw, unshadowed, |on_light| {
        query.sees(on_light, buffers)
    })
}

/// A point as it is drawn from `x`.
fn towards(point: DVec3, x: DVec3, pdf: Pdf<SolidAngle>) -> DrawnPoint {
    DrawnPoint {
        point,
        direction: (point - x).normalize_or_zero(),
        pdf,
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
