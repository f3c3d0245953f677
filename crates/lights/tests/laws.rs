//! The three laws of every sampling technique: the histogram of its samples fits its pdf (χ²), the pdf integrates to one,
//! and sample → invert → sample returns. On ordinary, tiny, huge, grazing and far-from-origin lights.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{
    AngularLines, AreaSampler, LineSampler, OffsetDensity, Pdf, ProxySampler, SolidAngle,
    SolidAngleSampler,
};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::quadrature::{gauss_kronrod, gauss_legendre};
use linelit_testkit::rng::SplitMix64;

/// A shading point, its normal and a light, with the edge length of the histogram and how well inverses resolve.
struct Case {
    name: &'static str,
    polygon: ConvexPolygon,
    x: DVec3,
    n: DVec3,
}

fn polygon(points: &[[f64; 3]]) -> ConvexPolygon {
    let points: Vec<_> = points.iter().map(|p| DVec3::from(*p)).collect();
    ConvexPolygon::try_new(&points).expect("a polygon")
}

/// Regular pentagon, stretched.
fn pentagon(center: DVec3, size: f64) -> ConvexPolygon {
    let points: Vec<_> = (0..5)
        .map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 5.0).sin_cos();
            center + DVec3::new(c, 0.6 * s, 0.3 * c) * size
        })
        .collect();
    ConvexPolygon::try_new(&points).expect("a polygon")
}

fn cases() -> Vec<Case> {
    let up = DVec3::Z;
    let case = |name, polygon, x, n| Case {
        name,
        polygon,
        x,
        n,
    };
    let o = DVec3::ZERO;
    let tilted = DVec3::new(0.48, 0.6, 0.64);
    vec![
        case(
            "triangle",
            polygon(&[[-1.0, -0.5, 2.0], [1.0, -0.2, 2.5], [0.2, 1.0, 1.5]]),
            o,
            up,
        ),
        case(
            "rectangle",
            polygon(&[
                [-1.0, -0.5, 1.0],
                [1.0, -0.5, 1.0],
                [1.0, 0.5, 1.2],
                [-1.0, 0.5, 1.2],
            ]),
            o,
            tilted,
        ),
        case(
            "pentagon",
            pentagon(DVec3::new(0.5, 0.2, 2.0), 1.0),
            o,
            tilted,
        ),
        case("tiny", pentagon(DVec3::new(0.5, 0.2, 2.0), 1e-5), o, tilted),
        case("huge", pentagon(DVec3::new(5.0, 3.0, 10.0), 40.0), o, up),
        case(
            "grazing",
            polygon(&[
                [1.0, -1.0, 0.2],
                [3.0, -1.0, 0.25],
                [3.0, 1.0, 0.25],
                [1.0, 1.0, 0.2],
            ]),
            o,
            up,
        ),
        case(
            "across the horizon",
            polygon(&[
                [-1.0, 1.0, -1.0],
                [1.0, 1.0, -1.0],
                [1.5, 1.5, 2.0],
                [-1.0, 1.5, 2.0],
            ]),
            o,
            up,
        ),
        case(
            "far",
            pentagon(DVec3::new(1e5 + 0.5, 2e5, -3e5 + 2.0), 1.0),
            DVec3::new(1e5, 2e5, -3e5),
            tilted,
        ),
    ]
}

/// How far rounding coordinates moves a place on the light, relative to its size.
fn resolution(case: &Case) -> f64 {
    let v = case.polygon.vertices();
    let far = v
        .iter()
        .map(|p| p.abs().max_element())
        .fold(case.x.abs().max_element(), f64::max);
    f64::EPSILON * (1.0 + far / case.polygon.area().sqrt())
}

/// Where the triangles of a polygon's fan meet in the first area coordinate.
fn fan_seams(polygon: &ConvexPolygon) -> Vec<f64> {
    let v = polygon.vertices();
    let mut sum = 0.0;
    v[1..]
        .windows(2)
        .map(|p| {
            sum += 0.5 * (p[0] - v[0]).cross(p[1] - v[0]).length() / polygon.area();
            sum
        })
        .collect()
}

