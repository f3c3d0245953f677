//! Files of facets: what is read, what is refused and at which position, and that nothing panics.

use linelit_viewfactors::files::{FileError, Mesh, Place, stl, vs3};
use linelit_viewfactors::{Facets, Sides};

type Reader = fn(&[u8]) -> Result<Mesh, FileError>;

/// A square, a triangle, and an obstruction.
const VS3: &str = "\
T three surfaces ! and a title\nc encl=0\n\nF 3\n! vertices\n\
V 1 0 0 0.125\nv 2 1e0 0 0 / a comment\nV 3 1 1 0\nV 4 0 1 0\nV  5 0. .5 -1.\n\
S 1 1 2 3 4 0 0 0.5 floor\ns 2 1 2 5 0 0 1 0.9 fin\no 3 2 3 5 0 0 0 0.1 tree\n\
End of data\nS 3 nothing of this is read\n";

const STL: &str = "\
solid two\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0.5\n  \
endloop\n endfacet\n FACET normal 0 0 1\n  outer loop\n   vertex -0 0 0\n   vertex 1 1 0.5\n   \
vertex 0 1 0\n  endloop\n endfacet\nendsolid two\n";

fn binary_stl() -> Vec<u8> {
    let triangles = [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5_f32]],
        [[-0.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]],
    ];
    // Some writers begin the 80 free bytes with `solid`.
    let mut bytes = format!("{:<80}", "solid").into_bytes();
    bytes.extend(2_u32.to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn a_vs3_file_is_read() {
    let mesh = vs3(VS3.as_bytes()).unwrap();
    assert_eq!(mesh.vertices.len(), 5);
    assert_eq!(
        (mesh.vertices[0], mesh.vertices[4]),
        ([0.0, 0.0, 0.125], [0.0, 0.5, -1.0])
    );
    assert_eq!(
        mesh.polygons,
        [vec![0, 1, 2, 3], vec![0, 1, 4], vec![1, 2, 4]]
    );
    assert_eq!(mesh.places, [11, 12, 13].map(Place::Line));
    assert_eq!((mesh.senders, mesh.emittances), (2, vec![0.5, 0.9]));
    assert!(
        mesh.notes[0].starts_with("line 12: surfaces are not combined"),
        "{:?}",
        mesh.notes
    );
}

#[test]
fn stl_files_join_equal_corners() {
    let text = stl(STL.as_bytes()).unwrap();
    let bytes = stl(&binary_stl()).unwrap();
    assert_eq!(text.polygons, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        (&text.polygons, &text.vertices),
        (&bytes.polygons, &bytes.vertices)
    );
    assert_eq!(text.places, [2, 9].map(Place::Line));
    assert_eq!(bytes.places, [84, 134].map(Place::Byte));
}

/// Fourth lines of a file that are wrong, each with the beginning of the message that it causes.
const WRONG: &str = "\
S 1 1 2 4 0 0 0 .9 => there is no vertex 4: 3 stand before this line
S 1 1 2 0 3 0 0 .9 => there is no vertex 0
S 1 1 2 -3 0 0 0 .9 => expected the number of a vertex, found `-3`
S 1 1 2 => expected the number of a vertex, the line ends
S 2 1 2 3 0 0 0 .9 => surface 2 stands where surface 1 should
S 1 1 2 3 0 0 0 nan => expected the emittance, found NaN
S 1 1 2 3 0 1 0 .9 => a surface within another (base 1) is not supported
M 1 1 2 3 0 => masks are not supported
V 5 0 0 0 => vertex 5 stands where vertex 4 should
V 4 0 inf 0 => expected the coordinate y, found inf
F 3a => the geometry `F 3a` is not supported
Q => `Q` begins no line of a .vs3 file";

fn refused(reader: Reader, bytes: &[u8], what: &str) {
    let error = reader(bytes).unwrap_err().to_string();
    assert!(error.starts_with(what), "`{error}`, not `{what}`");
}

#[test]
fn wrong_lines_of_vs3_files_are_refused() {
    for (line, what) in WRONG.lines().map(|line| line.split_once(" => ").unwrap()) {
        let text = format!("V 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\n{line}\n");
        refused(vs3, text.as_bytes(), &format!("line 4: {what}"));
    }
    let late = "V 1 0 0 0\nO 1 1 1 1 0\nS 2 1 1 1 0 0 0 1";
    refused(
        vs3,
        late.as_bytes(),
        "line 3: a surface `S` stands behind an obstruction",
    );
    refused(
        vs3,
        b"\xff\xfe",
        "line 1: `\u{fffd}\u{fffd}` begins no line",
    );
}

#[test]
fn wrong_places_of_stl_files_are_refused() {
    refused(stl, &STL.as_bytes()[..150], "line 11: ");
    refused(stl, b"solid\nendfacet", "line 2: a facet of 0 vertices");
    refused(
        stl,
        b"bytes",
        "byte 5: neither `solid` nor a binary STL file",
    );
    let told = "byte 80: 2 triangles are told, and 100 bytes are not their number";
    refused(stl, &binary_stl()[..100], told);
    let mut spoiled = binary_stl();
    spoiled[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    refused(
        stl,
        &spoiled,
        "byte 84: a corner of triangle 0 is not finite",
    );
}

#[test]
fn cut_and_spoiled_files_do_not_panic() {
    let cases: [(Reader, Vec<u8>); 3] = [(vs3, VS3.into()), (stl, STL.into()), (stl, binary_stl())];
    let mut refused = 0;
    let mut attempt = |reader: Reader, bytes: &[u8]| match reader(bytes) {
        Ok(mesh) => drop(Facets::new(&mesh.vertices, &mesh.polygons, Sides::Two)),
        Err(_) => refused += 1,
    };
    for (reader, bytes) in cases {
        for end in 0..bytes.len() {
            attempt(reader, &bytes[..end]);
            for by in [0, 0xff, b' ', b'\n', b'-', b'9', b'e', b'.', bytes[end] ^ 1] {
                let mut spoiled = bytes.clone();
                spoiled[end] = by;
                attempt(reader, &spoiled);
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}
