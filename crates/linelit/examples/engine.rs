//! A small renderer that uses single parts of linelit: its vectors are arrays, its triangles and
//! rays its own, and its random numbers come from `rand`. It lights a floor under a table by
//! points, by lines and by two techniques together, tests whether the three agree, and prints the
//! floor.
//!
//! ```text
//! cargo run --release --example engine
//! ```

#![allow(clippy::print_stdout, reason = "a program")]

use linelit::geometry::{ConvexPolygon, vector};
use linelit::lights::{
    LineSampler, LineTechnique, OffsetDensity, PointTechnique, SolidAngleSampler,
};
use linelit::mis::balance;
use linelit::shading::ribbon::{Sides, reflected};
use linelit::visibility::{Occluders, Scratch, ShaftQuery, SpaceBetween, VisibleLines};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{PI, TAU};
use std::process::ExitCode;

type Vector = [f64; 3];

fn add(a: Vector, b: Vector, factor: f64) -> Vector {
    [0, 1, 2].map(|k| a[k] + factor * b[k])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| a[i] * b[j] - a[j] * b[i])
}

/// The floor's normal.
const UP: Vector = [0.0, 0.0, 1.0];
/// The floor's BRDF: its albedo over π.
const REFLECTED: f64 = 0.5 / PI;
/// The radiance that the lamp emits.
const RADIANCE: f64 = 10.0;

/// The lower and the upper corner of a bounding box, and the triangles in it.
type Boxed = ([f32; 3], [f32; 3], Vec<[[f32; 3]; 3]>);

/// The engine's scene: bounding boxes with their triangles, one for each part of the table, and a
/// lamp.
struct Engine {
    boxes: Vec<Boxed>,
    lamp: ConvexPolygon,
}

