//! Boundaries, compared with areas that are found by a sweep over all events.

use super::orient::orient;
use super::{BoundaryEdge, Penumbra, Point};
use proptest::prelude::*;

/// The visible area, as a sum over the boundary's pieces.
fn area(light: &[Point], triangles: &[[Point; 3]]) -> f64 {
    let mut penumbra = Penumbra::default();
    area_within(
        light[0],
        penumbra.boundary(light, triangles.iter().copied()),
    )
}

/// Returns how far the pieces are from closed curves: the sum of their vectors.
fn gap(light: &[Point], triangles: &[[Point; 3]]) -> f64 {
    let mut penumbra = Penumbra::default();
    let pieces = penumbra.boundary(light, triangles.iter().copied());
    let sum = |k: usize| pieces.iter().map(|p| p.to[k] - p.from[k]).sum::<f64>();
    sum(0).abs().max(sum(1).abs())
}

/// Returns the interval of v in which the line u = `u` is inside a convex polygon.
fn chord(polygon: &[Point], u: f64) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..polygon.len() {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        if (a[0] <= u) != (b[0] <= u) {
            let v = a[1] + (b[1] - a[1]) * ((u - a[0]) / (b[0] - a[0]));
            (low, high) = (low.min(v), high.max(v));
        }
    }
    (low < high).then_some((low, high))
}

/// The visible length on the line u = `u`.
fn visible_length(light: &[Point], triangles: &[[Point; 3]], u: f64) -> f64 {
    let Some((low, high)) = chord(light, u) else {
        return 0.0;
    };
    let mut hidden: Vec<(f64, f64)> = triangles.iter().filter_map(|t| chord(t, u)).collect();
    hidden.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut reached, mut length) = (low, 0.0);
    for (from, to) in hidden {
        if from > reached {
            length += (from.min(high) - reached).max(0.0);
        }
        reached = reached.max(to);
    }
    length + (high - reached).max(0.0)
}

/// The visible area by a sweep: the visible length is linear between neighbouring corners and
/// crossings.
fn area_by_sweep(light: &[Point], triangles: &[[Point; 3]]) -> f64 {
    let polygons = triangles.iter().map(|t| &t[..]).chain([light]);
    let sides: Vec<[Point; 2]> = polygons
        .flat_map(|p| (0..p.len()).map(move |i| [p[i], p[(i + 1) % p.len()]]))
        .collect();
    let mut events: Vec<f64> = sides.iter().map(|s| s[0][0]).collect();
    for (i, [a, b]) in sides.iter().enumerate() {
        for [c, d] in &sides[..i] {
            let (e, f) = ([b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]]);
            let det = e[0] * f[1] - e[1] * f[0];
            let t = ((c[0] - a[0]) * f[1] - (c[1] - a[1]) * f[0]) / det;
            if (0.0..=1.0).contains(&t) {
                events.push(a[0] + e[0] * t);
            }
        }
    }
    events.sort_by(f64::total_cmp);
    let slab = |pair: &[f64]| {
        let width = pair[1] - pair[0];
        width * visible_length(light, triangles, 0.5 * (pair[0] + pair[1]))
    };
    events.windows(2).map(slab).sum()
}

const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// The tolerance for areas: rounded crossings change an area by thousands of ε at most. There are
/// some hundred of them; each is off along the edges by a few ε over the sine of the angle at which
/// the edges cross, but only by a few ε across them, which is what changes the area.
const AREA: f64 = 4096.0 * f64::EPSILON;

fn assert_area(light: &[Point], triangles: &[[Point; 3]]) {
    let (got, want) = (area(light, triangles), area_by_sweep(light, triangles));
    assert!(
        (got - want).abs() < AREA,
        "{got} but {want}: {light:?} {triangles:?}"
    );
    for every in [false, true] {
        if let Some(got) = area_past_surfaces(light, triangles, every) {
            assert!(
                (got - want).abs() < AREA,
                "{got} but {want}, surfaces {every}: {light:?} {triangles:?}"
            );
        }
    }
}

