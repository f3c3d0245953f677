//! The cost of building, counted: the depth of the tree, and how many triangles are visited on the
//! way down.

use super::{BuildOptions, Builder, Geometry, Hierarchy, LEAF_SIZE, binary::Binary, build, split};
use crate::node::Child;

/// Triangles that share no corners.
#[derive(Default)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn push(&mut self, triangle: [[f32; 3]; 3]) {
        let first = u32::try_from(self.positions.len()).unwrap();
        self.positions.extend(triangle);
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn of(count: u32, triangle: impl Fn(u32) -> [[f32; 3]; 3]) -> Self {
        let mut mesh = Self::default();
        (0..count).for_each(|k| mesh.push(triangle(k)));
        mesh
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry {
            positions: &self.positions,
            triangles: &self.triangles,
            origin: [0.0; 3],
            extent: largest(self.positions.as_flattened()),
        }
    }

    fn tree(&self, builder: Builder) -> Vec<Binary> {
        let ids = 0..u32::try_from(self.triangles.len()).unwrap();
        // Make the geometry once, since its extent is computed from all vertices.
        let geometry = self.geometry();
        let mut references: Vec<_> = ids.map(|id| geometry.reference(id)).collect();
        builder.grow(&mut references, geometry.extent)
    }

    fn hierarchy(&self) -> Hierarchy {
        let kept = vec![true; self.triangles.len()];
        build(&self.geometry(), &kept, BuildOptions::default())
    }
}

fn largest(numbers: &[f32]) -> f32 {
    numbers.iter().fold(0.0, |m: f32, x| m.max(x.abs()))
}

#[allow(clippy::cast_precision_loss, reason = "whole numbers below 2²⁴")]
fn float(k: u32) -> f32 {
    k as f32
}

/// Evenly distributed numbers between 0 and 1.
fn random(k: u32) -> f32 {
    float(k.wrapping_mul(2_654_435_769) >> 8) / 16_777_216.0
}

fn corner(x: f32, y: f32, z: f32, size: f32) -> [[f32; 3]; 3] {
    [[x, y, z], [x + size, y, z], [x, y + size, z]]
}

/// The inputs for which builders are known to take quadratic time, as functions of a triangle's
/// number and of its fraction of all, between zero and one.
type Hard = (&'static str, fn(u32, f32) -> [[f32; 3]; 3]);

const HARD: [Hard; 10] = [
    ("copies", |_, _| corner(0.0, 0.0, 0.0, 1.0)),
    ("copies that differ by an ulp or so", |k, _| {
        corner(0.0, 1e-7 * random(k), 0.0, 1.0)
    }),
    ("a row", |k, _| corner(float(k), 0.0, 0.0, 1.0)),
    ("a row on a line", |k, _| {
        [0.0, 0.3, 1.0].map(|x| [float(k) + x, 0.0, 0.0])
    }),
    // Sizes from one up to 1e6.
    ("a row of growing triangles", |_, share| {
        let x = 1e6_f32.powf(share);
        corner(x, 0.0, 0.0, x * 1e-3)
    }),
    ("nested triangles", |_, share| {
        let s = 1e6_f32.powf(share);
        [[-s, -s, 0.0], [s, -s, 0.0], [0.0, s, 0.0]]
    }),
    ("a fan of slivers", |k, _| {
        let (sin, cos) = (6.3 * random(k)).sin_cos();
        let [x, y] = [1e3 * cos, 1e3 * sin];
        [[0.0; 3], [x, y, 1.0], [x, y, -1.0]]
    }),
    ("a soup within a few giants", |k, _| {
        let at = [0, 1, 2].map(|axis| random(3 * k + axis));
        corner(at[0], at[1], at[2], if k % 97 == 0 { 1e5 } else { 1e-3 })
    }),
    ("corners as far as f32 goes", |k, _| {
        let mut t = corner(float(k), 0.0, 0.0, 1.0);
        let far = [[1e19, 0.0, 0.0], [0.0, -f32::MAX, 1e30], [f32::MAX; 3]];
        t[k as usize % 3] = far[k as usize / 3 % 3];
        t
    }),
    ("triangles as small as f32 goes", |k, _| {
        corner(1e-45 * float(k), 0.0, 0.0, 1e-45)
    }),
];

fn hard(count: u32) -> impl Iterator<Item = (&'static str, Mesh)> {
    let mesh = move |f: fn(u32, f32) -> _| Mesh::of(count, |k| f(k, float(k) / float(count)));
    HARD.into_iter().map(move |(name, f)| (name, mesh(f)))
}

/// The triangles of a tree, each once and in order; and the largest of their depths and the sum of
/// them.
fn walk(tree: &[Binary]) -> (Vec<u32>, usize, usize) {
    let (mut ids, mut deepest, mut sum) = (Vec::new(), 0, 0);
    let mut todo = vec![(0_usize, 0_usize)];
    while let Some((at, depth)) = todo.pop() {
        let node = &tree[at];
        if node.is_leaf() {
            ids.push(node.first);
            deepest = deepest.max(depth);
            sum += depth;
            continue;
        }
        let first = node.first as usize;
        let fit = tree[first].bounds.union(&tree[first + 1].bounds);
        assert_eq!(node.bounds, fit, "a box that does not fit its children");
        todo.extend([(first, depth + 1), (first + 1, depth + 1)]);
    }
    ids.sort_unstable();
    (ids, deepest, sum)
}

const BUILDERS: &[Builder] = &[
    Builder::Own,
    #[cfg(feature = "obvhs")]
    Builder::Obvhs,
];

/// The tree of obvhs is used for all inputs in [`HARD`], where random enlargement breaks its ties,
/// except for nests, of which it makes a list.
#[cfg(feature = "obvhs")]
#[test]
fn obvhs_clusters_what_is_hard() {
    for (name, mesh) in hard(1 << 13) {
        let geometry = mesh.geometry();
        let references: Vec<_> = (0..1 << 13).map(|id| geometry.reference(id)).collect();
        let tree = super::ploc::grow(&references, geometry.extent);
        assert_eq!(tree.is_some(), name != "nested triangles", "{name}");
    }
}

/// A triangle is visited once for each level above it. Beyond four times the logarithm of the
/// number of triangles, branches are halved, which takes another logarithm, and reinsertion moves
/// nothing there; there are twice as many nodes, which is one more level.
#[test]
fn growing_looks_at_n_log_n_triangles() {
    // More triangles than one block, since blocks are built one by one and their seams must not
    // show.
    let large = u32::try_from(3 * split::BLOCK).unwrap() + 17;
    for (count, cases) in [(1 << 10, HARD.len()), (1 << 13, HARD.len()), (large, 3)] {
        for (name, mesh) in hard(count).take(cases) {
            for builder in BUILDERS {
                let tree = mesh.tree(*builder);
                let (ids, deepest, sum) = walk(&tree);
                assert!(ids.into_iter().eq(0..count), "{name}");
                let levels = count.ilog2() as usize;
                assert!(
                    deepest <= 8 * levels,
                    "{name}: {deepest} levels of {levels}"
                );
                let mean = sum as f64 / f64::from(count);
                assert!(
                    mean <= 5.0 * levels as f64,
                    "{name}: {mean} levels of {levels}"
                );
            }
        }
    }
}

/// Leaves hold a few triangles each, for any input, and the tree of nodes has few levels.
#[test]
fn wide_nodes_are_filled() {
    let count = 1 << 13;
    for (name, mesh) in hard(count) {
        let hierarchy = mesh.hierarchy();
        let mut ids: Vec<u32> = Vec::new();
        let mut deepest = 0;
        let mut todo = vec![(0_usize, 1_usize)];
        while let Some((at, depth)) = todo.pop() {
            deepest = deepest.max(depth);
            let node = &hierarchy.nodes[at];
            for lane in (0..8).filter(|lane| node.valid >> lane & 1 != 0) {
                let child = Child(node.child[lane]);
                if child.is_leaf() {
                    let leaf = &hierarchy.leaves[child.index()];
                    assert!(child.count() <= LEAF_SIZE);
                    ids.extend(&leaf.id[..child.count() as usize]);
                } else {
                    todo.push((child.index(), depth + 1));
                }
            }
        }
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..count), "{name}");
        assert!(deepest <= 4 * 13, "{name}: {deepest} levels");
        let filled = f64::from(count) / hierarchy.leaves.len() as f64;
        assert!(filled >= 2.0, "{name}: {filled} triangles a leaf");
    }
}

