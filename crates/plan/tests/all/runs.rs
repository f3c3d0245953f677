//! Whoever does which unit, the sum has the same bits.

use crate::common::{expected, folder, merged, path, plan, value, work};
use linelit_plan::{BoxError, Folder, PlanError, Run, Shard, Task, run};
use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

fn shard(index: u32, count: u32) -> Run<'static> {
    Run {
        shard: Shard::new(index, count).unwrap(),
        only_own: true,
        ..Run::default()
    }
}

#[test]
fn shards_share_the_units_and_the_sum_is_the_same() {
    for count in [1, 2, 7, 64] {
        let path = path(&format!("shards-{count}"));
        let folder = folder(&path, 50);
        let mut computed = 0;
        for index in (0..count).rev() {
            let ran = run(&folder, &shard(index, count), work).unwrap();
            assert_eq!(ran.found, 0);
            computed += ran.computed;
            assert_eq!(computed + ran.elsewhere, 50);
        }
        assert_eq!(computed, 50);
        assert_eq!(merged(&folder).unwrap(), expected(50));
        assert!(fs::read_dir(path.join("leases")).unwrap().next().is_none());
        fs::remove_dir_all(path).unwrap();
    }
}

#[test]
fn what_others_leave_is_taken_over() {
    let path = path("left");
    let folder = folder(&path, 20);
    // The first of four does all, as nobody else is there.
    let options = Run {
        only_own: false,
        threads: 3,
        ..shard(0, 4)
    };
    let ran = run(&folder, &options, work).unwrap();
    assert_eq!((ran.computed, ran.elsewhere), (20, 0));
    assert_eq!(merged(&folder).unwrap(), expected(20));
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn a_lease_keeps_others_away_while_it_is_fresh() {
    let path = path("leases");
    let folder = folder(&path, 3);
    // Of nobody that this machine knows.
    fs::write(path.join("leases/00000001"), "boot space 1 0 a").unwrap();
    let options = Run {
        only_own: false,
        lease: Duration::from_millis(400),
        ..shard(2, 3)
    };
    let status = folder.status(options.lease).unwrap();
    assert_eq!((status.running, status.lost), (1, 0));
    let ran = run(&folder, &options, work).unwrap();
    assert_eq!((ran.computed, ran.elsewhere), (2, 1), "not its own: left");
    // Who owns the unit waits until the lease is old.
    let ran = run(
        &folder,
        &Run {
            shard: Shard::ALL,
            ..options
        },
        work,
    )
    .unwrap();
    assert_eq!((ran.computed, ran.found), (1, 2));
    assert_eq!(merged(&folder).unwrap(), expected(3));
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn who_is_at_work_keeps_the_lease() {
    let path = path("kept");
    let folder = folder(&path, 1);
    let computed = AtomicU32::new(0);
    let slow = |task: &Task<'_>| {
        computed.fetch_add(1, Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(1500));
        work(task)
    };
    let options = Run {
        lease: Duration::from_millis(400),
        ..Run::default()
    };
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| run(&folder, &options, slow).unwrap());
        }
    });
    assert_eq!(computed.into_inner(), 1);
    fs::remove_dir_all(path).unwrap();
}

/// A unit's value and those of all that it needs, in their order.
fn with_needs(task: &Task<'_>) -> Result<Vec<u8>, BoxError> {
    let mut sum = value(task.number());
    let mut order = Vec::new();
    task.parts(|number, part| {
        order.push(number);
        sum += f64::from_le_bytes(part.try_into().unwrap());
        Ok(())
    })?;
    assert_eq!(order, task.unit().needs.clone().collect::<Vec<_>>());
    Ok(sum.to_le_bytes().to_vec())
}

#[test]
fn units_read_the_parts_of_those_that_they_need() {
    let [path, alone] = ["needs", "needs-alone"].map(path);
    let mut plan = plan(30);
    for unit in &mut plan.units[10..] {
        unit.needs = 2..7;
    }
    let [folder, other] =
        [&path, &alone].map(|p| Folder::create(p, &plan, &Default::default()).unwrap());
    let computed = Mutex::new(Vec::new());
    let noted = |task: &Task<'_>| {
        computed.lock().unwrap().push(task.number());
        with_needs(task)
    };
    let shards = [0, 1, 2].map(|index| Run {
        threads: 2,
        ..shard(index, 3)
    });
    // The last alone, then the others together: whoever comes first computes what is needed.
    run(&folder, &shards[2], noted).unwrap();
    std::thread::scope(|scope| {
        for options in &shards[..2] {
            scope.spawn(|| run(&folder, options, noted).unwrap());
        }
    });
    let mut computed = computed.into_inner().unwrap();
    computed.sort_unstable();
    assert_eq!(computed, (0..30).collect::<Vec<_>>(), "each once");
    run(&other, &Run::default(), with_needs).unwrap();
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
    assert_eq!(folder.status(Duration::from_secs(90)).unwrap().done, 5);
    let stop = || folder.part_path(6).exists();
    let options = Run {
        stop: &stop,
        ..Run::default()
    };
    let stopped = run(&folder, &options, work).unwrap_err();
    assert!(matches!(stopped, PlanError::Interrupted) && stopped.is_temporary());
    let status = folder.status(Duration::from_secs(90)).unwrap();
    assert_eq!((status.done, status.running, status.lost), (7, 0, 0));
    let ran = run(&folder, &Run::default(), work).unwrap();
    assert_eq!((ran.found, ran.computed), (7, 2));
    fs::remove_dir_all(path).unwrap();
}
