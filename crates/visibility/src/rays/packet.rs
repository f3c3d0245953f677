//! Packets: up to eight rays of a fan that walk the hierarchy together, one in each lane.
//!
//! A packet opens a node once for all its rays, by two tests:
//!
//! ```text
//!     node of eight boxes ──► beam: which boxes may any ray enter?   one test for all eight boxes
//!         each box found  ──► slabs: which rays enter this box?      one test for all eight rays
//! ```
//!
//! Nodes that wait carry a bit for each ray that enters them, so that a ray visits what it would
//! visit by itself. (A beam is the box of all directions; slabs are the pairs of planes whose
//! intersection is a box.)
//!
//! `rays::together` uses packets for shadow rays,
//! `rays::closest` for first hits.

use crate::{
    bvh::{Bvh, largest_inverse_at},
    lanes::dabs,
    node::Node,
    rays::{
        fan::{Beam, Directions, FAN, Fan, LARGEST, Rays, Tests},
        ray::ROOM,
    },
};
use linelit_simd::Simd;

/// Eight rays that walk together.
pub(crate) struct Packet {
    /// The beam of the eight rays: the bounding box of their directions.
    pub(crate) beam: Beam,
    slabs: Slabs,
    /// A bit for each ray that enters the node that is open now.
    pub(crate) active: u8,
}

impl Packet {
    /// Prepares eight rays with directions within `bounds`.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(s: S, rays: &Rays, tests: &Tests, bounds: [[f64; 3]; 2]) -> Self {
        Self {
            beam: tests.beam(bounds),
            slabs: Slabs::new(s, rays, tests),
            active: 0,
        }
    }

    /// Returns a bit for each active ray that may enter a box of the open node before the ray's end
    /// `far`; `None` if no ray does.
    #[inline(always)]
    pub(crate) fn enter<S: Simd>(&self, s: S, node: &Node, lane: usize, far: S::F) -> Option<u8> {
        let entering = self.active & self.slabs.enter(s, node, lane, far);
        (entering != 0).then_some(entering)
    }
}

/// Eight rays, ready for the slab test: the plane `x = bound` is reached at `t = bound · inverse +
/// offset ± room`, where `room` is the margin for rounding. Unlike the rays of a beam
/// ([`Beam`]), these may differ in the plane through which they enter a box, so the test
/// takes the lesser of both distances.
#[derive(Default)]
struct Slabs {
    inverse: [[f32; 8]; 3],
    offset: [[f32; 8]; 3],
    room: [[f32; 8]; 3],
}

impl Slabs {
    #[inline(always)]
    fn new<S: Simd>(s: S, rays: &Rays, tests: &Tests) -> Self {
        let (origin, size) = (tests.origin, tests.size);
        let largest = largest_inverse_at(size);
        let mut out = Self::default();
        for k in 0..3 {
            let inverse = s.dsplat(1.0) / s.dload(&rays[k]);
            let inverse = s.dmin(s.dmax(inverse, s.dsplat(-largest)), s.dsplat(largest));
            let inverse = s.narrow(inverse);
            let wide = s.widen(inverse);
            s.store(inverse, &mut out.inverse[k]);
            s.store(s.narrow(wide * -origin[k]), &mut out.offset[k]);
            s.store(s.narrow(dabs(s, wide) * (ROOM * size)), &mut out.room[k]);
        }
        out
    }

    /// Returns a bit for each ray that may enter a box of a node before the ray's end `far`.
    #[inline(always)]
    fn enter<S: Simd>(&self, s: S, node: &Node, lane: usize, mut far: S::F) -> u8 {
        let mut near = s.splat(0.0);
        for k in 0..3 {
            let inverse = s.load(&self.inverse[k]);
            let offset = s.load(&self.offset[k]);
            let room = s.load(&self.room[k]);
            let a = s.fma(s.splat(node.bounds[k][lane]), inverse, offset);
            let b = s.fma(s.splat(node.bounds[k + 3][lane]), inverse, offset);
            near = s.max(s.min(a, b) - room, near);
            far = s.min(s.max(a, b) + room, far);
        }
        s.le(near, far)
    }
}

/// Returns the largest absolute coordinate of a fan's origin and of all vertices, to which error
/// bounds are relative; `None` if the error bounds do not hold for this fan, or the hierarchy is
/// empty.
#[inline(always)]
pub(crate) fn size_of(bvh: &Bvh, fan: &Fan<'_>) -> Option<f64> {
    let origin = fan.origin - bvh.origin;
    let size = bvh.extent.max(origin.abs().max_element());
    let times = fan.t_min >= 0.0 && fan.t_max >= fan.t_min;
    let is_for_packets =
        origin.is_finite() && size <= LARGEST && times && !bvh.hierarchy.nodes.is_empty();
    is_for_packets.then_some(size)
}

/// Sorts the rays in the set `some` so that neighbours have almost the same direction, and returns
/// their indices and how many there are. The order is along a Z curve (Morton code) through 8 × 8
/// cells over the two widest sides of the box of directions.
///
/// ```text
///     0  1 │ 4  5        the bits of a cell's number: y₂ x₂ y₁ x₁ y₀ x₀
///     2  3 │ 6  7
///     ─────┼─────        cells are sorted by counting: first how many rays are in each, then
///     8  9 │12 13        where each one's rays begin, then the rays themselves
///    10 11 │14 15
/// ```
#[allow(clippy::cast_possible_truncation, reason = "all are below 64")]
pub(crate) fn in_z_order(
    Directions(rays): &Directions,
    some: u64,
    [low, high]: [[f64; 3]; 2],
) -> ([u8; FAN], usize) {
    // Find the two widest sides.
    let extent: [f64; 3] = std::array::from_fn(|k| high[k] - low[k]);
    let thin = (0..3)
        .min_by(|&i, &j| extent[i].total_cmp(&extent[j]))
        .unwrap_or(0);
    let axes = [(thin + 1) % 3, (thin + 2) % 3];
    let scale = axes.map(|k| 8.0 / extent[k].max(1e-30));
    // Find the cell of each ray, and how many are in each.
    let mut cells = [0_u8; FAN];
    let mut starts = [0_u8; 65];
    for i in bits(some) {
        let mut cell = 0;
        for (j, k) in axes.into_iter().enumerate() {
            let x = ((rays[i / 8][k][i % 8] - low[k]) * scale[j]).min(7.0) as u32;
            cell |= ((x & 1) | (x & 2) << 1 | (x & 4) << 2) << j;
        }
        cells[i] = cell as u8;
        starts[cell as usize + 1] += 1;
    }
    // Find where the rays of each cell begin, and put them there.
    for i in 0..64 {
        starts[i + 1] += starts[i];
    }
    let mut order = [0; FAN];
    for i in bits(some) {
        let at = &mut starts[cells[i] as usize];
        order[*at as usize] = i as u8;
        *at += 1;
    }
    (order, some.count_ones() as usize)
}

/// The positions of the bits that are set, in ascending order.
fn bits(mut set: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = (set != 0).then_some(set.trailing_zeros() as usize);
        set &= set.wrapping_sub(1);
        lowest
    })
}
