//! Random schedules: shards run together and one after the other, are killed at any moment, run
//! several times at once, and parts are damaged meanwhile. The sum has the same bits each time.
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{expected, folder, merged, path, plan, value, work};
use linelit_plan::{BoxError, Folder, Run, Shard, Task, run};
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

fn below(numbers: &mut SplitMix64, end: u32) -> u32 {
    let number = numbers.next_u64() % u64::from(end.max(1));
    u32::try_from(number).unwrap()
}

/// Returns a folder in memory, if the system has one, as files cost least there.
fn place(name: &str) -> PathBuf {
    let memory = Path::new("/dev/shm");
    let found = path(name);
    match found.file_name() {
        Some(name) if memory.is_dir() => memory.join(name),
        _ => found,
    }
}

/// Leaves behind what a process leaves that was killed while it computed a unit: possibly the
/// beginning of a part.
fn leave_debris(folder: &Folder, number: u32, numbers: &mut SplitMix64) {
    if below(numbers, 2) == 0 {
        let begun = format!("parts/.{number:08}.part.17-{}.tmp", below(numbers, 9));
        fs::write(folder.path().join(begun), b"linelit-part 1\n\nhalf").unwrap();
    }
}

/// Damages an existing part: cuts it, flips a bit, or replaces it by the part of another unit.
fn damage(folder: &Folder, numbers: &mut SplitMix64) -> Option<u32> {
    let number = below(numbers, folder.units());
    let file = folder.part_path(number);
    let mut bytes = fs::read(&file).ok()?;
    let at = below(numbers, u32::try_from(bytes.len()).unwrap()) as usize;
    match below(numbers, 3) {
        0 => bytes.truncate(at),
        1 if at < bytes.len() => bytes[at] ^= 1 << below(numbers, 8),
        _ => {
            let other = (number + 1) % folder.units();
            bytes = fs::read(folder.part_path(other)).ok()?;
            if other == number {
                return None;
            }
        }
    }
    fs::write(&file, bytes).unwrap();
    Some(number)
}

/// Runs one shard of a plan until its end or until it is killed, which `dies` decides randomly.
fn one_shard(folder: &Folder, shard: Shard, numbers: SplitMix64, dies: u32) {
    let numbers = Mutex::new(numbers);
    let killed = Mutex::new(None);
    let mortal = |task: &Task<'_>| -> Result<Vec<u8>, BoxError> {
        let mut numbers = numbers.lock().unwrap();
        if below(&mut numbers, 100) < dies {
            *killed.lock().unwrap() = Some(task.number());
            return Err("killed".into());
        }
        work(task)
    };
    let options = Run {
        shard,
        ..Run::default()
    };
    let ended = run(folder, &options, mortal);
    let mut numbers = numbers.into_inner().unwrap();
    match killed.into_inner().unwrap() {
        Some(number) => {
            assert!(ended.unwrap_err().to_string().ends_with(": killed"));
            leave_debris(folder, number, &mut numbers);
        }
        None => drop(ended.unwrap()),
    }
}

/// Runs all shards in a random order, up to three at once and some of them twice, with damage in
/// between.
fn all_shards(folder: &Folder, count: u32, numbers: &mut SplitMix64) {
    let dies = [0, 5, 30][below(numbers, 3) as usize];
    let mut order: Vec<u32> = (0..count).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, below(numbers, u32::try_from(k + 1).unwrap()) as usize);
    }
    let mut left = order.as_slice();
    while !left.is_empty() {
        let together = (1 + below(numbers, 3) as usize).min(left.len());
        let (now, later) = left.split_at(together);
        left = later;
        let mut group: Vec<u32> = now.to_vec();
        if below(numbers, 3) == 0 {
            // Twice at once.
            group.push(now[0]);
        }
        std::thread::scope(|scope| {
            for index in group {
                let numbers = SplitMix64::new(numbers.next_u64());
                let shard = Shard::new(index, count).unwrap();
                scope.spawn(move || one_shard(folder, shard, numbers, dies));
            }
        });
        if below(numbers, 8) == 0 {
            damage(folder, numbers);
        }
    }
}

