//! What all readers share: putting meshes into the scene, reading images, finishing.

use crate::camera::{Camera, Projection};
use crate::emission::EmissionSpec;
use crate::error::{ErrorKind, Result, SceneError, Warnings};
use crate::film::FilmSettings;
use crate::framing;
use crate::image::{self, ImageData};
use crate::inflate;
use crate::load::{LoadOptions, Loaded};
use crate::mesh::{Builder, MeshData, Placement, Refusal};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Gives an error its place; the text is the label beside the caret.
pub(crate) type At<'a> = &'a dyn Fn(SceneError, &str) -> SceneError;

/// A scene in the making.
pub(crate) struct Assembly {
    pub(crate) builder: Builder,
    pub(crate) warnings: Warnings,
    pub(crate) max_triangles: usize,
    /// Where the file names in the scene start.
    pub(crate) folder: PathBuf,
    images: HashMap<(PathBuf, bool), Arc<ImageData>>,
    /// Files that were opened, and bytes read: of each once, and in all.
    opened: HashSet<PathBuf>,
    distinct_bytes: u64,
    read_bytes: u64,
    pixels: u64,
}

/// Bytes that a scene may read again and again: files that name each other many times would
/// otherwise take any time.
const FREE_REREADS: u64 = 1 << 26;
/// How often, on the average, files may be read beyond that.
const REREADS: u64 = 16;

/// Pixels that all images together may have, whatever their size in files.
const FREE_PIXELS: u64 = 1 << 27;
/// Pixels that all images together may have for each byte of their files.
const PIXELS_PER_BYTE: u64 = 16;

impl Assembly {
    /// An empty scene; `path` is that of the scene file, which is `bytes` long.
    pub(crate) fn new(path: Option<&Path>, bytes: usize, options: &LoadOptions) -> Self {
        Self {
            builder: Builder::new(options.max_triangles),
            warnings: Warnings::new(options.strict),
            max_triangles: options.max_triangles,
            folder: path
                .and_then(Path::parent)
                .unwrap_or(Path::new(""))
                .to_owned(),
            images: HashMap::new(),
            opened: HashSet::new(),
            distinct_bytes: bytes as u64,
            read_bytes: bytes as u64,
            pixels: 0,
        }
    }

    /// Warns about something at a place.
    pub(crate) fn warn(
        &mut self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: &str,
        at: At<'_>,
    ) -> Result<()> {
        self.warnings.warn(kind, message, |e| at(e, label))
    }

    /// Adds a mesh to the scene; `what` it is, for messages.
    pub(crate) fn place(
        &mut self,
        mesh: &MeshData,
        place: &Placement,
        what: &str,
        at: At<'_>,
    ) -> Result<()> {
        let total = mesh.triangles.len();
        match self.builder.add_mesh(mesh, place) {
            Ok(added) if added.degenerate > 0 => {
                let label = format!("{} of {total}", added.degenerate);
                let message = "triangles without area are left out";
                self.warn(ErrorKind::Suspicious, message, &label, at)
            }
            Ok(_) => Ok(()),
            Err(Refusal::Singular) => {
                let message = format!("{what} is flattened by its transform");
                self.warn(ErrorKind::BadTransform, message, "left out", at)
            }
            Err(Refusal::Vertex(k)) => {
                let message = format!("vertex {k} of {what} is beyond the range of f32");
                Err(at(
                    SceneError::new(ErrorKind::OutOfRange, message),
                    "after its transform",
                ))
            }
            Err(Refusal::TooManyLights) => Err(self.too_many_lights(at)),
            Err(Refusal::TooMany) => {
                let message = format!("more than {} triangles", self.max_triangles);
                let error = at(
                    SceneError::new(ErrorKind::Limit, message),
                    "this one is too many",
                );
                let so_far = self.builder.triangle_count();
                Err(error.note(format!(
                    "the scene has {so_far} triangles so far, this shape has {total}"
                )))
            }
        }
    }

    /// Adds a linear light between two points of the world.
    pub(crate) fn place_line(
        &mut self,
        [p0, p1]: [DVec3; 2],
        spec: &EmissionSpec,
        at: At<'_>,
    ) -> Result<()> {
        if !p0.is_finite() || !p1.is_finite() {
            let message = "the end of a line is not finite";
            let error = SceneError::new(ErrorKind::OutOfRange, message);
            return Err(at(error, "after its transform"));
        }
        if p0 == p1 {
            let message = "a line without length emits nothing";
            return self.warn(ErrorKind::Suspicious, message, "left out", at);
        }
        let added = self.builder.add_line(p0, p1, spec);
        added.map_err(|_| self.too_many_lights(at))
    }

    fn too_many_lights(&self, at: At<'_>) -> SceneError {
        let message = format!("more than {} lights", self.builder.max_lights);
        let error = SceneError::new(ErrorKind::Limit, message);
        at(error, "this shape has too many")
            .note("each emissive triangle or line is a light, unless neighbours in one plane merge")
    }

