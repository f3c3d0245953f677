//! The program from outside its process: its messages and remaining files when it cannot write, or
//! lacks memory.
#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{
    PROGRAM, folder, linelit, names, path, small_render, small_study, succeeded, text,
};
use std::fs::{self, File, OpenOptions, Permissions};
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// An image, and one command of each kind that prints.
fn printing(dir: &Path) -> Vec<Vec<String>> {
    let image = dir.join("a.exr");
    let small = ["--resolution", "4x4", "--samples", "1"];
    let render = ["render", "floating-quad", "-o", path(&image)];
    succeeded(&[&render[..], &small].concat());
    let study = dir.join("study");
    let commands: Vec<Vec<&str>> = vec![
        vec!["--help"],
        vec!["render", "--help"],
        vec!["--version"],
        vec!["info", "floating-quad"],
        vec!["info", "floating-quad", "--json"],
        [&render[..], &small, &["--json"]].concat(),
        [&render[..], &small, &["--explain"]].concat(),
        vec!["compare", path(&image), path(&image)],
        vec!["compare", path(&image), path(&image), "--json"],
        small_study("floating-quad", &study),
        [&small_study("floating-quad", &study)[..], &["--json"]].concat(),
    ];
    let own = |words: Vec<&str>| words.into_iter().map(str::to_owned).collect();
    commands.into_iter().map(own).collect()
}

#[test]
fn a_closed_pipe_ends_the_program_without_a_word() {
    let dir = folder("closed");
    for arguments in printing(&dir) {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = Command::new(PROGRAM)
            .args(&arguments)
            .stdout(writer)
            .output()
            .unwrap();
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(141), "{arguments:?}: {said}");
        assert!(said.is_empty(), "{arguments:?}: {said}");
    }
}

/// `/dev/full`, whose disk is always full.
fn full() -> Option<File> {
    let file = OpenOptions::new().write(true).open("/dev/full").ok();
    if file.is_none() {
        println!("not tried: there is no /dev/full here");
    }
    file
}

#[test]
fn a_full_disk_behind_standard_output_is_an_error() {
    let dir = folder("full");
    for arguments in printing(&dir) {
        let Some(full) = full() else { break };
        let output = Command::new(PROGRAM)
            .args(&arguments)
            .stdout(full)
            .output()
            .unwrap();
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.starts_with("error: cannot write to standard output: "),
            "{arguments:?}: {said}"
        );
    }
}

/// If the error message cannot be printed, the exit status still reports the error.
#[test]
fn without_standard_error_the_status_is_the_same() {
    let broken = ["info", "no-such-scene"];
    let wrong = ["rendr"];
    for (arguments, status) in [(&broken[..], 1), (&wrong, 2)] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = Command::new(PROGRAM);
        let ended = command.args(arguments).stderr(writer).status().unwrap();
        assert_eq!(ended.code(), Some(status));
        let Some(full) = full() else { continue };
        let mut command = Command::new(PROGRAM);
        let ended = command.args(arguments).stderr(full).status().unwrap();
        assert_eq!(ended.code(), Some(status));
    }
}

/// Arguments of a render that would take hours, if the output were tested only after the work.
fn long_render(image: &Path) -> Vec<&str> {
    let mut arguments = vec!["render", "colonnade-small", "-o", path(image)];
    arguments.extend(["--samples", "65536", "--resolution", "1024x1024"]);
    arguments
}

#[test]
fn where_nothing_can_be_written_nothing_is_begun() {
    let dir = folder("places");
    let file = dir.join("file");
    fs::write(&file, "kept").unwrap();
    let closed = dir.join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, Permissions::from_mode(0o555)).unwrap();
    let mut places = vec![file.join("a"), Path::new("/proc/linelit").join("a")];
    if File::create(closed.join("probe")).is_err() {
        places.push(closed.join("a"));
    } else {
        println!("a folder without the right to write was not tried: root writes there, too");
        fs::remove_file(closed.join("probe")).unwrap();
    }
    for place in places {
        let image = place.with_extension("exr");
        let mut study = small_study("cornell-box", &place);
        let twice = study.iter().position(|a| *a == "--samples").unwrap();
        let long = ["--samples", "65536", "--trials", "1000", "--pixels"];
        study.splice(twice..twice + 6, long.into_iter().chain(["512x512"]));
        for arguments in [long_render(&image), study] {
            let output = linelit(&arguments);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
            assert!(said.starts_with("error: "), "{said}");
            assert!(said.contains(path(place.parent().unwrap())), "{said}");
        }
    }
    assert_eq!(fs::read(&file).unwrap(), b"kept");
    assert_eq!(names(&dir), ["closed", "file"]);
    assert!(names(&closed).is_empty());
}

