//! The binary tree that the hierarchy is collapsed from.

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

    /// The smallest box around both.
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

    /// Half of the surface of a box that is not empty. In `f64`, where it neither overflows nor
    /// vanishes for any box of `f32`.
    #[inline(always)]
    pub(crate) fn half_area(&self) -> f64 {
        let d = |axis: usize| f64::from(self.hi[axis]) - f64::from(self.lo[axis]);
        let (x, y, z) = (d(0), d(1), d(2));
        x * y + (x + y) * z
    }
}

/// The lesser of two numbers, none of them NaN: one instruction, unlike `f32::min`.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers, none of them NaN.
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A node of the binary tree: a triangle, or two children that stand side by side. The root is
/// node 0, the first child of each pair has an odd number.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Binary {
    pub(super) bounds: Bounds,
    /// The first child, or the triangle.
    pub(super) first: u32,
    /// [`Binary::LEAF`] or nothing.
    pub(super) tag: u32,
}

impl Binary {
    /// The bit of a node that is a single triangle (or, in a part of a tree, where it ends).
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
