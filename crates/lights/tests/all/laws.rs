//! The three laws of every sampling technique: the histogram of its samples fits its pdf (χ²), the
//! pdf integrates to one, and sample → invert → sample returns. On ordinary, tiny, huge, grazing
//! and far-from-origin lights.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_lights::{
    AngularLines, Area, AreaSampler, LineSampler, LineTechnique, Measure, OffsetDensity, Pdf,
    PointTechnique, PointsOnLines, ProxySampler, SolidAngle, SolidAngleSampler, TransformedSampler,
    Width,
};
use linelit_testkit::chi2::sidak;
use linelit_testkit::laws::{Surface, Technique};
use linelit_testkit::quadrature::gauss_legendre;

/// A shading point, its normal and a light, with the edge length of the histogram and how well
/// inverses resolve.
struct Case {
    name: &'static str,
    polygon: ConvexPolygon,
    x: DVec3,
    n: DVec3,
}

fn polygon(points: &[[f64; 3]]) -> ConvexPolygon {
    let points: Vec<_> = points.iter().map(|p| DVec3::from(*p)).collect();
    ConvexPolygon::new(&points).expect("a polygon")
}

/// Regular pentagon, stretched.
fn pentagon(center: DVec3, size: f64) -> ConvexPolygon {
    let points: Vec<_> = (0..5)
        .map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 5.0).sin_cos();
            center + DVec3::new(c, 0.6 * s, 0.3 * c) * size
        })
        .collect();
    ConvexPolygon::new(&points).expect("a polygon")
}

#[allow(clippy::too_many_lines, reason = "one case after the other")]
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

#[allow(
    clippy::type_complexity,
    reason = "maps there and back, whose types have no names"
)]
/// The light by its area coordinates, the second of which is κ² on a triangle: smooth in κ only.
fn surface(
    case: &Case,
) -> Surface<impl Fn([f64; 2]) -> ([f64; 3], f64), impl Fn([f64; 3]) -> Option<[f64; 2]>> {
    let (area, total) = (AreaSampler::new(&case.polygon), case.polygon.area());
    Surface {
        place: move |[u, kappa]: [f64; 2]| {
            let point = area.sample([u, kappa * kappa]).point;
            (point.to_array(), total * 2.0 * kappa)
        },
        locate: move |point: [f64; 3]| {
            let [u, square] = area.invert(point.into())?;
            Some([u, square.sqrt()])
        },
        // The density has kinks where the triangles of the fan meet.
        seams: fan_seams(&case.polygon),
    }
}

/// Measures of points on a polygon.
trait OnPolygon: Measure {
    /// The same density per area.
    fn per_area(pdf: Pdf<Self>, case: &Case, point: DVec3) -> f64
    where
        Self: Sized;
}

impl OnPolygon for Area {
    fn per_area(pdf: Pdf<Self>, _: &Case, _: DVec3) -> f64 {
        pdf.value()
    }
}

impl OnPolygon for SolidAngle {
    fn per_area(pdf: Pdf<Self>, case: &Case, point: DVec3) -> f64 {
        let d = point - case.x;
        let r2 = d.length_squared();
        pdf.to_area(r2, case.polygon.normal().dot(d) / r2.sqrt())
            .value()
    }
}

/// A law of any technique.
trait Law {
    fn hold<T: PointTechnique<Measure: OnPolygon>>(&self, name: &str, case: &Case, technique: &T);
}

/// How many techniques [`hold`] goes through.
const TECHNIQUES: usize = 10;

