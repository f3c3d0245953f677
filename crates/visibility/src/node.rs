//! The memory layout of the hierarchy: nodes of eight boxes, and leaves of up to eight triangles,
//! both as structures of arrays so that one vector instruction handles all eight.

use crate::build::Bounds;

/// The largest number of triangles between a point and a light that are stored. A shaft with more
/// triangles is dense: its lines walk the hierarchy themselves, a few at a time. Whether a shaft is
/// dense depends on the geometry alone, so that results do not depend on the machine; see
/// `docs/decisions/010-dense-shafts.md`.
pub(crate) const DENSE: usize = 224;

/// A node of the hierarchy: eight boxes, and a reference to what each of them holds.
///
/// Boxes are relative to the hierarchy's origin and enclose their triangles without rounding, since
/// every vertex is stored as an `f32` relative to that origin.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// The rows of the lower x, y and z, then of the upper x, y and z, of the eight boxes.
    pub(crate) bounds: [[f32; 8]; 6],
    /// The contents of each box, as the 32 bits of a [`Child`].
    pub(crate) child: [u32; 8],
    /// A bit for each box in use.
    pub(crate) valid: u8,
    /// A bit for each box that holds a leaf.
    pub(crate) leaf: u8,
    /// A bit for each box that holds more than [`DENSE`] triangles, so that a shaft that contains
    /// the box is dense.
    pub(crate) dense: u8,
    /// A bit for each box that holds a triangle of a fine surface.
    pub(crate) fine: u8,
    /// A bit for each box in which all triangles belong to fine surfaces.
    pub(crate) all_fine: u8,
}

impl Node {
    /// Returns the box in `lane`.
    pub(crate) fn bounds_of(&self, lane: usize) -> Bounds {
        Bounds {
            lo: [0, 1, 2].map(|axis| self.bounds[axis][lane]),
            hi: [3, 4, 5].map(|row| self.bounds[row][lane]),
        }
    }

    /// Replaces the box in `lane` by `bounds`.
    pub(crate) fn set_bounds(&mut self, lane: usize, bounds: &Bounds) {
        let rows = bounds.lo.iter().chain(&bounds.hi);
        for (row, x) in self.bounds.iter_mut().zip(rows) {
            row[lane] = *x;
        }
    }

    /// Returns the lanes that hold a box.
    pub(crate) fn lanes(&self) -> impl Iterator<Item = usize> + use<> {
        let valid = self.valid;
        (0..8).filter(move |lane| valid >> lane & 1 != 0)
    }

    /// Returns the node with its children's indices shifted, for a list in which `nodes` nodes and
    /// `leaves` leaves precede those of the part of the hierarchy that the node belongs to.
    pub(crate) fn renumbered(mut self, nodes: usize, leaves: usize) -> Self {
        for lane in self.lanes() {
            let old = Child(self.child[lane]);
            let new = match old.is_leaf() {
                true => Child::leaf(leaves + old.index(), old.count() as usize),
                false => Child::node(nodes + old.index()),
            };
            self.child[lane] = new.0;
        }
        self
    }
}

/// A reference to a node or a leaf, in 32 bits. For a node it is the index; for a leaf the highest
/// bit is set, followed by the leaf's index and, in the last three bits, the number of the leaf's
/// triangles minus one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Child(pub(crate) u32);

impl Child {
    /// The bit of a reference to a leaf.
    const LEAF: u32 = 1 << 31;

    pub(crate) fn node(index: usize) -> Self {
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        assert!(index < Self::LEAF, "fewer than 2^31 nodes");
        Self(index)
    }

    pub(crate) fn leaf(index: usize, count: usize) -> Self {
        debug_assert!((1..=8).contains(&count));
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        assert!(index < 1 << 28, "fewer than 2^28 leaves");
        #[allow(clippy::cast_possible_truncation, reason = "1 to 8")]
        Self(Self::LEAF | (index << 3) | (count as u32 - 1))
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The index of the node or of the leaf in its list.
    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        if self.is_leaf() {
            self.leaf_index()
        } else {
            self.0 as usize
        }
    }

    /// The index of the leaf, for a reference that is known to be to a leaf.
    #[inline(always)]
    pub(crate) fn leaf_index(self) -> usize {
        ((self.0 & !Self::LEAF) >> 3) as usize
    }

    /// The slots of a leaf's eight lanes, leaf × 8 + lane. This crate refers to triangles by their
    /// slots.
    #[inline(always)]
    pub(crate) fn slots(self) -> [u32; 8] {
        let first = self.0 & !Self::LEAF & !7;
        let mut slots = [0; 8];
        for (lane, slot) in (0..).zip(&mut slots) {
            *slot = first + lane;
        }
        slots
    }

    /// For a leaf, a bit for each lane that holds a triangle.
    #[inline(always)]
    pub(crate) fn mask(self) -> u8 {
        0xff >> (7 - (self.0 & 7))
    }

    /// The number of a leaf's triangles.
    #[inline(always)]
    pub(crate) fn count(self) -> u32 {
        (self.0 & 7) + 1
    }
}

/// A leaf: up to eight triangles side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Leaf {
    /// The rows x, y, z of vertex 0, then of vertices 1 and 2, relative to the hierarchy's origin.
    /// Lanes that are not in use repeat the first triangle.
    pub(crate) vertices: [[f32; 8]; 9],
    /// The triangles' indices in the caller's list.
    pub(crate) id: [u32; 8],
}

impl Leaf {
    pub(crate) const EMPTY: Self = Self {
        vertices: [[0.0; 8]; 9],
        id: [u32::MAX; 8],
    };

    /// The vertices of one triangle.
    #[inline(always)]
    pub(crate) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        let v = &self.vertices;
        [
            [v[0][lane], v[1][lane], v[2][lane]],
            [v[3][lane], v[4][lane], v[5][lane]],
            [v[6][lane], v[7][lane], v[8][lane]],
        ]
    }
}
