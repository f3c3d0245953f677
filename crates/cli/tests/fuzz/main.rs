//! Broken files never cause a panic, a hang or the use of much memory: not in the readers of any
//! format, from bytes or from files on disk, and not in `Renderer::new` and a small picture of the
//! scenes that load.
//!
//! Complete scenes are cut, bytes are changed, tokens are shuffled, and checksums are corrected.
//! The usual tests use the same inputs on every run. The long one uses new ones: a million, or as
//! many as fit into `LINELIT_FUZZ_MINUTES`; it prints its seed, which `LINELIT_FUZZ_SEED` sets
//! (`cargo xtask fuzz --minutes N --seed S`). An input that fails is stored in a folder that the
//! message names: correct the reader, and put the files into `finds`.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a long test says its seed and what did harm"
)]

mod corpus;
mod mutate;
mod watch;

use corpus::{Case, finds, seeds};
use linelit_formats::{Format, LoadOptions, Loaded};
use linelit_integrator::{Estimator, LightChoice, Renderer, Settings, Workspace};
use linelit_testkit::rng::SplitMix64;
use mutate::{below, mutate};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use watch::Watch;

/// Estimators that draw the small pictures, in turns.
const ESTIMATORS: [&str; 5] = [
    "line-analytic",
    "point-solid-angle",
    "line-area+point-bsdf",
    "exact",
    "hybrid",
];

/// A folder of its own for each test.
fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("linelit-fuzz-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// Loads a case from files in a folder or, if it is one file, from memory; then draws it.
fn attempt(case: &Case, folder: &Path, turn: usize) {
    let options = LoadOptions {
        max_triangles: 100_000,
        ..LoadOptions::default()
    };
    let extension = case.main.rsplit('.').next().unwrap_or("");
    let loaded = if case.files.len() == 1 && turn.is_multiple_of(2) {
        let format = Format::from_extension(extension).unwrap();
        linelit_formats::from_bytes(format, &case.files[&case.main], "fuzz", &options)
    } else {
        linelit_formats::load(case.write(folder), &options)
    };
    match loaded {
        Ok(loaded) => draw(loaded, turn),
        // Formatting the message is part of the test.
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Renders a few pixels of a scene, which must be consistent.
fn draw(loaded: Loaded, turn: usize) {
    let mut scene = loaded.scene;
    let count = scene.positions.len();
    assert!(scene.positions.iter().flatten().all(|c| c.is_finite()));
    let inside = |i: &u32| (*i as usize) < count;
    assert!(scene.triangles.iter().flatten().all(inside));
    if scene.lights.is_empty() {
        linelit_formats::add_framing_light(&mut scene);
    }
    scene.set_resolution(3, 2);
    let settings = Settings {
        estimator: ESTIMATORS[turn % ESTIMATORS.len()]
            .parse::<Estimator>()
            .unwrap(),
        samples: 2,
        bounces: 2,
        // Many lights would take too long.
        lights: if scene.lights.len() > 500 {
            LightChoice::Power
        } else {
            LightChoice::All
        },
        ..Settings::default()
    };
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    for y in 0..2 {
        for x in 0..3 {
            let radiance = renderer.pixel(&settings, [x, y], &mut workspace);
            assert!(
                radiance.is_finite() && radiance.min_element() >= 0.0,
                "{radiance}"
            );
        }
    }
}

/// Tries mutated inputs until `end` returns true, and returns the number of attempts.
fn mutations(name: &str, seed: u64, mut end: impl FnMut(usize) -> bool) -> usize {
    let folder = folder(name);
    let watch = Watch::new();
    let mut random = SplitMix64::new(seed);
    let all: Vec<Case> = seeds()
        .into_iter()
        .chain(finds().into_iter().map(|(_, case)| case))
        .collect();
    let mut problems = Vec::new();
    let mut turn = 0;
    while !end(turn) && problems.len() < 20 {
        let mut case = all[below(&mut random, all.len())].clone();
        mutate(&mut case, &mut random);
        problems.extend(watch.run(&case, || attempt(&case, &folder, turn)));
        turn += 1;
    }
    std::fs::remove_dir_all(&folder).unwrap();
    let list = problems.join("\n");
    assert!(problems.is_empty(), "seed {seed}, {turn} attempts:\n{list}");
    turn
}

#[test]
fn the_seeds_load_and_are_drawn() {
    let folder = folder("seeds");
    for (turn, case) in seeds().iter().enumerate() {
        let loaded = linelit_formats::load(case.write(&folder), &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
        assert!(!loaded.scene.triangles.is_empty(), "{case:?}");
        draw(loaded, turn);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_once_did_harm_does_none() {
    let folder = folder("finds");
    let watch = Watch::new();
    let mut problems = Vec::new();
    for (name, case) in finds() {
        for turn in 0..2 * ESTIMATORS.len() {
            let problem = watch.run(&case, || attempt(&case, &folder, turn));
            problems.extend(problem.map(|p| format!("{name}: {p}")));
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn every_cut_is_handled() {
    let folder = folder("cuts");
    let watch = Watch::new();
    for (k, case) in seeds().iter().enumerate() {
        for (name, bytes) in &case.files {
            for cut in (k % 13..bytes.len()).step_by(13) {
                let mut case = case.clone();
                case.files.insert(name.clone(), bytes[..cut].to_vec());
                let problem = watch.run(&case, || attempt(&case, &folder, cut));
                assert_eq!(problem, None);
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn random_text_and_shuffled_words_are_handled() {
    let folder = folder("words");
    let watch = Watch::new();
    let mut random = SplitMix64::new(7);
    let all = seeds();
    let text = String::from_utf8_lossy(&all[0].files["main.pbrt"]).into_owned();
    let words: Vec<&str> = text.split_inclusive(char::is_whitespace).collect();
    for turn in 0..1000 {
        let length = below(&mut random, 200);
        let bytes = (0..length).map(|_| random.next_u64().to_le_bytes()[0]);
        let case = match turn % 3 {
            0 => {
                let mut text = "WorldBegin ".to_owned();
                text.extend((0..length).map(|_| words[below(&mut random, words.len())]));
                Case::new("main.pbrt", text)
            }
            1 => Case::new(&all[turn % 8].main, bytes.collect::<Vec<u8>>()),
            _ => Case::new(
                &all[turn % 8].main,
                bytes.map(|b| b' ' + b % 95).collect::<Vec<u8>>(),
            ),
        };
        let problem = watch.run(&case, || attempt(&case, &folder, turn));
        assert_eq!(problem, None);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn mutated_scenes_are_handled() {
    mutations("few", 20_161_121, |turn| turn >= 1500);
}

/// Returns a number from the environment.
fn told(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
#[ignore = "long: a million mutated scenes of all formats, new ones on every run"]
fn a_million_mutated_scenes_are_handled() {
    let clock = || {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.map_or(0, |d| d.as_secs() ^ u64::from(d.subsec_nanos()) << 32)
    };
    let seed = told("LINELIT_FUZZ_SEED").unwrap_or_else(clock);
    let minutes = told("LINELIT_FUZZ_MINUTES");
    println!("LINELIT_FUZZ_SEED={seed}");
    let start = Instant::now();
    let attempts = mutations("million", seed, |turn| match minutes {
        Some(minutes) => start.elapsed() >= Duration::from_secs(60 * minutes),
        None => turn >= 1_000_000,
    });
    let seconds = start.elapsed().as_secs();
    println!("{attempts} attempts in {seconds} s: no panic, no hang, none above 1 GiB");
}
