//! Techniques with floats that attack them in any argument: none panics, densities are finite and
//! not negative, numbers given back lie in [0, 1), and what is drawn with a positive density lies
//! on the light.

use linelit_geometry::{DMat3, DVec3, Segment, intervals::Interval};
use linelit_lights::{
    ChordMeasure, Cylinder, CylinderArea, CylinderLines, CylinderView, Disk, DiskArea, DiskChords,
    DiskCone, Measure, Pdf, PointSample, PointTechnique, Sphere, SphereCap, SphereCone,
    SphereProjected, TransformedCone,
};
use linelit_testkit::strategies::{hostile, hostile_direction, hostile_unit, hostile_vectors};
use proptest::prelude::*;
use std::f64::consts::TAU;

type Check = Result<(), TestCaseError>;

fn v(p: [f64; 3]) -> DVec3 {
    DVec3::from(p)
}

/// A density: finite and not negative.
fn density<M: Measure>(p: Pdf<M>) -> Check {
    prop_assert!(p.value() >= 0.0 && p.value().is_finite(), "{p:?}");
    Ok(())
}

fn numbers(u: Option<[f64; 2]>) -> Check {
    prop_assert!(
        u.is_none_or(|u| u.iter().all(|u| (0.0..1.0).contains(u))),
        "{u:?}"
    );
    Ok(())
}

