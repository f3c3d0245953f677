//! This module measures the errors of every integral, domain by domain, for the table and the plots
//! of accuracy.

use crate::polygon_oracle::Oracle as Positive;
use crate::{naive, oracle};
use linelit_geometry::DVec3;
use linelit_shading::{cylinder, polygon, ribbon, solid_angle};
use linelit_testkit::dd::Dd;
use linelit_testkit::precise::Wide;
use linelit_testkit::real::Real;
use linelit_testkit::rng::SplitMix64;

/// One evaluated input: its condition (for the plot), our error, and the error of the printed form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) condition: f64,
    pub(crate) ours: f64,
    pub(crate) printed: f64,
}

/// A row of the table.
#[derive(Debug)]
pub(crate) struct Row {
    pub(crate) function: &'static str,
    pub(crate) domain: &'static str,
    pub(crate) samples: Vec<Sample>,
    pub(crate) goal: f64,
}

impl Row {
    pub(crate) fn key(&self) -> String {
        format!("| {} | {} |", self.function, self.domain)
    }

    pub(crate) fn quantile(&self, q: f64, of: impl Fn(&Sample) -> f64) -> f64 {
        let mut errors: Vec<f64> = self.samples.iter().map(of).collect();
        if errors.is_empty() {
            return f64::NAN;
        }
        errors.sort_by(f64::total_cmp);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "an index below the length"
        )]
        let index = ((errors.len() - 1) as f64 * q).ceil() as usize;
        errors[index]
    }

    pub(crate) fn worst(&self) -> f64 {
        self.quantile(1.0, |s| s.ours)
    }
}

/// |got − want|/max(|want|, scale); infinite for what must never be: NaN, infinite, negative.
pub(crate) fn error(got: f64, want: Dd, scale: f64) -> f64 {
    if !(got >= 0.0 && got.is_finite()) {
        return f64::INFINITY;
    }
    let size = want.abs().to_f64().max(scale);
    let difference = (Dd::new(got) - want).abs().to_f64();
    if difference > 0.0 {
        difference / size
    } else {
        0.0
    }
}

pub(crate) fn printed_error(got: f64, want: Dd, scale: f64) -> f64 {
    let size = want.abs().to_f64().max(scale);
    let e = (got - want.to_f64()).abs() / size;
    if e.is_nan() { f64::INFINITY } else { e }
}

pub(crate) fn vector(rng: &mut SplitMix64) -> DVec3 {
    DVec3::from_array(rng.unit_vector())
}

pub(crate) fn log_uniform(rng: &mut SplitMix64, low: f64, high: f64) -> f64 {
    10f64.powf(rng.in_range(low, high))
}

pub(crate) const LINE_DOMAINS: [&str; 10] = [
    "ordinary",
    "grazing",
    "collinear",
    "through the line",
    "tiny",
    "huge",
    "far and short",
    "long",
    "at the horizon",
    "near and grazing",
];

/// A segment and a normal of a domain.
fn segment(domain: &str, rng: &mut SplitMix64) -> (DVec3, DVec3, DVec3) {
    let (a, b, n) = (vector(rng), vector(rng), vector(rng));
    let (a, b) = (
        a * log_uniform(rng, -1.0, 1.0),
        b * log_uniform(rng, -1.0, 1.0),
    );
    match domain {
        "grazing" => {
            let side = a.cross(b).normalize();
            (a, b, (side + n * log_uniform(rng, -13.0, -1.0)).normalize())
        }
        "collinear" => (
            a,
            a * rng.in_range(0.1, 5.0) + b * log_uniform(rng, -14.0, -1.0),
            n,
        ),
        "through the line" => (
            a,
            b * log_uniform(rng, -12.0, -1.0) - a * rng.in_range(0.1, 5.0),
            n,
        ),
        "near and grazing" => {
            let b = b * log_uniform(rng, -12.0, -1.0) - a * rng.in_range(0.1, 5.0);
            let along = (b - a).normalize();
            let side = n - along * along.dot(n);
            let tilt = log_uniform(rng, -13.0, -1.0) * rng.in_range(-1.0, 1.0);
            (a, b, (side.normalize() + along * tilt).normalize())
        }
        "tiny" => (a * 1e-30, b * 1e-30, n),
        "huge" => (a * 1e30, b * 1e30, n),
        "far and short" => (a, a + b * log_uniform(rng, -9.0, -1.0), n),
        "long" => (a, b * log_uniform(rng, 1.0, 9.0), n),
        "at the horizon" => {
            // An end in the horizon's plane up to rounding, or off by a little.
            let down = n.dot(a);
            (
                a - n * (down + log_uniform(rng, -17.0, -2.0) * rng.in_range(-1.0, 1.0)),
                b,
                n,
            )
        }
        _ => (a, b, n),
    }
}

