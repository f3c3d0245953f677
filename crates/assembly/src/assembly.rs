//! [`Assembly`], by which all readers build a scene: it adds meshes and lights with warnings about
//! them, opens files and decodes images within limits, and finishes the scene.

use crate::diagnostics::{ErrorKind, Files, Location, Result, SceneError, Warnings, shorten};
use crate::framing;
use crate::gzip;
use crate::options::{LoadOptions, Loaded, Watch};
use linelit_film::{Decoded, Pixels, decode_alpha, decode_picture};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use linelit_lights::Light;
use linelit_scene::{
    AddError, Alpha, Camera, EmissionSpec, FilmSettings, ImageData, MAX_COORDINATE, MeshData,
    Placement, Projection, SceneBuilder, Texture,
};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file that the scene names.
#[derive(Debug)]
pub struct Opened {
    /// The path of the file, for messages.
    pub path: String,
    /// The path after symbolic links.
    pub whole: PathBuf,
    /// The contents of the file.
    pub bytes: Vec<u8>,
}

/// The holes of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Holes {
    /// No holes.
    #[default]
    None,
    /// The holes are where the alpha mask with this index in the scene is below its cutoff.
    Some(u32),
    /// All of the surface is cut away.
    All,
}

impl Holes {
    /// Returns the index of the alpha mask, if there is one.
    pub fn alpha(self) -> Option<u32> {
        match self {
            Self::Some(alpha) => Some(alpha),
            Self::None | Self::All => None,
        }
    }
}

/// A scene that a reader is building, with its warnings and its files.
#[derive(Debug)]
pub struct Assembly {
    /// The scene so far.
    pub builder: SceneBuilder,
    /// The warnings so far.
    pub warnings: Warnings,
    /// The largest number of triangles.
    pub max_triangles: usize,
    /// Whether the file has lights so far, including black ones and lights that were left out.
    pub has_lights: bool,
    files: Files,
    watch: Watch,
    /// The images that have been decoded, by their names in the scene and whether their bytes are
    /// sRGB-encoded.
    images: HashMap<(String, bool), Arc<ImageData>>,
    /// The luminance of the images for which a reader requested it, with the same keys as `images`.
    greys: HashMap<(String, bool), Arc<ImageData>>,
    /// The alpha channels of the images for which a reader requested them, by the names of the
    /// images.
    alpha_channels: HashMap<String, Arc<ImageData>>,
    /// The files that have been opened.
    opened: HashSet<PathBuf>,
    /// The number of bytes of the files in `opened`, each counted once.
    distinct_bytes: u64,
    /// The number of bytes that have been read or unpacked, counted every time.
    read_bytes: u64,
    /// The number of bytes of all pixels.
    pixel_bytes: u64,
}

/// The number of bytes that a scene may read repeatedly: files that name each other many times
/// would otherwise take any time.
const FREE_REREADS: u64 = 1 << 26;
/// The average number of times that the files of a scene may be read, beyond [`FREE_REREADS`]. A
/// scene that reads more is refused.
const REREADS: u64 = 16;

/// The number of bytes that the pixels of all images together may take for files of any size.
const FREE_PIXEL_BYTES: u64 = 1 << 29;
/// The number of bytes that the pixels may take for each byte of the files.
const PIXEL_BYTES_PER_BYTE: u64 = 64;

impl Assembly {
    /// Begins an empty scene. `path` is the path of the scene's file, if it is on a disk, and
    /// `bytes` its length.
    pub fn new(path: Option<&Path>, bytes: usize, options: &LoadOptions) -> Self {
        let mut builder = SceneBuilder::new(options.max_triangles);
        builder.origin = options.origin.unwrap_or_default();
        Self {
            builder,
            warnings: Warnings::new(options.strict),
            max_triangles: options.max_triangles,
            has_lights: false,
            files: Files::new(path, options),
            watch: options.watch.clone(),
            images: HashMap::new(),
            greys: HashMap::new(),
            alpha_channels: HashMap::new(),
            opened: HashSet::new(),
            distinct_bytes: bytes as u64,
            read_bytes: bytes as u64,
            pixel_bytes: 0,
        }
    }

    /// Warns about a location in a file. The label is printed next to the caret. With
    /// [`LoadOptions::strict`], the warning is an error.
    pub fn warn(
        &mut self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: &str,
        at: Location<'_>,
    ) -> Result<()> {
        self.warnings.warn(kind, message, |e| e.at(at, label))
    }

