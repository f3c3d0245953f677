//! [`Camera`], which maps positions on the film to rays, as pbrt's cameras do.

use crate::footprint::RayDifferential;
use linelit_elementary::{sin_cos, tan};
use linelit_geometry::DVec3;
use linelit_geometry::glam::{DAffine3, DMat4, DVec4};

/// The map from film positions to directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole camera.
    Perspective {
        /// The full angle of view over the shorter side of the image, as in pbrt, in degrees, in
        /// (0, 180).
        fov_degrees: f64,
    },
    /// A camera with parallel rays; the screen window is in units of camera space.
    Orthographic,
    /// A camera that sees the whole sphere of directions: latitude over y, longitude over x.
    Spherical {
        /// Whether the vertical axis is z, as in pbrt-v4, instead of y, as in pbrt-v3's
        /// `environment` camera.
        z_up: bool,
    },
}

/// A camera ray in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// The origin of the ray.
    pub origin: DVec3,
    /// The direction of the ray, of unit length.
    pub direction: DVec3,
}

/// A camera: projection, placement and the size of its film in pixels.
///
/// Camera space is pbrt's: x to the right, y up, z into the picture. Whether that is left- or
/// right-handed in the world depends on the placement.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The transform from camera space to world space.
    pub camera_to_world: DAffine3,
    projection: Projection,
    /// The tangent of half the angle of view of a perspective camera; zero for others.
    tangent: f64,
    /// The screen window `[x_min, x_max, y_min, y_max]`, if the file has one.
    pub screen_window: Option<[f64; 4]>,
    /// The width of the picture over its height, if the scene's file states this ratio.
    pub frame_aspect_ratio: Option<f64>,
    /// The number of pixels across and down.
    resolution: [u32; 2],
    /// The screen window that is used.
    window: [f64; 4],
}

impl Camera {
    /// Creates a camera for a film of these pixels across and down, placed by `camera_to_world`,
    /// which is inverted twice and so may change in the last digits.
    ///
    /// Without a screen window, the window spans −1 to 1 over the shorter side and has the
    /// proportions `frame_aspect_ratio`, or those of the film.
    pub fn new(
        camera_to_world: DAffine3,
        projection: Projection,
        screen_window: Option<[f64; 4]>,
        frame_aspect_ratio: Option<f64>,
        resolution: [u32; 2],
    ) -> Self {
        Self::from_world_to_camera(
            camera_to_world.inverse(),
            projection,
            screen_window,
            frame_aspect_ratio,
            resolution,
        )
    }

    /// Creates a camera like [`Camera::new`], placed by the transform from world to camera space.
    pub fn from_world_to_camera(
        world_to_camera: DAffine3,
        projection: Projection,
        screen_window: Option<[f64; 4]>,
        frame_aspect_ratio: Option<f64>,
        [width, height]: [u32; 2],
    ) -> Self {
        let tangent = match projection {
            Projection::Perspective { fov_degrees } => tan(0.5 * fov_degrees.to_radians()),
            Projection::Orthographic | Projection::Spherical { .. } => 0.0,
        };
        let mut camera = Self {
            camera_to_world: world_to_camera.inverse(),
            projection,
            tangent,
            screen_window,
            frame_aspect_ratio,
            resolution: [1, 1],
            window: [-1.0, 1.0, -1.0, 1.0],
        };
        camera.set_resolution(width, height);
        camera
    }

    /// Changes the number of pixels; the angle of view over the shorter side stays the same.
    pub fn set_resolution(&mut self, width: u32, height: u32) {
        self.resolution = [width.max(1), height.max(1)];
        let pixels = f64::from(self.resolution[0]) / f64::from(self.resolution[1]);
        let aspect = self.frame_aspect_ratio.unwrap_or(pixels);
        self.window = self.screen_window.unwrap_or(if aspect > 1.0 {
            [-aspect, aspect, -1.0, 1.0]
        } else {
            [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
        });
    }

    /// Returns the projection, which maps film positions to directions.
    pub const fn projection(&self) -> Projection {
        self.projection
    }

    /// Returns the number of pixels across and down.
    pub const fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// Returns the matrices from the world to the camera, and from the world to the picture. In the
    /// picture, the upper left corner is (0, 0) and the lower right corner (1, 1). The second
    /// matrix is `None` for spherical projections. A perspective projection maps the depths 0.01
    /// and 1000 to 0 and 1, as in pbrt; an orthographic one does not change depths.
    ///
    /// ```
    /// use linelit_scene::geometry::glam::DAffine3;
    /// use linelit_scene::{Camera, Projection};
    /// let view = Projection::Perspective { fov_degrees: 90.0 };
    /// let camera = Camera::new(DAffine3::IDENTITY, view, None, None, [200, 100]);
    /// let ray = camera.ray(50.0, 25.0);
    /// let to_picture = camera.matrices()[1].unwrap();
    /// let place = to_picture.project_point3(ray.origin + 3.0 * ray.direction);
    /// assert!((place.x - 0.25).abs() < 1e-15 && (place.y - 0.25).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn matrices(&self) -> [Option<DMat4>; 2] {
        // Project from the camera to the screen.
        let to_camera = DMat4::from(self.camera_to_world.inverse());
        let [x_min, x_max, y_min, y_max] = self.window;
        let [near, far] = [0.01, 1000.0];
        let screen = match self.projection {
            Projection::Perspective { .. } => Some(DMat4::from_cols(
                DVec4::X / self.tangent,
                DVec4::Y / self.tangent,
                DVec4::new(0.0, 0.0, far / (far - near), 1.0),
                DVec4::new(0.0, 0.0, -far * near / (far - near), 0.0),
            )),
            Projection::Orthographic => Some(DMat4::IDENTITY),
            Projection::Spherical { .. } => None,
        };
        // Map the screen window to the unit square, whose y axis points down.
        let scale = DVec3::new(1.0 / (x_max - x_min), 1.0 / (y_min - y_max), 1.0);
        let moved = DVec3::new(-x_min, -y_max, 0.0);
        let to_picture = DMat4::from_scale(scale) * DMat4::from_translation(moved);
        let to_picture = screen.map(|screen| to_picture * screen * to_camera);
        [Some(to_camera), to_picture]
    }

