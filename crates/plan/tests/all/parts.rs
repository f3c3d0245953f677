//! Parts are refused unless they are complete and belong to their unit and plan.

use crate::common::{expected, folder, merged, path, plan, work};
use linelit_plan::{Event, Folder, PlanError, Run, run};
use std::fs;
use std::sync::Mutex;

#[test]
fn every_byte_of_a_part_counts() {
    let path = path("bytes");
    let folder = folder(&path, 2);
    run(&folder, &Run::default(), work).unwrap();
    let file = folder.part_path(1);
    let whole = fs::read(&file).unwrap();
    let refused = |bytes: &[u8], what: &str| {
        fs::write(&file, bytes).unwrap();
        match folder.part(1) {
            Err(PlanError::Broken { path, .. }) => assert_eq!(path, file),
            other => panic!("{what}: {other:?}"),
        }
    };
    for k in 0..whole.len() {
        for bit in 0..8 {
            let mut flipped = whole.clone();
            flipped[k] ^= 1 << bit;
            refused(&flipped, &format!("bit {bit} of byte {k}"));
        }
        refused(&whole[..k], &format!("{k} bytes"));
    }
    refused(&[&whole[..], b"\n"].concat(), "a byte more");
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn parts_of_other_units_and_plans_are_refused() {
    let (here, there) = (path("here"), path("there"));
    let folder = folder(&here, 2);
    run(&folder, &Run::default(), work).unwrap();
    fs::copy(folder.part_path(0), folder.part_path(1)).unwrap();
    let unit = folder.part(1).unwrap_err().to_string();
    assert!(unit.contains("of another unit"), "{unit}");
    let mut other = plan(2);
    other.settings = "{\"seed\": 8}".into();
    let other = Folder::create(&there, &other).unwrap();
    run(&other, &Run::default(), work).unwrap();
    fs::copy(other.part_path(1), folder.part_path(1)).unwrap();
    let plan = folder.part(1).unwrap_err().to_string();
    assert!(plan.contains("of another plan"), "{plan}");
    fs::remove_dir_all(here).unwrap();
    fs::remove_dir_all(there).unwrap();
}

#[test]
fn a_broken_part_is_named_and_computed_again_and_no_other() {
    let path = path("broken");
    let folder = folder(&path, 5);
    assert_eq!(merged(&folder).unwrap_err().absent, [0, 1, 2, 3, 4]);
    run(&folder, &Run::default(), work).unwrap();
    fs::write(folder.part_path(2), "half of").unwrap();
    fs::remove_file(folder.part_path(4)).unwrap();
    let missing = merged(&folder).unwrap_err();
    assert_eq!((missing.absent, missing.broken[0].0), (vec![4], 2));
    assert!(
        missing.broken[0]
            .1
            .contains("00000002.part: it has 7 bytes")
    );
    let (broken, computed) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let note = |event: &Event<'_>| match event {
        Event::Broken(unit, why) => {
            // A broken part stays until the new one is written.
            assert_eq!(fs::read(folder.part_path(2)).unwrap(), b"half of");
            broken.lock().unwrap().push(format!("{}: {why}", unit.name));
        }
        Event::Done(unit) => computed.lock().unwrap().push(unit.name.clone()),
        _ => {}
    };
    let options = Run {
        note: &note,
        ..Run::default()
    };
    let ran = run(&folder, &options, work).unwrap();
    assert_eq!((ran.computed, ran.found), (2, 3));
    assert_eq!(computed.into_inner().unwrap(), ["unit 2", "unit 4"]);
    let broken = broken.into_inner().unwrap();
    assert!(
        broken.len() == 1 && broken[0].starts_with("unit 2: "),
        "{broken:?}"
    );
    assert_eq!(merged(&folder).unwrap(), expected(5));
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn a_part_that_cannot_be_read_is_no_broken_one() {
    let path = path("unreadable");
    let folder = folder(&path, 2);
    fs::create_dir(folder.part_path(1)).unwrap();
    for refused in [
        run(&folder, &Run::default(), work).map(drop),
        folder.read_all(|_, _| Ok(())).map(drop),
    ] {
        let refused = refused.unwrap_err();
        assert!(matches!(refused, PlanError::Io { .. }), "{refused}");
        assert!(refused.to_string().contains("cannot read"), "{refused}");
    }
    assert!(folder.part_path(1).is_dir());
    fs::remove_dir_all(path).unwrap();
}
