//! Formulas and algorithms as the papers print them, beside quadrature.
#![allow(clippy::disallowed_methods, reason = "one claim is of a time")]

use super::super::bench::{Bench, Figures};
use crate::measured::Measured;
use crate::peters_inverse::{self, antiderivative};
use anyhow::Result;
use linelit_geometry::{DMat3, DVec3};
use linelit_samplers::{Sampler, SamplerKind};
use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

/// Independent uniform numbers.
struct Numbers {
    sampler: Sampler,
    next: u32,
}

impl Numbers {
    fn new(seed: u64) -> Self {
        Self {
            sampler: Sampler::new(SamplerKind::Independent, seed),
            next: 0,
        }
    }

    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        self.next += 1;
        let block = self.next / BLOCK;
        let set = self.sampler.points([block, 0], 0, BLOCK);
        set.get_1d(self.next % BLOCK)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Of unit length.
    fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, 2.0 * PI).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// Numbers of a pattern.
const BLOCK: u32 = 1 << 12;

/// Simpson's rule with 2,000 steps: of integrands as smooth as those here an error below 1e-11 of
/// the largest value, by (b − a)⁵/180/n⁴ times a fourth derivative below 1e4.
fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    const STEPS: u32 = 2000;
    let h = (b - a) / f64::from(STEPS);
    let weight = |k: u32| match k {
        0 | STEPS => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=STEPS)
        .map(|k| weight(k) * f(a + h * f64::from(k)))
        .sum();
    sum * h / 3.0
}

/// All of them.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let mut numbers = Numbers::new(bench.context.seed);
    diffuse_line(bench, &mut numbers, &mut figures);
    phong_line(bench, &mut numbers, &mut figures);
    combination(&mut numbers, &mut figures);
    linear_lights(bench, &mut numbers, &mut figures);
    sequences(bench, &mut figures);
    let cases = bench.pick(500, 400_000, 20_000_000);
    let worst = peters_inverse::worst(cases, bench.context.seed).climbed;
    figures.insert(
        "backward error of two steps".to_owned(),
        Measured::exact(worst),
    );
    Ok(figures)
}

/// Billen & Dutré, eq. 20: as printed, and with F before both terms and D + l in place of C + l.
fn diffuse_line(bench: &Bench<'_>, numbers: &mut Numbers, figures: &mut Figures) {
    let (mut printed, mut mended) = (Vec::new(), 0.0_f64);
    for _ in 0..bench.pick(4, 200, 2000) {
        // A line above the plane of x at some distance from it.
        let origin = DVec3::new(
            numbers.between(-2.0, 2.0),
            numbers.between(-2.0, 2.0),
            numbers.between(1.0, 3.0),
        );
        let along = numbers.direction();
        let along = DVec3::new(along.x, along.y, 0.3 * along.z.abs()).normalize();
        let normal = along.cross(numbers.direction()).normalize();
        let l = numbers.between(0.2, 2.0);
        let (a, b, c) = (origin.z, along.z, origin.length_squared());
        let (d, f) = (origin.dot(along), origin.dot(normal));
        let q = c - d * d;
        let turn = (d / q.sqrt()).atan() - ((d + l) / q.sqrt()).atan();
        let first = (a - b * d) / (2.0 * q.powf(1.5)) * turn;
        let second = |x: f64| {
            let over = l * (b * c * (x + l) + a * (c - d * l - 2.0 * d * d));
            over / (2.0 * c * q * (l * l + 2.0 * d * l + c))
        };
        let integrand = |t: f64| (a + t * b) / (c + 2.0 * d * t + t * t).powi(2);
        let exact = -f * integral(integrand, 0.0, l);
        let relative = |v: f64| (v / exact - 1.0).abs();
        printed.push(relative(first - f * second(c)));
        mended = mended.max(relative(f * (first - second(d))));
    }
    printed.sort_by(f64::total_cmp);
    let median = printed[printed.len() / 2];
    figures.insert("eq. 20 as printed".to_owned(), Measured::exact(median));
    figures.insert("eq. 20 mended".to_owned(), Measured::exact(mended));
    // §5.1.2: a triangle of base 1.3 along the axis and height 0.8, whose area is 0.52.
    let (base, area) = (1.3, 0.52);
    let under = |peak: f64| Measured::exact(0.5 * base * peak);
    figures.insert(
        "density with its printed peak".to_owned(),
        under(2.0 / area),
    );
    figures.insert("density with its peak mended".to_owned(), under(2.0 / base));
}

