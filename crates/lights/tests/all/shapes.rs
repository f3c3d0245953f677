//! These tests check shapes as surfaces: outlines, borders and widths, and LTCs on a part of a
//! light.

use super::surfaces::{SLACK, Scene, off};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{
    Cylinder, CylinderView, Disk, Mixture, RegionSampler, SolidAngleSampler, Sphere, Surface,
    VisiblePolygonLtc, around_unit_circle,
};
use linelit_shading::ltc::{LtcLobe, LtcMixture};
use linelit_testkit::cases::{cases, rng};
use std::f64::consts::TAU;

/// The outline is what rays touch, the disk before the sphere has the same cone and touches it,
/// and a triangle that reaches into the sphere is not clear of it.
#[test]
fn outlines_are_tangent() {
    let mut rng = rng(8);
    for _ in 0..cases(400) {
        let Scene { sphere, x, .. } = Scene::new(&mut rng);
        let [outline, before] =
            [sphere.outline(x), sphere.before(x)].map(|d| d.expect("from outside"));
        assert_eq!(outline.normal, before.normal);
        let frame = Frame::from_normal(outline.normal);
        for turn in [0.0, 1.0, 2.5, 4.0] {
            let way = frame.x * f64::cos(turn) + frame.y * f64::sin(turn);
            for disk in [outline, before] {
                let ray = (disk.center + way * disk.radius - x).normalize();
                let distance = ray.cross(sphere.center - x).length();
                assert!(
                    (distance - sphere.radius).abs() <= SLACK,
                    "{distance} for {sphere:?}"
                );
            }
        }
        let height = (before.center - sphere.center).dot(outline.normal);
        assert!((height - sphere.radius).abs() <= SLACK);
        let around = [0.0, 2.0, 4.0].map(|turn: f64| frame.x * turn.cos() + frame.y * turn.sin());
        for (part, clear) in [(1.01, true), (0.99, false), (-0.99, false), (-1.01, true)] {
            let middle = sphere.center + outline.normal * (sphere.radius * part);
            assert_eq!(sphere.is_clear_of(around.map(|way| middle + way)), clear);
        }
        let inside = sphere.center + outline.normal * (0.5 * sphere.radius);
        assert!(sphere.outline(inside).is_none() && sphere.before(inside).is_none());
        let border = Surface::Sphere(&sphere).border(x, inside, |_| 0.0);
        assert_eq!(border.to_bits(), 1_f64.to_bits());
    }
}

/// The polygon around a disk touches it in the middle of its edges, 1e-9 of the radius off, and
/// turns as the one around the unit circle.
#[test]
fn polygons_around_disks_touch_them() {
    let mut rng = rng(9);
    let unit = around_unit_circle();
    for _ in 0..cases(400) {
        let Scene { disk, .. } = Scene::new(&mut rng);
        let frame = Frame::from_normal(disk.normal);
        let corners = disk.around();
        for k in 0..Disk::CORNERS {
            let (corner, next) = (corners[k], corners[(k + 1) % Disk::CORNERS]);
            let middle = disk.center.distance(0.5 * (corner + next)) / disk.radius;
            assert!(
                (middle - 1.0 - 1e-9).abs() <= SLACK / disk.radius,
                "{middle}"
            );
            let [p, q] = unit[k];
            let same = disk.center + (frame.x * p + frame.y * q) * disk.radius;
            assert!(corner.distance(same) <= SLACK);
        }
    }
}

