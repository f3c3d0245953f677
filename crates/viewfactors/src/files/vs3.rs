//! The reader of View3D's input with geometry `F 3`: numbered vertices, and surfaces of three or
//! four of them.

use super::{FileError, Line, Mesh, Place};

/// Reads a `.vs3` file with the lines `T`, `C`, `F 3`, `V`, `S`, `O` and `E`, in upper or lower
/// case; `!` and `/` begin comments. An `O` surface hides others and has no row. Control lines
/// (`C`) are meant for View3D and ignored.
///
/// # Errors
/// Returns an error for the first line that is wrong or uses what is not supported: masks (`M`,
/// `N`), surfaces within others (`base`), and geometries other than `F 3`.
pub fn read(bytes: &[u8]) -> Result<Mesh, FileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = Mesh::default();
    let mut combined = None;
    for (word, mut line) in Line::all(&text, &['!', '/']) {
        // The first character alone determines the kind of the line.
        match word.as_bytes()[0].to_ascii_uppercase() {
            b'T' | b'C' => {}
            b'E' | b'*' => break,
            b'F' => {
                let form: String = line.read("the geometry `3`")?;
                if form != "3" {
                    return Err(line.error(format!("the geometry `F {form}` is not supported")));
                }
            }
            b'V' => {
                in_order(&mut line, "vertex", mesh.vertices.len())?;
                mesh.vertices.push(line.point()?);
            }
            b'S' if mesh.polygons.len() > mesh.senders => {
                return Err(line.error("a surface `S` stands behind an obstruction `O`"));
            }
            b'S' => {
                surface(&mut mesh, &mut line)?;
                mesh.senders += 1;
                if emittance(&mut mesh, &mut line)? {
                    combined.get_or_insert(line.number);
                }
            }
            b'O' => surface(&mut mesh, &mut line)?,
            b'M' | b'N' => {
                let what = "masks are not supported: cut the surface below into polygons";
                return Err(line.error(what));
            }
            _ => {
                let shown: String = word.chars().take(super::SHOWN).collect();
                return Err(line.error(format!("`{shown}` begins no line of a .vs3 file")));
            }
        }
    }
    mesh.notes.extend(combined.map(|number| {
        format!("line {number}: surfaces are not combined (`cmb`): each has a row of its own")
    }));
    Ok(mesh)
}

/// Checks that vertices or surfaces are numbered consecutively from one, as View3D requires.
fn in_order(line: &mut Line<'_>, what: &str, count: usize) -> Result<(), FileError> {
    let number: usize = line.read(&format!("the number of a {what}"))?;
    if number != count + 1 {
        let message = format!("{what} {number} stands where {what} {} should", count + 1);
        return Err(line.error(message));
    }
    Ok(())
}

/// Reads the number of a surface and its vertices; the fourth vertex is 0 for triangles.
fn surface(mesh: &mut Mesh, line: &mut Line<'_>) -> Result<(), FileError> {
    in_order(line, "surface", mesh.polygons.len())?;
    let mut corners = Vec::with_capacity(4);
    for k in 0..4 {
        let vertex: u32 = line.read("the number of a vertex")?;
        match vertex.checked_sub(1) {
            None if k == 3 => {}
            Some(index) if (index as usize) < mesh.vertices.len() => corners.push(index),
            _ => {
                let count = mesh.vertices.len();
                let what = format!("there is no vertex {vertex}: {count} stand before this line");
                return Err(line.error(what));
            }
        }
    }
    mesh.polygons.push(corners);
    mesh.places.push(Place::Line(line.number));
    Ok(())
}

/// Reads the base, the combination and the emittance of a surface; returns whether the file wants
/// it to be combined with another.
fn emittance(mesh: &mut Mesh, line: &mut Line<'_>) -> Result<bool, FileError> {
    let base: u32 = line.read("the number of the base surface")?;
    if base != 0 {
        let what = format!(
            "a surface within another (base {base}) is not supported: cut surface {base} into \
             polygons around it"
        );
        return Err(line.error(what));
    }
    let combined: u32 = line.read("the number of the surface to combine with")?;
    mesh.emittances.push(line.number("the emittance")?);
    Ok(combined != 0)
}
