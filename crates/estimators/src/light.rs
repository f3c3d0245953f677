//! A light among its surroundings, and what it emits.

use crate::{PlanCounters, PointDensity, ShadingPoint};
use linelit_geometry::{DVec3, Triangle};
use linelit_lights::{Emission, EmissionTexture, Light, LightPoint, NoTexture, Profile};
use std::ops::Range;

/// A light among the occluders, and statistics of its occlusion.
#[derive(Clone, Debug)]
pub struct LightSource<'a, T = NoTexture> {
    /// The light.
    pub light: &'a Light,
    /// The range of its triangles among the occluders', which never block it; empty if it has none.
    pub triangles: Range<u32>,
    /// The emission of an area light by position, if it is not the same everywhere.
    pub texture: Option<&'a T>,
    /// The factor of the emission by direction, about the normal of the side that emits, of a light
    /// that has sides ([`Light::normal`]); none emits alike in all directions. With it nothing is
    /// known in closed form: points and lines take samples.
    pub profile: Option<&'a Profile>,
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
    /// The fraction of the points from which the light is hidden in part, by few enough triangles
    /// to keep.
    pub partial: f64,
    /// Edges that bound what is hidden, for each triangle in between: up to three if triangles are
    /// loose, few in meshes.
    pub edges: f64,
    /// The number of rays that take as long as a line past a dense shaft: by the boxes and
    /// triangles that 32 lines in the best direction test, and sixteen rays. 13 if no shaft was
    /// dense.
    pub line_cost: f64,
    /// The number of lines from which on lines past a dense shaft have less noise than rays in the
    /// same time, on reflections with a closed form, as pilot lines see it; `None` if too few of
    /// them were sent.
    pub lines_ahead: Option<f64>,
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
        partial: 1.0,
        edges: 3.0,
        line_cost: 13.0,
        lines_ahead: None,
        direction: None,
    };
}

impl<'a> LightSource<'a> {
    /// A light of one radiance that none of the occluders belongs to.
    #[must_use]
    pub fn new(light: &'a Light) -> Self {
        Self {
            light,
            triangles: 0..0,
            texture: None,
            profile: None,
            occlusion: OcclusionStats::FEW,
        }
    }
}

impl<T: EmissionTexture> LightSource<'_, T> {
    /// The radiance that the light sends from one of the points of its surface against the
    /// direction to it, W/(m²·sr).
    #[inline]
    pub(crate) fn emitted(&self, at: &LightPoint) -> DVec3 {
        if let Light::Sky(sky) = self.light {
            // Points of a sky are drawn where it shows.
            return sky.along(at.direction);
        }
        let even = self.light.emission().towards(at.cos_light);
        let emitted = match (self.light, self.texture) {
            (Light::Area(_), Some(texture)) if even != DVec3::ZERO => texture.radiance(at.point),
            _ => even,
        };
        match self.profile {
            Some(profile) if emitted != DVec3::ZERO => emitted * self.factor(profile, at),
            _ => emitted,
        }
    }

    /// The factor of the emission by direction at a point of the surface.
    fn factor(&self, profile: &Profile, at: &LightPoint) -> DVec3 {
        // Lines, points and light from infinity have no side.
        let Some(normal) = self.light.normal(at.point) else {
            return DVec3::ONE;
        };
        profile.on_surface(normal * at.cos_light.signum(), -at.direction)
    }

    /// The emission that all points of a flat light have in common; `None` for any other light.
    pub(crate) fn even(&self) -> Option<Emission> {
        let is_even = match self.light {
            Light::Area(_) => self.texture.is_none(),
            light => light.is_flat(),
        };
        (is_even && self.profile.is_none()).then(|| self.light.emission())
    }

    /// The density of points of a polygon that reaches an error first: uniform on the area, or in
    /// the solid angle.
    pub(crate) fn cheapest_points(&self, x: DVec3) -> PointDensity {
        let Light::Area(area) = self.light else {
            return PointDensity::SolidAngle;
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
            PointDensity::Area
        } else {
            PointDensity::SolidAngle
        }
    }

    /// Whether the light can reach the point at all: some of it is above the horizon, on the side
    /// that emits. Where not, every estimator gives zero. Counts why not.
    pub fn reaches<R>(&self, point: &ShadingPoint<R>, counters: &mut PlanCounters) -> bool {
        let x = point.position;
        counters.point_lights += 1;
        // Find the light as the point sees it, where it is not the same from everywhere.
        let seen = match self.light {
            Light::Area(_) | Light::Linear(_) => None,
            light => light.seen_from(x),
        };
        let beam = match self.light {
            Light::Point(_) | Light::Distant(_) => self.light.beam(x),
            _ => None,
        };
        // Find whether the point is on a side that emits.
        let faces = match self.light {
            Light::Linear(_) => true,
            Light::Point(_) | Light::Distant(_) => beam.is_some(),
            Light::Area(light) => light.faces(x, 0.0),
            Light::Disk(light) => light.faces(x, 0.0),
            Light::Sphere(light) => light.sphere.center.distance(x) > light.sphere.radius,
            _ => seen.is_some(),
        };
        if !faces {
            counters.facing_away += 1;
            return false;
        }
        // Find whether some of the light is above both horizons.
        let is_above = |n: DVec3| match (self.light, &seen) {
            (Light::Area(light), _) => light.polygon.vertices().iter().any(|v| n.dot(*v - x) > 0.0),
            (Light::Linear(light), _) => {
                let ends = [light.segment.p0, light.segment.p1];
                ends.iter().any(|end| n.dot(*end - x) > 0.0)
            }
            (_, Some(seen)) => seen.surface().may_rise_above(x, n),
            (_, None) => beam.is_some_and(|b| n.dot(b.direction) > 0.0),
        };
        let [n, normal] = [point.geometric_normal, point.normal];
        let above = is_above(n) && (normal == n || is_above(normal));
        counters.below_horizon += u64::from(!above);
        above
    }
}

/// The ratio between solid angles of pieces of a light up to which points uniform on the area are
/// as good as points uniform in the solid angle; they cost two thirds.
const FLAT: f64 = 16.0;