/// The visible area if every second triangle, or every one, is known by its sides alone; `None` if
/// they are too close to each other to decide.
fn area_past_surfaces(light: &[Point], triangles: &[[Point; 3]], every: bool) -> Option<f64> {
    let mut penumbra = Penumbra::default();
    let is_surface = |i: usize| every || i % 2 == 1;
    let (mut images, mut surfaces) = (Vec::new(), Vec::new());
    for (i, t) in triangles.iter().enumerate() {
        // Smaller coordinates are zero to `orient`, too.
        let t = t.map(|p| p.map(|x| if x.abs() < 1e-60 { 0.0 } else { x }));
        if is_surface(i) {
            surfaces.push(t);
        } else {
            images.push(t);
        }
    }
    let silhouettes = surfaces.iter().flat_map(|&[a, b, c]| {
        let layers = match orient(a, b, c) {
            turn if turn > 0.0 => 1,
            turn if turn < 0.0 => -1,
            _ => 0,
        };
        [(a, b, layers), (b, c, layers), (c, a, layers)]
    });
    let is_visible = |p: Point| {
        let holds = |[a, b, c]: &[Point; 3]| {
            let turn = orient(*a, *b, *c).signum();
            let sides = [(a, b), (b, c), (c, a)];
            // Sides that two triangles share are not edges.
            orient(*a, *b, *c) != 0.0
                && sides.iter().all(|(a, b)| orient(**a, **b, p) * turn >= 0.0)
        };
        // Points behind images are never queried.
        assert!(!images.iter().any(holds), "{p:?}");
        !surfaces.iter().any(holds)
    };
    let occluded = penumbra.begin(light).past(images.iter().copied());
    let outline = occluded.outline(silhouettes);
    assert!(outline.edges().flatten().flatten().all(f64::is_finite));
    let pieces = outline.boundary(1e-12, is_visible)?;
    Some(area_within(light[0], pieces))
}

fn area_within(o: Point, pieces: &[BoundaryEdge]) -> f64 {
    let cross = |a: Point, b: Point| {
        let [u, v] = [a, b].map(|p| [p[0] - o[0], p[1] - o[1]]);
        0.5 * (u[0] * v[1] - u[1] * v[0])
    };
    pieces.iter().map(|piece| cross(piece.from, piece.to)).sum()
}

#[test]
fn simple_cases() {
    let half = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
    assert_area(&SQUARE, &[]);
    // A corner cut off exactly, twice, and in the other orientation.
    let corner = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];
    assert_area(&SQUARE, &[corner]);
    assert_area(&SQUARE, &[corner, corner]);
    assert_area(&SQUARE, &[corner, [corner[2], corner[1], corner[0]]]);
    assert_area(&SQUARE, &[half]);
    assert!(area(&SQUARE, &[half]).abs() < 1e-15);
    // A hole, and a hole within a hole.
    let hole = [[0.25, 0.25], [0.75, 0.25], [0.5, 0.75]];
    assert_area(&SQUARE, &[hole]);
    let inner = [[0.4, 0.3], [0.6, 0.3], [0.5, 0.4]];
    assert_area(&SQUARE, &[hole, inner]);
    // Next to the light, along its side.
    assert_area(&SQUARE, &[[[0.0, 0.0], [1.0, 0.0], [0.5, -1.0]]]);
    // Triangles without area.
    assert_area(&SQUARE, &[[[0.1, 0.1], [0.5, 0.5], [0.9, 0.9]]]);
}

#[test]
fn meshes_leave_nothing() {
    // A fan around a point on the light, its rim beyond the light, in any order.
    for count in 3..12 {
        let corner = |i: u32| {
            let (s, c) = (f64::from(i % count) / f64::from(count) * 6.0).sin_cos();
            [0.4 + 3.0 * c, 0.6 + 3.0 * s]
        };
        let fan: Vec<[Point; 3]> = (0..count)
            .map(|i| [[0.4, 0.6], corner(i), corner(i + 1)])
            .collect();
        let mut penumbra = Penumbra::default();
        let pieces = penumbra.boundary(&SQUARE, fan.iter().copied()).len();
        let by_sweep = area_by_sweep(&SQUARE, &fan);
        assert!(pieces == 0 || by_sweep > 0.0, "{count}: {pieces} pieces");
        assert_area(&SQUARE, &fan);
    }
}

/// A side whose end is as close to both long sides of a thin image as rounding moves a crossing, so
/// that it is not known which of them it crosses first.
#[test]
fn sides_that_end_at_thin_images() {
    let above = 1.250_000_000_000_000_7;
    let thin = [[0.25, 1.0], [0.249_999_999_999_999_92, 0.0], [0.25, above]];
    assert_area(&SQUARE, &[thin, [[-0.5, above], [0.25, 0.25], [0.75, 0.0]]]);
}

