//! Filters: which parts of triangles hide anything.

use linelit_geometry::intervals::Interval;
use std::{fmt::Debug, sync::Arc};

/// Cuts holes into triangles (`Occluders::with_holes`): what
/// Embree's filter functions do for rays, for rays and lines.
///
/// Places are barycentric coordinates of a triangle's second and third corner, as in
/// [`Hit::barycentric`](crate::Hit::barycentric). Both functions are to tell of the same set of
/// places, but for rounding: else points and lines converge to different pictures. They are asked
/// from several threads, in no particular order, and the more often the more is in the way; one
/// that answers a question now so and now otherwise makes pictures that depend on the number of
/// threads.
///
/// [`AlphaMask`](crate::AlphaMask) is the one for grids of texels.
///
/// ```
/// use linelit_visibility::{Filter, geometry::intervals::Interval};
///
/// /// Triangles hide where their second barycentric coordinate is below one half.
/// #[derive(Debug)]
/// struct Half;
///
/// impl Filter for Half {
///     fn hides(&self, _: u32, [b, _]: [f64; 2]) -> bool {
///         b < 0.5
///     }
///
///     fn hides_along(&self, _: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>) {
///         let [[from, _], [to, _]] = ends;
///         // Where the straight line from one to the other crosses one half.
///         let at = ((0.5 - from) / (to - from)).clamp(0.0, 1.0);
///         match (from < 0.5, to < 0.5) {
///             (true, true) => hidden.push(Interval::UNIT),
///             (true, false) => hidden.push(Interval::new(0.0, at)),
///             (false, true) => hidden.push(Interval::new(at, 1.0)),
///             (false, false) => {}
///         }
///     }
/// }
///
/// let mut hidden = Vec::new();
/// Half.hides_along(0, [[0.25, 0.0], [0.75, 0.0]], &mut hidden);
/// assert_eq!(hidden, [Interval::new(0.0, 0.5)]);
/// assert!(Half.hides(0, [0.25, 0.0]));
/// ```
pub trait Filter: Debug + Send + Sync {
    /// Whether a triangle hides what is behind one of its places.
    fn hides(&self, triangle: u32, barycentric: [f64; 2]) -> bool;

    /// Pushes to `hidden`, which is empty, the intervals of the segment between two places of a
    /// triangle that hide what is behind them; 0 is the first place and 1 the second. They may
    /// touch and overlap and come in any order; what is outside of [0, 1] or not a number is
    /// ignored.
    fn hides_along(&self, triangle: u32, ends: [[f64; 2]; 2], hidden: &mut Vec<Interval>);
}

/// A filter of whichever type, to be shared: what is in the way of a point calls it through
/// a table, as Embree calls its filter functions. Triangles without holes do not need it.
pub type SharedFilter = Arc<AnyFilter>;

/// A filter of whichever type.
pub type AnyFilter = dyn Filter;
