//! Facets that coincide, are not convex, or are back to back.

use linelit_shading::polygon::irradiance_by_edges;
use linelit_testkit::rng::SplitMix64;
use linelit_viewfactors::geometry::DVec3;
use linelit_viewfactors::{FacetError, Facets, Memory, Sides};

/// The vertex numbers of a polygon with this many corners.
fn numbers(count: usize) -> std::ops::Range<u32> {
    0..u32::try_from(count).unwrap()
}

/// A square of side 4 at height 2, seen from below, with others in one plane in front of it.
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
        // The same square again, one inside of it, and one across its corner.
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
        // Numbers decide which one stays: the large square loses what the small one covers.
        let before = ceiling(&[[-1.0, -1.0, 0.5, 0.5]], sides);
        let value = before.between(0, 1, 1e-9, &mut memory).value;
        let want = none.between(0, 1, 1e-9, &mut memory).value;
        let ways = if sides == Sides::Two { 0.5 } else { 1.0 };
        assert!((value - ways * want).abs() < 1e-9);
    }
}

#[test]
fn covered_facets_keep_the_rest() {
    // A floor whose number is higher than that of a plate in it: what is left of the floor is a
    // frame.
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
    // Both directions are within their tolerances.
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
    // A comb, and the same shape as rectangles.
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
    // The same comb with two more corners on each side, at thirds.
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
    // Sums of some hundred areas of up to 23, with rounding.
    for facets in [&whole, &fine] {
        assert!((facets.area(0) - (width + 24.0)).abs() < 1e-12);
    }
    for x in [[3.0, 1.0, 2.0], [0.5, 2.5, 0.1], [40.0, -3.0, 7.0]] {
        let n = [0.1, 0.2, -1.0];
        let want: f64 = parts.from_point(x, n, &mut memory).facets.iter().sum();
        let found = whole.from_point(x, n, &mut memory).facets[0];
        // Sums over some tens of parts (Lambert's formula).
        assert!((found - want).abs() < 1e-13, "{found} {want}");
        // Corners at thirds are rounded, and the point is lifted by twice the displacement, at .1
        // from the comb.
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
    // A floor and a wall at right angles, in any rotation: points of the floor see as much of the
    // wall as without rounding.
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

/// A rectangle `[x0, y0, x1, y1]` in a plane `z = a + b x`, seen from above or below.
#[derive(Clone, Copy)]
struct Pane {
    rectangle: [f64; 4],
    plane: [f64; 2],
    is_up: bool,
}

impl Pane {
    fn height(&self, x: f64) -> f64 {
        self.plane[0] + self.plane[1] * x
    }

    fn corners(&self) -> [[f64; 3]; 4] {
        let [a, b, c, d] = self.rectangle;
        let mut corners = [[a, b], [c, b], [c, d], [a, d]].map(|[x, y]| [x, y, self.height(x)]);
        if !self.is_up {
            corners.reverse();
        }
        corners
    }
}

/// The view factors from a point to panes so close together that parallax does not matter, and the
/// least distance to a pane: in each cell between the lines of all edges and crossings, the nearest
/// pane is seen.
fn seen_of_panes(panes: &[Pane], x: [f64; 3], n: [f64; 3], sides: Sides) -> Vec<f64> {
    let mut cuts = [Vec::new(), Vec::new()];
    for pane in panes {
        let [a, b, c, d] = pane.rectangle;
        cuts[0].extend([a, c]);
        cuts[1].extend([b, d]);
        let crossing =
            |other: &Pane| (other.plane[0] - pane.plane[0]) / (pane.plane[1] - other.plane[1]);
        cuts[0].extend(panes.iter().map(crossing).filter(|x| x.is_finite()));
    }
    for cuts in &mut cuts {
        cuts.sort_by(f64::total_cmp);
    }
    let mut seen = vec![0.0; panes.len()];
    for u in cuts[0].windows(2) {
        for v in cuts[1].windows(2) {
            let [s, t] = [0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1])];
            let covers = |pane: &Pane| {
                let [a, b, c, d] = pane.rectangle;
                a < s && s < c && b < t && t < d
            };
            let covering = (0..panes.len()).filter(|&k| covers(&panes[k]));
            let faces = |k: usize| sides == Sides::Two || panes[k].is_up == (x[2] > 0.0);
            // Of two panes at the same height, the one that faces the point is seen.
            let order = |k: &usize| ((x[2] - panes[*k].height(s)).abs(), !faces(*k));
            let nearest = |a: &usize, b: &usize| {
                let (a, b) = (order(a), order(b));
                a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
            };
            let Some(k) = { covering }.min_by(nearest) else {
                continue;
            };
            if faces(k) {
                let corners = [[u[0], v[0]], [u[1], v[0]], [u[1], v[1]], [u[0], v[1]]];
                let cell = corners.map(|[a, b]| DVec3::new(a, b, 0.0) - DVec3::from(x));
                let n = DVec3::from(n).normalize();
                seen[k] += irradiance_by_edges(&cell, n).abs() / std::f64::consts::PI;
            }
        }
    }
    seen
}

