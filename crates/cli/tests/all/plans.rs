//! Plans of pictures: the result has the bytes of a single process, whichever process computed
//! which unit and however it ended.

#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{PROGRAM, folder, linelit, names, parts, path, succeeded, text};
use linelit_plan::Folder;
use linelit_simd::InstructionSet;
use linelit_testkit::cases::rng;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// A picture, by `render` and by a plan, in a folder of its own.
struct Case {
    dir: crate::common::Folder,
    scene: String,
    flags: Vec<&'static str>,
}

impl Case {
    fn new(name: &str, scene: &str, flags: &[&'static str]) -> Self {
        Self {
            dir: folder(name),
            scene: scene.to_owned(),
            flags: flags.to_vec(),
        }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Returns the bytes that `render` writes.
    fn rendered(&self) -> Vec<u8> {
        let image = self.at("rendered.exr");
        done(
            &[
                &["render", &self.scene, "-o", path(&image)],
                &self.flags[..],
            ]
            .concat(),
        );
        fs::read(image).unwrap()
    }

    fn plan(&self, more: &[&str]) -> PathBuf {
        let plan = self.at("plan");
        let words = ["plan", "render", &self.scene, "-o", path(&plan)];
        done(&[&words, &self.flags[..], more].concat());
        plan
    }

    fn merged(&self, plan: &Path) -> Vec<u8> {
        let image = self.at("merged.exr");
        done(&["merge", path(plan), "-o", path(&image)]);
        fs::read(image).unwrap()
    }
}

/// Returns the output of a command that must succeed.
fn done(words: &[&str]) -> String {
    text(&succeeded(words).stdout)
}

/// Returns the messages of a command that must fail with this status.
fn refused(words: &[&str], status: i32) -> String {
    let output = linelit(words);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{words:?}: {said}");
    said
}

/// Runs a plan in this many shards, moves their parts to another folder, the last first, and
/// merges them there.
fn by_shards(case: &Case, tiles: &[&str], count: u32) -> Vec<u8> {
    let (plan, gathered) = (case.plan(tiles), case.at("gathered"));
    let parts = gathered.join("parts");
    fs::create_dir_all(&parts).unwrap();
    fs::copy(plan.join("plan.json"), gathered.join("plan.json")).unwrap();
    let mut seen = 0;
    for index in (1..=count).rev() {
        let shard = format!("{index}/{count}");
        done(&["run", path(&plan), "--shard", &shard]);
        for part in fs::read_dir(plan.join("parts")).unwrap() {
            let part = part.unwrap();
            fs::rename(part.path(), parts.join(part.file_name())).unwrap();
            seen += 1;
        }
    }
    assert!(seen > 3, "{seen} parts");
    let merged = case.merged(&gathered);
    fs::remove_dir_all(plan).unwrap();
    fs::remove_dir_all(gathered).unwrap();
    merged
}

#[test]
fn shards_merged_in_any_order_are_the_picture() {
    let small = ["--resolution", "48x40", "--samples", "4"];
    let plain = Case::new("plan-plain", "cornell-box", &small);
    let rendered = plain.rendered();
    for count in [1, 2, 7, 64] {
        assert!(
            by_shards(&plain, &["--tile", "16"], count) == rendered,
            "{count}"
        );
    }
    let crop = [
        "--crop",
        "0.1,0.9,0,0.8",
        "--bounces",
        "1",
        "--light-estimator",
        "1=point-bsdf",
    ];
    let crop = Case::new("plan-crop", "plates", &[&small[..], &crop].concat());
    assert!(by_shards(&crop, &["--tile", "9"], 3) == crop.rendered());
}

#[test]
fn blocks_of_samples_and_layers_are_those_of_the_picture() {
    let flags = [
        "--resolution",
        "12x10",
        "--samples",
        "1",
        "--pixel-samples",
        "130",
        "--seed",
        "3",
    ];
    let layers = ["--aovs", "albedo,normal,depth,variance,samples"];
    let case = Case::new("plan-blocks", "plates", &[&flags[..], &layers].concat());
    let rendered = case.rendered();
    let split = ["--tile", "8", "--split-samples"];
    for (tiles, shards) in [
        (&split[..], 1),
        (&split, 2),
        (&split, 7),
        (&["--tile", "5"], 2),
    ] {
        assert!(
            by_shards(&case, tiles, shards) == rendered,
            "{tiles:?} {shards}"
        );
    }
    let case = Case::new("plan-samples", "plates", &flags);
    let rendered = case.rendered();
    assert!(by_shards(&case, &split, 2) == rendered);
    // Trials are units of their own, with moments and without.
    let trials = ["--pixel-samples", "1", "--samples", "2", "--trials", "9"];
    let trials = [&flags[..2], &trials].concat();
    for aovs in [&[][..], &layers] {
        let case = Case::new("plan-trials", "plates", &[&trials, aovs].concat());
        let rendered = case.rendered();
        for (tiles, shards) in [(&split[..], 7), (&["--tile", "5"], 2)] {
            let found = by_shards(&case, tiles, shards);
            assert!(found == rendered, "{tiles:?} {shards} {aovs:?}");
        }
    }
}

#[test]
fn what_is_missing_or_broken_is_named_and_done() {
    let small = ["--resolution", "16x8", "--samples", "1"];
    let layers = ["--pixel-samples", "2", "--aovs", "variance"];
    let flags = [&small[..], &layers].concat();
    let case = Case::new("plan-missing", "cornell-box", &flags);
    let plan = case.plan(&["--tile", "4"]);
    let merge = ["merge", path(&plan), "-o", "x.exr"];
    let none = refused(&merge, 75);
    assert!(none.contains("8 of 8 units are missing"), "{none}");
    done(&["run", path(&plan)]);
    let part = |k: u32| plan.join(format!("parts/{k:08}.part"));
    fs::remove_file(part(2)).unwrap();
    let mut flipped = fs::read(part(5)).unwrap();
    // Damage a byte before the checksum.
    let place = flipped.len() - 32 - 4;
    flipped[place] ^= 4;
    fs::write(part(5), flipped).unwrap();
    let some = refused(&merge, 75);
    for piece in [
        "2 of 8",
        "not done: pixels 8..12 x 0..4;",
        "00000005.part",
        "checksum",
    ] {
        assert!(some.contains(piece), "{some}");
    }
    let again = linelit(&["run", path(&plan)]);
    assert!(text(&again.stderr).contains("once more"), "{again:?}");
    assert!(
        text(&again.stdout).contains("2 units computed, 6 found"),
        "{again:?}"
    );
    assert!(case.merged(&plan) == case.rendered());
    // A part that cannot be read at all is neither missing nor broken.
    fs::remove_file(part(5)).unwrap();
    fs::create_dir(part(5)).unwrap();
    for words in [&merge[..], &["run", path(&plan)]] {
        assert!(refused(words, 1).contains("cannot read "));
    }
}

#[test]
fn changed_scenes_and_other_programs_are_refused() {
    let small = ["--resolution", "8x8", "--samples", "1"];
    let dir = folder("plan-scene");
    let scene = dir.join("box.pbrt");
    fs::copy("tests/cornell/v4.pbrt", &scene).unwrap();
    let main = "Include \"box.pbrt\"\n";
    fs::write(dir.join("main.pbrt"), main).unwrap();
    let case = Case::new("plan-changed", path(&dir.join("main.pbrt")), &small);
    let plan = case.plan(&[]);
    fs::write(&scene, fs::read_to_string(&scene).unwrap() + "\n").unwrap();
    let changed = refused(&["run", path(&plan)], 1);
    assert!(changed.contains("`box.pbrt` was "), "{changed}");
    let other = refused(
        &[
            &["plan", "render", &case.scene, "-o", path(&plan)],
            &small[..],
        ]
        .concat(),
        1,
    );
    assert!(
        other.contains("another plan (") && other.contains("`box.pbrt` was "),
        "{other}"
    );
    drop(dir);
    let gone = refused(&["run", path(&plan)], 1);
    assert!(gone.contains("which the plan was made for"), "{gone}");

    let file = plan.join("plan.json");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replacen("--samples=1", "--samples=2", 1)).unwrap();
    assert!(refused(&["run", path(&plan)], 1).contains("is broken"));
}

#[test]
fn schedulers_say_which_shard_it_is() {
    let case = Case::new("plan-array", "cornell-box", &["--resolution", "8x8"]);
    let plan = case.plan(&["--tile", "4"]);
    let run = |variables: &[(&str, &str)], more: &[&str]| {
        let mut command = Command::new(PROGRAM);
        command.args(["run", path(&plan)]).args(more);
        command.envs(variables.iter().copied()).output().unwrap()
    };
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "5"),
        ("SLURM_ARRAY_TASK_MIN", "4"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
    ];
    let said = run(&slurm, &[]);
    assert!(text(&said.stderr).contains("shard 2/2 by SLURM_ARRAY_TASK_ID"));
    assert!(text(&said.stdout).contains("2 units computed, 0 found; 2 of 4 are left"));
    let kubernetes = [("JOB_COMPLETION_INDEX", "0")];
    assert_eq!(run(&kubernetes, &[]).status.code(), Some(2));
    let said = run(&kubernetes, &["--shards", "2"]);
    assert!(text(&said.stdout).starts_with("shard 1/2: 2 units"));
    assert_eq!(run(&[], &["--shards", "2"]).status.code(), Some(2));
    for script in ["slurm", "parallel", "kubernetes"] {
        let lines = case.plan(&["--tile", "4"]);
        let words = [
            "plan",
            "render",
            "cornell-box",
            "-o",
            path(&lines),
            "--tile",
            "4",
        ];
        let more = ["--resolution", "8x8", "--script", script, "--shards", "5"];
        let printed = done(&[&words[..], &more].concat());
        assert!(
            printed.lines().count() >= 4 && printed.contains("run"),
            "{printed}"
        );
    }
}

