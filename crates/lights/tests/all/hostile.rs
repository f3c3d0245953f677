//! These tests call every public function with hostile floats in any argument (round lights and
//! surfaces have files of their own): none panics, densities are finite and not negative, random
//! numbers that are returned lie in [0, 1), and points that are drawn with a positive density lie
//! on the light.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::linear::{
    ArcPoint, LineView, LinearSample, LinearSampler, LinearTechnique, LtcSampler, ProjectedLine,
    SegmentLtc, ThinLine,
};
use linelit_lights::{
    AngularLines, Area, AreaLight, AreaSampler, Cylinder, CylinderLight, Disk, DiskLight, Emission,
    ImportanceImage, Length, Light, LineSample, LineSampler, LineTechnique, LinearLight,
    LinearPointTechnique, Measure, Offset, OffsetDensity, Pdf, Pieces, PointColumns, PointSample,
    PointTechnique, PointsOnLines, ProxySampler, RegionSampler, SolidAngle, SolidAngleSampler,
    Sphere, SphereLight, TextureAxis, TexturedLines, TexturedSampler, ThinSolidAngle,
    TransformedSampler, Width, sample_linear,
};
use linelit_shading::ltc::{LtcLobe, LtcMixture};
use linelit_testkit::public;
use linelit_testkit::strategies::{
    hostile, hostile_direction, hostile_unit, hostile_vector, hostile_vectors,
};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};
use std::path::Path;

#[test]
fn every_public_function_is_called_with_hostile_numbers() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let tests = concat!(
        include_str!("constructed.rs"),
        include_str!("environments.rs"),
        include_str!("hostile.rs"),
        include_str!("octahedral.rs"),
        include_str!("profiles.rs"),
        include_str!("round/hostile.rs"),
        include_str!("shapes.rs"),
        include_str!("skies.rs"),
        include_str!("spaces.rs"),
        include_str!("surfaces.rs")
    );
    // `Random` hands on what techniques give, and points by a texture are made by `PointSource`.
    let missing = public::missing(&src, tests, &["Random", "TexturedPoints"]);
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

type Check = Result<(), TestCaseError>;

fn v(p: [f64; 3]) -> DVec3 {
    DVec3::from(p)
}

/// A density: finite and not negative.
fn density<M: Measure>(p: Pdf<M>) -> Check {
    prop_assert!(
        p.value() >= 0.0 && p.value().is_finite(),
        "{p:?} {}",
        M::UNIT
    );
    prop_assert_eq!(p.is_positive(), p.value() > 0.0);
    Ok(())
}

fn numbers<const N: usize>(u: Option<[f64; N]>) -> Check {
    prop_assert!(
        u.is_none_or(|u| u.iter().all(|u| (0.0..1.0).contains(u))),
        "{u:?}"
    );
    Ok(())
}

/// Numbers of [0, 1] that add up to at most so much.
fn share(x: f64, most: f64) -> Check {
    prop_assert!(x >= 0.0 && x <= most, "{x} of {most}");
    Ok(())
}

/// A sample of positive density lies within the box of the polygon and in its plane, to 64 ε of its
/// coordinates: points are interpolated between vertices, or placed in a frame with its origin at
/// one.
fn on_polygon<M: Measure>(s: PointSample<M>, p: &Shape) -> Check {
    density(s.pdf)?;
    if s.pdf.is_positive() {
        prop_assert!(is_on(s.point, p), "{s:?} {p:?}");
    }
    Ok(())
}

fn is_on(point: DVec3, Shape { polygon: p, scale }: &Shape) -> bool {
    let (lo, hi) = p
        .vertices()
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| {
            (lo.min(*v), hi.max(*v))
        });
    let slack = 64.0 * f64::EPSILON * scale;
    point.is_finite()
        && (0..3).all(|k| point[k] >= lo[k] - slack && point[k] <= hi[k] + slack)
        && p.normal().dot(point - p.vertices()[0]).abs() <= slack
}

/// A polygon, and the size to which its coordinates are rounded: the size of the whole of which it
/// is a part.
#[derive(Clone, Debug)]
struct Shape {
    polygon: ConvexPolygon,
    scale: f64,
}

