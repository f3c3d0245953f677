//! Formulas, errors and costs of Peters 2021: linear lights in closed form, their samplers, and
//! blue noise.

use super::inverse::{self, antiderivative};
use super::{Numbers, Out, integral};
use crate::judged::bench::Bench;
use crate::measured::Measured;
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use linelit_elementary::{atan2, exp};
use linelit_film::{Image, Tile};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_integrator::{Renderer, Settings, ShadingPoint};
use linelit_lights::linear::{LineView, LinearSampler, LinearTechnique, ProjectedLine};
use linelit_lights::{AngularLines, Light, SolidAngleSampler};
use linelit_lights::{LineTechnique as _, LinearPointTechnique as _, PointTechnique as _};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_study::engine::CpuClock;
use linelit_study::scene_study::{Targets, all_pixels, render};
use linelit_testkit::peters_as_printed::sample_as_printed;
use std::f64::consts::PI;
use std::hint::black_box;

/// Compares Peters' eqs. 1, 2 and 5 with quadrature along the line.
pub(super) fn linear_lights(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let numbers = &mut Numbers::new(bench.context.seed);
    let mut worst = [0.0_f64; 4];
    for _ in 0..bench.pick(4, 100, 1000) {
        // Draw a line above the horizon.
        let start = DVec3::new(
            numbers.between(-2.0, 2.0),
            numbers.between(-2.0, 2.0),
            numbers.between(0.5, 2.0),
        );
        let s = numbers.direction();
        let s = DVec3::new(s.x, s.y, 0.5 * s.z.abs()).normalize();
        let length = numbers.between(0.2, 3.0);
        let q = start - start.dot(s) * s;
        // Along the line's own direction the integrands are no longer smooth.
        if q.length() < 0.3 {
            // Towards the line's own direction the integrands are no longer smooth.
            continue;
        }
        let at = |l: f64| start + l * s;
        // Solid angle per radius of an infinitesimal piece of the cylinder.
        let solid = |p: DVec3, s: DVec3| 2.0 * s.cross(p).length() / p.length().powi(3);
        // Eq. 1: the solid angle of a thin cylinder.
        let ends = [0.0, length].map(|l| at(l).dot(s) / at(l).length());
        let relative = |v: f64, exact: f64| (v / exact - 1.0).abs();
        let whole = integral(|l| solid(at(l), s), 0.0, length);
        worst[0] = worst[0].max(relative(2.0 / q.length() * (ends[1] - ends[0]), whole));
        // Eq. 2: the projected solid angle.
        let (ns, nt) = (s.z, q.z / q.length());
        let [first, last] = ends.map(|w| antiderivative([ns, nt], w.asin()));
        let printed = (last - first) / q.length();
        let exact = integral(|l| solid(at(l), s) * at(l).normalize().z, 0.0, length);
        worst[1] = worst[1].max(relative(printed, exact));
        // Eq. 5, and the inverse that is a square root.
        worst[2] = worst[2].max(transformed(numbers, at, s, length));
        let x = numbers.unit();
        worst[3] = worst[3].max((antiderivative([1.0, 0.0], x.sqrt().asin()) - x).abs());
    }
    for (name, worst) in ["eq. 1", "eq. 2", "eq. 5", "square root"]
        .into_iter()
        .zip(worst)
    {
        out.insert(format!("{name} of Peters"), Measured::exact(worst));
    }
    Ok(())
}

/// Returns the relative error of the light of a line by an LTC (a linearly transformed cosine) that
/// is computed in the space of the cosine with the factor of eq. 5.
fn transformed(numbers: &mut Numbers, at: impl Fn(f64) -> DVec3, s: DVec3, length: f64) -> f64 {
    // Draw a transform and evaluate its density.
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
    // Integrate along the line, and along the transformed line.
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
    // The factor of eq. 5 converts the width of the cylinder.
    let normal = s.cross(at(0.0));
    let factor = (m.transpose() * normal).length() / normal.length();
    // The clip at the horizon of the cosine is a kink, so lines that cross it are left out.
    if (inverse * at(0.0)).z <= 0.0 || (inverse * at(length)).z <= 0.0 {
        return 0.0;
    }
    (integral(cosine, 0.0, length) / factor / world - 1.0).abs()
}