impl Engine {
    fn new() -> Self {
        let lamp =
            ConvexPolygon::parallelogram([-0.5, -0.5, 3.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        let mut engine = Self {
            boxes: Vec::new(),
            lamp: lamp.expect("a square"),
        };
        engine.add_box([-0.8, -0.5, 1.0], [0.8, 0.5, 1.1]);
        for [x, y] in [[-0.75, -0.45], [0.65, -0.45], [-0.75, 0.35], [0.65, 0.35]] {
            engine.add_box([x, y, 0.0], [x + 0.1, y + 0.1, 1.0]);
        }
        engine
    }

    fn add_box(&mut self, low: [f32; 3], high: [f32; 3]) {
        let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { low[k] } else { high[k] });
        let faces = [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ];
        let halves = faces
            .into_iter()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let triangles = halves.map(|t| t.map(corner)).collect();
        self.boxes.push((low, high, triangles));
    }

    /// Returns whether a ray of the engine, from `x` along `d` up to t = 1, meets no triangle, by
    /// the test of Möller and Trumbore.
    fn is_free(&self, x: Vector, d: Vector) -> bool {
        !self.boxes.iter().flat_map(|(_, _, all)| all).any(|t| {
            let [a, b, c] = t.map(|v| v.map(f64::from));
            let (u, v, from) = (add(b, a, -1.0), add(c, a, -1.0), add(x, a, -1.0));
            let (p, q) = (cross(d, v), cross(from, u));
            let volume = dot(u, p);
            let [s, r, t] = [dot(from, p), dot(d, q), dot(v, q)].map(|x| x / volume);
            s >= 0.0 && r >= 0.0 && s + r <= 1.0 && t > 1e-6 && t < 1.0 - 1e-6
        })
    }

    /// Returns the vector from `x` to the point where a direction meets the lamp; `None` if it does
    /// not.
    fn to_lamp(&self, x: Vector, d: Vector) -> Option<Vector> {
        let t = (3.0 - x[2]) / d[2];
        let to = d.map(|k| k * t);
        let meets = |k: usize| (x[k] + to[k]).abs() < 0.5;
        (t > 0.0 && meets(0) && meets(1)).then_some(to)
    }

    /// Estimates the reflected radiance by one point of the lamp, drawn by solid angle, and a ray.
    fn by_points(&self, x: Vector, random: &mut Pcg64Mcg) -> f64 {
        let sample = SolidAngleSampler::new(&self.lamp, vector(x)).sample(random.random());
        let d = add(sample.point.to_array(), x, -1.0);
        if !self.is_free(x, d) {
            return 0.0;
        }
        RADIANCE * REFLECTED * dot(UP, d) / dot(d, d).sqrt() / sample.pdf.value()
    }

    /// Estimates the reflected radiance by one line of the lamp, integrated over its visible parts.
    fn by_lines(&self, x: Vector, random: &mut Pcg64Mcg, room: &mut Room) -> f64 {
        // Sample a line of the lamp: its direction, then its offset.
        let sampler = LineSampler::new(
            &self.lamp,
            random.random_range(0.0..PI),
            OffsetDensity::Uniform,
        );
        let sample = sampler.sample(random.random());
        // Find the parts of the line that are not hidden by the triangles whose boxes meet the
        // space between x and the lamp.
        let between = SpaceBetween::new(x, &self.lamp);
        let boxes = self.boxes.iter();
        let boxes = boxes.filter(|(low, high, _)| between.may_meet(*low, *high));
        let occluders = Occluders::from_triangles(boxes.flat_map(|(_, _, all)| all).copied());
        let mut shaft = occluders.shaft(ShaftQuery::new(x, &self.lamp), &mut room.scratch);
        shaft.visible(&[sample.segment], &mut room.visible);
        // Integrate in closed form along the visible parts.
        let (line, down) = (sample.segment.relative_to(vector(x)), self.lamp.normal());
        let parts = room.visible.line(0).iter();
        let along = parts.map(|part| {
            reflected(
                line.at(part.lo),
                line.at(part.hi),
                vector(UP),
                down,
                Sides::One,
                0.5,
            )
        });
        RADIANCE * along.sum::<f64>() / sample.pdf.value()
    }

    /// Estimates the reflected radiance by one point of the lamp and one direction in proportion to
    /// the floor's cosine, weighted by the balance heuristic.
    fn by_both(&self, x: Vector, random: &mut Pcg64Mcg) -> f64 {
        // Sample a point of the lamp, and a direction by the cosine.
        let technique = SolidAngleSampler::new(&self.lamp, vector(x));
        let point = add(technique.sample(random.random()).point.to_array(), x, -1.0);
        let (r2, turn) = (random.random::<f64>(), TAU * random.random::<f64>());
        let across = r2.sqrt();
        let direction = [across * turn.cos(), across * turn.sin(), (1.0 - r2).sqrt()];
        // Add both, each over its density and by its weight, where the ray is free.
        let both = [Some(point), self.to_lamp(x, direction)];
        let one = |(i, d): (usize, Option<Vector>)| {
            let d = d?;
            let by_light = technique.pdf(vector(add(x, d, 1.0))).value();
            let cosine = dot(UP, d) / dot(d, d).sqrt();
            let densities = [by_light, cosine / PI];
            let weight = balance(&[1.0; 2], &densities, i) / densities[i];
            self.is_free(x, d)
                .then_some(RADIANCE * REFLECTED * cosine * weight)
        };
        both.into_iter().enumerate().filter_map(one).sum()
    }
}

/// The memory that line samples use again from one point to the next.
#[derive(Default)]
struct Room {
    scratch: Scratch,
    visible: VisibleLines,
}

/// The number of pixels along each side of the floor, which is 4 by 4 metres.
const SIDE: u32 = 16;
/// The number of samples of a pixel for each technique.
const SAMPLES: u32 = 400;

fn main() -> ExitCode {
    let (engine, mut room, mut random) =
        (Engine::new(), Room::default(), Pcg64Mcg::seed_from_u64(1));
    // Sum the means and the variances of the three techniques over all pixels of the floor.
    let (mut sums, mut picture) = ([[0.0; 2]; 3], String::new());
    for row in 0..SIDE {
        for column in 0..SIDE {
            let at = |k: u32| (f64::from(k) + 0.5) * 4.0 / f64::from(SIDE) - 2.0;
            let (x, mut pixel) = ([at(column), at(row), 1e-4], [[0.0; 2]; 3]);
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
            // Add the pixel's means, and the variances of its means.
            let n = f64::from(SAMPLES);
            for (sum, [first, second]) in sums.iter_mut().zip(pixel) {
                let mean = first / n;
                *sum = [
                    sum[0] + mean,
                    sum[1] + (second / n - mean * mean) / (n - 1.0),
                ];
            }
            // Draw the pixel by its radiance from lines.
            let bright = 20.0 * pixel[1][0] / n;
            let shades = ".:-=+#".chars().zip(1..);
            let shade = shades
                .take_while(|(_, k)| f64::from(*k) <= 1.0 + bright)
                .last();
            picture.extend([shade.map_or(' ', |(c, _)| c); 2]);
        }
        picture.push('\n');
    }
    print!("{picture}");
    for ([mean, variance], name) in sums.iter().zip(["points", "lines", "both"]) {
        println!("{name:>6} {mean:.4} ± {:.4}", variance.sqrt());
    }
    // Compare each two techniques. The bound gives one false alarm in 10⁵ runs of other seeds.
    let z = |i: usize, j: usize| (sums[i][0] - sums[j][0]) / (sums[i][1] + sums[j][1]).sqrt();
    let worst = [z(0, 1), z(1, 2), z(2, 0)]
        .into_iter()
        .fold(0.0, |w: f64, z| w.max(z.abs()));
    println!("they differ by {worst:.2} standard errors at most");
    if worst < 4.6 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

#[test]
fn the_engine_agrees_with_itself() {
    use std::process::Termination as _;
    let wanted = format!("{:?}", ExitCode::SUCCESS.report());
    assert_eq!(format!("{:?}", main().report()), wanted);
}
