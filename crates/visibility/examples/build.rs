//! Measures how long building the hierarchy of a scene takes on different numbers of threads, and
//! checks that it is the same on all of them.
//!
//! ```text
//! cargo run --release -p linelit-visibility --example build -- SCENE [THREADS,…] [ROUNDS]
//! ```
//!
//! SCENE is a scene file or the name of a built-in scene; by default, the numbers of threads are 1
//! and 2, and there are 5 rounds. The program that cargo leaves in `target/release/examples/build`
//! needs no other file than the scene. For each number of threads, for rays alone and with the data
//! for shafts, and with the feature `obvhs` over either tree, it prints the least and the median of
//! the seconds of wall-clock time that building takes, the same of processor time (Linux), the
//! bytes per triangle, and a hash of the whole hierarchy.

#![allow(clippy::print_stdout, reason = "what it is for")]

use linelit_scenes::Library;
use linelit_visibility::{BuildOptions, Builder, Occluders};
use std::fmt::{self, Write as _};
use std::time::Instant;

/// A hash of everything that is written to it.
struct Hash(u64);

impl fmt::Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Ok(())
    }
}

/// The processor time of this process so far, in hundredths of a second; zero where it is not
/// available.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = text.split(' ').skip(13).take(2);
    ticks
        .filter_map(|ticks| ticks.parse::<f64>().ok())
        .sum::<f64>()
        * 0.01
}

/// The least and the median of some numbers.
fn spread(mut seconds: Vec<f64>) -> [f64; 2] {
    seconds.sort_by(f64::total_cmp);
    [seconds[0], seconds[seconds.len() / 2]]
}

fn main() {
    let mut args = std::env::args().skip(1);
    let usage = "SCENE [THREADS,…] [ROUNDS]";
    let scene = args.next().expect(usage);
    let threads = args.next().unwrap_or_else(|| "1,2".into());
    let rounds = args.next().map_or(5, |n| n.parse().expect(usage));
    let scene = Library::default().load(&scene).expect("a scene").scene;
    println!("{} triangles", scene.triangles.len());
    let kinds: &[(&str, bool, Builder)] = &[
        ("rays", true, Builder::Own),
        ("shafts", false, Builder::Own),
        #[cfg(feature = "obvhs")]
        ("rays, by obvhs", true, Builder::Obvhs),
        #[cfg(feature = "obvhs")]
        ("shafts, by obvhs", false, Builder::Obvhs),
    ];
    for threads in threads.split(',') {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.parse().expect(usage));
        let pool = pool.build().expect("threads");
        for &(kind, for_rays, builder) in kinds {
            let options = BuildOptions { for_rays, builder };
            let build = || {
                pool.install(|| Occluders::build_with(&scene.positions, &scene.triangles, options))
            };
            let (mut wall, mut cpu) = (Vec::new(), Vec::new());
            for _ in 0..rounds {
                let (start, before) = (Instant::now(), cpu_seconds());
                let occluders = build();
                wall.push(start.elapsed().as_secs_f64());
                cpu.push(cpu_seconds() - before);
                drop(occluders);
            }
            let occluders = build();
            let mut hash = Hash(0xcbf2_9ce4_8422_2325);
            write!(hash, "{occluders:?}").expect("a hash takes everything");
            let bytes = occluders.memory() as f64 / occluders.triangle_count() as f64;
            println!(
                "{threads} threads, {kind}: wall {:.4?} s, processor {:.4?} s, {bytes:.1} bytes a \
                 triangle, hash {:016x}",
                spread(wall),
                spread(cpu),
                hash.0,
            );
        }
    }
}
