//! PLY meshes: ASCII and binary of either byte order, with polygons cut into triangles.
//!
//! Read are the vertex properties `x y z`, `nx ny nz` and `u v` (or `s t`, `texture_u texture_v`)
//! and the face list `vertex_indices` (or `vertex_index`); everything else is read past. Counts in
//! the header are checked against the size of the file before anything is allocated.

mod ascii;
mod binary;
mod header;

use crate::assembly::Assembly;
use crate::diagnostics::{ErrorKind, Result, SceneError, Source};
use crate::options::{LoadOptions, Loaded};
use crate::polygon::triangulate;
use header::{Element, Format, Header};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use linelit_scene::{FilmSettings, MeshData, Placement};
use std::path::Path;

/// Reads a scene that is one mesh of the default material, seen by a camera that frames it.
pub fn load(source: &Source, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    let mut base = Assembly::new(path, source.bytes().len(), options);
    let Mesh { mesh, left_out } = read(source)?;
    for message in left_out {
        let whole = |e: SceneError| e.in_file(source.name());
        base.warnings.warn(ErrorKind::Unsupported, message, whole)?;
    }
    let at = |e: SceneError, _: &str| e.in_file(source.name());
    let place = Placement {
        to_world: DAffine3::IDENTITY,
        reverse: false,
        material: 0,
        emission: None,
    };
    let has_shapes = !mesh.triangles.is_empty();
    base.place(&mesh, &place, "the mesh", &at)?;
    base.finish(source.name(), has_shapes, None, FilmSettings::default())
}

/// What a file holds.
#[derive(Debug)]
pub struct Mesh {
    /// Vertices, and polygons cut into triangles.
    pub mesh: MeshData,
    /// What it holds besides, for warnings.
    pub left_out: Vec<String>,
}

/// Reads a mesh.
pub fn read(source: &Source) -> Result<Mesh> {
    let header = Header::parse(source)?;
    let layout = Layout::new(source, &header)?;
    let mut sink = Sink {
        mesh: MeshData::default(),
        layout,
        faces: 0,
    };
    match header.format {
        Format::Ascii => ascii::read(source, &header, &mut sink)?,
        Format::Little => binary::read::<true>(source, &header, &mut sink)?,
        Format::Big => binary::read::<false>(source, &header, &mut sink)?,
    }
    let left_out = sink.layout.left_out(&header);
    Ok(Mesh {
        mesh: sink.mesh,
        left_out,
    })
}

/// Names that a warning lists.
const LISTED: usize = 12;

/// Where the properties that we want stand among the others.
#[derive(Debug)]
struct Layout {
    vertex: Option<usize>,
    face: Option<usize>,
    /// Property numbers of x, y, z.
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
    /// Property number of the index list.
    indices: usize,
    vertex_count: usize,
}

impl Layout {
    fn new(source: &Source, header: &Header) -> Result<Self> {
        let find = |name: &str| header.elements.iter().position(|e| e.name == name);
        let missing = |what: &str| {
            SceneError::new(
                ErrorKind::MissingParameter,
                format!("the PLY header has no {what}"),
            )
            .at(source, header.span, "the header ends here")
        };
        let vertex = find("vertex").ok_or_else(|| missing("element `vertex`"))?;
        let element = &header.elements[vertex];
        let scalar = |name: &str| element.scalar(name);
        let all = |names: &[&str]| names.iter().map(|n| scalar(n)).collect::<Option<Vec<_>>>();
        let position = match all(&["x", "y", "z"]) {
            Some(p) => [p[0], p[1], p[2]],
            None => return Err(missing("vertex properties `x`, `y` and `z`")),
        };
        let pairs = [
            ["u", "v"],
            ["s", "t"],
            ["texture_u", "texture_v"],
            ["texture_s", "texture_t"],
        ];
        let uv = pairs
            .iter()
            .find_map(|names| all(names))
            .map(|p| [p[0], p[1]]);
        let face = find("face");
        let indices = match face {
            Some(f) => header.elements[f]
                .list(&["vertex_indices", "vertex_index"])
                .ok_or_else(|| missing("face property list `vertex_indices`"))?,
            None => 0,
        };
        Ok(Self {
            vertex: Some(vertex),
            face,
            position,
            normal: all(&["nx", "ny", "nz"]).map(|p| [p[0], p[1], p[2]]),
            uv,
            indices,
            vertex_count: element.count,
        })
    }
}

