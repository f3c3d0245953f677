//! The rounding of vertices to single precision: relative to which origin, and how far it moves
//! them.
//!
//! A coordinate x is rounded to `f32` with an error of up to 2⁻²⁴ |x|, which is half a metre at the
//! five million metres of a map. So x − o is stored instead, for an origin o in the middle of the
//! scene, and the error is 2⁻²⁴ of the scene's extent, no matter where the scene is.
#![allow(
    clippy::disallowed_types,
    reason = "this is where numbers become single"
)]

use crate::DVec3;
use core::fmt;

/// Returns the origin for vertices in the box from `low` to `high`: on each axis the centre of the
/// box, if the centre is more than four times as far from zero as the box is large; otherwise zero.
///
/// Vertices of scenes around zero are stored as they are, since subtracting the centre would gain
/// at most three bits. Differences from the origin are exact in `f64` (Sterbenz). The origin itself
/// is rounded to `f32` if that moves it by less than an eighth of the box's size; then vertices
/// that are `f32` numbers have exact differences.
///
/// ```
/// use linelit_geometry::{DVec3, origin_of_box};
/// let (low, high) = (DVec3::new(-2.0, 500_000.0, 0.0), DVec3::new(9.0, 500_004.0, 3.0));
/// assert_eq!(origin_of_box(low, high), DVec3::new(0.0, 500_002.0, 0.0));
/// ```
#[must_use]
pub fn origin_of_box(low: DVec3, high: DVec3) -> DVec3 {
    let size = (high - low).max_element();
    let axis = |low: f64, high: f64| {
        let middle = low + (high - low) * 0.5;
        // An empty box has no middle.
        if !(size >= 0.0 && middle.abs() > 4.0 * size) {
            return 0.0;
        }
        #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
        let short = f64::from(middle as f32);
        match (short - middle).abs() <= 0.125 * size {
            true => short,
            false => middle,
        }
    };
    let (l, h) = (low, high);
    DVec3::new(axis(l.x, h.x), axis(l.y, h.y), axis(l.z, h.z))
}

/// How rounding to single precision moved the vertices of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// The largest distance by which a vertex that some triangle uses was moved.
    pub displacement: f64,
    /// The median length of the edges of triangles; for large scenes, of the edges of a sample of
    /// triangles.
    pub median_edge: f64,
}

impl Rounding {
    /// Creates the summary from the displacement and the lengths of edges, which are reordered.
    #[must_use]
    pub fn new(displacement: f64, edges: &mut [f64]) -> Self {
        let middle = edges.len() / 2;
        let median_edge = match edges {
            [] => 0.0,
            edges => *edges.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        Self {
            displacement,
            median_edge,
        }
    }

    /// Whether a vertex was moved by more than a thousandth of the median edge, so that results may
    /// be wrong where the scene has edges of that size. The text of this value says so.
    #[must_use]
    pub fn is_coarse(&self) -> bool {
        self.displacement > 1e-3 * self.median_edge
    }
}

impl fmt::Display for Rounding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "rounding to single precision moves a vertex by {:.1e}, more than a thousandth of the \
             median edge, {:.1e}: the scene is too large for its details",
            self.displacement, self.median_edge
        )
    }
}
