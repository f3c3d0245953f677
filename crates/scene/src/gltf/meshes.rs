//! glTF meshes.

use super::buffers::Numbers;
use super::document::Document;
use super::json::Node;
use super::{Reader, short};
use crate::error::{ErrorKind, Result, SceneError};
use crate::mesh::{EmissionSpec, MeshData, Placement};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use std::rc::Rc;

/// What a primitive is made of.
#[derive(Debug)]
pub(super) enum Shape {
    Triangles(MeshData),
    Lines(Vec<[DVec3; 2]>),
}

/// The primitives of a mesh, each with the number of its material.
pub(super) type Primitives = Rc<Vec<(Shape, Option<usize>)>>;

impl Reader {
    /// Puts a mesh into the scene.
    pub(super) fn place_mesh(
        &mut self,
        doc: &Document<'_>,
        index: usize,
        to_world: DAffine3,
    ) -> Result<()> {
        let node = &doc.list("meshes")?[index];
        let primitives = match &self.meshes[index] {
            Some(primitives) => Rc::clone(primitives),
            None => {
                let primitives = Rc::new(self.primitives(doc, node)?);
                self.meshes[index] = Some(Rc::clone(&primitives));
                primitives
            }
        };
        let place = short(node);
        let at = |e: SceneError, label: &str| e.at(doc.source, place.span, label);
        for (shape, material) in primitives.iter() {
            self.shapes += 1;
            let material = material.map(|m| self.materials[m]).unwrap_or_default();
            let emission = material.emission.map(|radiance| EmissionSpec {
                radiance,
                two_sided: material.two_sided,
                power: None,
            });
            match shape {
                Shape::Triangles(mesh) => {
                    let placement = Placement {
                        to_world,
                        reverse: false,
                        material: material.index,
                        emission,
                    };
                    self.base.place(mesh, &placement, "the mesh", &at)?;
                }
                Shape::Lines(lines) => match emission {
                    Some(spec) => {
                        for line in lines {
                            let [p0, p1] = line.map(|p| to_world.transform_point3(p));
                            if p0 != p1 && p0.is_finite() && p1.is_finite() {
                                self.base.builder.add_line(p0, p1, &spec);
                            }
                        }
                    }
                    None => {
                        let message = "lines without an emissive material are nothing";
                        self.warn(doc, ErrorKind::Suspicious, message, &place, "left out")?;
                    }
                },
            }
        }
        Ok(())
    }

    fn primitives(
        &mut self,
        doc: &Document<'_>,
        mesh: &Node,
    ) -> Result<Vec<(Shape, Option<usize>)>> {
        let mut list = Vec::new();
        for node in doc.array(mesh, "primitives")? {
            if let Some(targets) = doc.get(node, "targets") {
                let message = "morph targets are not supported";
                self.warn(
                    doc,
                    ErrorKind::Unsupported,
                    message,
                    &short(targets),
                    "left out",
                )?;
            }
            let material = doc.index(node, "material", "materials")?;
            if let Some(shape) = self.primitive(doc, node)? {
                list.push((shape, material));
            }
        }
        Ok(list)
    }

