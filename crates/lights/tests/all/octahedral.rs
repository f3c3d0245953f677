//! These tests check the octahedral map: known directions, round trips, equal areas, and hostile
//! input.

use linelit_geometry::DVec3;
use linelit_lights::octahedral::{sphere_to_square, square_to_sphere, wrap_texel};
use linelit_testkit::cases::cases;
use linelit_testkit::strategies::{hostile, hostile_vector, unit_interval, unit_vector};
use proptest::prelude::*;

const EPSILON: f64 = f64::EPSILON;

/// A place and its direction in pbrt-v4: the six axes and a point of each half.
#[test]
fn orientation_is_that_of_pbrt() {
    let (half, third) = (0.5f64.sqrt(), (1.0f64 / 3.0).sqrt());
    // A third of the sphere's height lies at r² = 1 − √(1/3), on the diagonal u = v = r / 2.
    let near = 0.25 * (1.0 - third).sqrt() + 0.5;
    let far = 0.5 * (1.0 - 0.5 * (1.0 - third).sqrt()) + 0.5;
    let known = [
        ([0.5, 0.5], DVec3::Z),
        ([1.0, 0.5], DVec3::X),
        ([0.0, 0.5], DVec3::NEG_X),
        ([0.5, 1.0], DVec3::Y),
        ([0.5, 0.0], DVec3::NEG_Y),
        ([0.75, 0.75], DVec3::new(half, half, 0.0)),
        ([near, near], DVec3::splat(third)),
        ([1.0 - near, near], DVec3::new(-third, third, third)),
        ([far, far], DVec3::new(third, third, -third)),
        ([far, 1.0 - far], DVec3::new(third, -third, -third)),
    ];
    for (place, w) in known {
        assert!(square_to_sphere(place).distance(w) < 16.0 * EPSILON, "{w}");
        let back = sphere_to_square(w);
        let off = (back[0] - place[0]).abs().max((back[1] - place[1]).abs());
        assert!(off < 8.0 * EPSILON, "{w}: {back:?}");
    }
    for corner in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
        assert_eq!(square_to_sphere(corner), DVec3::NEG_Z);
    }
}

/// The map has the Jacobian 4π: by central differences, whose step of 2⁻¹⁷ leaves errors of the
/// order of 2⁻³⁴ of third derivatives (at most some hundreds, off the creases) and of ε / 2⁻¹⁷.
#[test]
fn areas_are_equal() {
    let step = 2f64.powi(-17);
    let mut off_creases = 0;
    for i in 0..40 {
        for j in 0..40 {
            let p = [(f64::from(i) + 0.3) / 40.0, (f64::from(j) + 0.4) / 40.0];
            let [u, v] = p.map(|p| (2.0 * p - 1.0).abs());
            if u.min(v).min((u + v - 1.0).abs()).min(1.0 - u.max(v)) < 1e-3 {
                continue;
            }
            off_creases += 1;
            let at = |x, y| square_to_sphere([p[0] + x * step, p[1] + y * step]);
            let across = (at(1.0, 0.0) - at(-1.0, 0.0)) / (2.0 * step);
            let up = (at(0.0, 1.0) - at(0.0, -1.0)) / (2.0 * step);
            let area = across.cross(up).length() / (4.0 * std::f64::consts::PI);
            assert!((area - 1.0).abs() < 1e-7, "{p:?}: {area}");
        }
    }
    assert!(off_creases > 1000);
}

/// Texels beyond the border are those that directions next to them lie in.
#[test]
fn texels_beyond_the_border_are_neighbours() {
    for size in [1usize, 2, 5, 8] {
        let last = size.cast_signed() - 1;
        let n = size as f64;
        for k in 0..=last {
            for [x, y] in [[-1, k], [last + 1, k], [k, -1], [k, last + 1]] {
                // A border point of the texel inside is the same direction on the texel beyond.
                let inside = [x, y].map(|i| i.clamp(0, last));
                let border = [0, 1].map(|c| {
                    let beyond = [x, y][c] - inside[c];
                    (inside[c] as f64 + 0.5 + 0.5 * beyond as f64) / n
                });
                let there = wrap_texel([x, y], size);
                let other = [0, 1].map(|c| {
                    let on_side = border[c].fract() == 0.0;
                    let centre = (there[c] as f64 + 0.5) / n;
                    if on_side { border[c] } else { centre }
                });
                let gap = square_to_sphere(border).distance(square_to_sphere(other));
                assert!(gap < 16.0 * EPSILON, "{x} {y} of {size}: {there:?}");
            }
        }
        let corner = wrap_texel([-1, -1], size);
        assert_eq!(corner, [size - 1; 2]);
        assert_eq!(wrap_texel([last + 1, -1], size), [0, size - 1]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(2000)))]

    #[test]
    fn there_and_back(w in unit_vector(), place in [unit_interval(), unit_interval()]) {
        let w = DVec3::from(w);
        let there = square_to_sphere(sphere_to_square(w));
        // 4 ε of a place are up to 4 ε √(4π) · 2 of a direction, where the map stretches most.
        prop_assert!(there.distance(w) < 48.0 * EPSILON, "{w} {there}");
        let w = square_to_sphere(place);
        prop_assert!((w.length() - 1.0).abs() < 16.0 * EPSILON);
        // A direction on a side has several positions: compare directions.
        let again = square_to_sphere(sphere_to_square(w));
        prop_assert!(again.distance(w) < 48.0 * EPSILON, "{place:?}");
    }

    #[test]
    fn hostile_input(w in hostile_vector(), place in [hostile(), hostile()], x in any::<isize>(), y in any::<i8>(), size in 0..9usize) {
        let [u, v] = sphere_to_square(DVec3::from(w));
        prop_assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v), "{u} {v}");
        let length = square_to_sphere(place).length();
        prop_assert!((length - 1.0).abs() < 16.0 * EPSILON);
        let texel = wrap_texel([x, isize::from(y)], size);
        prop_assert!(texel.iter().all(|i| *i < size.max(1)));
    }
}
