//! The meshes of glTF: their primitives become triangle meshes and lines, which each node places.

use super::Reader;
use super::buffers::Numbers;
use super::document::{Document, List, Raw};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use linelit_assembly::{ErrorKind, Holes, Result};
use linelit_geometry::glam::DAffine3;
use linelit_geometry::{DVec3, stop};
use linelit_scene::{Cutout, EmissionSpec, MeshData, Placement};
use serde::Deserialize;
use std::collections::HashMap;
use std::rc::Rc;

/// A mesh of the file.
#[derive(Deserialize)]
struct JsonMesh<'a> {
    #[serde(borrow)]
    primitives: Vec<Raw<'a>>,
}

/// The geometry of a primitive.
#[derive(Debug)]
enum Shape {
    Triangles(Rc<MeshData>),
    Lines(Vec<[DVec3; 2]>),
}

/// A mesh that has been read.
#[derive(Debug)]
pub(super) struct Mesh {
    /// The shapes with their materials, which are copied for each instance.
    shapes: Vec<(Shape, Placement)>,
    /// The number of primitives of the mesh.
    count: usize,
}

impl<'a> Reader<'a> {
    /// Adds an instance of a mesh to the scene.
    pub(super) fn place_mesh(&mut self, index: usize, to_world: DAffine3) -> Result<()> {
        // Read the mesh with its first instance.
        let doc = self.doc;
        let at = doc.at_start(doc.known(List::Meshes, index));
        let mesh = match &self.meshes[index] {
            Some(mesh) => Rc::clone(mesh),
            None => {
                let mesh = Rc::new(self.mesh(index)?);
                self.meshes[index] = Some(Rc::clone(&mesh));
                mesh
            }
        };
        self.shapes += mesh.count;
        // Count instances, from the second on: a mesh with one instance is not an object.
        self.places[index] += 1;
        let placed = &mut self.base.builder.placed;
        match self.places[index] {
            1 => {}
            2 => {
                placed.objects += 1;
                placed.instances += 2;
            }
            _ => placed.instances += 1,
        }
        // Add its shapes under the transform.
        for (shape, placement) in &mesh.shapes {
            match shape {
                Shape::Triangles(triangles) => {
                    let placement = Placement {
                        to_world,
                        ..*placement
                    };
                    self.base.add_mesh(triangles, &placement, "the mesh", at)?;
                }
                Shape::Lines(lines) => match &placement.emission {
                    Some(spec) => {
                        for line in lines {
                            let ends = line.map(|p| to_world.transform_point3(p));
                            self.base.add_line(ends, spec, at)?;
                        }
                    }
                    None => {
                        let message = "lines without an emissive material are nothing";
                        self.base.suspicious(message, "left out", at)?;
                    }
                },
            }
        }
        Ok(())
    }

    /// Reads a mesh, with the material of each of its primitives.
    fn mesh(&mut self, index: usize) -> Result<Mesh> {
        let doc = self.doc;
        let raw = doc.known(List::Meshes, index);
        let mut shapes = Vec::new();
        let primitives = self.primitives(raw)?;
        let count = primitives.len();
        for (shape, material) in primitives {
            // Take the emission and the holes from the material; a shape that emits has no holes.
            let material = material.map(|m| self.materials[m]);
            let material = material.unwrap_or_default();
            let emission = material.emission.map(|radiance| EmissionSpec {
                radiance,
                two_sided: material.two_sided,
                power: None,
                map: material.emission_map,
                profile: None,
            });
            let cutout = match (material.holes, emission) {
                (Holes::None, _) => None,
                (Holes::Some(alpha), None) => Some(Cutout {
                    seen: Some(alpha),
                    shadow: None,
                }),
                (Holes::All, None) => continue,
                (_, Some(_)) => {
                    let message = "what emits is opaque: its alpha is not supported";
                    let at = doc.at_start(raw);
                    self.base.unsupported(message, "ignored", at)?;
                    None
                }
            };
            // Each instance sets the transform of this placement.
            let placement = Placement {
                material: material.index,
                emission,
                cutout,
                ..Placement::default()
            };
            shapes.push((shape, placement));
        }
        Ok(Mesh { shapes, count })
    }

