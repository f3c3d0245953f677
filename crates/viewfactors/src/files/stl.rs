//! The reader of STL files, text or binary. Corners with equal coordinates are joined to one
//! vertex.

use super::{FileError, Line, Mesh, Place, number_of};
use std::collections::HashMap;

/// The number of bytes before the triangles of a binary file, and the number of bytes of a
/// triangle: a normal, three corners, and two more bytes.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an STL file. It is binary if its length fits the number of triangles in its header;
/// otherwise it has to be text that begins with `solid`.
///
/// # Errors
/// Returns an error for the first line or byte that is wrong.
pub fn read(bytes: &[u8]) -> Result<Mesh, FileError> {
    let told = bytes.get(HEAD - 4..HEAD).and_then(|b| b.try_into().ok());
    let told = told.map(|count| u32::from_le_bytes(count) as usize);
    let is_whole = told.is_some_and(|n| n.checked_mul(TRIANGLE) == Some(bytes.len() - HEAD));
    if is_whole {
        return binary(bytes);
    }
    let begins = bytes.trim_ascii_start().get(..5);
    if begins.is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0) {
        return text(&String::from_utf8_lossy(bytes));
    }
    let length = bytes.len();
    let what = match told {
        Some(n) => format!("{n} triangles are told, and {length} bytes are not their number"),
        None => "neither `solid` nor a binary STL file".to_owned(),
    };
    let place = Place::Byte(length.min(HEAD - 4));
    Err(FileError { place, what })
}

/// A mesh to which triangles are added, with a table of its vertices.
#[derive(Default)]
struct Joined {
    mesh: Mesh,
    /// The vertex at each position, by the bits of the coordinates.
    numbers: HashMap<[u64; 3], u32>,
}

impl Joined {
    /// The number of the vertex at a position; adds it if it is new.
    fn vertex(&mut self, position: [f64; 3]) -> u32 {
        // Minus zero and zero are equal.
        let key = position.map(|x| (x + 0.0).to_bits());
        let next = u32::try_from(self.mesh.vertices.len()).unwrap_or(u32::MAX);
        *self.numbers.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(position);
            next
        })
    }

    fn finish(mut self) -> Mesh {
        self.mesh.senders = self.mesh.polygons.len();
        self.mesh
    }
}

/// Reads the triangles of a binary file.
fn binary(bytes: &[u8]) -> Result<Mesh, FileError> {
    let mut joined = Joined::default();
    for (number, triangle) in bytes[HEAD..].chunks_exact(TRIANGLE).enumerate() {
        let place = Place::Byte(HEAD + number * TRIANGLE);
        let mut corners = Vec::with_capacity(3);
        for corner in triangle[12..48].chunks_exact(12) {
            let coordinate =
                |k: usize| f32::from_le_bytes([0, 1, 2, 3].map(|byte| corner[4 * k + byte]));
            let position = [0, 1, 2].map(|k| f64::from(coordinate(k)));
            if !position.iter().all(|x| x.is_finite()) {
                let what = format!("a corner of triangle {number} is not finite");
                return Err(FileError { place, what });
            }
            corners.push(joined.vertex(position));
        }
        joined.mesh.polygons.push(corners);
        joined.mesh.places.push(place);
    }
    Ok(joined.finish())
}

/// Reads a text file, whose facets may have more than three vertices.
fn text(text: &str) -> Result<Mesh, FileError> {
    let mut joined = Joined::default();
    let mut corners = Vec::new();
    let mut last = 1;
    let mut open = 0;
    // Collect the vertices of each facet from `facet` to `endfacet`; the words between them do not
    // matter.
    for (word, mut line) in Line::all(text, &[]) {
        last = line.number;
        match word.to_ascii_lowercase().as_str() {
            "vertex" => {
                let position = line.point()?;
                number_of(joined.mesh.vertices.len(), &line)?;
                corners.push(joined.vertex(position));
            }
            "facet" => open = line.number,
            "endfacet" => {
                if corners.len() < 3 {
                    let what = format!("a facet of {} vertices", corners.len());
                    return Err(line.error(what));
                }
                joined.mesh.polygons.push(std::mem::take(&mut corners));
                joined.mesh.places.push(Place::Line(open));
                open = 0;
            }
            "solid" | "outer" | "endloop" | "endsolid" => {}
            _ => {
                let shown: String = word.chars().take(super::SHOWN).collect();
                return Err(line.error(format!("`{shown}` begins no line of an STL file")));
            }
        }
    }
    if open > 0 || !corners.is_empty() {
        let (place, what) = (Place::Line(last), "the file ends within a facet".to_owned());
        return Err(FileError { place, what });
    }
    Ok(joined.finish())
}