/// Half the width of a rectangle, a disk and a sphere, and of what is seen of a cylinder; and the
/// borders that a point on the light is this and that far from.
#[test]
fn borders_are_where_they_are() {
    let x = DVec3::new(0.0, 0.0, -3.0);
    let quad = ConvexPolygon::parallelogram(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let sphere = Sphere {
        center: DVec3::ZERO,
        radius: 1.5,
    };
    let disk = Disk {
        center: DVec3::ZERO,
        normal: DVec3::Z,
        radius: 0.5,
    };
    let axis = Segment::new(DVec3::ZERO, DVec3::X * 4.0);
    let view = CylinderView::new(&Cylinder { axis, radius: 1.5 }, x).expect("from outside");
    // Of a sphere or a cylinder half as wide as far away, the rim is at 60°, or 30° off the axis.
    let rim = 1.5 * (0.75_f64).sqrt();
    let nearest = DVec3::Z * -1.5;
    let cases = [
        (
            Surface::Polygon(&quad),
            0.5,
            DVec3::new(0.5, 0.25, 0.0),
            0.5 * 1.5 * 0.25 * 0.75,
        ),
        (Surface::Disk(&disk), 0.5, DVec3::new(0.3, 0.0, 0.0), 0.2),
        (Surface::Sphere(&sphere), 1.5, nearest, rim),
        (
            Surface::Cylinder(&view),
            rim,
            nearest + DVec3::X,
            3.0 * 1.5 * TAU / 6.0,
        ),
    ];
    for (surface, half, point, border) in cases {
        assert!((surface.half_width() - half).abs() <= SLACK, "{surface:?}");
        let got = surface.border(point, x, |distance| distance);
        assert!((got - border).abs() <= SLACK, "{got} {surface:?}");
        let flat = matches!(surface, Surface::Polygon(_) | Surface::Disk(_));
        assert_eq!(surface.flat(), flat.then(|| surface.normal(point)));
    }
    // On the sphere's rim as it is seen, 60° off.
    let seen = DVec3::new(rim, 0.0, -0.75);
    assert!(
        Surface::Sphere(&sphere)
            .border(seen, x, |distance| distance)
            .abs()
            <= SLACK
    );
}

/// Samples by LTCs on a part of a light lie on this part, and reach all of it.
#[test]
fn lobes_on_a_part_see_all_of_it() {
    let mut rng = rng(10);
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X * 2.0, DVec3::Y).expect("a quad");
    let x = DVec3::new(0.4, 0.3, 0.0);
    let frame = Frame::from_normal(DVec3::new(0.6, 0.0, 0.8));
    let mut cosines = LtcMixture::new(frame, DVec3::splat(0.3));
    for width in [0.3, 0.6] {
        let map = DMat3::from_diagonal(DVec3::new(width, width, 1.0));
        let albedo = DVec3::splat(0.2);
        cosines.add(LtcLobe { map, albedo });
    }
    // What is beyond a line through two edges.
    let corners = [[0.25, 0.0], [1.0, 0.0], [1.0, 1.0], [0.75, 1.0]];
    let part = ConvexPolygon::new(&corners.map(|[p, q]| DVec3::new(2.0 * p, q, 1.0)));
    let part = part.expect("a part");
    let mut region = RegionSampler::default();
    let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]);
    region.set([DVec3::Z, DVec3::X * 2.0, DVec3::Y], sides);
    let lobes: Mixture<_, _> =
        VisiblePolygonLtc::within(&region, &quad, x, &cosines, &[0.1, 0.2, 0.15]);
    let (count, mut drawn, mut sum, mut squares) = (100_000, 0, 0.0, 0.0);
    for _ in 0..count {
        let u = [rng.next_f64(), rng.next_f64()];
        if let Some((at, density)) = lobes.draw(u, &quad, x) {
            let error = off(&Surface::Polygon(&part), at.point);
            assert!(error <= SLACK, "{error} {at:?}");
            drawn += 1;
            sum += 1.0 / density;
            squares += 1.0 / (density * density);
        }
    }
    let n = f64::from(count);
    let error = (squares / n - (sum / n) * (sum / n)).sqrt() / n.sqrt();
    let want = SolidAngleSampler::new(&part, x).solid_angle();
    // Once in two millions of such tests.
    assert!(
        (sum / n - want).abs() < 5.0 * error,
        "{} ± {error} for {want}",
        sum / n
    );
    assert!(drawn < count && error < 0.01 * want);
}
