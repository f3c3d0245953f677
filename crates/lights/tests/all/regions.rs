//! These tests check the laws of samples on regions: χ², a density that integrates to one, and
//! round trips from sample over invert to sample.

use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{PointTechnique, RegionSampler};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::rng::SplitMix64;
use proptest::prelude::*;
use std::f64::consts::TAU;

/// A plane in space, with axes that are neither of unit length nor at right angles.
const PLANE: [DVec3; 3] = [
    DVec3::new(3.0, -1.0, 2.0),
    DVec3::new(0.8, 0.3, -0.2),
    DVec3::new(-0.5, 1.5, 0.4),
];

fn in_space([p, q]: [f64; 2]) -> DVec3 {
    PLANE[0] + PLANE[1] * p + PLANE[2] * q
}

/// Square metres of a unit square of coordinates.
fn unit() -> f64 {
    PLANE[1].cross(PLANE[2]).length()
}

/// A convex polygon, counter-clockwise, that is part of a region or a hole of it.
struct Part {
    corners: Vec<[f64; 2]>,
    is_hole: bool,
}

impl Part {
    fn boundary(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let n = self.corners.len();
        (0..n).map(move |i| {
            let [a, b] = [self.corners[i], self.corners[(i + 1) % n]];
            if self.is_hole { [b, a] } else { [a, b] }
        })
    }

    /// Its area within a box, in units of the coordinates; of a hole less than zero.
    fn area_within(&self, [low, high]: [[f64; 2]; 2]) -> f64 {
        let flat = |[p, q]: [f64; 2]| DVec3::new(p, q, 0.0);
        let corners: Vec<DVec3> = self.corners.iter().map(|c| flat(*c)).collect();
        let mut polygon = ConvexPolygon::new(&corners).ok();
        for (at, normal) in [
            (low, DVec3::X),
            (low, DVec3::Y),
            (high, -DVec3::X),
            (high, -DVec3::Y),
        ] {
            polygon = polygon.and_then(|polygon| polygon.clip(flat(at), normal));
        }
        let area = polygon.map_or(0.0, |polygon| polygon.area());
        if self.is_hole { -area } else { area }
    }
}

fn square([p, q]: [f64; 2], size: f64, is_hole: bool) -> Part {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let corners = corners.map(|[a, b]| [p + a * size, q + b * size]).to_vec();
    Part { corners, is_hole }
}

fn regions() -> Vec<(&'static str, Vec<Part>)> {
    let part = |corners: &[[f64; 2]]| Part {
        corners: corners.to_vec(),
        is_hole: false,
    };
    let hexagon = (0..6).map(|i| {
        let (sine, cosine) = (f64::from(i) * TAU / 6.0 + 0.1).sin_cos();
        [0.5 + 0.45 * cosine, 0.5 + 0.45 * sine]
    });
    let hole = Part {
        corners: vec![[0.4, 0.4], [0.7, 0.45], [0.5, 0.65]],
        is_hole: true,
    };
    vec![
        ("a square", vec![square([0.0, 0.0], 1.0, false)]),
        (
            "a hexagon with a hole",
            vec![part(&hexagon.collect::<Vec<_>>()), hole],
        ),
        (
            "a frame with an island",
            vec![
                square([0.0, 0.0], 1.0, false),
                square([0.1, 0.1], 0.8, true),
                square([0.3, 0.4], 0.3, false),
            ],
        ),
        (
            "triangles that share a corner",
            vec![
                part(&[[0.0, 0.0], [1.0, 0.1], [0.5, 0.5]]),
                part(&[[0.5, 0.5], [1.0, 1.0], [0.0, 0.8]]),
            ],
        ),
        (
            "slivers",
            vec![
                part(&[[0.0, 0.0], [1.0, 0.97], [1.0, 0.98]]),
                part(&[[0.2, 0.9], [0.201, 0.3], [0.202, 0.9]]),
                part(&[[0.1, 0.5], [0.15, 0.499], [0.15, 0.5]]),
            ],
        ),
        (
            "far apart",
            vec![
                square([0.0, 0.0], 1e-4, false),
                square([0.9, 0.9], 1e-4, false),
            ],
        ),
    ]
}

fn sampler(parts: &[Part]) -> RegionSampler {
    let mut region = RegionSampler::default();
    region.set(PLANE, parts.iter().flat_map(Part::boundary));
    region
}

const CELLS: usize = 16;

/// The area of a region in each cell of a grid over the unit square.
fn areas(parts: &[Part]) -> Vec<f64> {
    let at = |i: usize| i as f64 / CELLS as f64;
    let cell = |k: usize| {
        let (i, j) = (k % CELLS, k / CELLS);
        let cell = [[at(i), at(j)], [at(i + 1), at(j + 1)]];
        parts.iter().map(|part| part.area_within(cell)).sum()
    };
    (0..CELLS * CELLS).map(cell).collect()
}

