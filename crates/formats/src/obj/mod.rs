//! The reader of Wavefront OBJ files with their material libraries.
//!
//! It reads faces (polygons are triangulated) and line elements, in groups by material. `Ke` makes
//! the faces of a material an area light (radiance in linear RGB, emitted on the outside), and its
//! line elements linear lights (`Ke` is then radiance × radius). The outside is where the vertex
//! normals point, or without normals the side from which the corners run counter-clockwise. The
//! world is right-handed with y up. A camera that frames everything is added, since OBJ has none.

mod lines;
mod mtl;
mod statements;

use linelit_assembly::{Assembly, ErrorKind, LoadOptions, Loaded};
use linelit_assembly::{Result, Source, about_its_middle, triangulate};
use linelit_geometry::DVec3;
use linelit_scene::{FilmSettings, MeshData, Placement};
use mtl::Entry;
pub use statements::Polygons;
use statements::Statements;
use std::path::Path;
use std::sync::Arc;
use tobj::Mesh;

/// Reads a scene from a file in memory. [`Statements`] checks each statement and passes a rewritten
/// text to the crate tobj, which makes one mesh of each group of faces, and one of each line
/// element.
pub(crate) fn load(
    source: Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    let source = as_utf8(source);
    about_its_middle(options, |options| scene(&source, path, options))
}

/// Reads a scene with vertices relative to the origin in the options.
fn scene(source: &Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    // Read the material libraries, then all other statements through tobj.
    let base = Assembly::new(path, source.bytes().len(), options);
    let mut statements = Statements::new(source, base);
    statements.read_libraries()?;
    let one_index = tobj::LoadOptions {
        single_index: true,
        ..tobj::LoadOptions::default()
    };
    let no_library = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let read = tobj::load_obj_buf(&mut statements, &one_index, no_library);
    let (models, _) = statements.check(read)?;
    // Add the lines and meshes of each group to the scene. A model's name is the number of its
    // group; the model before the first group is empty.
    let mut base = statements.base;
    for model in models {
        let group = model.name.parse().ok();
        let Some(group) = group.and_then(|k: usize| statements.groups.get(k)) else {
            continue;
        };
        let at = source.at(group.first);
        let Entry {
            index: material,
            emission,
            cutout,
        } = group.material;
        if let Some(spec) = emission.filter(|_| group.is_line) {
            for ends in model.mesh.indices.as_chunks::<2>().0 {
                base.add_line(ends.map(|k| position(&model.mesh, k)), &spec, at)?;
            }
            continue;
        }
        let (mesh, left_out) = mesh_data(model.mesh);
        for it in left_out {
            base.warn(ErrorKind::BadMesh, format!("a face {it}"), "left out", at)?;
        }
        let place = Placement {
            material,
            emission,
            cutout,
            ..Placement::default()
        };
        if !mesh.triangles.is_empty() {
            base.add_mesh(&mesh, &place, "the mesh from here", at)?;
        }
    }
    let shapes = statements.shapes > 0;
    base.finish(source.name(), shapes, None, FilmSettings::default())
}

/// Reads the polygons of a file without triangulating them.
///
/// # Errors
/// The first position or face that is not valid, with its position in the file.
pub fn read_polygons(source: &Arc<Source>) -> Result<Polygons> {
    statements::polygons(&as_utf8(Arc::clone(source)))
}

/// Returns the file in UTF-8: itself, unless it begins with a byte order mark of UTF-16.
fn as_utf8(source: Arc<Source>) -> Arc<Source> {
    match utf16(source.bytes()) {
        Some(text) => Source::new(source.name().clone(), text.into_bytes()),
        None => source,
    }
}

/// Returns the position of a vertex.
fn position(mesh: &Mesh, index: u32) -> DVec3 {
    let start = 3 * index as usize;
    DVec3::from_array([0, 1, 2].map(|k| mesh.positions[start + k]))
}

/// Triangulates a mesh of polygons. The texts in the result say why some polygons were left out.
fn mesh_data(mesh: Mesh) -> (MeshData, Vec<String>) {
    let mut left_out = Vec::new();
    let count = mesh.positions.len() / 3;
    let mut data = MeshData {
        positions: (0..count).map(|k| position(&mesh, index(k))).collect(),
        normals: singles(&mesh.normals),
        uvs: singles(&mesh.texcoords),
        ..MeshData::default()
    };
    if mesh.face_arities.is_empty() {
        data.triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    }
    let mut rest = &mesh.indices[..];
    for arity in mesh.face_arities {
        let (corners, behind) = rest.split_at(arity as usize);
        left_out.extend(triangulate(&data.positions, corners, &mut data.triangles).err());
        rest = behind;
    }
    (data, left_out)
}

/// Groups numbers into normals or texture coordinates in single precision.
#[allow(clippy::cast_possible_truncation, reason = "they are f32 in a scene")]
fn singles<const N: usize>(values: &[f64]) -> Vec<[f32; N]> {
    let rows = values.as_chunks::<N>().0.iter();
    rows.map(|row| row.map(|x| x as f32)).collect()
}

/// Returns the index of a vertex as tobj has it, a `u32`.
fn index(k: usize) -> u32 {
    u32::try_from(k).unwrap_or(u32::MAX)
}

/// Returns the text of a file that begins with a byte order mark of UTF-16; `None` for other files.
fn utf16(bytes: &[u8]) -> Option<String> {
    let (big, rest) = match bytes {
        [0xfe, 0xff, rest @ ..] => (true, rest),
        [0xff, 0xfe, rest @ ..] => (false, rest),
        _ => return None,
    };
    let units = rest.as_chunks::<2>().0.iter().map(|unit| {
        if big {
            u16::from_be_bytes(*unit)
        } else {
            u16::from_le_bytes(*unit)
        }
    });
    let chars = char::decode_utf16(units);
    Some(
        chars
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf16_text_is_converted() {
        assert_eq!(utf16(b"\xfe\xff\0v\0 \0\xe4").as_deref(), Some("v \u{e4}"));
        assert_eq!(utf16(b"\xff\xfev\0").as_deref(), Some("v"));
        assert_eq!(utf16(b"v 1 2 3"), None);
    }
}