    /// A file that the scene names, read into memory.
    pub(crate) fn open(&mut self, name: &str, at: At<'_>) -> Result<(PathBuf, Vec<u8>)> {
        let path = self.folder.join(name);
        match std::fs::read(&path) {
            Ok(bytes) => {
                let count = bytes.len() as u64;
                if self.opened.insert(path.clone()) {
                    self.distinct_bytes += count;
                }
                self.read_bytes += count;
                if self.read_bytes > FREE_REREADS.saturating_add(REREADS * self.distinct_bytes) {
                    let message = format!("`{name}` and others are read too often");
                    let error = at(SceneError::new(ErrorKind::Limit, message), "read again");
                    return Err(error.note(format!(
                        "{} bytes of files have been read as {} bytes",
                        self.distinct_bytes, self.read_bytes
                    )));
                }
                Ok((path, bytes))
            }
            Err(error) => {
                let message = format!("cannot read `{name}`: {}", describe(&error));
                Err(at(SceneError::new(ErrorKind::Io, message), "named here"))
            }
        }
    }

    /// As [`Assembly::open`], and decompressed if its name ends in `.gz`.
    pub(crate) fn open_unpacked(&mut self, name: &str, at: At<'_>) -> Result<(PathBuf, Vec<u8>)> {
        let (path, bytes) = self.open(name, at)?;
        if !name.ends_with(".gz") {
            return Ok((path, bytes));
        }
        let unpacked = inflate::gunzip(&bytes).map_err(|message| {
            let message = format!("cannot unpack `{name}`: {message}");
            at(SceneError::new(ErrorKind::Syntax, message), "named here")
        })?;
        Ok((path, unpacked))
    }

    /// An image file, read once; `None` after a warning if its format is not supported.
    pub(crate) fn image(
        &mut self,
        name: &str,
        srgb: bool,
        at: At<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        let key = (self.folder.join(name), srgb);
        if let Some(image) = self.images.get(&key) {
            return Ok(Some(Arc::clone(image)));
        }
        let (_, bytes) = self.open(name, at)?;
        let image = self.decode(name, &bytes, srgb, at)?;
        if let Some(image) = &image {
            self.images.insert(key, Arc::clone(image));
        }
        Ok(image)
    }

    /// An image from memory; `None` after a warning if its format is not supported.
    pub(crate) fn decode(
        &mut self,
        name: &str,
        bytes: &[u8],
        srgb: bool,
        at: At<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        match image::read(name, bytes, srgb) {
            Some(Ok(image)) => {
                self.pixels += u64::from(image.width()) * u64::from(image.height());
                if self.pixels > FREE_PIXELS.saturating_add(PIXELS_PER_BYTE * self.distinct_bytes) {
                    let message = format!("the images have {} pixels in all", self.pixels);
                    let error = SceneError::new(ErrorKind::Limit, message);
                    return Err(at(error, "too many for the size of their files"));
                }
                Ok(Some(Arc::new(image)))
            }
            Some(Err(message)) => {
                let message = format!("cannot read `{name}`: {message}");
                Err(at(
                    SceneError::new(ErrorKind::Syntax, message),
                    "named here",
                ))
            }
            None => {
                let extension: String = name
                    .rsplit('.')
                    .next()
                    .unwrap_or("")
                    .chars()
                    .take(20)
                    .collect();
                let message = format!("images of type `{extension}` are not supported");
                self.warn(ErrorKind::Unsupported, message, "replaced by grey, 0.5", at)?;
                Ok(None)
            }
        }
    }

    /// The finished scene with its warnings; without a camera it gets one that frames it.
    pub(crate) fn finish(
        mut self,
        name: &str,
        has_shapes: bool,
        camera: Option<Camera>,
        film: FilmSettings,
    ) -> Result<Loaded> {
        let whole = |e: SceneError| e.in_file(name);
        if !has_shapes {
            let message = "the scene has no shapes";
            self.warnings.warn(ErrorKind::Suspicious, message, whole)?;
        } else if self.builder.light_count() == 0 {
            let message = "the scene has no area or linear lights";
            self.warnings.warn(ErrorKind::Suspicious, message, whole)?;
        }
        let size = [film.width, film.height];
        let unset = Camera::new(
            DAffine3::IDENTITY,
            Projection::Perspective { fov_degrees: 90.0 },
            None,
            None,
            size,
        );
        let framed = camera.is_none();
        let mut scene = self.builder.finish(camera.unwrap_or(unset), film);
        if framed && let Some((lo, hi)) = scene.bounds() {
            scene.camera = framing::camera(lo, hi, size);
        }
        Ok(Loaded {
            scene,
            warnings: self.warnings.into_list(),
        })
    }
}

/// What an I/O error means, without the system's error number.
pub(crate) fn describe(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        std::io::ErrorKind::IsADirectory => "it is a folder".into(),
        _ => error.to_string(),
    }
}