/// The same, turned over where it would be dark.
pub(crate) fn lit_segment(domain: &str, rng: &mut SplitMix64) -> (DVec3, DVec3, DVec3) {
    let (a, b, n) = segment(domain, rng);
    if n.dot(a) <= 0.0 && n.dot(b) <= 0.0 {
        (a, b, -n)
    } else {
        (a, b, n)
    }
}

pub(crate) fn sine(a: DVec3, b: DVec3) -> f64 {
    linelit_geometry::predicates::cross(a, b).length() / (a.length() * b.length())
}

type Integral = fn(DVec3, DVec3, DVec3) -> f64;
type Oracle = fn([f64; 3], [f64; 3], [f64; 3]) -> Dd;

/// The Lambert line forms.
pub(crate) fn lines(count: usize) -> Vec<Row> {
    let functions: [(&str, Integral, Integral, Oracle); 2] = [
        (
            "ribbon::line_integral",
            ribbon::line_integral,
            naive::ribbon,
            oracle::ribbon,
        ),
        (
            "cylinder::irradiance",
            cylinder::irradiance,
            naive::cylinder,
            oracle::cylinder,
        ),
    ];
    let mut rows = Vec::new();
    for (function, ours, printed, exact) in functions {
        for domain in LINE_DOMAINS {
            let mut rng = SplitMix64::new(1);
            let samples = (0..count)
                .map(|_| {
                    let (a, b, n) = lit_segment(domain, &mut rng);
                    let want = exact(a.to_array(), b.to_array(), n.to_array());
                    Sample {
                        condition: 1.0 / sine(a, b),
                        ours: error(ours(a, b, n), want, 0.0),
                        printed: printed_error(printed(a, b, n), want, 1e-300),
                    }
                })
                .collect();
            rows.push(Row {
                function,
                domain,
                samples,
                goal: 1e-13,
            });
        }
    }
    rows
}

pub(crate) const POLYGON_DOMAINS: [&str; 7] = [
    "ordinary",
    "grazing",
    "edge-on",
    "tiny",
    "far",
    "at the horizon",
    "sliver",
];

/// Polygons that the shading point is as good as in the plane of.
const PLANE: &str = "in its plane";

