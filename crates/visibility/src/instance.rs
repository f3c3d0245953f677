//! Instances: occluders that stand elsewhere, with holes, or for some rays only.

use crate::{Occluders, Ray, SharedFilter};
use linelit_elementary::{exp2, log2};
use linelit_geometry::{DMat3, DVec3, Segment, Vector3};
use linelit_simd::InstructionSet;
use std::{fmt, sync::Arc};

/// Occluders that stand in others ([`Occluders::with_instances`]): moved by an affine map, perhaps
/// with a [`Filter`](crate::Filter) that cuts holes into their triangles, and with a mask that says
/// which rays meet them.
///
/// The hierarchy is shared: a thousand instances of a mesh take the memory of one, and a few
/// hundred bytes each. Queries are brought to it, in `f64`; no vertex is rounded. One whose
/// triangles are to have holes where they are stands by [`Instance::HERE`].
///
/// ```
/// use linelit_visibility::{Instance, Occluders, Ray, Scratch};
/// use std::sync::Arc;
///
/// // A triangle at z = 1, and two copies of it: one higher up, one mirrored.
/// let positions = [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
/// let leaf = Arc::new(Occluders::build(&positions, &[[0, 1, 2]]));
/// let up = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 4.0]];
/// let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
/// let copies = [up, mirrored].map(|map| Instance::new(leaf.clone(), map));
/// let scene = Occluders::default().with_instances(copies.into_iter().collect::<Result<_, _>>()?);
///
/// let mut scratch = Scratch::new();
/// let mut meets = |x: f64| {
///     let hit = scene.closest_hit(&Ray::new([x, 0.0, 0.0], [0.0, 0.0, 1.0]), &mut scratch)?;
///     Some((hit.t, hit.instance?))
/// };
/// assert_eq!(meets(1.0), Some((5.0, 0)));
/// assert_eq!(meets(-1.0), Some((1.0, 1)));
/// # Ok::<(), linelit_visibility::InstanceError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Instance {
    pub(crate) occluders: Arc<Occluders>,
    /// To the world.
    matrix: DMat3,
    origin: DVec3,
    /// From the world.
    inverse: DMat3,
    pub(crate) filter: Option<SharedFilter>,
    pub(crate) mask: u32,
}

/// Why there is no such [`Instance`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InstanceError {
    /// A number of the map is not finite, or an entry of its inverse is not.
    NotFinite,
    /// The map takes space to a plane, a line or a point, or so nearly that its inverse is rounding
    /// ([`Instance::LARGEST_CONDITION`]).
    Singular,
    /// The occluders have instances themselves: maps are to be multiplied by who has them.
    Nested,
}

impl fmt::Display for InstanceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the map of an instance is not finite",
            Self::Singular => "the map of an instance is singular",
            Self::Nested => "an instance has instances itself",
        })
    }
}

impl std::error::Error for InstanceError {}

