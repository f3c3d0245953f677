//! A light among its surroundings, and what it emits.

use crate::{PlanCounters, PointBy, ShadingPoint};
use linelit_geometry::{DVec3, Triangle};
use linelit_lights::{CylinderView, Emission, EmissionTexture, Light, LightPoint, NoTexture};
use std::ops::Range;

/// A light among the occluders, and statistics of its occlusion.
#[derive(Clone, Debug)]
pub struct LightSource<'a, T = NoTexture> {
    /// The light.
    pub light: &'a Light,
    /// Its triangles among those of the occluders, which never block it; empty if it has none.
    pub triangles: Range<u32>,
    /// The emission of an area light by position, if it is not the same everywhere.
    pub texture: Option<&'a T>,
    /// Statistics of its occlusion, by which `hybrid` chooses.
    pub occlusion: OcclusionStats,
}

/// Statistics of the occlusion of a light, by which `hybrid` chooses. Geometry alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionStats {
    /// Whether so much stands before the light that looking for all of it at once seldom pays.
    pub dense: bool,
    /// Triangles in between that may hide a part of the light, on average over points; none where
    /// nothing or all of it is hidden.
    pub candidates: f64,
    /// Edges that bound what is hidden, for each triangle in between: up to three if triangles are
    /// loose, few in meshes.
    pub edges: f64,
    /// The number of rays that take as long as a line past a dense shaft: by the boxes and
    /// triangles that 32 lines in the best direction test, and sixteen rays. 13 if no shaft was
    /// dense.
    pub line_cost: f64,
    /// The direction of lines, in half turns from the light's first edge, in which the visible part
    /// changes least from one line to the next; of the light's edges and diagonals. `None` if it is
    /// not known: a random one for each shading point.
    pub direction: Option<f64>,
}

impl OcclusionStats {
    /// Few triangles, all loose; no direction better than others.
    pub const FEW: Self = Self {
        dense: false,
        candidates: 1.0,
        edges: 3.0,
        line_cost: 13.0,
        direction: None,
    };
}

impl Default for OcclusionStats {
    fn default() -> Self {
        Self::FEW
    }
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

    /// The emission that all points of a flat light have in common; `None` for any other light.
    pub(crate) fn even(&self) -> Option<Emission> {
        match self.light {
            Light::Area(area) if self.texture.is_none() => Some(area.emission),
            Light::Disk(light) => Some(light.emission),
            Light::Area(_) | Light::Linear(_) | Light::Sphere(_) | Light::Cylinder(_) => None,
        }
    }

    /// The density of points of a polygon that reaches an error first: uniform on the area, or in
    /// the solid angle.
    pub(crate) fn cheapest_points(&self, x: DVec3) -> PointBy {
        let Light::Area(area) = self.light else {
            return PointBy::SolidAngle;
        };
        let corners = area.polygon.vertices();
        let triangles = corners[1..].windows(2);
        let nearest = triangles.map(|pair| {
            let triangle = Triangle::new(corners[0], pair[0], pair[1]);
            triangle.nearest(x).distance_squared(x)
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        let farthest = corners.iter().map(|corner| corner.distance_squared(x));
        let farthest = farthest.fold(0.0, f64::max);
        // The solid angle of a piece goes as the cube of the distance.
        if farthest.powi(3) <= FLAT * FLAT * nearest.powi(3) {
            PointBy::Area
        } else {
            PointBy::SolidAngle
        }
    }

    /// Whether the light can reach the point at all: some of it is above the horizon, on the side
    /// that emits. Where not, every estimator gives zero. Counts why not.
    pub fn reaches<R>(&self, point: &ShadingPoint<R>, counters: &mut PlanCounters) -> bool {
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

/// The ratio between solid angles of pieces of a light up to which points uniform on the area are
/// as good as points uniform in the solid angle; they cost two thirds.
const FLAT: f64 = 16.0;
