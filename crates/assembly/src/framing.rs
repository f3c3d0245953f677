//! A camera and a light for files that have none.

use linelit_elementary::sin;
use linelit_geometry::glam::DAffine3;
use linelit_geometry::{DMat3, DVec3};
use linelit_scene::{Camera, Projection, SceneDescription};

/// Creates a camera that sees a whole box from the front, a little from the right and from above,
/// in a right-handed world with y up.
pub(crate) fn camera(lo: DVec3, hi: DVec3, size: [u32; 2]) -> Camera {
    /// The angle of view of the camera over the shorter side of the picture, in degrees.
    const FOV_DEGREES: f64 = 40.0;
    // Choose the distance so that the ball around the box fits into the angle of view.
    let centre = 0.5 * (lo + hi);
    let radius = (0.5 * (hi - lo).length()).max(f64::MIN_POSITIVE);
    let backward = DVec3::new(0.4, 0.35, 1.0).normalize();
    let distance = radius / sin((0.5 * FOV_DEGREES).to_radians());
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

/// The position and the size of a framing light, relative to the distance from the camera to the
/// centre of the scene: the distance up and to the left of the camera, the distance behind it, and
/// half the side of the square.
const LIGHT: [f64; 3] = [0.35, 0.05, 0.12];

/// Adds a square light next to the camera, above it and to its left, which faces the centre of the
/// scene. The light is for files without lights, whose pictures would be black. A white surface in
/// the centre that faces the light has a radiance of about one. The result is false if the scene is
/// empty.
///
/// ```
/// use linelit_assembly::{LoadOptions, Source, add_framing_light, ply};
///
/// let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
///     property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
///     0 0 0  1 0 0  0 1 0  3 0 1 2\n";
/// let source = Source::new("one.ply", text.into());
/// let mut scene = ply::load(&source, None, &LoadOptions::default())?.scene;
/// assert!(scene.lights.is_empty() && add_framing_light(&mut scene));
/// assert_eq!((scene.lights.len(), scene.triangles.len()), (1, 3));
/// # Ok::<(), linelit_assembly::SceneError>(())
/// ```
pub fn add_framing_light(scene: &mut SceneDescription) -> bool {
    let Some((lo, hi)) = scene.bounds() else {
        return false;
    };
    // Choose the position relative to the camera.
    let [aside, behind, half] = LIGHT;
    let centre = 0.5 * (lo + hi);
    let eye = scene.camera.position();
    let distance = (centre - eye).length().max(0.5 * (hi - lo).length());
    let axes = scene.camera.camera_to_world.matrix3;
    let axis = |v: DVec3| v.normalize_or_zero() * distance;
    let (right, up, forward) = (axis(axes.x_axis), axis(axes.y_axis), axis(axes.z_axis));
    let place = eye + aside * (up - right) - behind * forward;
    // Turn the square to the centre of the scene.
    let Some(normal) = (centre - place).try_normalize() else {
        return false;
    };
    let u = right.cross(normal).try_normalize().unwrap_or(DVec3::Y) * (half * distance);
    let v = normal.cross(u);
    let corners = [place - u - v, place + u - v, place + u + v, place - u + v];
    // Choose the radiance that gives the irradiance π at the centre of the scene.
    let irradiance = std::f64::consts::PI;
    let square = (centre - place).length_squared();
    let radiance = |area: f64| DVec3::splat(irradiance * square / area);
    scene.has_lamp = scene.add_quad_light("framing light", corners, radiance);
    scene.has_lamp
}