    /// Warns about a feature that linelit does not support.
    pub fn unsupported(
        &mut self,
        message: impl Into<String>,
        label: &str,
        at: Location<'_>,
    ) -> Result<()> {
        self.warn(ErrorKind::Unsupported, message, label, at)
    }

    /// Warns about something that is probably not intended.
    pub fn suspicious(
        &mut self,
        message: impl Into<String>,
        label: &str,
        at: Location<'_>,
    ) -> Result<()> {
        self.warn(ErrorKind::Suspicious, message, label, at)
    }

    /// Adds a mesh to the scene, with warnings about triangles that were left out. `what` names the
    /// mesh in messages.
    pub fn add_mesh(
        &mut self,
        mesh: &MeshData,
        place: &Placement,
        what: &str,
        at: Location<'_>,
    ) -> Result<()> {
        // Warn about texture coordinates that are too large for alpha masks.
        self.has_lights |= place.emission.is_some();
        let alphas = place.cutout.map_or([None; 2], |c| [c.seen, c.shadow]);
        let mut alphas = alphas.into_iter().flatten();
        if alphas.any(|alpha| self.builder.alpha(alpha).is_beyond(&mesh.uvs)) {
            let message = "texture coordinates that are too large for holes";
            self.suspicious(message, "beyond 16777216 pixels of the image", at)?;
        }
        // Add the mesh; a singular transform is only a warning.
        let total = mesh.triangles.len();
        let added = match self.builder.add_mesh(mesh, place) {
            Ok(added) => added,
            Err(AddError::Singular) => {
                let message = format!("{what} is flattened by its transform");
                return self.warn(ErrorKind::BadTransform, message, "left out", at);
            }
            Err(AddError::Vertex(k)) => {
                let message =
                    format!("vertex {k} of {what} is beyond {MAX_COORDINATE:.2e} of the origin");
                return Err(at.error(ErrorKind::OutOfRange, message, "after its transform"));
            }
            Err(AddError::TooManyLights) => return Err(self.too_many_lights(at)),
            Err(AddError::TooMany) => {
                let message = format!("more than {} triangles", self.max_triangles);
                let error = at.error(ErrorKind::Limit, message, "this one is too many");
                let so_far = self.builder.triangle_count();
                return Err(error.note(format!(
                    "the scene has {so_far} triangles so far, this shape has {total}"
                )));
            }
        };
        // Warn about triangles that were left out or give no light.
        if added.degenerate > 0 {
            let label = format!("{} of {total}", added.degenerate);
            self.suspicious("triangles without area are left out", &label, at)?;
        }
        if let Some(why) = added.why_unlit {
            let label = format!("{} of {total}", added.unlit);
            let message = format!("triangles that would emit give no light: {why}");
            self.suspicious(message, &label, at)?;
        }
        Ok(())
    }

    /// Adds a linear light between two points of the world.
    pub fn add_line(
        &mut self,
        [p0, p1]: [DVec3; 2],
        spec: &EmissionSpec,
        at: Location<'_>,
    ) -> Result<()> {
        self.has_lights = true;
        if !p0.is_finite() || !p1.is_finite() {
            let message = "the end of a line is not finite";
            return Err(at.error(ErrorKind::OutOfRange, message, "after its transform"));
        }
        if p0 == p1 {
            return self.suspicious("a line without length emits nothing", "left out", at);
        }
        let added = self.builder.add_line(p0, p1, spec);
        added.map_err(|_| self.too_many_lights(at))
    }

    /// Adds a light without a shape.
    pub fn add_light(&mut self, light: Light, at: Location<'_>) -> Result<()> {
        self.has_lights = true;
        let added = self.builder.add_light(light);
        added.map_err(|_| self.too_many_lights(at))
    }

    /// Returns the error for a shape with too many lights.
    fn too_many_lights(&self, at: Location<'_>) -> SceneError {
        let message = format!("more than {} lights", self.builder.max_lights);
        at.error(ErrorKind::Limit, message, "this shape has too many")
            .note("each emissive triangle or line is a light, unless neighbours in one plane merge")
    }

