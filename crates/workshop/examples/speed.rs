//! The least time of each closed form on ordinary segments: the cost of the code when no other work
//! disturbs it, also on a busy machine. `cargo run --release -p linelit-workshop
//! --no-default-features --example speed [NAME]`

#![allow(clippy::print_stdout, reason = "printing is what the program is for")]

use linelit_geometry::{DVec3, Segment};
use linelit_shading::{batch, cylinder, phong, polygon, ribbon};
use linelit_testkit::rng::SplitMix64;
use std::hint::black_box;
use std::time::Instant;

/// The number of segments that are timed together.
const COUNT: usize = 512;

/// Returns ordinary segments above the origin.
fn segments() -> Vec<Segment> {
    let mut rng = SplitMix64::new(11);
    let mut v = |a: f64, b: f64| rng.in_range(a, b);
    (0..COUNT)
        .map(|_| {
            let p = DVec3::new(v(-2.0, 2.0), v(-2.0, 2.0), v(1.0, 3.0));
            Segment::new(p, p + DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), 0.0))
        })
        .collect()
}

/// Prints the least time of a function for each of [`COUNT`] integrals.
fn least(name: &str, f: impl FnMut()) {
    least_of(name, 1.0, f);
}

/// Prints the least time for each integral, for a function that computes this fraction of [`COUNT`]
/// integrals.
fn least_of(name: &str, share: f64, mut f: impl FnMut()) {
    if std::env::args().nth(1).is_some_and(|only| only != name) {
        return;
    }
    let mut best = f64::INFINITY;
    for _ in 0..1500 {
        let start = Instant::now();
        f();
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!(
        "{name:<16} {:8.2} ns",
        best * 1e9 / share / f64::from(u32::try_from(COUNT).expect("small"))
    );
}

fn main() {
    // Times of line integrals, diffuse and glossy.
    let input = segments();
    let n = DVec3::Z;
    let axis = DVec3::new(0.2, 0.1, 0.9).normalize();
    let mut out = vec![0.0; COUNT];
    let sum = |f: &dyn Fn(&Segment) -> f64| {
        black_box(black_box(&input).iter().map(f).sum::<f64>());
    };
    least("ribbon", || {
        black_box(
            black_box(&input)
                .iter()
                .map(|s| ribbon::line_integral(s.p0, s.p1, n))
                .sum::<f64>(),
        );
    });
    least("ribbon/batch", || {
        batch::ribbons(black_box(&input), n, black_box(&mut out))
    });
    least("cylinder", || sum(&|s| cylinder::irradiance(s.p0, s.p1, n)));
    for k in [10.0, 300.0, 1e3] {
        let toward = |s: &Segment| (s.p0.lerp(s.p1, 0.3) + DVec3::new(0.1, 0.05, 0.0)).normalize();
        least(&format!("phong near/{k}"), || {
            sum(&|s| phong::ribbon(s.p0, s.p1, n, toward(s), k))
        });
    }
    for k in [10.0, 1e3, 1e5] {
        least(&format!("phong/{k}"), || {
            sum(&|s| phong::ribbon(s.p0, s.p1, n, axis, k))
        });
    }
    polygons();
}

/// Times squares overhead, far away, and cut by the horizon; each run computes a 64th of [`COUNT`]
/// integrals.
fn polygons() {
    let n = DVec3::Z;
    for (name, half, height) in [("near", 1.0, 1.0), ("far", 0.01, 3.0), ("cut", 2.0, 0.0)] {
        let up = if height > 0.0 { DVec3::Y } else { DVec3::Z };
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::X * (half * x) + up * (half * y) + DVec3::new(0.3, 0.8, height));
        let repeat = |f: &dyn Fn() -> f64| {
            for _ in 0..COUNT / 64 {
                black_box(f());
            }
        };
        let scale = 1.0 / 64.0;
        least_of(&format!("square {name}"), scale, || {
            repeat(&|| polygon::irradiance(black_box(&square), n));
        });
    }
}
