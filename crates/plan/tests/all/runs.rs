//! Runs of a plan: the sum has the same bits, whichever process computes which unit.

use crate::common::{expected, folder, merged, path, plan, value, work};
use linelit_plan::{BoxError, Folder, PlanError, Run, Shard, Task, run};
use std::fs;
use std::sync::Mutex;

fn shard(index: u32, count: u32) -> Run<'static> {
    Run {
        shard: Shard::new(index, count).unwrap(),
        ..Run::default()
    }
}

#[test]
fn shards_share_the_units_evenly_and_the_sum_is_the_same() {
    for count in [1, 2, 7, 64] {
        let path = path(&format!("shards-{count}"));
        let folder = folder(&path, 50);
        let mut computed = 0;
        let mut costs = Vec::new();
        for index in (0..count).rev() {
            let cost = Mutex::new(0.0);
            let noted = |task: &Task<'_>| {
                *cost.lock().unwrap() += task.unit().cost;
                work(task)
            };
            let ran = run(&folder, &shard(index, count), noted).unwrap();
            assert_eq!(ran.found, 0);
            computed += ran.computed;
            assert_eq!(computed + ran.elsewhere, 50);
            costs.push(cost.into_inner().unwrap());
        }
        assert_eq!(computed, 50);
        // Shards differ by at most one unit, and the most expensive one costs 13.
        costs.sort_by(f64::total_cmp);
        assert!(costs[costs.len() - 1] - costs[0] <= 13.0, "{costs:?}");
        assert_eq!(merged(&folder).unwrap(), expected(50));
        fs::remove_dir_all(path).unwrap();
    }
}

#[test]
fn a_second_run_does_what_a_shard_left() {
    let path = path("left");
    let folder = folder(&path, 20);
    let ran = run(&folder, &shard(0, 4), work).unwrap();
    assert_eq!((ran.computed, ran.elsewhere), (5, 15));
    let all = Run {
        threads: 3,
        ..Run::default()
    };
    let ran = run(&folder, &all, work).unwrap();
    assert_eq!((ran.computed, ran.found, ran.elsewhere), (15, 5, 0));
    assert_eq!(merged(&folder).unwrap(), expected(20));
    fs::remove_dir_all(path).unwrap();
}

/// Returns the sum of a unit's value and the parts of all units that it needs, in their order.
fn with_needs(task: &Task<'_>) -> Result<Vec<u8>, BoxError> {
    let mut sum = value(task.number());
    for number in task.unit().needs.clone() {
        sum += f64::from_le_bytes(task.part(number)?.try_into().unwrap());
    }
    Ok(sum.to_le_bytes().to_vec())
}

#[test]
fn units_read_the_parts_of_those_that_they_need() {
    let [path, alone] = ["needs", "needs-alone"].map(path);
    let mut plan = plan(30);
    for unit in &mut plan.units[10..] {
        unit.needs = 2..7;
    }
    let [folder, other] = [&path, &alone].map(|p| Folder::create(p, &plan).unwrap());
    let computed = Mutex::new(Vec::new());
    let noted = |task: &Task<'_>| {
        computed.lock().unwrap().push(task.number());
        with_needs(task)
    };
    let shards = [0, 1, 2].map(|index| Run {
        threads: 2,
        ..shard(index, 3)
    });
    // The first process computes the needed units, on one of its threads.
    for options in shards.iter().rev() {
        run(&folder, options, noted).unwrap();
    }
    let mut computed = computed.into_inner().unwrap();
    computed.sort_unstable();
    assert_eq!(computed, (0..30).collect::<Vec<_>>(), "each once");
    // At the same time, two processes may compute a unit twice, and the sum is the same.
    std::thread::scope(|scope| {
        for options in &shards {
            scope.spawn(|| run(&other, options, with_needs).unwrap());
        }
    });
    assert_eq!(merged(&folder).unwrap(), merged(&other).unwrap());
    fs::remove_dir_all(path).unwrap();
    fs::remove_dir_all(alone).unwrap();
}

#[test]
fn work_that_fails_or_is_stopped_leaves_what_is_done() {
    let path = path("fails");
    let folder = folder(&path, 9);
    let fails = |task: &Task<'_>| match task.number() {
        5 => Err("no light".into()),
        _ => work(task),
    };
    let failed = run(&folder, &Run::default(), fails).unwrap_err();
    assert_eq!(failed.to_string(), "unit 5 (unit 5): no light");
    assert!(!failed.is_temporary());
    assert_eq!(folder.status().unwrap().done, 5);
    let stop = || folder.part_path(6).exists();
    let options = Run {
        stop: &stop,
        ..Run::default()
    };
    let stopped = run(&folder, &options, work).unwrap_err();
    assert!(matches!(stopped, PlanError::Interrupted) && stopped.is_temporary());
    let status = folder.status().unwrap();
    assert_eq!((status.done, status.units), (7, 9));
    let ran = run(&folder, &Run::default(), work).unwrap();
    assert_eq!((ran.found, ran.computed), (7, 2));
    fs::remove_dir_all(path).unwrap();
}
