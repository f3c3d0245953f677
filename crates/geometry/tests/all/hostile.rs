//! Extreme floats in any argument of every public function: none panics, and results are finite,
//! positive or inside where that is promised.

use linelit_geometry::double::{self, Double};
use linelit_geometry::finite::{
    below_one, fraction, nonnegative, nonnegative_vector, power_of_two_over,
};
use linelit_geometry::intervals::{Interval, IntervalSet, IntervalTree, MIN_LENGTH, VisibleSet};
use linelit_geometry::{
    Chord, CloseLines, ConvexPolygon, DMat3, DVec2, DVec3, EllipticCone, Frame, Margins,
    ParallelLines, PlaneFrame, PolygonError, Rounding, Segment, ShadowCoords, ShadowTriangle,
    Triangle, Vector3, origin_of_box, predicates, vector,
};
use linelit_testkit::public;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::{
    hostile, hostile_direction, hostile_unit, hostile_vector, hostile_vectors,
};
use proptest::prelude::*;
use std::path::Path;

/// Instruction sets and questions whether to stop: they take no floats.
const WITHOUT_FLOATS: [&str; 14] = [
    "Avx2",
    "Avx512",
    "InstructionSet",
    "Isa",
    "ParseInstructionSetError",
    "Stopped",
    "ask",
    "best",
    "catch",
    "check",
    "detect",
    "is_available",
    "limit",
    "name",
];

