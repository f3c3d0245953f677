//! Helpers for arrays of eight numbers that one vector instruction handles.

use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// An array of eight numbers, or rows of eight numbers, aligned for the widest vector load.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Lanes<T>(pub(crate) T);

impl<T> std::ops::Deref for Lanes<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> std::ops::DerefMut for Lanes<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// Computes `n·(x, y, z)` for eight vectors, in the same order of additions as `DVec3::dot`.
#[inline(always)]
pub(crate) fn ddot<S: Simd>(n: DVec3, x: S::D, y: S::D, z: S::D) -> S::D {
    x * n.x + y * n.y + z * n.z
}

/// Returns the absolute values of eight numbers.
#[inline(always)]
pub(crate) fn dabs<S: Simd>(s: S, a: S::D) -> S::D {
    s.dmax(a, s.dsplat(0.0) - a)
}
