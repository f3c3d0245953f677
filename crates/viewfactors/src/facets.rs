//! Facets: what sends and receives, and what stands in the way.

use crate::patches::{FLAT, Patch, bounds, patches};
use crate::tree::Tree;
use linelit_geometry::{ConvexPolygon, DVec3, Vector3, predicates};
use linelit_visibility::Occluders;
use std::fmt;
use std::ops::Range;

/// The sides of a facet that send and receive. Either side hides others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The side from which the corners run counter-clockwise.
    #[default]
    One,
    /// Both sides.
    Two,
}

/// The reason why facets are refused: the number of the facet or vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetError {
    /// The vertex is NaN, infinite or beyond 2⁶⁰.
    Vertex(usize),
    /// The facet names a vertex that does not exist.
    NoVertex {
        /// The number of the facet.
        facet: usize,
        /// The vertex that it names.
        vertex: u32,
    },
    /// The facet has fewer than 3 corners, more than 16, or no area after rounding to `f32`.
    NoArea(usize),
    /// The corners of the facet do not lie in one plane, or are not convex.
    NotConvex(usize),
}

impl fmt::Display for FacetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(i) => write!(f, "vertex {i} is not finite, or beyond 2^60"),
            Self::NoVertex { facet, vertex } => {
                write!(f, "facet {facet} has vertex {vertex}, which does not exist")
            }
            Self::NoArea(i) => write!(f, "facet {i} has no area, or not 3 to 16 corners"),
            Self::NotConvex(i) => write!(f, "facet {i} is not flat and convex: split it"),
        }
    }
}

impl std::error::Error for FacetError {}

/// A part of a facet that is exactly flat: all of it, or a triangle.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub polygon: ConvexPolygon,
    /// Its triangles among the occluders.
    pub triangles: Range<u32>,
}

/// A convex part of a facet, before rounding.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub polygon: ConvexPolygon,
    pub facet: usize,
    pub patch: usize,
}

/// A facet.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    pub parts: Range<usize>,
    pub pieces: Range<usize>,
    pub area: f64,
}

/// Planar facets that see each other, and hide each other.
///
/// Facets in one plane do not hide each other. Those that overlap in one plane, such as the bottom
/// of a box in a floor, are therefore both seen there, and rows exceed one: cut the lower one out.
#[derive(Clone, Debug)]
pub struct Facets {
    pub(crate) parts: Vec<Part>,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) facets: Vec<Facet>,
    pub(crate) patches: Vec<Patch>,
    pub(crate) patch_tree: Tree,
    /// The largest coordinate.
    pub(crate) size: f64,
    /// The height above a plane that is rounding.
    pub(crate) room: f64,
    pub(crate) occluders: Occluders,
    pub(crate) sides: Sides,
    pub(crate) middle: DVec3,
    displacement: f64,
}

/// The largest coordinate.
const LARGEST: f64 = (1_u64 << 60) as f64;

impl Facets {
    /// Facets from vertices and the vertices' numbers of each polygon, which is flat and convex.
    ///
    /// # Errors
    /// The first vertex or facet that is not valid.
    pub fn new<P: AsRef<[u32]>>(
        vertices: &[[f64; 3]],
        polygons: &[P],
        sides: Sides,
    ) -> Result<Self, FacetError> {
        let is_valid = |v: &[f64; 3]| v.iter().all(|x| x.abs() <= LARGEST);
        if let Some(i) = vertices.iter().position(|v| !is_valid(v)) {
            return Err(FacetError::Vertex(i));
        }
        let first = vertices.first().map_or(DVec3::ZERO, |v| v.dvec3());
        let all = vertices.iter().map(|v| v.dvec3());
        let (low, high) = all.fold((first, first), |(low, high), v| (low.min(v), high.max(v)));
        let middle = 0.5 * (low + high);
        let mut displacement = 0.0_f64;
        let mut rounded = Vec::with_capacity(vertices.len());
        for vertex in vertices {
            let exact = vertex.dvec3() - middle;
            let near = exact.as_vec3();
            displacement = displacement.max(near.as_dvec3().distance(exact));
            rounded.push(near.to_array());
        }
        let mut built = Self {
            parts: Vec::new(),
            pieces: Vec::new(),
            facets: Vec::new(),
            patches: Vec::new(),
            patch_tree: Tree::default(),
            size: (high - middle).max_element(),
            room: FLAT * (high - middle).max_element(),
            occluders: Occluders::default(),
            sides,
            middle,
            displacement,
        };
        let (mut triangles, mut outlines) = (Vec::new(), Vec::new());
        for (i, polygon) in polygons.iter().enumerate() {
            built.add(i, polygon.as_ref(), vertices, &rounded, &mut triangles)?;
            let moved = |v: &u32| vertices[*v as usize].dvec3() - middle;
            outlines.push(polygon.as_ref().iter().map(moved).collect());
        }
        let polygons: Vec<ConvexPolygon> = built.parts.iter().map(|part| part.polygon).collect();
        built.patches = patches(&polygons, &outlines, |part| built.parts[part].facet);
        for (k, patch) in built.patches.iter().enumerate() {
            for &part in &patch.tree.order {
                built.parts[part].patch = k;
            }
        }
        let all = (0..built.patches.len()).collect();
        built.patch_tree = Tree::build(all, |k| bounds(built.patches[k].polygon.vertices()));
        built.occluders = Occluders::build(&rounded, &triangles);
        Ok(built)
    }