/// A polygon from hostile corners, its whole or what a plane leaves of it.
fn polygon() -> impl Strategy<Value = Shape> {
    let ordinary = (
        hostile_vectors::<3>(),
        any::<bool>(),
        hostile_vector(),
        hostile_direction(),
    );
    ordinary.prop_filter_map("no polygon", |(corners, four, x, n)| {
        let [a, b, c] = corners.map(v);
        let whole = if four {
            ConvexPolygon::parallelogram(a, b, c).ok()?
        } else {
            ConvexPolygon::triangle(a, b, c).ok()?
        };
        let largest = whole.vertices().iter().map(|v| v.abs().max_element());
        Some(Shape {
            polygon: whole.clip(v(x), v(n)).unwrap_or(whole),
            scale: largest.fold(whole.diameter(), f64::max),
        })
    })
}

/// Points side by side are those one by one, to the bit.
fn in_columns(technique: &impl PointTechnique, u: [f64; 2]) -> Check {
    let all = [u, [u[1], u[0]], [u[0], 0.5]];
    let of = |k: usize| [std::array::from_fn(|i| all[i % 3][k])];
    let [mut x, mut y, mut z, mut pdf] = [[[0.0; 8]]; 4];
    let out = PointColumns {
        point: [&mut x, &mut y, &mut z],
        pdf: &mut pdf,
    };
    technique.sample_into([&of(0), &of(1)], out);
    for i in 0..8 {
        let (want, got) = (technique.sample(all[i % 3]), [x[0][i], y[0][i], z[0][i]]);
        prop_assert_eq!(want.pdf.value().to_bits(), pdf[0][i].to_bits());
        let want = want.point.to_array();
        prop_assert_eq!(want.map(f64::to_bits), got.map(f64::to_bits), "{:?}", want);
    }
    Ok(())
}

fn parts() -> impl Strategy<Value = Vec<Interval>> {
    let part = [hostile_unit(), hostile_unit()].prop_map(|[a, b]| Interval::new(a, b));
    prop::collection::vec(part, 0..3)
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        max_local_rejects: 10_000_000,
        ..ProptestConfig::default()
    }
}

/// A line technique with hostile numbers, and the point technique it makes.
fn on_lines<T: LineTechnique + Copy>(
    lines: &T,
    shape: &Shape,
    u: [f64; 2],
    visible: &[Interval],
    offset: f64,
    q: DVec3,
) -> Check {
    let (a, b) = lines.lines().range();
    let line = lines.sample(u[0]);
    on_line(&line, shape)?;
    for parts in [visible, &[Interval::UNIT]] {
        let s = lines.point(&line, parts, u[1]);
        on_polygon(s, shape)?;
        for at in [q, s.point] {
            density(lines.joint_pdf(at, parts))?;
            numbers(lines.invert_point(at, parts))?;
        }
    }
    for at in [offset, a, b, line.offset] {
        density(lines.pdf(at))?;
        numbers(lines.invert(at).map(|u| [u]))?;
    }
    let points = PointsOnLines(*lines);
    let s = points.sample(u);
    on_polygon(s, shape)?;
    density(points.pdf(s.point))?;
    numbers(points.invert(q))
}

