//! [`Vector3`]: conversion from the vectors of other libraries.

use crate::DVec3;

/// A point, direction or colour of any library. Constructors take it, so that a renderer need not
/// convert its vectors.
///
/// It is implemented for [`DVec3`], for `[f64; 3]` and `[f32; 3]` (to which vectors of any version
/// of glam, nalgebra or cgmath can be converted), and, with the feature `mint`, for the vectors and
/// points of mint. For functions that take a [`DVec3`], [`vector`] converts; to convert a returned
/// [`DVec3`], use its `to_array()`.
///
/// ```
/// use linelit_geometry::{ConvexPolygon, DVec3, Segment, vector};
/// let lamp = ConvexPolygon::parallelogram([0.0_f32, 0.0, 3.0], [1.0, 0.0, 0.0], DVec3::Y)?;
/// let corners = [[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0], [0.0, 1.0, 3.0]];
/// assert_eq!(lamp, ConvexPolygon::try_from(corners)?);
/// assert_eq!(Segment::from([corners[0], corners[1]]).vector(), vector([1.0, 0.0, 0.0]));
/// # Ok::<(), linelit_geometry::PolygonError>(())
/// ```
pub trait Vector3 {
    /// Converts to [`DVec3`], exactly.
    #[must_use]
    fn dvec3(self) -> DVec3;

    /// Returns the vectors as they are if their type is `[f32; 3]`, so that storing them in single
    /// precision needs no copy.
    #[allow(
        clippy::disallowed_types,
        reason = "what is handed in may be single; what is computed is not"
    )]
    #[must_use]
    fn singles(_of: &[Self]) -> Option<&[[f32; 3]]>
    where
        Self: Sized,
    {
        None
    }
}

/// Converts a point, direction or colour of any library to [`DVec3`], as [`Vector3::dvec3`] does.
#[inline]
#[must_use]
pub fn vector(v: impl Vector3) -> DVec3 {
    v.dvec3()
}

impl Vector3 for DVec3 {
    #[inline]
    fn dvec3(self) -> DVec3 {
        self
    }
}

impl Vector3 for [f64; 3] {
    #[inline]
    fn dvec3(self) -> DVec3 {
        DVec3::from_array(self)
    }
}

#[allow(
    clippy::disallowed_types,
    reason = "what is handed in may be single; what is computed is not"
)]
impl Vector3 for [f32; 3] {
    #[inline]
    fn dvec3(self) -> DVec3 {
        DVec3::from_array(self.map(f64::from))
    }

    #[inline]
    fn singles(of: &[Self]) -> Option<&[Self]> {
        Some(of)
    }
}

/// Implementations for the vectors and points of mint, to which most libraries of vectors can
/// convert.
#[cfg(feature = "mint")]
mod with_mint {
    use super::{DVec3, Vector3};

    macro_rules! mint_vectors {
        ($($vector:ty),*) => {$(
            impl Vector3 for $vector {
                #[inline]
                fn dvec3(self) -> DVec3 {
                    DVec3::new(self.x.into(), self.y.into(), self.z.into())
                }
            }
        )*};
    }

    mint_vectors!(mint::Vector3<f64>, mint::Point3<f64>);
    #[allow(
        clippy::disallowed_types,
        reason = "what is handed in may be single; what is computed is not"
    )]
    mod single {
        use super::{DVec3, Vector3};
        mint_vectors!(mint::Vector3<f32>, mint::Point3<f32>);
    }

    #[test]
    fn mint_keeps_the_numbers() {
        let (x, y, z) = (0.1_f32, -2.0, 3.5);
        let single = mint::Vector3 { x, y, z }.dvec3();
        assert_eq!(single, [x, y, z].dvec3());
        let [x, y, z] = [0.1, -2.0, 3.5];
        assert_eq!(mint::Point3 { x, y, z }.dvec3(), DVec3::new(x, y, z));
    }
}
