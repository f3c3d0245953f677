//! Peters' worst case for the projected solid angle of a line, searched, reproduced and beaten; and the same in `f32`.
//!
//! ```text
//! cargo run --release -p linelit-lights --example backward_error -- [CASES]
//! ```
//!
//! The backward error of a sample is the change of the random number ξ that explains it: |CDF(sample) − ξ|.
//!
//! 1. `f64`: random lines with log-spaced distances from every singular position (CASES of them, 10⁷ if not given), then a
//!    local search from the worst, for 0 to 3 Halley steps and for the sampler as it is. Peters 2021, §3.4 reports 1.58e-5
//!    after two steps from 28 billion starts.
//! 2. `f32`: classes of lines, the paper's algorithms 1 and 2 as printed against ours; the CDF is evaluated in `f64` for
//!    the very same `f32` input.
#![allow(clippy::print_stdout, reason = "an example reports on stdout")]

use linelit_geometry::DVec3;
use linelit_lights::linear::{ArcPoint, ProjectedLine, sample_as_printed};
use std::f64::consts::FRAC_PI_2;

/// SplitMix64, so that the example needs nothing else.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        #[allow(clippy::cast_precision_loss, reason = "53 bits fit")]
        let bits = ((z ^ (z >> 31)) >> 11) as f64;
        bits / (1_u64 << 53) as f64
    }

    fn in_range(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next()
    }

    fn log(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.in_range(low, high))
    }

    fn sign(&mut self) -> f64 {
        if self.next() < 0.5 { -1.0 } else { 1.0 }
    }

    fn direction(&mut self) -> DVec3 {
        let z = self.in_range(-1.0, 1.0);
        let (s, c) = self.in_range(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * c, r * s, z)
    }
}

/// A case in the plane of the line: normal angle ν, end angles φ₀ < φ₁ from the closest point, random number ξ.
#[derive(Clone, Copy, Debug)]
struct Planar {
    nu: f64,
    phi: [f64; 2],
    xi: f64,
}

impl Planar {
    fn random(rng: &mut Random) -> Self {
        let end = |rng: &mut Random| {
            if rng.next() < 0.5 {
                rng.in_range(-FRAC_PI_2, FRAC_PI_2)
            } else {
                rng.sign() * (FRAC_PI_2 - rng.log(-5.0, 0.0))
            }
        };
        let (a, b) = (end(rng), end(rng));
        let phi = [a.min(b), a.max(b)];
        // Half of the normals graze one of the ends: n·ω = cos(φ − ν).
        let nu = if rng.next() < 0.5 {
            rng.in_range(-FRAC_PI_2, FRAC_PI_2)
        } else {
            let side = rng.sign();
            let end = phi[usize::from(rng.next() < 0.5)];
            end - side * (FRAC_PI_2 - rng.log(-6.0, -1.0))
        };
        let xi = match rng.next() {
            u if u < 0.4 => rng.next(),
            u if u < 0.7 => rng.log(-9.0, 0.0),
            _ => 1.0 - rng.log(-9.0, 0.0),
        };
        Self { nu, phi, xi }
    }

    fn perturbed(&self, rng: &mut Random, size: f64) -> Self {
        let mut out = *self;
        // Relative to the distance from the nearest singular position.
        let nudge = |x: f64, rng: &mut Random| {
            let room = FRAC_PI_2 - x.abs();
            x.signum() * (FRAC_PI_2 - room * (1.0 + size * rng.in_range(-1.0, 1.0)))
        };
        out.phi = out.phi.map(|p| nudge(p, rng));
        out.nu += size * rng.in_range(-1.0, 1.0) * (out.phi[1] - out.phi[0]).abs().min(1.0);
        let away = out.xi.min(1.0 - out.xi);
        out.xi = (out.xi + size * away * rng.in_range(-1.0, 1.0)).clamp(1e-9, 1.0 - 1e-9);
        if out.phi[0] > out.phi[1] {
            out.phi.swap(0, 1);
        }
        out
    }

    fn line(&self) -> Option<ProjectedLine<f64>> {
        let [a, b] = self.phi.map(|p| [p.tan(), 1.0, 0.0]);
        ProjectedLine::new(a, b, [self.nu.sin(), self.nu.cos(), 0.0])
    }

    /// Backward error after `steps`, or of the sampler as it is.
    fn error(&self, steps: Option<u32>) -> f64 {
        let Some(line) = self.line() else {
            return 0.0;
        };
        let got = match steps {
            Some(n) => line.cdf(line.angle_steps(self.xi, n)),
            None => {
                let arc = line.sample(self.xi);
                if line.view().is_short() {
                    line.invert(arc.lambda)
                } else {
                    line.cdf(angle_of(&line, &arc))
                }
            }
        };
        (got - self.xi).abs()
    }
}

/// The angle of a sample from the line's first end, by whichever output resolves it.
fn angle_of(line: &ProjectedLine<f64>, arc: &ArcPoint<f64>) -> f64 {
    let p0 = DVec3::from(line.view().ends().0);
    let w = DVec3::from(arc.direction);
    p0.cross(w).length().atan2(p0.dot(w))
}

