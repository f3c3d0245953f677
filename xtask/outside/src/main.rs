//! The example `engine` of linelit as a program outside of the workspace, which uses linelit's
//! packages together with vectors of glam 0.29 and random numbers of rand 0.8. `cargo xtask test
//! package outside`, a part of `--long`, builds and runs it.

use glam::DVec3;
use linelit::geometry::{vector, ConvexPolygon};
use linelit::lights::{LineSampler, LineTechnique, OffsetDensity, PointTechnique, SolidAngleSampler};
use linelit::mis::balance;
use linelit::shading::ribbon::{reflected, Sides};
use linelit::visibility::{Between, Occluders, Scratch, ShaftQuery, VisibleLines};
use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{PI, TAU};
use std::process::ExitCode;

type Vector = DVec3;

/// The floor's normal, and its albedo over π.
const UP: Vector = DVec3::Z;
const REFLECTED: f64 = 0.5 / PI;
/// The radiance that the lamp emits.
const RADIANCE: f64 = 10.0;

/// The lower and upper corner of a box, and the triangles in it.
type Boxed = ([f32; 3], [f32; 3], Vec<[[f32; 3]; 3]>);

/// The engine's scene: a lamp, and triangles in boxes, one for each part of a table.
struct Engine {
    boxes: Vec<Boxed>,
    lamp: ConvexPolygon,
}

