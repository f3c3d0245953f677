//! Rays of a fan that go apart: eight neighbours at a time.
//!
//! Each box carries the rays that enter it. A node is opened once for all of its rays, with the box
//! of the directions of all eight; what that finds is tested against each ray, eight in lanes, so
//! that a ray visits what it would visit alone. Where a single one is left, its own direction takes
//! the place of the box.

use crate::{
    Occluders, Scratch,
    fan::{Beam, Directions, FAN, Fan, Rays, Tests, abs},
    node::{Child, Node},
    ray::ROOM,
    sweep::Lanes,
};
use linelit_simd::Simd;

/// Which of the `open` rays of a fan, whose directions are within `bounds`, are hidden.
#[inline(always)]
pub(crate) fn apart<S: Simd>(
    s: S,
    occluders: &Occluders,
    tests: &Tests,
    fan: &Fan<'_>,
    open: u64,
    bounds: [[f64; 3]; 2],
    scratch: &mut Scratch,
) -> u64 {
    let (order, count) = along_curve(&scratch.fan, open, bounds);
    let mut hidden = 0;
    for group in order[..count].chunks(8) {
        let mut rays = Lanes([[0.0; 8]; 3]);
        for lane in 0..8 {
            let i = usize::from(group[lane.min(group.len() - 1)]);
            for (row, x) in rays.iter_mut().zip(fan.directions[i].to_array()) {
                row[lane] = x;
            }
        }
        let found = eight(s, occluders, tests, &rays, group.len(), scratch);
        for (lane, i) in group.iter().enumerate() {
            hidden |= u64::from(found >> lane & 1) << i;
        }
    }
    hidden
}

/// Eight rays, ready for boxes: as [`Beam`], but that which side is entered is found for each ray.
pub(crate) struct Slabs {
    inverse: [[f32; 8]; 3],
    offset: [[f32; 8]; 3],
    room: [[f32; 8]; 3],
}

impl Slabs {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(s: S, rays: &Rays, tests: &Tests) -> Self {
        let (origin, size) = (tests.origin, tests.size);
        let largest = Beam::largest_inverse(size);
        let mut out = Self {
            inverse: [[0.0; 8]; 3],
            offset: [[0.0; 8]; 3],
            room: [[0.0; 8]; 3],
        };
        for k in 0..3 {
            let inverse = s.dsplat(1.0) / s.dload(&rays[k]);
            let inverse = s.dmin(s.dmax(inverse, s.dsplat(-largest)), s.dsplat(largest));
            let inverse = s.narrow(inverse);
            let wide = s.widen(inverse);
            s.store(inverse, &mut out.inverse[k]);
            s.store(s.narrow(wide * -origin[k]), &mut out.offset[k]);
            s.store(s.narrow(abs(s, wide) * (ROOM * size)), &mut out.room[k]);
        }
        out
    }

    /// The rays that may enter a box of a node before each comes to `far`.
    #[inline(always)]
    pub(crate) fn enter<S: Simd>(&self, s: S, node: &Node, lane: usize, mut far: S::F) -> u8 {
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

/// The numbers of the open rays along a Z curve across the two widest sides of their box, and how
/// many they are.
#[allow(clippy::cast_possible_truncation, reason = "all are below 64")]
fn along_curve(
    Directions(rays): &Directions,
    mut open: u64,
    [low, high]: [[f64; 3]; 2],
) -> ([u8; FAN], usize) {
    let extent: [f64; 3] = std::array::from_fn(|k| high[k] - low[k]);
    let thin = (0..3)
        .min_by(|&i, &j| extent[i].total_cmp(&extent[j]))
        .unwrap_or(0);
    let axes = [(thin + 1) % 3, (thin + 2) % 3];
    let scale = axes.map(|k| 8.0 / extent[k].max(1e-30));
    let mut cells = [0_u8; FAN];
    let mut counts = [0_u8; 65];
    let all = open;
    while open != 0 {
        let i = open.trailing_zeros() as usize;
        open &= open - 1;
        let mut cell = 0;
        for (j, k) in axes.into_iter().enumerate() {
            let x = ((rays[i / 8][k][i % 8] - low[k]) * scale[j]).min(7.0) as u32;
            cell |= ((x & 1) | (x & 2) << 1 | (x & 4) << 2) << j;
        }
        cells[i] = cell as u8;
        counts[cell as usize + 1] += 1;
    }
    for i in 0..64 {
        counts[i + 1] += counts[i];
    }
    let mut order = [0; FAN];
    open = all;
    while open != 0 {
        let i = open.trailing_zeros() as usize;
        open &= open - 1;
        let at = &mut counts[cells[i] as usize];
        order[*at as usize] = i as u8;
        *at += 1;
    }
    (order, all.count_ones() as usize)
}

/// Which of eight rays are hidden: each node that several enter is opened once.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn eight<S: Simd>(
    s: S,
    occluders: &Occluders,
    tests: &Tests,
    rays: &Rays,
    count: usize,
    scratch: &mut Scratch,
) -> u8 {
    let hierarchy = &*occluders.hierarchy;
    let all = 0xff_u8 >> (8 - count);
    let mut open = all;
    let (mut low, mut high) = ([f64::MAX; 3], [-f64::MAX; 3]);
    for k in 0..3 {
        for &x in &rays[k] {
            low[k] = if x < low[k] { x } else { low[k] };
            high[k] = if x > high[k] { x } else { high[k] };
        }
    }
    let together = tests.beam([low, high]);
    let slabs = Slabs::new(s, rays, tests);
    let mut alone: [Option<Beam>; 8] = [None; 8];
    let Scratch {
        stack,
        masks,
        counters,
        ..
    } = scratch;
    let stack = &mut stack[..];
    if masks.len() < stack.len() {
        masks.resize(stack.len(), 0);
    }
    let masks = &mut masks[..stack.len()];
    stack[0] = Child::node(0).0;
    masks[0] = all;
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let mine = masks[top] & open;
        if mine == 0 {
            continue;
        }
        let node = &hierarchy.nodes[stack[top] as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let single = mine.is_power_of_two();
        let beam = if single {
            let i = mine.trailing_zeros() as usize;
            if alone[i].is_none() {
                let direction = [rays[0][i], rays[1][i], rays[2][i]];
                alone[i] = Some(tests.beam([direction; 2]));
            }
            alone[i].as_ref().unwrap_or(&together)
        } else {
            &together
        };
        let (found, _) = beam.boxes(s, node);
        let mut leaves = found & node.leaf;
        while leaves != 0 {
            let lane = leaves.trailing_zeros() as usize;
            leaves &= leaves - 1;
            let mut entering = open & mine;
            if !single {
                entering &= slabs.enter(s, node, lane, s.splat(beam.t_max));
            }
            if entering == 0 {
                continue;
            }
            let child = Child(node.child[lane]);
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.leaf_index()];
            open &= !tests
                .meets(s, beam, leaf, child, &[*rays], entering.into())
                .to_le_bytes()[0];
        }
        let mut inner = found & !node.leaf;
        // That which is expected to meet most is the last, and highest on the stack.
        while inner != 0 {
            let lane = inner.trailing_zeros() as usize;
            inner &= inner - 1;
            let mut entering = open & mine;
            if !single {
                entering &= slabs.enter(s, node, lane, s.splat(beam.t_max));
            }
            stack[top] = node.child[lane];
            masks[top] = entering;
            top += usize::from(entering != 0);
        }
    }
    all & !open
}