/// Counts how often each of `bins × bins` cells of the light's area coordinates is hit, against the integral of the density
/// per area over the cell.
fn chi2_on_area(
    case: &Case,
    samples: u32,
    sample: impl Fn([f64; 2]) -> DVec3,
    density: impl Fn(DVec3) -> f64,
) -> (f64, f64) {
    const BINS: usize = 16;
    let area = AreaSampler::new(&case.polygon);
    let mut rng = SplitMix64::new(7);
    let mut observed = vec![0_u64; BINS * BINS];
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "below BINS"
    )]
    let bin = |u: f64| ((u * BINS as f64) as usize).min(BINS - 1);
    for _ in 0..samples {
        let p = sample([rng.next_f64(), rng.next_f64()]);
        let [a, b] = area.invert(p).expect("samples lie on the light");
        observed[bin(a) * BINS + bin(b)] += 1;
    }
    // The density has kinks where the triangles of the fan meet: cells are cut there.
    let seams = fan_seams(&case.polygon);
    let rule = gauss_legendre(12);
    let width = 1.0 / BINS as f64;
    let total = case.polygon.area();
    let mut expected = Vec::with_capacity(BINS * BINS);
    for i in 0..BINS {
        for j in 0..BINS {
            let (a, b) = (i as f64 * width, j as f64 * width);
            let mut cuts = vec![a, a + width];
            cuts.extend(seams.iter().filter(|s| **s > a && **s < a + width));
            cuts.sort_by(f64::total_cmp);
            // The second coordinate is κ² on a triangle: smooth in κ only.
            let kappas = [b.sqrt(), (b + width).sqrt()];
            let at = |u: f64, kappa: f64| {
                density(area.sample([u, kappa * kappa]).point) * total * 2.0 * kappa
            };
            let strips = cuts.windows(2);
            let mass: f64 = strips
                .map(|c| rule.integrate_2d([c[0], c[1]], kappas, at))
                .sum();
            expected.push(mass);
        }
    }
    let mass: f64 = expected.iter().sum();
    for e in &mut expected {
        *e *= f64::from(samples);
    }
    (chi2_test(&observed, &expected, 5.0).p_value, mass)
}

/// Solid angle density → density per area.
fn per_area(case: &Case, point: DVec3, pdf: Pdf<SolidAngle>) -> f64 {
    let d = point - case.x;
    let r2 = d.length_squared();
    pdf.to_area(r2, case.polygon.normal().dot(d) / r2.sqrt())
        .value()
}

type Point = Box<dyn Fn([f64; 2]) -> DVec3>;
type Density = Box<dyn Fn(DVec3) -> f64>;
type Inverse = Box<dyn Fn(DVec3) -> Option<[f64; 2]>>;

/// Every point technique on a polygon, as closures; densities per area.
fn techniques(case: &Case) -> Vec<(&'static str, Point, Density, Inverse)> {
    let here = || Case {
        name: case.name,
        polygon: case.polygon,
        x: case.x,
        n: case.n,
    };
    let area = AreaSampler::new(&case.polygon);
    let solid = SolidAngleSampler::new(&case.polygon, case.x);
    let proxy = ProxySampler::new(&case.polygon, case.x);
    let lines = AngularLines::by_solid_angle(&case.polygon, 0.7, case.x);
    let warped = AngularLines::by_warped_solid_angle(&case.polygon, 0.7, case.x);
    let cosine = AngularLines::by_projected_solid_angle(&case.polygon, 0.7, case.x, case.n);
    let whole = [Interval::UNIT];
    let plain = LineSampler::new(&case.polygon, 0.7, OffsetDensity::Length);
    let on_lines = |l: AngularLines| -> Point {
        Box::new(move |u| l.point(&l.sample(u[0]), &[Interval::UNIT], u[1]).point)
    };
    let (c1, c2, c3, c4, c5) = (here(), here(), here(), here(), here());
    vec![
        (
            "area",
            Box::new(move |u| area.sample(u).point),
            Box::new(move |p| area.pdf(p).value()),
            Box::new(move |p| area.invert(p)),
        ),
        (
            "solid angle",
            Box::new(move |u| solid.sample(u).point),
            Box::new(move |p| per_area(&c1, p, solid.pdf(p))),
            Box::new(move |p| solid.invert(p)),
        ),
        (
            "proxy",
            Box::new(move |u| proxy.sample(u).point),
            Box::new(move |p| per_area(&c2, p, proxy.pdf(p))),
            Box::new(move |p| proxy.invert(p)),
        ),
        (
            "points on lines",
            Box::new(move |u| plain.point(&plain.sample(u[0]), &whole, u[1]).point),
            Box::new(move |p| plain.joint_pdf(p, &whole).value()),
            Box::new(move |p| plain.invert_point(p, &whole)),
        ),
        (
            "solid-angle lines",
            on_lines(lines),
            Box::new(move |p| per_area(&c3, p, lines.joint_pdf(p, &whole))),
            Box::new(move |p| lines.invert_point(p, &whole)),
        ),
        (
            "warped solid-angle lines",
            on_lines(warped),
            Box::new(move |p| per_area(&c5, p, warped.joint_pdf(p, &whole))),
            Box::new(move |p| warped.invert_point(p, &whole)),
        ),
        (
            "projected solid angle",
            on_lines(cosine),
            Box::new(move |p| per_area(&c4, p, cosine.joint_pdf(p, &whole))),
            Box::new(move |p| cosine.invert_point(p, &whole)),
        ),
    ]
}