/// On the sphere, to the rounding of its coordinates.
fn on_sphere<M: Measure>(s: PointSample<M>, sphere: &Sphere) -> Check {
    density(s.pdf)?;
    if s.pdf.is_positive() {
        // In radii: their squares need not be numbers.
        let slack =
            64.0 * f64::EPSILON * (sphere.center.abs().max_element() / sphere.radius.abs() + 1.0)
                + 1e-323 / sphere.radius.abs();
        let off = ((s.point - sphere.center) / sphere.radius).length() - 1.0;
        prop_assert!(
            s.point.is_finite() && off.abs() <= slack,
            "{s:?} {sphere:?} {off}"
        );
    }
    Ok(())
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        max_local_rejects: 10_000_000,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(cases(4_000))]

    #[test]
    fn spheres(places in hostile_vectors::<3>(), radius in hostile(), n in hostile_direction(), u in [hostile_unit(), hostile_unit()]) {
        let [center, x, q] = places.map(v);
        let sphere = Sphere { center, radius };
        for cap in [SphereCap::visible(&sphere, x), SphereCap::whole(&sphere)] {
            let s = cap.sample(u);
            on_sphere(s, &sphere)?;
            density(cap.pdf(q))?;
            numbers(cap.invert(q))?;
            numbers(cap.invert(s.point))?;
        }
        let cone = SphereCone::new(&sphere, x);
        prop_assert!(cone.solid_angle().is_nan() || (0.0..=2.0 * TAU).contains(&cone.solid_angle()), "{}", cone.solid_angle());
        let s = cone.sample(u);
        on_sphere(s, &sphere)?;
        density(cone.pdf(q))?;
        numbers(cone.invert(q))?;
        numbers(cone.invert(s.point))?;
        if let Some(projected) = SphereProjected::new(&sphere, x, v(n)) {
            prop_assert!(projected.projected_solid_angle() > 0.0 && projected.projected_solid_angle().is_finite());
            let s = projected.sample(u);
            on_sphere(s, &sphere)?;
            density(projected.pdf(q))?;
            numbers(projected.invert(q))?;
            numbers(projected.invert(s.point))?;
        }
    }

    #[test]
    fn disks(places in hostile_vectors::<3>(), radius in hostile(), n in hostile_direction(), u in [hostile_unit(), hostile_unit()]) {
        let [center, x, q] = places.map(v);
        let disk = Disk { center, normal: v(n), radius };
        let by_area = DiskArea::new(&disk);
        let s = by_area.sample(u);
        density(s.pdf)?;
        density(by_area.pdf(q))?;
        let columns = places.map(v);
        let map = DMat3::from_cols(columns[0], columns[1], columns[2]);
        for map in [map, DMat3::IDENTITY] {
            if let Some(image) = TransformedCone::new(&disk, x, map) {
                prop_assert!((0.0..=1.0).contains(&image.about_integral()), "{}", image.about_integral());
                prop_assert!((0.0..=1.0).contains(&image.coverage()), "{}", image.coverage());
                let (direction, pdf) = image.sample(u);
                density(pdf)?;
                density(image.pdf(direction))?;
                density(image.pdf(v(n)))?;
                numbers(Some(image.invert(direction)))?;
                numbers(Some(image.invert(v(n))))?;
            }
        }
        let cone = DiskCone::new(&disk, x);
        density(cone.sample(u).pdf)?;
        density(cone.pdf(q))?;
        for at in [q, s.point, cone.sample(u).point] {
            numbers(cone.invert(at))?;
            numbers(by_area.invert(at))?;
        }
        // A normal as the disk's own domain wants it.
        if (disk.normal.length() - 1.0).abs() <= 4.0 * f64::EPSILON {
            for (point, drawn) in [(s.point, s.pdf.is_positive()), (cone.sample(u).point, cone.sample(u).pdf.is_positive())] {
                let slack = 64.0 * f64::EPSILON * (center.abs().max_element() + radius.abs());
                let off = point - center;
                let inside = point.is_finite() && linelit_geometry::predicates::length(off) <= radius.abs() + slack && off.dot(disk.normal).abs() <= slack;
                prop_assert!(inside || !drawn, "{point} {disk:?} from {x}");
            }
        }
    }

    #[test]
    fn chords(
        places in hostile_vectors::<3>(), radius in hostile(), n in hostile_direction(), horizons in [hostile_direction(), hostile_direction()],
        angle in hostile(), u in [hostile_unit(), hostile_unit()],
    ) {
        let [center, x, q] = places.map(v);
        let disk = Disk { center, normal: v(n), radius };
        let irradiance = DiskCone::new(&disk, x).vector_irradiance().length();
        // Of a normal as the disk's own domain wants it, half a sphere's at most.
        if (disk.normal.length() - 1.0).abs() <= 4.0 * f64::EPSILON {
            prop_assert!(irradiance <= 0.5 * TAU + 1e-9, "{irradiance}");
        }
        let chords = DiskChords::new(&disk, angle, x, &horizons.map(v));
        let s = chords.sample(u);
        density(s.pdf)?;
        density(chords.pdf(q))?;
        numbers(chords.invert(q))?;
        numbers(chords.invert(s.point))?;
    }

    #[test]
    fn cylinders(
        places in hostile_vectors::<4>(), radius in hostile(), horizons in [hostile_direction(), hostile_direction()], offset in hostile(),
        u in [hostile_unit(), hostile_unit()], ends in [hostile_unit(), hostile_unit()],
    ) {
        let [p0, p1, x, q] = places.map(v);
        let cylinder = Cylinder { axis: Segment::new(p0, p1), radius };
        for by_area in [CylinderArea::whole(&cylinder), CylinderArea::visible(&cylinder, x)] {
            let s = by_area.sample(u);
            density(s.pdf)?;
            density(by_area.pdf(q))?;
            numbers(by_area.invert(q))?;
            numbers(by_area.invert(s.point))?;
        }
        let visible = [Interval::new(ends[0], ends[1])];
        let measures = [ChordMeasure::Uniform, ChordMeasure::Length, ChordMeasure::SolidAngle, ChordMeasure::Projected];
        let all = measures.map(|m| CylinderLines::new(&cylinder, x, &horizons.map(v), m)).into_iter();
        let view = CylinderView::new(&cylinder, x);
        let of_views = view.iter().flat_map(|view| measures.map(|m| CylinderLines::of(view, &[], m)));
        for lines in all.chain(of_views) {
            let line = lines.sample(u[0]);
            density(line.pdf)?;
            density(lines.offset_pdf(offset))?;
            density(lines.point(&line, &visible, u[1]).pdf)?;
            density(lines.joint_pdf(q, &visible))?;
            let _ = (lines.direction(), lines.through(q), lines.height(&line));
            let s = PointTechnique::sample(&lines, u);
            density(s.pdf)?;
            density(PointTechnique::pdf(&lines, q))?;
            numbers(lines.invert(q))?;
            numbers(lines.invert(s.point))?;
            numbers(lines.invert_offset(offset).map(|u| [u, 0.0]))?;
        }
        if let Some(view) = view {
            prop_assert!(view.cylinder() == &cylinder && view.position() == x);
            prop_assert!((0.0..=0.25 * TAU).contains(&view.half_turn()) && !view.azimuth(q).is_infinite());
            prop_assert!((view.towards().length() - 1.0).abs() < 1e-12);
            prop_assert!(view.vector_irradiance().is_finite());
            let _ = (view.normal(q), view.meets(v(horizons[0])), view.heights(v(horizons[1])), view.across(q));
            let _ = (view.outline(), view.front(), view.onto_outline(&Segment::new(q, p0)), view.is_clear_of([q, p0, x]));
        }
    }

    /// Points in the plane of a disk to rounding, in it and outside.
    #[test]
    fn disks_edge_on(
        center in hostile_vectors::<1>(), n in hostile_direction(), radius in 0.01..2.0f64, way in 0.0..4.0f64, turn in 0.0..7.0f64,
        height in prop_oneof![Just(0.0), -1e-15..1e-15f64, (-320..-10_i32).prop_map(|e| 10f64.powi(e))],
        u in [hostile_unit(), hostile_unit()],
    ) {
        let Some(normal) = linelit_geometry::predicates::normalize(v(n)) else {
            return Ok(());
        };
        let center = v(center[0].map(|c| if c.abs() < 1e3 { c } else { 0.5 }));
        let f = linelit_geometry::Frame::from_normal(normal);
        let disk = Disk { center, normal, radius };
        let x = center + (f.x * turn.cos() + f.y * turn.sin()) * way + normal * height;
        let cone = DiskCone::new(&disk, x);
        let s = cone.sample(u);
        density(s.pdf)?;
        if s.pdf.is_positive() {
            // No cone is smaller than its width times what is left of its height.
            prop_assert!((s.point - center).length() <= radius * (1.0 + 64.0 * f64::EPSILON) + 64.0 * f64::EPSILON * center.length());
            let solid_angle = 1.0 / s.pdf.value();
            prop_assert!(solid_angle <= TAU * 1.02, "{solid_angle}");
            prop_assert!(cone.pdf(s.point).is_positive() || solid_angle < 1e-13, "{s:?}");
        }
    }
}

