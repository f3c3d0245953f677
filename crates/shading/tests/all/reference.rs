//! Reference vectors: reading a folder of them, evaluating, and comparing with bounds.
//!
//! One field is skipped, for the crate has no such integral: `point` of `b_line_models`, a line of
//! isotropic points.

use linelit_geometry::DVec3;
use linelit_shading::{cylinder, phong, phong_polygon, polygon, ribbon, solid_angle};
use linelit_testkit::real::Real;
use linelit_testkit::vectors::{Case, Vectors};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Goal of the Lambert line forms.
const LINE: f64 = 1e-13;
/// Goal of the polygons, times their condition.
const POLYGON: f64 = 1e-12;
/// Goal of the Phong lobes.
const PHONG: f64 = 1e-10;

/// The errors of one quantity in one class.
#[derive(Debug)]
pub(crate) struct Row {
    errors: Vec<f64>,
    bound: f64,
    worst: (f64, usize),
}

/// All errors, by file, quantity and class.
#[derive(Debug, Default)]
pub(crate) struct Report {
    rows: BTreeMap<(String, String, String), Row>,
}

impl Report {
    fn add(&mut self, file: &str, what: &str, case: &Case, error: f64, bound: f64) {
        let key = (file.to_owned(), what.to_owned(), case.tag().to_owned());
        let row = self.rows.entry(key).or_insert(Row {
            errors: Vec::new(),
            bound,
            worst: (-1.0, 0),
        });
        // A NaN counts as infinitely wrong.
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > row.worst.0 {
            row.worst = (error, case.index);
        }
        row.errors.push(error);
    }

    /// Whether every error is within its bound.
    pub(crate) fn holds(&self) -> bool {
        self.rows.values().all(|row| row.worst.0 <= row.bound)
    }

    /// The errors as a table.
    pub(crate) fn table(&self) -> String {
        let mut out = format!(
            "{:<24} {:<8} {:<22} {:>6} {:>9} {:>9} {:>9}  worst case\n",
            "file", "quantity", "class", "cases", "worst", "median", "bound"
        );
        for ((file, what, class), row) in &self.rows {
            let mut errors = row.errors.clone();
            errors.sort_by(f64::total_cmp);
            let median = errors[errors.len() / 2];
            let mark = if row.worst.0 <= row.bound {
                ""
            } else {
                "  ABOVE ITS BOUND"
            };
            writeln!(
                out,
                "{file:<24} {what:<8} {class:<22} {:>6} {:>9.1e} {median:>9.1e} {:>9.1e}  {}{mark}",
                errors.len(),
                row.worst.0,
                row.bound,
                row.worst.1,
            )
            .expect("a String takes any text");
        }
        out
    }
}

/// Evaluates every `*.json` of the folder.
pub(crate) fn run(folder: &Path) -> Result<Report, String> {
    let mut report = Report::default();
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths: Vec<_> = entries.filter_map(Result::ok).map(|e| e.path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "json"));
    paths.sort();
    if paths.is_empty() {
        return Err(format!("{}: no vector files", folder.display()));
    }
    for path in paths {
        let named = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = std::fs::read_to_string(&path).map_err(|e| named(&e))?;
        let vectors = Vectors::parse(&text).map_err(|e| named(&e))?;
        let file = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        for case in &vectors.cases {
            guarded(&mut report, &file, &vectors.schema, case).map_err(|e| named(&e))?;
        }
    }
    Ok(report)
}

/// [`evaluate`], with a case that lacks something as an error: the accessors of a case panic, for
/// in a test that is what they should do.
fn guarded(report: &mut Report, file: &str, schema: &str, case: &Case) -> Result<(), String> {
    let attempt = std::panic::AssertUnwindSafe(|| evaluate(report, file, schema, case));
    match std::panic::catch_unwind(attempt) {
        Ok(result) => result,
        Err(payload) => {
            let text = payload
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| payload.downcast_ref::<&str>().copied());
            Err(text.unwrap_or("a case cannot be read").to_owned())
        }
    }
}