fn points_fit(samples: u32) {
    let cases = cases();
    let alpha = sidak(0.01, cases.len() * 7);
    for case in &cases {
        for (name, sample, density, _) in techniques(case) {
            let (p, mass) = chi2_on_area(case, samples, sample, density);
            assert!(p > alpha, "{name} on {}: p = {p:e}", case.name);
            // The horizon cuts cells of the projected measure; elsewhere the rule converges to rounding.
            let below = |v: &&DVec3| case.n.dot(**v - case.x) < 0.0;
            let cut = name == "projected solid angle"
                && case.polygon.vertices().iter().find(below).is_some();
            // The warped density has kinks at the offsets of vertices, which do too; `laws_1d` integrates between
            // them.
            let kinked = name == "warped solid-angle lines";
            let tolerance = if cut || kinked { 1e-3 } else { 1e-8 };
            assert!(
                (mass - 1.0).abs() < tolerance,
                "{name} on {}: ∫ = {mass}",
                case.name
            );
        }
    }
}

#[test]
fn points_on_polygons_fit_their_pdf() {
    points_fit(100_000);
}

#[test]
#[ignore = "long: a million samples of each technique and light"]
fn points_on_polygons_fit_their_pdf_long() {
    points_fit(1_000_000);
}

#[test]
fn points_on_polygons_invert() {
    let mut rng = linelit_testkit::cases::rng(3);
    for case in &cases() {
        // Rounded coordinates move the place; the density per area over its mean, at most 1e3 here, scales it to ξ. The
        // CDF of the line techniques adds its own ε times the full turn.
        let tolerance = 1e3 * resolution(case);
        for (name, sample, _, invert) in techniques(case) {
            for _ in 0..2000 {
                let u = [rng.next_f64(), rng.next_f64()];
                let point = sample(u);
                let Some(back) = invert(point) else {
                    panic!("{name} on {}: {u:?} is outside", case.name);
                };
                // Near the fan's apex and where lines shrink to a point the second coordinate is ill-defined: compare
                // the points.
                let again = sample(back);
                let error = (again - point).length() / case.polygon.area().sqrt();
                assert!(
                    error < tolerance,
                    "{name} on {}: {u:?} {back:?} {error:e}",
                    case.name
                );
            }
        }
    }
}

#[test]
fn perfect_techniques_have_no_variance() {
    let mut rng = linelit_testkit::cases::rng(5);
    for case in &cases() {
        let lines = AngularLines::by_projected_solid_angle(&case.polygon, 0.3, case.x, case.n);
        let tolerance = 1e3 * resolution(case);
        for _ in 0..1000 {
            let line = lines.sample(rng.next_f64());
            let s = lines.point(&line, &[Interval::UNIT], rng.next_f64());
            let cosine = case.n.dot((s.point - case.x).normalize());
            let estimate = cosine / s.pdf.value();
            // Close to the horizon both cosine and density round by ε/cosine.
            let slack = tolerance * (1.0 + 1.0 / cosine);
            let error = (estimate / lines.total() - 1.0).abs();
            assert!(error < slack, "{}: {error:e} {slack:e}", case.name);
        }
    }
}

#[test]
fn occluded_lines_estimate_what_is_visible() {
    // The middle third of every line is hidden: two thirds of each line remain, exactly, by area.
    let visible = [Interval::new(0.0, 1.0 / 3.0), Interval::new(2.0 / 3.0, 1.0)];
    let rule = gauss_legendre(24);
    for case in &cases()[..3] {
        for lines in [
            AngularLines::by_solid_angle(&case.polygon, 1.1, case.x),
            AngularLines::by_warped_solid_angle(&case.polygon, 1.1, case.x),
            AngularLines::by_projected_solid_angle(&case.polygon, 1.1, case.x, case.n),
        ] {
            // ∫ pdf over the visible part = 1, with area coordinates (offset, along).
            let knots = lines.lines().knots();
            let mut mass = 0.0;
            for k in knots.windows(2) {
                mass += rule.integrate(k[0], k[1], |u| {
                    let segment = lines.lines().segment(u).expect("inside");
                    let part = |i: &Interval| {
                        rule.integrate(i.lo, i.hi, |t| {
                            let p = segment.at(t);
                            per_area(case, p, lines.joint_pdf(p, &visible)) * segment.length()
                        })
                    };
                    visible.iter().map(part).sum()
                });
            }
            assert!((mass - 1.0).abs() < 1e-9, "{}: {mass}", case.name);
            let line = lines.sample(0.4);
            for i in 0..100 {
                let s = lines.point(&line, &visible, f64::from(i) / 100.0);
                let (_, t) = lines.locate(s.point).expect("on the light");
                assert!(!(0.334..0.666).contains(&t), "{t}");
            }
            // A hidden point has no density, and a hidden line no sample.
            let hidden = line.segment.at(0.5);
            assert!(!lines.joint_pdf(hidden, &visible).is_positive());
            assert!(!lines.point(&line, &[], 0.5).pdf.is_positive());
        }
    }
}

