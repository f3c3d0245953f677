//! A light among its surroundings, and what it emits.

use crate::techniques::points::{DrawPoints, LightPoint};
use crate::{OcclusionStats, PlanCounters, ShadingPoint};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{
    AreaLight, AreaSampler, CylinderArea, CylinderView, Disk, DiskArea, Emission, ImportanceImage,
    Light, Sphere, SphereCap, TexturedSampler,
};
use std::ops::Range;

/// Emission that varies over an area light, and what points are drawn in proportion to.
pub trait EmissionTexture {
    /// The radiance at a point of the light, W/(m²·sr), on the side that emits.
    fn radiance(&self, on_light: DVec3) -> DVec3;

    /// Points in proportion to the emission, on the light or (see [`fits`](Self::fits)) around it;
    /// `None` where there is no such density: points then are uniform on the area.
    fn points(&self) -> Option<TexturedSampler<'_>>;

    /// Whether all points that are drawn lie on the light.
    fn fits(&self) -> bool;

    /// The image over `part`, if that is a parallelogram that the image covers exactly.
    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage>;
}

/// The texture of lights that have none: there is no value of it.
#[derive(Clone, Copy, Debug)]
pub enum NoTexture {}

impl EmissionTexture for NoTexture {
    fn radiance(&self, _: DVec3) -> DVec3 {
        match *self {}
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        match *self {}
    }

    fn fits(&self) -> bool {
        match *self {}
    }

    fn over(&self, _: &ConvexPolygon) -> Option<&ImportanceImage> {
        match *self {}
    }
}

/// A light, which triangles are its own, and how occluded it usually is.
#[derive(Clone, Debug)]
pub struct LightSource<'a, T = NoTexture> {
    /// The light.
    pub light: &'a Light,
    /// Its triangles among those of the occluders, which never block it; empty if it has none.
    pub triangles: Range<u32>,
    /// What an area light emits where, if not the same everywhere.
    pub texture: Option<&'a T>,
    /// How occluded the light usually is; chooses the strategy of `hybrid`.
    pub occlusion: OcclusionStats,
}

impl<'a> LightSource<'a> {
    /// A light of one radiance that none of the occluders belongs to.
    #[must_use]
    pub fn new(light: &'a Light) -> Self {
        Self {
            light,
            triangles: 0..0,
            texture: None,
            occlusion: OcclusionStats::default(),
        }
    }
}

impl<T: EmissionTexture> LightSource<'_, T> {
    /// What the light sends from one of its points against the direction to it: radiance,
    /// W/(m²·sr), of a linear light times its radius, W/(m·sr).
    #[inline]
    pub(crate) fn emitted(&self, at: &LightPoint) -> DVec3 {
        match self.light {
            Light::Area(area) => {
                let even = area.emission.towards(at.cos_light);
                match self.texture {
                    Some(texture) if even != DVec3::ZERO => texture.radiance(at.point),
                    Some(_) | None => even,
                }
            }
            Light::Linear(line) => line.radiance_radius,
            Light::Sphere(light) => Emission::one_sided(light.radiance).towards(at.cos_light),
            Light::Disk(light) => light.emission.towards(at.cos_light),
            Light::Cylinder(light) => Emission::one_sided(light.radiance).towards(at.cos_light),
        }
    }

    /// What a flat light sends from all of its points alike; `None` of any other.
    pub(crate) fn even(&self) -> Option<Emission> {
        match self.light {
            Light::Area(area) if self.texture.is_none() => Some(area.emission),
            Light::Disk(light) => Some(light.emission),
            Light::Area(_) | Light::Linear(_) | Light::Sphere(_) | Light::Cylinder(_) => None,
        }
    }

    /// The reflection of a point where the light's integral over it has a closed form along a line
    /// and over a polygon.
    pub(crate) fn closed_form<'p, R: Reflection>(
        &self,
        point: &'p ShadingPoint<R>,
    ) -> Option<ClosedForm<'p>> {
        match self.texture {
            None => point.known().closed_form(),
            Some(_) => None,
        }
    }

    /// Whether the light can reach the point at all: some of it is above the horizon, on the side
    /// that emits. Where not, every estimator gives zero. Counts why not.
    pub fn reaches<R: Reflection>(
        &self,
        point: &ShadingPoint<R>,
        counters: &mut PlanCounters,
    ) -> bool {
        counters.point_lights += 1;
        match self.light {
            Light::Area(area) => {
                if !area.faces(point.position, 0.0) {
                    counters.facing_away += 1;
                    return false;
                }
                above_horizon(point, area.polygon.vertices(), counters)
            }
            Light::Linear(line) => {
                above_horizon(point, &[line.segment.p0, line.segment.p1], counters)
            }
            // Samplers of round lights ask for the horizon themselves.
            Light::Sphere(light) => {
                let outside = light.sphere.center.distance(point.position) > light.sphere.radius;
                counters.facing_away += u64::from(!outside);
                outside
            }
            Light::Disk(light) => {
                let faces = light.faces(point.position, 0.0);
                counters.facing_away += u64::from(!faces);
                faces
            }
            Light::Cylinder(light) => {
                let Some(view) = CylinderView::new(&light.cylinder, point.position) else {
                    counters.facing_away += 1;
                    return false;
                };
                let highest = |n: DVec3| view.heights(n)[1];
                let above = highest(point.geometric_normal) > 0.0 && highest(point.normal) > 0.0;
                counters.below_horizon += u64::from(!above);
                above
            }
        }
    }
}

