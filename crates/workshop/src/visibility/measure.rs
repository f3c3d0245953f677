//! The times of rays, of lines, and of points in a shaft.

use super::Rivals;
use linelit_geometry::{DVec3, Segment};
use linelit_scenes::stratified_lines;
use linelit_visibility::{
    Counters, LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery, VisibleLines,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::ops::Range;
use std::time::Instant;

/// A light in a scene, and the points to shade.
#[derive(Clone, Debug)]
pub(super) struct Workload<'a> {
    /// A parallelogram or triangle, or the two ends of a linear light. Lines on other polygons
    /// reach beyond them.
    pub(super) light: LightCorners<'a>,
    /// The shading points, moved off their surfaces.
    pub(super) points: &'a [DVec3],
}

impl<'a> Workload<'a> {
    /// Returns the workload of some of the points.
    fn part(&self, range: Range<usize>) -> Workload<'a> {
        Self {
            points: &self.points[range],
            ..self.clone()
        }
    }
}

/// The nanoseconds per query, undisturbed: the sum over small chunks of the least time in any
/// round.
#[derive(Clone, Debug, Default)]
pub(super) struct Timings {
    /// The time of our any-hit ray.
    pub(super) ray: f64,
    /// The time in obvhs's binary hierarchy.
    pub(super) bvh2: f64,
    /// The time in obvhs's compressed wide hierarchy.
    pub(super) cwbvh: f64,
    /// The times by the number of lines, or of points, for each shading point.
    pub(super) shared: Vec<Shared>,
    /// The work of one pass over all points with the first number of lines.
    pub(super) counters: Counters,
    /// The fraction of rays that meet something.
    pub(super) hit_share: f64,
    /// The mean visible fraction of the lines.
    pub(super) visible_share: f64,
}

/// The time of lines, and of points by the same shaft.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    pub(super) count: u32,
    /// The nanoseconds per line, and this time divided by the time of our ray.
    pub(super) line: f64,
    pub(super) in_rays: f64,
    /// The nanoseconds per point.
    pub(super) point: f64,
}

/// Returns `per_point` shadow rays from every shading point to random points of the light.
fn shadow_rays(work: &Workload<'_>, per_point: usize) -> Vec<Ray> {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut rays = Vec::with_capacity(work.points.len() * per_point);
    let corners = work.light.corners();
    for &point in work.points {
        for _ in 0..per_point {
            // Draw a point uniform on the triangle, parallelogram or line.
            let (mut s, mut t) = (random.random::<f64>(), random.random::<f64>());
            if corners.len() == 3 && s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let o = corners[0];
            let last = corners[corners.len() - 1];
            if corners.len() == 2 {
                s = 0.0;
            }
            let target = o + (corners[1] - o) * s + (last - o) * t;
            rays.push(Ray {
                origin: point,
                direction: target - point,
                t_min: 1e-9,
                t_max: 1.0 - 1e-6,
            });
        }
    }
    rays
}

/// The empty range of triangles that rays leave out.
const NONE: Range<u32> = 0..0;

/// The largest number of shading points that are timed together.
const CHUNK: usize = 24;

/// The time, in seconds, that a chunk of points takes at most, if it has more than one: short
/// enough that the system seldom interrupts it, and long enough that reading the clock is
/// negligible.
const UNDISTURBED: f64 = 20e-6;

/// The least time of each chunk over all rounds. Their sum is the undisturbed time of the work.
#[derive(Default)]
struct Fastest {
    least: Vec<f64>,
    chunk: usize,
}

