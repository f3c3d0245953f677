//! PLY meshes: ASCII and binary of either byte order, with polygons cut into triangles.
//!
//! Read are the vertex properties `x y z`, `nx ny nz` and `u v` (or `s t`, `texture_u texture_v`)
//! and the face list `vertex_indices` (or `vertex_index`); everything else is read past. Counts in
//! the header are checked against the size of the file before anything is allocated.

mod header;
mod rows;

use crate::assembly::Assembly;
use crate::diagnostics::{ErrorKind, Result, Source, shorten};
use crate::options::{LoadOptions, Loaded, about_its_middle};
use crate::polygon::triangulate;
use header::{Element, Header, Property};
use linelit_geometry::DVec3;
use linelit_scene::{FilmSettings, MeshData, Placement};
use std::path::Path;

/// Reads a scene that is one mesh of the default material, seen by a camera that frames it.
///
/// # Errors
/// Whatever is wrong with the file, with its place; when [`LoadOptions::strict`] also what is
/// merely not supported.
pub fn load(source: &Source, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    about_its_middle(options, |options| scene(source, path, options))
}

fn scene(source: &Source, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    let mut base = Assembly::new(path, source.bytes().len(), options);
    let Mesh { mesh, left_out } = read(source)?;
    for message in left_out {
        base.unsupported(message, "", source.whole())?;
    }
    let has_shapes = !mesh.triangles.is_empty();
    let place = Placement::default();
    base.add_mesh(&mesh, &place, "the mesh", source.whole())?;
    base.finish(source.name(), has_shapes, None, FilmSettings::default())
}

/// The contents of a file.
#[derive(Debug)]
pub struct Mesh {
    /// Vertices, and polygons cut into triangles.
    pub mesh: MeshData,
    /// The names of other contents, for warnings.
    pub left_out: Vec<String>,
}

/// Reads a mesh.
///
/// # Errors
/// Whatever is wrong with the file, with its place.
pub fn read(source: &Source) -> Result<Mesh> {
    let header = Header::parse(source)?;
    let mut sink = Sink::new(source, &header)?;
    rows::read(source, &header, &mut sink)?;
    let left_out = sink.left_out(&header);
    let mesh = sink.mesh;
    Ok(Mesh { mesh, left_out })
}

/// Reads the positions of the vertices, and the corners of each polygon, uncut.
///
/// # Errors
/// As [`read`].
pub fn read_polygons(source: &Source) -> Result<(Vec<DVec3>, Vec<Vec<u32>>)> {
    let header = Header::parse(source)?;
    let mut sink = Sink::new(source, &header)?;
    sink.polygons = Some(Vec::new());
    rows::read(source, &header, &mut sink)?;
    Ok((sink.mesh.positions, sink.polygons.unwrap_or_default()))
}

/// Names that a warning lists.
const LISTED: usize = 12;

/// The role of an element's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Vertex,
    Face,
    Skip,
}

/// Takes the rows of the elements.
#[derive(Debug)]
struct Sink {
    mesh: MeshData,
    /// Polygons that are not to be cut, if that is asked.
    polygons: Option<Vec<Vec<u32>>>,
    faces: usize,
    /// The index of the element of vertices.
    vertex: usize,
    face: Option<usize>,
    vertex_count: usize,
    /// Among the properties of a vertex.
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
    /// The list of corners among the properties of a face.
    indices: usize,
}

/// Why a row was refused; the readers add the place.
type RowResult = std::result::Result<(), String>;

impl Sink {
    fn new(source: &Source, header: &Header) -> Result<Self> {
        let find = |name: &str| header.elements.iter().position(|e| e.name == name);
        let missing = |what: &str| {
            let message = format!("the PLY header has no {what}");
            let at = source.at(header.span);
            at.error(ErrorKind::MissingParameter, message, "the header ends here")
        };
        let vertex = find("vertex").ok_or_else(|| missing("element `vertex`"))?;
        let element = &header.elements[vertex];
        let face = find("face");
        let indices = face.map(|f| {
            let is_list = |p: &Property| {
                let named = ["vertex_indices", "vertex_index"].contains(&p.name.as_str());
                named && p.length.is_some() && !p.item.is_float()
            };
            let list = header.elements[f].properties.iter().position(is_list);
            list.ok_or_else(|| missing("face property list `vertex_indices`"))
        });
        let uvs = ["u v", "s t", "texture_u texture_v", "texture_s texture_t"];
        Ok(Self {
            mesh: MeshData::default(),
            polygons: None,
            faces: 0,
            vertex,
            face,
            vertex_count: element.count,
            position: columns(element, "x y z")
                .ok_or_else(|| missing("vertex properties `x`, `y` and `z`"))?,
            normal: columns(element, "nx ny nz"),
            uv: uvs.into_iter().find_map(|names| columns(element, names)),
            indices: indices.transpose()?.unwrap_or_default(),
        })
    }

    fn role(&self, element: usize) -> Role {
        if element == self.vertex {
            Role::Vertex
        } else if self.face == Some(element) {
            Role::Face
        } else {
            Role::Skip
        }
    }

