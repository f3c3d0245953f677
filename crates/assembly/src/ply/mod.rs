//! The reader of PLY meshes, in ASCII and in binary with either byte order. Polygons are
//! triangulated.
//!
//! It reads the vertex properties `x y z`, `nx ny nz` and `u v` (or `s t`, `texture_u texture_v`,
//! `texture_s texture_t`) and the face list `vertex_indices` (or `vertex_index`), and skips
//! everything else. The counts in the header are compared with the size of the file before memory
//! is allocated.

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

/// Reads a scene of one mesh with the default material, and a camera that sees all of it.
///
/// # Errors
/// The first error in the file, with its position. With [`LoadOptions::strict`], contents that are
/// not supported are errors, too.
pub fn load(source: &Source, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    about_its_middle(options, |options| scene(source, path, options))
}

/// Reads a scene with vertices relative to the origin in the options.
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
    /// The vertices, and the triangles of all polygons.
    pub mesh: MeshData,
    /// Warnings that name contents which were not read.
    pub left_out: Vec<String>,
}

/// Reads a mesh.
///
/// # Errors
/// The first error in the file, with its position.
pub fn read(source: &Source) -> Result<Mesh> {
    let header = Header::parse(source)?;
    let mut sink = Sink::new(source, &header)?;
    rows::read(source, &header, &mut sink)?;
    let left_out = sink.left_out(&header);
    let mesh = sink.mesh;
    Ok(Mesh { mesh, left_out })
}

/// Reads the positions of the vertices, and the corners of each polygon, without triangulating
/// them.
///
/// # Errors
/// The same as for [`read`].
pub fn read_polygons(source: &Source) -> Result<(Vec<DVec3>, Vec<Vec<u32>>)> {
    let header = Header::parse(source)?;
    let mut sink = Sink::new(source, &header)?;
    sink.polygons = Some(Vec::new());
    rows::read(source, &header, &mut sink)?;
    Ok((sink.mesh.positions, sink.polygons.unwrap_or_default()))
}

/// The largest number of names that a warning lists.
const LISTED: usize = 12;

/// The use of an element's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Vertex,
    Face,
    Skip,
}

/// Makes a mesh of the rows of vertices and faces that the reader passes to it.
#[derive(Debug)]
struct Sink {
    mesh: MeshData,
    /// The polygons, each as the indices of its corners, if they are not to be triangulated;
    /// otherwise `None`.
    polygons: Option<Vec<Vec<u32>>>,
    /// The number of faces so far.
    faces: usize,
    /// The index of the element of vertices.
    vertex: usize,
    /// The index of the element of faces.
    face: Option<usize>,
    /// The number of vertices in the header.
    vertex_count: usize,
    /// The indices of x, y and z among the properties of a vertex.
    position: [usize; 3],
    /// The indices of the normal's components among the properties of a vertex.
    normal: Option<[usize; 3]>,
    /// The indices of the texture coordinates among the properties of a vertex.
    uv: Option<[usize; 2]>,
    /// The index of the list of corners among the properties of a face.
    indices: usize,
}

/// The result for a row, whose error gets its position from the reader.
type RowResult = std::result::Result<(), String>;

impl Sink {
    /// Finds the elements and properties in the header.
    fn new(source: &Source, header: &Header) -> Result<Self> {
        let find = |name: &str| header.elements.iter().position(|e| e.name == name);
        let missing = |what: &str| {
            let message = format!("the PLY header has no {what}");
            let at = source.at(header.span);
            at.error(ErrorKind::MissingParameter, message, "the header ends here")
        };
        // Find the elements, and the list of corners.
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
        // Find the properties of vertices, under the first names of texture coordinates that exist.
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

    /// Returns the use of the rows of an element.
    fn role(&self, element: usize) -> Role {
        if element == self.vertex {
            Role::Vertex
        } else if self.face == Some(element) {
            Role::Face
        } else {
            Role::Skip
        }
    }

    /// Warnings with the names of elements and properties that are not read.
    fn left_out(&self, header: &Header) -> Vec<String> {
        /// Elements that mesh tools write often and renderers do not need.
        const SILENT: [&str; 2] = ["edge", "camera"];
        // Collect the names of properties and elements that have rows and are not read.
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
        // Make a warning for each list of names that is not empty.
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

    /// Reserves memory for a number of rows.
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

    /// Adds a vertex by the numbers of its row. A position that is not finite is an error; other
    /// attributes become zero.
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

    /// Adds a face of three corners, given as little-endian bytes. The result is false, and the
    /// face not added, if an index is out of range.
    fn triangle(&mut self, corners: &[[u8; 4]]) -> bool {
        let count = self.vertex_count;
        let index = |k: usize| u32::from_le_bytes(corners[k]);
        let triangle = [index(0), index(1), index(2)];
        // Negative indices are read as numbers from 2^31 on, which are refused as well.
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

    /// Adds a face by the list of its corners.
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
        // Add a triangle.
        if let (None, [a, b, c]) = (&self.polygons, indices) {
            self.mesh
                .triangles
                .push([index(*a)?, index(*b)?, index(*c)?]);
            return Ok(());
        }
        // Add a polygon as it is, or triangulated.
        let corners = indices.iter().map(|i| index(*i));
        let corners: Vec<u32> = corners.collect::<std::result::Result<_, _>>()?;
        if corners.len() < 3 {
            return Err(format!("face {number} has {} corners", corners.len()));
        }
        if let Some(polygons) = &mut self.polygons {
            polygons.push(corners);
            return Ok(());
        }
        // If the vertices come after the faces, their positions are not known: make a fan.
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

/// Returns the indices of the scalar properties with these names, if all of them exist.
fn columns<const N: usize>(element: &Element, names: &str) -> Option<[usize; N]> {
    let find = |name| {
        let mut all = element.properties.iter();
        all.position(|p| p.name == name && p.length.is_none())
    };
    let found: Option<Vec<usize>> = names.split(' ').map(find).collect();
    found?.try_into().ok()
}
