//! This module compares the techniques with reference vectors of 25 digits, with a tolerance for
//! each case that follows from its conditioning.
#![allow(dead_code, reason = "a test and an example use a part of it each")]

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::linear::ProjectedLine;
use linelit_lights::{AngularLines, LineTechnique, SolidAngleSampler};
use linelit_testkit::vectors::{Case, Vectors};

const EPS: f64 = f64::EPSILON;

fn cases(file: &str) -> Vec<Case> {
    Vectors::parse(file).expect("reference vectors").cases
}

fn point(case: &Case, name: &str) -> DVec3 {
    case.vec3(name).into()
}

fn relative(got: f64, want: f64) -> f64 {
    (got - want).abs() / want.abs().max(f64::MIN_POSITIVE)
}

/// What was measured of one quantity.
pub(crate) struct Row {
    pub(crate) what: &'static str,
    /// Every error.
    pub(crate) errors: Vec<f64>,
    /// The worst error over its tolerance, and the class of the case.
    pub(crate) ratio: f64,
    pub(crate) tag: String,
}

pub(crate) struct Rows(pub(crate) Vec<Row>);

impl Rows {
    fn new(what: &[&'static str]) -> Self {
        let row = |&what| Row {
            what,
            errors: Vec::new(),
            ratio: 0.0,
            tag: String::new(),
        };
        Self(what.iter().map(row).collect())
    }

    fn check(&mut self, slot: usize, error: f64, tolerance: f64, tag: &str) {
        let row = &mut self.0[slot];
        row.errors.push(error);
        let ratio = if error.is_nan() {
            f64::INFINITY
        } else {
            error / tolerance
        };
        if ratio >= row.ratio {
            (row.ratio, row.tag) = (ratio, tag.to_owned());
        }
    }

    /// Asserts that every quantity keeps its tolerance, and that the tolerances are not a thousand
    /// times too wide: that would hide a regression.
    pub(crate) fn assert(&self) {
        for r in &self.0 {
            let (what, ratio, tag) = (r.what, r.ratio, &r.tag);
            assert!(
                ratio <= 1.0,
                "{what}: {ratio} of the tolerance in a case of class {tag}"
            );
            assert!(
                ratio > 1e-3,
                "{what}: the worst case is {ratio:e} of the tolerance"
            );
        }
    }
}

/// Lines: `e_linear_sampling.json`.
pub(crate) fn linear_lights(file: &str) -> Rows {
    let mut worst = Rows::new(&["ends", "psa", "sa", "xi of psa", "direction", "xi of sa"]);
    for case in &cases(file) {
        let (p0, p1, n) = (point(case, "p0"), point(case, "p1"), point(case, "n"));
        let line = ProjectedLine::new(p0, p1, n);
        if case.flag("empty") {
            assert!(line.is_none());
            continue;
        }
        let (line, tag) = (line.expect("above the horizon"), case.tag());
        let (view, xi) = (line.view(), case.number("xi"));
        let (a, b) = view.ends();
        for (got, want) in [(a, point(case, "a")), (b, point(case, "b"))] {
            // A cross product and a division by a dot product of two terms.
            let error = (got - want).length() / want.length();
            worst.check(0, error, 16.0 * EPS, tag);
        }
        // Three terms whose sum is at least 1/7 of their magnitudes, each of a few roundings.
        worst.check(
            1,
            relative(line.projected_solid_angle(), case.number("psa")),
            32.0 * EPS,
            tag,
        );
        worst.check(
            2,
            relative(view.solid_angle(), case.number("sa")),
            16.0 * EPS,
            tag,
        );
        // A place on the line is a fraction of its length: ε of that is ε l/h in angle.
        let place = 32.0 * EPS * (1.0 + view.length() / view.line_distance());
        let arc = line.sample(xi);
        for lambda in [case.number("t_psa"), arc.lambda] {
            worst.check(3, (line.invert(lambda) - xi).abs(), place, tag);
        }
        for lambda in [case.number("t_sa"), view.sample_solid_angle(xi).lambda] {
            worst.check(5, (view.invert_solid_angle(lambda) - xi).abs(), place, tag);
        }
        // An error in ξ moves the angle by 1/p, p = pdf · dΩ/dv = 2 pdf/distance being the density
        // per angle.
        let (error, pdf) = (
            (arc.direction - point(case, "dir_psa")).length(),
            case.number("pdf_psa"),
        );
        let per_xi = arc.point.length() / (2.0 * pdf.abs());
        worst.check(4, error, 32.0 * EPS * (1.0 + per_xi), tag);
    }
    worst
}

fn on_plane(points: &[(f64, f64)], z: f64) -> ConvexPolygon {
    // u → x, y → y, and the first edge does not matter: angles are given to the polygon's own
    // frame.
    let points: Vec<_> = points.iter().map(|&(u, y)| DVec3::new(u, y, z)).collect();
    ConvexPolygon::new(&points).expect("a polygon")
}

/// The angle that makes the lines run along +y.
fn along_y(p: &ConvexPolygon) -> f64 {
    let f = p.plane_frame().axes;
    f.x.cross(DVec3::Y).dot(f.z).atan2(f.x.dot(DVec3::Y))
}

/// How far rounding the coordinates of the light moves it, relative to its smallest extent and its
/// distance.
fn conditioning(points: &[(f64, f64)], z: f64) -> f64 {
    let far = points
        .iter()
        .fold(z, |m, p| m.max(p.0.abs()).max(p.1.abs()));
    let n = points.len();
    let thinnest = (0..n)
        .map(|i| {
            let (a, b, c) = (points[i], points[(i + 1) % n], points[(i + 2) % n]);
            let (e, g) = ((b.0 - a.0, b.1 - a.1), (c.0 - a.0, c.1 - a.1));
            (e.0 * g.1 - e.1 * g.0).abs() / e.0.hypot(e.1)
        })
        .fold(f64::MAX, f64::min);
    1.0 + far / thinnest + far / z
}

/// Solid angle and irradiance of polygons: `d_polygon.json`.
pub(crate) fn polygons(file: &str) -> Rows {
    let mut worst = Rows::new(&["omega", "fan", "irradiance"]);
    for case in &cases(file) {
        let points: Vec<DVec3> = case
            .points("verts")
            .into_iter()
            .map(DVec3::from_array)
            .collect();
        let (tag, n) = (case.tag(), point(case, "n"));
        let Ok(polygon) = ConvexPolygon::new(&points) else {
            continue;
        };
        // The vertices are planar to a few ε of their coordinates only, and the polygon is
        // flattened: the solid angle moves by that over the plane's distance and the light's
        // thickness.
        let z = polygon.normal().dot(points[0]).abs();
        let far = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        let size = polygon.area() / polygon.diameter();
        let tolerance = 16.0 * EPS * (1.0 + far / z + far / size);
        let omega = case.number("omega").abs();
        let solid = SolidAngleSampler::new(&polygon, DVec3::ZERO).solid_angle();
        worst.check(1, relative(solid, omega), tolerance, tag);
        let lines = AngularLines::by_solid_angle(&polygon, 0.4, DVec3::ZERO);
        worst.check(0, relative(lines.total(), omega), tolerance, tag);
        // Absolute in the solid angle: grazing cosines cancel in the data themselves.
        let cosine = AngularLines::by_projected_solid_angle(&polygon, 0.4, DVec3::ZERO, n);
        let error = (cosine.total() - case.number("E").abs()).abs() / omega;
        worst.check(2, error, tolerance, tag);
    }
    worst
}

/// Lines by solid angle: `f_solid_angle_lines.json`.
#[allow(clippy::too_many_lines, reason = "one case after the other")]
pub(crate) fn solid_angle_lines(file: &str) -> Rows {
    let mut worst = Rows::new(&["omega", "offset", "backward", "pdf", "y"]);
    for case in &cases(file) {
        let (z, tag, rect) = (case.number("z"), case.tag(), case.text("kind") == "rect");
        let points: Vec<(f64, f64)> = if rect {
            let [x0, x1, y0, y1] = ["x0", "x1", "y0", "y1"].map(|k| case.number(k));
            vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        } else {
            case.points("pts")
                .into_iter()
                .map(|[u, y]| (u, y))
                .collect()
        };
        let polygon = on_plane(&points, z);
        let lines = AngularLines::by_solid_angle(&polygon, along_y(&polygon), DVec3::ZERO);
        // The polygon's own vertices, frame and offsets are rounded coordinates: each error is a
        // few ε of the coordinates, divided by the extent that it changes.
        let tolerance = 8.0 * EPS * conditioning(&points, z);
        worst.check(
            0,
            relative(lines.total(), case.number("omega")),
            tolerance,
            tag,
        );
        let (u, xi) = if rect { ("x", "xi_u") } else { ("u", "xi") };
        let (u, xi) = (case.number(u), case.number(xi));
        let towards = lines.lines().across().dot(DVec3::X).signum();
        let line = lines.sample(if towards > 0.0 { xi } else { 1.0 - xi });
        let extent = |f: fn(&(f64, f64)) -> f64| {
            let of = |init, g: fn(f64, f64) -> f64| points.iter().map(f).fold(init, g);
            of(f64::MIN, f64::max) - of(f64::MAX, f64::min)
        };
        let width = extent(|p| p.0);
        // ξ moves the offset by 1/pdf, pdf relative to the mean density 1/width.
        let slack = tolerance * (1.0 + 1.0 / (width * line.pdf.value()));
        worst.check(1, (line.segment.p0.x - u).abs() / width, slack, tag);
        let back = lines.invert(line.offset).expect("on the light");
        let back = if towards > 0.0 { back } else { 1.0 - back };
        worst.check(
            2,
            (back - xi).abs(),
            tolerance * (1.0 + width * line.pdf.value()),
            tag,
        );
        if rect {
            let vis = case.points("vis").into_iter();
            let vis: Vec<_> = vis.map(|[a, b]| Interval::new(a, b)).collect();
            let sample = lines.point(&line, &vis, case.number("xi_v"));
            worst.check(
                3,
                relative(sample.pdf.value(), case.number("pdf")),
                4.0 * tolerance,
                tag,
            );
            let error = (sample.point.y - case.number("y")).abs() / extent(|p| p.1);
            worst.check(4, error, 4.0 * tolerance, tag);
        } else {
            // The length of the line changes with the offset, so its error enters relative to the
            // line.
            let shape = width * line.pdf.value() * line.segment.length() / extent(|p| p.1);
            let slack = tolerance * (4.0 + 1.0 / shape.min(1.0));
            worst.check(
                3,
                relative(line.pdf.value(), case.number("pdf_u")),
                slack,
                tag,
            );
        }
    }
    worst
}