    fn primitive(&mut self, doc: &Document<'_>, node: &Node) -> Result<Option<Shape>> {
        let attributes = doc.require(doc.object(node, "attributes")?, node, "attributes")?;
        if doc.get(attributes, "POSITION").is_none() {
            let message = "a primitive without positions";
            self.warn(doc, ErrorKind::BadMesh, message, &short(node), "left out")?;
            return Ok(None);
        }
        let mut attribute = |key: &str, width: usize| self.attribute(doc, attributes, key, width);
        let positions = attribute("POSITION", 3)?.unwrap_or_default();
        let normals = attribute("NORMAL", 3)?;
        let uvs = attribute("TEXCOORD_0", 2)?;
        let positions: Vec<DVec3> = positions
            .as_chunks::<3>()
            .0
            .iter()
            .map(|c| DVec3::from_array(*c))
            .collect();
        if let Some(k) = positions.iter().position(|p| !p.is_finite()) {
            let message = format!("vertex {k} is not finite");
            return Err(doc.error(
                ErrorKind::BadMesh,
                message,
                &short(node),
                "in this primitive",
            ));
        }
        let indices = self.indices(doc, node, positions.len())?;
        let triple = |[a, b, c]: [usize; 3]| [indices[a], indices[b], indices[c]];
        let n = indices.len();
        let pair = |a: usize, b: usize| [indices[a], indices[b]].map(|i| positions[i as usize]);
        let triangles = match doc.size(node, "mode")?.unwrap_or(4) {
            4 => (0..n / 3)
                .map(|k| triple([3 * k, 3 * k + 1, 3 * k + 2]))
                .collect(),
            5 => (2..n)
                .map(|k| {
                    triple(if k % 2 == 0 {
                        [k - 2, k - 1, k]
                    } else {
                        [k - 1, k - 2, k]
                    })
                })
                .collect(),
            6 => (2..n).map(|k| triple([0, k - 1, k])).collect(),
            1 => {
                return Ok(Some(Shape::Lines(
                    (0..n / 2).map(|k| pair(2 * k, 2 * k + 1)).collect(),
                )));
            }
            3 => return Ok(Some(Shape::Lines((1..n).map(|k| pair(k - 1, k)).collect()))),
            2 => {
                return Ok(Some(Shape::Lines(
                    (0..n).map(|k| pair(k, (k + 1) % n)).collect(),
                )));
            }
            _ => {
                let message = "points are not supported";
                self.warn(
                    doc,
                    ErrorKind::Unsupported,
                    message,
                    &short(node),
                    "left out",
                )?;
                return Ok(None);
            }
        };
        let count = positions.len();
        let mut mesh = MeshData {
            positions,
            triangles,
            ..MeshData::default()
        };
        #[allow(
            clippy::cast_possible_truncation,
            reason = "normals and texture coordinates are f32"
        )]
        if let Some(normals) = normals {
            let finite = |c: f64| if c.is_finite() { c as f32 } else { 0.0 };
            mesh.normals = normals
                .as_chunks::<3>()
                .0
                .iter()
                .map(|c| c.map(finite))
                .collect();
        }
        #[allow(
            clippy::cast_possible_truncation,
            reason = "normals and texture coordinates are f32"
        )]
        if let Some(uvs) = uvs {
            let finite = |c: f64| if c.is_finite() { c as f32 } else { 0.0 };
            mesh.uvs = uvs
                .as_chunks::<2>()
                .0
                .iter()
                .map(|[u, v]| [finite(*u), finite(1.0 - v)])
                .collect();
        }
        for (name, length) in [
            ("NORMAL", mesh.normals.len()),
            ("TEXCOORD_0", mesh.uvs.len()),
        ] {
            if length != 0 && length != count {
                let message = format!("`{name}` has {length} entries for {count} vertices");
                return Err(doc.error(ErrorKind::BadMesh, message, attributes, "must be equal"));
            }
        }
        Ok(Some(Shape::Triangles(mesh)))
    }

    /// The numbers of a vertex attribute.
    fn attribute(
        &mut self,
        doc: &Document<'_>,
        attributes: &Node,
        key: &str,
        width: usize,
    ) -> Result<Option<Vec<f64>>> {
        let Some(index) = doc.index(attributes, key, "accessors")? else {
            return Ok(None);
        };
        let Numbers { width: got, values } = self.buffers.numbers(doc, &self.base, index)?;
        if got == width {
            return Ok(Some(values));
        }
        let message = format!("`{key}` has {got} numbers per vertex, expected {width}");
        Err(doc.error(
            ErrorKind::BadMesh,
            message,
            attributes,
            "in these attributes",
        ))
    }

    /// The indices of a primitive, all in range; without them all vertices in order.
    fn indices(&mut self, doc: &Document<'_>, node: &Node, count: usize) -> Result<Vec<u32>> {
        let Some(accessor) = doc.index(node, "indices", "accessors")? else {
            return Ok((0..u32::try_from(count).unwrap_or(u32::MAX)).collect());
        };
        let numbers = self.buffers.numbers(doc, &self.base, accessor)?;
        let convert = |v: &f64| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "compared with the number of vertices before the cast"
            )]
            let index = *v as u32;
            let fits = *v >= 0.0
                && (index as usize) < count
                && f64::from(index).to_bits() == v.abs().to_bits();
            fits.then_some(index).ok_or_else(|| {
                let place = doc.get(node, "indices").unwrap_or(node);
                let message = format!("index {v} is out of range");
                doc.error(
                    ErrorKind::BadMesh,
                    message,
                    place,
                    &format!("there are {count} vertices"),
                )
            })
        };
        numbers.values.iter().map(convert).collect()
    }
}
