//! This module measures the errors of all integrals with a lobe, domain by domain.

use crate::accuracy::{
    LINE_DOMAINS, Row, Sample, error, lit_segment, log_uniform, printed_error, sine, vector,
};
use crate::lobe_oracle::{self, Rule};
use crate::naive;
use linelit_geometry::{DVec3, Frame};
use linelit_shading::quadrature::{self, Model};
use linelit_shading::{phong, spherical_gaussian};
use linelit_testkit::dd::Dd;
use linelit_testkit::real::Real;
use linelit_testkit::rng::SplitMix64;

/// The domains of lines, and the sharpest lobes on ordinary ones.
fn domains(high: &'static str) -> impl Iterator<Item = &'static str> {
    LINE_DOMAINS.into_iter().chain([high])
}

/// An exponent from 0 to 1e5, most of them integers, a third of them below ten.
fn exponent(domain: &str, rng: &mut SplitMix64) -> f64 {
    let k = if domain.starts_with("exponent") {
        log_uniform(rng, 3.0, 5.0)
    } else if rng.next_f64() < 0.3 {
        rng.in_range(0.0, 10.0)
    } else {
        log_uniform(rng, 1.0, 5.0)
    };
    if rng.next_f64() < 0.7 || k < 1.0 {
        k.floor()
    } else {
        k
    }
}

/// Lobes whose own horizon cuts the line as well as the surface's does.
const BOTH: &str = "both horizons";

/// A segment, a normal and an axis of a domain.
fn lobe_segment(domain: &str, rng: &mut SplitMix64) -> (DVec3, DVec3, DVec3, DVec3) {
    let (a, b, n) = lit_segment(domain, rng);
    if domain != BOTH {
        return (a, b, n, axis(a, b, rng));
    }
    // Half of the axes are nearly perpendicular to the line, the others cut it at 1e-12 to 1 of its
    // length from where the surface does.
    if rng.next_f64() < 0.5 {
        let side = a.cross(b).normalize();
        return (
            a,
            b,
            n,
            (side + vector(rng) * log_uniform(rng, -13.0, -1.0)).normalize(),
        );
    }
    let first = rng.next_f64();
    let second = first + log_uniform(rng, -12.0, 0.0) * (rng.next_f64() - first).signum();
    let mut across = |t: f64| {
        let (v, p) = (vector(rng), a.lerp(b, t));
        (v - p * (v.dot(p) / p.length_squared())).normalize()
    };
    (a, b, across(first), across(second))
}

/// Half of the axes point at the line.
fn axis(a: DVec3, b: DVec3, rng: &mut SplitMix64) -> DVec3 {
    let along = if rng.next_f64() < 0.5 { 0.05 } else { 2.0 };
    (a.lerp(b, rng.next_f64()).normalize() + vector(rng) * along).normalize()
}

/// An integer exponent for the recursions, which take a time proportional to it: of every 25th
/// input.
fn integer(k: f64, index: usize) -> Option<u32> {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to 1e5"
    )]
    (k.fract() <= 0.0 && index.is_multiple_of(25)).then_some(k as u32)
}