impl Engine {
    /// Creates a table under a lamp.
    fn new() -> Self {
        let lamp = ConvexPolygon::parallelogram([-0.5, -0.5, 3.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        let mut engine = Self { boxes: Vec::new(), lamp: lamp.expect("a square") };
        engine.add_box([-0.8, -0.5, 1.0], [0.8, 0.5, 1.1]);
        for [x, y] in [[-0.75, -0.45], [0.65, -0.45], [-0.75, 0.35], [0.65, 0.35]] {
            engine.add_box([x, y, 0.0], [x + 0.1, y + 0.1, 1.0]);
        }
        engine
    }

    /// Adds a box with the twelve triangles of its faces.
    fn add_box(&mut self, low: [f32; 3], high: [f32; 3]) {
        let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { low[k] } else { high[k] });
        let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let halves = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let triangles = halves.map(|t| t.map(corner)).collect();
        self.boxes.push((low, high, triangles));
    }

    /// Returns whether the engine's ray from `x` along `d` up to t = 1 meets no triangle (by Möller
    /// and Trumbore's test).
    fn is_free(&self, x: Vector, d: Vector) -> bool {
        !self.boxes.iter().flat_map(|(_, _, all)| all).any(|t| {
            let [a, b, c] = t.map(|v| DVec3::from_array(v.map(f64::from)));
            let (u, v, from) = (b - a, c - a, x - a);
            let (p, q) = (d.cross(v), from.cross(u));
            let volume = u.dot(p);
            let [s, r, t] = [from.dot(p), d.dot(q), v.dot(q)].map(|x| x / volume);
            s >= 0.0 && r >= 0.0 && s + r <= 1.0 && t > 1e-6 && t < 1.0 - 1e-6
        })
    }

    /// Returns the vector from `x` to the point where a direction meets the lamp, if it does.
    fn to_lamp(&self, x: Vector, d: Vector) -> Option<Vector> {
        let t = (3.0 - x.z) / d.z;
        let to = d * t;
        let meets = |k: usize| (x[k] + to[k]).abs() < 0.5;
        (t > 0.0 && meets(0) && meets(1)).then_some(to)
    }

    /// Estimates the light at `x` by one point of the lamp, uniform in solid angle, and a ray.
    fn by_points(&self, x: Vector, random: &mut Pcg64Mcg) -> f64 {
        let sample = SolidAngleSampler::new(&self.lamp, vector(x.to_array())).sample(random.gen());
        let d = DVec3::from(sample.point.to_array()) - x;
        if !self.is_free(x, d) {
            return 0.0;
        }
        RADIANCE * REFLECTED * UP.dot(d.normalize()) / sample.pdf.value()
    }

    /// Estimates the light at `x` by one line of the lamp, integrating along its visible parts.
    fn by_lines(&self, x: Vector, random: &mut Pcg64Mcg, room: &mut Room) -> f64 {
        let sampler = LineSampler::new(&self.lamp, random.gen_range(0.0..PI), OffsetDensity::Uniform);
        let sample = sampler.sample(random.gen());
        // Gather the triangles in boxes that may be between the point and the lamp.
        let between = Between::new(x.to_array(), &self.lamp);
        let boxes = self.boxes.iter();
        let boxes = boxes.filter(|(low, high, _)| between.may_meet(*low, *high));
        let occluders = Occluders::from_triangles(boxes.flat_map(|(_, _, all)| all).copied());
        // Find the visible parts of the line, and integrate the reflected light along them.
        let mut shaft = occluders.shaft(ShaftQuery::new(x.to_array(), &self.lamp), &mut room.scratch);
        shaft.visible(&[sample.segment], &mut room.visible);
        let (line, down) = (sample.segment.relative_to(vector(x.to_array())), self.lamp.normal());
        let parts = room.visible.line(0).iter();
        let along = parts.map(|part| {
            reflected(line.at(part.lo), line.at(part.hi), vector(UP.to_array()), down, Sides::One, 0.5)
        });
        RADIANCE * along.sum::<f64>() / sample.pdf.value()
    }

    /// Estimates the light at `x` by one point of the lamp and one direction sampled by the cosine,
    /// weighted by the balance heuristic.
    fn by_both(&self, x: Vector, random: &mut Pcg64Mcg) -> f64 {
        let technique = SolidAngleSampler::new(&self.lamp, vector(x.to_array()));
        let point = DVec3::from(technique.sample(random.gen()).point.to_array()) - x;
        let (r2, turn) = (random.gen::<f64>(), TAU * random.gen::<f64>());
        let across = r2.sqrt();
        let direction = DVec3::new(across * turn.cos(), across * turn.sin(), (1.0 - r2).sqrt());
        let both = [Some(point), self.to_lamp(x, direction)];
        let one = |(i, d): (usize, Option<Vector>)| {
            let d = d?;
            let by_light = technique.pdf(vector((x + d).to_array())).value();
            let cosine = UP.dot(d.normalize());
            let densities = [by_light, cosine / PI];
            let weight = balance(&[1.0; 2], &densities, i) / densities[i];
            self.is_free(x, d).then_some(RADIANCE * REFLECTED * cosine * weight)
        };
        both.into_iter().enumerate().filter_map(one).sum()
    }
}

/// The memory that lines reuse from one point to the next.
#[derive(Default)]
struct Room {
    scratch: Scratch,
    visible: VisibleLines,
}

/// The number of pixels along each side of the floor, which is 4 by 4 metres.
const SIDE: u32 = 16;
/// The number of samples of a pixel by each of the three estimators.
const SAMPLES: u32 = 400;

pub(crate) fn main() -> ExitCode {
    let (engine, mut room, mut random) = (Engine::new(), Room::default(), Pcg64Mcg::seed_from_u64(1));
    // The sums over the floor of the three estimates and of their variances.
    let (mut sums, mut picture) = ([[0.0; 2]; 3], String::new());
    for row in 0..SIDE {
        for column in 0..SIDE {
            let at = |k: u32| (f64::from(k) + 0.5) * 4.0 / f64::from(SIDE) - 2.0;
            let (x, mut pixel) = (DVec3::new(at(column), at(row), 1e-4), [[0.0; 2]; 3]);
            for _ in 0..SAMPLES {
                let values = [
                    engine.by_points(x, &mut random),
                    engine.by_lines(x, &mut random, &mut room),
                    engine.by_both(x, &mut random),
                ];
                for (sum, value) in pixel.iter_mut().zip(values) {
                    *sum = [sum[0] + value, sum[1] + value * value];
                }
            }
            let n = f64::from(SAMPLES);
            for (sum, [first, second]) in sums.iter_mut().zip(pixel) {
                let mean = first / n;
                *sum = [sum[0] + mean, sum[1] + (second / n - mean * mean) / (n - 1.0)];
            }
            let bright = 20.0 * pixel[1][0] / n;
            let shades = ".:-=+#".chars().zip(1..);
            let shade = shades.take_while(|(_, k)| f64::from(*k) <= 1.0 + bright).last();
            picture.extend([shade.map_or(' ', |(c, _)| c); 2]);
        }
        picture.push('\n');
    }
    print!("{picture}");
    for ([mean, variance], name) in sums.iter().zip(["points", "lines", "both"]) {
        println!("{name:>6} {mean:.4} ± {:.4}", variance.sqrt());
    }
    // Compare each pair; of runs with other seeds, one in 10⁵ would fail by chance.
    let z = |i: usize, j: usize| (sums[i][0] - sums[j][0]) / (sums[i][1] + sums[j][1]).sqrt();
    let worst = [z(0, 1), z(1, 2), z(2, 0)].into_iter().fold(0.0, |w: f64, z| w.max(z.abs()));
    println!("they differ by {worst:.2} standard errors at most");
    if worst < 4.6 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
