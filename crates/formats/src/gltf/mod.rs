//! The reader of glTF 2.0, as `.gltf` with its files or as `.glb`.
//!
//! It reads the nodes of the default scene with their transforms, triangles in all three
//! topologies, lines (which are linear lights if their material emits; the emission is then
//! radiance × radius), materials with the extensions listed in [`EXTENSIONS`], and the first
//! camera. Emission is one-sided unless the material is double-sided.
//!
//! Structures of the crate gltf are used where they lose nothing (its nodes and cameras are `f32`,
//! and it refuses scenes without nodes). Errors have their position in the JSON.

mod buffers;
mod document;
mod lights;
mod materials;
mod meshes;
mod textures;

use buffers::Numbers;
use document::{Document, List, Raw};
use linelit_assembly::{
    Assembly, ErrorKind, LoadOptions, Loaded, Result, Source, Span, about_its_middle, shorten,
};
use linelit_elementary::{atan, tan};
use linelit_geometry::glam::{DAffine3, DQuat};
use linelit_geometry::{DMat4, DVec3};
use linelit_scene::{Camera, FilmSettings, ImageData, Projection};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use textures::Channel;

/// The extensions of glTF that the reader supports.
const EXTENSIONS: &[&str] = &[
    INSTANCING,
    lights::LIGHTS,
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// The advice for files with compressed meshes.
const WITHOUT_COMPRESSION: &str = "export the scene without mesh compression";

/// The extension by which a node places many instances of a mesh.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The number of pixels along the shorter side of a picture, as glTF's cameras have no resolution.
const SHORTER_SIDE: f64 = 720.0;

/// Reads a scene from a file in memory.
pub(crate) fn load(
    source: &Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    about_its_middle(options, |options| scene(source, path, options))
}

/// Reads a scene, with vertices relative to the origin in the options, from JSON or a GLB file.
fn scene(source: &Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    let mut base = Assembly::new(path, source.bytes().len(), options);
    if source.bytes().starts_with(b"glTF") {
        let chunks = chunks(source)?;
        let behind = source.bytes().len() - chunks.end;
        if behind > 0 {
            let message = format!("{behind} bytes behind the end of the GLB file are left out");
            base.suspicious(message, "", source.at_byte(chunks.end))?;
        }
        let name = format!("{} (its JSON)", source.name());
        return read(&Source::new(name, chunks.json), chunks.binary, base);
    }
    read(source, None, base)
}

/// The contents of a GLB file.
struct Chunks {
    json: Vec<u8>,
    binary: Option<Arc<[u8]>>,
    /// The offset at which the last chunk ends.
    end: usize,
}

/// Splits a GLB file into its JSON and its binary chunk.
fn chunks(source: &Source) -> Result<Chunks> {
    let bytes = source.bytes();
    let cut = || {
        let at = source.at_byte(bytes.len());
        at.error(ErrorKind::Truncated, "the GLB file ends early", "")
    };
    let number = |at: usize| -> Result<usize> {
        let four = bytes.get(at..at + 4).and_then(|b| b.first_chunk::<4>());
        four.map(|b| u32::from_le_bytes(*b) as usize)
            .ok_or_else(cut)
    };
    if number(4)? != 2 {
        let message = format!("GLB version {} is not supported", number(4)?);
        let at = source.at_byte(4);
        return Err(at.error(ErrorKind::Unsupported, message, ""));
    }
    // Read the length of the file from the header, where some writers have zero.
    let end = match number(8)? {
        length if (12..bytes.len()).contains(&length) => length,
        _ => bytes.len(),
    };
    // Take the first chunk of each kind.
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < end {
        let length = number(at)?;
        let kind = number(at + 4)?;
        let chunk = bytes
            .get(at + 8..)
            .and_then(|b| b.get(..length))
            .ok_or_else(cut)?;
        match kind {
            0x4e4f_534a if json.is_none() => json = Some(chunk.to_vec()),
            0x004e_4942 if binary.is_none() => binary = Some(Arc::from(chunk)),
            _ => {}
        }
        at += 8 + length;
    }
    let none = || {
        let at = source.whole();
        at.error(ErrorKind::Syntax, "the GLB file has no JSON chunk", "")
    };
    let json = json.ok_or_else(none)?;
    Ok(Chunks {
        json,
        binary,
        end: end.max(at),
    })
}

/// Reads the scene of a JSON document, with the binary chunk of a GLB file if there is one.
fn read(source: &Arc<Source>, binary: Option<Arc<[u8]>>, base: Assembly) -> Result<Loaded> {
    // Parse the top level, and check the version.
    let doc = &Document::new(source)?;
    let asset = doc.lists.asset.ok_or_else(|| {
        let first = source.bytes().iter().position(|b| *b == b'{').unwrap_or(0);
        let at = source.at(Span::new(first, first + 1));
        at.error(
            ErrorKind::MissingParameter,
            "`asset` is missing",
            "in this object",
        )
    })?;
    if !doc.read::<Asset>(asset)?.version.starts_with("2.") {
        let message = "only glTF 2 is supported";
        return Err(doc.error(ErrorKind::Unsupported, message, asset, "another version"));
    }
    let mut reader = Reader {
        doc,
        base,
        buffers: vec![None; doc.lists.buffers.len()],
        binary,
        accessors: HashMap::new(),
        numbers_left: buffers::FREE_NUMBERS,
        camera: None,
        materials: Vec::new(),
        images: HashMap::new(),
        meshes: vec![None; doc.lists.meshes.len()],
        places: vec![0; doc.lists.meshes.len()],
        lights: Vec::new(),
        shapes: 0,
        indices: 0,
    };
    // Read all parts in order: nodes need the materials and the lights.
    reader.refuse_extensions()?;
    reader.warn_extensions()?;
    reader.read_materials()?;
    reader.read_lights()?;
    reader.read_nodes()?;
    let (camera, film) = reader.camera.unzip();
    let film = film.unwrap_or_default();
    reader
        .base
        .finish(source.name(), reader.shapes > 0, camera, film)
}

/// The version of glTF that the file is written in.
#[derive(Deserialize)]
struct Asset {
    version: String,
}

/// A scene of the file.
#[derive(Default, Deserialize)]
#[serde(default)]
struct SceneNodes<'a> {
    #[serde(borrow)]
    nodes: Vec<Raw<'a>>,
}

