//! Facets that are closer together than the distance by which rounding to `f32` moves them: which
//! of them is in front.
//!
//! If two facets are that close and nearly in one plane, their rounded corners do not say which
//! hides the other. So before rounding, their common part becomes one polygon, a *stack*, with the
//! facet that is seen from either side according to the corners as given. The parts that they do
//! not share stay by themselves.
//!
//! ```text
//!   ────────── A                A    A above, B below      B
//!         ───────── B   →    ────── ──────────────────── ─────
//! ```

use crate::facets::{Part, Sides};
use crate::patches::bounds;
use crate::rounded::displacement;
use crate::tree::Tree;
use crate::view::{Plane, divided, edge_planes};
use linelit_geometry::DVec3;

/// The largest sine of the angle between the planes of facets that become stacks. Facets at steeper
/// angles stay separate: their rounded corners say which is in front, except in a strip that is at
/// most a thousand times as wide as the displacement by rounding; cuts along such a strip would be
/// rounded themselves.
const STEEPEST: f64 = 1e-3;

/// The corners of a polygon, the facet that is seen from the side of its normal, and the facet that
/// is seen from the other side, if any.
pub(crate) type Seen = (Vec<DVec3>, [Option<usize>; 2]);

/// The common polygon of some parts of facets that are closer together than the rounding.
#[derive(Clone, Debug)]
struct Stack {
    corners: Vec<DVec3>,
    /// The indices of the parts; the corners of the stack are in the plane of the first.
    parts: Vec<usize>,
}

/// Puts all parts on stacks, and returns the polygon of each stack with the facets that are seen on
/// its two sides. Most parts are alone on their stack, whose corners are exactly theirs then.
pub(crate) fn stacks(parts: &[Part], corners: &[Vec<DVec3>], sides: Sides) -> Vec<Seen> {
    let mut stacker = Stacker {
        parts,
        stacks: Vec::with_capacity(parts.len()),
        of: vec![Vec::new(); parts.len()],
    };
    let tree = Tree::build((0..parts.len()).collect(), |k| bounds(&corners[k]));
    // Find the margin: no displacement is larger than half a unit in the last digit of three
    // coordinates.
    let [low, high] = tree
        .nodes
        .first()
        .map_or_else(Default::default, |n| [n.low, n.high]);
    let largest = low.abs().max(high.abs()).max_element();
    let margin = 4.0 * largest * f64::from(f32::EPSILON);
    // Add each part to the stacks near it, then divide stacks where their parts cross.
    for (k, corners) in corners.iter().enumerate() {
        let [low, high] = bounds(corners);
        let meets = |l: DVec3, h: DVec3| !(h.cmplt(low - margin) | l.cmpgt(high + margin)).any();
        let mut near = Vec::new();
        tree.find(meets, |other| {
            if other < k && stacker.sine(other, k) <= STEEPEST {
                near.extend(&stacker.of[other]);
            }
        });
        stacker.add(k, corners, near);
    }
    let uncrossed = stacker
        .stacks
        .iter()
        .flat_map(|stack| stacker.uncrossed(stack));
    uncrossed.map(|stack| stacker.seen(stack, sides)).collect()
}

/// The stacks made so far, while parts are added.
struct Stacker<'a> {
    parts: &'a [Part],
    stacks: Vec<Stack>,
    /// For each part, the indices of the stacks that it is on.
    of: Vec<Vec<usize>>,
}

