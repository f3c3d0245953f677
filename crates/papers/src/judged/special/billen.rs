//! Formulas and costs of Billen & Dutré 2016: the light of a line in closed form, and the cost of
//! its visibility.

use super::{Numbers, Out, integral};
use crate::judged::bench::Bench;
use crate::measured::Measured;
use anyhow::Result;
use linelit_geometry::{DVec3, Segment, ShadowTriangle};
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use linelit_study::engine::CpuClock;
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines};
use std::hint::black_box;
use std::time::Instant;

/// Compares eq. 20 of Billen & Dutré 2016 with quadrature: as printed, and corrected, that is, with
/// the paper's factor F before both terms and with its D + l in place of C + l. Also integrates the
/// density of the paper's §5.1.2, as printed and corrected.
pub(super) fn diffuse_line(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let numbers = &mut Numbers::new(bench.context.seed);
    let (mut printed, mut mended) = (Vec::new(), 0.0_f64);
    for _ in 0..bench.pick(4, 200, 2000) {
        // Draw a line above the plane of the receiver, at some distance from it.
        let origin = DVec3::new(
            numbers.between(-2.0, 2.0),
            numbers.between(-2.0, 2.0),
            numbers.between(1.0, 3.0),
        );
        let along = numbers.direction();
        let along = DVec3::new(along.x, along.y, 0.3 * along.z.abs()).normalize();
        let normal = along.cross(numbers.direction()).normalize();
        let l = numbers.between(0.2, 2.0);
        // Evaluate both terms of eq. 20; `second(c)` is the printed one, `second(d)` the corrected
        // one.
        let (a, b, c) = (origin.z, along.z, origin.length_squared());
        let (d, f) = (origin.dot(along), origin.dot(normal));
        let q = c - d * d;
        let turn = (d / q.sqrt()).atan() - ((d + l) / q.sqrt()).atan();
        let first = (a - b * d) / (2.0 * q.powf(1.5)) * turn;
        let second = |x: f64| {
            let over = l * (b * c * (x + l) + a * (c - d * l - 2.0 * d * d));
            over / (2.0 * c * q * (l * l + 2.0 * d * l + c))
        };
        // Compare both with quadrature.
        let integrand = |t: f64| (a + t * b) / (c + 2.0 * d * t + t * t).powi(2);
        let exact = -f * integral(integrand, 0.0, l);
        let relative = |v: f64| (v / exact - 1.0).abs();
        printed.push(relative(first - f * second(c)));
        mended = mended.max(relative(f * (first - second(d))));
    }
    printed.sort_by(f64::total_cmp);
    let median = printed[printed.len() / 2];
    out.insert("eq. 20 as printed".to_owned(), Measured::exact(median));
    out.insert("eq. 20 mended".to_owned(), Measured::exact(mended));
    // §5.1.2: a triangular density of base 1.3 along the axis and height 0.8, so that its area is
    // 0.52, has to integrate to one.
    let (base, area) = (1.3, 0.52);
    let under = |peak: f64| Measured::exact(0.5 * base * peak);
    out.insert(
        "density with its printed peak".to_owned(),
        under(2.0 / area),
    );
    out.insert("density with its peak mended".to_owned(), under(2.0 / base));
    Ok(())
}

/// Evaluates an antiderivative of cosⁿ by the recursion of eq. 16.
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