/// A node of the file.
#[derive(Default, Deserialize)]
#[serde(default)]
struct JsonNode<'a> {
    #[serde(borrow)]
    children: Vec<Raw<'a>>,
    mesh: Option<usize>,
    camera: Option<usize>,
    extensions: HashMap<String, Raw<'a>>,
    matrix: Option<[f64; 16]>,
    translation: [f64; 3],
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

/// The extension `EXT_mesh_gpu_instancing`: the accessors of the instances' transforms.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Instances {
    attributes: HashMap<String, usize>,
}

/// A camera of the file.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Lenses<'a> {
    r#type: String,
    #[serde(borrow)]
    perspective: Option<Raw<'a>>,
    orthographic: Option<Raw<'a>>,
}

/// The parameters of a perspective or an orthographic camera.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Lens {
    yfov: Option<f64>,
    aspect_ratio: Option<f64>,
    xmag: Option<f64>,
    ymag: Option<f64>,
}

/// The state of the reader.
struct Reader<'a> {
    doc: &'a Document<'a>,
    base: Assembly,
    /// For each buffer of the file, its bytes if they have been loaded.
    buffers: Vec<Option<Arc<[u8]>>>,
    /// The binary chunk of a GLB file.
    binary: Option<Arc<[u8]>>,
    /// The accessors that have been decoded, by index in the file: meshes often share them.
    accessors: HashMap<usize, Rc<Numbers>>,
    /// The number of numbers that may still be decoded. The limit is needed because accessors may
    /// overlap, so that a small file could request very many.
    numbers_left: usize,
    camera: Option<(Camera, FilmSettings)>,
    /// The materials, in the order of the file.
    materials: Vec<materials::Entry>,
    /// The images that have been decoded, by index in the file and channel.
    images: HashMap<(usize, Channel), Option<Arc<ImageData>>>,
    /// For each mesh of the file, the mesh if it has been read.
    meshes: Vec<Option<Rc<meshes::Mesh>>>,
    /// The number of instances of each mesh so far.
    places: Vec<usize>,
    /// The entries of `KHR_lights_punctual` with their positions in the file.
    lights: Vec<(Raw<'a>, Option<lights::Punctual>)>,
    /// The number of primitives of all instances so far.
    shapes: usize,
    /// The number of vertex indices that have been read.
    indices: usize,
}