#[test]
fn every_public_function_is_called_here() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let missing = public::missing(&src, include_str!("hostile.rs"), &WITHOUT_FLOATS);
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// Whether a frame is orthonormal: to 4 ε over the least angle, 1e-3, of the plain cross product.
fn is_orthonormal(f: &Frame) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() < 4e3 * f64::EPSILON;
    [f.x, f.y, f.z].iter().all(|a| near(a.length(), 1.0))
        && [f.x.dot(f.y), f.y.dot(f.z), f.z.dot(f.x)]
            .iter()
            .all(|d| near(*d, 0.0))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: linelit_testkit::cases::cases(5_000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn polygons(
        points in hostile_vectors::<5>(),
        count in 0..=5_usize,
        x in hostile_vector(),
        direction in hostile_direction(),
        numbers in [hostile(), hostile(), hostile()],
        unit in hostile_unit(),
    ) {
        let points = points.map(vector);
        let _ = ConvexPolygon::parallelogram(points[0], points[1], points[2]).map(|p| sound(&p));
        let _ = ConvexPolygon::triangle(points[0], points[1], points[2]).map(|p| sound(&p));
        // Vectors of other types give the same numbers.
        let three = [points[0], points[1], points[2]];
        prop_assert_eq!(ConvexPolygon::try_from(three.map(|p| p.to_array())), ConvexPolygon::new(&three));
        let ends = Segment::from([three[0], three[1]]);
        prop_assert!(ends.p0.dvec3().to_array().map(f64::to_bits) == three[0].to_array().map(f64::to_bits));
        let Ok(polygon) = ConvexPolygon::new(&points[..count]) else {
            return Ok(());
        };
        sound(&polygon)?;
        sound(&polygon.flipped())?;
        prop_assert!(polygon.moved(vector(x)).moved(DVec3::ZERO).area().to_bits() == polygon.area().to_bits());
        sound(&polygon.starting_at(7))?;
        if let Some(part) = polygon.clip(vector(x), vector(direction)) {
            prop_assert!(part.area() > 0.0 && part.area().is_finite());
            prop_assert!(part.vertices().iter().all(|v| is_inside(&polygon, *v)), "{part:?}");
            lines(&part, numbers, unit, vector(x))?;
        }
        lines(&polygon, numbers, unit, vector(x))?;
        let map = DMat3::from_cols(vector(direction), vector(x), vector(numbers));
        for map in [map, DMat3::from_diagonal(vector(direction))] {
            let Some(image) = polygon.mapped(map, vector(x)) else {
                continue;
            };
            prop_assert!(image.area() > 0.0 && image.area().is_finite());
            prop_assert!((image.normal().length() - 1.0).abs() <= 4.0 * f64::EPSILON);
            prop_assert!(image.vertices().iter().all(|v| v.is_finite()));
            prop_assert_eq!(image.vertices().len(), polygon.vertices().len());
        }
    }

    #[test]
    fn frames(z in hostile_direction(), x in hostile_vector(), p in hostile_vector(), angle in hostile()) {
        let [z, x, p] = [z, x, p].map(vector);
        let plane = PlaneFrame::new(p, z, x).turned(angle);
        prop_assert!(is_orthonormal(&plane.axes), "{plane:?}");
        prop_assert!(plane.turn_from(&plane).abs() < 32.0 * f64::EPSILON);
        for x in [x, z, z + x * 1e-3, z + x * 1e-9, -z] {
            let frame = Frame::from_normal_and_tangent(z, x);
            prop_assert!(is_orthonormal(&frame), "{frame:?} {x}");
        }
        let frame = plane.axes;
        // A unit vector, as the function requires.
        if let Some(z) = predicates::normalize(z) {
            prop_assert!((z.length() - 1.0).abs() <= 4.0 * f64::EPSILON);
            prop_assert!(is_orthonormal(&Frame::from_normal(z)));
        }
        let _ = Frame::from_normal(z);
        // Sums of products of any numbers.
        let _ = (frame.to_local(p), frame.to_world(p), plane.to_plane(x), plane.height(x));
        let _ = plane.from_plane(DVec2::new(p.x, p.y));
    }

    #[test]
    fn elliptic_cones(v in hostile_vectors::<3>()) {
        let [c, u, w] = v.map(vector);
        if let Some(EllipticCone { axes: [x, y, z], tan: [a, b] }) = EllipticCone::over(c, u, w) {
            prop_assert!(is_orthonormal(&Frame { x, y, z }), "{x} {y} {z}");
            prop_assert!(a >= b && b > 0.0 && a.is_finite(), "{a} {b}");
        }
    }

    #[test]
    fn doubles(v in hostile_vectors::<3>()) {
        let [a, b, c] = v.map(vector);
        for k in 0..3 {
            let all = [Double::product(a[k], b[k]), Double::difference(a[k], b[k])];
            prop_assert_eq!(all.map(|d| d.hi().to_bits()), [a[k] * b[k], a[k] - b[k]].map(f64::to_bits));
        }
        let products = Double::diff_of_products(a.x, b.y, a.y, b.x);
        let _ = (products.hi(), products.lo(), double::dot_of(a, b), double::cross_of(a, b));
        let normal = double::cross(double::difference(a, c), double::difference(b, c));
        let _ = (double::rounded(normal), double::dot(normal, double::vector(c)).hi());
    }

    #[test]
    fn finite_values(v in hostile_vector()) {
        for x in v {
            prop_assert!((0.0..=f64::MAX).contains(&nonnegative(x)), "{x}");
            prop_assert!((0.0..=1.0).contains(&fraction(x)), "{x}");
            prop_assert!((0.0..1.0).contains(&below_one(x)), "{x}");
            let unit = power_of_two_over(x);
            prop_assert!(unit.is_normal() && unit.to_bits().trailing_zeros() >= 52, "{x}");
        }
        prop_assert_eq!(nonnegative_vector(vector(v)), vector(v.map(nonnegative)));
    }

    #[test]
    fn segments_and_triangles(v in hostile_vectors::<3>(), numbers in [hostile(), hostile(), hostile()]) {
        let [a, b, c] = v.map(vector);
        let [s, t, u] = numbers;
        let segment = Segment::new(a, b);
        let _ = (segment.vector(), segment.at(s));
        let length = segment.length();
        prop_assert!(length >= 0.0 || length.is_nan());
        prop_assert!(length.is_finite() || !(segment.vector() / 2.0).is_finite() || segment.vector().length().is_infinite());
        let d = segment.direction();
        prop_assert!(d == DVec3::ZERO || (d.length() - 1.0).abs() <= 4.0 * f64::EPSILON, "{d}");
        let _ = (segment.piece(s, t), segment.reversed(), segment.relative_to(c));
        let triangle = Triangle::new(a, b, c);
        let area = triangle.area();
        prop_assert!(area >= 0.0 || area.is_nan());
        let n = triangle.normal();
        prop_assert!(n == DVec3::ZERO || (n.length() - 1.0).abs() <= 4.0 * f64::EPSILON, "{n}");
        let _ = (triangle.area_vector(), triangle.at(s, u), triangle.centroid(), triangle.nearest(vector(v[0]) + DVec3::ONE));
    }

    #[test]
    fn origins(v in hostile_vectors::<2>(), moved in hostile(), edges in [hostile(), hostile(), hostile()]) {
        let [a, b] = v.map(vector);
        let (low, high) = (a.min(b), a.max(b));
        let (origin, size) = (origin_of_box(low, high), (high - low).max_element());
        prop_assert!(origin.is_finite(), "{low} {high}: {origin}");
        let off = (origin - (low + (high - low) * 0.5)).abs();
        for axis in 0..3 {
            prop_assert!(origin[axis] == 0.0 || off[axis] <= 0.125 * size, "{low} {high}: {origin}");
        }
        let rounding = Rounding::new(moved, &mut edges.clone());
        prop_assert!(edges.iter().any(|e| e.to_bits() == rounding.median_edge.to_bits()));
        prop_assert!(!rounding.is_coarse() || moved > 0.0 || rounding.median_edge < 0.0);
        let _ = rounding.to_string();
        let own = Margins::excluding(&(3..4));
        prop_assert!(own == Margins::ROUNDING && Margins::excluding(&(4..4)) == Margins::DEFAULT);
    }

    #[test]
    fn shadows(v in hostile_vectors::<6>(), reach in hostile(), distance in hostile()) {
        let margins = Margins::default();
        let margin = margins.near(reach, distance);
        prop_assert!((0.0..=margins.point).contains(&margin), "{margin}");
        prop_assert!(margin < margins.end());
        let [x, p, q, a, b, c] = v.map(vector);
        let Some(shadow) = ShadowTriangle::new(x, &Segment::new(p, q)) else {
            return Ok(());
        };
        let shadow = shadow.with_margins(margins, reach);
        let inside = |i: &Interval| i.lo >= 0.0 && i.lo < i.hi && i.hi <= 1.0;
        prop_assert!(shadow.blocked_by(&[a, b, c]).is_none_or(|i| inside(&i)));
        let corners = [a, b, c].map(|p| shadow.vertex(p));
        prop_assert!(shadow.blocked(&corners).is_none_or(|i| inside(&i)));
        let any = [a, b, c].map(|p| ShadowCoords { sigma: p.x, lam0: p.y, lam1: p.z });
        prop_assert!(shadow.blocked(&any).is_none_or(|i| inside(&i)));
        let chord: Option<Chord> = shadow.chord(&any);
        if let Some(chord) = chord {
            prop_assert!(inside(&chord.hidden()));
            // Finite sides, which are not all so near each other that their difference vanishes.
            let on_triangle = |x: &f64| (-1e-12..=1.0 + 1e-12).contains(x) || x.is_nan();
            prop_assert!(chord.ends().as_flattened().iter().all(on_triangle), "{chord:?}");
            let t = chord.t(distance);
            prop_assert!(t.is_nan() || (0.0..=1.0).contains(&t));
        }
    }

    /// Checks that both sets stay sorted, disjoint, within [0, 1], and equal to each other.
    #[test]
    fn intervals(clips in prop::collection::vec([hostile_unit(), hostile_unit()], 0..12)) {
        let (mut set, mut tree) = (IntervalSet::full(), IntervalTree::full());
        for [lo, hi] in clips {
            set.clip(lo, hi);
            tree.clip(lo, hi);
            let _ = Interval::new(lo, hi).length();
            let mut pieces = Vec::new();
            tree.for_each(|p| pieces.push(p));
            prop_assert_eq!(set.as_slice(), &pieces[..]);
            prop_assert_eq!((set.count(), set.is_empty()), (tree.count(), tree.is_empty()));
            prop_assert!((0.0..=1.0).contains(&set.measure()));
            prop_assert!(pieces.iter().all(|p| p.lo >= 0.0 && p.hi <= 1.0 && p.length() >= MIN_LENGTH));
            prop_assert!(pieces.windows(2).all(|w| w[0].hi <= w[1].lo));
            prop_assert!(tree.depth() <= 6);
        }
        set.reset();
        tree.reset();
        prop_assert_eq!(set.measure().to_bits(), 1f64.to_bits());
        prop_assert_eq!(tree.measure().to_bits(), 1f64.to_bits());
    }

    #[test]
    fn exact_products(n in [hostile(), hostile(), hostile(), hostile()], v in hostile_vectors::<3>()) {
        let [a, b, c, d] = n;
        let _ = (predicates::two_product(a, b), predicates::two_sum(a, b));
        let _ = (predicates::diff_of_products(a, b, c, d), predicates::sum_of_products(a, b, c, d));
        let [x, y, z] = v.map(vector);
        let _ = (predicates::cross(x, y), predicates::dot(x, y), predicates::determinant(x, y, z));
        if x.is_finite() {
            // Scaled to where squares are safe; the length is finite for vectors shorter than
            // 1e307.
            let largest = x.abs().max_element();
            let length = predicates::length(x);
            prop_assert!(length >= largest && (length.is_finite() || largest > 1e307), "{x} {length}");
            prop_assert!(length <= 2.0 * largest || largest > 1e307);
            let unit = predicates::normalize(x);
            prop_assert_eq!(unit.is_none(), x == DVec3::ZERO);
            prop_assert!(unit.is_none_or(|u| (u.length() - 1.0).abs() <= 4.0 * f64::EPSILON));
        } else {
            prop_assert!(predicates::normalize(x).is_none());
        }
    }
}

