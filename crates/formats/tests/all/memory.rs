//! Tests of scenes that are read from memory with all files that they name: no file is opened, and
//! the files that a reader reports suffice to read the scene again.

use linelit_formats::{
    ErrorKind, Format, LoadOptions, Loaded, Root, SceneError, Watch, from_bytes,
};
use linelit_testkit::folder::Folder;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Reads `text` as the scene `a.pbrt`, with the given other files in memory.
fn load(text: &str, files: &[(&str, &[u8])]) -> Result<Loaded, SceneError> {
    let files = files.iter().map(|(name, b)| ((*name).into(), b.to_vec()));
    let options = LoadOptions {
        root: Root::Memory(Arc::new(BTreeMap::from_iter(files))),
        max_file_bytes: 1000,
        ..LoadOptions::default()
    };
    from_bytes(Format::Pbrt, text.as_bytes(), "a.pbrt", &options)
}

#[test]
fn what_a_scene_in_memory_names_is_found_there_and_nowhere_else() {
    let picture = linelit_testkit::pictures::tga([2, 2], &[[255, 0, 0]; 4]);
    let part = b"Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"sub/red.tga\"
        Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"";
    let files = [("part.pbrt", &part[..]), ("sub/red.tga", &picture)];
    let scene = load("WorldBegin Include \"part.pbrt\"", &files)
        .unwrap()
        .scene;
    assert!(scene.texture_memory() > 0 && !scene.triangles.is_empty());

    // Names that are not in memory are an error, even if such a file exists: `Cargo.toml` is in the
    // working folder of the tests.
    for absent in ["Cargo.toml", "./part.pbrt", "/etc/hostname", ""] {
        let error = load(&format!("WorldBegin\n Include \"{absent}\""), &files).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Io, "{error}");
        assert!(error.message().contains("no such file"), "{error}");
        assert_eq!(
            (error.line(), error.column()),
            (Some(2), Some(10)),
            "{error}"
        );
    }
    let itself = [("b.pbrt", &b"Include \"b.pbrt\""[..])];
    let error = load("WorldBegin Include \"b.pbrt\"", &itself).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Recursion, "{error}");
    let long = [("b.pbrt", &[b' '; 1001][..])];
    let error = load("WorldBegin Include \"b.pbrt\"", &long).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
}

#[test]
fn who_is_told_of_the_files_can_read_the_scene_again() {
    let folder = Folder::new("watch");
    std::fs::create_dir(folder.join("sub")).unwrap();
    let main = "WorldBegin Include \"sub/part.pbrt\" Include \"sub/part.pbrt\"";
    std::fs::write(folder.join("a.pbrt"), main).unwrap();
    std::fs::write(folder.join("sub/part.pbrt"), "Shape \"sphere\"").unwrap();
    let seen = Arc::new(Mutex::new(Vec::new()));
    let told = Arc::clone(&seen);
    let options = LoadOptions {
        watch: Watch::new(move |name, bytes| {
            told.lock().unwrap().push((name.to_owned(), bytes.to_vec()));
        }),
        ..LoadOptions::default()
    };
    let scene = linelit_formats::load(folder.join("a.pbrt"), &options);
    let triangles = scene.unwrap().scene.triangles;
    let seen = seen.lock().unwrap().clone();
    let names: Vec<&str> = seen.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["a.pbrt", "sub/part.pbrt", "sub/part.pbrt"]);
    let files: Vec<_> = seen[1..].iter().map(|(n, b)| (&**n, &b[..])).collect();
    let again = load(str::from_utf8(&seen[0].1).unwrap(), &files).unwrap();
    assert!(again.scene.triangles == triangles && !triangles.is_empty());
}
