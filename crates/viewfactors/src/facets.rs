//! [`Facets`], the scene of view factors: planar polygons that send, receive and hide. Building it
//! cuts them into convex parts, removes what coincides, and prepares two representations: parts and
//! patches in `f64`, for view factors between facets, and pieces rounded to `f32`, for view factors
//! from points.

use crate::covered;
use crate::layers::stacks;
use crate::outline::{Refused, convex_parts};
use crate::patches::{FLAT, Patch, bounds, patches};
use crate::rounded::{Rounder, flat_pieces, rounded};
use crate::tree::Tree;
use linelit_geometry::{ConvexPolygon, DVec3, Rounding, Vector3, stop};
use linelit_visibility::Occluders;
use std::fmt;
use std::ops::Range;

/// Which sides of facets send and receive. Both sides hide others in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The side from which the corners run counter-clockwise.
    #[default]
    One,
    /// Both sides.
    Two,
}

/// The reason why facets are refused, with the number of the facet or vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetError {
    /// A coordinate of the vertex is NaN, infinite or beyond 2⁶⁰.
    Vertex(usize),
    /// The facet refers to a vertex that does not exist.
    NoVertex {
        /// The number of the facet.
        facet: usize,
        /// The number of the vertex that it refers to.
        vertex: u32,
    },
    /// The facet has fewer than 3 corners, or no area, or none after rounding to `f32`.
    NoArea(usize),
    /// The corners of the facet do not lie in one plane.
    NotFlat(usize),
    /// The outline of the facet crosses or touches itself.
    Crossing(usize),
    /// Too many facets: 2³¹ or more.
    TooMany,
}

impl fmt::Display for FacetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(i) => write!(f, "vertex {i} is not finite, or beyond 2^60"),
            Self::NoVertex { facet, vertex } => {
                write!(f, "facet {facet} has vertex {vertex}, which does not exist")
            }
            Self::NoArea(i) => write!(f, "facet {i} has no area"),
            Self::NotFlat(i) => write!(f, "facet {i} is not flat: split it into triangles"),
            Self::Crossing(i) => write!(f, "the outline of facet {i} crosses or touches itself"),
            Self::TooMany => write!(f, "there are more than 2^31 facets"),
        }
    }
}

impl std::error::Error for FacetError {}

/// A convex polygon that is exactly flat after rounding to `f32`, with the facets that are seen on
/// its two sides.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub polygon: ConvexPolygon,
    /// The facet that is seen from the side to which the normal points, and the one from the other
    /// side.
    pub seen: [Option<usize>; 2],
    /// The range of the piece's triangles among the occluders.
    pub triangles: Range<u32>,
}

/// A convex part of a facet, before rounding, with the number of its facet and of the patch that it
/// belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub polygon: ConvexPolygon,
    pub facet: usize,
    pub patch: usize,
    /// The tolerance for flatness: corners that it shares with other parts are within this height
    /// of its plane.
    pub flatness: f64,
}

/// The range of a facet's parts, and their area.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facet {
    pub parts: Range<usize>,
    pub area: f64,
}

/// Planar facets between which view factors are computed, and which hide each other.
///
/// Facets in one plane do not hide each other. Where facets coincide in one plane and are seen from
/// the same side, only the one with the lowest number counts: the parts of others that it covers
/// neither send nor receive.
#[derive(Clone, Debug)]
pub struct Facets {
    pub(crate) parts: Vec<Part>,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) facets: Vec<Facet>,
    pub(crate) patches: Vec<Patch>,
    pub(crate) patch_tree: Tree,
    /// The largest coordinate after the middle was subtracted.
    pub(crate) size: f64,
    pub(crate) occluders: Occluders,
    pub(crate) sides: Sides,
    pub(crate) middle: DVec3,
    rounding: Rounding,
}

/// The largest absolute coordinate of vertices.
const LARGEST: f64 = (1_u64 << 60) as f64;

