//! Wavefront OBJ with its material library.
//!
//! Faces (polygons are cut into triangles), line elements, groups by material. `Ke` makes the
//! faces of a material an area light (radiance in linear RGB, emitted on the outside), and its
//! line elements linear lights (`Ke` is then radiance × radius). The outside is where the vertex
//! normals point, or without them where the corners turn counter-clockwise. The world is
//! right-handed with y up; a camera that frames everything is added, since OBJ has none.

mod lines;
mod mtl;
mod statements;

use linelit_assembly::{Assembly, LoadOptions, Loaded};
use linelit_assembly::{Result, Source, about_its_middle};
use linelit_scene::{FilmSettings, Placement};
use mtl::Entry;
pub use statements::Polygons;
use statements::Statements;
use std::path::Path;
use std::sync::Arc;

/// Reads a scene from a file in memory.
pub(crate) fn load(
    source: Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    let source = as_utf8(source);
    about_its_middle(options, |options| scene(&source, path, options))
}

fn scene(source: &Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    let base = Assembly::new(path, source.bytes().len(), options);
    let mut statements = Statements::new(source, base);
    statements.read()?;
    let (mut base, shapes) = (statements.base, statements.shapes > 0);
    for group in statements.groups {
        let at = source.at(group.first);
        let Entry {
            index: material,
            emission,
            cutout,
        } = group.material;
        if let Some(spec) = &emission {
            for ends in group.segments {
                base.add_line(ends, spec, at)?;
            }
        }
        let place = Placement {
            material,
            emission,
            cutout,
            ..Placement::default()
        };
        if !group.mesh.triangles.is_empty() {
            base.add_mesh(&group.mesh, &place, "the mesh from here", at)?;
        }
    }
    base.finish(source.name(), shapes, None, FilmSettings::default())
}

/// Reads the polygons of a file, uncut.
///
/// # Errors
/// The first position or face that is wrong, with its place.
pub fn read_polygons(source: &Arc<Source>) -> Result<Polygons> {
    statements::polygons(&as_utf8(Arc::clone(source)))
}

/// A file whose text is UTF-8, as most are.
fn as_utf8(source: Arc<Source>) -> Arc<Source> {
    match utf16(source.bytes()) {
        Some(text) => Source::new(source.name().clone(), text.into_bytes()),
        None => source,
    }
}

/// The text of a file that begins with a UTF-16 byte order mark.
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
