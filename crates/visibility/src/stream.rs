//! Streams: rays from anywhere, several on their way at a time.
//!
//! What a ray visits next is known only when what it visits now is there: in a large scene, a
//! single ray waits for memory. So several take turns. Each asks for the node and the leaf that it
//! visits next, which arrive while the others take their steps. Steps have few branches, since
//! with a different ray each time none can be foreseen.

use crate::{
    Counters, Occluders, Ray, Scratch,
    build::Hierarchy,
    node::Child,
    ray::{RayQuery, highest},
};
use linelit_simd::{Simd, dispatch};
use std::ops::Range;

/// Rays on their way at a time. More gain nothing; `docs/decisions/013-streams-of-rays.md`.
const ABREAST: usize = 8;

impl Occluders {
    /// Whether rays meet any triangle but those numbered in the range beside each, one by one as by
    /// [`Occluders::any_hit`], whose answers these are: `hidden[i]` becomes that of `rays[i]`.
    ///
    /// For many rays from different points, such as those of a tile of pixels or of a path tracer's
    /// step: 64 or more at a time, in any order. Those that are near each other in the list best
    /// are so in space. For rays from one point there is [`Occluders::any_hits`].
    ///
    /// In the [`Counters`], each ray does the work of a single one that is the first from its
    /// origin.
    ///
    /// ```
    /// use linelit_visibility::{Occluders, Ray, Scratch, geometry::DVec3};
    ///
    /// // A triangle at z = 1, and rays up from a row of points below.
    /// let positions = [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    /// let occluders = Occluders::build(&positions, &[[0, 1, 2]]);
    /// let rays = [-1.0, 0.5, 1.0, 4.0].map(|x| {
    ///     let origin = DVec3::new(x, 0.0, 0.0);
    ///     let ray = Ray { origin, direction: DVec3::Z, t_min: 0.0, t_max: 2.0 };
    ///     (ray, 0..0)
    /// });
    /// let mut hidden = [false; 4];
    /// occluders.any_hit_stream(&rays, &mut hidden, &mut Scratch::new());
    /// assert_eq!(hidden, [false, true, true, false]);
    /// ```
    ///
    /// # Panics
    /// If `hidden` is not as long as `rays`.
    pub fn any_hit_stream(
        &self,
        rays: &[(Ray, Range<u32>)],
        hidden: &mut [bool],
        scratch: &mut Scratch,
    ) {
        assert_eq!(rays.len(), hidden.len(), "an answer for each ray");
        scratch.counters.rays += rays.len() as u64;
        stream(self.isa, self, rays, hidden, scratch);
        if self.holes.is_some() {
            for ((ray, _), hidden) in rays.iter().zip(hidden) {
                *hidden |= !*hidden && self.any_with_holes(ray, scratch);
            }
        }
    }
}

/// The number of no node: there are fewer than 2³¹.
const NONE: u32 = u32::MAX;

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    query: RayQuery,
    /// The number of the ray.
    ray: usize,
    /// The node that was opened, and a bit for each of its leaves that is yet to be tested.
    at: u32,
    leaves: u8,
    /// The node to open next, or [`NONE`].
    next: u32,
    /// How many more wait on the stack.
    top: u32,
}

impl Flight {
    const IDLE: Self = Self {
        query: RayQuery::IDLE,
        ray: 0,
        at: 0,
        leaves: 0,
        next: 0,
        top: 0,
    };

    /// Tests the leaves of the node that was opened, and opens the next. Whether the ray meets
    /// anything, once it is known.
    #[inline(always)]
    fn step<S: Simd>(
        &mut self,
        s: S,
        hierarchy: &Hierarchy,
        stack: &mut [u32],
        counters: &mut Counters,
    ) -> Option<bool> {
        let mut leaves = self.leaves;
        if leaves != 0 {
            let node = &hierarchy.nodes[self.at as usize];
            while leaves != 0 {
                let lane = highest(leaves);
                leaves &= !(1 << lane);
                let child = Child(node.child[lane]);
                counters.triangle_tests += u64::from(child.count());
                let leaf = &hierarchy.leaves[child.leaf_index()];
                if self.query.any(s, leaf, child.mask()) {
                    return Some(true);
                }
            }
        }
        if self.next == NONE {
            return Some(false);
        }
        self.at = self.next;
        let node = &hierarchy.nodes[self.at as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (found, _) = self.query.boxes(s, node, self.query.t_max32);
        self.leaves = found & node.leaf;
        // The first leaf; where there is none, anything, rather than a branch.
        let leaf = Child(node.child[highest(self.leaves | 1)]).leaf_index();
        s.prefetch(&hierarchy.leaves[leaf.min(hierarchy.leaves.len() - 1)]);
        // The next node through the stack with the others, for the same reason: the other rays'
        // steps are between this store and its use.
        let inner = found & !node.leaf;
        s.pack(inner, &node.child, stack, self.top as usize);
        self.top += inner.count_ones();
        if self.top == 0 {
            self.next = NONE;
            return (self.leaves == 0).then_some(false);
        }
        self.top -= 1;
        self.next = stack[self.top as usize];
        s.prefetch(&hierarchy.nodes[self.next as usize]);
        None
    }
}

/// Rays that are yet to start.
struct Waiting<'a> {
    rays: &'a [(Ray, Range<u32>)],
    /// The number of the next.
    next: usize,
}

impl Waiting<'_> {
    /// Has the next ray that can meet anything take a place, if there is one.
    #[inline(always)]
    fn start(&mut self, occluders: &Occluders, place: &mut Flight) -> bool {
        while let Some((ray, exclude)) = self.rays.get(self.next) {
            let number = self.next;
            self.next += 1;
            if let Some(query) = RayQuery::new(occluders, ray, exclude) {
                *place = Flight {
                    query,
                    ray: number,
                    at: 0,
                    leaves: 0,
                    next: 0,
                    top: 0,
                };
                return true;
            }
        }
        false
    }
}

#[inline(always)]
fn stream_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    rays: &[(Ray, Range<u32>)],
    hidden: &mut [bool],
    scratch: &mut Scratch,
) {
    hidden.fill(false);
    let hierarchy = &*occluders.hierarchy;
    let Scratch {
        counters, stack, ..
    } = scratch;
    let room = occluders.stack_size;
    if stack.len() < room * ABREAST {
        stack.resize(room * ABREAST, 0);
    }
    let mut waiting = Waiting { rays, next: 0 };
    let mut flights = [Flight::IDLE; ABREAST];
    let mut count = 0;
    while count < ABREAST && waiting.start(occluders, &mut flights[count]) {
        count += 1;
    }
    while count > 0 {
        let mut k = 0;
        while k < count {
            let flight = &mut flights[k];
            let stack_of_it = &mut stack[room * k..room * (k + 1)];
            let done = flight.step(s, hierarchy, stack_of_it, counters);
            if let Some(meets) = done {
                hidden[flight.ray] = meets;
                if !waiting.start(occluders, flight) {
                    // The last one takes the place.
                    count -= 1;
                    flights[k] = flights[count];
                    stack.copy_within(room * count..room * (count + 1), room * k);
                    continue;
                }
            }
            k += 1;
        }
    }
}

dispatch! {
    /// [`Occluders::any_hit_stream`] on an instruction set.
    fn stream = stream_kernel(occluders: &Occluders, rays: &[(Ray, Range<u32>)], hidden: &mut [bool], scratch: &mut Scratch) -> ()
}