/// ∫ cosⁿ by the recursion of eq. 16.
fn cosine_power(n: u32, theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    let (mut value, first) = if n.is_multiple_of(2) {
        (theta, 2)
    } else {
        (sin, 3)
    };
    let mut power = if first == 2 { cos } else { cos * cos };
    for k in (first..=n).step_by(2) {
        let k = f64::from(k);
        value = power * sin / k + (k - 1.0) / k * value;
        power *= cos * cos;
    }
    value
}

/// Eqs. 15, 16 and 24 against quadrature, and the time that the recursion takes.
fn phong_line(bench: &Bench<'_>, numbers: &mut Numbers, figures: &mut Figures) {
    let mut worst = 0.0_f64;
    let exponents = [1_u8, 2, 5, 20, 101];
    for k in 0..bench.pick(4, 100, 1000) {
        let n = exponents[k % exponents.len()];
        let (low, x, y) = (
            numbers.between(-1.2, 0.0),
            numbers.between(-1.0, 1.0),
            numbers.between(-1.0, 1.0),
        );
        let high = numbers.between(0.1, 1.2);
        let between = |f: &dyn Fn(f64) -> f64| f(high) - f(low);
        let cosines = |m: u8| between(&|u| cosine_power(u32::from(m), u));
        let with_sine =
            |m: u8| between(&|u: f64| -u.cos().powi(i32::from(m) + 1) / f64::from(m + 1));
        // sin² = 1 − cos².
        let closed = x.cos() * y.cos() * cosines(n + 2)
            - (x.cos() * y.sin() + x.sin() * y.cos()) * with_sine(n + 1)
            + x.sin() * y.sin() * (cosines(n) - cosines(n + 2));
        let integrand = |u: f64| u.cos().powi(i32::from(n)) * (u + x).cos() * (u + y).cos();
        let exact = integral(integrand, low, high);
        let scale = integral(|u| u.cos().powi(i32::from(n)), low, high);
        worst = worst.max((closed - exact).abs() / scale);
    }
    figures.insert("eq. 24".to_owned(), Measured::exact(worst));
    let time = |n: u32| {
        let mut least = f64::INFINITY;
        for _ in 0..bench.pick(2, 200, 2000) {
            let start = Instant::now();
            for k in 0..16 {
                // So near the axis that no power of a cosine is subnormal.
                black_box(cosine_power(black_box(n), 0.005 * f64::from(k)));
            }
            least = least.min(start.elapsed().as_secs_f64());
        }
        least
    };
    let growth = (time(10_000) / time(1_000)).log10();
    figures.insert(
        "growth of the recursion".to_owned(),
        Measured::exact(growth),
    );
}

/// Salesin & Jarosz, eq. 7, of two densities on [0, 1], expectations by quadrature: as printed, and
/// without the factor 1/S.
fn combination(numbers: &mut Numbers, figures: &mut Figures) {
    let (a, b) = (numbers.between(0.2, 0.8), numbers.between(0.2, 0.8));
    let density = |s: usize, x: f64| match s {
        0 => 2.0 * (a + (1.0 - 2.0 * a) * x),
        _ => 3.0 * x * x * b + 1.0 - b,
    };
    let integrand = |x: f64| 1.0 + (3.0 * x).sin();
    let counts = [1.0, 3.0];
    // E of the mean over N_s samples of w f/p is ∫ w f.
    let expectation = |s: usize| {
        let weight = |x: f64| {
            let all = counts[0] * density(0, x) + counts[1] * density(1, x);
            counts[s] * density(s, x) / all
        };
        integral(|x| weight(x) * integrand(x), 0.0, 1.0)
    };
    let exact = integral(integrand, 0.0, 1.0);
    let sum = (expectation(0) + expectation(1)) / exact;
    figures.insert("eq. 7 as printed".to_owned(), Measured::exact(sum / 2.0));
    figures.insert("eq. 7 mended".to_owned(), Measured::exact(sum));
}

