//! glTF 2.0, as `.gltf` with its files or as `.glb`.
//!
//! A reader of our own: all errors name the place in the JSON, and nothing is trusted. Read are
//! the nodes of the default scene with their transforms, triangles in all three topologies, lines
//! (linear lights, if their material emits: radiance × radius is then the emission), materials
//! with the extensions listed in [`EXTENSIONS`], and the first camera.
//! Emission is one-sided unless the material is double-sided.

mod buffers;
mod document;
mod json;
mod materials;
mod meshes;
mod textures;

use crate::assembly::Assembly;
use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span};
use crate::load::{LoadOptions, Loaded};
use buffers::Buffers;
use document::Document;
use json::Node;
use linelit_geometry::glam::{DAffine3, DQuat};
use linelit_geometry::{DMat4, DVec3};
use linelit_scene::{Camera, FilmSettings, Projection};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use textures::{Channel, NamedImage};

/// Extensions that we read.
const EXTENSIONS: &[&str] = &[
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Pixels along the shorter side of a camera's picture; glTF has none.
const SHORTER_SIDE: f64 = 720.0;

/// Reads a scene from a file in memory.
pub(crate) fn load(
    source: &Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    let mut base = Assembly::new(path, source.bytes().len(), options);
    if source.bytes().starts_with(b"glTF") {
        let chunks = chunks(source)?;
        let behind = source.bytes().len() - chunks.end;
        if behind > 0 {
            let message = format!("{behind} bytes behind the end of the GLB file are left out");
            let at = |e: SceneError, _: &str| e.at_byte(source, chunks.end);
            base.warn(ErrorKind::Suspicious, message, "", &at)?;
        }
        let name = format!("{} (its JSON)", source.name());
        return read(&Source::new(name, chunks.json), chunks.binary, base);
    }
    read(source, None, base)
}

/// What a GLB file holds.
struct Chunks {
    json: Vec<u8>,
    binary: Option<Arc<[u8]>>,
    /// Where the last chunk ends.
    end: usize,
}

/// The JSON and the binary chunk of a GLB file.
fn chunks(source: &Source) -> Result<Chunks> {
    let bytes = source.bytes();
    let cut = |at: usize| {
        SceneError::new(ErrorKind::Truncated, "the GLB file ends early").at_byte(source, at)
    };
    let number = |at: usize| -> Result<usize> {
        let four = bytes.get(at..at + 4).and_then(|b| b.first_chunk::<4>());
        four.map(|b| u32::from_le_bytes(*b) as usize)
            .ok_or_else(|| cut(bytes.len()))
    };
    if number(4)? != 2 {
        let message = format!("GLB version {} is not supported", number(4)?);
        return Err(SceneError::new(ErrorKind::Unsupported, message).at_byte(source, 4));
    }
    // The header says where the file ends. Some writers leave that zero.
    let end = match number(8)? {
        length if (12..bytes.len()).contains(&length) => length,
        _ => bytes.len(),
    };
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < end {
        let length = number(at)?;
        let kind = number(at + 4)?;
        let chunk = bytes
            .get(at + 8..)
            .and_then(|b| b.get(..length))
            .ok_or_else(|| cut(bytes.len()))?;
        match kind {
            0x4e4f_534a if json.is_none() => json = Some(chunk.to_vec()),
            0x004e_4942 if binary.is_none() => binary = Some(Arc::from(chunk)),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| {
        SceneError::new(ErrorKind::Syntax, "the GLB file has no JSON chunk").in_file(source.name())
    })?;
    Ok(Chunks {
        json,
        binary,
        end: end.max(at),
    })
}

fn read(source: &Arc<Source>, binary: Option<Arc<[u8]>>, base: Assembly) -> Result<Loaded> {
    let root = json::parse(source)?;
    let doc = Document::new(source, root);
    let version = doc.require(doc.object(&doc.root, "asset")?, &short(&doc.root), "asset")?;
    if let Some(text) = doc.string(version, "version")?
        && !text.starts_with("2.")
    {
        let message = "only glTF 2 is supported";
        return Err(doc.error(ErrorKind::Unsupported, message, version, "another version"));
    }
    let mut reader = Reader {
        buffers: Buffers::new(&doc, binary)?,
        base,
        camera: None,
        materials: Vec::new(),
        images: HashMap::new(),
        meshes: Vec::new(),
        shapes: 0,
        indices: 0,
    };
    reader.warn_extensions(&doc)?;
    reader.read_materials(&doc)?;
    reader
        .meshes
        .resize_with(doc.list("meshes")?.len(), || None);
    reader.read_nodes(&doc)?;
    let (camera, film) = reader.camera.unzip();
    let film = film.unwrap_or_default();
    reader
        .base
        .finish(source.name(), reader.shapes > 0, camera, film)
}

/// The start of a long value, to point at.
fn short(node: &Node) -> Node {
    Node {
        value: json::Value::Null,
        span: Span::new(node.span.start, node.span.start + 1),
    }
}

struct Reader {
    base: Assembly,
    buffers: Buffers,
    camera: Option<(Camera, FilmSettings)>,
    /// Index and emission of each material.
    materials: Vec<materials::Entry>,
    /// Images and the names of their files, by index and use.
    images: HashMap<(usize, Channel), Option<NamedImage>>,
    meshes: Vec<Option<meshes::Primitives>>,
    shapes: usize,
    /// Indices read so far.
    indices: usize,
}

impl Reader {
    fn warn(
        &mut self,
        doc: &Document<'_>,
        kind: ErrorKind,
        message: &str,
        node: &Node,
        label: &str,
    ) -> Result<()> {
        let at = |e: SceneError, label: &str| e.at(doc.source, node.span, label);
        self.base.warn(kind, message, label, &at)
    }

    /// Names what the file uses and we do not read. Extensions of materials are named where they
    /// are used.
    fn warn_extensions(&mut self, doc: &Document<'_>) -> Result<()> {
        for node in doc.list("extensionsUsed")? {
            let json::Value::String(name) = &node.value else {
                continue;
            };
            if EXTENSIONS.contains(&name.as_str()) || materials::names_extension(name) {
                continue;
            }
            if name == "KHR_lights_punctual" {
                let message = "`KHR_lights_punctual`: lights without size are not supported";
                self.warn(doc, ErrorKind::Unsupported, message, node, "left out")?;
                continue;
            }
            let name: String = name.chars().take(60).collect();
            let message = format!("extension `{name}` is not supported");
            self.warn(doc, ErrorKind::Unsupported, &message, node, "left out")?;
        }
        for key in ["animations", "skins"] {
            if let Some(first) = doc.list(key)?.first() {
                let message = format!("`{key}` are not supported: nodes are drawn as they stand");
                let place = short(first);
                self.warn(doc, ErrorKind::Unsupported, &message, &place, "left out")?;
            }
        }
        if let Some(second) = doc.list("scenes")?.get(1) {
            let message = "a file with several scenes: one is drawn";
            let label = "not the only one";
            self.warn(doc, ErrorKind::Suspicious, message, &short(second), label)?;
        }
        Ok(())
    }

    /// Walks the nodes of the scene; a node may appear only once.
    fn read_nodes(&mut self, doc: &Document<'_>) -> Result<()> {
        let nodes = doc.list("nodes")?;
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, DAffine3)> = Vec::new();
        let scene = doc.index(&doc.root, "scene", "scenes")?.unwrap_or(0);
        match doc.list("scenes")?.get(scene) {
            Some(scene) => {
                for node in doc.array(scene, "nodes")?.iter().rev() {
                    let index = doc.as_index("nodes", node, "nodes")?;
                    self.visit(doc, node, index, &mut seen)?;
                    stack.push((index, DAffine3::IDENTITY));
                }
            }
            None => {
                for index in roots(doc, nodes)? {
                    seen[index] = true;
                    stack.push((index, DAffine3::IDENTITY));
                }
            }
        }
        while let Some((index, parent)) = stack.pop() {
            let node = &nodes[index];
            let to_world = parent * transform(doc, node)?;
            if !to_world.is_finite() {
                let message = "the transform is not finite";
                return Err(doc.error(ErrorKind::BadTransform, message, &short(node), ""));
            }
            for child in doc.array(node, "children")?.iter().rev() {
                let index = doc.as_index("children", child, "nodes")?;
                self.visit(doc, child, index, &mut seen)?;
                stack.push((index, to_world));
            }
            if let Some(mesh) = doc.index(node, "mesh", "meshes")? {
                self.place_mesh(doc, mesh, to_world)?;
            }
            if let Some(camera) = doc.index(node, "camera", "cameras")? {
                self.read_camera(doc, camera, to_world)?;
            }
        }
        Ok(())
    }

    fn visit(
        &self,
        doc: &Document<'_>,
        place: &Node,
        index: usize,
        seen: &mut [bool],
    ) -> Result<()> {
        if std::mem::replace(&mut seen[index], true) {
            let message = format!("node {index} is reached twice");
            return Err(doc.error(ErrorKind::Recursion, message, place, "nodes form a tree"));
        }
        Ok(())
    }

    fn read_camera(&mut self, doc: &Document<'_>, index: usize, to_world: DAffine3) -> Result<()> {
        let node = &doc.list("cameras")?[index];
        if self.camera.is_some() {
            let message = "further cameras are left out";
            return self.warn(
                doc,
                ErrorKind::Suspicious,
                message,
                &short(node),
                "the first one is used",
            );
        }
        let positive = |object: &Node, key: &str| match doc.number(object, key)? {
            Some(v) if v > 0.0 => Ok(Some(v)),
            Some(v) => {
                let message = format!("`{key}` of a camera is {v}");
                Err(doc.error(ErrorKind::OutOfRange, message, object, "must be positive"))
            }
            None => Ok(None),
        };
        let (projection, window, aspect) = match doc.string(node, "type")? {
            Some("orthographic") => {
                let object =
                    doc.require(doc.object(node, "orthographic")?, node, "orthographic")?;
                let x = doc.require(positive(object, "xmag")?, object, "xmag")?;
                let y = doc.require(positive(object, "ymag")?, object, "ymag")?;
                (Projection::Orthographic, Some([-x, x, -y, y]), x / y)
            }
            _ => {
                let object = doc.require(doc.object(node, "perspective")?, node, "perspective")?;
                let y_fov = doc.require(positive(object, "yfov")?, object, "yfov")?;
                let aspect = positive(object, "aspectRatio")?.unwrap_or(16.0 / 9.0);
                // Ours is the angle over the shorter side.
                let half = (0.5 * y_fov).tan() * aspect.min(1.0);
                let fov_degrees = 2.0 * half.atan().to_degrees();
                if y_fov >= std::f64::consts::PI || fov_degrees <= 0.0 {
                    let message = format!("`yfov` of a camera is {y_fov}");
                    return Err(doc.error(
                        ErrorKind::OutOfRange,
                        message,
                        object,
                        "expected an angle below π",
                    ));
                }
                (Projection::Perspective { fov_degrees }, None, aspect)
            }
        };
        let aspect = aspect.clamp(1.0 / 16.0, 16.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 720 and 11520"
        )]
        let side = |factor: f64| (SHORTER_SIDE * factor.max(1.0)).round() as u32;
        let film = FilmSettings::new(side(aspect), side(1.0 / aspect));
        // glTF's cameras look along −z.
        let camera_to_world = to_world * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let size = [film.width, film.height];
        self.camera = Some((
            Camera::new(camera_to_world, projection, window, None, size),
            film,
        ));
        Ok(())
    }
}

/// Nodes that are nobody's child.
fn roots(doc: &Document<'_>, nodes: &[Node]) -> Result<Vec<usize>> {
    let mut is_child = vec![false; nodes.len()];
    for node in nodes {
        for child in doc.array(node, "children")? {
            is_child[doc.as_index("children", child, "nodes")?] = true;
        }
    }
    Ok((0..nodes.len()).rev().filter(|i| !is_child[*i]).collect())
}

/// A node's own transform.
fn transform(doc: &Document<'_>, node: &Node) -> Result<DAffine3> {
    if let Some(m) = doc.vector::<16>(node, "matrix")? {
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(&m)));
    }
    let t = doc.vector::<3>(node, "translation")?.unwrap_or_default();
    let r = doc
        .vector::<4>(node, "rotation")?
        .unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let s = doc.vector::<3>(node, "scale")?.unwrap_or([1.0; 3]);
    let rotation = DQuat::from_array(r);
    let length = rotation.length();
    // Files hold unit quaternions to three digits; zero is none.
    let rotation = if length > 0.0 {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    Ok(DAffine3::from_scale_rotation_translation(
        s.into(),
        rotation,
        t.into(),
    ))
}