/// Finds the worst backward error of the paper's iteration after two steps (§3.4).
pub(super) fn two_steps(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let cases = bench.pick(500, 400_000, 20_000_000);
    let worst = inverse::worst(cases, 2, bench.context.seed);
    let name = "backward error of two steps".to_owned();
    out.insert(name, Measured::exact(worst));
    Ok(())
}

/// Finds the worst backward errors in single precision of algorithms 1 and 2 as printed, over the
/// points of a room (Fig. 4): alone, and times the brightness relative to the brightest point. The
/// correct sample for the same input is computed in `f64`.
pub(super) fn single_precision(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    const SAMPLES: u32 = 16;
    let mut scene = bench.context.library.load("cornell-box-line")?.scene;
    let side = bench.pick(4, 64, 256);
    scene.set_resolution(side, side);
    let Some(Light::Linear(light)) = scene.lights.first().map(|l| &*l.light) else {
        bail!("the room has no linear light");
    };
    // Take half of the light, to keep away from the wall.
    let line = light.segment.piece(0.0, 0.5);
    let renderer = Renderer::new(&scene);
    let numbers = Sampler::new(SamplerKind::Independent, bench.context.seed);
    // Find the worst errors over all points and samples.
    let (mut raw, mut times, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (pixel, point) in &Targets::find(&renderer, &all_pixels(side, side)).points {
        let set = numbers.points(*pixel, 0, SAMPLES);
        let errors = (0..SAMPLES).filter_map(|i| backward_errors(&line, point, set.get_1d(i)));
        let worst = errors.fold(DVec3::ZERO, DVec3::max);
        raw = raw.max(worst.x);
        times = times.max(worst.x * worst.z);
        most = most.max(worst.z);
    }
    out.insert("f32, worst".to_owned(), Measured::exact(raw));
    out.insert(
        "f32, times brightness".to_owned(),
        Measured::exact(times / most),
    );
    Ok(())
}

/// Returns the backward errors of the algorithm as printed, in `f32`, and of ours, in `f64`, for
/// the same `f32` input, and the projected solid angle. `None` if no light arrives.
pub(crate) fn backward_errors(line: &Segment, point: &ShadingPoint, xi: f64) -> Option<DVec3> {
    // Round the input to single precision.
    let narrow = |v: DVec3| v.as_vec3().to_array();
    let [p0, p1] = [line.p0, line.p1].map(|p| narrow(p - point.position));
    let n = narrow(point.normal);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "single precision is the point"
    )]
    let xi = xi as f32;
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    // Sample by our algorithm, and find the random number that belongs to the sample.
    let exact = ProjectedLine::new(wide(p0), wide(p1), wide(n))?;
    let xi64 = f64::from(xi);
    let ours = exact.sample(xi64);
    let own = if exact.view().is_short() {
        (exact.invert_fractions(ours.lambda, ours.rest) - xi64).abs()
    } else {
        backward(&exact, ours.direction, xi64)
    };
    // Sample by the printed algorithm; no direction counts as the largest error.
    let printed = sample_as_printed(p0, p1, n, xi).map_or(1.0, |w| backward(&exact, wide(w), xi64));
    Some(DVec3::new(printed, own, exact.projected_solid_angle()))
}

/// Returns the backward error of a direction in the plane of the line; at most one, which is also
/// the error of an invalid direction.
fn backward(exact: &ProjectedLine, w: DVec3, xi: f64) -> f64 {
    let (p0, p1) = exact.view().ends();
    let axis = p0.cross(p1).normalize_or_zero();
    let v = atan2(p0.cross(w).dot(axis), p0.dot(w));
    let error = (exact.cdf(v.clamp(0.0, exact.view().angle())) - xi).abs();
    if error <= 1.0 { error } else { 1.0 }
}