/// Counts the units of a plan that are done.
fn units_done(plan: &Path) -> u64 {
    let status = done(&["status", path(plan), "--json"]);
    let status: serde_json::Value = serde_json::from_str(&status).unwrap();
    status["done"].as_u64().unwrap()
}

/// A picture whose units take a while, and how many they are.
fn slow_case(name: &str) -> (Case, u64) {
    let flags = [
        "--resolution",
        "64x48",
        "--samples",
        "64",
        "--pixel-samples",
        "16",
    ];
    let estimator = ["--estimator", "point-area"];
    let case = Case::new(name, "grid-planes", &[&flags[..], &estimator].concat());
    (case, 48)
}

/// Two processes at a time, on random instruction sets, killed at random moments.
#[cfg(unix)]
#[test]
fn killed_shards_on_any_instructions_are_the_picture() {
    let (case, units) = slow_case("plan-killed");
    let plan = case.plan(&["--tile", "8"]);
    let mut numbers = rng(23);
    let sets: Vec<String> = InstructionSet::ALL
        .into_iter()
        .filter(|set| set.is_available())
        .map(|set| set.to_string())
        .collect();
    let mut kills = 0_u32;
    while units_done(&plan) < units {
        let mut children = ["1/2", "2/2"].map(|shard| {
            let any = numbers.below(sets.len() as u64);
            let set = &sets[usize::try_from(any).unwrap()];
            let mut command = Command::new(PROGRAM);
            command.args(["run", path(&plan), "--shard", shard, "--threads", "1"]);
            command.args(["--isa", set]);
            command.stdout(Stdio::null()).stderr(Stdio::null());
            command.spawn().unwrap()
        });
        std::thread::sleep(Duration::from_millis(40 + numbers.below(400)));
        for child in &mut children {
            // On a machine that is too slow for these moments, the last processes are not killed.
            if kills < 24 && child.try_wait().unwrap().is_none() {
                kills += 1;
                child.kill().unwrap();
            }
            child.wait().unwrap();
        }
    }
    println!("{kills} kills, on {sets:?}");
    assert!(kills > 1);
    assert!(case.merged(&plan) == case.rendered());
}