impl Layout {
    /// What the header describes and nobody reads.
    fn left_out(&self, header: &Header) -> Vec<String> {
        let mut messages = Vec::new();
        let list = |names: &[&str]| {
            let shown: Vec<String> = names
                .iter()
                .take(LISTED)
                .map(|n| format!("`{}`", n.chars().take(40).collect::<String>()))
                .collect();
            shown.join(", ")
        };
        let is_read = |k: usize| {
            let uv = self.uv.iter().flatten();
            let normal = self.normal.iter().flatten();
            self.position
                .iter()
                .chain(normal)
                .chain(uv)
                .any(|i| *i == k)
        };
        if let Some(vertex) = self.vertex {
            let properties = header.elements[vertex].properties.iter().enumerate();
            let names: Vec<&str> = properties
                .filter(|(k, _)| !is_read(*k))
                .map(|(_, p)| p.name.as_str())
                .collect();
            if !names.is_empty() {
                messages.push(format!("vertex properties are left out: {}", list(&names)));
            }
        }
        // What every mesh tool writes and no renderer needs.
        const SILENT: [&str; 2] = ["edge", "camera"];
        let elements = header.elements.iter().enumerate();
        let names: Vec<&str> = elements
            .filter(|(k, e)| {
                element_role(self, *k) == Role::Skip
                    && e.count > 0
                    && !SILENT.contains(&e.name.as_str())
            })
            .map(|(_, e)| e.name.as_str())
            .collect();
        if !names.is_empty() {
            messages.push(format!("elements are left out: {}", list(&names)));
        }
        messages
    }
}

/// Why a row was refused; the readers add the place.
type RowResult = std::result::Result<(), String>;

/// Takes the rows of the elements.
#[derive(Debug)]
struct Sink {
    mesh: MeshData,
    layout: Layout,
    faces: usize,
}

impl Sink {
    fn reserve(&mut self, vertices: usize, faces: usize) {
        self.mesh.positions.reserve(vertices);
        if self.layout.normal.is_some() {
            self.mesh.normals.reserve(vertices);
        }
        if self.layout.uv.is_some() {
            self.mesh.uvs.reserve(vertices);
        }
        self.mesh.triangles.reserve(faces);
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "normals and texture coordinates are f32"
    )]
    fn vertex(&mut self, row: &[f64]) -> RowResult {
        let layout = &self.layout;
        let p = layout.position.map(|i| row[i]);
        if !p.iter().all(|c| c.is_finite()) {
            return Err(format!(
                "vertex {} is not finite",
                self.mesh.positions.len()
            ));
        }
        self.mesh.positions.push(DVec3::from_array(p));
        if let Some(normal) = layout.normal {
            let n = normal.map(|i| row[i] as f32);
            let finite = n.iter().all(|c| c.is_finite());
            self.mesh.normals.push(if finite { n } else { [0.0; 3] });
        }
        if let Some(uv) = layout.uv {
            let uv = uv.map(|i| row[i] as f32);
            let finite = uv.iter().all(|c| c.is_finite());
            self.mesh.uvs.push(if finite { uv } else { [0.0; 2] });
        }
        Ok(())
    }

    fn face(&mut self, indices: &[i64]) -> RowResult {
        let number = self.faces;
        self.faces += 1;
        let count = self.layout.vertex_count;
        let mut small = [0_u32; 4];
        let mut large = Vec::new();
        let corners: &mut [u32] = if indices.len() <= 4 {
            &mut small[..indices.len()]
        } else {
            large.resize(indices.len(), 0);
            &mut large
        };
        for (corner, &i) in corners.iter_mut().zip(indices) {
            *corner = u32::try_from(i)
                .ok()
                .filter(|i| (*i as usize) < count)
                .ok_or_else(|| {
                    format!("face {number} refers to vertex {i}, but there are {count} vertices")
                })?;
        }
        match *corners {
            [_, _] | [_] | [] => Err(format!("face {number} has {} corners", indices.len())),
            [a, b, c] => {
                self.mesh.triangles.push([a, b, c]);
                Ok(())
            }
            // Vertices may come behind the faces, so polygons are cut in the end if they must be.
            _ if self.mesh.positions.len() < count => {
                let fan = 1..corners.len() - 1;
                self.mesh
                    .triangles
                    .extend(fan.map(|k| [corners[0], corners[k], corners[k + 1]]));
                Ok(())
            }
            _ => {
                triangulate(&self.mesh.positions, corners, &mut self.mesh.triangles);
                Ok(())
            }
        }
    }
}

/// The readers call this for each element.
fn element_role(layout: &Layout, index: usize) -> Role {
    if layout.vertex == Some(index) {
        Role::Vertex
    } else if layout.face == Some(index) {
        Role::Face
    } else {
        Role::Skip
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Vertex,
    Face,
    Skip,
}

/// The message for a file that ends before its header's promise.
fn truncated(element: &Element, row: usize) -> SceneError {
    SceneError::new(
        ErrorKind::Truncated,
        format!(
            "the file ends in `{}` {row} of {}",
            element.name, element.count
        ),
    )
}
