//! What must not change the answer, and how it may change.

use crate::common::{InSpace, NONE, ask, chord, light, soup};
use linelit_geometry::{DVec3, Margins, Segment, intervals::Interval};
use linelit_scenes::{Library, VisibilityScene};
use linelit_testkit::cases::cases;
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    InstructionSet, LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery,
};
use proptest::prelude::*;

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
fn case(seed: u64) -> (crate::common::Mesh, Vec<DVec3>, DVec3, Vec<Segment>) {
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

    /// Intervals, classes, hits: the same bits on every instruction set, and the same work.
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

    /// Neither the order of the triangles nor that of the lines matters, not by a bit; but for
    /// shafts of as many triangles as make them dense, or nearly, where how `f32` rounds decides
    /// which way they are looked at.
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
        // Another order of lines may take another line's direction for that of all, or walk a
        // dense shaft in other company: rounding apart.
        let reversed: Vec<_> = lines.iter().rev().copied().collect();
        let (_, got) = view(&after, point, &light, &reversed);
        for (got, want) in total(&got).iter().rev().zip(total(&want.1)) {
            prop_assert!((got - want).abs() < 1e-9, "{} {}", got, want);
        }
    }

    /// A line run through the other way shows the same pieces the other way round; and more
    /// occluders never show more.
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

    /// A point of the light is visible through the shaft exactly if a ray gets there.
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

/// Memory of the built-in scenes: below a hundred bytes a triangle, the least of which are the
/// corners' 36 and the number's 4.
#[test]
fn hierarchies_are_compact() {
    for name in ["grid-planes-large", "triangle-soup-large"] {
        let scene = VisibilityScene::load(&Library::default(), name).unwrap();
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let count = occluders.triangle_count();
        assert!(occluders.memory() < 100 * count && occluders.memory() > 40 * count);
    }
}