    /// Reads a file that the scene names.
    pub fn open(&mut self, name: &str, at: Location<'_>) -> Result<Opened> {
        let refuse = |why: SceneError| {
            let message = format!("cannot read `{name}`: {}", why.message());
            let error = at.error(why.kind(), message, "named here");
            if why.kind() == ErrorKind::Outside {
                return error
                    .help("`--root DIR` or `--allow-outside` lets a scene name such files");
            }
            error
        };
        // Find and read the file.
        let (path, whole) = self.files.find(name).map_err(refuse)?;
        let bytes = self.files.read(&whole).map_err(refuse)?;
        // Count the bytes, and pass the file to the callback.
        let count = bytes.len() as u64;
        if self.opened.insert(whole.clone()) {
            self.distinct_bytes += count;
        }
        self.count_read(name, count, at)?;
        self.watch.tell(name, &bytes);
        let path = path.display().to_string();
        Ok(Opened { path, whole, bytes })
    }

    /// Counts bytes that were read or unpacked; it is an error if a scene reads too many. This
    /// limit prevents that small files, read again and again, take much time.
    fn count_read(&mut self, name: &str, count: u64, at: Location<'_>) -> Result<()> {
        self.read_bytes += count;
        let limit = FREE_REREADS.saturating_add(REREADS * self.distinct_bytes);
        if self.read_bytes <= limit {
            return Ok(());
        }
        let message = format!("`{name}` and others are read too often");
        let error = at.error(ErrorKind::Limit, message, "read again");
        Err(error.note(format!(
            "{} bytes of files have been read as {} bytes, {limit} are allowed",
            self.distinct_bytes, self.read_bytes
        )))
    }

    /// Returns whether a file of this name exists and the scene may name it.
    pub fn has_file(&self, name: &str) -> bool {
        self.files.has(name)
    }

    /// Reads a file as [`Assembly::open`] does, and decompresses it if its name ends in `.gz`.
    pub fn open_unpacked(&mut self, name: &str, at: Location<'_>) -> Result<Opened> {
        let mut file = self.open(name, at)?;
        if name.ends_with(".gz") {
            file.bytes = gzip::unpack(&file.bytes).map_err(|why| {
                let message = format!("cannot unpack `{name}`: {}", why.message());
                at.error(why.kind(), message, "named here")
            })?;
            self.count_read(name, file.bytes.len() as u64, at)?;
        }
        Ok(file)
    }

    /// Returns the luminance of an image file, which is computed once; `None` in the same cases as
    /// for [`Assembly::image`].
    pub fn luminance(
        &mut self,
        name: &str,
        srgb: bool,
        at: Location<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        let key = (name.to_owned(), srgb);
        if let Some(grey) = self.greys.get(&key) {
            return Ok(Some(Arc::clone(grey)));
        }
        let Some(image) = self.image(name, srgb, at)? else {
            return Ok(None);
        };
        self.add_pixels(image.memory(), at)?;
        let grey = Arc::new(image.to_luminance());
        self.greys.insert(key, Arc::clone(&grey));
        Ok(Some(grey))
    }

    /// Returns an image file, which is read once; `None`, after a warning, if its format is not
    /// supported. `srgb` says whether its integers are sRGB-encoded.
    pub fn image(
        &mut self,
        name: &str,
        srgb: bool,
        at: Location<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        let key = (name.to_owned(), srgb);
        if let Some(image) = self.images.get(&key) {
            return Ok(Some(Arc::clone(image)));
        }
        let file = self.open(name, at)?;
        let image = self.decode(name, &file.bytes, srgb, at)?;
        if let Some(image) = &image {
            self.images.insert(key, Arc::clone(image));
        }
        Ok(image)
    }

    /// Counts the memory of an image; it is an error if all images take more than allowed.
    fn add_pixels(&mut self, bytes: usize, at: Location<'_>) -> Result<()> {
        self.pixel_bytes += bytes as u64;
        let limit = FREE_PIXEL_BYTES.saturating_add(PIXEL_BYTES_PER_BYTE * self.distinct_bytes);
        if self.pixel_bytes <= limit {
            return Ok(());
        }
        let message = format!(
            "the images take {} bytes in all, {limit} are allowed",
            self.pixel_bytes
        );
        Err(at.error(
            ErrorKind::Limit,
            message,
            "too many for the size of their files",
        ))
    }