/// Killed, and then ended as schedulers do it, `render` loses only its current units.
#[cfg(unix)]
#[test]
fn an_interrupted_render_goes_on() {
    use rustix::process::{Pid, Signal, kill_process};
    use std::process::Child;
    let flags = ["--samples", "64", "--pixel-samples", "16"];
    let size = ["--resolution", "192x96", "--estimator", "point-area"];
    let case = Case::new("render-interrupted", "grid-planes", &[flags, size].concat());
    let rendered = case.rendered();
    fs::remove_file(case.at("rendered.exr")).unwrap();
    let (image, plan) = (case.at("a.exr"), case.at(".a.exr.linelit-plan"));
    let words = ["render", &case.scene, "-o", path(&image)];
    let words = [&words[..], &case.flags, &["--checkpoints", "always"]].concat();
    let send = |child: &Child, signal| kill_process(Pid::from_child(child), signal).unwrap();
    // Stop it when this many units are done, so that it is still working, however fast it is.
    let started = |more: usize| {
        let mut command = Command::new(PROGRAM);
        command.args(&words).args(["--threads", "1"]);
        let child = command.stderr(Stdio::piped()).spawn().unwrap();
        while parts(&plan) < more {
            std::thread::sleep(Duration::from_millis(5));
        }
        send(&child, Signal::STOP);
        child
    };
    let mut killed = started(1);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let kept = parts(&plan);
    assert!(kept > 0);
    let ended = started(kept + 1);
    let busy = refused(&words, 1);
    assert!(
        busy.contains(&format!("process {} is rendering", ended.id())),
        "{busy}"
    );
    send(&ended, Signal::TERM);
    send(&ended, Signal::CONT);
    let ended = ended.wait_with_output().unwrap();
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(75), "{said}");
    assert!(said.contains("the same command goes on"), "{said}");
    let kept = parts(&plan);
    assert!(
        !image.exists() && said.contains(&format!(" {kept} of ")),
        "{said}"
    );

    let other = refused(&[&words[..], &["--seed", "1"]].concat(), 1);
    assert!(
        other.contains("seed") && other.contains("--fresh"),
        "{other}"
    );
    let last = linelit(&words);
    let said = text(&last.stderr);
    assert!(last.status.success(), "{said}");
    let going_on = format!("going on with an interrupted picture, {kept} of ");
    assert!(said.contains(&going_on), "{said}");
    assert!(fs::read(&image).unwrap() == rendered);
    assert_eq!(names(&case.dir), ["a.exr"]);
}