/// Compares view factors from points to panes with closed forms, at some size and in some rotation.
fn compare_panes(panes: &[Pane], sides: Sides, scale: f64, rng: &mut SplitMix64) {
    // Some are not rotated, and have their middle at zero, where the smallest heights keep all
    // digits.
    let most = if rng.in_range(0.0, 1.0) < 0.3 {
        0.0
    } else {
        6.0
    };
    let [(sin, cos), (s, c)] =
        [(); 2].map(|()| linelit_elementary::sin_cos(rng.in_range(0.0, 1.0) * most));
    let turned = |[x, y, z]: [f64; 3]| {
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        [x, c * y - s * z, s * y + c * z].map(|v| scale * v)
    };
    // A lid on either side; if one is farther away, the middle is not at zero and heights are
    // rounded.
    let below = if most > 0.0 { -0.8 } else { -1.0 };
    let lid = |z: f64| [[-3., -3., z], [3., -3., z], [3., 3., z], [-3., 3., z]];
    let corners = panes
        .iter()
        .map(Pane::corners)
        .chain([lid(1.0), lid(below)]);
    let vertices: Vec<[f64; 3]> = corners.flatten().map(turned).collect();
    let polygons: Vec<Vec<u32>> = numbers(panes.len() + 2)
        .map(|k| (4 * k..4 * k + 4).collect())
        .collect();
    let facets = Facets::new(&vertices, &polygons, sides).unwrap();
    let mut memory = Memory::default();
    for side in [1.0, -1.0] {
        let x = [
            rng.in_range(-0.5, 0.5),
            rng.in_range(-0.5, 0.5),
            side * rng.in_range(0.3, 0.7),
        ];
        let n = [rng.in_range(-0.3, 0.3), rng.in_range(-0.3, 0.3), -side];
        let want = seen_of_panes(panes, x, n, sides);
        let row = facets.from_point(turned(x), turned(n), &mut memory);
        // Heights, and twice the displacement of both, move lines: the four of each pane, and those
        // where two panes cross, each up to 2 long, at a distance of .3.
        let heights = panes
            .iter()
            .flat_map(|pane| pane.corners().map(|v| v[2].abs()));
        let moved = 4.0 * facets.displacement() / scale + heights.fold(0.0, f64::max);
        let lines = (panes.len() * (panes.len() + 7)) as f64 / 2.0;
        let most = 1e-12 + lines * 2.0 * moved / (std::f64::consts::PI * 0.3 * 0.3);
        for (k, want) in want.iter().enumerate() {
            let found = row.facets[k];
            assert!(
                (found - want).abs() < most,
                "{k}: {found} {want}, {most:e} {scale} {sides:?}"
            );
        }
    }
}

