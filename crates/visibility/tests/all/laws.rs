//! Laws: what must not change the answers, and in which direction they may change.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, soup};
use linelit_geometry::{DVec3, Margins, Segment, intervals::Interval};
use linelit_scenes::{Library, VisibilityScene};
use linelit_testkit::cases::cases;
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    InstructionSet, LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery,
};
use proptest::prelude::*;
use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};

fn view(
    occluders: &Occluders,
    point: DVec3,
    light: &[DVec3],
    lines: &[Segment],
) -> (ShaftClass, Vec<Vec<Interval>>) {
    look(occluders, point, light, lines, &mut Scratch::new())
}

fn look(
    occluders: &Occluders,
    point: DVec3,
    light: &[DVec3],
    lines: &[Segment],
    scratch: &mut Scratch,
) -> (ShaftClass, Vec<Vec<Interval>>) {
    let (class, out) = ask(occluders, point, (light, lines), &NONE, scratch);
    (
        class,
        (0..lines.len()).map(|i| out.line(i).to_vec()).collect(),
    )
}

fn is_dense(occluders: &Occluders, point: DVec3, light: &[DVec3]) -> bool {
    let light = LightCorners::new(light).unwrap();
    let mut scratch = Scratch::new();
    occluders
        .shaft(ShaftQuery::new(point, light), &mut scratch)
        .is_dense()
}

fn total(lines: &[Vec<Interval>]) -> Vec<f64> {
    lines
        .iter()
        .map(|l| l.iter().map(|i| i.hi - i.lo).sum())
        .collect()
}

/// A scene from a seed: triangles, a light, a point and lines.
fn case(seed: u64) -> (Mesh, Vec<DVec3>, DVec3, Vec<Segment>) {
    let mut rng = SplitMix64::new(seed);
    let count = [40, 300, 3000][rng.index(3)];
    let size = [0.03, 0.3][rng.index(2)];
    let mesh = soup(&mut rng, count, size, DVec3::ZERO, 1.0);
    let corners = 2 + rng.index(5);
    let at = rng.direction() * 1.5;
    let size = [0.1, 1.0][rng.index(2)];
    let light = light(&mut rng, corners, at, size);
    let point = rng.in_cube(1.0);
    let angle = (rng.index(4) > 0).then(|| rng.in_range(0.0, 3.0));
    let count = 1 + rng.index(20);
    let lines = (0..count).map(|_| chord(&mut rng, &light, angle)).collect();
    (mesh, light, point, lines)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: cases(96),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Intervals, classes and hits have the same bits on every instruction set, and take the same
    /// work.
    #[test]
    fn instruction_sets_agree_to_the_bit(seed in any::<u64>()) {
        let (mesh, light, point, lines) = case(seed);
        let build = |limit| Occluders::build(&mesh.positions, &mesh.triangles).limited_to(limit);
        let scalar = build(InstructionSet::Scalar);
        prop_assert_eq!(scalar.instruction_set(), InstructionSet::Scalar);
        for limit in [InstructionSet::Avx2, InstructionSet::Avx512] {
            let other = build(limit);
            let [mut theirs, mut ours] = [Scratch::new(), Scratch::new()];
            prop_assert_eq!(
                look(&other, point, &light, &lines, &mut theirs),
                look(&scalar, point, &light, &lines, &mut ours)
            );
            for line in &lines {
                let ray = Ray {
                    origin: point,
                    direction: line.p0 - point,
                    t_min: 0.0,
                    t_max: f64::INFINITY,
                };
                prop_assert_eq!(
                    other.closest_hit(&ray, &mut theirs),
                    scalar.closest_hit(&ray, &mut ours)
                );
                prop_assert_eq!(
                    other.any_hit(&ray, &(0..2), &mut theirs),
                    scalar.any_hit(&ray, &(0..2), &mut ours)
                );
            }
            prop_assert_eq!(theirs.counters, ours.counters);
        }
    }

    /// The order of triangles and that of lines do not change a bit; except for shafts with so many
    /// triangles that they are dense, or nearly, where rounding in `f32` decides how triangles are
    /// tested.
    #[test]
    fn order_does_not_matter(seed in any::<u64>()) {
        let (mut mesh, light, point, lines) = case(seed);
        let before = Occluders::build(&mesh.positions, &mesh.triangles);
        let want = view(&before, point, &light, &lines);
        let mut rng = SplitMix64::new(seed ^ 1);
        for i in (1..mesh.triangles.len()).rev() {
            mesh.triangles.swap(i, rng.index(i + 1));
        }
        let after = Occluders::build(&mesh.positions, &mesh.triangles);
        let got = view(&after, point, &light, &lines);
        if is_dense(&before, point, &light) == is_dense(&after, point, &light) {
            prop_assert_eq!(&got, &want);
        }
        for (got, want) in total(&got.1).into_iter().zip(total(&want.1)) {
            prop_assert!((got - want).abs() < 1e-9, "{} {}", got, want);
        }
        // In another order, another line may determine the common direction, and lines of a dense
        // shaft share walks with others: results agree up to rounding.
        let reversed: Vec<_> = lines.iter().rev().copied().collect();
        let (_, got) = view(&after, point, &light, &reversed);
        for (got, want) in total(&got).iter().rev().zip(total(&want.1)) {
            prop_assert!((got - want).abs() < 1e-9, "{} {}", got, want);
        }
    }

    /// A reversed line has the same pieces in reverse; and more occluders never show more.
    #[test]
    fn reversal_and_monotonicity(seed in any::<u64>()) {
        let (mesh, light, point, lines) = case(seed);
        let all = Occluders::build(&mesh.positions, &mesh.triangles);
        let (_, want) = view(&all, point, &light, &lines);
        let backwards: Vec<_> = lines.iter().map(Segment::reversed).collect();
        let (_, got) = view(&all, point, &light, &backwards);
        for (got, want) in got.iter().zip(&want) {
            prop_assert_eq!(got.len(), want.len());
            for (g, w) in got.iter().rev().zip(want) {
                prop_assert!((1.0 - g.hi - w.lo).abs() < 1e-9 && (1.0 - g.lo - w.hi).abs() < 1e-9);
            }
        }
        let half = Occluders::build(&mesh.positions, &mesh.triangles[..mesh.triangles.len() / 2]);
        let (_, more) = view(&half, point, &light, &lines);
        for (more, want) in total(&more).iter().zip(total(&want)) {
            prop_assert!(*more >= want - 1e-12);
        }
    }

    /// A point of the light is visible through the shaft exactly if a ray reaches it.
    #[test]
    fn shaft_points_agree_with_rays(seed in any::<u64>()) {
        let (mesh, light, point, lines) = case(seed);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let mut rays = Scratch::new();
        let mut scratch = Scratch::new();
        let query = ShaftQuery::new(point, LightCorners::new(&light).unwrap()).excluding(0..3);
        let mut shaft = occluders.shaft(query, &mut scratch);
        for line in &lines {
            let target = line.at(0.618);
            let ray = Ray {
                origin: point,
                direction: target - point,
                t_min: Margins::DEFAULT.point,
                t_max: Margins::DEFAULT.end(),
            };
            prop_assert_eq!(
                shaft.point_visible(target),
                !occluders.any_hit(&ray, &(0..3), &mut rays)
            );
        }
    }
}