proptest! {
    #![proptest_config(cases(1_500))]

    #[test]
    fn points_of_polygons(shape in polygon(), x in hostile_vector(), u in [hostile_unit(), hostile_unit()], q in hostile_vector()) {
        let p = shape.polygon;
        let (x, q) = (v(x), v(q));
        let by_area = AreaSampler::new(&p);
        on_polygon(by_area.sample(u), &shape)?;
        in_columns(&by_area, u)?;
        density(by_area.pdf(q))?;
        let by_angle = SolidAngleSampler::new(&p, x);
        share(by_angle.solid_angle(), TAU)?;
        on_polygon(by_angle.sample(u), &shape)?;
        in_columns(&by_angle, u)?;
        density(by_angle.pdf(q))?;
        let proxy = ProxySampler::new(&p, x);
        on_polygon(proxy.sample(u), &shape)?;
        in_columns(&proxy, u)?;
        density(proxy.pdf(q))?;
        let map = DMat3::from_cols(q, x.cross(q), DVec3::new(u[0], u[1], x.z));
        for map in [DMat3::IDENTITY, map] {
            if let Some(mapped) = TransformedSampler::new(&p, x, map) {
                // Corners cut at the horizon are rounded, each coordinate once or twice.
                let image = mapped.image().vertices();
                let size = image.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
                prop_assert!(image.iter().all(|v| v.z >= -8.0 * f64::EPSILON * size));
                let sample = mapped.sample(u);
                prop_assert!(sample.point.is_finite());
                density(sample.pdf)?;
                density(mapped.pdf(q))?;
                numbers(mapped.invert(q))?;
            }
        }
        for at in [q, by_area.sample(u).point] {
            numbers(by_area.invert(at))?;
            numbers(by_angle.invert(at))?;
            numbers(proxy.invert(at))?;
        }
    }

    #[test]
    fn lines_of_polygons(
        shape in polygon(), angle in prop_oneof![-7.0..7.0f64, hostile()], u in [hostile_unit(), hostile_unit()],
        visible in parts(), offset in hostile(), q in hostile_vector(),
    ) {
        let p = shape.polygon;
        for by in [OffsetDensity::Uniform, OffsetDensity::Length] {
            let lines = LineSampler::new(&p, angle, by);
            on_lines(&lines, &shape, u, &visible, offset, v(q))?;
        }
    }

    #[test]
    fn lines_from_corners(
        shape in polygon(), corner in 0..9_usize, u in [hostile_unit(), hostile_unit()], visible in parts(), q in hostile_vector(),
    ) {
        let polygon = shape.polygon.starting_at(corner);
        let fan = AreaSampler::by_fan(&polygon);
        let line = fan.line(u[0]);
        prop_assert!(is_on(line.p0, &shape) && is_on(line.p1, &shape), "{line:?}");
        on_polygon(fan.sample(u), &shape)?;
        numbers(fan.invert(v(q)))?;
        for width in [Width::Even, Width::Growing] {
            let (t, total) = width.place(&visible, u[1]);
            prop_assert!((0.0..=1.0).contains(&t) && (0.0..=visible.len() as f64).contains(&total), "{t} {total}");
        }
    }

    #[test]
    fn lines_by_angle(
        shape in polygon(), angle in prop_oneof![-7.0..7.0f64, hostile()], x in hostile_vector(), n in hostile_direction(),
        u in [hostile_unit(), hostile_unit()], visible in parts(), offset in hostile(), q in hostile_vector(),
    ) {
        let p = shape.polygon;
        let (x, n) = (v(x), v(n));
        for lines in [
            AngularLines::by_solid_angle(&p, angle, x),
            AngularLines::by_warped_solid_angle(&p, angle, x),
            AngularLines::by_projected_solid_angle(&p, angle, x, n),
        ] {
            prop_assert!(lines.total() >= 0.0 && lines.total().is_finite());
            on_lines(&lines, &shape, u, &visible, offset, v(q))?;
            let _ = (lines.locate(v(q)), lines.locate(lines.sample(u[0]).segment.p0));
        }
    }

    /// Of boundaries that are none.
    #[test]
    fn regions(
        plane in hostile_vectors::<3>(),
        sides in prop::collection::vec([[hostile(), hostile()], [hostile(), hostile()]], 0..30),
        u in [hostile_unit(), hostile_unit()],
        q in hostile_vector(),
    ) {
        let mut region = RegionSampler::default();
        for plane in [plane.map(v), [DVec3::ZERO, DVec3::X, DVec3::Y]] {
            region.set(plane, sides.iter().copied());
            prop_assert!(region.area() >= 0.0 && region.area().is_finite());
            density(region.density())?;
            let sample = region.sample(u);
            density(sample.pdf)?;
            prop_assert!(!sample.pdf.is_positive() || sample.point.is_finite());
            in_columns(&region, u)?;
            for at in [v(q), sample.point] {
                density(region.pdf(at))?;
                numbers(region.invert(at))?;
                prop_assert!(region.holds(at) || !region.pdf(at).is_positive());
            }
        }
    }

    #[test]
    fn pictures(
        values in prop::collection::vec(hostile().prop_map(f64::abs), 6), shape in polygon(),
        u in [hostile_unit(), hostile_unit()], at in [hostile(), hostile()], angle in prop_oneof![-7.0..7.0f64, hostile()],
        visible in parts(), q in hostile_vector(),
    ) {
        let p = shape.polygon;
        let finite: Vec<f64> = values.iter().map(|x| if x.is_finite() { *x } else { 0.0 }).collect();
        let positive = finite.iter().any(|x| *x > 0.0);
        prop_assert_eq!(ImportanceImage::new(3, 2, &values).is_some(), positive && values == finite);
        let Some(image) = ImportanceImage::new(3, 2, &finite) else {
            return Ok(());
        };
        prop_assert_eq!(image.size(), (3, 2));
        let inside = |x: f64| (0.0..1.0).contains(&x);
        let pixel_density = |x: f64| (0.0..=6.0 * (1.0 + 8.0 * f64::EPSILON)).contains(&x);
        let uv = image.sample(u);
        prop_assert!(uv.iter().all(|x| inside(*x)) && image.density(uv) > 0.0);
        for at in [at, uv] {
            prop_assert!(pixel_density(image.density(at)));
            numbers(image.invert(at))?;
        }
        let Some(texture) = TexturedSampler::new(&p, &image) else {
            return Ok(());
        };
        on_polygon(texture.sample(u), &shape)?;
        density(texture.pdf(v(q)))?;
        numbers(texture.invert(v(q)))?;
        let _ = texture.coordinates(v(q));
        let all = [TexturedLines::new(&p, &image, angle), TexturedLines::along(&p, &image, TextureAxis::U), TexturedLines::along(&p, &image, TextureAxis::V)];
        prop_assert!(all[0].is_some() == angle.is_finite() && all[1].is_some() && all[2].is_some());
        for lines in all.iter().flatten() {
            let (a, b) = lines.lines().range();
            let line = lines.sample(u[0]);
            on_line(&line, &shape)?;
            let s = lines.point(&line, &visible, u[1]);
            on_polygon(s, &shape)?;
            for place in [at[0], a, b, line.offset] {
                density(lines.pdf(place))?;
                numbers(lines.invert(place).map(|u| [u]))?;
            }
            for place in [v(q), s.point] {
                density(lines.joint_pdf(place, &visible))?;
                numbers(lines.invert_point(place, &visible))?;
            }
        }
    }
}