/// Compares eqs. 15, 16 and 24 with quadrature, and times the recursion.
pub(super) fn phong_line(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let numbers = &mut Numbers::new(bench.context.seed);
    let mut worst = 0.0_f64;
    let exponents = [1_u8, 2, 5, 20, 101];
    for k in 0..bench.pick(4, 100, 1000) {
        let n = exponents[k % exponents.len()];
        // Draw an interval of angles and the offsets of two more cosines.
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
        // Evaluate the product of all cosines in closed form, with sin² = 1 − cos².
        let closed = x.cos() * y.cos() * cosines(n + 2)
            - (x.cos() * y.sin() + x.sin() * y.cos()) * with_sine(n + 1)
            + x.sin() * y.sin() * (cosines(n) - cosines(n + 2));
        // Compare with quadrature, relative to the integral of the power alone.
        let integrand = |u: f64| u.cos().powi(i32::from(n)) * (u + x).cos() * (u + y).cos();
        let exact = integral(integrand, low, high);
        let scale = integral(|u| u.cos().powi(i32::from(n)), low, high);
        worst = worst.max((closed - exact).abs() / scale);
    }
    out.insert("eq. 24".to_owned(), Measured::exact(worst));
    // Time the recursion for a power of 1,000 and for one of 10,000.
    let time = |n: u32| {
        let mut least = f64::INFINITY;
        for _ in 0..bench.pick(2, 200, 2000) {
            let start = Instant::now();
            for k in 0..16 {
                // The angles are so close to the axis that no power of a cosine is subnormal.
                black_box(cosine_power(black_box(n), 0.005 * f64::from(k)));
            }
            least = least.min(start.elapsed().as_secs_f64());
        }
        least
    };
    let growth = (time(10_000) / time(1_000)).log10();
    out.insert(
        "time of the recursion, power".to_owned(),
        Measured::exact(growth),
    );
    Ok(())
}

/// Counts the box and triangle tests of a shadow triangle in growing scenes (§6.2 claims O(log n +
/// m)). Two numbers come out: how many times more tests there are among 2⁸ times as many triangles
/// of which the same number are in the way, and the power of m with which tests grow among 2⁴ times
/// as many triangles in the way, where m is the number of triangles that hide a part of the line.
pub(super) fn growth(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    const FEW: u32 = 1 << 10;
    let lines = bench.pick(8, 512, 4096);
    let seed = bench.context.seed;
    // Count tests among few triangles, among the same with many more far away, and among many.
    let few = Tests::among(&soup(FEW, 0, seed), lines, seed);
    let beside = bench.pick(FEW, 255 * FEW, 255 * FEW);
    let beside = Tests::among(&soup(FEW, beside, seed), lines, seed);
    let dense = Tests::among(&soup(bench.pick(2, 16, 16) * FEW, 0, seed), lines, seed);
    // The factor by which tests grow off to the side; and, among many, the growth of tests as a
    // power of the growth of m.
    let ratio = |a: &[f64], b: &[f64]| Measured::positive_mean(a).over(Measured::positive_mean(b));
    out.insert(
        "tests, more beside".to_owned(),
        ratio(&beside.all, &few.all),
    );
    let power = ratio(&dense.all, &few.all).map(f64::ln);
    let blockers = ratio(&dense.blockers, &few.blockers).value.ln();
    out.insert("tests, power of m".to_owned(), power.map(|p| p / blockers));
    Ok(())
}

/// Returns the corners, three each, of small triangles between a floor and a light, and of more
/// triangles that are off to the side.
fn soup(between: u32, beside: u32, seed: u64) -> Vec<[f32; 3]> {
    let mut numbers = Numbers::new(seed);
    let mut corners = Vec::new();
    for k in 0..between + beside {
        let shift = if k < between { 0.0 } else { 3.0 };
        let [x, y] = [(); 2].map(|()| numbers.between(-1.0, 1.0));
        let centre = DVec3::new(x + shift, y, numbers.between(0.15, 0.85));
        for _ in 0..3 {
            let off = [(); 3].map(|()| numbers.between(-0.03, 0.03));
            corners.push((centre + DVec3::from(off)).as_vec3().to_array());
        }
    }
    corners
}

/// The numbers of tests of single shadow triangles in a scene.
struct Tests {
    /// The numbers of boxes and triangles that are tested.
    all: Vec<f64>,
    /// The numbers of triangles that hide a part of the line.
    blockers: Vec<f64>,
}