/// The laws for a density on an interval: χ² over 64 equal cells, mass one, round trip.
fn laws_1d(
    name: &str,
    range: (f64, f64),
    knots: &[f64],
    (samples, condition): (u32, f64),
    sample: impl Fn(f64) -> f64,
    pdf: impl Fn(f64) -> f64,
    invert: impl Fn(f64) -> Option<f64>,
) -> f64 {
    const BINS: usize = 64;
    let (a, b) = range;
    let mut rng = SplitMix64::new(9);
    let mut observed = vec![0_u64; BINS];
    for _ in 0..samples {
        let xi = rng.next_f64();
        let x = sample(xi);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below BINS"
        )]
        let bin = ((x - a) / (b - a) * BINS as f64) as usize;
        observed[bin.min(BINS - 1)] += 1;
        let back = invert(x).unwrap_or_else(|| panic!("{name}: {x} is outside"));
        // A place resolved to ε of the range and of the coordinates, times the density there; and the rounding of the CDF.
        let place = 1.0 + (b - a + a.abs().max(b.abs())) * pdf(x);
        let tolerance = 64.0 * f64::EPSILON * (place + condition);
        assert!(
            (back - xi).abs() <= tolerance,
            "{name}: {xi} → {x} → {back}"
        );
    }
    let edge = |i: usize| a + (b - a) * i as f64 / BINS as f64;
    let expected: Vec<f64> = (0..BINS)
        .map(|i| {
            let mut cuts = vec![edge(i), edge(i + 1)];
            cuts.extend(knots.iter().filter(|k| **k > edge(i) && **k < edge(i + 1)));
            cuts.sort_by(f64::total_cmp);
            let mass: f64 = cuts
                .windows(2)
                .map(|c| gauss_kronrod(&pdf, c[0], c[1], 1e-10).value)
                .sum();
            mass * f64::from(samples)
        })
        .collect();
    let mass = expected.iter().sum::<f64>() / f64::from(samples);
    assert!((mass - 1.0).abs() < 1e-8, "{name}: ∫ = {mass}");
    chi2_test(&observed, &expected, 5.0).p_value
}

#[test]
fn line_offsets_obey_the_laws() {
    offsets_fit(100_000, 20_000);
}

#[test]
#[ignore = "long: a million lines of each density on each light in three directions"]
fn line_offsets_obey_the_laws_long() {
    offsets_fit(1_000_000, 1_000_000);
}

fn offsets_fit(plain: u32, angular: u32) {
    let cases = cases();
    let alpha = sidak(0.01, cases.len() * 3 * 5);
    for case in &cases {
        for angle in [0.0, 0.7, 2.5] {
            for density in [OffsetDensity::Uniform, OffsetDensity::Length] {
                let s = LineSampler::new(&case.polygon, angle, density);
                let name = format!("{density:?} {angle} on {}", case.name);
                let p = laws_1d(
                    &name,
                    s.lines().range(),
                    s.lines().knots(),
                    (plain, 0.0),
                    |xi| s.sample(xi).offset,
                    |u| s.pdf(u).value(),
                    |u| s.invert(u),
                );
                assert!(p > alpha, "{name}: p = {p:e}");
            }
            let lines = AngularLines::by_solid_angle(&case.polygon, angle, case.x);
            let cosine =
                AngularLines::by_projected_solid_angle(&case.polygon, angle, case.x, case.n);
            let warped = AngularLines::by_warped_solid_angle(&case.polygon, angle, case.x);
            for (s, kind) in [
                (lines, "solid angle"),
                (warped, "warped solid angle"),
                (cosine, "projected solid angle"),
            ] {
                // Lambert's sum for a light that is not small has terms of order one, whatever their sum.
                let condition = if kind == "projected solid angle" {
                    1.0 / s.total().min(1.0)
                } else {
                    0.0
                };
                let condition = if case.name == "tiny" { 0.0 } else { condition };
                let name = format!("lines by {kind} {angle} on {}", case.name);
                let p = laws_1d(
                    &name,
                    s.lines().range(),
                    s.lines().knots(),
                    (angular, condition),
                    |xi| s.sample(xi).offset,
                    |u| s.pdf(u).value(),
                    |u| s.invert(u),
                );
                assert!(p > alpha, "{name}: p = {p:e}");
            }
        }
    }
}