#[allow(clippy::cast_possible_truncation, reason = "counts")]
impl Fastest {
    /// Times `f` on every chunk of `0..count`.
    fn round(&mut self, count: usize, mut f: impl FnMut(Range<usize>)) {
        // In the first round, choose the size of chunks.
        if self.chunk == 0 {
            let start = Instant::now();
            f(0..count);
            let taken = start.elapsed().as_secs_f64();
            let points = (UNDISTURBED / taken * count as f64).clamp(1.0, CHUNK as f64);
            self.chunk = points as usize;
            self.least = vec![f64::INFINITY; count.div_ceil(self.chunk)];
        }
        for (k, least) in self.least.iter_mut().enumerate() {
            let start = Instant::now();
            f(k * self.chunk..count.min((k + 1) * self.chunk));
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }

    /// Returns the least time of all chunks together, in nanoseconds for each of `count` queries.
    fn per_query(&self, count: usize) -> f64 {
        self.least.iter().sum::<f64>() * 1e9 / count as f64
    }
}

/// Times rays and lines in alternation, `rounds` times.
pub(super) fn time(
    occluders: &Occluders,
    rivals: &Rivals,
    work: &Workload<'_>,
    lines: &[u32],
    rounds: usize,
) -> Timings {
    // Draw the rays and lines.
    const RAYS: usize = 8;
    let rays = shadow_rays(work, RAYS);
    let points = work.points.len();
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let mut random = Pcg64Mcg::seed_from_u64(11);
    let sets: Vec<Vec<Segment>> = lines
        .iter()
        .map(|&n| stratified_lines(work.light.corners(), n, &mut || random.random()))
        .collect();
    // Time them: rays by our hierarchy and by the others, then each set of lines, and points by the
    // same shafts.
    let mut ray_times: [Fastest; 3] = Default::default();
    let mut line_times: Vec<[Fastest; 2]> = lines.iter().map(|_| Default::default()).collect();
    let mut sink = 0;
    for _ in 0..rounds {
        let mut shoot = |k: usize, f: &mut dyn FnMut(&Ray) -> bool| {
            ray_times[k].round(points, |r| {
                let rays = &rays[r.start * RAYS..r.end * RAYS];
                sink += rays.iter().filter(|r| f(r)).count();
            });
        };
        shoot(0, &mut |r| occluders.any_hit(r, &NONE, &mut scratch));
        shoot(1, &mut |r| rivals.bvh2_any_hit(r));
        shoot(2, &mut |r| rivals.cwbvh_any_hit(r));
        for (set, [line_time, point_time]) in sets.iter().zip(&mut line_times) {
            line_time.round(points, |r| {
                let part = work.part(r);
                std::hint::black_box(trace_lines(occluders, &part, set, &mut scratch, &mut out));
            });
            let targets: Vec<DVec3> = set.iter().map(|l| l.at(0.37)).collect();
            point_time.round(points, |r| {
                sink += trace_points(occluders, &work.part(r), &targets, &mut scratch);
            });
        }
    }
    std::hint::black_box(sink);
    // Divide by the numbers of queries.
    let mut result = Timings {
        ray: ray_times[0].per_query(rays.len()),
        bvh2: ray_times[1].per_query(rays.len()),
        cwbvh: ray_times[2].per_query(rays.len()),
        ..Timings::default()
    };
    for ((&count, set), times) in lines.iter().zip(&sets).zip(&line_times) {
        let [line, point] = times.each_ref().map(|t| t.per_query(points * set.len()));
        let in_rays = line / result.ray;
        result.shared.push(Shared {
            count,
            line,
            in_rays,
            point,
        });
    }
    // Count the work of one pass, and how many rays hit.
    scratch.counters = Counters::default();
    if let Some(set) = sets.first() {
        result.visible_share = trace_lines(occluders, work, set, &mut scratch, &mut out);
    }
    result.counters = scratch.counters;
    let hit = |ray: &&Ray| occluders.any_hit(ray, &NONE, &mut scratch);
    result.hit_share = rays.iter().filter(hit).count() as f64 / rays.len() as f64;
    result
}

/// Returns the mean visible fraction of lines over all shading points.
#[inline(never)]
fn trace_lines(
    occluders: &Occluders,
    work: &Workload<'_>,
    lines: &[Segment],
    scratch: &mut Scratch,
    out: &mut VisibleLines,
) -> f64 {
    let mut sum = 0.0;
    for &point in work.points {
        let query = ShaftQuery::new(point, work.light);
        let mut shaft = occluders.shaft(query, scratch);
        // A line is wholly visible or wholly hidden where all of the light is; otherwise clip each
        // line.
        match shaft.class() {
            ShaftClass::Empty => {
                sum += lines.len() as f64;
            }
            ShaftClass::Blocked => {}
            ShaftClass::Partial => {
                shaft.visible(lines, out);
                for i in 0..lines.len() {
                    sum += out.fraction(i);
                }
            }
        }
    }
    let count = (work.points.len() * lines.len()) as f64;
    sum / count
}

/// Returns the number of visible points of the light, over all shading points.
fn trace_points(
    occluders: &Occluders,
    work: &Workload<'_>,
    targets: &[DVec3],
    scratch: &mut Scratch,
) -> usize {
    let mut visible = 0;
    for &point in work.points {
        let query = ShaftQuery::new(point, work.light);
        let mut shaft = occluders.shaft(query, scratch);
        visible += match shaft.class() {
            ShaftClass::Empty => targets.len(),
            ShaftClass::Blocked => 0,
            ShaftClass::Partial => targets.iter().filter(|t| shaft.point_visible(**t)).count(),
        };
    }
    visible
}

/// Returns the first points that the camera's rays meet, moved off the surface towards the eye.
pub(super) fn shading_points(
    occluders: &Occluders,
    view: &[[DVec3; 2]],
    offset: f64,
) -> Vec<DVec3> {
    let mut scratch = Scratch::new();
    let meet = |&[origin, direction]: &[DVec3; 2]| {
        let hit = occluders.closest_hit(&Ray::new(origin, direction), &mut scratch)?;
        Some(origin + direction * (hit.t - offset))
    };
    view.iter().filter_map(meet).collect()
}