    /// Returns the names of elements and properties that are not read.
    fn left_out(&self, header: &Header) -> Vec<String> {
        // What every mesh tool writes and no renderer needs.
        const SILENT: [&str; 2] = ["edge", "camera"];
        let of_vertex = self.position.iter().chain(self.normal.iter().flatten());
        let of_vertex: Vec<usize> = of_vertex.chain(self.uv.iter().flatten()).copied().collect();
        let unread = |element: usize, read: &[usize]| -> Vec<&str> {
            let Element {
                count, properties, ..
            } = &header.elements[element];
            let all = properties.iter().enumerate().filter(|_| *count > 0);
            let unread = all.filter(|(k, _)| !read.contains(k));
            unread.map(|(_, p)| &*p.name).collect()
        };
        let elements = header.elements.iter().enumerate().filter(|(k, e)| {
            self.role(*k) == Role::Skip && e.count > 0 && !SILENT.contains(&e.name.as_str())
        });
        let list = |what: &str, names: Vec<&str>| {
            let shown = names.iter().take(LISTED);
            let shown: Vec<_> = shown.map(|n| format!("`{}`", shorten(n))).collect();
            let message = format!("{what} are left out: {}", shown.join(", "));
            (!names.is_empty()).then_some(message)
        };
        [
            list("vertex properties", unread(self.vertex, &of_vertex)),
            self.face
                .and_then(|face| list("face properties", unread(face, &[self.indices]))),
            list("elements", elements.map(|(_, e)| &*e.name).collect()),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn reserve(&mut self, role: Role, rows: usize) {
        match role {
            Role::Vertex => {
                self.mesh.positions.reserve(rows);
                self.mesh.normals.reserve(self.normal.map_or(0, |_| rows));
                self.mesh.uvs.reserve(self.uv.map_or(0, |_| rows));
            }
            Role::Face => self.mesh.triangles.reserve(rows),
            Role::Skip => {}
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "normals and texture coordinates are f32"
    )]
    fn vertex(&mut self, row: &[f64]) -> RowResult {
        fn finite<const N: usize>(row: &[f64], columns: [usize; N]) -> [f32; N] {
            let values = columns.map(|i| row[i] as f32);
            if values.iter().all(|c| c.is_finite()) {
                values
            } else {
                [0.0; N]
            }
        }
        let p = DVec3::from_array(self.position.map(|i| row[i]));
        if !p.is_finite() {
            let number = self.mesh.positions.len();
            return Err(format!("vertex {number} is not finite"));
        }
        self.mesh.positions.push(p);
        let normal = self.normal.map(|columns| finite(row, columns));
        self.mesh.normals.extend(normal);
        let uv = self.uv.map(|columns| finite(row, columns));
        self.mesh.uvs.extend(uv);
        Ok(())
    }

    /// A face of three corners, as little-endian bytes; false if one is out of range.
    fn triangle(&mut self, corners: &[[u8; 4]]) -> bool {
        let count = self.vertex_count;
        let index = |k: usize| u32::from_le_bytes(corners[k]);
        let triangle = [index(0), index(1), index(2)];
        // What is negative is beyond 2^31 here, which would be an error as well.
        let fits = triangle
            .iter()
            .all(|i| (*i as usize) < count && *i < 1 << 31);
        if fits {
            self.faces += 1;
            match &mut self.polygons {
                Some(polygons) => polygons.push(triangle.to_vec()),
                None => self.mesh.triangles.push(triangle),
            }
        }
        fits
    }

    fn face(&mut self, indices: &[f64]) -> RowResult {
        let (number, count) = (self.faces, self.vertex_count);
        self.faces += 1;
        let index = |i: f64| {
            if (0.0..count.min(1 << 32) as f64).contains(&i) {
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "an integer in range"
                )]
                return Ok(i as u32);
            }
            Err(format!(
                "face {number} refers to vertex {i}, but there are {count} vertices"
            ))
        };
        if let (None, [a, b, c]) = (&self.polygons, indices) {
            self.mesh
                .triangles
                .push([index(*a)?, index(*b)?, index(*c)?]);
            return Ok(());
        }
        let corners = indices.iter().map(|i| index(*i));
        let corners: Vec<u32> = corners.collect::<std::result::Result<_, _>>()?;
        if corners.len() < 3 {
            return Err(format!("face {number} has {} corners", corners.len()));
        }
        if let Some(polygons) = &mut self.polygons {
            polygons.push(corners);
            return Ok(());
        }
        // Where vertices come behind the faces, polygons are fans.
        if self.mesh.positions.len() < count {
            let fan = corners[1..]
                .windows(2)
                .map(|two| [corners[0], two[0], two[1]]);
            self.mesh.triangles.extend(fan);
            return Ok(());
        }
        triangulate(&self.mesh.positions, &corners, &mut self.mesh.triangles)
            .map_err(|it| format!("face {number} {it}"))
    }
}

/// The numbers of the scalar properties of these names, if all are there.
fn columns<const N: usize>(element: &Element, names: &str) -> Option<[usize; N]> {
    let find = |name| {
        let mut all = element.properties.iter();
        all.position(|p| p.name == name && p.length.is_none())
    };
    let found: Option<Vec<usize>> = names.split(' ').map(find).collect();
    found?.try_into().ok()
}