/// Whether any vertex is above both horizons. A convex light has its highest point at a vertex.
fn above_horizon<R>(
    point: &ShadingPoint<R>,
    vertices: &[DVec3],
    counters: &mut PlanCounters,
) -> bool {
    let any_above = |n: DVec3| vertices.iter().any(|v| n.dot(*v - point.position) > 0.0);
    let above = any_above(point.geometric_normal) && any_above(point.normal);
    if !above {
        counters.below_horizon += 1;
    }
    above
}

/// What an area light without a texture sends to `x`, and the height of `x` over the light's plane,
/// positive on the side of the normal.
pub(crate) fn even_emission(light: &AreaLight, x: DVec3) -> (DVec3, f64) {
    let height = light.polygon.normal().dot(x - light.polygon.vertices()[0]);
    (light.emission.towards(height), height)
}

/// The surface of a light.
pub(crate) trait Shape: Sized {
    /// The unit normal at one of its points, on the side that emits.
    fn normal(&self, point: DVec3) -> DVec3;

    /// The normal, if it is the same everywhere.
    fn flat(&self) -> Option<DVec3> {
        None
    }

    /// Where a ray from outside meets it first.
    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3>;

    /// Points uniform on its area.
    fn by_area(&self) -> impl DrawPoints<Self>;
}

impl Shape for ConvexPolygon {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.normal()
    }

    fn flat(&self) -> Option<DVec3> {
        Some(self.normal())
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let (vertices, n) = (self.vertices(), self.normal());
        let hit = on_plane(vertices[0], n, x, direction)?;
        let next = vertices.iter().cycle().skip(1);
        let inside = |(a, b): (&DVec3, &DVec3)| n.dot((*b - *a).cross(hit - *a)) >= 0.0;
        vertices.iter().zip(next).all(inside).then_some(hit)
    }

    fn by_area(&self) -> impl DrawPoints<Self> {
        AreaSampler::new(self)
    }
}

impl Shape for Disk {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.normal
    }

    fn flat(&self) -> Option<DVec3> {
        Some(self.normal)
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let hit = on_plane(self.center, self.normal, x, direction)?;
        (hit.distance(self.center) <= self.radius).then_some(hit)
    }

    fn by_area(&self) -> impl DrawPoints<Self> {
        DiskArea::new(self)
    }
}

impl Shape for Sphere {
    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.normal(point)
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let to_center = self.center - x;
        let along = to_center.dot(direction);
        // The distance of the ray from the centre, without the cancellation of d² − along².
        let across = (to_center - direction * along).length();
        if along <= 0.0 || across > self.radius {
            return None;
        }
        let inside = ((self.radius - across) * (self.radius + across)).sqrt();
        (along > inside).then(|| x + direction * (along - inside))
    }

    fn by_area(&self) -> impl DrawPoints<Self> {
        SphereCap::whole(self)
    }
}

/// As its shading point sees it.
impl Shape for CylinderView {
    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.normal(point)
    }

    fn meets(&self, _: DVec3, direction: DVec3) -> Option<DVec3> {
        self.meets(direction)
    }

    fn by_area(&self) -> impl DrawPoints<Self> {
        CylinderArea::visible(self.cylinder(), self.position())
    }
}

/// Where a ray meets a plane ahead of it.
pub(crate) fn on_plane(on_it: DVec3, normal: DVec3, x: DVec3, direction: DVec3) -> Option<DVec3> {
    let t = normal.dot(on_it - x) / normal.dot(direction);
    (t > 0.0 && t.is_finite()).then(|| x + direction * t)
}