#[test]
fn a_fresh_render_forgets_the_interrupted_one() {
    let flags = ["--resolution", "16x8", "--samples", "1"];
    let case = Case::new("render-fresh", "cornell-box", &flags);
    let rendered = case.rendered();
    // The parts of another picture.
    let (plan, kept) = (case.plan(&["--seed", "5"]), case.at(".a.exr.linelit-plan"));
    done(&["run", path(&plan)]);
    fs::rename(plan, &kept).unwrap();
    let image = case.at("a.exr");
    let words = [
        "render",
        &case.scene,
        "-o",
        path(&image),
        "--checkpoints",
        "always",
    ];
    let words = [&words[..], &flags].concat();
    assert!(refused(&words, 1).contains("--fresh"));
    done(&[&words[..], &["--fresh"]].concat());
    assert!(fs::read(&image).unwrap() == rendered);
    assert_eq!(names(&case.dir), ["a.exr", "rendered.exr"]);
    // A plan without finished units is replaced.
    fs::rename(case.plan(&["--seed", "5"]), &kept).unwrap();
    done(&words);
    assert!(fs::read(&image).unwrap() == rendered && !kept.exists());
    // Parts of short pictures are stored only on request: no old plan is in the way.
    fs::create_dir(&kept).unwrap();
    fs::write(kept.join("mine"), "").unwrap();
    done(&[&words[..4], &flags].concat());
    assert!(refused(&words, 1).contains("mine"));
}