/// What scrambling adds to the order of the root mean squared error of the integral of a ramp,
/// whose ends differ, by the first points of van der Corput's sequence.
fn sequences(bench: &Bench<'_>, figures: &mut Figures) {
    let trials = bench.pick(2, 64, 256);
    let scrambled = |samples: u32| {
        let square = |seed: u64| {
            let set = Sampler::new(SamplerKind::Sobol, seed).points([0, 0], 0, samples);
            let sum: f64 = (0..samples).map(|k| set.get_1d(k)).sum();
            (sum / f64::from(samples) - 0.5).powi(2)
        };
        ((0..trials).map(square).sum::<f64>() / trials as f64).sqrt()
    };
    let plain = |samples: u32| {
        let sum: f64 = (0..samples)
            .map(|k| f64::from(k.reverse_bits()) / 2f64.powi(32))
            .sum();
        (sum / f64::from(samples) - 0.5).abs()
    };
    let order = |few: f64, many: f64| (many / few).ln() / 256_f64.ln();
    let gain = order(scrambled(4), scrambled(1024)) - order(plain(4), plain(1024));
    figures.insert("a ramp, scrambled".to_owned(), Measured::exact(gain));
}

/// Peters, eqs. 1, 2 and 5 against quadrature along the line.
fn linear_lights(bench: &Bench<'_>, numbers: &mut Numbers, figures: &mut Figures) {
    let mut worst = [0.0_f64; 4];
    for _ in 0..bench.pick(4, 100, 1000) {
        let start = DVec3::new(
            numbers.between(-2.0, 2.0),
            numbers.between(-2.0, 2.0),
            numbers.between(0.5, 2.0),
        );
        let s = numbers.direction();
        let s = DVec3::new(s.x, s.y, 0.5 * s.z.abs()).normalize();
        let length = numbers.between(0.2, 3.0);
        let q = start - start.dot(s) * s;
        if q.length() < 0.3 {
            // Towards the line's own direction the integrands are no longer smooth.
            continue;
        }
        let at = |l: f64| start + l * s;
        // Solid angle per radius of an infinitesimal piece of the cylinder.
        let solid = |p: DVec3, s: DVec3| 2.0 * s.cross(p).length() / p.length().powi(3);
        let ends = [0.0, length].map(|l| at(l).dot(s) / at(l).length());
        let relative = |v: f64, exact: f64| (v / exact - 1.0).abs();
        let whole = integral(|l| solid(at(l), s), 0.0, length);
        worst[0] = worst[0].max(relative(2.0 / q.length() * (ends[1] - ends[0]), whole));
        let (ns, nt) = (s.z, q.z / q.length());
        let [first, last] = ends.map(|w| antiderivative([ns, nt], w.asin()));
        let printed = (last - first) / q.length();
        let exact = integral(|l| solid(at(l), s) * at(l).normalize().z, 0.0, length);
        worst[1] = worst[1].max(relative(printed, exact));
        worst[2] = worst[2].max(transformed(numbers, at, s, length));
        let x = numbers.unit();
        worst[3] = worst[3].max((antiderivative([1.0, 0.0], x.sqrt().asin()) - x).abs());
    }
    for (name, worst) in ["eq. 1", "eq. 2", "eq. 5", "square root"]
        .into_iter()
        .zip(worst)
    {
        figures.insert(format!("{name} of Peters"), Measured::exact(worst));
    }
}

/// The relative error of the light of a line by a linearly transformed cosine, found in the space
/// of the cosine with the factor of eq. 5.
fn transformed(numbers: &mut Numbers, at: impl Fn(f64) -> DVec3, s: DVec3, length: f64) -> f64 {
    let m = DMat3::from_cols(
        DVec3::new(numbers.between(0.5, 1.5), 0.0, numbers.between(-0.3, 0.3)),
        DVec3::new(0.0, numbers.between(0.5, 1.5), 0.0),
        DVec3::new(numbers.between(-0.3, 0.3), 0.0, 1.0),
    );
    let inverse = m.inverse();
    let solid = |p: DVec3, s: DVec3| 2.0 * s.cross(p).length() / p.length().powi(3);
    let density = |w: DVec3| {
        let c = inverse * w;
        (c.z / c.length()).max(0.0) / PI * inverse.determinant().abs() / c.length().powi(3)
    };
    let world = integral(
        |l| density(at(l).normalize()) * solid(at(l), s),
        0.0,
        length,
    );
    let stretched = (inverse * s).length();
    let cosine = |l: f64| {
        let p = inverse * at(l);
        (p.z / p.length()).max(0.0) / PI * solid(p, inverse * s / stretched) * stretched
    };
    let normal = s.cross(at(0.0));
    let factor = (m.transpose() * normal).length() / normal.length();
    // The clip at the horizon of the cosine is a kink: lines that meet it are left out.
    if (inverse * at(0.0)).z <= 0.0 || (inverse * at(length)).z <= 0.0 {
        return 0.0;
    }
    (integral(cosine, 0.0, length) / factor / world - 1.0).abs()
}
