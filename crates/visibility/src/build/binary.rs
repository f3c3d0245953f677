//! The binary tree that is collapsed to the hierarchy, and the bounding boxes that it consists of.

/// A box in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) lo: [f32; 3],
    pub(crate) hi: [f32; 3],
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self {
        lo: [f32::INFINITY; 3],
        hi: [f32::NEG_INFINITY; 3],
    };

    /// The smallest box around two boxes.
    #[inline(always)]
    pub(crate) fn union(&self, other: &Self) -> Self {
        let mut both = *self;
        both.extend(other);
        both
    }

    #[inline(always)]
    pub(crate) fn extend(&mut self, other: &Self) {
        for axis in 0..3 {
            self.lo[axis] = least(self.lo[axis], other.lo[axis]);
            self.hi[axis] = most(self.hi[axis], other.hi[axis]);
        }
    }

    /// Half of the surface area of a box that is not empty. The area is computed in `f64`, where it
    /// neither overflows nor underflows for any box of `f32`.
    #[inline(always)]
    pub(crate) fn half_area(&self) -> f64 {
        let d = |axis: usize| f64::from(self.hi[axis]) - f64::from(self.lo[axis]);
        let (x, y, z) = (d(0), d(1), d(2));
        x * y + (x + y) * z
    }
}

/// The minimum of two numbers that are not NaN: one instruction, unlike `f32::min`.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The maximum of two numbers that are not NaN.
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A node of the binary tree: a triangle, or two children next to each other in the list. The root
/// is node 0, and the first child of each pair has an odd index.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Binary {
    pub(super) bounds: Bounds,
    /// The index of the first child, or, for a leaf, the index of the triangle.
    pub(super) first: u32,
    /// [`Binary::LEAF`] or zero.
    pub(super) tag: u32,
}

impl Binary {
    /// The bit of a node that is a single triangle, or at which one part of a tree ends that is
    /// handled in parts.
    pub(super) const LEAF: u32 = 1 << 31;

    pub(super) const EMPTY: Self = Self {
        bounds: Bounds::EMPTY,
        first: 0,
        tag: 0,
    };

    #[inline(always)]
    pub(super) fn is_leaf(&self) -> bool {
        self.tag & Self::LEAF != 0
    }
}