/// The boundary past silhouettes is refused only if they nearly coincide; for random triangles this
/// never happens.
#[test]
fn silhouettes_tell_nearly_always() {
    let mut rng = linelit_testkit::cases::rng(10);
    for count in [1, 3, 10, 40] {
        for every in [false, true] {
            let triangles: Vec<[Point; 3]> = (0..count)
                .map(|_| [(); 3].map(|()| [rng.in_range(-0.5, 1.5), rng.in_range(-0.5, 1.5)]))
                .collect();
            let got = area_past_surfaces(&SQUARE, &triangles, every).expect("none is close");
            assert!((got - area_by_sweep(&SQUARE, &triangles)).abs() < AREA);
        }
    }
}

fn any_point(low: f64, high: f64) -> impl Strategy<Value = Point> {
    [low..high, low..high]
}

/// Points of a coarse grid: corners coincide, edges overlap, and everything is on common lines.
fn grid_point() -> impl Strategy<Value = Point> {
    [-2i32..7, -2i32..7].prop_map(|p| p.map(|x| 0.25 * f64::from(x)))
}

fn convex_light() -> impl Strategy<Value = Vec<Point>> {
    prop_oneof![
        Just(SQUARE.to_vec()),
        Just(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        Just(vec![[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
        linelit_testkit::strategies::convex_polygon_2d(),
    ]
}

proptest! {
    #[test]
    fn area_of_anything(
        light in convex_light(),
        triangles in prop::collection::vec([any_point(-1.0, 2.0), any_point(-1.0, 2.0), any_point(-1.0, 2.0)], 0..8),
    ) {
        assert_area(&light, &triangles);
    }

    /// Compares areas for so many triangles that counts are handed on: small ones within the light,
    /// some that share corners, and some that extend as far beyond the light as visibility leaves
    /// them, where coordinates, and so crossings, are a thousand times less precise.
    #[test]
    fn area_of_crowds(
        near in prop::collection::vec([any_point(-0.2, 1.2), any_point(-0.3, 0.3), any_point(-0.3, 0.3)], 0..16),
        far in prop::collection::vec([any_point(-1.0, 2.0), any_point(-1e3, 1e3), any_point(-1e3, 1e3)], 0..6),
    ) {
        let moved = |o: Point, p: Point| [o[0] + p[0], o[1] + p[1]];
        let mut triangles: Vec<[Point; 3]> = Vec::new();
        for [o, a, b] in near {
            let (a, b) = (moved(o, a), moved(o, b));
            triangles.extend([[o, a, b], [a, b, moved(a, [b[0] - o[0], b[1] - o[1]])]]);
        }
        triangles.extend(far.iter().copied());
        let (got, want) = (area(&SQUARE, &triangles), area_by_sweep(&SQUARE, &triangles));
        let room = if far.is_empty() { AREA } else { 1e3 * AREA };
        prop_assert!((got - want).abs() < room, "{got} but {want}");
        prop_assert!(gap(&SQUARE, &triangles) < room);
    }

    /// Coordinates are multiples of a quarter, so that everything coincides.
    #[test]
    fn area_on_a_grid(
        light in convex_light(),
        triangles in prop::collection::vec([grid_point(), grid_point(), grid_point()], 0..8),
    ) {
        assert_area(&light, &triangles);
        prop_assert!(gap(&light, &triangles) < 1e-12);
    }

    /// Shared corners, moved by a few units in the last place, so that edges nearly coincide.
    #[test]
    fn area_of_near_coincidences(
        triangles in prop::collection::vec([grid_point(), grid_point(), grid_point()], 1..6),
        nudges in prop::collection::vec(-3i64..4, 36),
    ) {
        let mut nudges = nudges.into_iter();
        let mut nudge = |x: f64| linelit_testkit::close::nudge(x, nudges.next().unwrap_or(0));
        let triangles: Vec<_> = triangles.iter().map(|t| t.map(|p| p.map(&mut nudge))).collect();
        assert_area(&SQUARE, &triangles);
    }

    /// The order of triangles and of their corners changes nothing except rounding.
    #[test]
    fn order_does_not_matter(
        mut triangles in prop::collection::vec([grid_point(), grid_point(), grid_point()], 0..8),
    ) {
        let before = area(&SQUARE, &triangles);
        triangles.reverse();
        for t in &mut triangles {
            t.swap(0, 1);
        }
        prop_assert!((area(&SQUARE, &triangles) - before).abs() < AREA);
    }
}

/// Edges that enter the light where it meets an image's side, up to rounding: only exact arithmetic
/// can decide on which side of the image's side they begin. There are so many images that grids are
/// used, whose cells meet there, too, and edges that begin one cell away from an image have to be
/// found.
#[test]
fn rounding_across_the_cells_of_grids_decides_nothing() {
    let mut rng = linelit_testkit::cases::rng(12);
    for case in 0..linelit_testkit::cases::cases(2000) {
        let swap = |p: Point| if case % 2 == 0 { p } else { [p[1], p[0]] };
        let side = if case % 4 < 2 { 2.0 } else { -1.0 };
        let image = [[0.5, -1.0], [0.5, 2.0], [side, 0.3]].map(swap);
        let run = [(); 2].map(|()| rng.in_range(-1.0, 1.0));
        let at = |t: f64| [0.5 + run[0] * t, run[1] * t];
        let ends = [-rng.in_range(0.1, 2.0), rng.in_range(0.1, 2.0)].map(at);
        let third = [(); 2].map(|()| rng.in_range(-1.0, 2.0));
        let other = [ends[0], ends[1], third].map(swap);
        let many: Vec<_> = [image, other].into_iter().cycle().take(80).collect();
        let (got, want) = (area(&SQUARE, &many), area_by_sweep(&SQUARE, &many[..2]));
        assert!((got - want).abs() < AREA, "{got} but {want}: {other:?}");
    }
}

#[test]
fn what_is_kept_of_a_light_serves_no_other() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut other = square;
    other[2] = [0.7, 0.8];
    let mut around = square;
    around.reverse();
    let triangle = [[0.2, -1.0], [0.9, 0.6], [-0.4, 0.9]];
    let mut kept = Penumbra::default();
    for light in [&square[..], &square, &other, &around, &square[1..], &square] {
        let pieces = kept.boundary(light, [triangle].into_iter()).to_vec();
        let mut fresh = Penumbra::default();
        assert_eq!(pieces, fresh.boundary(light, [triangle].into_iter()));
        assert!(!pieces.is_empty());
    }
}

/// Hundreds of sides, for which other tables are used than for a few. Adding a part of the
/// triangles, and then the others and some of the first again, gives the same as adding all at
/// once.
#[test]
fn area_of_many_in_two_goes() {
    let mut rng = linelit_testkit::cases::rng(9);
    let mut penumbra = Penumbra::default();
    for (count, size) in [(40, 0.3), (150, 0.1), (260, 0.04), (260, 0.3)] {
        let mut triangles = Vec::new();
        for _ in 0..count {
            let mut any = |low, high| [rng.in_range(low, high), rng.in_range(low, high)];
            let (o, a, b) = (any(-0.1, 1.1), any(-size, size), any(-size, size));
            let [a, b] = [a, b].map(|p| [o[0] + p[0], o[1] + p[1]]);
            // Two triangles that share a side.
            let c = [a[0] + b[0] - o[0], a[1] + b[1] - o[1]];
            triangles.extend([[o, a, b], [a, b, c]]);
        }
        let want = area_by_sweep(&SQUARE, &triangles);
        let (first, second) = triangles.split_at(triangles.len() / 3);
        let mut some = penumbra.begin(&SQUARE).past(first.iter().copied());
        some.boundary();
        let again = second.iter().chain(&first[..7]).copied();
        let pieces = some.past(again).boundary().to_vec();
        assert_eq!(pieces, penumbra.latest());
        let sum = pieces
            .iter()
            .map(|p| p.from[0] * p.to[1] - p.from[1] * p.to[0]);
        let got = 0.5 * sum.sum::<f64>();
        assert!((got - want).abs() < 10.0 * AREA, "{count}: {got} {want}");
        assert!((area(&SQUARE, &triangles) - want).abs() < 10.0 * AREA);
    }
}

/// A light of which nothing is left is queried after one that was partly hidden, as callers do that
/// do not skip lights below the horizon.
#[test]
fn nothing_is_visible_of_an_empty_light_after_another() {
    let [a, b, c] = [[0.2, 0.2], [0.8, 0.2], [0.2, 0.8]];
    let is_past = |p: Point| p[0] < 0.2 || p[1] < 0.2 || p[0] + p[1] > 1.0;
    let mut penumbra = Penumbra::default();
    for light in [&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][..], &[]] {
        let silhouettes = [(a, b, 2), (b, c, 2), (c, a, 2)].into_iter();
        let outline = penumbra.begin(light).outline(silhouettes);
        assert_eq!(outline.edges().count() == 0, light.is_empty());
        let count = outline.boundary(1e-12, is_past).map(<[_]>::len);
        assert_eq!(count.is_none_or(|n| n == 0), light.is_empty(), "{count:?}");
    }
}