impl<'a> Reader<'a> {
    /// Refuses a file that requires an extension that is not supported, as glTF 2.0 demands
    /// (section 3.12).
    fn refuse_extensions(&self) -> Result<()> {
        let doc = self.doc;
        for raw in &doc.lists.extensions_required {
            let name: String = doc.read(raw)?;
            if EXTENSIONS.contains(&name.as_str()) {
                continue;
            }
            let message = format!("the extension `{}` is not supported", shorten(&name));
            let error = doc.error(ErrorKind::Unsupported, message, raw, "the file requires it");
            return Err(if name.contains("compression") {
                error.help(WITHOUT_COMPRESSION)
            } else {
                error
            });
        }
        Ok(())
    }

    /// Warns about features of the file that are not supported. (About extensions of materials,
    /// there are warnings where they are used.)
    fn warn_extensions(&mut self) -> Result<()> {
        // Warn about extensions.
        let doc = self.doc;
        for raw in &doc.lists.extensions_used {
            let name: String = doc.read(raw)?;
            if EXTENSIONS.contains(&name.as_str()) || materials::names_extension(&name) {
                continue;
            }
            let name: String = name.chars().take(60).collect();
            let message = format!("extension `{name}` is not supported");
            self.base.unsupported(message, "left out", doc.at(raw))?;
        }
        // Warn about motion, and about more than one scene.
        let lists = [
            ("animations", &doc.lists.animations),
            ("skins", &doc.lists.skins),
        ];
        for (key, list) in lists {
            if let Some(first) = list.first() {
                let message = format!("`{key}` are not supported: nodes are drawn as they stand");
                let at = doc.at_start(first);
                self.base.unsupported(message, "left out", at)?;
            }
        }
        if let Some(second) = doc.lists.scenes.get(1) {
            let message = "a file with several scenes: one is drawn";
            let at = doc.at_start(second);
            self.base.suspicious(message, "not the only one", at)?;
        }
        Ok(())
    }

    /// Visits the nodes of the scene, which must form a tree, and adds their meshes, lights and
    /// cameras.
    fn read_nodes(&mut self) -> Result<()> {
        // Begin with the nodes of the default scene or of the first one, or else all roots.
        let doc = self.doc;
        let mut seen = vec![false; doc.lists.nodes.len()];
        let scene = match doc.lists.scene {
            Some(raw) => Some(doc.element(List::Scenes, doc.read(raw)?, raw, "scene")?),
            None => doc.lists.scenes.first().copied(),
        };
        let mut stack = match scene {
            Some(scene) => {
                let nodes = doc.read::<SceneNodes<'_>>(scene)?.nodes;
                visit(doc, &nodes, "nodes", DAffine3::IDENTITY, &mut seen)?
            }
            None => roots(doc, &mut seen)?,
        };
        while let Some((index, parent)) = stack.pop() {
            // Compute the node's transform, and visit its children next.
            let raw = doc.known(List::Nodes, index);
            let node: JsonNode<'_> = doc.read(raw)?;
            let to_world = parent * transform(&node);
            if !to_world.is_finite() {
                let message = "the transform is not finite";
                let at = doc.at_start(raw);
                return Err(at.error(ErrorKind::BadTransform, message, ""));
            }
            stack.extend(visit(doc, &node.children, "children", to_world, &mut seen)?);
            // Add what the node has.
            if let Some(mesh) = node.mesh {
                doc.element(List::Meshes, mesh, raw, "mesh")?;
                match node.extensions.get(INSTANCING) {
                    Some(instances) => self.place_many(mesh, to_world, instances)?,
                    None => self.place_mesh(mesh, to_world)?,
                }
            }
            if let Some(light) = node.extensions.get(lights::LIGHTS) {
                self.place_light(light, to_world)?;
            }
            if let Some(camera) = node.camera {
                let camera = doc.element(List::Cameras, camera, raw, "camera")?;
                self.read_camera(camera, to_world)?;
            }
        }
        Ok(())
    }

