//! Wavefront OBJ: vertices and faces, whole polygons.

use super::{FileError, Line, Mesh, Place, number_of};

/// Reads the statements `v` and `f` of an OBJ file, and none of the others.
///
/// # Errors
/// The first line that is wrong.
pub fn read(bytes: &[u8]) -> Result<Mesh, FileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = Mesh::default();
    for (word, mut line) in Line::all(&text, &['#']) {
        match word {
            "v" => mesh.vertices.push(line.point()?),
            "f" => {
                let count = number_of(mesh.vertices.len(), &line)?;
                let words = line.words.clone();
                let corners = words.map(|word| corner(word, count, &line));
                mesh.polygons.push(corners.collect::<Result<_, _>>()?);
                mesh.places.push(Place::Line(line.number));
            }
            _ => {}
        }
    }
    mesh.senders = mesh.polygons.len();
    Ok(mesh)
}

/// The vertex of `v`, `v/vt` or `v/vt/vn`: from one, or from −1 backwards.
fn corner(word: &str, count: u32, line: &Line<'_>) -> Result<u32, FileError> {
    let shown: String = word.chars().take(super::SHOWN).collect();
    let text = word.split('/').next().unwrap_or_default();
    let Ok(number) = text.parse::<i64>() else {
        return Err(line.error(format!("expected the number of a vertex, found `{shown}`")));
    };
    let index = match number {
        ..0 => i64::from(count).checked_add(number),
        _ => number.checked_sub(1),
    };
    let index = index.and_then(|index| u32::try_from(index).ok());
    index.filter(|index| *index < count).ok_or_else(|| {
        line.error(format!(
            "there is no vertex {number}: {count} stand before this line"
        ))
    })
}