fn evaluate(report: &mut Report, file: &str, schema: &str, case: &Case) -> Result<(), String> {
    match schema {
        "a_ribbon_diffuse" => diffuse(report, file, case),
        "b_line_models" => models(report, file, case),
        "c_phong_line" => phong_line(report, file, case),
        "d_polygon" => polygons(report, file, case),
        "e_linear_sampling" => linear(report, file, case),
        "f_solid_angle_lines" => solid(report, file, case),
        other => return Err(format!("unknown schema {other:?}")),
    }
    Ok(())
}

fn vec3(case: &Case, name: &str) -> DVec3 {
    DVec3::from_array(case.vec3(name))
}

fn diffuse(report: &mut Report, file: &str, case: &Case) {
    let (p0, p1, n, m) = (
        vec3(case, "p0"),
        vec3(case, "p1"),
        vec3(case, "n"),
        vec3(case, "m"),
    );
    // Every cosine is formed accurately relative to itself, so no scale is needed.
    let got = ribbon::line_integral(p0, p1, n);
    report.add(file, "I_clip", case, case.error("I_clip", got, 0.0), LINE);
    let below = ribbon::line_integral(p0, p1, -n);
    // Scale of the signed integral: its two parts, which may cancel.
    report.add(
        file,
        "I",
        case,
        case.error("I", got - below, got + below),
        LINE,
    );
    let emit = ribbon::emitter(p0, p1, -m, ribbon::Sides::Both);
    let scale = p0.length().min(p1.length());
    // The vector m is perpendicular to the line only up to rounding: relative to the distance.
    report.add(
        file,
        "emit",
        case,
        case.error("emit", emit * sign(case.precise("emit").to_f64()), scale),
        LINE,
    );
}

fn sign(x: f64) -> f64 {
    1f64.copysign(x)
}

fn models(report: &mut Report, file: &str, case: &Case) {
    let (p0, p1, n) = (vec3(case, "p0"), vec3(case, "p1"), vec3(case, "n"));
    let mut add =
        |what: &str, got: f64| report.add(file, what, case, case.error(what, got, 0.0), LINE);
    add("cyl", cylinder::irradiance(p0, p1, n));
    add("solid", cylinder::solid_angle(p0, p1));
    let got = ribbon::reflected(
        p0,
        p1,
        n,
        vec3(case, "m"),
        ribbon::Sides::One,
        std::f64::consts::PI,
    );
    // The emitter's factor carries the rounding of m; see `diffuse`.
    let scale = p0.length().min(p1.length()) * ribbon::line_integral(p0, p1, n);
    report.add(file, "ribbon", case, case.error("ribbon", got, scale), LINE);
}

fn phong_line(report: &mut Report, file: &str, case: &Case) {
    let [p0, p1, n, m, r] = ["p0", "p1", "n", "m", "r"].map(|name| vec3(case, name));
    let got = phong::half_space(p0, p1, n, m, r, case.number("exponent"));
    let want = case.precise("J").to_f64();
    // Relative above 1e-280; below, the result only has to be small.
    let error = if want > 1e-280 {
        case.error("J", got, 0.0)
    } else if got < 1e-270 {
        0.0
    } else {
        f64::INFINITY
    };
    report.add(file, "J", case, error, PHONG);
}