    /// Adds the instances of a mesh that `EXT_mesh_gpu_instancing` has.
    fn place_many(&mut self, mesh: usize, to_world: DAffine3, raw: &Raw<'a>) -> Result<()> {
        // Read the attributes, which must have the same number of entries.
        let doc = self.doc;
        let at = doc.find(raw, &["attributes"]);
        let attributes = doc.read::<Instances>(raw)?.attributes;
        let mut count = None;
        let mut list = |key: &str, width: usize| -> Result<Option<Rc<Numbers>>> {
            let Some(&index) = attributes.get(key) else {
                return Ok(None);
            };
            let numbers = self.numbers(index, at, key)?;
            let (got, length) = (numbers.width, numbers.values.len() / numbers.width.max(1));
            let error = |message: String, label: &str| {
                Err(doc.error(ErrorKind::BadMesh, message, at, label))
            };
            if got != width {
                let message = format!("`{key}` has {got} numbers per instance, expected {width}");
                return error(message, "in these attributes");
            }
            if *count.get_or_insert(length) != length {
                let message = format!("`{key}` has another number of entries than the others");
                return error(message, "must be equal");
            }
            Ok(Some(numbers))
        };
        let moves = list("TRANSLATION", 3)?;
        let turns = list("ROTATION", 4)?;
        let scales = list("SCALE", 3)?;
        let three = |list: &Option<Rc<Numbers>>, k: usize| {
            let list = list.as_ref()?;
            <[f64; 3]>::try_from(list.values.get(3 * k..3 * k + 3)?).ok()
        };
        // Add an instance for each entry.
        for k in 0..count.unwrap_or(0) {
            let turn = turns.as_ref().and_then(|t| t.values.get(4 * k..4 * k + 4));
            let here = JsonNode {
                translation: three(&moves, k).unwrap_or_default(),
                rotation: turn.and_then(|t| <[f64; 4]>::try_from(t).ok()),
                scale: three(&scales, k),
                ..JsonNode::default()
            };
            let to_world = to_world * transform(&here);
            if !to_world.is_finite() {
                let message = "the transform is not finite";
                return Err(doc.error(ErrorKind::BadTransform, message, at, "of an instance"));
            }
            self.place_mesh(mesh, to_world)?;
        }
        Ok(())
    }