impl Facets {
    /// Creates facets from vertices and, for each facet, a polygon of vertex numbers. Each polygon
    /// has to be flat, and its outline must not cross itself.
    ///
    /// # Errors
    /// Returns an error for the first vertex or facet that is not valid.
    pub fn new<P: AsRef<[u32]>>(
        vertices: &[[f64; 3]],
        polygons: &[P],
        sides: Sides,
    ) -> Result<Self, FacetError> {
        let is_valid = |v: &[f64; 3]| v.iter().all(|x| x.abs() <= LARGEST);
        if let Some(i) = vertices.iter().position(|v| !is_valid(v)) {
            return Err(FacetError::Vertex(i));
        }
        if polygons.len() >= 1 << 31 {
            return Err(FacetError::TooMany);
        }
        // Find the middle of the vertices that facets use, and the tolerance for flatness, which
        // follows from the rounding of the coordinates as given, since these are larger.
        let numbers = polygons.iter().flat_map(|polygon| polygon.as_ref());
        let used = numbers.filter_map(|v| vertices.get(*v as usize));
        let used: Vec<DVec3> = used.map(|v| v.dvec3()).collect();
        let [low, high] = bounds(&used);
        let middle = 0.5 * (low + high);
        let size = (high - middle).max_element();
        let largest = low.abs().max(high.abs()).max_element();
        let flatness = FLAT * largest;
        // Cut facets into convex parts, and take away what coincides.
        let outlines = outlines(vertices, polygons, middle, largest)?;
        let outlines = covered::without(&outlines, flatness, sides);
        let mut built = Self {
            parts: Vec::with_capacity(outlines.len()),
            pieces: Vec::new(),
            facets: vec![Facet::default(); polygons.len()],
            patches: Vec::new(),
            patch_tree: Tree::default(),
            size,
            occluders: Occluders::default(),
            sides,
            middle,
            rounding: Rounding::default(),
        };
        // Make the parts; what coincident facets leave of others may be a sliver that is only
        // rounding.
        let mut corners = Vec::new();
        for (facet, outline) in outlines {
            if let Ok(polygon) = ConvexPolygon::new(&outline) {
                built.facets[facet].area += polygon.area();
                built.facets[facet].parts.end += 1;
                // Corners were moved onto the plane, here and in other parts that share them.
                let moved = outline.iter().zip(polygon.vertices());
                let moved = moved.fold(0.0_f64, |most, (v, w)| most.max(v.distance(*w)));
                corners.push(outline);
                built.parts.push(Part {
                    polygon,
                    facet,
                    patch: 0,
                    flatness: flatness + 2.0 * moved,
                });
            }
        }
        built.index(&corners);
        Ok(built)
    }

    /// Prepares what is derived from the parts: pieces and occluders, the ranges of facets, and
    /// patches.
    fn index(&mut self, corners: &[Vec<DVec3>]) {
        // Round the facets for view factors from points, and measure how far that moved corners.
        let mut rounder = Rounder::default();
        for (corners, seen) in stacks(&self.parts, corners, self.sides) {
            rounder.add(seen, &corners);
        }
        let sides = corners.iter().flat_map(|c| {
            let next = c.iter().cycle().skip(1);
            c.iter().zip(next).map(|(a, b)| a.distance(*b))
        });
        self.rounding = Rounding::new(rounder.displacement, &mut sides.collect::<Vec<_>>());
        (self.pieces, self.occluders) = rounder.finish();
        // Number the parts of each facet, and join parts in one plane to patches.
        let mut parts = 0;
        for facet in &mut self.facets {
            facet.parts = parts..parts + facet.parts.end;
            parts = facet.parts.end;
        }
        self.patches = patches(&self.parts, corners);
        for (k, patch) in self.patches.iter().enumerate() {
            for &part in &patch.tree.order {
                self.parts[part].patch = k;
            }
        }
        let all = (0..self.patches.len()).collect();
        self.patch_tree = Tree::build(all, |k| bounds(self.patches[k].polygon.vertices()));
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

    /// The area of a facet, without what facets of lower numbers cover.
    ///
    /// # Panics
    /// If there is no facet of this number.
    #[must_use]
    pub fn area(&self, facet: usize) -> f64 {
        self.facets[facet].area
    }

    /// A bound of the distance by which rounding to `f32` moved vertices. View factors from points
    /// may be off by this distance over the distance of the facet. A facet that is not much wider
    /// than this has no correct digits there; view factors between facets are computed in `f64`.
    #[must_use]
    pub const fn displacement(&self) -> f64 {
        self.rounding.displacement
    }

    /// How rounding to `f32` moved the vertices that facets use. Its text is a warning if the
    /// displacement [is large](Rounding::is_coarse) for the facets' size.
    #[must_use]
    pub const fn rounding(&self) -> Rounding {
        self.rounding
    }
}

/// Cuts all polygons into convex parts, each with the number of its facet.
fn outlines<P: AsRef<[u32]>>(
    vertices: &[[f64; 3]],
    polygons: &[P],
    middle: DVec3,
    largest: f64,
) -> Result<Vec<(usize, Vec<DVec3>)>, FacetError> {
    let mut parts = Vec::with_capacity(polygons.len());
    for (facet, polygon) in polygons.iter().enumerate() {
        stop::check();
        let polygon = polygon.as_ref();
        let missing = |v: &&u32| **v as usize >= vertices.len();
        if let Some(&vertex) = polygon.iter().find(missing) {
            return Err(FacetError::NoVertex { facet, vertex });
        }
        let moved = |v: &u32| vertices[*v as usize].dvec3() - middle;
        let corners: Vec<DVec3> = polygon.iter().map(moved).collect();
        let convex = convex_parts(&corners, largest).map_err(|refused| match refused {
            Refused::NoArea => FacetError::NoArea(facet),
            Refused::NotFlat => FacetError::NotFlat(facet),
            Refused::Crossing => FacetError::Crossing(facet),
        })?;
        // Refuse facets that have no area after rounding.
        let has_area = |corners: &Vec<DVec3>| {
            let rounded: Vec<DVec3> = corners.iter().map(rounded).collect();
            !flat_pieces(&rounded).is_empty()
        };
        if !convex.iter().any(has_area) {
            return Err(FacetError::NoArea(facet));
        }
        parts.extend(convex.into_iter().map(|corners| (facet, corners)));
    }
    Ok(parts)
}