fn search(cases: u64, steps: Option<u32>) -> (Planar, f64) {
    let mut rng = Random(steps.map_or(99, u64::from));
    let mut best: Vec<(Planar, f64)> = Vec::new();
    for _ in 0..cases {
        let case = Planar::random(&mut rng);
        let error = case.error(steps);
        if best.len() < 64 || error > best[63].1 {
            best.push((case, error));
            best.sort_by(|a, b| b.1.total_cmp(&a.1));
            best.truncate(64);
        }
    }
    for (case, error) in &mut best {
        let mut size = 0.3;
        for _ in 0..20_000 {
            let next = case.perturbed(&mut rng, size);
            let e = next.error(steps);
            if e > *error {
                (*case, *error) = (next, e);
                size = (size * 1.5).min(0.5);
            } else {
                size = (size * 0.995).max(1e-7);
            }
        }
    }
    best.into_iter()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((
            Planar {
                nu: 0.0,
                phi: [0.0; 2],
                xi: 0.0,
            },
            0.0,
        ))
}

fn exact_arithmetic(cases: u64) {
    println!("f64, {cases} random starts and local refinement; worst backward error in ξ");
    let rows = [Some(0), Some(1), Some(2), Some(3), None];
    let names = [
        "solid angle (0 steps)",
        "1 step",
        "2 steps (the paper)",
        "3 steps",
        "as sampled",
    ];
    for (steps, name) in rows.into_iter().zip(names) {
        let (case, error) = search(cases, steps);
        println!("  {name:22} {error:.4e}   at {case:?}");
    }
}

fn narrow(v: DVec3) -> [f32; 3] {
    #[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
    v.to_array().map(|x| x as f32)
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// A class of lines in general position.
fn class(name: &str, rng: &mut Random) -> (DVec3, DVec3) {
    let (a, b) = (rng.direction(), rng.direction());
    match name {
        "far 10" | "far 100" | "far 1000" => {
            let r: f64 = name[4..].parse().unwrap_or(1.0);
            (a * r, a * r + b)
        }
        "collinear 0.1" | "collinear 0.01" | "collinear 0.001" => {
            let h: f64 = name[10..].parse().unwrap_or(1.0);
            let side = a.cross(b).normalize() * h;
            (a + side, a * rng.in_range(1.1, 3.0) + side)
        }
        "through 0.001" => {
            let side = a.cross(b).normalize() * 1e-3;
            (
                side - a * rng.in_range(0.1, 2.0),
                side + a * rng.in_range(0.1, 2.0),
            )
        }
        _ => (a * rng.in_range(0.1, 3.0), b * rng.in_range(0.1, 3.0)),
    }
}

/// Backward error of a sample given by a point or direction in the line's fan.
fn backward(exact: &ProjectedLine<f64>, w: DVec3, xi: f64) -> f64 {
    let (a, _) = exact.view().ends();
    let p0 = DVec3::from(a);
    // Angle within the plane of the fan, signed so that a sample before the first end counts as outside.
    let axis = p0.cross(DVec3::from(exact.view().ends().1));
    let v = p0.cross(w).dot(axis.normalize()).atan2(p0.dot(w));
    let error = (exact.cdf(v.clamp(0.0, exact.view().angle())) - xi).abs();
    if error.is_nan() { f64::INFINITY } else { error }
}

fn single_precision(cases: u64) {
    println!("\nf32, {cases} lines a class; backward error in ξ: median / 99.9 % / max");
    println!("  {:16} {:32} ours", "class", "paper as printed");
    for name in [
        "random",
        "far 10",
        "far 100",
        "far 1000",
        "collinear 0.1",
        "collinear 0.01",
        "collinear 0.001",
        "through 0.001",
    ] {
        let mut rng = Random(5);
        let (mut paper, mut ours) = (Vec::new(), Vec::new());
        while (ours.len() as u64) < cases {
            let (p0, p1) = class(name, &mut rng);
            let (p0, p1, n) = (narrow(p0), narrow(p1), narrow(rng.direction()));
            let xi = narrow(DVec3::splat(rng.next()))[0];
            let f = |v: [f32; 3]| wide(v).to_array();
            let Some(exact) = ProjectedLine::new(f(p0), f(p1), f(n)) else {
                continue;
            };
            let Some(line) = ProjectedLine::new(p0, p1, n) else {
                // Above the horizon by less than the rounding of the cosines.
                continue;
            };
            let arc = line.sample(xi);
            let xi64 = f64::from(xi);
            ours.push(if exact.view().is_short() {
                (exact.invert(f64::from(arc.lambda)) - xi64).abs()
            } else {
                backward(&exact, wide(arc.direction), xi64)
            });
            let printed = sample_as_printed(p0, p1, n, xi)
                .map_or(f64::INFINITY, |w| backward(&exact, wide(w), xi64));
            paper.push(printed);
        }
        let summary = |mut e: Vec<f64>| {
            e.sort_by(f64::total_cmp);
            let at = |n: usize, d: usize| e[(e.len() - 1) * n / d];
            format!(
                "{:.1e} / {:.1e} / {:.1e}",
                at(1, 2),
                at(999, 1000),
                at(1, 1)
            )
        };
        println!("  {name:16} {:32} {}", summary(paper), summary(ours));
    }
}

fn main() {
    let cases = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(10_000_000);
    exact_arithmetic(cases);
    single_precision((cases / 10).clamp(1000, 1_000_000));
}