fn obey(samples: u32) {
    let regions = regions();
    let alpha = sidak(0.01, regions.len());
    for (name, parts) in &regions {
        let region = sampler(parts);
        let areas = areas(parts);
        let all: f64 = areas.iter().sum();
        // A hundred roundings of areas below one, of coordinates below one.
        assert!((region.area() / unit() - all).abs() < 1e-14, "{name}");
        let mut observed = vec![0_u64; CELLS * CELLS];
        let mut random = SplitMix64::new(3);
        for _ in 0..samples {
            let sample = region.sample([random.next_f64(), random.next_f64()]);
            // One over the area; as often as one rounds.
            assert!(
                (sample.pdf.value() * region.area() - 1.0).abs() < 1e-15,
                "{name}"
            );
            let d = sample.point - PLANE[0];
            let normal = PLANE[1].cross(PLANE[2]) / unit();
            let p = d.cross(PLANE[2]).dot(normal) / unit();
            let q = PLANE[1].cross(d).dot(normal) / unit();
            let cell = |x: f64| (1..CELLS).filter(|i| x >= *i as f64 / CELLS as f64).count();
            observed[cell(q) * CELLS + cell(p)] += 1;
            // A fraction of 1e-12 of the region is within rounding of its boundary.
            let u = region.invert(sample.point).expect("a point of the region");
            let back = region.sample(u).point;
            // Lines shrink to a point at corners, where ξ = (d/D)² of a width D: ε/√ξ, and of N
            // samples the nearest has ξ < α/N with probability α.
            let near_corner = (f64::from(samples) / alpha).sqrt();
            let room = f64::EPSILON * 4.0 * near_corner;
            assert!(
                back.distance(sample.point) < room,
                "{name}: {:e}",
                back.distance(sample.point)
            );
        }
        let expected: Vec<f64> = areas.iter().map(|a| a / all * f64::from(samples)).collect();
        let fit = chi2_test(&observed, &expected, 5.0);
        assert!(fit.p_value > alpha, "{name}: {fit:?}");
    }
}

#[test]
fn points_of_regions_obey() {
    obey(100_000);
}

#[test]
#[ignore = "long: two million samples of each region"]
fn points_of_regions_obey_long() {
    obey(2_000_000);
}

#[test]
fn degenerate_regions_give_nothing() {
    let mut region = RegionSampler::default();
    let flat = [[[0.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 0.0]]];
    let upright = [[[0.5, 0.0], [0.5, 1.0]], [[0.5, 1.0], [0.5, 0.0]]];
    for boundary in [&flat[..], &upright, &[]] {
        region.set(PLANE, boundary.iter().copied());
        assert!(region.area() <= 0.0);
        assert!(!region.sample([0.3, 0.6]).pdf.is_positive());
        assert!(!region.density().is_positive());
        assert_eq!(region.invert(in_space([0.5, 0.5])), None);
    }
    // A plane without two directions.
    let line = [DVec3::ZERO, DVec3::X, DVec3::X];
    region.set(line, square([0.0, 0.0], 1.0, false).boundary());
    assert!(region.area() <= 0.0);
    assert!(!region.sample([0.3, 0.6]).pdf.is_positive());
    assert!(!region.holds(DVec3::X));
}

proptest! {
    /// Of a curve around a place: the area is Green's, and points are where a ray from the place
    /// is shorter than the curve.
    #[test]
    fn curves_are_filled(radii in prop::collection::vec(0.05..1.0, 3..40), seed: u64) {
        let n = radii.len();
        let corners: Vec<[f64; 2]> = radii.iter().enumerate().map(|(i, r)| {
            let (sine, cosine) = (i as f64 / n as f64 * TAU).sin_cos();
            [0.3 + r * cosine, -0.2 + r * sine]
        }).collect();
        let sides = || (0..n).map(|i| [corners[i], corners[(i + 1) % n]]);
        let mut region = RegionSampler::default();
        region.set(PLANE, sides());
        let green: f64 = sides().map(|[a, b]| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum();
        // Eighty sides, a dozen of them over each slab, a rounding each of what is below 1.3.
        prop_assert!((region.area() / unit() - green).abs() < 1e-13);
        let mut random = SplitMix64::new(seed);
        for _ in 0..200 {
            let [p, q] = [0; 2].map(|_| random.in_range(-1.0, 1.0));
            let left_of = |[a, b]: [[f64; 2]; 2]| {
                let [x, y] = [0.3 + p - a[0], -0.2 + q - a[1]];
                (b[0] - a[0]) * y - (b[1] - a[1]) * x
            };
            let turn = q.atan2(p).rem_euclid(TAU) / TAU * n as f64;
            let turn = (1..n).filter(|i| turn >= *i as f64).count();
            let inside = left_of([corners[turn], corners[(turn + 1) % n]]);
            let point = in_space([0.3 + p, -0.2 + q]);
            // On the side of a curve to rounding, either answer is right.
            if inside.abs() > 1e-12 {
                prop_assert_eq!(region.holds(point), inside > 0.0);
            }
        }
    }
}