/// Returns a triangle or a parallelogram in a plane (exactly, by equal coordinates) at a distance
/// of 10 to a power from `low` to `high`. The foot of the shading point is inside, on a side to
/// 1e-17 to 1e-8, or outside. The normal is the normal of the plane, nearly this normal, nearly in
/// the plane, or any, such that the horizon cuts the shape.
pub(crate) fn flat_shape(low: f64, high: f64, rng: &mut SplitMix64) -> (Vec<DVec3>, DVec3) {
    let mut flat = || [rng.in_range(-1.0, 1.0), rng.in_range(-1.0, 1.0)];
    let [o, a, b] = [flat(), flat(), flat()];
    let mut corners = vec![o, a, b];
    if rng.next_f64() < 0.5 {
        corners = vec![o, a, [a[0] + b[0] - o[0], a[1] + b[1] - o[1]], b];
    }
    let (s, t) = (rng.next_f64(), rng.next_f64());
    let (s, t) = match rng.below(3) {
        0 => (s.min(1.0 - t), t.min(1.0 - s)),
        1 => (s, log_uniform(rng, -17.0, -8.0) * rng.in_range(-1.0, 1.0)),
        _ => (3.0 * s - 1.0, -t),
    };
    let foot = [0, 1].map(|i| o[i] + s * (a[i] - o[i]) + t * (b[i] - o[i]));
    let height = log_uniform(rng, low, high);
    let turn = usize::try_from(rng.below(3)).expect("small");
    let placed = |v: [f64; 3]| DVec3::new(v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]);
    let up = placed([0.0, 0.0, 1.0]);
    let away = vector(rng);
    let n = match rng.below(4) {
        0 => up,
        1 => (up + away * log_uniform(rng, -15.0, -1.0)).normalize(),
        2 => (away - up * up.dot(away)
            + up * log_uniform(rng, -15.0, -1.0) * rng.in_range(-1.0, 1.0))
        .normalize(),
        _ => away,
    };
    let corner = |p: [f64; 2]| placed([p[0] - foot[0], p[1] - foot[1], height]);
    (corners.into_iter().map(corner).collect(), n)
}

/// Irradiance and solid angle from a plane: both by sums that lose the digits of the distance,
/// twice, of as many as it takes.
pub(crate) fn from_its_plane(corners: &[[f64; 3]], n: [f64; 3]) -> [f64; 2] {
    let coordinates = corners.iter().flatten().filter(|x| **x != 0.0);
    let least = coordinates.fold(1.0, |a: f64, b| a.min(b.abs()));
    if least > 1e-40 {
        oracle::wide_polygon::<Wide<512>>(corners, n)
    } else if least > 1e-150 {
        oracle::wide_polygon::<Wide<1280>>(corners, n)
    } else {
        oracle::wide_polygon::<Wide<2304>>(corners, n)
    }
}

/// Rows of [`flat_shape`].
fn flat_polygons(count: usize) -> [Row; 2] {
    let mut rng = SplitMix64::new(12);
    let (mut diffuse, mut solid) = (Vec::new(), Vec::new());
    while diffuse.len() < count {
        let (low, high) = if rng.next_f64() < 0.5 {
            (-300.0, -20.0)
        } else {
            (-20.0, -7.0)
        };
        let (corners, n) = flat_shape(low, high, &mut rng);
        let arrays: Vec<[f64; 3]> = corners.iter().map(|v| v.to_array()).collect();
        let [want, omega] = from_its_plane(&arrays, n.to_array());
        // Below the range of numbers, or nearly.
        if want < 1e-280 {
            continue;
        }
        let sample = |got: f64, want: f64, printed: f64| Sample {
            condition: 1.0 / omega,
            ours: error(got, Dd::new(want), 0.0),
            printed: printed_error(printed, Dd::new(want), 0.0),
        };
        diffuse.push(sample(
            polygon::irradiance(&corners, n),
            want,
            naive::polygon(&corners, n),
        ));
        solid.push(sample(
            solid_angle::polygon(&corners),
            omega,
            naive::solid_angle(&corners),
        ));
    }
    let row = |function, samples| Row {
        function,
        domain: PLANE,
        samples,
        goal: 1e-12,
    };
    [
        row("polygon::irradiance", diffuse),
        row("solid_angle::polygon", solid),
    ]
}

