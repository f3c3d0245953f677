//! The same rays in the hierarchies of the crate obvhs, for comparison.

use linelit_geometry::glam::Vec3A;
use linelit_visibility::Ray;
use obvhs::{
    BvhBuildParams,
    bvh2::{Bvh2, builder::build_bvh2_from_tris},
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    triangle::Triangle,
};
use std::time::Duration;

/// obvhs's binary and its compressed eight-wide hierarchy over the same triangles, with its own
/// triangle test. Triangles are laid out in the order of the leaves, as its documentation advises.
pub(super) struct Rivals {
    bvh2: Bvh2,
    bvh2_triangles: Vec<Triangle>,
    cwbvh: CwBvh,
    cwbvh_triangles: Vec<Triangle>,
}

impl Rivals {
    /// Builds both hierarchies.
    pub(super) fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let input: Vec<Triangle> = triangles
            .iter()
            .map(|t| {
                let [v0, v1, v2] = t.map(|i| Vec3A::from_array(positions[i as usize]));
                Triangle { v0, v1, v2 }
            })
            .collect();
        let params = BvhBuildParams {
            pre_split: false,
            ..BvhBuildParams::medium_build()
        };
        let mut spent = Duration::default();
        let bvh2 = build_bvh2_from_tris(&input, params, &mut spent);
        let cwbvh = build_cwbvh_from_tris(&input, params, &mut spent);
        let ordered = |order: &[u32]| order.iter().map(|&i| input[i as usize]).collect();
        Self {
            bvh2_triangles: ordered(&bvh2.primitive_indices),
            cwbvh_triangles: ordered(&cwbvh.primitive_indices),
            bvh2,
            cwbvh,
        }
    }

    /// Returns whether a ray hits anything, by the binary hierarchy.
    pub(super) fn bvh2_any_hit(&self, ray: &Ray) -> bool {
        let test = |ray: &_, k: usize| self.bvh2_triangles[k].intersect(ray);
        !self.bvh2.ray_traverse_miss(convert(ray), test)
    }

    /// Returns whether a ray hits anything, by the wide hierarchy.
    pub(super) fn cwbvh_any_hit(&self, ray: &Ray) -> bool {
        let test = |ray: &_, k: usize| self.cwbvh_triangles[k].intersect(ray);
        !self.cwbvh.ray_traverse_miss(convert(ray), test)
    }
}

/// Returns a ray of obvhs.
#[allow(clippy::cast_possible_truncation, reason = "obvhs is f32")]
fn convert(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(
        ray.origin.as_vec3().into(),
        ray.direction.as_vec3().into(),
        ray.t_min as f32,
        ray.t_max as f32,
    )
}