/// The area of the triangles below each box, and whether the boxes of the node, and of all nodes
/// below, are sorted by that area over half of the box's surface.
fn areas(mesh: &Mesh, hierarchy: &Hierarchy, node: usize) -> ([f64; 8], bool) {
    let node = &hierarchy.nodes[node];
    let (mut areas_below, mut ordered, mut before) = ([0.0; 8], true, 0.0);
    let used = node.valid.count_ones() as usize;
    for (lane, below) in areas_below.iter_mut().enumerate().take(used) {
        let child = Child(node.child[lane]);
        *below = if child.is_leaf() {
            let ids = &hierarchy.leaves[child.index()].id[..child.count() as usize];
            let area = |&id| {
                let [a, b, c] = mesh.geometry().vertices(id);
                let side = |v: [f32; 3]| std::array::from_fn(|k| f64::from(v[k]) - f64::from(a[k]));
                let ([bx, by, bz], [cx, cy, cz]): ([f64; 3], [f64; 3]) = (side(b), side(c));
                let n = [by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx];
                0.5 * n.iter().map(|x| x * x).sum::<f64>().sqrt()
            };
            ids.iter().map(area).sum()
        } else {
            let (areas, there) = areas(mesh, hierarchy, child.index());
            ordered &= there;
            areas.iter().sum()
        };
        let [x, y, z] = std::array::from_fn(|axis| {
            f64::from(node.bounds[axis + 3][lane]) - f64::from(node.bounds[axis][lane])
        });
        let crossings = *below / (x * y + y * z + z * x);
        // Sums are added in another order.
        ordered &= crossings >= before * (1.0 - 1e-12);
        before = crossings;
    }
    (areas_below, ordered)
}

#[test]
fn boxes_with_most_triangles_for_their_size_stand_last() {
    // Few and small on one side, many and large on the other.
    let mesh = Mesh::of(3_000, |k| {
        let [x, y, z] = [3 * k, 3 * k + 1, 3 * k + 2].map(random);
        corner(x * x, y, z, 0.05 * x + 1e-3)
    });
    let (_, ordered) = areas(&mesh, &mesh.hierarchy(), 0);
    assert!(ordered);
}