impl Instance {
    /// Where the occluders are.
    pub const HERE: [[f64; 3]; 4] = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0],
    ];

    /// The most by which the longest image of a unit vector may exceed the shortest (in the sense
    /// of the largest sums of rows): a query is brought to the occluders to this times a few ε.
    pub const LARGEST_CONDITION: f64 = 1e8;

    /// Occluders moved by an affine map: where it takes the three axes, then the origin. It may
    /// mirror, shear and scale. Met by rays of every mask but 0.
    pub fn new<V: Vector3>(
        occluders: Arc<Occluders>,
        to_world: [V; 4],
    ) -> Result<Self, InstanceError> {
        let [x, y, z, origin] = to_world.map(Vector3::dvec3);
        let matrix = DMat3::from_cols(x, y, z);
        if occluders.instances.is_some() {
            return Err(InstanceError::Nested);
        }
        if !(matrix.is_finite() && origin.is_finite()) {
            return Err(InstanceError::NotFinite);
        }
        let inverse = inverse(&matrix).ok_or(InstanceError::Singular)?;
        if !inverse.is_finite() {
            return Err(InstanceError::NotFinite);
        }
        Ok(Self {
            occluders,
            matrix,
            origin,
            inverse,
            filter: None,
            mask: u32::MAX,
        })
    }

    /// With holes in its triangles.
    #[must_use]
    pub fn with_filter(self, filter: SharedFilter) -> Self {
        Self {
            filter: Some(filter),
            ..self
        }
    }

    /// Met only by rays and lines that have a bit of this mask
    /// ([`Occluders::with_mask`]).
    #[must_use]
    pub fn with_mask(self, mask: u32) -> Self {
        Self { mask, ..self }
    }

    /// What is moved.
    #[must_use]
    pub fn occluders(&self) -> &Arc<Occluders> {
        &self.occluders
    }

    /// The map: where it takes the three axes, then the origin.
    #[must_use]
    pub fn to_world(&self) -> [DVec3; 4] {
        let m = &self.matrix;
        [m.x_axis, m.y_axis, m.z_axis, self.origin]
    }

    /// Whether its triangles may have holes.
    #[must_use]
    pub fn is_filtered(&self) -> bool {
        self.filter.is_some()
    }

    /// The mask.
    #[must_use]
    pub fn mask(&self) -> u32 {
        self.mask
    }

    /// A point of the world in the occluders' coordinates: to 8 ε κ of its distance from the map's
    /// origin there, κ being the map's condition.
    #[inline]
    pub(crate) fn bring(&self, point: DVec3) -> DVec3 {
        self.inverse * (point - self.origin)
    }

    /// A ray in the occluders' coordinates; its t is the same.
    #[inline]
    pub(crate) fn bring_ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.bring(ray.origin),
            direction: self.inverse * ray.direction,
            ..*ray
        }
    }

    /// A line in the occluders' coordinates; its parameter is the same.
    #[inline]
    pub(crate) fn bring_line(&self, line: &Segment) -> Segment {
        Segment::new(self.bring(line.p0), self.bring(line.p1))
    }

    /// A box of the world that holds all of it, a little larger; `None` without triangles.
    pub(crate) fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        let [lo, hi] = self.occluders.bounds()?;
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let center = self.matrix * middle + self.origin;
        let m = &self.matrix;
        let reach = DVec3::from_array([0, 1, 2].map(|k| m.row(k).abs().dot(half)));
        // Sixteen roundings of the terms that the two are sums of.
        let size = DVec3::from_array([0, 1, 2].map(|k| m.row(k).abs().dot(middle.abs() + half)));
        let room = 16.0 * f64::EPSILON * (size + self.origin.abs());
        let (lo, hi) = (center - reach - room, center + reach + room);
        #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
        Some([
            lo.to_array().map(|x| (x as f32).next_down()),
            hi.to_array().map(|x| (x as f32).next_up()),
        ])
    }

    /// Uses no instruction set beyond `limit`.
    pub(crate) fn limited_to(&self, limit: InstructionSet) -> Self {
        let occluders = self.occluders.as_ref().clone().limited_to(limit);
        Self {
            occluders: Arc::new(occluders),
            ..self.clone()
        }
    }
}

/// The inverse, if the condition of the matrix leaves it digits. A step after Newton mends what
/// rounding left; of powers of two on a diagonal, and of their like, it is exact.
fn inverse(matrix: &DMat3) -> Option<DMat3> {
    let norm = |m: &DMat3| {
        let row = |k| m.row(k).abs().element_sum();
        row(0).max(row(1)).max(row(2))
    };
    // By a power of two, so that no product of three overflows.
    let unit = exp2(log2(norm(matrix)).floor());
    let scaled = *matrix * unit.recip();
    if !(unit.is_normal() && unit.recip().is_normal() && scaled.determinant() != 0.0) {
        return None;
    }
    let first = scaled.inverse();
    let better = first * (DMat3::IDENTITY * 2.0 - scaled * first);
    (norm(&scaled) * norm(&better) <= Instance::LARGEST_CONDITION).then(|| better * unit.recip())
}
