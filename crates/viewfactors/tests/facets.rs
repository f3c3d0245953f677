//! Facets that coincide, are not convex, or are back to back.

use linelit_testkit::rng::SplitMix64;
use linelit_viewfactors::{FacetError, Facets, Memory, Sides};

/// The numbers of so many corners.
fn numbers(count: usize) -> std::ops::Range<u32> {
    0..u32::try_from(count).unwrap()
}

/// A square of side 4 at height 2, seen from below, in front of which others lie in one plane.
fn ceiling(others: &[[f64; 4]], sides: Sides) -> Facets {
    let square = |[x, y, w, d]: [f64; 4]| {
        [
            [x, y, 2.0],
            [x, y + d, 2.0],
            [x + w, y + d, 2.0],
            [x + w, y, 2.0],
        ]
    };
    let floor = [
        [-2.0, -2.0, 0.0],
        [2.0, -2.0, 0.0],
        [2.0, 2.0, 0.0],
        [-2.0, 2.0, 0.0],
    ];
    let mut vertices = floor.to_vec();
    vertices.extend(square([-2.0, -2.0, 4.0, 4.0]));
    vertices.extend(others.iter().flat_map(|other| square(*other)));
    let polygons: Vec<Vec<u32>> = numbers(vertices.len() / 4)
        .map(|k| (4 * k..4 * k + 4).collect())
        .collect();
    Facets::new(&vertices, &polygons, sides).unwrap()
}

#[test]
fn facets_that_coincide_are_there_once() {
    let mut memory = Memory::default();
    let none = ceiling(&[], Sides::One);
    let up = [0.0, 0.0, 1.0];
    for sides in [Sides::One, Sides::Two] {
        // The same again, one inside, one across the corner.
        let others = [
            [-2.0, -2.0, 4.0, 4.0],
            [-1.0, -1.0, 0.5, 0.5],
            [1.0, 1.0, 2.0, 2.0],
        ];
        let all = ceiling(&others, sides);
        assert!(all.area(2) <= 0.0 && all.area(3) <= 0.0 && (all.area(4) - 3.0).abs() < 1e-14);
        for x in [[0.0, 0.0, 0.0], [1.5, 1.0, 0.5], [-0.3, 0.7, 1.9]] {
            let (want, found) = (
                none.from_point(x, up, &mut memory),
                all.from_point(x, up, &mut memory),
            );
            assert!((found.facets[1] - want.facets[1]).abs() < 1e-14);
            assert!(found.facets[2] <= 0.0 && found.facets[3] <= 0.0);
            assert!(found.facets.iter().sum::<f64>() <= 1.0 + 1e-12);
        }
        let matrix = all.matrix(1e-6);
        for row in 0..5 {
            let place = matrix.indptr[row]..matrix.indptr[row + 1];
            let sum: f64 = matrix.data[place.clone()].iter().sum();
            let told: f64 = matrix.error[place].iter().sum();
            assert!(sum <= 1.0 + told + 1e-12 && matrix.sky[row] >= -told - 1e-12);
        }
        // The order decides which is there: the large one is what the small ones leave.
        let before = ceiling(&[[-1.0, -1.0, 0.5, 0.5]], sides);
        let value = before.between(0, 1, 1e-9, &mut memory).value;
        let want = none.between(0, 1, 1e-9, &mut memory).value;
        let ways = if sides == Sides::Two { 0.5 } else { 1.0 };
        assert!((value - ways * want).abs() < 1e-9);
    }
}