/// Runs a plan of a few units by a random number of shards, and returns this number.
fn schedule(name: &str, numbers: &mut SplitMix64) -> u32 {
    let units = 1 + below(numbers, 24);
    // As often of tens as of hundreds.
    let most = [2, 3, 4, 8, 16, 64, 125, 1000][below(numbers, 8) as usize];
    let count = 1 + below(numbers, most);
    let path = place(name);
    let _ = fs::remove_dir_all(&path);
    let folder = folder(&path, units);
    all_shards(&folder, count, numbers);
    run(&folder, &Run::default(), work).unwrap();
    assert_eq!(merged(&folder), Ok(expected(units)));
    // Parts that are damaged at the end are named, exactly these, and computed again.
    let damaged: BTreeSet<u32> = (0..2).filter_map(|_| damage(&folder, numbers)).collect();
    let whole = |number: &u32| folder.part(*number).is_ok_and(|part| part.is_some());
    for number in &damaged {
        // If it was damaged twice, it may be intact again.
        let expected = value(*number).to_le_bytes();
        assert!(!whole(number) || folder.part(*number).unwrap().unwrap() == expected);
    }
    let named: BTreeSet<u32> = match merged(&folder) {
        Ok(sum) => {
            assert_eq!(sum, expected(units));
            BTreeSet::new()
        }
        Err(missing) => missing
            .broken
            .into_iter()
            .map(|(number, _)| number)
            .collect(),
    };
    let broken: BTreeSet<u32> = damaged.into_iter().filter(|n| !whole(n)).collect();
    assert_eq!(named, broken);
    run(&folder, &Run::default(), work).unwrap();
    assert_eq!(merged(&folder), Ok(expected(units)));
    fs::remove_dir_all(path).unwrap();
    count
}

fn schedules(name: &str, seed: u64, times: u32) {
    let (start, mut numbers, mut shards) = (Instant::now(), rng(seed), 0);
    for _ in 0..times {
        shards += schedule(name, &mut numbers);
    }
    println!(
        "{times} schedules of {shards} shards in {:?}",
        start.elapsed()
    );
}

#[test]
fn any_schedule_gives_the_same_bits() {
    schedules("schedules", 17, cases(40));
}

#[test]
#[ignore = "long: ten thousand schedules, minutes"]
fn ten_thousand_schedules_give_the_same_bits() {
    schedules("schedules-long", 18, 10_000);
}

const PLAN_OF_CHILD: &str = "LINELIT_TEST_PLAN";
const SHARD_OF_CHILD: &str = "LINELIT_TEST_SHARD";

/// Takes part in a plan, if another test has started this program for it.
#[test]
fn takes_part() {
    let Ok(path) = std::env::var(PLAN_OF_CHILD) else {
        return;
    };
    let folder = Folder::open(Path::new(&path)).unwrap();
    let options = Run {
        shard: std::env::var(SHARD_OF_CHILD).unwrap().parse().unwrap(),
        threads: 2,
        ..Run::default()
    };
    let slow = |task: &Task<'_>| {
        std::thread::sleep(Duration::from_millis(u64::from(task.number() % 5)));
        work(task)
    };
    run(&folder, &options, slow).unwrap();
}

/// Separate processes are killed while they work, and others continue.
#[cfg(unix)]
#[test]
fn killed_processes_leave_what_is_done() {
    let path = path("killed");
    let units = 300;
    folder(&path, units);
    let mut numbers = rng(19);
    let start = |index: u32| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["schedules::takes_part", "--exact", "--test-threads", "1"]);
        command.env(PLAN_OF_CHILD, &path);
        command.env(SHARD_OF_CHILD, format!("{}/3", index + 1));
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().unwrap()
    };
    let mut children: Vec<_> = (0..3).map(start).collect();
    let mut kills = 0;
    while kills < 20 {
        std::thread::sleep(Duration::from_millis(10 + numbers.next_u64() % 40));
        let at = below(&mut numbers, 3);
        let child = &mut children[at as usize];
        if child
            .try_wait()
            .unwrap()
            .is_some_and(|status| status.success())
        {
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        *child = start(at);
    }
    println!("{kills} kills");
    assert!(kills > 3);
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    let folder = Folder::open(&path).unwrap();
    assert_eq!(merged(&folder), Ok(expected(units)));
    assert_eq!(folder.plan(), &plan(units));
    fs::remove_dir_all(path).unwrap();
}