#[test]
fn plans_of_other_programs_and_parts_of_other_plans_are_refused() {
    let flags = ["--resolution", "8x8", "--samples", "1"];
    let case = Case::new("plan-foreign", "cornell-box", &flags);
    let plan = case.plan(&["--tile", "4"]);
    done(&["run", path(&plan)]);
    let mut other = Folder::open(&plan).unwrap().plan().clone();
    let own = std::mem::replace(&mut other.program, "linelit 9.9.9 (abc)".to_owned());
    let foreign = case.at("foreign");
    Folder::create(&foreign, &other).unwrap();
    let image = case.at("x.exr");
    let merge = ["merge", path(&foreign), "-o", path(&image)];
    for words in [&["run", path(&foreign)][..], &merge] {
        let said = refused(words, 1);
        for program in [&own, "linelit 9.9.9 (abc)"] {
            assert!(said.contains(&format!("`{program}`")), "{said}");
        }
    }
    // The same tiles of another seed.
    let mut seeded = Folder::open(&plan).unwrap().plan().clone();
    seeded.settings = seeded.settings.replace("--seed=0", "--seed=1");
    let seeded = (case.at("seeded"), seeded);
    Folder::create(&seeded.0, &seeded.1).unwrap();
    let part = "parts/00000002.part";
    fs::copy(plan.join(part), seeded.0.join(part)).unwrap();
    let merge = ["merge", path(&seeded.0), "-o", path(&image)];
    let said = refused(&merge, 75);
    assert!(
        said.contains("4 of 4") && said.contains("another plan"),
        "{said}"
    );
    let again = linelit(&["run", path(&seeded.0)]);
    assert!(text(&again.stderr).contains("once more"), "{again:?}");
    assert!(
        text(&again.stdout).contains("4 units computed"),
        "{again:?}"
    );
}

/// The lines that `--script` prints, in a file.
fn script(case: &Case, scheduler: &str) -> (PathBuf, PathBuf) {
    let (plan, file) = (case.at("plan"), case.at("script.sh"));
    let words = [
        "plan",
        "render",
        &case.scene,
        "-o",
        path(&plan),
        "--tile",
        "8",
    ];
    let more = ["--script", scheduler, "--shards", "16"];
    fs::write(&file, done(&[&words, &case.flags[..], &more].concat())).unwrap();
    (plan, file)
}

/// Whether a program is there and answers.
fn answers(program: &str, words: &[&str]) -> bool {
    let output = Command::new(program).args(words).output();
    let there = output.is_ok_and(|output| output.status.success());
    if !there {
        println!("skipped: `{program}` is not there, or does not answer");
    }
    there
}

#[test]
#[ignore = "long: GNU parallel, where it is installed"]
fn parallel_runs_the_script_as_printed() {
    if !answers("parallel", &["--version"]) {
        return;
    }
    let (case, _) = slow_case("plan-parallel");
    let (_, file) = script(&case, "parallel");
    let mut command = Command::new("sh");
    let output = command.arg(&file).current_dir(&*case.dir).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(fs::read(case.at("picture.exr")).unwrap() == case.rendered());
}

#[test]
#[ignore = "long: a job array of Slurm, where one runs"]
fn slurm_runs_the_script_as_printed() {
    if !answers("sinfo", &["--noheader"]) {
        return;
    }
    let (case, units) = slow_case("plan-slurm");
    let (plan, file) = script(&case, "slurm");
    let slurm = |program: &str, words: &[&str]| {
        let output = Command::new(program).args(words).output().unwrap();
        assert!(
            output.status.success(),
            "{program}: {}",
            text(&output.stderr)
        );
        text(&output.stdout).trim().to_owned()
    };
    let job = slurm("sbatch", &["--parsable", path(&file)]);
    let wait = |count: u64| {
        for _ in 0..600 {
            if units_done(&plan) >= count {
                return;
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        panic!("{} of {count} units in two minutes", units_done(&plan));
    };
    wait(5);
    slurm("scontrol", &["requeue", &format!("{job}_0")]);
    slurm("scancel", &[&format!("{job}_1")]);
    println!("{}", slurm("squeue", &["--noheader"]));
    wait(units);
    // A requeued job begins only after a while, and would find no plan.
    slurm("scancel", &[&job]);
    assert!(case.merged(&plan) == case.rendered());
}