/// Rows of two models that share an oracle.
struct Both {
    names: [&'static str; 2],
    samples: [Vec<Sample>; 2],
}

impl Both {
    fn new(names: [&'static str; 2]) -> Self {
        Self {
            names,
            samples: Default::default(),
        }
    }

    /// Results above 1e-280 count.
    fn add(&mut self, which: usize, condition: f64, got: f64, want: f64, printed: Option<f64>) {
        if want > 1e-280 && want < 1e280 {
            let want = Dd::new(want);
            self.samples[which].push(Sample {
                condition,
                ours: error(got, want, 0.0),
                printed: printed.map_or(f64::NAN, |p| printed_error(p, want, 0.0)),
            });
        }
    }

    fn rows(self, domain: &'static str, goal: f64) -> impl Iterator<Item = Row> {
        self.names
            .into_iter()
            .zip(self.samples)
            .map(move |(function, samples)| Row {
                function,
                domain,
                samples,
                goal,
            })
    }
}

/// Phong along both models.
pub(crate) fn phong_lines(count: usize) -> Vec<Row> {
    let rule = Rule::default();
    let mut rows = Vec::new();
    for domain in domains("exponent 1e3 to 1e5").chain([BOTH]) {
        let mut rng = SplitMix64::new(3);
        let mut both = Both::new(["phong::ribbon", "phong::cylinder"]);
        while both.samples[0].len() < count {
            let (a, b, n, r) = lobe_segment(domain, &mut rng);
            let k = exponent(domain, &mut rng);
            let [p, q, m, w] = [a, b, n, r].map(|v| v.to_array());
            // Closer to the line than that, the rounded ends themselves decide.
            if sine(a, b) < 1e-12 {
                continue;
            }
            let Some(want) = lobe_oracle::phong(&rule, p, q, m, w, k) else {
                continue;
            };
            let condition = (k + 1.0) / sine(a, b);
            let printed = integer(k, both.samples[0].len()).map(|k| naive::phong(a, b, n, r, k));
            let got = [phong::ribbon(a, b, n, r, k), phong::cylinder(a, b, n, r, k)];
            let want = [want.ribbon, want.cylinder];
            for i in 0..2 {
                both.add(i, condition, got[i], want[i], printed.map(|p| p[i]));
            }
        }
        rows.extend(both.rows(domain, 1e-10));
    }
    rows.sort_by_key(|row| row.function);
    rows
}

/// Spherical Gaussians along both models, sharpness 1e-2 to 1e4.
pub(crate) fn gaussians(count: usize) -> Vec<Row> {
    let rule = Rule::default();
    let mut rows = Vec::new();
    for domain in domains("sharpness 1e3 to 1e4") {
        let mut rng = SplitMix64::new(4);
        let mut both = Both::new(["spherical_gaussian::ribbon", "spherical_gaussian::cylinder"]);
        while both.samples[0].len() < count {
            let (a, b, n) = lit_segment(domain, &mut rng);
            let xi = axis(a, b, &mut rng);
            let low = if domain.starts_with("sharpness") {
                3.0
            } else {
                -2.0
            };
            let lambda = log_uniform(&mut rng, low, 4.0);
            if sine(a, b) < 1e-12 {
                continue;
            }
            let [p, q, m, w] = [a, b, n, xi].map(|v| v.to_array());
            let Some(want) = lobe_oracle::gaussian(&rule, p, q, m, w, lambda) else {
                continue;
            };
            let condition = (lambda + 1.0) / sine(a, b);
            let got = [
                spherical_gaussian::ribbon(a, b, n, xi, lambda),
                spherical_gaussian::cylinder(a, b, n, xi, lambda),
            ];
            let want = [want.ribbon, want.cylinder];
            for i in 0..2 {
                both.add(i, condition, got[i], want[i], None);
            }
        }
        rows.extend(both.rows(domain, 1e-10));
    }
    rows.sort_by_key(|row| row.function);
    rows
}

/// The axis, local and of any length, and the exponent of a cosine lobe.
fn some_lobe(rng: &mut SplitMix64) -> (DVec3, f64) {
    let mut v = |a: f64, b: f64| rng.in_range(a, b);
    let stretch = DVec3::new(v(-1.2, 0.6), v(-1.2, 0.6), v(0.6, 1.1));
    let view = DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), v(0.1, 1.0)).normalize();
    (stretch * view, 10f64.powf(v(0.0, 1.45)).floor())
}

/// Adaptive quadrature of cosine lobes of exponents below 30 that see both ends: a lit end that no
/// node meets stays unseen, as is said there. A segment through the shading point has ends that are
/// opposite, of which next to no lobe sees both: those domains are left out.
pub(crate) fn quadratures(count: usize) -> Vec<Row> {
    let rule = Rule::default();
    let domains = LINE_DOMAINS
        .into_iter()
        .filter(|d| *d != "through the line" && *d != "near and grazing");
    let row = |domain| {
        let mut rng = SplitMix64::new(11);
        let mut samples = Vec::new();
        while samples.len() < count {
            let (a, b, n) = lit_segment(domain, &mut rng);
            let frame = Frame::from_normal(n);
            let (local, k) = some_lobe(&mut rng);
            let axis = frame.to_world(local);
            if sine(a, b) < 1e-12 || axis.dot(a).min(axis.dot(b)) <= 0.0 {
                continue;
            }
            let [p, q, m, w] = [a, b, frame.z, axis].map(|v| v.to_array());
            let Some(want) = lobe_oracle::phong(&rule, p, q, m, w, k) else {
                continue;
            };
            let flat =
                linelit_shading::ribbon::line_integral(a, b, frame.z) * axis.length().powf(k);
            if want.ribbon <= 1e-3 * flat {
                continue;
            }
            let value = |w: DVec3| DVec3::splat(axis.dot(w).max(0.0).powf(k));
            let got = quadrature::line(a, b, frame.z, Model::Ribbon, value, 1e-10, 4000);
            samples.push(Sample {
                condition: (k + 1.0) / sine(a, b),
                ours: error(got.value.x, Dd::new(want.ribbon), 0.0),
                printed: f64::NAN,
            });
        }
        Row {
            function: "quadrature::line",
            domain,
            samples,
            goal: 1e-8,
        }
    };
    domains.map(row).collect()
}
