//! [`VisibilityScene`], a scene for measurements and tests of visibility queries: its triangles,
//! the corners of its lights, and lines across them.

use crate::Library;
use anyhow::{Result, ensure};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::Light;
use linelit_scene::{Camera, SceneDescription};

/// A scene on which visibility queries are measured and tested.
#[derive(Clone, Debug)]
pub struct VisibilityScene {
    /// The name of the scene.
    pub name: String,
    /// The positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// For each triangle, the indices of its vertices in `positions`; the triangles of lights are
    /// among them.
    pub triangles: Vec<[u32; 3]>,
    /// The corners of each polygonal light under two names: `L` is the light, and `S` the light
    /// scaled by a tenth about its centroid. The names of lights after the first have a number.
    pub lights: Vec<(String, Vec<DVec3>)>,
    camera: Camera,
}

impl VisibilityScene {
    /// Loads a scene by the path of a file or the name of a built-in scene.
    ///
    /// # Errors
    /// The scene cannot be found or read, or has no polygonal light.
    pub fn load(library: &Library, name: &str) -> Result<Self> {
        let scene = library.load(name)?.scene;
        let lights = lights(&scene);
        ensure!(!lights.is_empty(), "`{name}` has no polygonal light");
        Ok(Self {
            name: name.to_owned(),
            positions: (0_u32..)
                .zip(&scene.positions)
                .map(|(i, _)| scene.vertex(i).as_vec3().to_array())
                .collect(),
            triangles: scene.triangles,
            lights,
            camera: scene.camera,
        })
    }

    /// Returns the origin and the unit direction of the camera's ray through the centre of each
    /// pixel, row by row.
    #[must_use]
    pub fn view(&self, width: u32, height: u32) -> Vec<[DVec3; 2]> {
        let mut camera = self.camera.clone();
        camera.set_resolution(width, height);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let ray = |[x, y]: [u32; 2]| {
            let ray = camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            [ray.origin, ray.direction]
        };
        pixels.map(ray).collect()
    }
}

/// Returns the corners of each polygonal light, for [`VisibilityScene::lights`].
fn lights(scene: &SceneDescription) -> Vec<(String, Vec<DVec3>)> {
    let areas = scene.lights.iter().filter_map(|light| match &*light.light {
        Light::Area(area) => Some(area.polygon.vertices()),
        _ => None,
    });
    let mut lights = Vec::new();
    for (i, corners) in areas.enumerate() {
        let count = corners.iter().map(|_| 1.0).sum::<f64>();
        let middle = corners.iter().sum::<DVec3>() / count;
        let tenth = corners.iter().map(|v| middle + (*v - middle) * 0.1);
        let number = if i == 0 { String::new() } else { i.to_string() };
        lights.push((format!("S{number}"), tenth.collect()));
        lights.push((format!("L{number}"), corners.to_vec()));
    }
    lights
}

/// Returns stratified lines across a light, which is given by its corners. They are parallel to the
/// side from the first corner to the last, and end at the outline of a parallelogram or a triangle;
/// on other polygons they may reach beyond it. For a linear light, given by its two ends, all lines
/// are the light itself. `jitter` returns random numbers in [0, 1).
#[must_use]
pub fn stratified_lines(
    light: &[DVec3],
    count: u32,
    jitter: &mut impl FnMut() -> f64,
) -> Vec<Segment> {
    let o = light[0];
    let v = light[light.len() - 1] - o;
    let u = if light.len() == 2 {
        DVec3::ZERO
    } else {
        light[1] - o
    };
    (0..count)
        .map(|i| {
            let s = (f64::from(i) + jitter()) / f64::from(count);
            let reach = if light.len() == 3 { 1.0 - s } else { 1.0 };
            let p0 = o + u * s;
            Segment::new(p0, p0 + v * reach)
        })
        .collect()
}