/// Holds every point technique on a polygon to a law.
fn hold(law: &impl Law, case: &Case) {
    let Case { polygon, x, n, .. } = case;
    let lines = LineSampler::new(polygon, 0.7, OffsetDensity::Length);
    let solid = AngularLines::by_solid_angle(polygon, 0.7, *x);
    let warped = AngularLines::by_warped_solid_angle(polygon, 0.7, *x);
    let cosine = AngularLines::by_projected_solid_angle(polygon, 0.7, *x, *n);
    let about = Frame::from_normal((polygon.centroid() - *x).normalize());
    let leaning = about.z + about.x * 0.2;
    let map = DMat3::from_cols(about.x * 0.4, about.y * 0.7, leaning);
    let transformed = TransformedSampler::new(polygon, *x, map).expect("a polygon");
    law.hold("area", case, &AreaSampler::new(polygon));
    law.hold("transformed solid angle", case, &transformed);
    law.hold("solid angle", case, &SolidAngleSampler::new(polygon, *x));
    law.hold("proxy", case, &ProxySampler::new(polygon, *x));
    law.hold("points on lines", case, &PointsOnLines(lines));
    law.hold("solid-angle lines", case, &PointsOnLines(solid));
    law.hold("warped solid-angle lines", case, &PointsOnLines(warped));
    law.hold("projected solid angle", case, &PointsOnLines(cosine));
    law.hold("lines from a corner", case, &AreaSampler::by_fan(polygon));
    let turned = polygon.starting_at(2);
    law.hold("another corner", case, &AreaSampler::by_fan(&turned));
}

/// The laws that a technique obeys: χ² of a number of samples at a level, a density that integrates
/// to one, and the round trip from sample over invert to sample.
struct Obeys {
    samples: u32,
    alpha: f64,
}

impl Law for Obeys {
    fn hold<T: PointTechnique<Measure: OnPolygon>>(&self, name: &str, case: &Case, technique: &T) {
        // The horizon cuts cells of the projected measure; elsewhere the rule converges to
        // rounding.
        let below = |v: &DVec3| case.n.dot(*v - case.x) < 0.0;
        let cut = name == "projected solid angle" && case.polygon.vertices().iter().any(below);
        // The warped density has kinks at the offsets of vertices, which do too; `offsets_fit`
        // integrates between them.
        let kinked = name == "warped solid-angle lines";
        // A narrow lobe over a light 40 times as wide as far: the rule is too coarse.
        let narrow = name == "transformed solid angle" && case.name == "huge";
        let tolerance = if cut || kinked || narrow { 1e-3 } else { 1e-8 };
        // Rounded coordinates move the place; the density per area over its mean, at most 1e3 here,
        // scales it to ξ. Lines shrink to a point at a vertex: d from there on a light D wide,
        // ξ = (d/D)², so that the rounding of their CDF moves d by D/(2√ξ) times as much. Of N
        // samples the nearest has ξ < α/N with probability α.
        let near_vertex = 0.5 * (f64::from(self.samples) / self.alpha).sqrt();
        Technique::new(format!("{name} on {}", case.name))
            .samples(self.samples as usize)
            .alpha(self.alpha)
            .seed(7)
            .mass(tolerance)
            .resolution((1e3 + near_vertex) * resolution(case) * case.polygon.area().sqrt())
            // Differences of places far away, over a light that is small there, are less sure.
            .sure(0.1)
            .check_2d(
                &surface(case),
                |u| technique.sample(u).point.to_array(),
                |p| T::Measure::per_area(technique.pdf(p.into()), case, p.into()),
                |p| technique.invert(p.into()),
            );
    }
}

fn points_fit(samples: u32) {
    let cases = cases();
    let alpha = sidak(0.01, cases.len() * TECHNIQUES);
    for case in &cases {
        hold(&Obeys { samples, alpha }, case);
    }
}

#[test]
fn points_on_polygons_obey() {
    points_fit(100_000);
}

