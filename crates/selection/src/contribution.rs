//! What a light may contribute to a surface point, without shadows.

use linelit_geometry::{DVec3, predicates};
use linelit_lights::{AreaSampler, Light, PointTechnique};
use linelit_spheres::{DiskArea, SphereCap};

/// Whether any point of the light can light the surface point `x` with the unit normal `n`: some of
/// it is above the tangent plane, and x is on an emitting side. This is the test that allows α = 0.
#[must_use]
pub fn can_contribute(light: &Light, x: DVec3, n: DVec3) -> bool {
    match light {
        Light::Area(l) => l.faces(x) && l.polygon.vertices().iter().any(|v| n.dot(*v - x) > 0.0),
        Light::Linear(l) => [l.segment.p0, l.segment.p1]
            .iter()
            .any(|v| n.dot(*v - x) > 0.0),
        Light::Sphere(l) => n.dot(l.sphere.center - x) + l.sphere.radius > 0.0,
        Light::Disk(l) => {
            let side = l.disk.normal.dot(x - l.disk.center);
            let faces = side > 0.0 || (l.emission.two_sided && side < 0.0);
            // The highest point of the disk over the tangent plane.
            let rise = l.disk.radius * predicates::cross(n, l.disk.normal).length();
            faces && n.dot(l.disk.center - x) + rise > 0.0
        }
    }
}

/// One-sample estimate of the irradiance at `x` from a random point of the light, averaged over the
/// channels, the geometry term set to visible (Shirley & Wang 1991, eq. 3). A cheap Lhat; for the
/// exact unshadowed value use the closed forms.
#[must_use]
pub fn unshadowed(light: &Light, x: DVec3, n: DVec3, u: [f64; 2]) -> f64 {
    match light {
        Light::Area(l) => {
            let s = AreaSampler::new(&l.polygon).sample(u);
            from_point(light, x, n, s.point) / s.pdf.value()
        }
        Light::Linear(l) => from_point(light, x, n, l.segment.at(u[0])) * l.segment.length(),
        Light::Sphere(l) => {
            let s = SphereCap::visible(&l.sphere, x).sample(u);
            from_point(light, x, n, s.point) / s.pdf.value()
        }
        Light::Disk(l) => {
            let s = DiskArea::new(&l.disk).sample(u);
            from_point(light, x, n, s.point) / s.pdf.value()
        }
    }
}

/// The estimate from the light's centre: deterministic, and wrong where the centre is below the
/// horizon while other parts are not. It makes the bands of Shirley & Wang's Fig. 10 if α = 0
/// follows from it; for that comparison only.
#[must_use]
pub fn unshadowed_at_center(light: &Light, x: DVec3, n: DVec3) -> f64 {
    match light {
        Light::Area(l) => from_point(light, x, n, l.polygon.centroid()) * l.polygon.area(),
        Light::Linear(l) => from_point(light, x, n, l.segment.at(0.5)) * l.segment.length(),
        Light::Sphere(l) => {
            let towards = (x - l.sphere.center).normalize_or_zero() * l.sphere.radius;
            from_point(light, x, n, l.sphere.center + towards) * 0.25 * l.sphere.area()
        }
        Light::Disk(l) => from_point(light, x, n, l.disk.center) * l.disk.area(),
    }
}

/// Irradiance per area (per length for a line) of the light around `point`.
fn from_point(light: &Light, x: DVec3, n: DVec3, point: DVec3) -> f64 {
    let d = point - x;
    let r2 = d.length_squared();
    if r2 <= 0.0 {
        return 0.0;
    }
    let cosine = n.dot(d).max(0.0);
    let facing = |normal: DVec3, two_sided: bool| {
        let c = -normal.dot(d);
        if two_sided { c.abs() } else { c.max(0.0) }
    };
    match light {
        Light::Area(l) => {
            let c = facing(l.polygon.normal(), l.emission.two_sided);
            mean(l.emission.radiance) * cosine * c / (r2 * r2)
        }
        Light::Linear(l) => {
            // dω/R = 2h/r³ dt.
            let h = predicates::cross(d, l.segment.direction()).length();
            mean(l.radiance_radius) * cosine * 2.0 * h / (r2 * r2)
        }
        Light::Sphere(l) => {
            mean(l.radiance) * cosine * facing(l.sphere.normal(point), false) / (r2 * r2)
        }
        Light::Disk(l) => {
            let c = facing(l.disk.normal, l.emission.two_sided);
            mean(l.emission.radiance) * cosine * c / (r2 * r2)
        }
    }
}

/// Mean of the three channels.
fn mean(rgb: DVec3) -> f64 {
    rgb.element_sum() / 3.0
}