    /// Decodes an image from memory; `None`, after a warning, if its format is not supported.
    pub fn decode(
        &mut self,
        name: &str,
        bytes: &[u8],
        srgb: bool,
        at: Location<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        match decode_picture(name, bytes) {
            Some(Ok(Decoded { pixels, warning })) => {
                // Pass the decoder's warning on, and count the pixels.
                if let Some(warning) = warning {
                    let message = format!("`{name}`: {warning}");
                    self.warn(ErrorKind::OutOfRange, message, "named here", at)?;
                }
                let image = image_of(pixels, srgb);
                let image = image.expect("a reader gives all pixels, and none that is no light");
                self.add_pixels(image.memory(), at)?;
                Ok(Some(Arc::new(image)))
            }
            Some(Err(error)) => {
                let kind = if error.too_large {
                    ErrorKind::Limit
                } else {
                    ErrorKind::Syntax
                };
                let message = format!("cannot read `{name}`: {error}");
                Err(at.error(kind, message, "named here"))
            }
            None => {
                let extension = shorten(name.rsplit('.').next().unwrap_or(""));
                let message = format!("images of type `{extension}` are not supported");
                self.unsupported(message, "replaced by grey, 0.5", at)?;
                Ok(None)
            }
        }
    }

    /// Returns the alpha channel of an image file, or its luminance if it has no alpha channel;
    /// `None` in the same cases as for [`Assembly::image`].
    pub fn alpha_image(&mut self, name: &str, at: Location<'_>) -> Result<Option<Arc<ImageData>>> {
        if let Some(known) = self.alpha_channels.get(name) {
            return Ok(Some(Arc::clone(known)));
        }
        let file = self.open(name, at)?;
        let Some(alpha) = self.alpha_channel(name, &file.bytes, at)? else {
            return self.luminance(name, false, at);
        };
        self.alpha_channels
            .insert(name.to_owned(), Arc::clone(&alpha));
        Ok(Some(alpha))
    }

    /// Returns the alpha channel of an image from memory, as grey; `None` if it has no alpha
    /// channel or cannot be read. ([`Assembly::decode`] reports images that cannot be read.)
    pub fn alpha_channel(
        &mut self,
        name: &str,
        bytes: &[u8],
        at: Location<'_>,
    ) -> Result<Option<Arc<ImageData>>> {
        let Ok(Some(grey)) = decode_alpha(name, bytes) else {
            return Ok(None);
        };
        let Some(image) = image_of(grey, false) else {
            return Ok(None);
        };
        self.add_pixels(image.memory(), at)?;
        Ok(Some(Arc::new(image)))
    }

    /// Returns the holes that a texture cuts into a shape, where its value is below the cutoff.
    /// There are no holes, after a warning, if the texture cannot be an alpha mask.
    pub fn alpha(&mut self, texture: Texture, cutoff: f64, at: Location<'_>) -> Result<Holes> {
        #[allow(clippy::cast_possible_truncation, reason = "numbers of masks are f32")]
        let cutoff = cutoff as f32;
        let alpha = Alpha { texture, cutoff };
        if alpha.grid().is_some() {
            return Ok(Holes::Some(self.builder.add_alpha(alpha)));
        }
        let message = "an alpha that is a mixture or a product of textures is not supported";
        self.unsupported(message, "taken as opaque", at)?;
        Ok(Holes::None)
    }

    /// Finishes the scene, and returns it with its warnings. Without a camera, the scene gets one
    /// that sees all of it. `name` is the name of the file in messages.
    pub fn finish(
        mut self,
        name: &str,
        has_shapes: bool,
        camera: Option<Camera>,
        film: FilmSettings,
    ) -> Result<Loaded> {
        // Warn about missing shapes and lights.
        let whole = |e: SceneError| e.in_file(name);
        if !has_shapes {
            let message = "the scene has no shapes";
            self.warnings.warn(ErrorKind::Suspicious, message, whole)?;
        } else if self.builder.light_count() == 0 {
            let message = match self.has_lights {
                true => "no light of the scene emits anything",
                false => "the scene has no lights",
            };
            self.warnings.warn(ErrorKind::Suspicious, message, whole)?;
        }
        // Build the scene; where the file has no camera, frame all of it.
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
        // Warn if `f32` is too coarse for the details of the scene.
        let rounding = scene.rounding();
        if rounding.is_coarse() {
            let kind = ErrorKind::OutOfRange;
            self.warnings
                .warn(kind, rounding.to_string(), |e| e.in_file(name))?;
        }
        Ok(Loaded {
            scene,
            has_lights: self.has_lights,
            warnings: self.warnings.into_list(),
        })
    }
}

/// Returns the image of a texture from the pixels of a picture file.
fn image_of(pixels: Pixels, srgb: bool) -> Option<ImageData> {
    match pixels {
        Pixels::Bytes(p) => ImageData::new(p.width, p.height, p.rgb, srgb),
        Pixels::Words(p) => ImageData::of_words(p.width, p.height, &p.rgb, srgb),
        Pixels::Linear(p) => ImageData::linear(p.width, p.height, p.rgb),
    }
}
