//! Tests of the reading of polygons from OBJ files without triangulation: the result, the errors
//! with their positions, and that no input panics.

use linelit_formats::ErrorKind;
use linelit_formats::assembly::{Result, Source};
use linelit_formats::obj::{Polygons, read_polygons};
use linelit_geometry::DVec3;

const OBJ: &str = "\
# a comment\no thing\nv 0 0 0.1 1.0\nv 1 0 0\nv 1 1 0 # another\nv 0 1 0\nvt 0 0\n\
f 1/1 2/1 3/1 4/1\nusemtl red\nf -1 -3//2 -2\n";

fn read(bytes: &[u8]) -> Result<Polygons> {
    read_polygons(&Source::new("a.obj", bytes.to_vec()))
}

#[test]
fn polygons_of_an_obj_file_stay_whole() {
    let found = read(OBJ.as_bytes()).unwrap();
    assert!(found.positions.contains(&DVec3::new(0.0, 0.0, 0.1)));
    assert_eq!(found.positions.len(), 4);
    assert_eq!(found.polygons, [vec![0, 1, 2, 3], vec![3, 1, 2]]);
    assert_eq!(found.lines, [8, 10]);
}

#[test]
fn wrong_places_of_obj_polygons_are_refused() {
    for (text, what) in [
        ("v 0 0 0\nf 1 2 1", "vertex 2 does not exist"),
        ("v 0 0 0\nf 0 1 1", "vertex 0 does not exist"),
        ("v 0 0 0\nf -2 1 1", "vertex -2 does not exist"),
        (
            "v 0 0 0\nf -9223372036854775808 1 1",
            "vertex -9223372036854775808 does not exist",
        ),
        ("v 0 0 0\nf 1 1 /1", "`` is no index of a vertex"),
        ("\nv 0 x 0", "`x` is not a number"),
    ] {
        let error = read(text.as_bytes()).unwrap_err();
        let said = error.to_string();
        assert!(error.message().starts_with(what), "{said}");
        assert!(said.contains("--> a.obj:2:"), "{said}");
        assert_ne!(error.kind(), ErrorKind::Io);
    }
}

#[test]
fn cut_and_spoiled_obj_polygons_do_not_panic() {
    let mut refused = 0;
    for end in 0..OBJ.len() {
        let bytes = OBJ.as_bytes();
        refused += usize::from(read(&bytes[..end]).is_err());
        for by in [0, 0xff, b' ', b'\n', b'-', b'9', b'e', b'.', bytes[end] ^ 1] {
            let mut spoiled = bytes.to_vec();
            spoiled[end] = by;
            refused += usize::from(read(&spoiled).is_err());
        }
    }
    assert!(refused > 100, "{refused}");
}