    /// Adds a facet.
    fn add(
        &mut self,
        i: usize,
        polygon: &[u32],
        vertices: &[[f64; 3]],
        rounded: &[[f32; 3]],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<(), FacetError> {
        let missing = |v: &&u32| **v as usize >= vertices.len();
        if let Some(&vertex) = polygon.iter().find(missing) {
            return Err(FacetError::NoVertex { facet: i, vertex });
        }
        if !(3..=ConvexPolygon::CAPACITY).contains(&polygon.len()) {
            return Err(FacetError::NoArea(i));
        }
        let moved = |v: &u32| vertices[*v as usize].dvec3() - self.middle;
        let corners: Vec<DVec3> = polygon.iter().map(moved).collect();
        let whole = ConvexPolygon::new(&corners).map_err(|_| FacetError::NotConvex(i))?;
        let first = (self.parts.len(), self.pieces.len());
        self.parts.push(Part {
            polygon: whole,
            facet: i,
            patch: 0,
        });
        self.add_pieces(polygon, rounded, triangles);
        if self.pieces.len() == first.1 {
            return Err(FacetError::NoArea(i));
        }
        self.facets.push(Facet {
            parts: first.0..self.parts.len(),
            pieces: first.1..self.pieces.len(),
            area: whole.area(),
        });
        Ok(())
    }

    /// Adds what rounding leaves of a polygon: one piece where its corners still lie in one plane,
    /// else triangles, which are flat.
    fn add_pieces(&mut self, polygon: &[u32], rounded: &[[f32; 3]], triangles: &mut Vec<[u32; 3]>) {
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let corner = |v: &u32| rounded[*v as usize].dvec3();
        let corners: Vec<DVec3> = polygon.iter().map(corner).collect();
        let fan = (2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]]);
        let [a, b, c] = [corners[0], corners[1], corners[2]];
        let height = |d: &DVec3| predicates::determinant(b - a, c - a, *d - a);
        let is_flat = corners[3..].iter().all(|d| height(d) == 0.0);
        let whole = is_flat.then(|| ConvexPolygon::new(&corners).ok()).flatten();
        let first = number(triangles.len());
        if let Some(polygon) = whole {
            triangles.extend(fan);
            self.pieces.push(Piece {
                polygon,
                triangles: first..number(triangles.len()),
            });
            return;
        }
        for triangle in fan {
            // What rounding left without area neither sends nor hides.
            if let Ok(polygon) = ConvexPolygon::new(&triangle.map(|v| corner(&v))) {
                let own = number(triangles.len());
                triangles.push(triangle);
                self.pieces.push(Piece {
                    polygon,
                    triangles: own..own + 1,
                });
            }
        }
    }

    /// The number of facets.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.facets.len()
    }

    /// Whether there are no facets.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// The area of a facet.
    ///
    /// # Panics
    /// If there is no facet of this number.
    #[must_use]
    pub fn area(&self, facet: usize) -> f64 {
        self.facets[facet].area
    }

    /// The distance by which rounding to `f32` moved a vertex, at most.
    #[must_use]
    pub const fn displacement(&self) -> f64 {
        self.displacement
    }
}