fn polygons(report: &mut Report, file: &str, case: &Case) {
    let vertices: Vec<DVec3> = case
        .points::<3>("verts")
        .into_iter()
        .map(DVec3::from_array)
        .collect();
    let n = vec3(case, "n");
    let omega = case.precise("omega").to_f64().abs();
    report.add(
        file,
        "omega",
        case,
        case.error("omega", solid_angle::polygon(&vertices), 0.0),
        POLYGON,
    );
    let got = polygon::irradiance(&vertices, n) * sign(case.precise("E").to_f64());
    // Condition: the solid angle over the irradiance at grazing incidence, distance over height
    // where the light is seen edge-on.
    let scale = omega * edge_on(&vertices);
    report.add(file, "E", case, case.error("E", got, scale), POLYGON);
    // Relative to the lesser of the irradiance and the whole lobe; ends of lines are rounded by 8 ε
    // of the farthest vertex, over the distance of the nearest point of a side.
    let (r, k) = (vec3(case, "r"), case.number("exponent"));
    let most = got.abs().min(2.0 * std::f64::consts::PI / (k + 2.0));
    let got = phong_polygon::irradiance(&vertices, n, r, k);
    let next = vertices.iter().cycle().skip(1);
    let nearest = |(a, b): (&DVec3, &DVec3)| {
        let t = -a.dot(*b - *a) / (*b - *a).length_squared();
        a.lerp(*b, t.clamp(0.0, 1.0)).length()
    };
    let near = vertices
        .iter()
        .zip(next)
        .map(nearest)
        .fold(f64::INFINITY, f64::min);
    let far = vertices.iter().map(|v| v.length()).fold(0.0, f64::max);
    let rounding = 8.0 * f64::EPSILON * far / near;
    let bound = PHONG.max(rounding);
    report.add(
        file,
        "P",
        case,
        case.error("P", got, most) * (PHONG / bound),
        PHONG,
    );
}

/// How far edge-on the polygon is seen: the distance of its nearest vertex over the height of the
/// shading point above its plane; 1 where the foot of the height is inside.
fn edge_on(vertices: &[DVec3]) -> f64 {
    let (u, v) = (vertices[1] - vertices[0], vertices[2] - vertices[0]);
    let normal = u.cross(v).normalize_or_zero();
    let height = normal.dot(vertices[0]);
    let inside = (0..vertices.len()).all(|i| {
        let (a, b) = (vertices[i], vertices[(i + 1) % vertices.len()]);
        normal.dot(a.cross(b)) > 0.0
    });
    let nearest = vertices
        .iter()
        .map(|p| p.length())
        .fold(f64::INFINITY, f64::min);
    if inside {
        1.0
    } else {
        (nearest / height.abs()).max(1.0)
    }
}

fn linear(report: &mut Report, file: &str, case: &Case) {
    let (p0, p1, n) = (vec3(case, "p0"), vec3(case, "p1"), vec3(case, "n"));
    if case.flag("empty") {
        let got = cylinder::irradiance(p0, p1, n);
        report.add(
            file,
            "psa",
            case,
            if got <= 0.0 { 0.0 } else { f64::INFINITY },
            LINE,
        );
        return;
    }
    report.add(
        file,
        "psa",
        case,
        case.error("psa", cylinder::irradiance(p0, p1, n), 0.0),
        LINE,
    );
    if let Some(clipped) = linelit_shading::horizon::clip_segment(p0, p1, n) {
        let got = cylinder::solid_angle(clipped.p0, clipped.p1);
        // The rounded end moves the line's distance by eps |Q|: relative to the sine it subtends.
        let sine = clipped
            .p0
            .normalize()
            .cross(clipped.p1.normalize())
            .length();
        report.add(
            file,
            "sa",
            case,
            case.error("sa", got, 0.0) * sine.min(1.0),
            LINE,
        );
    }
}

fn solid(report: &mut Report, file: &str, case: &Case) {
    let z = case.number("z");
    let got = if case.text("kind") == "rect" {
        let [x0, x1, y0, y1] = ["x0", "x1", "y0", "y1"].map(|name| case.number(name));
        solid_angle::polygon(
            &[(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec3::new(x, y, z)),
        )
    } else {
        let points = case.points::<2>("pts");
        let [a, b, c] = [0, 1, 2].map(|i| DVec3::new(points[i][0], points[i][1], z));
        solid_angle::triangle(a, b, c)
    };
    report.add(file, "omega", case, case.error("omega", got, 0.0), POLYGON);
}
