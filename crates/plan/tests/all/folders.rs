//! The folder of a plan: its contents, and the folders that are refused.

use crate::common::{folder, path, plan, work};
use linelit_plan::{Folder, Input, InputFile, PlanError, Run, run};
use std::fs;

#[test]
fn a_plan_is_read_as_it_was_written() {
    let path = path("read");
    let mut plan = plan(5);
    plan.settings = "{\"third\": 0.3333333333333333, \"name\": \"a \\\"b\\\"\"}".into();
    // A range without units is written as it is, wherever it begins.
    plan.units[2].needs = 2..2;
    plan.units[3].needs = 1..3;
    plan.units[4].cost = 1.0 / 3.0;
    plan.inputs.push(Input {
        name: "room \"1\".pbrt".into(),
        files: vec![InputFile::of("room.pbrt", b"text")],
    });
    let made = Folder::create(&path, &plan).unwrap();
    let read = Folder::open(&path).unwrap();
    assert_eq!(read.plan(), &plan);
    assert_eq!(read.hash(), made.hash());
    // Its text is JSON that others can read.
    let text = fs::read_to_string(path.join("plan.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["units"][3]["needs"]["end"], 3);
    // The same plan again is the same folder.
    Folder::create(&path, &plan).unwrap();
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn every_byte_of_a_plan_counts() {
    let path = path("sealed");
    folder(&path, 2);
    let file = path.join("plan.json");
    let text = fs::read(&file).unwrap();
    for k in 0..text.len() {
        let mut broken = text.clone();
        broken[k] ^= 1;
        fs::write(&file, broken).unwrap();
        let refused = Folder::open(&path).unwrap_err();
        assert!(matches!(refused, PlanError::Broken { .. }), "byte {k}");
        fs::write(&file, &text[..k]).unwrap();
        assert!(Folder::open(&path).is_err(), "{k} bytes");
    }
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn what_differs_is_said() {
    let path = path("differs");
    folder(&path, 3);
    let refused = |change: fn(&mut linelit_plan::Plan)| {
        let mut plan = plan(3);
        change(&mut plan);
        let refused = Folder::create(&path, &plan);
        refused.unwrap_err().to_string()
    };
    let seed = refused(|plan| plan.settings = "{\"seed\": 8}".into());
    assert!(seed.contains("settings: seed 7, not 8"), "{seed}");
    let version = refused(|plan| plan.program = "toy 2".into());
    assert!(
        version.contains("program `toy 1`, not `toy 2`"),
        "{version}"
    );
    let fewer = refused(|plan| drop(plan.units.pop()));
    assert!(fewer.contains("3 units, not 2"), "{fewer}");
    let unit = refused(|plan| plan.units[1].work = "{\"k\": 9}".into());
    assert!(unit.contains("the unit `unit 1`"), "{unit}");
    let unit = refused(|plan| plan.units[2].needs = 2..2);
    assert!(unit.contains("the unit `unit 2`"), "{unit}");
    let opened = Folder::open(&path).unwrap();
    let other = opened.check_program("toy 2").unwrap_err().to_string();
    assert!(other.contains("`toy 1`") && other.contains("`toy 2`"));
    opened.check_program("toy 1").unwrap();

    let with_input = path.with_extension("input");
    let of_room = |bytes: &[u8]| {
        let mut plan = plan(1);
        plan.inputs.push(Input {
            name: "room.pbrt".into(),
            files: vec![InputFile::of("room.pbrt", bytes)],
        });
        Folder::create(&with_input, &plan)
    };
    of_room(b"old").unwrap();
    let changed = of_room(b"new").unwrap_err().to_string();
    assert!(changed.contains("`room.pbrt` was "), "{changed}");
    fs::remove_dir_all(with_input).unwrap();

    let input = Input {
        name: "room.pbrt".into(),
        files: ["a", "b"].map(|n| InputFile::of(n, b"old")).to_vec(),
    };
    input.check(&input.files).unwrap();
    let files = [InputFile::of("a", b"new"), InputFile::of("c", b"old")];
    let changed = input.check(&files).unwrap_err().to_string();
    for part in ["`a` was", "`b` is read no more", "`c` was not read then"] {
        assert!(changed.contains(part), "{changed}");
    }
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn other_folders_are_left_alone() {
    let path = path("others");
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("thesis.tex"), "").unwrap();
    let refused = Folder::create(&path, &plan(1)).unwrap_err();
    assert!(refused.to_string().contains("`thesis.tex`"), "{refused}");
    assert!(Folder::open(&path).is_err());
    fs::remove_dir_all(&path).unwrap();
    assert!(Folder::open(&path).is_err());
}

#[test]
fn plans_that_make_no_sense_are_refused() {
    let path = path("nonsense");
    let refused = |change: fn(&mut linelit_plan::Plan)| {
        let mut plan = plan(2);
        change(&mut plan);
        assert!(Folder::create(&path, &plan).is_err());
    };
    refused(|plan| plan.settings = "{".into());
    refused(|plan| plan.units[1].work = "}, {".into());
    refused(|plan| plan.units[1].cost = f64::NAN);
    refused(|plan| plan.units[0].cost = -1.0);
    refused(|plan| plan.units[0].needs = 0..1);
    assert!(!path.exists());
}

#[test]
fn a_folder_without_parts_can_be_copied_and_run() {
    let (from, to) = (path("copy-from"), path("copy-to"));
    folder(&from, 3);
    fs::create_dir_all(&to).unwrap();
    fs::copy(from.join("plan.json"), to.join("plan.json")).unwrap();
    let copied = Folder::open(&to).unwrap();
    assert_eq!(run(&copied, &Run::default(), work).unwrap().computed, 3);
    fs::remove_dir_all(from).unwrap();
    fs::remove_dir_all(to).unwrap();
}