    /// Reads the primitives of a mesh, each with the index of its material, if it has one.
    fn primitives(&mut self, mesh: Raw<'a>) -> Result<Vec<(Shape, Option<usize>)>> {
        let doc = self.doc;
        let mut list = Vec::new();
        for raw in doc.read::<JsonMesh<'_>>(mesh)?.primitives {
            let node: Primitive = doc.read(raw)?;
            if node.targets.is_some() {
                let message = "morph targets are not supported";
                let at = doc.at_start(doc.find(raw, &["targets"]));
                self.base.unsupported(message, "left out", at)?;
            }
            let material = node.material.map(|m| m.value());
            if let Some(index) = material {
                doc.element(List::Materials, index, raw, "material")?;
            }
            let uv_set = material.map_or(0, |m| self.materials[m].uv_set);
            if let Some(shape) = self.primitive(&node, raw, uv_set)? {
                list.push((shape, material));
            }
        }
        Ok(list)
    }

    /// Reads a primitive with this set of texture coordinates; `None`, after a warning, if it is
    /// not supported.
    fn primitive(&mut self, node: &Primitive, raw: Raw<'a>, uv_set: u32) -> Result<Option<Shape>> {
        // Read the attributes of the vertices.
        let doc = self.doc;
        refuse_compression(doc, node, raw)?;
        let Some(positions) = self.attribute(node, raw, Semantic::Positions, 3, None)? else {
            let message = "a primitive without positions";
            let (kind, at) = (ErrorKind::BadMesh, doc.at_start(raw));
            self.base.warn(kind, message, "left out", at)?;
            return Ok(None);
        };
        let count = positions.values.len() / 3;
        let vertices = Vertices {
            positions,
            normals: self.attribute(node, raw, Semantic::Normals, 3, Some(count))?,
            uvs: self.attribute(node, raw, Semantic::TexCoords(uv_set), 2, Some(count))?,
        };
        let colours = Checked::Valid(Semantic::Colors(0));
        if node.attributes.contains_key(&colours) {
            let message = "vertex colours are not supported";
            let at = doc.at(doc.find(raw, &["attributes", "COLOR_0"]));
            self.base.unsupported(message, "left out", at)?;
        }
        // Make triangles or lines of the indices.
        let indices = self.indices(node, raw, count)?;
        let (shape, why_not) = match node.mode {
            Checked::Valid(mode) => (vertices.shape(mode, &indices), "points are not supported"),
            Checked::Invalid => (None, "a primitive of unknown `mode`"),
        };
        let Some(shape) = shape else {
            let at = doc.at_start(raw);
            self.base.unsupported(why_not, "left out", at)?;
            return Ok(None);
        };
        // Check the vertices that are used.
        let finite = match &shape {
            Shape::Triangles(mesh) => mesh.positions.iter().all(|p| p.is_finite()),
            Shape::Lines(lines) => lines.iter().flatten().all(|p| p.is_finite()),
        };
        if finite {
            return Ok(Some(shape));
        }
        let (kind, message) = (ErrorKind::BadMesh, "a vertex is not finite");
        Err(doc.at_start(raw).error(kind, message, "in this primitive"))
    }

    /// Returns the numbers of a vertex attribute, `width` for each vertex and for `count` vertices
    /// if that is known; `None` if the primitive does not have the attribute.
    fn attribute(
        &mut self,
        node: &Primitive,
        raw: Raw<'a>,
        semantic: Semantic,
        width: usize,
        count: Option<usize>,
    ) -> Result<Option<Rc<Numbers>>> {
        // Decode the numbers.
        let key = semantic.to_string();
        let Some(index) = node.attributes.get(&Checked::Valid(semantic)) else {
            return Ok(None);
        };
        let attributes = self.doc.find(raw, &["attributes"]);
        let numbers = self.numbers(index.value(), attributes, &key)?;
        // Check how many there are.
        let (got, length) = (numbers.width, numbers.values.len() / width);
        let (message, label) = match count {
            _ if got != width => {
                let message = format!("`{key}` has {got} numbers per vertex, expected {width}");
                (message, "in these attributes")
            }
            Some(count) if count != length => {
                let message = format!("`{key}` has {length} entries for {count} vertices");
                (message, "must be equal")
            }
            _ => return Ok(Some(numbers)),
        };
        let kind = ErrorKind::BadMesh;
        Err(self.doc.error(kind, message, attributes, label))
    }

    /// Returns the vertex indices of a primitive, which must be below `count`; if the primitive has
    /// no indices, the result is 0, 1, …, `count` − 1.
    fn indices(&mut self, node: &Primitive, raw: Raw<'a>, count: usize) -> Result<Vec<u32>> {
        let doc = self.doc;
        let numbers = match node.indices {
            Some(index) => Some(self.numbers(index.value(), raw, "indices")?),
            None => None,
        };
        // Limit the number of all indices: primitives may share them, so that a small file could
        // request very many triangles.
        self.indices += numbers.as_ref().map_or(count, |n| n.values.len());
        if self.indices > 3 * self.base.max_triangles {
            let message = format!("more than {} triangles", self.base.max_triangles);
            let at = doc.at_start(raw);
            return Err(at.error(ErrorKind::Limit, message, "this one is too many"));
        }
        let Some(numbers) = numbers else {
            return Ok((0..u32::try_from(count).unwrap_or(u32::MAX)).collect());
        };
        // Convert the numbers to indices.
        let convert = |v: &f64| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "compared with the number of vertices and with the number itself"
            )]
            let index = *v as u32;
            let exact = f64::from(index).to_bits() == v.abs().to_bits();
            let fits = *v >= 0.0 && (index as usize) < count && exact;
            fits.then_some(index).ok_or_else(|| {
                let place = doc.find(raw, &["indices"]);
                let message = format!("index {v} is out of range");
                let label = format!("there are {count} vertices");
                doc.error(ErrorKind::BadMesh, message, place, &label)
            })
        };
        numbers.values.iter().map(convert).collect()
    }
}

