//! This module has a light with everything that an estimate needs to know about it: its triangles
//! among the occluders, its emission, and statistics of its occlusion.

use crate::{PlanCounters, PointDensity, ShadingPoint};
use linelit_geometry::{DVec3, Triangle};
use linelit_lights::{Emission, EmissionTexture, Light, LightPoint, NoTexture, Profile};
use std::ops::Range;

/// A light together with its triangles among the occluders, its emission by position and direction,
/// and statistics of its occlusion.
#[derive(Clone, Debug)]
pub struct LightSource<'a, T = NoTexture> {
    /// The light itself.
    pub light: &'a Light,
    /// The range of the light's own triangles among the occluders. They never block this light. The
    /// range is empty if the light has no triangles.
    pub triangles: Range<u32>,
    /// The emission of an area light by position; `None` if it is the same everywhere.
    pub texture: Option<&'a T>,
    /// The factor of the emission by direction, about the normal of the side that emits, of a light
    /// that has sides ([`Light::normal`]). `None` for emission that is the same in all directions.
    /// With a profile, nothing can be integrated in closed form, so that points and lines are
    /// sampled.
    pub profile: Option<&'a Profile>,
    /// Statistics of its occlusion, by which `hybrid` chooses a method.
    pub occlusion: OcclusionStats,
}

/// Statistics of the occlusion of a light, by which `hybrid` chooses a method. They depend on the
/// geometry alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionStats {
    /// Whether there are so many triangles before the light that it seldom pays to collect them.
    pub dense: bool,
    /// The number of triangles between a shading point and the light that may hide a part of it, on
    /// average over points. A point from which the light is hidden wholly, or not at all, counts as
    /// zero triangles.
    pub candidates: f64,
    /// The fraction of the points from which the light is hidden in part, by few enough triangles
    /// to collect them.
    pub partial: f64,
    /// The number of edges that bound the hidden part, for each triangle in between: up to three if
    /// the triangles do not touch each other, few in meshes.
    pub edges: f64,
    /// The number of rays that take as long as a line past a dense shaft. This is measured by the
    /// boxes and triangles that 32 lines in the best direction and sixteen rays are tested against.
    /// It is 13 if no shaft was dense.
    pub line_cost: f64,
    /// The number of lines from which on lines past a dense shaft have less noise than rays in the
    /// same time, on reflections with a closed form. Pilot lines predict it; `None` if there were
    /// too few of them.
    pub lines_ahead: Option<f64>,
    /// The direction of lines in which the visible part changes least from one line to the next, in
    /// half turns from the light's first edge. It is a direction of one of the light's edges or
    /// diagonals. If it is not known (`None`), each shading point takes a random direction.
    pub direction: Option<f64>,
}

impl OcclusionStats {
    /// The statistics of a light with a few separate triangles before it, and without a best
    /// direction. This is the default where nothing was measured.
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
    /// A light of one radiance that has no triangles among the occluders.
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
    /// The radiance that the light sends from a point of its surface to the shading point,
    /// W/(m²·sr).
    #[inline]
    pub(crate) fn emitted(&self, at: &LightPoint) -> DVec3 {
        if let Light::Sky(sky) = self.light {
            // Points of a sky are only drawn in directions from which it is seen, which need no
            // check.
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

    /// The factor by which the profile changes the emission of a point of the surface.
    fn factor(&self, profile: &Profile, at: &LightPoint) -> DVec3 {
        // Linear lights, delta lights and skies have no sides.
        let Some(normal) = self.light.normal(at.point) else {
            return DVec3::ONE;
        };
        profile.on_surface(normal * at.cos_light.signum(), -at.direction)
    }

    /// The emission that all points of a flat light have in common; `None` if it differs between
    /// points, and for any other light.
    pub(crate) fn even(&self) -> Option<Emission> {
        let is_even = match self.light {
            Light::Area(_) => self.texture.is_none(),
            light => light.is_flat(),
        };
        (is_even && self.profile.is_none()).then(|| self.light.emission())
    }

    /// The density of points on a polygon that reaches a given error in the least time: uniform in
    /// the area, or in the solid angle.
    pub(crate) fn cheapest_points(&self, x: DVec3) -> PointDensity {
        let Light::Area(area) = self.light else {
            return PointDensity::SolidAngle;
        };
        // Find the distances of the nearest and of the farthest point of the light.
        let corners = area.polygon.vertices();
        let triangles = corners[1..].windows(2);
        let nearest = triangles.map(|pair| {
            let triangle = Triangle::new(corners[0], pair[0], pair[1]);
            triangle.nearest(x).distance_squared(x)
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        let farthest = corners.iter().map(|corner| corner.distance_squared(x));
        let farthest = farthest.fold(0.0, f64::max);
        // Pieces of equal area in a plane have solid angles that fall with the cube of the
        // distance.
        if farthest.powi(3) <= FLAT * FLAT * nearest.powi(3) {
            PointDensity::Area
        } else {
            PointDensity::SolidAngle
        }
    }

    /// Returns whether the light can reach the point at all: a part of the light is above the
    /// point's horizon, and the point is on a side that emits. If not, every estimator gives zero.
    /// The counters count the pair, and why it was skipped.
    pub fn reaches<R>(&self, point: &ShadingPoint<R>, counters: &mut PlanCounters) -> bool {
        let x = point.position;
        counters.point_lights += 1;
        // See the light from the point, if it looks different from each point.
        let seen = match self.light {
            Light::Area(_) | Light::Linear(_) => None,
            light => light.seen_from(x),
        };
        let beam = match self.light {
            Light::Point(_) | Light::Distant(_) => self.light.beam(x),
            _ => None,
        };
        // Check that the point is on a side that emits.
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
        // Check that a part of the light is above both horizons.
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

/// The ratio between the solid angles of the light's nearest and farthest pieces up to which points
/// that are uniform in the area are as good as points that are uniform in the solid angle. Points
/// by area take two thirds of the time.
const FLAT: f64 = 16.0;