/// Measures the times of making a sampler and of drawing one of its samples, by technique, at
/// points above a floor (Table 1). The techniques are timed in turns.
pub(super) fn costs(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    const POINTS: usize = 1024;
    const SAMPLES: usize = 128;
    // Set up a linear light, random shading points and numbers, and a quad for comparison.
    let light = Segment::new(DVec3::new(-1.0, 0.2, 1.0), DVec3::new(1.5, -0.3, 1.3));
    let numbers = &mut Numbers::new(bench.context.seed);
    let points: Vec<DVec3> = (0..POINTS)
        .map(|_| DVec3::new(numbers.between(-2.0, 2.0), numbers.between(-2.0, 2.0), 0.0))
        .collect();
    let numbers: Vec<f64> = (0..SAMPLES).map(|_| numbers.unit()).collect();
    let corner = DVec3::new(-0.5, -0.5, 1.0);
    let quad = ConvexPolygon::parallelogram(corner, DVec3::X, DVec3::new(0.0, 1.0, 0.3))?;
    // List our techniques.
    let mut entries: Vec<Entry<'_>> = LinearTechnique::ALL
        .into_iter()
        .map(|technique| {
            let make = move |x| LinearSampler::new(technique, &light, x, DVec3::Z);
            let one = |s: &LinearSampler, u| {
                black_box(s.sample(u));
            };
            Entry::new(technique.name(), &points, &numbers, make, one)
        })
        .collect();
    // To the error of Newton-bisection.
    entries.push(Entry::new(
        "two steps",
        &points,
        &numbers,
        |x| {
            let view =
                LineView::with_edge(light.p0 - x, light.p1 - x, light.vector(), Some(DVec3::Z));
            view.and_then(ProjectedLine::of)
        },
        |s: &ProjectedLine, u| {
            black_box(s.sample_coarse(u));
        },
    ));
    // Time all of them in turns.
    entries.extend(quads(&quad, &points, &numbers));
    for _ in 0..bench.pick(2, 40, 160) {
        entries.iter_mut().for_each(Entry::time);
    }
    for entry in &entries {
        for (what, times) in [("light", &entry.lights), ("sample", &entry.samples)] {
            let name = format!("time of a {what} by {}", entry.name);
            out.insert(name, Measured::geometric_mean(times));
        }
    }
    Ok(())
}

/// Returns entries for a quad by solid angle and by projected solid angle.
fn quads<'a>(quad: &'a ConvexPolygon, points: &'a [DVec3], numbers: &'a [f64]) -> [Entry<'a>; 2] {
    let second = |u: f64| (7.13 * u).fract();
    // Sample by solid angle. The second random number is derived from the first.
    let solid = Entry::new(
        "quad, solid angle",
        points,
        numbers,
        |x| Some(SolidAngleSampler::new(quad, x)),
        move |s: &SolidAngleSampler, u| {
            black_box(s.sample([u, second(u)]));
        },
    );
    // Sample by projected solid angle, along lines of the quad.
    let projected = Entry::new(
        "quad, projected",
        points,
        numbers,
        |x| {
            Some(AngularLines::by_projected_solid_angle(
                quad,
                0.0,
                x,
                DVec3::Z,
            ))
        },
        move |s: &AngularLines, u| {
            black_box(s.point(&s.sample(u), &[Interval::UNIT], second(u)));
        },
    );
    [solid, projected]
}

/// A technique that is timed: `make` makes samplers and draws one sample of each, `draw` draws many
/// samples of few.
struct Entry<'a> {
    name: &'static str,
    make: Box<dyn Fn() + 'a>,
    draw: Box<dyn Fn() + 'a>,
    lights: Vec<f64>,
    samples: Vec<f64>,
}

impl<'a> Entry<'a> {
    /// Creates an entry from the functions that make a sampler and that draw a sample.
    fn new<S>(
        name: &'static str,
        points: &'a [DVec3],
        numbers: &'a [f64],
        make: impl Fn(DVec3) -> Option<S> + Clone + 'a,
        one: impl Fn(&S, f64) + Clone + 'a,
    ) -> Self {
        let again = (make.clone(), one.clone());
        Self {
            name,
            // Make a sampler and draw one sample at every point.
            make: Box::new(move || {
                for (x, u) in points.iter().zip(numbers.iter().cycle()) {
                    if let Some(s) = make(black_box(*x)) {
                        one(&s, *u);
                    }
                }
            }),
            // Make a sampler at every sixteenth point, and draw many samples of it.
            draw: Box::new(move || {
                for s in points.iter().step_by(16).filter_map(|x| again.0(*x)) {
                    numbers.iter().for_each(|u| again.1(&s, black_box(*u)));
                }
            }),
            lights: Vec::new(),
            samples: Vec::new(),
        }
    }

