//! The program away from the repository that it was built in: it needs no other file.

use crate::common::{PROGRAM, folder, names, path, small_study, text};
use linelit_film::Image;
use linelit_scenes::BuiltIn;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in an empty folder, without a home folder.
fn in_folder(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(PROGRAM);
    let command = command.args(arguments).current_dir(folder).env_clear();
    command.output().unwrap()
}

/// No built-in scene reads a file, or leaves one behind.
#[test]
fn built_in_scenes_need_no_folder() {
    let (dir, out) = (folder("alone"), folder("alone-out"));
    for scene in ["colonnade", "window", "cornell-box"] {
        let image = out.join(format!("{scene}.exr"));
        let size = ["--resolution", "8x8", "--samples", "1"];
        let render = ["render", scene, "-o", path(&image)];
        let output = in_folder(&dir, &[&render[..], &size].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let mean = Image::read(&image).unwrap().mean();
        assert!(mean.iter().all(|c| *c > 0.0), "{scene}: {mean:?}");
    }
    let study = out.join("study");
    let output = in_folder(&dir, &small_study("colonnade-line", &study));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(names(&dir).is_empty(), "{:?}", names(&dir));
    for scene in BuiltIn::ALL
        .iter()
        .filter(|s| !s.name.starts_with("colonnade"))
    {
        let output = in_folder(&dir, &["info", scene.name, "--json"]);
        assert!(
            output.status.success(),
            "{}: {}",
            scene.name,
            text(&output.stderr)
        );
    }

    // A file of the user's with the same name takes precedence.
    std::fs::write(dir.join("plates"), "").unwrap();
    let said = text(&in_folder(&dir, &["info", "plates"]).stderr);
    assert!(
        said.contains("cannot tell the format of `plates`"),
        "{said}"
    );
}