#[test]
fn covered_facets_keep_the_rest() {
    // A floor with a number above that of a plate in it: what is left is a frame.
    let vertices = [
        [0.2, 0.2, 0.0],
        [0.6, 0.2, 0.0],
        [0.6, 0.7, 0.0],
        [0.2, 0.7, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [1.0, 1.0, 1.0],
        [1.0, 0.0, 1.0],
    ];
    let polygons: [[u32; 4]; 3] = [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]];
    let both = Facets::new(&vertices, &polygons, Sides::One).unwrap();
    let alone = Facets::new(&vertices, &polygons[1..], Sides::One).unwrap();
    assert!((both.area(1) - 0.8).abs() < 1e-15);
    let mut memory = Memory::default();
    let mut to = |facets: &Facets, from: usize, to: usize| {
        facets.between(from, to, 1e-10, &mut memory).value
    };
    let parts = to(&both, 2, 0) + to(&both, 2, 1);
    assert!((parts - to(&alone, 1, 0)).abs() < 1e-9);
    // Each way to its tolerance.
    assert!((0.8 * to(&both, 1, 2) - to(&both, 2, 1)).abs() < 2e-10);
}

/// A triangle and its reverse, in any place.
fn twins(rng: &mut SplitMix64) -> [[f64; 3]; 3] {
    [(); 3].map(|()| [(); 3].map(|()| rng.in_range(-1.0, 1.0)))
}

#[test]
fn facets_back_to_back_do_not_hide_each_other() {
    let mut rng = linelit_testkit::cases::rng(51);
    let mut memory = Memory::default();
    for _ in 0..2_000 {
        let triangle = twins(&mut rng);
        let x = [(); 3].map(|()| rng.in_range(-1.0, 1.0));
        let n = [(); 3].map(|()| rng.in_range(-1.0, 1.0));
        let both = Facets::new(&triangle, &[[0, 1, 2], [2, 1, 0]], Sides::One).unwrap();
        let one = Facets::new(&triangle, &[[0, 1, 2]], Sides::Two).unwrap();
        let want = one.from_point(x, n, &mut memory).facets[0];
        let found: f64 = both.from_point(x, n, &mut memory).facets.iter().sum();
        assert!(
            (found - want).abs() < 1e-14,
            "{triangle:?} {x:?} {n:?}: {found} {want}"
        );
    }
}

#[test]
fn outlines_that_are_not_convex_are_the_sum_of_their_parts() {
    // A comb of 2 n + 1 teeth, and beside it the same as rectangles.
    let mut memory = Memory::default();
    let teeth = 12;
    let mut comb = vec![[0.0, 0.0, 0.0]];
    let mut rectangles: Vec<[[f64; 3]; 4]> = Vec::new();
    let width = f64::from(2 * teeth - 1);
    comb.push([width, 0.0, 0.0]);
    for k in (0..teeth).rev() {
        let x = f64::from(2 * k);
        comb.extend([[x + 1.0, if k == teeth - 1 { 0.0 } else { 1.0 }, 0.0]; 1]);
        comb.extend([[x + 1.0, 3.0, 0.0], [x, 3.0, 0.0]]);
        if k > 0 {
            comb.push([x, 1.0, 0.0]);
        }
    }
    comb.remove(2);
    // A corner in the middle of each side, and one more.
    let thirds = |k: usize| {
        let (a, b) = (comb[k], comb[(k + 1) % comb.len()]);
        [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|t| [0, 1, 2].map(|j| a[j] + t * (b[j] - a[j])))
    };
    let fine: Vec<[f64; 3]> = (0..comb.len()).flat_map(thirds).collect();
    let rectangle = |x: f64, y: f64, w: f64, h: f64| {
        [
            [x, y, 0.0],
            [x + w, y, 0.0],
            [x + w, y + h, 0.0],
            [x, y + h, 0.0],
        ]
    };
    rectangles.push(rectangle(0.0, 0.0, width, 1.0));
    for k in 0..teeth {
        rectangles.push(rectangle(f64::from(2 * k), 1.0, 1.0, 2.0));
    }
    let polygon: Vec<u32> = numbers(comb.len()).collect();
    let whole = Facets::new(&comb, &[polygon], Sides::One).unwrap();
    let corners: Vec<[f64; 3]> = rectangles.concat();
    let polygons: Vec<[u32; 4]> = numbers(rectangles.len())
        .map(|k| [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3])
        .collect();
    let parts = Facets::new(&corners, &polygons, Sides::One).unwrap();
    let polygon: Vec<u32> = numbers(fine.len()).collect();
    let fine = Facets::new(&fine, &[polygon], Sides::One).unwrap();
    // Sums of some hundred areas of up to 23, rounded.
    for facets in [&whole, &fine] {
        assert!((facets.area(0) - (width + 24.0)).abs() < 1e-12);
    }
    for x in [[3.0, 1.0, 2.0], [0.5, 2.5, 0.1], [40.0, -3.0, 7.0]] {
        let n = [0.1, 0.2, -1.0];
        let want: f64 = parts.from_point(x, n, &mut memory).facets.iter().sum();
        let found = whole.from_point(x, n, &mut memory).facets[0];
        // Lambert's sums of some tens of parts.
        assert!((found - want).abs() < 1e-13, "{found} {want}");
        // Thirds are rounded, and the point is lifted by twice as much, .1 from the comb.
        let found = fine.from_point(x, n, &mut memory).facets[0];
        let room = 20.0 * fine.displacement() / 0.1;
        assert!((found - want).abs() < room, "{found} {want}");
    }
}