impl Tests {
    /// Counts the tests for random lines seen from random points.
    fn among(corners: &[[f32; 3]], lines: u32, seed: u64) -> Self {
        // Build the hierarchy over the triangles.
        let triangles: Vec<[u32; 3]> = (0..)
            .step_by(3)
            .take(corners.len() / 3)
            .map(|k| [k, k + 1, k + 2])
            .collect();
        let occluders = Occluders::build(corners, &triangles);
        let wide: Vec<DVec3> = corners
            .iter()
            .map(|c| DVec3::from(c.map(f64::from)))
            .collect();
        let mut numbers = Numbers::new(seed ^ 1);
        let (mut scratch, mut visible) = (Scratch::new(), VisibleLines::new());
        let (mut all, mut blockers) = (Vec::new(), Vec::new());
        for _ in 0..lines {
            // Draw a point on the floor and a line on the light.
            let mut place = |z| {
                let [x, y] = [(); 2].map(|()| numbers.between(-0.8, 0.8));
                DVec3::new(x, y, z)
            };
            let (point, line) = (place(0.0), Segment::new(place(1.0), place(1.0)));
            // Count the tests of one query.
            let ends = [line.p0, line.p1];
            let mut shaft = occluders.shaft(ShaftQuery::new(point, &ends), &mut scratch);
            shaft.visible(std::slice::from_ref(&line), &mut visible);
            let counters = std::mem::take(&mut scratch.counters);
            all.push((counters.node_tests + counters.triangle_tests) as f64);
            // Count the triangles in the way by trying each.
            let Some(shadow) = ShadowTriangle::new(point, &line) else {
                continue;
            };
            let hides = |c: &&[DVec3; 3]| shadow.blocked_by(c).is_some();
            blockers.push(wide.as_chunks::<3>().0.iter().filter(hides).count() as f64);
        }
        Self { all, blockers }
    }
}

/// Measures the fraction of the processor time of one line at a point that visibility takes, walk
/// and clipping together (§6.2): how much longer the same estimates take than without any occluder,
/// timed in turns.
pub(super) fn share(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let mut settings = Settings {
        estimator: "line-analytic[orientation=parallel,control=none]".parse()?,
        sampler: SamplerKind::Independent,
        samples: 1,
        seed: bench.context.seed,
        // As the paper means it, no work is skipped.
        skip: false,
        ..Settings::default()
    };
    let [width, height] = bench.pick([4; 2], [24; 2], [48; 2]);
    for name in SHARES {
        // Make a copy of the scene in which all triangles are degenerate.
        let mut scene = bench.context.library.load(name)?.scene;
        scene.set_resolution(width, height);
        let mut bare = scene.clone();
        bare.triangles.fill([0; 3]);
        let (renderer, empty) = (Renderer::new(&scene), Renderer::new(&bare));
        // Time the estimates of all points with and without occluders.
        let targets = Targets::find(&renderer, &all_pixels(width, height));
        let mut workspace = Workspace::new();
        let mut time = |renderer: &Renderer<'_>, passes: u32| {
            let clock = CpuClock::start();
            for pass in 0..passes {
                settings.seed = bench.context.seed.wrapping_add(pass.into());
                for (pixel, point) in &targets.points {
                    let light = renderer.direct(&settings, point, *pixel, &mut workspace);
                    black_box(light);
                }
            }
            clock.seconds()
        };
        // The fraction is one minus the ratio of the times.
        let passes = bench.pick(1, 4, 16);
        let ratios: Vec<f64> = (0..bench.pick(3, 12, 24))
            .map(|_| time(&empty, passes) / time(&renderer, passes))
            .collect();
        let rest = Measured::geometric_mean(&ratios);
        let walk = Measured::exact(1.0).minus(rest);
        out.insert(format!("time of visibility, {name}"), walk);
    }
    Ok(())
}

/// The scenes in which visibility's fraction of the time is measured.
const SHARES: [&str; 3] = [
    "grid-planes-large",
    "triangle-soup-large",
    "colonnade-large",
];