#[test]
fn of_facets_closer_than_rounding_that_in_front_is_seen() {
    let mut rng = linelit_testkit::cases::rng(53);
    for k in 0..400 {
        let count = 2 + k % 5;
        let apart = [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5][k / 5 % 8];
        let scale = [1.0, 37.0, 1_000.0, 10_000.0][k / 40 % 4];
        let sides = [Sides::One, Sides::Two][k % 2];
        let mut panes = Vec::new();
        for layer in 0..count {
            let [x, y] = [(); 2].map(|()| rng.in_range(-1.0, 0.2));
            // Every third set of panes has one outline, like party walls.
            let rectangle = match k % 3 {
                0 => [-0.5, -0.6, 0.7, 0.4],
                _ => [x, y, x + rng.in_range(0.3, 1.0), y + rng.in_range(0.3, 1.0)],
            };
            // Facets in one plane that face the same way are merged, which another test is about.
            let is_exact = apart <= 0.0;
            let height = apart * (layer as f64 - rng.in_range(0.2, 0.4));
            panes.push(Pane {
                rectangle,
                plane: [if is_exact { 0.0 } else { height }, 0.0],
                is_up: if is_exact {
                    layer == 0
                } else {
                    rng.in_range(0.0, 1.0) < 0.6
                },
            });
            if is_exact && layer == 1 {
                break;
            }
        }
        if apart <= 0.0 && sides == Sides::Two {
            continue;
        }
        compare_panes(&panes, sides, scale, &mut rng);
    }
}

#[test]
fn of_facets_that_cross_within_rounding_each_is_in_front_on_its_side() {
    let mut rng = linelit_testkit::cases::rng(54);
    for k in 0..200 {
        let slope = [1e-11, 1e-10, 1e-9, 1e-8, 1e-7][k % 5];
        let panes: Vec<Pane> = (0..2 + k / 5 % 3)
            .map(|_| Pane {
                rectangle: [
                    rng.in_range(-1.0, -0.3),
                    rng.in_range(-1.0, -0.3),
                    rng.in_range(0.3, 1.0),
                    rng.in_range(0.3, 1.0),
                ],
                plane: [
                    slope * rng.in_range(-0.3, 0.3),
                    slope * rng.in_range(-1.0, 1.0),
                ],
                is_up: rng.in_range(0.0, 1.0) < 0.7,
            })
            .collect();
        let sides = [Sides::One, Sides::Two][k % 2];
        compare_panes(&panes, sides, [1.0, 1_000.0][k / 20 % 2], &mut rng);
    }
}

#[test]
fn a_vertex_that_no_facet_uses_changes_nothing() {
    let vertices = [
        [0.1, 0., 0.3],
        [1., 0., 0.7],
        [1., 1., 0.9],
        [0.3, 0.2, 1.],
        [0., 1., 1.],
    ];
    let far = [vertices.to_vec(), vec![[1e9, -3e8, 2e9]]].concat();
    let rows = [&vertices[..], &far].map(|vertices| {
        let facets = Facets::new(vertices, &[[0, 1, 2], [2, 3, 4]], Sides::Two).unwrap();
        let row = facets.from_point([0.2, 0.1, 3.0], [0., 0.1, -1.], &mut Memory::default());
        (row, facets.displacement().to_bits(), facets.matrix(1e-6))
    });
    assert_eq!(rows[0], rows[1]);
}
/// A vertex that no facet uses changes nothing, wherever it is, and neither does one far away on a
/// map.
#[test]
fn stray_vertices_are_not_in_the_middle() {
    let square = [[0.0, 0.0], [1.7, 0.0], [1.7, 1.7], [0.0, 1.7]];
    let high: Vec<_> = square.iter().rev().map(|[x, y]| [*x, *y, 1.7]).collect();
    let low = square.iter().map(|[x, y]| [*x, *y, 0.0]);
    let at = [500_000.3, 4_500_000.7, 100.1];
    let place = |v: [f64; 3]| [v[0] + at[0], v[1] + at[1], v[2] + at[2]];
    let vertices: Vec<_> = low.chain(high).map(place).collect();
    let polygons = [[0, 1, 2, 3], [4, 5, 6, 7]];
    let row = |vertices: &[[f64; 3]]| {
        let facets = Facets::new(vertices, &polygons, Sides::One).unwrap();
        assert!(!facets.rounding().is_coarse());
        let (x, up) = (place([0.85, 0.85, 0.3]), [0.0, 0.0, 1.0]);
        facets.from_point(x, up, &mut Memory::default())
    };
    let want = row(&vertices);
    assert!((want.facets[1] - 0.316_326_72).abs() < 1e-7, "{want:?}");
    for stray in [[0.0; 3], [5e9, 0.0, 0.0], [-1e15, 1e15, 0.0]] {
        let mut with = vertices.clone();
        with.push(stray);
        assert_eq!(row(&with), want);
    }
}