#[test]
fn wrong_outlines_are_refused() {
    let of = |corners: &[[f64; 3]]| {
        let polygon: Vec<u32> = numbers(corners.len()).collect();
        Facets::new(corners, &[polygon], Sides::One).map(|f| f.area(0))
    };
    let bow = [[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 2., 0.]];
    assert_eq!(of(&bow), Err(FacetError::Crossing(0)));
    let line = [[0., 0., 0.], [1., 1., 0.], [2., 2., 0.], [3., 3., 0.]];
    assert_eq!(of(&line), Err(FacetError::NoArea(0)));
    let bent = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.1], [0., 1., 0.]];
    assert_eq!(of(&bent), Err(FacetError::NotFlat(0)));
    let arrow = [[0., 0., 0.], [2., -1., 0.], [1., 0., 0.], [2., 1., 0.]];
    assert_eq!(of(&arrow).map(|area| (area * 1e9).round()), Ok(1e9));
    // A hole whose bridge touches itself.
    let bridge = [
        [0., 0., 0.],
        [3., 0., 0.],
        [3., 3., 0.],
        [1., 1., 0.],
        [2., 1., 0.],
        [1., 1., 0.],
    ];
    assert_eq!(of(&bridge), Err(FacetError::Crossing(0)));
}

#[test]
fn points_on_a_facet_are_above_it() {
    // A floor and a wall at right angles, turned in any way: points of the floor see as much of the
    // wall as they do where nothing is rounded.
    let mut rng = linelit_testkit::cases::rng(52);
    let mut memory = Memory::default();
    let floor = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let wall = [[1., 0., 0.], [1., 0., 1.], [1., 1., 1.], [1., 1., 0.]];
    let exact = Facets::new(
        &[floor, wall].concat(),
        &[[0, 1, 2, 3], [4, 5, 6, 7]],
        Sides::One,
    );
    let exact = exact.unwrap();
    for _ in 0..500 {
        let (sin, cos) = linelit_elementary::sin_cos(rng.in_range(0.0, 6.0));
        let (s, c) = linelit_elementary::sin_cos(rng.in_range(0.0, 6.0));
        let turned = |[x, y, z]: [f64; 3]| {
            let (x, y) = (cos * x - sin * y, sin * x + cos * y);
            [x, c * y - s * z, s * y + c * z]
        };
        let vertices = [floor, wall].concat().into_iter().map(turned);
        let vertices: Vec<[f64; 3]> = vertices.collect();
        let facets = Facets::new(&vertices, &[[0, 1, 2, 3], [4, 5, 6, 7]], Sides::One).unwrap();
        let x = [rng.in_range(0.1, 0.9), rng.in_range(0.1, 0.9), 0.0];
        let want = exact.from_point(x, [0., 0., 1.], &mut memory).facets[1];
        let found = facets.from_point(turned(x), turned([0., 0., 1.]), &mut memory);
        // The point and the corners of the wall are off by displacements of some 1e-7 at 0.1.
        assert!((found.facets[1] - want).abs() < 20.0 * facets.displacement() / 0.1);
    }
}
