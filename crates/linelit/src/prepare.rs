//! What `hybrid` knows of lights before anything is asked.

use crate::direct::{WHITE, same_length};
use crate::scene_lights::{SceneLight, looks_ahead};
use crate::{Error, Scene};
use linelit_estimators::{
    Buffers, Estimator, OcclusionProbe, OcclusionStats, Query, RandomNumbers, ShadingPoint,
};
use linelit_geometry::{DVec3, Vector3};
use linelit_lights::Light;
use linelit_samplers::{Sampler, SamplerKind};
use std::sync::Arc;

/// The most lights that are looked at beforehand.
const MOST_LIGHTS: usize = 16;
/// Points that each light is looked at from, and those for the direction of lines.
const POINTS: [u32; 2] = [64, 256];

impl Scene {
    /// Looks at the lights from these points, by which `hybrid` chooses its method: in place of
    /// points on the triangles, which the scene took when it was built. Some hundred points in the
    /// places that matter will do. Answers keep their mean, whatever the points are.
    ///
    /// # Errors
    /// Slices of different lengths; the first point or normal that is not valid.
    pub fn prepare<V: Vector3 + Copy>(&mut self, points: &[V], normals: &[V]) -> Result<(), Error> {
        same_length("normals", points, normals)?;
        let mut places = Vec::with_capacity(points.len());
        for (i, (point, normal)) in points.iter().zip(normals).enumerate() {
            places.push(self.point(i, point.dvec3(), normal.dvec3(), None, WHITE)?);
        }
        self.places = Arc::new([places.clone(), places]);
        self.set_lights(self.lights.to_vec())
    }

    /// Points spread evenly over the triangles, and as many for the direction of lines.
    pub(crate) fn places_on<V: Vector3 + Copy>(
        &self,
        positions: &[V],
        triangles: &[[u32; 3]],
    ) -> [Vec<ShadingPoint>; 2] {
        // As they are stored, or points would be below their own triangles.
        let origin = self.occluders.origin();
        let stored = |p: DVec3| (p - origin).as_vec3().as_dvec3() + origin;
        let corners = |t: &[u32; 3]| t.map(|i| stored(positions[i as usize].dvec3()));
        let area = |t: &[u32; 3]| {
            let [a, b, c] = corners(t);
            0.5 * (b - a).cross(c - a).length()
        };
        let mut sums: Vec<f64> = Vec::with_capacity(triangles.len());
        let mut total = 0.0;
        for triangle in triangles {
            total += area(triangle);
            sums.push(total);
        }
        POINTS.map(|count| -> Vec<ShadingPoint> {
            let points = Sampler::new(SamplerKind::Sobol, 0).points([0, 0], 0, count);
            let place = |i: u32| {
                let u = (f64::from(i) + 0.5) / f64::from(count);
                let triangle = triangles.get(sums.partition_point(|&sum| sum < u * total))?;
                let ([a, b, c], [s, t]) = (corners(triangle), points.get_2d(i));
                let root = s.sqrt();
                let point = a * (1.0 - root) + (b * (1.0 - t) + c * t) * root;
                Some((point, (b - a).cross(c - a)))
            };
            // A light may be on either side of a triangle.
            let sides = (0..count)
                .filter_map(place)
                .flat_map(|(p, n)| [(p, n), (p, -n)]);
            let lifted = sides.filter_map(|(p, n)| self.point(0, p, n, None, WHITE).ok());
            lifted.collect()
        })
    }

    /// Looks at the polygons among the first lights, where the estimator wants to know.
    pub(crate) fn look_at(&self, lights: &mut [SceneLight]) {
        let looks_ahead = looks_ahead(&self.settings.estimator);
        let estimator = Estimator::hybrid();
        let mut buffers = Buffers::default();
        for light in lights.iter_mut().take(MOST_LIGHTS) {
            light.occlusion = OcclusionStats::FEW;
            let Light::Area(area) = &light.light else {
                continue;
            };
            if !looks_ahead {
                continue;
            }
            let (source, mut probe) = (light.source(), OcclusionProbe::default());
            for (places, along_lines) in self.places.iter().zip([false, true]) {
                for point in places {
                    if !source.reaches(point, &mut buffers.counts.plan) {
                        continue;
                    }
                    let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], 0);
                    let query = Query::new(&self.occluders, &source, point, &estimator, numbers, 1);
                    if along_lines {
                        probe.look_along_lines(&query, area, &mut buffers);
                    } else {
                        probe.look(&query, area, &mut buffers);
                    }
                }
            }
            light.occlusion = probe.stats();
        }
    }
}