fn on_line(line: &LineSample, p: &Shape) -> Check {
    density(line.pdf)?;
    if line.pdf.is_positive() {
        prop_assert!(
            is_on(line.segment.p0, p) && is_on(line.segment.p1, p),
            "{line:?} {p:?}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(4_000))]

    #[test]
    fn pieces_and_shapes(weights in prop::collection::vec(hostile(), 0..30), [u, place] in [hostile_unit(), hostile_unit()], [w0, w1] in [hostile(), hostile()], at in hostile_vectors::<2>()) {
        let pieces = Pieces::new(weights.iter().copied());
        let (piece, within) = pieces.pick(u);
        share(within, 1.0)?;
        prop_assert!(piece < 23 && pieces.total() >= 0.0);
        prop_assert!(!pieces.is_usable() || weights[piece] > 0.0);
        numbers(Some([pieces.unpick(piece, place), pieces.unpick(usize::MAX, place)]))?;
        let [w0, w1] = [w0, w1].map(f64::abs);
        if w0 < 1e150 && w1 < 1e150 {
            share(sample_linear(linelit_geometry::finite::fraction(u), w0, w1), 1.0)?;
        }
        let [center, q] = at.map(v);
        let sphere = Sphere { center, radius: w0 };
        prop_assert!(sphere.area() >= 0.0 && sphere.area().is_finite());
        let normal = sphere.normal(q);
        prop_assert!(normal == DVec3::ZERO || (normal.length() - 1.0).abs() <= 4.0 * f64::EPSILON);
        let disk = Disk { center, normal: q, radius: w0 };
        prop_assert!(disk.area() >= 0.0 && disk.area().is_finite());
        let cylinder = Cylinder { axis: Segment::new(center, q), radius: w0 };
        prop_assert!(cylinder.area() >= 0.0 && cylinder.area().is_finite());
        let normal = cylinder.normal(q);
        prop_assert!(normal == DVec3::ZERO || (normal.length() - 1.0).abs() <= 4.0 * f64::EPSILON);
        for s in [PointSample::<Area>::at(q, Pdf::new(w1)), PointSample::none(q)] {
            prop_assert!(q.is_finite() || !s.pdf.is_positive());
        }
    }

    #[test]
    fn linear_lights(
        places in hostile_vectors::<3>(), n in hostile_direction(), u in hostile_unit(), t in hostile_unit(), m in hostile_vectors::<3>(),
    ) {
        let [p0, p1, x] = places.map(v);
        let (light, n) = (Segment::new(p0, p1), v(n));
        let sound = |s: &LinearSample| -> Check {
            density(s.pdf)?;
            if s.pdf.is_positive() {
                share(s.t, 1.0)?;
                prop_assert!(s.offset.is_finite() && s.direction.is_finite(), "{s:?}");
            }
            Ok(())
        };
        let set_up = LinearTechnique::ALL.map(|technique| (technique.name(), LinearSampler::new(technique, &light, x, n)));
        for (name, sampler) in &set_up {
            let Some(sampler) = sampler else { continue };
            sound(&sampler.sample(u)).map_err(|e| TestCaseError::fail(format!("{name}: {e}")))?;
            let mut out = [LinearSample::default(); 3];
            sampler.sample_into(&[u, t, 0.5], &mut out);
            out.iter().try_for_each(sound)?;
            density(sampler.pdf(t))?;
            numbers(sampler.invert(t).map(|u| [u]))?;
            prop_assert!(sampler.irradiance().is_none_or(|e| e >= 0.0 && e.is_finite()), "{name}");
            let _ = sampler.view();
        }
        let matrix = DMat3::from_cols(v(m[0]), v(m[1]), v(m[2]));
        if let Some(ltc) = LtcSampler::new(&light, x, n, matrix) {
            prop_assert!(ltc.integral() > 0.0 && ltc.integral().is_finite());
            sound(&ltc.sample(u))?;
            density(ltc.pdf(t))?;
            numbers(ltc.invert(t).map(|u| [u]))?;
        }
        let mut cosines = LtcMixture::new(Frame::from_normal(n), x);
        for (map, albedo) in [(matrix, p0.abs()), (matrix.inverse(), DVec3::ONE)] {
            cosines.add(LtcLobe { map, albedo });
        }
        if let Some(lobes) = SegmentLtc::new(&light, x, n, &cosines) {
            prop_assert!(lobes.reflected.is_finite());
            sound(&lobes.sample(u))?;
            density(lobes.pdf(t))?;
        }
    }

    #[test]
    fn kernels(p in hostile_vectors::<3>(), u in hostile_unit(), t in hostile_unit(), steps in 0..6_u32) {
        kernel(p.map(v), u, t, steps)?;
    }

    #[test]
    fn plain_data(n in [hostile(), hostile(), hostile(), hostile()], places in hostile_vectors::<3>(), shape in polygon()) {
        let p = shape.polygon;
        let [a, b, c, d] = n;
        let area = Pdf::<Area>::new(a);
        density(area)?;
        density(area.scaled(b))?;
        density(area.to_solid_angle(b, c))?;
        let solid = Pdf::<SolidAngle>::new(b);
        density(solid.to_area(c, d))?;
        density(Pdf::<Offset>::new(a).joint(Pdf::<Length>::new(b)))?;
        density(Pdf::<Length>::new(a).to_thin_solid_angle(b, c))?;
        density(Pdf::<ThinSolidAngle>::new(a).to_length(b, c))?;
        let [x, y, z] = places.map(v);
        let one = Emission::one_sided(x);
        let two = Emission { two_sided: true, ..one };
        let _ = (one.towards(a), two.towards(a));
        let disk = Disk { center: y, normal: z, radius: d };
        let lights = [
            Light::Area(AreaLight { polygon: p, emission: two }),
            Light::Linear(LinearLight { segment: Segment::new(y, z), radiance_radius: x }),
            Light::Sphere(SphereLight { sphere: Sphere { center: y, radius: d }, radiance: x }),
            Light::Disk(DiskLight { disk, emission: one }),
            Light::Cylinder(CylinderLight { cylinder: Cylinder { axis: Segment::new(y, z), radius: d }, radiance: x }),
        ];
        for light in lights {
            prop_assert!(light.power() >= 0.0 && light.power().is_finite(), "{light:?}");
            let _ = light.emission();
        }
        let _ = AreaLight { polygon: p, emission: one }.faces(y, d);
    }
}

/// The kernels of lines.
fn kernel([p0, p1, n]: [DVec3; 3], u: f64, t: f64, steps: u32) -> Check {
    let not_negative = |x: f64| x.is_finite() && x >= 0.0;
    let unit = |x: f64| not_negative(x) && x <= 1.0;
    let place = |a: &ArcPoint| {
        unit(a.lambda) && unit(a.rest) && a.direction.is_finite() && a.point.is_finite()
    };
    let edge = p1 - p0;
    let views = [
        LineView::new(p0, p1),
        LineView::clipped(p0, p1, n),
        LineView::with_edge(p0, p1, edge, Some(n)),
        LineView::with_edge(p0, p1, n, None),
    ];
    for (k, view) in views.iter().enumerate() {
        let Some(view) = view else { continue };
        let (a, b) = view.ends();
        prop_assert!(a.is_finite() && b.is_finite());
        prop_assert!(view.range().into_iter().all(unit) || k == 3);
        prop_assert!(not_negative(view.line_distance()) && not_negative(view.length()));
        prop_assert!(not_negative(view.angle()) && view.angle() <= PI * (1.0 + 1e-6));
        prop_assert!(not_negative(view.solid_angle()), "{:?}", view.solid_angle());
        prop_assert!(not_negative(view.distance(t)) && view.at(t).is_finite());
        prop_assert!(unit(view.whole_fraction(t)) || k == 3);
        prop_assert!(view.clipped_fraction(t).is_none_or(unit));
        prop_assert!(
            unit(view.invert_solid_angle(t)),
            "{:?}",
            view.invert_solid_angle(t)
        );
        prop_assert!(
            place(&view.sample_solid_angle(u)),
            "{view:?} {:?}",
            view.sample_solid_angle(u)
        );
        let _ = (view.cosine(t), view.is_short());
        sound_thin(&ThinLine::Solid(*view), u, t)?;
        if let Some(line) = ProjectedLine::of(*view) {
            prop_assert!(not_negative(line.projected_solid_angle()));
        }
    }
    if let Some(line) = ProjectedLine::new(p0, p1, n) {
        prop_assert!(place(&line.sample(u)), "{:?}", line.sample(u));
        prop_assert!(place(&line.sample_coarse(u)), "{:?}", line.sample_coarse(u));
        prop_assert!(not_negative(line.angle_steps(u, steps)));
        prop_assert!(
            unit(line.cdf(t)) && unit(line.invert(t)) && unit(line.invert_fractions(t, u))
        );
        prop_assert!(not_negative(line.pdf(t)), "{:?}", line.pdf(t));
        sound_thin(&ThinLine::Projected(line), u, t)?;
    }
    Ok(())
}

fn sound_thin(line: &ThinLine, u: f64, t: f64) -> Check {
    prop_assert!(line.measure() >= 0.0 && line.measure().is_finite());
    prop_assert!((0.0..=1.0).contains(&line.sample(u).lambda));
    prop_assert!((0.0..=1.0).contains(&line.invert(t)) && line.view().length() >= 0.0);
    Ok(())
}