    /// Reads a camera with its film; only the first one is used.
    fn read_camera(&mut self, raw: Raw<'a>, to_world: DAffine3) -> Result<()> {
        let doc = self.doc;
        if self.camera.is_some() {
            let message = "further cameras are left out";
            let at = doc.at_start(raw);
            return self.base.suspicious(message, "the first one is used", at);
        }
        let lenses: Lenses<'_> = doc.read(raw)?;
        let (key, lens) = if lenses.r#type == "orthographic" {
            ("orthographic", lenses.orthographic)
        } else {
            ("perspective", lenses.perspective)
        };
        let place = doc.require(lens, raw, key)?;
        let lens: Lens = doc.read(place)?;
        let positive = |value: Option<f64>, key: &str| match value {
            Some(v) if !(v > 0.0 && v <= f64::from(f32::MAX)) => {
                let message = format!("`{key}` of a camera is {v}");
                Err(doc.error(ErrorKind::OutOfRange, message, place, "must be positive"))
            }
            value => Ok(value),
        };
        // Read the projection and the aspect ratio.
        let (projection, window, aspect) = if key == "orthographic" {
            let x = doc.require(positive(lens.xmag, "xmag")?, place, "xmag")?;
            let y = doc.require(positive(lens.ymag, "ymag")?, place, "ymag")?;
            (Projection::Orthographic, Some([-x, x, -y, y]), x / y)
        } else {
            let y_fov = doc.require(positive(lens.yfov, "yfov")?, place, "yfov")?;
            let aspect = positive(lens.aspect_ratio, "aspectRatio")?.unwrap_or(16.0 / 9.0);
            // Convert the angle over the height to the angle over the shorter side.
            let half = tan(0.5 * y_fov) * aspect.min(1.0);
            let fov_degrees = 2.0 * atan(half).to_degrees();
            if y_fov >= std::f64::consts::PI || fov_degrees <= 0.0 {
                let message = format!("`yfov` of a camera is {y_fov}");
                let label = "expected an angle below π";
                return Err(doc.error(ErrorKind::OutOfRange, message, place, label));
            }
            (Projection::Perspective { fov_degrees }, None, aspect)
        };
        // Choose the number of pixels by the aspect ratio.
        let aspect = aspect.clamp(1.0 / 16.0, 16.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 720 and 11520"
        )]
        let side = |factor: f64| (SHORTER_SIDE * factor.max(1.0)).round() as u32;
        let film = FilmSettings::new(side(aspect), side(1.0 / aspect));
        // Place the camera, which in glTF looks along −z.
        let camera_to_world = to_world * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let size = [film.width, film.height];
        self.camera = Some((
            Camera::new(camera_to_world, projection, window, None, size),
            film,
        ));
        Ok(())
    }
}

/// A stack of nodes to visit, with the transforms of their parents. The node to visit first is at
/// the end.
type Nodes = Vec<(usize, DAffine3)>;

/// Returns the children of a node or a scene, in the order of a stack. It is an error if one of
/// them has been seen before.
fn visit<'a>(
    doc: &Document<'a>,
    children: &[Raw<'a>],
    key: &str,
    to_world: DAffine3,
    seen: &mut [bool],
) -> Result<Nodes> {
    let visit = |&child: &Raw<'a>| {
        let index = doc.read(child)?;
        doc.element(List::Nodes, index, child, key)?;
        if std::mem::replace(&mut seen[index], true) {
            let message = format!("node {index} is reached twice");
            return Err(doc.error(ErrorKind::Recursion, message, child, "nodes form a tree"));
        }
        Ok((index, to_world))
    };
    children.iter().rev().map(visit).collect()
}

/// Returns the nodes that are not the child of a node, for files without a scene.
fn roots(doc: &Document<'_>, seen: &mut [bool]) -> Result<Nodes> {
    let mut is_child = vec![false; seen.len()];
    for raw in &doc.lists.nodes {
        for child in doc.read::<JsonNode<'_>>(raw)?.children {
            let index = doc.read(child)?;
            doc.element(List::Nodes, index, child, "children")?;
            is_child[index] = true;
        }
    }
    let roots = (0..seen.len()).rev().filter(|i| !is_child[*i]);
    let roots: Nodes = roots.map(|index| (index, DAffine3::IDENTITY)).collect();
    roots.iter().for_each(|(index, _)| seen[*index] = true);
    Ok(roots)
}

/// Returns a node's transform relative to its parent.
fn transform(node: &JsonNode<'_>) -> DAffine3 {
    if let Some(m) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(m));
    }
    let r = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let s = node.scale.unwrap_or([1.0; 3]);
    let rotation = DQuat::from_array(r);
    let length = rotation.length();
    // Normalise the quaternion, which files may have with three digits; zero means no rotation.
    let rotation = if length > 0.0 {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    DAffine3::from_scale_rotation_translation(s.into(), rotation, node.translation.into())
}