/// Outside a disk, in its plane to rounding.
#[test]
fn a_disk_edge_on_is_dark() {
    let disk = Disk {
        center: DVec3::new(
            0.066_815_462_330_273_69,
            0.824_716_233_504_868_8,
            0.187_754_070_351_639_6,
        ),
        normal: DVec3::new(
            0.908_517_389_379_443_9,
            -0.132_335_373_204_215_65,
            -0.396_337_611_379_577_2,
        ),
        radius: 0.160_459_697_283_262_48,
    };
    let x = DVec3::new(
        -0.048_051_504_463_349_395,
        0.336_987_332_858_674_77,
        0.087_297_162_996_333_9,
    );
    let cone = DiskCone::new(&disk, x);
    let s = cone.sample([0.022_187_126_407_314_794, 0.315_242_341_930_640_93]);
    assert!(!s.pdf.is_positive() && s.point.is_finite());
    assert!(!cone.pdf(disk.center).is_positive());
}

/// Radii near the ends of the range: densities and round trips, not ∞ or NaN.
#[test]
fn cones_keep_their_digits_at_any_scale() {
    for scale in [1e-300, 1e-170, 1.0, 1e170, 1e300] {
        let sphere = Sphere {
            center: DVec3::new(0.0, 0.0, 4.0) * scale,
            radius: scale,
        };
        let cone = SphereCone::new(&sphere, DVec3::ZERO);
        let s = cone.sample([0.3, 0.6]);
        let [a, b] = cone.invert(s.point).unwrap();
        assert!(
            (a - 0.3).abs() < 1e-14 && (b - 0.6).abs() < 1e-14,
            "{scale}"
        );
        assert!(s.pdf.is_positive());
    }
}