/// Checks what a polygon promises.
fn sound(p: &ConvexPolygon) -> Result<(), TestCaseError> {
    prop_assert!(p.area() > 0.0 && p.area().is_finite());
    prop_assert!((p.normal().length() - 1.0).abs() <= 4.0 * f64::EPSILON);
    prop_assert!(p.vertices().iter().all(|v| v.is_finite()));
    prop_assert!(p.diameter() > 0.0 && p.diameter().is_finite());
    let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
    let first = p.relative_to(p.vertices()[0], &mut relative)[0];
    prop_assert_eq!(first, DVec3::ZERO);
    prop_assert!(is_inside(p, p.centroid()), "{:?}", p.centroid());
    prop_assert!(is_orthonormal(&p.plane_frame().axes));
    if let Some((o, u, v)) = p.as_parallelogram() {
        prop_assert!(is_inside(p, o + 0.5 * (u + v)));
    }
    Ok(())
}

/// Within the extent of a polygon, to a thousandth: that is how far vertices may have been moved
/// onto its plane, and a thin polygon's centre of mass divides by an area that is little but
/// rounding.
fn is_inside(p: &ConvexPolygon, point: DVec3) -> bool {
    let slack = 1e-3 * p.diameter() + 64.0 * f64::EPSILON * point.abs().max_element();
    let bound = |least: bool| {
        p.vertices()
            .iter()
            .copied()
            .reduce(|a, b| if least { a.min(b) } else { a.max(b) })
    };
    let (Some(lo), Some(hi)) = (bound(true), bound(false)) else {
        return false;
    };
    (0..3).all(|k| point[k] >= lo[k] - slack && point[k] <= hi[k] + slack)
}