#[test]
#[ignore = "long: a million samples of each technique and light"]
fn points_on_polygons_obey_long() {
    points_fit(1_000_000);
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
                            let pdf = lines.joint_pdf(p, &visible);
                            SolidAngle::per_area(pdf, case, p) * segment.length()
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

/// Points of what is visible of a line are uniform in the area of its strip, even or growing from
/// a corner: as many in each part of equal widths, or differences of squares.
#[test]
fn places_are_uniform_in_what_is_visible() {
    let visible = [Interval::new(0.5, 0.75), Interval::new(0.875, 1.0)];
    let below = |t: f64, power: i32| {
        let part = |i: &Interval| (t.min(i.hi).powi(power) - i.lo.powi(power)).max(0.0);
        visible.iter().map(part).sum::<f64>()
    };
    for (width, power) in [(Width::Even, 1), (Width::Growing, 2)] {
        let all = below(1.0, power);
        for i in 0..100 {
            let xi = (f64::from(i) + 0.5) / 100.0;
            let (t, total) = width.place(&visible, xi);
            // There are some roundings of numbers below one, divided by a fraction of .3.
            assert!(
                (total - all / f64::from(power)).abs() < 1e-15,
                "{width:?} {total}"
            );
            assert!((below(t, power) / all - xi).abs() < 1e-14, "{width:?} {t}");
        }
        assert!(width.place(&[], 0.5).1.abs() < f64::MIN_POSITIVE);
    }
    // The points of a whole line are the points of the sampler.
    for case in &cases() {
        let fan = AreaSampler::by_fan(&case.polygon);
        let (line, slack) = (
            fan.line(0.3),
            16.0 * resolution(case) * case.polygon.diameter(),
        );
        for v in [0.0, 0.25, 0.9] {
            let (t, _) = Width::Growing.place(&[Interval::UNIT], v);
            let apart = line.at(t) - fan.sample([0.3, v]).point;
            assert!(apart.length() < slack, "{}: {apart}", case.name);
        }
    }
}

/// Checks the laws of the offsets of lines; `condition` is the condition of the CDF.
fn offsets_obey(
    name: String,
    lines: &impl LineTechnique,
    samples: u32,
    condition: f64,
    alpha: f64,
) {
    let (a, b) = lines.lines().range();
    let extent = b - a + a.abs().max(b.abs());
    Technique::new(name)
        .samples(samples as usize)
        .alpha(alpha)
        .seed(9)
        .kinks(lines.lines().knots())
        // The rounding of the CDF, and a place resolved to ε of the range and of the coordinates.
        .round_trip(64.0 * f64::EPSILON * (1.0 + condition))
        .resolution(64.0 * f64::EPSILON * extent)
        .mass(1e-8)
        .check_1d(
            [a, b],
            |u| lines.sample(u).offset,
            |offset| lines.pdf(offset).value(),
            |offset| lines.invert(offset),
        );
}

#[test]
fn line_offsets_obey_the_laws() {
    offsets_fit(100_000, 20_000);
}

#[test]
#[ignore = "long: a million lines of each density on each light in four directions"]
fn line_offsets_obey_the_laws_long() {
    offsets_fit(1_000_000, 1_000_000);
}

fn offsets_fit(plain: u32, angular: u32) {
    let cases = cases();
    let alpha = sidak(0.01, cases.len() * 4 * 5);
    for case in &cases {
        // Along an edge of rectangles, and across it, offsets are in closed form.
        for angle in [0.0, std::f64::consts::FRAC_PI_2, 0.7, 2.5] {
            for density in [OffsetDensity::Uniform, OffsetDensity::Length] {
                let lines = LineSampler::new(&case.polygon, angle, density);
                let name = format!("{density:?} {angle} on {}", case.name);
                offsets_obey(name, &lines, plain, 0.0, alpha);
            }
            let solid = AngularLines::by_solid_angle(&case.polygon, angle, case.x);
            let warped = AngularLines::by_warped_solid_angle(&case.polygon, angle, case.x);
            let cosine =
                AngularLines::by_projected_solid_angle(&case.polygon, angle, case.x, case.n);
            // Lambert's sum for a light that is not small has terms of order one, however small the
            // sum is.
            let condition = match case.name {
                "tiny" => 0.0,
                _ => 1.0 / cosine.total().min(1.0),
            };
            for (lines, kind, condition) in [
                (solid, "solid angle", 0.0),
                (warped, "warped solid angle", 0.0),
                (cosine, "projected solid angle", condition),
            ] {
                let name = format!("lines by {kind} {angle} on {}", case.name);
                offsets_obey(name, &lines, angular, condition, alpha);
            }
        }
    }
}
