//! A view and a light for files that have none.

use crate::camera::{Camera, Projection};
use crate::material::Material;
use crate::scene::{Mesh, Scene, SceneLight};
use linelit_geometry::glam::DAffine3;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3};
use linelit_lights::{AreaLight, Emission, Light};
use std::sync::Arc;

/// A camera that sees a whole box from the front, a little from the right and from above, in a
/// right-handed world with y up.
pub(crate) fn camera(lo: DVec3, hi: DVec3, size: [u32; 2]) -> Camera {
    const FOV_DEGREES: f64 = 40.0;
    let centre = 0.5 * (lo + hi);
    let radius = (0.5 * (hi - lo).length()).max(f64::MIN_POSITIVE);
    let backward = DVec3::new(0.4, 0.35, 1.0).normalize();
    let distance = radius / (0.5 * FOV_DEGREES).to_radians().sin();
    let forward = -backward;
    let right = forward.cross(DVec3::Y).normalize();
    let camera_to_world = DAffine3 {
        matrix3: DMat3::from_cols(right, right.cross(forward), forward),
        translation: centre + backward * distance,
    };
    let projection = Projection::Perspective {
        fov_degrees: FOV_DEGREES,
    };
    Camera::new(camera_to_world, projection, None, None, size)
}

/// Of the distance from the camera to what it looks at: how far up and to the left of the camera a
/// framing light hangs, how far behind it, and half its side.
const LIGHT: [f64; 3] = [0.35, 0.05, 0.12];

impl Scene {
    /// Adds a square light beside the camera, above it and to its left, that shines at the middle
    /// of the scene: for files that have no light, whose picture would be black. A white surface
    /// there that faces the light has a radiance of about one. False if there is nothing to light.
    ///
    /// ```
    /// use linelit_scene::{Format, LoadOptions, Scene};
    ///
    /// let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    /// let mut scene = Scene::from_bytes(Format::Obj, text, "one.obj", &LoadOptions::default())?.scene;
    /// assert!(scene.lights.is_empty() && scene.add_framing_light());
    /// assert_eq!((scene.lights.len(), scene.triangles.len()), (1, 3));
    /// # Ok::<(), linelit_scene::SceneError>(())
    /// ```
    pub fn add_framing_light(&mut self) -> bool {
        let Some((lo, hi)) = self.bounds() else {
            return false;
        };
        let [aside, behind, half] = LIGHT;
        let centre = 0.5 * (lo + hi);
        let eye = self.camera.position();
        let distance = (centre - eye).length().max(0.5 * (hi - lo).length());
        let axes = self.camera.camera_to_world.matrix3;
        let axis = |v: DVec3| v.normalize_or_zero() * distance;
        let (right, up, forward) = (axis(axes.x_axis), axis(axes.y_axis), axis(axes.z_axis));
        let place = eye + aside * (up - right) - behind * forward;
        let Some(normal) = (centre - place).try_normalize() else {
            return false;
        };
        let u = right.cross(normal).try_normalize().unwrap_or(DVec3::Y) * (half * distance);
        let v = normal.cross(u);
        let corners = [place - u - v, place + u - v, place + u + v, place - u + v];
        let corners = corners.map(crate::mesh::to_f32);
        let Ok(polygon) = ConvexPolygon::try_new(&corners.map(crate::scene::to_f64)) else {
            return false;
        };
        let irradiance = std::f64::consts::PI;
        let square = (centre - place).length_squared();
        let radiance = DVec3::splat(irradiance * square / polygon.area());
        self.push_quad(corners, polygon, Emission::one_sided(radiance));
        true
    }

    /// Adds a black quad that emits on the side of its polygon's normal.
    fn push_quad(&mut self, corners: [[f32; 3]; 4], polygon: ConvexPolygon, emission: Emission) {
        let index = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (base, first) = (index(self.positions.len()), index(self.triangles.len()));
        self.positions.extend(corners);
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), [0.0; 3]);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), [0.0; 2]);
        }
        let corner = |k: u32| base + k;
        self.triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(corner)));
        self.meshes.push(Mesh {
            triangles: first..first + 2,
            material: index(self.materials.len()),
            flipped: false,
            has_normals: false,
            has_uvs: false,
        });
        self.materials
            .push(Material::matte("framing light", DVec3::ZERO));
        self.light_ranges
            .push((first, first + 2, index(self.lights.len())));
        self.lights.push(SceneLight {
            light: Arc::new(Light::Area(AreaLight { polygon, emission })),
            triangles: first..first + 2,
            map: None,
        });
    }
}