impl Stacker<'_> {
    /// Returns the sine of the angle between the planes of two parts.
    fn sine(&self, a: usize, b: usize) -> f64 {
        let [a, b] = [a, b].map(|k| self.parts[k].polygon.normal());
        a.cross(b).length()
    }

    /// Adds a part: the polygons that it shares with the stacks `near` are added to these, and the
    /// rest becomes new stacks.
    fn add(&mut self, part: usize, corners: &[DVec3], mut near: Vec<usize>) {
        let mut left = vec![corners.to_vec()];
        near.sort_unstable();
        near.dedup();
        while let Some(stack) = near.pop() {
            for piece in std::mem::take(&mut left) {
                match self.shared(stack, part, &piece) {
                    None => left.push(piece),
                    // The rest of the stack becomes another stack, which later pieces may share,
                    // too.
                    Some([shared, others, rest]) => {
                        left.extend(rest);
                        let below = self.stacks[stack].parts.clone();
                        for corners in others {
                            near.push(self.stacks.len());
                            self.push(corners, below.clone());
                        }
                        let stack_of = &mut self.stacks[stack];
                        stack_of.corners = shared.into_iter().flatten().collect();
                        stack_of.parts.push(part);
                        self.of[part].push(stack);
                    }
                }
            }
        }
        for piece in left {
            self.push(piece, vec![part]);
        }
    }

    /// Adds a new stack.
    fn push(&mut self, corners: Vec<DVec3>, parts: Vec<usize>) {
        for &part in &parts {
            self.of[part].push(self.stacks.len());
        }
        self.stacks.push(Stack { corners, parts });
    }

    /// Returns, if a stack and a piece of a part are closer together than the rounding, three lists
    /// of polygons: what they share, what is left of the stack, and what is left of the piece.
    /// `None` if they are not that close or share no area.
    fn shared(&self, stack: usize, part: usize, piece: &[DVec3]) -> Option<[Vec<Vec<DVec3>>; 3]> {
        let Stack { corners, parts } = &self.stacks[stack];
        if parts.contains(&part) {
            return None;
        }
        let n = self.parts[parts[0]].polygon.normal();
        // They are close if they are within twice the displacement of both, plus the tolerance for
        // flatness.
        let flatness = self.flatness(parts[0], part);
        let near = 2.0 * (displacement(corners) + displacement(piece)) + flatness;
        let mut planes = edge_planes(n, corners, near);
        let at = n.dot(corners[0]);
        let slab = |side: f64| Plane {
            normal: side * n,
            at: side * at - near,
            room: 0.1 * near,
        };
        planes.extend([slab(1.0), slab(-1.0)]);
        let (inside, rest) = divided(piece, &planes)?;
        let around = edge_planes(self.parts[part].polygon.normal(), &inside, near);
        let (shared, others) = divided(corners, &around)?;
        Some([vec![shared], others, rest])
    }

    /// Returns the height within which two parts count as in one plane.
    fn flatness(&self, a: usize, b: usize) -> f64 {
        self.parts[a].flatness.max(self.parts[b].flatness)
    }

    /// Returns the height of a part's plane above the point `x`, along the normal `n`.
    fn height(&self, part: usize, n: DVec3, x: DVec3) -> f64 {
        let plane = &self.parts[part].polygon;
        plane.normal().dot(plane.vertices()[0] - x) / plane.normal().dot(n)
    }

    /// Divides a stack along the lines where planes of its parts cross, so that in each of the
    /// resulting stacks the parts have one order of heights.
    fn uncrossed(&self, stack: &Stack) -> Vec<Stack> {
        let parts = &stack.parts;
        let n = self.parts[parts[0]].polygon.normal();
        let mut pieces = vec![stack.corners.clone()];
        for (k, &a) in parts.iter().enumerate() {
            for &b in &parts[..k] {
                let along = |part: usize| {
                    let normal = self.parts[part].polygon.normal();
                    normal / normal.dot(n)
                };
                // The height of one plane above the other grows in this direction.
                let slope = along(b) - along(a);
                let Some(normal) = slope.try_normalize() else {
                    continue;
                };
                let x = stack.corners[0];
                let height = self.height(a, n, x) - self.height(b, n, x);
                let plane = Plane {
                    normal,
                    at: normal.dot(x) - height / slope.length(),
                    // Where the heights differ by less, neither is above the other.
                    room: self.flatness(a, b) / slope.length(),
                };
                let halves = |piece: Vec<DVec3>| match divided(&piece, &[plane]) {
                    Some((above, below)) => [vec![above], below].concat(),
                    None => vec![piece],
                };
                pieces = pieces.into_iter().flat_map(halves).collect();
            }
        }
        let with = |corners| Stack {
            corners,
            parts: parts.clone(),
        };
        pieces.into_iter().map(with).collect()
    }

    /// Finds which facets are seen of a stack from either side: for each side the highest facet
    /// that faces it.
    fn seen(&self, Stack { corners, parts }: Stack, sides: Sides) -> Seen {
        let n = self.parts[parts[0]].polygon.normal();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let from = |side: f64| {
            let height = |&part: &usize| side * self.height(part, n, middle);
            let top = parts
                .iter()
                .max_by(|a, b| height(a).total_cmp(&height(b)))?;
            let faces = |&part: &usize| {
                let facing = side * self.parts[part].polygon.normal().dot(n);
                sides == Sides::Two || facing > 0.0
            };
            // Among parts that are in one plane with the highest, the one that faces this side is
            // seen.
            let is_top = |part: &&usize| height(top) - height(part) <= self.flatness(*top, **part);
            let tops = parts.iter().filter(is_top);
            tops.copied()
                .filter(faces)
                .map(|part| self.parts[part].facet)
                .min()
        };
        let seen = [from(1.0), from(-1.0)];
        (corners, seen)
    }
}
