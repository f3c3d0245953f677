//! linelit's side of `run.py`: its rays and its building, on triangles and rays from files.
//!
//! `distances PATH` writes how far each ray of PATH.view goes; `time PATH` measures. Each line of
//! its output is what was done, by which call, the processor seconds, and how many hits or
//! triangles there were.

use linelit_visibility::geometry::DVec3;
use linelit_visibility::{Fan, Occluders, Ray, Scratch};
use rustix::time::{ClockId, clock_gettime};
use std::{env, error::Error, fs, io};

/// The rays from one point in files of the kind `fan`, and of view rays that are traced at once.
const FAN: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [command, path] = &arguments[..] else {
        return Err("usage: distances | time, and a path without its ending".into());
    };
    let positions = rows(&format!("{path}.positions"), f32::from_le_bytes)?;
    let triangles = rows(&format!("{path}.triangles"), u32::from_le_bytes)?;
    match command.as_str() {
        "distances" => distances(path, &positions, &triangles)?,
        "time" => time(path, &positions, &triangles)?,
        _ => return Err(format!("unknown command {command}").into()),
    }
    Ok(())
}

fn distances(path: &str, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    let occluders = Occluders::build(positions, triangles);
    let mut scratch = Scratch::new();
    let mut bytes = Vec::new();
    for ray in rays(path, "view")? {
        let hit = occluders.closest_hit(&ray, &mut scratch);
        let distance = hit.map_or(f64::INFINITY, |hit| hit.t);
        bytes.extend(distance.to_le_bytes());
    }
    fs::write(format!("{path}.distances"), bytes)
}

fn time(path: &str, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    let (occluders, seconds) = timed(|| Occluders::build_for_rays(positions, triangles));
    report(
        "build-for-rays",
        "build_for_rays",
        seconds,
        occluders.triangle_count(),
    );
    let (occluders, seconds) = timed(|| Occluders::build(positions, triangles));
    report("build", "build", seconds, occluders.triangle_count());
    let mut scratch = Scratch::new();
    for kind in ["random", "camera", "fan"] {
        let rays = rays(path, kind)?;
        let (count, seconds) = timed(|| {
            let hidden = |ray: &&Ray| occluders.any_hit(ray, &(0..0), &mut scratch);
            rays.iter().filter(hidden).count()
        });
        report(kind, "any_hit", seconds, count);
        if kind == "fan" {
            let (count, seconds) = timed(|| any_hits(&occluders, &rays, &mut scratch));
            report(kind, "any_hits", seconds, count);
        }
    }
    let rays = rays(path, "view")?;
    let (count, seconds) = timed(|| {
        let hit = |ray| occluders.closest_hit(ray, &mut scratch);
        rays.iter().filter_map(hit).count()
    });
    report("view", "closest_hit", seconds, count);
    let (count, seconds) = timed(|| closest_hits(&occluders, &rays, &mut scratch));
    report("view", "closest_hits", seconds, count);
    Ok(())
}

/// The number of hidden rays, those from one point traced together.
fn any_hits(occluders: &Occluders, rays: &[Ray], scratch: &mut Scratch) -> usize {
    let mut directions = Vec::new();
    let mut count = 0;
    for few in rays.chunks(FAN) {
        let fan = fan(few, &mut directions);
        count += occluders.any_hits(&fan, &(0..0), scratch).count_ones() as usize;
    }
    count
}

/// The number of rays that meet something, neighbours traced together.
fn closest_hits(occluders: &Occluders, rays: &[Ray], scratch: &mut Scratch) -> usize {
    let (mut directions, mut hits) = (Vec::new(), Vec::new());
    let mut count = 0;
    for few in rays.chunks(FAN) {
        occluders.closest_hits(&fan(few, &mut directions), &mut hits, scratch);
        count += hits.iter().flatten().count();
    }
    count
}

fn fan<'a>(rays: &[Ray], directions: &'a mut Vec<DVec3>) -> Fan<'a> {
    directions.clear();
    directions.extend(rays.iter().map(|ray| ray.direction));
    let Ray {
        origin,
        t_min,
        t_max,
        ..
    } = rays[0];
    Fan {
        origin,
        directions,
        t_min,
        t_max,
    }
}

/// What the second of two runs returns, and its processor seconds.
fn timed<T>(mut run: impl FnMut() -> T) -> (T, f64) {
    run();
    let start = processor_seconds();
    let result = run();
    (result, processor_seconds() - start)
}

fn processor_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

fn report(what: &str, call: &str, seconds: f64, count: usize) {
    println!("{what} {call} {seconds:e} {count}");
}

/// Rays in files are eight numbers: origin, least t, direction, largest t.
fn rays(path: &str, kind: &str) -> io::Result<Vec<Ray>> {
    let rows = rows(&format!("{path}.{kind}"), f32::from_le_bytes)?;
    let ray = |[x, y, z, t_min, dx, dy, dz, t_max]: [f32; 8]| Ray {
        origin: DVec3::new(x.into(), y.into(), z.into()),
        direction: DVec3::new(dx.into(), dy.into(), dz.into()),
        t_min: t_min.into(),
        t_max: t_max.into(),
    };
    Ok(rows.into_iter().map(ray).collect())
}

/// The numbers of a file, four bytes each, in rows of N.
fn rows<T, const N: usize>(path: &str, number: fn([u8; 4]) -> T) -> io::Result<Vec<[T; N]>> {
    let bytes = fs::read(path)?;
    let (numbers, _) = bytes.as_chunks::<4>();
    let (rows, _) = numbers.as_chunks::<N>();
    Ok(rows.iter().map(|row| row.map(number)).collect())
}