/// Checks what the lines of a polygon promise, at any angle and offset.
fn lines(
    p: &ConvexPolygon,
    [angle, offset, v]: [f64; 3],
    unit: f64,
    x: DVec3,
) -> Result<(), TestCaseError> {
    prop_assert!(is_orthonormal(&p.plane_frame().turned(angle).axes));
    let lines = ParallelLines::new(p, angle);
    let same = ParallelLines::in_frame(p, &p.plane_frame(), angle);
    prop_assert_eq!(same.knots(), lines.knots());
    let (a, b) = lines.range();
    prop_assert!(a <= b && a.is_finite() && b.is_finite());
    prop_assert!(lines.knots().windows(2).all(|w| w[0] < w[1]));
    prop_assert_eq!(lines.lower().len(), lines.upper().len());
    prop_assert!((lines.direction().length() - 1.0).abs() < 16.0 * f64::EPSILON);
    prop_assert!((lines.across().length() - 1.0).abs() < 16.0 * f64::EPSILON);
    prop_assert!(angle.is_finite() || b <= a);
    for normal in [p.normal(), -p.normal(), DVec3::new(angle, offset, v), x] {
        if let Some(close) = CloseLines::new(p, angle, x, normal) {
            let knots = close.lines.knots();
            prop_assert!(knots.windows(2).all(|w| w[0] < w[1]) && knots[0].is_finite());
            prop_assert!(close.height.is_finite() && angle.is_finite());
        }
    }
    for u in [offset, a, b, a + unit * (b - a)] {
        let length = lines.length(u);
        prop_assert!(
            length >= 0.0
                && length
                    <= p.diameter() * (1.0 + 64.0 * f64::EPSILON)
                        + 64.0 * f64::EPSILON * x_scale(p)
        );
        match lines.segment(u) {
            Some(s) if angle.is_finite() => {
                prop_assert!(is_inside(p, s.p0) && is_inside(p, s.p1), "{s:?} of {p:?}");
                prop_assert!(lines.extent(u).is_some());
            }
            Some(_) => prop_assert!(length.abs() < f64::MIN_POSITIVE),
            None => prop_assert!(!(a..=b).contains(&u)),
        }
    }
    let _ = (
        lines.segment_between(offset, (v, offset)),
        lines.coordinates(x),
    );
    let _ = lines.frame().height(x);
    Ok(())
}

fn x_scale(p: &ConvexPolygon) -> f64 {
    p.vertices()
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f64::max)
}