/// A hash of everything that is written to it.
struct Hash(DefaultHasher);

impl fmt::Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// A fine closed mesh, and other triangles around it: more than one parallel task handles.
fn many() -> Mesh {
    let mut rng = SplitMix64::new(7);
    let mut mesh = closed(&mut rng, 400, 100, 1.0, DVec3::ZERO, 1.0);
    for _ in 0..9_000 {
        let at = rng.in_cube(1.0);
        let [a, b, c] = [(); 3].map(|()| at + rng.in_cube(0.02));
        mesh.triangle(a, b, c);
    }
    mesh
}

/// The hierarchy is the same for any number of threads, and outside of a pool; also if it is built
/// for rays alone, and after triangles have moved.
#[test]
fn threads_do_not_matter() {
    let mesh = many();
    let moved: Vec<_> = mesh.positions.iter().map(|p| p.map(|x| 1.5 * x)).collect();
    let hash = |occluders: &Occluders| {
        let mut hash = Hash(DefaultHasher::new());
        write!(hash, "{occluders:?}").unwrap();
        hash.0.finish()
    };
    let hashes = || {
        let rays = Occluders::build_for_rays(&mesh.positions, &mesh.triangles);
        let mut shafts = Occluders::build(&mesh.positions, &mesh.triangles);
        let built = hash(&shafts);
        shafts.refit(&moved, &mesh.triangles);
        [hash(&rays), built, hash(&shafts)]
    };
    let alone = hashes();
    for threads in [1, 2, 3, 8, 64] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let shared = pool.build().unwrap().install(hashes);
        assert_eq!(alone, shared, "{threads} threads");
    }
}

/// A hierarchy for rays alone gives the same answers to rays, and to shafts the same visible parts,
/// before and after its triangles have moved, and takes less memory.
#[test]
fn hierarchies_for_rays_answer_shafts_as_well() {
    let mesh = many();
    let [mut all, mut rays] = [Occluders::build, Occluders::build_for_rays]
        .map(|build| build(&mesh.positions, &mesh.triangles));
    let mut rng = SplitMix64::new(8);
    let mut scratch = Scratch::new();
    let mut dense = 0;
    for turn in 0..40 {
        if turn == 20 {
            let moved: Vec<_> = mesh.positions.iter().map(|p| p.map(|x| 1.5 * x)).collect();
            all.refit(&moved, &mesh.triangles);
            rays.refit(&moved, &mesh.triangles);
        }
        assert!(rays.memory() * 3 < all.memory() * 2 + all.memory() / 2);
        let (point, at) = (rng.direction() * 2.5, rng.direction() * 2.0);
        let ray = Ray::new(point, at - point);
        let hits = [&all, &rays].map(|of| of.closest_hit(&ray, &mut scratch));
        assert_eq!(hits[0], hits[1]);
        let light = light(&mut rng, 4, at, 0.7);
        let lines: Vec<_> = (0..8).map(|_| chord(&mut rng, &light, None)).collect();
        dense += u32::from(is_dense(&all, point, &light));
        let [want, got] = [&all, &rays].map(|of| total(&view(of, point, &light, &lines).1));
        for (got, want) in got.iter().zip(want) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
    }
    assert!(dense > 10, "{dense} dense shafts");
}

/// The memory of the built-in scenes is below a hundred bytes per triangle, of which the corners
/// take at least 36 and the number 4.
#[test]
fn hierarchies_are_compact() {
    for name in ["grid-planes-large", "triangle-soup-large"] {
        let scene = VisibilityScene::load(&Library::default(), name).unwrap();
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let count = occluders.triangle_count();
        assert!(occluders.memory() < 100 * count && occluders.memory() > 40 * count);
    }
}