    /// Times both functions once.
    fn time(&mut self) {
        for (run, times) in [
            (&self.make, &mut self.lights),
            (&self.draw, &mut self.samples),
        ] {
            let clock = CpuClock::start();
            run();
            times.push(clock.seconds());
        }
    }
}

/// Measures the squared error of pictures by white and by blue noise, as they are and after a blur
/// (Fig. 7).
pub(super) fn blurred(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let mut scene = bench.context.library.load("cornell-box-line")?.scene;
    let side = bench.pick(8, 80, 224);
    scene.set_resolution(side, side);
    let renderer = Renderer::new(&scene);
    // Render the true picture.
    let picture = |estimator: &str, sampler, seed| -> Result<Image> {
        let settings = Settings {
            estimator: estimator.parse()?,
            sampler,
            samples: 3,
            seed,
            show_lights: false,
            ..Settings::default()
        };
        let window = Tile::whole(side, side);
        Ok(render(&renderer, &settings, window, &ProgressBar::hidden()).0)
    };
    let exact = picture("line-analytic", SamplerKind::Stratified, 0)?;
    // Render each noise several times, and average the squared errors.
    for (name, sampler) in [
        ("independent, white", SamplerKind::Independent),
        ("independent, blue", SamplerKind::BlueNoiseIndependent),
        ("jittered, white", SamplerKind::UniformJitter),
        ("jittered, blue", SamplerKind::BlueNoise),
    ] {
        let (mut raw, mut after) = (Vec::new(), Vec::new());
        for k in 0..bench.pick(2, 6, 8) {
            let estimator = "point-linear[technique=clipped-solid-angle]";
            let image = picture(estimator, sampler, bench.context.seed.wrapping_add(k))?;
            let [plain, blurred] = squares(&image, &exact);
            raw.push(plain);
            after.push(blurred);
        }
        for (what, squares) in [("noise", raw), ("blurred noise", after)] {
            out.insert(
                format!("{what} of {name}"),
                Measured::positive_mean(&squares),
            );
        }
    }
    Ok(())
}

/// Returns the mean squared difference of two pictures, and that difference after both were blurred
/// by a Gaussian of 1.5 pixels, as an eye at a distance sees them. Blue noise loses more by the
/// blur than white noise.
fn squares(a: &Image, b: &Image) -> [f64; 2] {
    let pixels = a.rgb.iter().zip(&b.rgb);
    let error: Vec<DVec3> = pixels
        .map(|(p, q)| DVec3::from(p.map(f64::from)) - DVec3::from(q.map(f64::from)))
        .collect();
    let (w, h) = (a.width as usize, a.height as usize);
    let both = blur(&blur(&error, [w, h], 1), [w, h], w);
    let mean = |of: &[DVec3]| {
        let sum: f64 = of.iter().map(|e| e.length_squared()).sum();
        sum / (3.0 * of.len() as f64)
    };
    [mean(&error), mean(&both)]
}

/// Applies one pass of a separable blur, along rows (`stride` 1) or columns (`stride` the width).
/// Weights are normalized to pixels inside the image.
fn blur(image: &[DVec3], [w, h]: [usize; 2], stride: usize) -> Vec<DVec3> {
    const SIGMA: f64 = 1.5;
    let length = if stride == 1 { w } else { h };
    let blurred = |i: usize| {
        let at = if stride == 1 { i % w } else { i / w };
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for d in -6_i32..=6 {
            let Some(other) = at.checked_add_signed(d as isize).filter(|k| *k < length) else {
                continue;
            };
            let g = exp(-0.5 * (f64::from(d) / SIGMA).powi(2));
            total += g;
            sum += g * image[i + other * stride - at * stride];
        }
        sum / total
    };
    (0..w * h).map(blurred).collect()
}
