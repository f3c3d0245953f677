//! Shadow rays of a fan, all traced in one walk: which of them are hidden.
//!
//! A *fan* is up to 64 rays from one point to one light, so that at first they enter the same nodes
//! of the hierarchy. A ray is *hidden* if it hits any triangle. The walk has two phases:
//!
//! ```text
//!     1. one beam                        2. packets of up to eight neighbours
//!
//!        ╲  │   │   │  ╱                    ╲╲│      │││      │╱╱
//!         ╲ │   │   │ ╱                      ╲╲│     │││     │╱╱
//!          ╲│   │   │╱                         ╲╲│   │││   │╱╱
//!            ╲╲ │ ╱╱                             ╲╲│ │││ │╱╱
//!               ●                                     ●
//! ```
//!
//! 1. A beam, the box of all directions, walks for the whole fan. A node is opened if any direction
//!    of the box may enter it, and a leaf is tested against all rays that are not yet hidden. This
//!    is cheap, but the beam widens where rays diverge, so it ends after a [`budget`] of nodes and
//!    leaves. The order of visits does not matter, since any hit will do.
//! 2. The remaining rays are sorted along a Z curve and grouped by eight. Each [`Packet`] walks by
//!    itself from the root, with a narrower beam and a bit for each ray that enters a box
//!    ([`packet`](crate::rays::packet)).
//!
//! Boxes and beams only skip what no ray can hit. Triangles of a leaf that the beam may hit are
//! tested against eight rays at once in `f64` with error bounds, and where these do not decide,
//! against each ray by itself, as single rays are ([`fan`](crate::rays::fan)). So the answers are
//! the same as for the rays one by one, however they are grouped.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::{Child, Leaf, Node},
    rays::{
        fan::{Beam, Directions, Fan, LARGEST, Rays, Tests, one_by_one},
        packet::{self, Packet, in_z_order},
        ray::{RayScratch, wait_for_root},
    },
    walk::{NearestFirst, Waiting, in_any_order, nearest_first},
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};
use std::ops::{ControlFlow, Range};

/// Returns the number of nodes and leaves that the beam of a whole fan of `count` rays visits
/// before packets continue: some three levels of the hierarchy, and more if more rays share the
/// work.
const fn budget(count: usize) -> usize {
    3 + count / 16
}

/// Buffers for fans.
#[derive(Debug, Default)]
pub(crate) struct FanScratch {
    /// The directions of the fan, and those of one packet.
    pub(crate) directions: Box<Directions>,
    packet: Box<Directions>,
    /// Nodes and leaves that wait for a packet, with a bit for each of its rays that enters them.
    pub(crate) waiting: Waiting<u8>,
}

/// Returns a bit for each ray of a fan that hits a triangle; the head of this module describes the
/// two phases.
#[inline(always)]
fn any_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    fan: &Fan<'_>,
    exclude: &Range<u32>,
    scratch: &mut RayScratch,
    together: &mut FanScratch,
    counters: &mut Counters,
) -> u64 {
    // Prepare the tests. A fan beyond their error bounds (numbers that are not finite or too large,
    // an empty hierarchy) is traced one by one.
    let size = packet::size_of(bvh, fan);
    let bounds = together.directions.set(s, fan);
    let (Some(size), Some(bounds), true) = (size, bounds, fan.t_max <= LARGEST) else {
        return one_by_one(bvh, fan, fan.all(), exclude, scratch, counters);
    };
    let origin = (fan.origin - bvh.origin).to_array();
    let tests = Tests::new(fan, exclude, origin, size, bounds);
    let beam = tests.beam(bounds);
    let hierarchy = &*bvh.hierarchy;
    let (directions, mut unhidden) = (&together.directions, fan.all());
    let RayScratch { stack, last, .. } = scratch;
    // Try the leaf that hid the latest ray from this point, as for single rays.
    if let Some((origin, child)) = *last
        && origin == fan.origin
        && let Some(leaf) = hierarchy.leaves.get(child.leaf_index())
    {
        counters.triangle_tests += u64::from(child.count());
        unhidden &= !tests.meets(s, &beam, leaf, child, &directions.0, unhidden);
    }
    // Walk with the beam until all rays are hidden or its budget is spent.
    bvh.make_room(stack);
    let (mut visited, budget) = (0, budget(fan.directions.len()));
    let ended_early = in_any_order(
        s,
        hierarchy,
        stack,
        #[inline(always)]
        |node| {
            if unhidden == 0 || visited >= budget {
                return ControlFlow::Break(());
            }
            counters.node_tests += u64::from(node.valid.count_ones());
            let (found, _) = beam.boxes(s, node);
            let mut leaves = found & node.leaf;
            visited += 1 + leaves.count_ones() as usize;
            while leaves != 0 && unhidden != 0 {
                let child = Child(node.child[leaves.trailing_zeros() as usize]);
                leaves &= leaves - 1;
                let leaf = &hierarchy.leaves[child.leaf_index()];
                counters.triangle_tests += u64::from(child.count());
                let hidden = tests.meets(s, &beam, leaf, child, &directions.0, unhidden);
                if hidden != 0 {
                    *last = Some((fan.origin, child));
                    unhidden &= !hidden;
                }
            }
            ControlFlow::Continue(found & !node.leaf)
        },
    );
    // Walk with packets of the other rays.
    if ended_early && unhidden != 0 {
        unhidden = by_packets(s, bvh, &tests, fan, unhidden, bounds, together, counters);
    }
    fan.all() & !unhidden
}