/// Refuses a primitive whose vertices exist only in compressed form.
fn refuse_compression<'a>(doc: &Document<'a>, node: &Primitive, raw: Raw<'a>) -> Result<()> {
    const DRACO: &str = "KHR_draco_mesh_compression";
    let Some(extension) = doc.extensions(raw).remove(DRACO) else {
        return Ok(());
    };
    // Accept it if it also has plain vertices, as it has where the extension is not required.
    let positions = node.attributes.get(&Checked::Valid(Semantic::Positions));
    if let Some(index) = positions {
        let attributes = doc.find(raw, &["attributes"]);
        let accessor = doc.element(List::Accessors, index.value(), attributes, "POSITION")?;
        if doc.get(accessor, "bufferView").is_some() {
            return Ok(());
        }
    }
    let message = format!("meshes compressed by `{DRACO}` are not supported");
    let error = doc.error(ErrorKind::Unsupported, message, extension, "cannot be read");
    Err(error.help(super::WITHOUT_COMPRESSION))
}

/// Returns the ends of the lines of a topology, as positions in a list of `n` indices; `None` for
/// other topologies.
fn line_pairs(mode: Mode, n: usize) -> Option<Vec<[usize; 2]>> {
    match mode {
        Mode::Lines => Some((0..n / 2).map(|k| [2 * k, 2 * k + 1]).collect()),
        Mode::LineLoop => Some((0..n).map(|k| [k, (k + 1) % n]).collect()),
        Mode::LineStrip => Some((1..n).map(|k| [k - 1, k]).collect()),
        _ => None,
    }
}

/// Returns the corners of the triangles of a topology, as positions in a list of `n` indices;
/// `None` for other topologies.
fn triangle_corners(mode: Mode, n: usize) -> Option<Vec<[usize; 3]>> {
    // Swap two corners of every other triangle of a strip, so that all face the same side.
    let in_strip = |k: usize| {
        if k.is_multiple_of(2) {
            [k - 2, k - 1, k]
        } else {
            [k - 1, k - 2, k]
        }
    };
    match mode {
        Mode::Triangles => Some((0..n / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()),
        Mode::TriangleStrip => Some((2..n).map(in_strip).collect()),
        Mode::TriangleFan => Some((2..n).map(|k| [0, k - 1, k]).collect()),
        _ => None,
    }
}

/// The attributes of a primitive, which may be shared with others.
struct Vertices {
    positions: Rc<Numbers>,
    normals: Option<Rc<Numbers>>,
    uvs: Option<Rc<Numbers>>,
}

impl Vertices {
    /// Returns the position of vertex `i`.
    fn position(&self, i: usize) -> DVec3 {
        let p = &self.positions.values[3 * i..3 * i + 3];
        DVec3::new(p[0], p[1], p[2])
    }

    /// Makes a shape of a list of indices with a topology; `None` for points.
    fn shape(&self, mode: Mode, indices: &[u32]) -> Option<Shape> {
        if let Some(pairs) = line_pairs(mode, indices.len()) {
            let ends = pairs.into_iter();
            let ends = ends.map(|pair| pair.map(|k| self.position(indices[k] as usize)));
            return Some(Shape::Lines(ends.collect()));
        }
        let corners = triangle_corners(mode, indices.len())?.into_iter();
        let triangles = corners.map(|t| t.map(|k| indices[k]));
        Some(Shape::Triangles(Rc::new(self.compact(triangles))))
    }

    /// Returns a mesh of these triangles with only the vertices that they use, numbered anew.
    fn compact(&self, triangles: impl Iterator<Item = [u32; 3]>) -> MeshData {
        let mut mesh = MeshData::default();
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let triangles: Vec<[u32; 3]> = triangles
            .map(|t| {
                t.map(|i| {
                    *numbers.entry(i).or_insert_with(|| {
                        self.copy(i as usize, &mut mesh);
                        u32::try_from(mesh.positions.len() - 1).unwrap_or(u32::MAX)
                    })
                })
            })
            .collect();
        mesh.triangles = triangles;
        mesh
    }

    /// Appends vertex `i` to a mesh.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "normals and texture coordinates are f32"
    )]
    fn copy(&self, i: usize, mesh: &mut MeshData) {
        stop::check();
        let finite = |c: f64| if c.is_finite() { c as f32 } else { 0.0 };
        mesh.positions.push(self.position(i));
        if let Some(normals) = &self.normals {
            let n = &normals.values[3 * i..3 * i + 3];
            mesh.normals
                .push([finite(n[0]), finite(n[1]), finite(n[2])]);
        }
        if let Some(uvs) = &self.uvs {
            // In scenes, v counts from the bottom.
            let uv = &uvs.values[2 * i..2 * i + 2];
            mesh.uvs.push([finite(uv[0]), finite(1.0 - uv[1])]);
        }
    }
}
