//! The public interface for finding a boundary step by step, for callers that do not have all
//! occluders at once.
//!
//! Occluders are added little by little, since which of them matter depends on what the others
//! hide. Each state is a type, so that the steps can only be taken in a valid order:
//!
//! ```text
//! Penumbra ── begin ──► Occluded ── boundary ──► the boundary past all triangles so far
//!                         │  ▲
//!                 outline │  │ past
//!                         ▼  │
//!                        Outline ── boundary ──► the boundary past fine meshes, too
//! ```

use super::edges::hash;
use super::image::Image;
use super::{BoundaryEdge, Bounds, Penumbra, Point, settled};

/// A polygon and the triangles that have been added in front of it.
#[derive(Debug)]
pub struct Occluded<'p>(&'p mut Penumbra);

/// The parts of the edges of triangles and silhouettes in front of a polygon that no triangle
/// hides. Which of them bound the visible part is not known yet, since silhouettes only say how the
/// number of layers (sheets of a surface over a point) changes.
///
/// After triangles were added, a new outline has to be found:
///
/// ```compile_fail,E0382
/// let mut penumbra = linelit_penumbra::Penumbra::default();
/// let light = penumbra.begin(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
/// let outline = light.outline([].into_iter());
/// let more = outline.past([].into_iter());
/// let boundary = outline.boundary(1e-12, |_| true);
/// ```
#[derive(Debug)]
pub struct Outline<'p>(&'p mut Penumbra);

impl Penumbra {
    /// Finds the boundary of a convex polygon minus triangles in its plane, each in either
    /// orientation.
    ///
    /// Edges are returned in no particular order. Together they form closed curves,
    /// counter-clockwise around the visible part and clockwise around its holes, up to the rounding
    /// of their ends. The result is empty if nothing is visible or the light has fewer than three
    /// corners. Coordinates have to be zero or between 1e-60 and 1e60 in absolute value.
    pub fn boundary(
        &mut self,
        light: &[Point],
        triangles: impl Iterator<Item = [Point; 3]>,
    ) -> &[BoundaryEdge] {
        self.begin(light).past(triangles).boundary();
        self.latest()
    }

    /// Begins with a convex polygon without occluders. This is for callers who do not have all
    /// occluders at once, or who have the silhouettes of fine meshes.
    pub fn begin(&mut self, light: &[Point]) -> Occluded<'_> {
        self.set_light(light);
        self.images.clear();
        self.edges.clear();
        Occluded(self).without_silhouettes()
    }

    /// Returns the boundary that was found last.
    #[must_use]
    pub fn latest(&self) -> &[BoundaryEdge] {
        &self.pieces
    }
}

impl<'p> Occluded<'p> {
    /// Adds triangles in the polygon's plane, each in either orientation.
    #[must_use]
    pub fn past(self, triangles: impl Iterator<Item = [Point; 3]>) -> Self {
        if self.0.light.len() < 3 {
            return self;
        }
        let on_light = Bounds::of_all(&self.0.light);
        let known = self.0.images.len();
        let images = triangles.filter_map(Image::new);
        let images = images.filter(|i| i.bounds.meets(&on_light));
        self.0.images.extend(images);
        self.0.collect_edges(known);
        self
    }

    /// Finds the boundary of the polygon minus the triangles, as [`Penumbra::boundary`] returns it.
    pub fn boundary(&mut self) -> &[BoundaryEdge] {
        self.0.find();
        self.0.latest()
    }

    /// Finds the edges that no triangle hides, including the edges of fine meshes, which are given
    /// by their silhouettes: edges from one point to another, each with the number of layers on its
    /// left minus the number on its right.
    ///
    /// Edges may be missing outside of the polygon and behind triangles; elsewhere, the changes of
    /// the number of layers around any point have to add up to zero.
    pub fn outline(self, silhouettes: impl Iterator<Item = (Point, Point, i32)>) -> Outline<'p> {
        self.0.past_surfaces = true;
        let edges = &mut self.0.surface_edges;
        edges.make_room(silhouettes.size_hint().0);
        for (a, b, layers) in silhouettes {
            let (a, b) = (settled(a), settled(b));
            edges.make_room(1);
            let hash = hash(a).wrapping_add(hash(b));
            edges.count(a, b, hash, layers);
        }
        self.0.find();
        Outline(self.0)
    }

    /// Removes the silhouettes of an outline.
    fn without_silhouettes(self) -> Self {
        self.0.past_surfaces = false;
        self.0.surface_edges.clear();
        self
    }
}

impl<'p> Outline<'p> {
    /// Returns all parts of edges that are on the polygon and have no triangle over their right
    /// side: where missing triangles or silhouettes may matter.
    pub fn edges(&self) -> impl Iterator<Item = [Point; 2]> {
        self.0.stretches.iter()
    }

    /// Adds triangles in front of the polygon, and removes the silhouettes.
    pub fn past(self, triangles: impl Iterator<Item = [Point; 3]>) -> Occluded<'p> {
        Occluded(self.0).without_silhouettes().past(triangles)
    }

    /// Finds the boundary of the polygon minus triangles and meshes. `is_visible` is called with
    /// points of the polygon that no triangle hides and that are at least `least` away from all
    /// edges, and returns whether no mesh hides them either.
    ///
    /// For each set of points that edges connect, one point under the fewest layers is queried.
    /// Returns `None` if edges are so close to each other that there is no point to query.
    ///
    /// ```
    /// use linelit_penumbra::Penumbra;
    ///
    /// // A mesh whose silhouette is a triangle: two layers, its front and its back.
    /// let [a, b, c] = [[0.2, 0.2], [0.8, 0.2], [0.2, 0.8]];
    /// let is_past = |p: [f64; 2]| p[0] < 0.2 || p[1] < 0.2 || p[0] + p[1] > 1.0;
    /// let silhouettes = [(a, b, 2), (b, c, 2), (c, a, 2)].into_iter();
    /// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// let mut penumbra = Penumbra::default();
    /// let outline = penumbra.begin(&square).outline(silhouettes);
    /// // The sides of the square and of the triangle.
    /// assert_eq!(outline.edges().count(), 7);
    /// let boundary = outline.boundary(1e-12, is_past).expect("nothing is close");
    /// let area = boundary.iter().map(|e| 0.5 * (e.from[0] * e.to[1] - e.from[1] * e.to[0]));
    /// assert!((area.sum::<f64>() - 0.82).abs() < 1e-15);
    /// ```
    pub fn boundary(
        self,
        least: f64,
        is_visible: impl FnMut(Point) -> bool,
    ) -> Option<&'p [BoundaryEdge]> {
        let penumbra = self.0;
        let is_found = penumbra.find_boundary(least, is_visible);
        is_found.then_some(&penumbra.pieces)
    }
}
