//! The error type of the façade: the reasons why a scene or a query is refused.

use linelit_estimators::MOST_SAMPLES;
use std::fmt;

/// The reason why a [`Scene`](crate::Scene) or its builder refuses the input. Vertices, triangles,
/// lights and points are given by their indices, from 0, in the slices of the call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The vertex with this index is NaN, infinite or beyond 2⁶⁰.
    Vertex(usize),
    /// A triangle names a vertex that does not exist.
    Triangle {
        /// The number of the triangle.
        triangle: usize,
        /// The index of the vertex that the triangle names.
        vertex: u32,
        /// The number of vertices of the scene.
        vertices: usize,
    },
    /// The light with this index has an emission, a position, a size or a direction that is not
    /// valid: negative, not finite or beyond 2⁶⁰, or of length zero.
    Light(usize),
    /// The scene has no light with the requested index.
    NoLight {
        /// The requested index.
        light: usize,
        /// The number of lights of the scene.
        lights: usize,
    },
    /// The range of triangles of the light with this index is not a range of the scene's triangles.
    LightTriangles(usize),
    /// The light with this index has no exact answer. Either the estimator is `exact`, which is for
    /// polygons without a profile, lines, points and parallel light, and would have noise here; or
    /// the visible part of the light has no exact form: see
    /// [`Scene::visible_fraction`](crate::Scene::visible_fraction) and
    /// [`Scene::visible_polygons`](crate::Scene::visible_polygons).
    NotExact(usize),
    /// A triangle reaches into a spherical light on the side that the point sees, so that the
    /// visible part of the light is not a part of the flat disk of its outline.
    Pierced {
        /// The number of the point.
        point: usize,
        /// The number of the light.
        light: usize,
    },
    /// A profile was given to the light with this index, which has no normal, or before any light
    /// was added. Profiles are for polygons, disks, spheres and cylinders.
    Profile(usize),
    /// A margin is not between 0 and 1, or the surface offset is negative or not finite.
    Setting,
    /// The requested number of samples for each point and light is more than
    /// [`MOST_SAMPLES`](crate::estimators::MOST_SAMPLES).
    Samples(u32),
    /// The point with this index is NaN, infinite or beyond 2⁶⁰.
    Point(usize),
    /// The normal of the point with this index is zero, NaN or infinite.
    Normal(usize),
    /// The direction to the viewer of the point with this index is zero, NaN or infinite.
    Outgoing(usize),
    /// A slice does not have the same length as the slice of points.
    Length {
        /// The content of the slice in words, such as "normals".
        of: &'static str,
        /// The number of points.
        points: usize,
        /// The length of the slice.
        found: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(i) => write!(f, "vertex {i} is not finite, or beyond 2^60"),
            Self::Triangle {
                triangle,
                vertex,
                vertices,
            } => write!(
                f,
                "triangle {triangle} has vertex {vertex}, but there are {vertices} vertices"
            ),
            Self::Light(i) => write!(
                f,
                "light {i} has an emission, a place, a size or a direction that no light has"
            ),
            Self::NoLight { light, lights } => {
                write!(f, "there is no light {light}; the scene has {lights}")
            }
            Self::LightTriangles(i) => write!(f, "the triangles of light {i} do not exist"),
            Self::NotExact(i) => write!(
                f,
                "there is no exact answer for light {i}: irradiance has one for polygons without a \
                 profile, lines, points and parallel light, and `hybrid` takes all lights; visible \
                 parts are known of all but cylinders and skies, as polygons of polygons, disks \
                 and spheres"
            ),
            Self::Pierced { point, light } => write!(
                f,
                "a triangle reaches into light {light}, a sphere, as point {point} sees it"
            ),
            Self::Profile(i) => write!(f, "light {i} takes no profile, or does not exist yet"),
            Self::Setting => write!(
                f,
                "a margin is not in [0, 1), or the surface offset is not a finite number of at least zero"
            ),
            Self::Samples(n) => write!(f, "{n} samples are more than {MOST_SAMPLES}"),
            Self::Point(i) => write!(f, "point {i} is not finite, or beyond 2^60"),
            Self::Normal(i) => write!(f, "normal {i} is zero or not finite"),
            Self::Outgoing(i) => write!(f, "outgoing direction {i} is zero or not finite"),
            Self::Length { of, points, found } => {
                write!(f, "{found} {of} for {points} points")
            }
        }
    }
}

impl std::error::Error for Error {}
