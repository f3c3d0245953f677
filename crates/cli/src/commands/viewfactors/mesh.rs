//! Readers of facets: polygons from geometry files, or the triangles of a scene.

use anyhow::{Result, anyhow, bail};
use linelit_formats::assembly::{Source, ply};
use linelit_formats::obj;
use linelit_geometry::DVec3;
use linelit_scenes::{Library, SceneLocation};
use linelit_viewfactors::files::{self, Mesh};
use linelit_viewfactors::{FacetError, Facets, Sides};
use std::path::Path;
use std::sync::Arc;

/// A reader of polygons.
type Reader = fn(&Arc<Source>) -> Result<Mesh>;

/// Reads facets from a file: polygons if there is a reader of polygons for its format, otherwise
/// the triangles of a scene.
pub(super) fn read(library: &Library, name: &str) -> Result<Mesh> {
    let mesh = match reader(name) {
        None => triangles(library.load(name)?),
        Some(reader) => {
            let SceneLocation::File(path) = SceneLocation::find(name)? else {
                bail!("`{name}` is no file");
            };
            let source = Source::open(&path, &library.options)?;
            let own = path.file_name().unwrap_or_default().to_string_lossy();
            library.options.watch.tell(&own, source.bytes());
            reader(&source)?
        }
    };
    for note in &mesh.notes {
        (library.note)(format_args!("note: {name}: {note}"));
    }
    if mesh.senders == 0 {
        bail!("{name}: no facets");
    }
    Ok(mesh)
}

/// Returns the reader of polygons for files with this name's ending, if there is one.
fn reader(name: &str) -> Option<Reader> {
    let ending = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
    let reader: Reader = match ending.as_str() {
        "vs3" => |source| of_file(source, files::vs3),
        "stl" => |source| of_file(source, files::stl),
        "obj" => of_obj,
        "ply" => of_ply,
        _ => return None,
    };
    Some(reader)
}

/// Reads a file by a parser, and adds the file's name to its errors.
fn of_file(
    source: &Source,
    read: impl Fn(&[u8]) -> Result<Mesh, files::FileError>,
) -> Result<Mesh> {
    read(source.bytes()).map_err(|error| anyhow!("{}, {error}", source.name()))
}

/// Reads the polygons of a PLY file.
fn of_ply(source: &Arc<Source>) -> Result<Mesh> {
    let (positions, polygons) = ply::read_polygons(source)?;
    Ok(of_polygons(&positions, polygons, &[]))
}

/// Reads the polygons of an OBJ file, with their lines in the file.
fn of_obj(source: &Arc<Source>) -> Result<Mesh> {
    let found = obj::read_polygons(source)?;
    Ok(of_polygons(&found.positions, found.polygons, &found.lines))
}

/// Returns the facets that polygons make; `lines` has the line of each polygon in its file, or is
/// empty.
fn of_polygons(positions: &[DVec3], polygons: Vec<Vec<u32>>, lines: &[usize]) -> Mesh {
    Mesh {
        vertices: positions.iter().map(DVec3::to_array).collect(),
        senders: polygons.len(),
        polygons,
        places: lines.iter().map(|line| files::Place::Line(*line)).collect(),
        ..Mesh::default()
    }
}

/// Returns the triangles of a scene as facets.
fn triangles(loaded: linelit_formats::Loaded) -> Mesh {
    let scene = loaded.scene;
    Mesh {
        vertices: (0_u32..)
            .zip(&scene.positions)
            .map(|(i, _)| scene.vertex(i).to_array())
            .collect(),
        polygons: scene.triangles.iter().map(|t| t.to_vec()).collect(),
        senders: scene.triangles.len(),
        ..Mesh::default()
    }
}

/// Returns the facets of a file. Errors state the position in the file of the first invalid facet,
/// if it is known.
pub(super) fn facets(name: &str, mesh: &Mesh, sides: u8) -> Result<Facets> {
    let sides = if sides == 2 { Sides::Two } else { Sides::One };
    Facets::new(&mesh.vertices, &mesh.polygons, sides).map_err(|error| {
        let facet = match error {
            FacetError::Vertex(_) | FacetError::TooMany => None,
            FacetError::NoVertex { facet, .. }
            | FacetError::NoArea(facet)
            | FacetError::NotFlat(facet)
            | FacetError::Crossing(facet) => mesh.places.get(facet),
        };
        match facet {
            Some(place) => anyhow!("{name}, {place}: {error} (facets are counted from 0)"),
            None => anyhow!("{name}: {error} (counted from 0)"),
        }
    })
}