    /// Returns the position of the camera in world space.
    pub fn position(&self) -> DVec3 {
        self.camera_to_world.translation
    }

    /// Returns the ray through a position on the film, in pixels from the top left corner; the
    /// centre of the first pixel is (0.5, 0.5). The error of the direction is a few ulps.
    ///
    /// ```
    /// use linelit_scene::geometry::{DVec3, glam::DAffine3};
    /// use linelit_scene::{Camera, Projection};
    ///
    /// let view = Projection::Perspective { fov_degrees: 90.0 };
    /// let camera = Camera::new(DAffine3::IDENTITY, view, None, None, [200, 100]);
    /// assert_eq!(camera.ray(100.0, 50.0).direction, DVec3::Z);
    /// // The top edge is at half the angle over the shorter side.
    /// let up = camera.ray(100.0, 0.0).direction;
    /// assert!((up.y / up.z - 1.0).abs() < 1e-15);
    /// ```
    pub fn ray(&self, film_x: f64, film_y: f64) -> CameraRay {
        // Find the position on the screen.
        let u = film_x / f64::from(self.resolution[0]);
        let v = film_y / f64::from(self.resolution[1]);
        let [x_min, x_max, y_min, y_max] = self.window;
        let screen_x = x_min + u * (x_max - x_min);
        let screen_y = y_max - v * (y_max - y_min);
        // Make the ray in camera space.
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (
                DVec3::ZERO,
                DVec3::new(screen_x * self.tangent, screen_y * self.tangent, 1.0),
            ),
            Projection::Orthographic => (DVec3::new(screen_x, screen_y, 0.0), DVec3::Z),
            Projection::Spherical { z_up } => {
                let (sin_theta, cos_theta) = sin_cos(std::f64::consts::PI * v);
                let (sin_phi, cos_phi) = sin_cos(std::f64::consts::TAU * u);
                let [a, b, c] = [sin_theta * cos_phi, cos_theta, sin_theta * sin_phi];
                (
                    DVec3::ZERO,
                    if z_up {
                        DVec3::new(a, c, b)
                    } else {
                        DVec3::new(a, b, c)
                    },
                )
            }
        };
        // Transform it to the world.
        let direction = self.camera_to_world.transform_vector3(direction);
        CameraRay {
            origin: self.camera_to_world.transform_point3(origin),
            direction: direction.normalize_or(DVec3::Z),
        }
    }

    /// Returns the two rays next to [`Camera::ray`], `spacing` pixels to the right and `spacing`
    /// pixels down, to first order in the spacing: the differences over a whole pixel are scaled,
    /// as in pbrt.
    ///
    /// ```
    /// use linelit_scene::geometry::{DVec3, glam::DAffine3};
    /// use linelit_scene::{Camera, Projection};
    ///
    /// let camera = Camera::new(DAffine3::IDENTITY, Projection::Orthographic, None, None, [2, 2]);
    /// let beside = camera.differential(1.0, 1.0, 0.5);
    /// assert_eq!(beside.origins, [DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, -0.5, 0.0)]);
    /// assert_eq!(beside.directions, [DVec3::Z; 2]);
    /// ```
    pub fn differential(&self, film_x: f64, film_y: f64, spacing: f64) -> RayDifferential {
        let ray = self.ray(film_x, film_y);
        let next = [
            self.ray(film_x + 1.0, film_y),
            self.ray(film_x, film_y + 1.0),
        ];
        RayDifferential {
            origins: next.map(|r| ray.origin.lerp(r.origin, spacing)),
            directions: next.map(|r| ray.direction.lerp(r.direction, spacing)),
        }
    }
}