/// Traces the `unhidden` rays in packets of up to eight neighbours, and returns a bit for each of
/// them that is still not hidden. All directions are within `bounds`.
#[allow(clippy::too_many_arguments, reason = "a step of one kernel")]
#[inline(always)]
fn by_packets<S: Simd>(
    s: S,
    bvh: &Bvh,
    tests: &Tests,
    fan: &Fan<'_>,
    mut unhidden: u64,
    bounds: [[f64; 3]; 2],
    scratch: &mut FanScratch,
    counters: &mut Counters,
) -> u64 {
    let FanScratch {
        directions,
        packet,
        waiting,
    } = scratch;
    let (order, count) = in_z_order(directions, unhidden, bounds);
    for group in order[..count].chunks(8) {
        // Collect the directions of the packet; copies of the last one fill it up to eight.
        let eight: [DVec3; 8] = std::array::from_fn(|lane| {
            fan.directions[usize::from(group[lane.min(group.len() - 1)])]
        });
        let directions = &eight[..];
        // The packet has narrower bounds of its own; if they cannot be computed, the bounds of the
        // whole fan hold.
        let bounds = packet.set(s, &Fan { directions, ..*fan }).unwrap_or(bounds);
        let rays = &packet.0[..1];
        // Walk until all rays of the packet are hidden, and note which are.
        let all = 0xff_u8 >> (8 - group.len());
        let mut visitor = AnyOfPacket {
            packet: Packet::new(s, &rays[0], tests, bounds),
            tests,
            rays,
            unhidden: all,
            single: [None; 8],
        };
        wait_for_root(waiting, all);
        nearest_first(s, &bvh.hierarchy, waiting, counters, &mut visitor);
        for (lane, i) in group.iter().enumerate() {
            unhidden &= !(u64::from(!visitor.unhidden >> lane & 1) << i);
        }
    }
    unhidden
}

/// A walk that looks for triangles that hide the rays of a packet. A node or leaf waits with a bit
/// for each ray that enters it.
struct AnyOfPacket<'a> {
    packet: Packet,
    tests: &'a Tests,
    rays: &'a [Rays],
    /// The rays that are not known to be hidden.
    unhidden: u8,
    /// For each ray its own beam, once a node is opened for this ray alone; it is narrower than the
    /// packet's.
    single: [Option<Beam>; 8],
}

impl AnyOfPacket<'_> {
    /// Returns the beam for a set of rays that is not empty ([`NearestFirst::wants`] has ensured
    /// that): the ray's own beam if the set is one ray that has a beam, or else the packet's.
    #[inline(always)]
    fn beam(&self, rays: u8) -> &Beam {
        let single = &self.single[rays.trailing_zeros() as usize];
        match single {
            Some(beam) if rays.is_power_of_two() => beam,
            _ => &self.packet.beam,
        }
    }
}

impl<S: Simd> NearestFirst<S> for AnyOfPacket<'_> {
    type Entry = u8;

    #[inline(always)]
    fn wants(&self, _: S, _: f32, rays: u8) -> bool {
        rays & self.unhidden != 0
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, rays: u8) -> (u8, S::F) {
        let active = rays & self.unhidden;
        let i = active.trailing_zeros() as usize;
        if active.is_power_of_two() && self.single[i].is_none() {
            let direction = [0, 1, 2].map(|k| self.rays[0][k][i]);
            self.single[i] = Some(self.tests.beam([direction; 2]));
        }
        self.packet.active = active;
        self.beam(active).boxes(s, node)
    }

    #[inline(always)]
    fn entry(&self, s: S, node: &Node, lane: usize) -> Option<u8> {
        let active = self.packet.active;
        match active.is_power_of_two() {
            // The node's boxes were tested against this ray's own beam.
            true => Some(active),
            false => self
                .packet
                .enter(s, node, lane, s.splat(self.packet.beam.t_max)),
        }
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, rays: u8) -> ControlFlow<()> {
        let active = rays & self.unhidden;
        let beam = self.beam(active);
        let hidden = self
            .tests
            .meets(s, beam, leaf, child, self.rays, active.into());
        self.unhidden &= !hidden.to_le_bytes()[0];
        match self.unhidden {
            0 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    }
}

dispatch! {
    /// [`any_kernel`] on an instruction set.
    pub(crate) fn any = any_kernel(bvh: &Bvh, fan: &Fan<'_>, exclude: &Range<u32>, scratch: &mut RayScratch, together: &mut FanScratch, counters: &mut Counters) -> u64
}