/// A triangle or a parallelogram, and a normal.
pub(crate) fn shape(domain: &str, rng: &mut SplitMix64) -> (Vec<DVec3>, DVec3) {
    let (o, u, v, mut n) = (vector(rng), vector(rng), vector(rng), vector(rng));
    let size = match domain {
        "far" => log_uniform(rng, -7.0, -1.0),
        _ => log_uniform(rng, -0.5, 0.5),
    };
    let (u, v) = (u * size, v * size);
    let mut corners = vec![o, o + u, o + v];
    if rng.next_f64() < 0.5 {
        corners = vec![o, o + u, o + u + v, o + v];
    }
    let facing = u.cross(v).normalize();
    let mut shift = DVec3::ZERO;
    match domain {
        "edge-on" => shift = facing * (log_uniform(rng, -7.0, -1.0) - facing.dot(o)),
        "grazing" => {
            let side = o.cross(u).normalize();
            n = (side + n * log_uniform(rng, -10.0, -1.0)).normalize();
        }
        "sliver" => {
            // One corner goes to the opposite side but for a little.
            let foot = corners[0].lerp(corners[1], rng.in_range(-0.2, 1.2));
            let off = corners[2] - foot;
            corners.truncate(3);
            corners[2] = foot + off * log_uniform(rng, -12.0, -2.0);
        }
        "at the horizon" => shift = n * (log_uniform(rng, -17.0, -3.0) - n.dot(o)),
        _ => {}
    }
    let scale = if domain == "tiny" { 1e-30 } else { 1.0 };
    for corner in &mut corners {
        *corner = (*corner + shift) * scale;
    }
    (corners, n)
}

/// Polygons: irradiance and solid angle.
pub(crate) fn polygons(count: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    let positive = Positive::new();
    for domain in POLYGON_DOMAINS {
        let mut rng = SplitMix64::new(2);
        let (mut diffuse, mut solid) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let (corners, n) = shape(domain, &mut rng);
            let arrays: Vec<[f64; 3]> = corners.iter().map(|v| v.to_array()).collect();
            let exact = oracle::triangle(arrays[0], arrays[1], arrays[2]);
            let omega = if arrays.len() == 4 {
                exact + oracle::triangle(arrays[0], arrays[2], arrays[3])
            } else {
                exact
            };
            let omega = omega.abs();
            let mut want = oracle::polygon(&arrays, n.to_array());
            // Lambert's sum cancels also in double-double; terms of one sign do not.
            if want.to_f64() < 1e-9 {
                want = Dd::new(positive.irradiance(&arrays, n.to_array()));
            }
            diffuse.push(Sample {
                condition: 1.0 / omega.to_f64(),
                ours: error(polygon::irradiance(&corners, n), want, 0.0),
                printed: printed_error(naive::polygon(&corners, n), want, 1e-300),
            });
            solid.push(Sample {
                condition: 1.0 / omega.to_f64(),
                ours: error(solid_angle::polygon(&corners), omega, 0.0),
                printed: printed_error(naive::solid_angle(&corners), omega, 1e-300),
            });
        }
        rows.push(Row {
            function: "polygon::irradiance",
            domain,
            samples: diffuse,
            goal: 1e-12,
        });
        rows.push(Row {
            function: "solid_angle::polygon",
            domain,
            samples: solid,
            goal: 1e-12,
        });
    }
    // Sums of hundreds of digits take ten milliseconds.
    rows.extend(flat_polygons(count.div_ceil(25)));
    rows.sort_by_key(|row| row.function);
    rows
}

/// Rows that are worse than the committed table says, or above their goal.
pub(crate) fn regressions(rows: &[Row], committed: &str) -> Vec<String> {
    let mut out = Vec::new();
    for row in rows {
        let key = row.key();
        let Some(line) = committed.lines().find(|line| line.starts_with(&key)) else {
            out.push(format!("{key} is not in the table"));
            continue;
        };
        let bound: f64 = line
            .split('|')
            .nth(4)
            .and_then(|c| c.trim().parse().ok())
            .unwrap_or(0.0);
        // The table is rounded to two digits.
        if row.worst() > 1.06 * bound {
            out.push(format!(
                "{key} worst {:.2e}, committed {bound:.1e}",
                row.worst()
            ));
        }
        if row.worst() > row.goal {
            out.push(format!(
                "{key} worst {:.2e} is above the goal {:.0e}",
                row.worst(),
                row.goal
            ));
        }
    }
    out
}