#[test]
fn a_link_is_followed_and_a_read_only_file_kept() {
    let dir = folder("links");
    let (link, real) = (dir.join("link.exr"), dir.join("real"));
    symlink("real", &link).unwrap();
    let render = [
        "render",
        "floating-quad",
        "-o",
        path(&link),
        "--resolution",
        "4x4",
    ];
    succeeded(&render);
    assert!(link.is_symlink() && fs::metadata(&real).unwrap().len() > 0);

    let kept = dir.join("kept.exr");
    fs::write(&kept, "precious").unwrap();
    fs::set_permissions(&kept, Permissions::from_mode(0o444)).unwrap();
    let device = dir.join("device.exr");
    symlink("/dev/null", &device).unwrap();
    for (place, why) in [(&kept, "read-only"), (&device, "not a regular file")] {
        let output = linelit(&long_render(place));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert_eq!(said.matches(why).count(), 1, "{said}");
    }
    assert_eq!(fs::read(&kept).unwrap(), b"precious");
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

/// Returns the program under limits of the shell.
fn limited(limits: &str, arguments: &[&str]) -> Output {
    Command::new("sh")
        .args(["-c", &format!("{limits}; exec \"$0\" \"$@\""), PROGRAM])
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// A file beyond the limit is cut off as on a full disk: the signal is ignored, writing fails.
#[test]
fn a_disk_that_fills_up_leaves_what_was_there() {
    let dir = folder("filled");
    let (image, study) = (dir.join("a.exr"), dir.join("study"));
    let render = small_render(&image, "96x96");
    let converge = small_study("cornell-box", &study);
    for before in [false, true] {
        for arguments in [&render, &converge] {
            let kept = |p: &Path| fs::read(p).ok();
            let old = [&image, &study.join("report.html")].map(|p| kept(p));
            assert_eq!(old.iter().all(Option::is_some), before, "{arguments:?}");
            let output = limited("trap '' XFSZ; ulimit -f 4", arguments);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
            assert!(said.contains("cannot write"), "{said}");
            let new = [&image, &study.join("report.html")].map(|p| kept(p));
            assert!(old == new, "{arguments:?}");
        }
        let temporary = |n: &String| n.ends_with(".tmp");
        assert!(!names(&dir).iter().any(temporary), "{:?}", names(&dir));
        if study.is_dir() {
            let left = names(&study);
            assert!(!left.iter().any(temporary), "{left:?}");
            assert!(!left.contains(&".linelit-lock".to_owned()), "{left:?}");
        }
        for arguments in [&render, &converge] {
            succeeded(arguments);
        }
    }
}

#[test]
fn what_does_not_fit_into_memory_is_refused_with_numbers() {
    let dir = folder("memory");
    let image = dir.join("a.exr");
    let render = [
        "render",
        "floating-quad",
        "-o",
        path(&image),
        "--resolution",
    ];
    let study = dir.join("study");
    let trials = [
        "converge",
        "cornell-box",
        "--samples",
        "1,2",
        "--trials",
        "4294967295",
    ];
    for (output, what) in [
        (
            limited(
                "ulimit -v 300000",
                &[&render[..], &["8192x8192", "--threads", "2"]].concat(),
            ),
            "a picture of 8192 x 8192 pixels takes 1.5 GiB",
        ),
        (
            // With a quarter of the pixels: 28 bytes more for the surface and 2 × 4 for the layer.
            limited(
                "ulimit -v 300000",
                &[
                    &render[..],
                    &["4096x4096", "--threads", "2", "--aovs", "depth"],
                ]
                .concat(),
            ),
            "a picture of 4096 x 4096 pixels takes 960.0 MiB",
        ),
        (
            linelit(&[&trials[..], &["--pixels", "1x1", "--out", path(&study)]].concat()),
            "trials of each takes ",
        ),
    ] {
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains(what) && said.contains(" are available"),
            "{said}"
        );
    }
    assert!(names(&dir).is_empty());
}

/// A lamp is added only if a file has no lights, and JSON and metadata state it, both of one
/// process and of a plan. If the file has lights that emit nothing, the picture is black.
#[test]
fn a_lamp_is_for_files_without_lights_and_is_named() {
    let dir = folder("lamp");
    let (plan, merged) = (dir.join("plan"), dir.join("merged.exr"));
    let square = "Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 3 1 -1 3 -1 1 3 1 1 3 ]";
    for (lights, has_lamp) in [
        ("", true),
        ("LightSource \"point\" \"rgb I\" [ 0 0 0 ]", false),
        ("LightSource \"projection\"", false),
        ("LightSource \"point\"", false),
    ] {
        let (file, picture) = (dir.join("a.pbrt"), dir.join("a.exr"));
        let scene = format!("Camera \"perspective\" WorldBegin {square} {lights}");
        fs::write(&file, scene).unwrap();
        let size = ["--resolution", "4x4"];
        let whole = ["render", path(&file), "-o", path(&picture), "--json"];
        let planned = ["plan", "render", path(&file), "-o", path(&plan)];
        let merge = ["merge", path(&plan), "-o", path(&merged), "--json"];
        let done = linelit(&[&whole[..], &size].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        assert!(linelit(&[&planned[..], &size].concat()).status.success());
        assert!(linelit(&["run", path(&plan)]).status.success());
        for (output, picture) in [(done, &picture), (linelit(&merge), &merged)] {
            let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(json["lamp"], has_lamp, "{lights}: {json}");
            let is_lit = json["mean"][0].as_f64() > Some(0.0);
            assert_eq!(
                is_lit,
                has_lamp || lights == "LightSource \"point\"",
                "{json}"
            );
            let document = linelit_film::Document::read(picture).unwrap();
            assert_eq!(document.get("lamp").is_some(), has_lamp, "{lights}");
        }
        fs::remove_dir_all(&plan).unwrap();
    }
}

#[test]
fn a_file_without_lights_is_lit_for_pictures_and_refused_by_studies() {
    let dir = folder("unlit");
    let (file, empty) = (dir.join("dark.obj"), dir.join("empty.pbrt"));
    fs::write(
        &file,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n",
    )
    .unwrap();
    fs::write(&empty, "WorldBegin\n").unwrap();
    let picture = dir.join("dark.exr");
    let output = linelit(&[
        "render",
        path(&file),
        "-o",
        path(&picture),
        "--resolution",
        "8x8",
    ]);
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("has no lights: it is lit by"), "{said}");
    for scene in [&file, &empty] {
        let output = linelit(&small_study(path(scene), &dir.join("out")));
        assert_eq!(output.status.code(), Some(1));
        let said = text(&output.stderr);
        assert!(
            said.contains("a study measures those of the file"),
            "{said}"
        );
    }
}
