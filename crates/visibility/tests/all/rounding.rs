//! Vertices in double precision: relative to which origin they are rounded, and how far that moves
//! them.

use linelit_geometry::{DVec3, origin_of_box};
use linelit_testkit::cases::{cases, rng};
use linelit_visibility::{BuildOptions, Occluders, Ray, Scratch};

fn build(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Occluders {
    Occluders::build_with(positions, triangles, BuildOptions::default())
}

/// A vertex moves by half an ulp of its distance from the middle on each axis, √3 · 2⁻²⁵ of twice
/// the extent at most, and hits of rays move by no more than that.
#[test]
fn doubles_are_rounded_by_the_extent_of_the_scene_wherever_it_is() {
    let (mut rng, mut scratch) = (rng(11), Scratch::new());
    for _ in 0..cases(200) {
        let far = 10f64.powf(rng.in_range(0.0, 9.0));
        let size = far * 10f64.powf(rng.in_range(-6.0, -1.0));
        let at = DVec3::from(rng.unit_vector()) * far;
        let corners =
            [(); 3].map(|()| at + DVec3::from([(); 3].map(|()| rng.in_range(-size, size))));
        let occluders = build(&corners.map(|v| v.to_array()), &[[0, 1, 2]]);
        let moved = occluders.rounding().displacement;
        // An axis has no middle if the scene is closer to zero than four sizes: coordinates up to
        // nine units then.
        assert!(
            moved <= 9.0 * size * 2f64.powi(-24),
            "{far} {size}: {moved}"
        );
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let inside = (a + b + c) / 3.0;
        let ray = Ray::new(inside + normal * size, -normal);
        let hit = occluders
            .closest_hit(&ray, &mut scratch)
            .expect("its middle");
        let error = (hit.t - size).abs();
        assert!(
            error <= 2.0 * moved + 16.0 * f64::EPSILON * far,
            "{far} {size}: {error}"
        );
    }
}

/// Vertices that no triangle uses, or that only triangles use which can hide nothing, have no
/// influence.
#[test]
fn stray_vertices_move_nothing() {
    let at = DVec3::new(500_000.3, 4_500_000.7, 100.1);
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|v| (v + at).to_array());
    let plain = build(&corners, &[[0, 1, 2]]);
    for stray in [
        [0.0; 3],
        [5e9, 0.0, -5e9],
        [f64::NAN, 0.0, 0.0],
        [1e300, 0.0, 0.0],
    ] {
        let mut vertices = corners.to_vec();
        vertices.push(stray);
        let other = build(&vertices, &[[3, 3, 0], [0, 1, 2], [1, 3, 3], [0, 1, 9]]);
        assert_eq!(other.origin(), plain.origin());
        assert_eq!(other.rounding(), plain.rounding());
    }
    assert!(!plain.rounding().is_coarse());
}

/// A distant triangle makes the scene large, and the rounding coarse for a small triangle.
#[test]
fn details_that_rounding_loses_are_warned_about() {
    let small = [[0.1, 0.0, 0.0], [0.7, 0.0, 0.0], [0.1, 0.3, 0.0]];
    let far = [
        [4e6, 1e6, 0.1],
        [4e6, 1e6 + 0.3, 0.1],
        [4e6 + 0.6, 1e6, 0.1],
    ];
    let together: Vec<_> = small.into_iter().chain(far).collect();
    let alone = build(&small, &[[0, 1, 2]]).rounding();
    assert!(!alone.is_coarse() && alone.displacement > 0.0);
    let both = build(&together, &[[0, 1, 2], [3, 4, 5]]).rounding();
    assert!(both.is_coarse() && both.to_string().contains("single precision"));
}

/// Vertices that are `f32` are stored as they are, whatever type they come in, and give the same
/// answers to the bit.
#[test]
fn doubles_that_are_single_keep_their_bits() {
    let (mut rng, mut scratch) = (rng(12), Scratch::new());
    for far in [0.0_f32, 1.0, 4096.0, 1e6] {
        let mut at = || far + DVec3::splat(rng.in_range(-1.0, 1.0)).as_vec3().x;
        let singles: Vec<[f32; 3]> = (0..30).map(|_| [(); 3].map(|()| at())).collect();
        let doubles: Vec<_> = singles.iter().map(|v| v.map(f64::from)).collect();
        let triangles: Vec<[u32; 3]> = (0..10).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let (one, two) = (
            Occluders::build(&singles, &triangles),
            build(&doubles, &triangles),
        );
        assert!(two.rounding().displacement <= 0.0);
        for _ in 0..200 {
            let middle = DVec3::splat(far.into());
            let ray = Ray::new(
                middle - DVec3::from(rng.unit_vector()) * 4.0,
                rng.unit_vector(),
            );
            let hits = [&one, &two].map(|o| o.closest_hit(&ray, &mut scratch));
            assert_eq!(hits[0], hits[1]);
        }
    }
}

#[test]
fn a_box_near_zero_or_an_empty_one_has_no_origin() {
    let empty = origin_of_box(DVec3::INFINITY, DVec3::NEG_INFINITY);
    let near = origin_of_box(DVec3::new(3.0, -1.0, 0.0), DVec3::new(4.0, 1.0, 0.0));
    assert_eq!([empty, near], [DVec3::ZERO; 2]);
    // The middle of what is smaller than the spacing of single numbers there.
    let (low, high) = (DVec3::splat(5_400_000.1), DVec3::splat(5_400_000.101));
    let off = origin_of_box(low, high) - 0.5 * (low + high);
    assert!(off.abs().max_element() < 1.3e-4, "{off}");
}