/// Points that were computed to be on one line are no polygon, at any distance from the origin.
#[test]
fn rounding_gives_no_area() {
    let mut rng = SplitMix64::new(12);
    for k in 0..30_000 {
        let mut v = || vector([0, 1, 2].map(|_| rng.in_range(-1.0, 1.0)));
        let offset = v() * [0.0, 1.0, 1e5][k % 3];
        let (a, b) = (offset + v(), offset + v());
        let t = v().x;
        let on_line = a + (b - a) * t;
        for points in [[a, b, on_line], [on_line, b, a]] {
            assert_eq!(
                ConvexPolygon::new(&points),
                Err(PolygonError::Degenerate),
                "{points:?}"
            );
        }
    }
}

/// A corner that is cut off within the rounding of the corner itself is no polygon, although
/// rounding gives one in twelve of them an area, with edges along its normal.
#[test]
fn cuts_within_rounding_leave_nothing() {
    let (mut rng, mut cuts) = (SplitMix64::new(14), 0);
    for k in 0..9_000 {
        let mut v = || vector([0, 1, 2].map(|_| rng.in_range(-1.0, 1.0)));
        let (a, b) = (v(), v());
        let mut corners = [DVec3::ZERO, a, b];
        corners.rotate_right(k % 3);
        let [a, b, c] = corners;
        let Ok(light) = ConvexPolygon::triangle(a, b, c) else {
            continue;
        };
        let cut = -(a + b + c).normalize();
        let others = light.vertices().iter().filter(|p| cut.dot(**p) < -0.1);
        if others.count() == 2 {
            let by = rng.in_range(0.0, 0.5) * f64::EPSILON;
            let part = light.clip(light.vertices()[k % 3] - cut * by, cut);
            assert!(part.is_none(), "{light:?} {part:?}");
            cuts += 1;
        }
    }
    assert!(cuts > 4_000);
}

/// A quadrilateral that is bent by a part of its size, anywhere in space, and one rounded to `f32`.
#[test]
fn bends_are_told_from_rounding() {
    for scale in [1e-40, 1e-3, 1.0, 1e5, 1e40] {
        for offset in [0.0, 3.0, 1e5] {
            let o = vector([1.0, -0.7, 0.9]) * offset;
            let quad = |bend: f64| {
                [
                    [0.0, 0.0, bend],
                    [1.0, 0.1, 0.0],
                    [1.1, 1.0, bend],
                    [0.0, 0.9, 0.0],
                ]
                .map(|v| (o + vector(v)) * scale)
            };
            for bend in [0.3, 0.02] {
                assert!(
                    matches!(
                        ConvexPolygon::new(&quad(bend)),
                        Err(PolygonError::NotPlanar(_))
                    ),
                    "{bend} at {offset}"
                );
            }
            assert!(ConvexPolygon::new(&quad(0.0)).is_ok());
            // Rounded as in a model file, up to a thousand sizes from the origin.
            #[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
            let rounded = quad(0.0).map(|p| vector(p.to_array().map(|c| f64::from(c as f32))));
            if offset < 1e3 && (1e-30..1e30).contains(&scale) {
                assert!(ConvexPolygon::new(&rounded).is_ok(), "{scale} {offset}");
            }
        }
    }
}

/// A polygon is the same at every scale, to the last bit, or is refused for the same reason.
#[test]
fn scales_are_right_or_refused_with_the_reason() {
    let points = [[-0.5, -0.5, 2.0], [0.5, -0.5, 2.0], [0.0, 0.5, 2.0]].map(vector);
    let one = ConvexPolygon::new(&points).unwrap();
    for e in -466..=466 {
        let scale = 2f64.powi(e);
        match ConvexPolygon::new(&points.map(|p| p * scale)) {
            Ok(p) => {
                assert_eq!(
                    p.area().to_bits(),
                    (one.area() * scale * scale).to_bits(),
                    "2^{e}"
                );
                assert_eq!(p.normal(), one.normal());
                assert!(
                    (p.centroid() - one.centroid() * scale).length() < 4.0 * f64::EPSILON * scale
                );
            }
            Err(PolygonError::TooLarge(0)) => assert!(e >= 200, "2^{e}"),
            Err(PolygonError::TooSmall) => assert!(e < -200, "2^{e}"),
            Err(other) => panic!("2^{e}: {other}"),
        }
    }
    let reason = |p: [f64; 3]| {
        ConvexPolygon::triangle(vector(p), DVec3::X, DVec3::Y)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        reason([1e78, 0.0, 0.0]),
        "vertex 0 has a coordinate beyond 1.6e60"
    );
    let tiny = points.map(|p| p * 1e-100);
    assert_eq!(
        ConvexPolygon::new(&tiny).unwrap_err().to_string(),
        "the polygon is smaller than 6.2e-61"
    );
}
