//! `linelit convert`: a scene as pbrt-v4 text.

use crate::args::ConvertArgs;
use crate::output::note;
use anyhow::Result;
use linelit_film::{ByteImage, FilmError, encode_tga, write_atomically, write_atomically_with};
use linelit_formats::ExportOptions;
use linelit_integrator::{LightChoice, Renderer, Settings, Workspace};
use linelit_lights::Light;
use linelit_scene::{ImageData, ImageTexture, Links, Material, Mesh, Scene};
use linelit_scenes::Place;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes a scene as pbrt text, and beside it the images that it had inside itself.
///
/// # Errors
/// If the scene cannot be read or a file cannot be written.
pub fn run(args: &ConvertArgs) -> Result<()> {
    // Before the work, lest that be lost.
    linelit_film::check_writable(&args.output)?;
    let mut scene = args.read.library().load(&args.scene)?.scene;
    let images = Images {
        from: Place::find(&args.scene)?,
        to: &args.output,
        written: RefCell::default(),
        copied: RefCell::default(),
    };
    let options = ExportOptions {
        extensions: args.extensions,
        image_name: &|image| images.name(image),
    };
    // A file that is there already stays whole until the new one is; the images that the text
    // names are known, and written, before it appears.
    write_atomically_with(&args.output, |mut file| {
        linelit_formats::write_pbrt(&scene, &mut file, &options)?;
        images.write().map_err(io::Error::other)
    })?;
    say_what_is_written(&scene, &images, args);
    say_what_is_lost(&scene, &options);
    if !options.extensions {
        say_what_changes(&mut scene);
    }
    Ok(())
}

/// Says how much brighter or darker the picture becomes by the materials that pbrt-v4 does not
/// have, when linelit reads the nearest that it has instead.
fn say_what_changes(scene: &mut Scene) {
    /// Names of materials that are said.
    const SHOWN: usize = 3;
    let nearest =
        |m: &Material| linelit_formats::nearest_in_pbrt_v4(m).unwrap_or_else(|| m.clone());
    let mut changed: BTreeMap<[&str; 2], Vec<&str>> = BTreeMap::new();
    for material in &scene.materials {
        if let Some(near) = linelit_formats::nearest_in_pbrt_v4(material) {
            let kinds = [material.kind.name(), near.kind.name()];
            changed.entry(kinds).or_default().push(&material.name);
        }
    }
    if changed.is_empty() {
        return;
    }
    let changed = changed.iter().map(|([ours, theirs], names)| {
        let more = match names.len().saturating_sub(SHOWN) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let names: Vec<String> = names.iter().take(SHOWN).map(|n| format!("`{n}`")).collect();
        format!("{ours} as {theirs} ({}{more})", names.join(", "))
    });
    let what = changed.collect::<Vec<_>>().join(", ");
    // As `render` lights it.
    if scene.lights.is_empty() {
        linelit_formats::add_framing_light(scene);
    }
    let before = brightness(scene);
    scene.materials = scene.materials.iter().map(nearest).collect();
    let after = brightness(scene);
    let change = if before > 0.0 {
        format!("by {:+.1} %", 100.0 * (after / before - 1.0))
    } else {
        format!("from {before} to {after:.3}")
    };
    note(format_args!(
        "warning: pbrt-v4 does not have all materials: {what}; read back by linelit, the mean of \
         the picture changes {change} (--extensions writes materials as they are)"
    ));
}

/// The mean of a small picture of direct light, as `render` makes it, without lights in view; good
/// to a percent where materials are compared, as both pictures have the same samples.
fn brightness(scene: &mut Scene) -> f64 {
    /// Pixels along the longer side.
    const SIDE: f64 = 64.0;
    /// Lights from which on each point samples some of them.
    const MANY: usize = 16;
    let [width, height] = [scene.film.width, scene.film.height].map(f64::from);
    let scale = SIDE / width.max(height);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most the number of pixels along the longer side"
    )]
    let [width, height] = [width, height].map(|n| (n * scale).round().max(1.0) as u32);
    scene.set_resolution(width, height);
    let few = scene.lights.len() < MANY;
    let settings = Settings {
        lights: if few {
            LightChoice::All
        } else {
            LightChoice::Tree
        },
        show_lights: false,
        bounces: 8,
        ..Settings::default()
    };
    let renderer = Renderer::new(scene);
    let mut workspace = Workspace::new();
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            let pixel = renderer.pixel(&settings, [x, y], &mut workspace);
            sum += pixel.element_sum();
        }
    }
    sum / (3.0 * f64::from(width) * f64::from(height))
}

/// Says what is in the new file, and which files are new beside it.
fn say_what_is_written(scene: &Scene, images: &Images<'_>, args: &ConvertArgs) {
    let beside = images.beside();
    let beside = match beside.len() {
        0 => String::new(),
        _ => format!("; beside it {}", beside.join(", ")),
    };
    let instances = match (scene.instances.len(), scene.objects.len()) {
        (0, 0) => String::new(),
        (count, objects) => format!(", {count} instances of {objects} objects"),
    };
    note(format_args!(
        "note: {}: {} triangles in {} meshes{instances}, {} materials, {} lights{beside}",
        args.output.display(),
        scene.triangles.len(),
        scene.meshes.len(),
        scene.materials.len(),
        scene.lights.len()
    ));
    if scene.lights.is_empty() {
        note(format_args!(
            "warning: the scene has no lights, and gets none (`render` lights it by a square)"
        ));
    }
}

fn say_what_is_lost(scene: &Scene, options: &ExportOptions<'_>) {
    let maps = scene.lights.iter().filter_map(|l| l.map.as_ref());
    let maps = maps.filter(|map| !options.writes(map)).count();
    if maps > 0 {
        note(format_args!(
            "warning: the textured emission of {maps} lights is written as its means"
        ));
    }
    let is_line = |light: &&Light| matches!(light, Light::Linear(_));
    let lines = scene
        .lights
        .iter()
        .map(|l| &*l.light)
        .filter(is_line)
        .count();
    if !options.extensions {
        say_what_is_no_pbrt(scene);
    }
    if lines > 0 && !options.extensions {
        note(format_args!(
            "warning: pbrt-v4 has no linear lights: {lines} are written as comments \
             (--extensions writes them for linelit)"
        ));
    }
}

/// Says of meshes what pbrt-v4 does not have.
fn say_what_is_no_pbrt(scene: &Scene) {
    let of_objects = scene.objects.iter().flat_map(|object| &object.meshes);
    let meshes = scene.meshes.iter().chain(of_objects);
    let shadow = |mesh: &&Mesh| mesh.cutout.is_some_and(|holes| holes.shadow.is_some());
    let is_linked = |mesh: &&Mesh| mesh.links != Links::default();
    for (what, count) in [
        (
            "holes for lights alone",
            meshes.clone().filter(shadow).count(),
        ),
        ("light linking", meshes.filter(is_linked).count()),
    ] {
        if count > 0 {
            note(format_args!(
                "warning: pbrt-v4 has no {what}: that of {count} meshes is left out (--extensions \
                 writes it for linelit)"
            ));
        }
    }
}

fn parent(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_owned()
}

/// Names of images in the new file.
struct Images<'a> {
    /// Where the old names are known.
    from: Place,
    /// The new file.
    to: &'a Path,
    /// Images that have no file yet.
    written: RefCell<Vec<Arc<ImageData>>>,
    /// Images of files to copy beside the new file, with their old names and those there.
    copied: RefCell<Vec<Copied>>,
}

struct Copied {
    /// Links followed: a file may have several names.
    whole: PathBuf,
    old: String,
    new: String,
}

impl Images<'_> {
    /// The name to write: the old one within the same folder, that of a copy of an image
    /// elsewhere (scenes may name only files below their folder), and a new file for what was
    /// inside the scene file.
    fn name(&self, image: &ImageTexture) -> String {
        if image.filename.is_empty() {
            let mut written = self.written.borrow_mut();
            let known = written.iter().position(|i| Arc::ptr_eq(i, &image.data));
            let number = known.unwrap_or_else(|| {
                written.push(Arc::clone(&image.data));
                written.len() - 1
            });
            return self.file_name(number, &image.data);
        }
        let old = &image.filename;
        let whole = match &self.from {
            Place::BuiltIn(_) => PathBuf::from(old),
            Place::File(scene) => {
                let whole = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_owned());
                if whole(&parent(scene)) == whole(&parent(self.to)) {
                    return old.clone();
                }
                whole(&scene.with_file_name(old))
            }
        };
        let mut copied = self.copied.borrow_mut();
        if let Some(known) = copied.iter().find(|c| c.whole == whole) {
            return known.new.clone();
        }
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let file = whole.file_name().unwrap_or_default().to_string_lossy();
        // Files of several folders may have one name.
        let new = format!("{stem}-{}-{file}", copied.len());
        let (old, name) = (old.clone(), new.clone());
        copied.push(Copied { whole, old, new });
        name
    }

    /// The file of an image that was inside the scene file.
    fn file_name(&self, number: usize, image: &ImageData) -> String {
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let kind = if image.is_linear() { "pfm" } else { "tga" };
        format!("{stem}-image{number}.{kind}")
    }

    /// Names of the files that stand beside the new one because of it.
    fn beside(&self) -> Vec<String> {
        let (copied, written) = (self.copied.borrow(), self.written.borrow());
        let written = written.iter().enumerate();
        let written = written.map(|(number, image)| self.file_name(number, image));
        let copied = copied.iter().map(|image| image.new.clone());
        copied.chain(written).collect()
    }

    fn write(&self) -> Result<(), FilmError> {
        for image in self.copied.borrow().iter() {
            write_atomically_with(&parent(self.to).join(&image.new), |file| {
                file.write_all(&self.from.read(&image.old)?)
            })?;
        }
        for (number, image) in self.written.borrow().iter().enumerate() {
            let path = parent(self.to).join(self.file_name(number, image));
            if image.is_linear() {
                linelit_film::write_pfm(&path, &numbers(image))?;
            } else {
                write_atomically(&path, &encode_tga(&bytes(image))?)?;
            }
        }
        Ok(())
    }
}

/// An image whose pixels are bytes.
fn bytes(image: &ImageData) -> ByteImage {
    ByteImage {
        width: image.width(),
        height: image.height(),
        rgb: image.bytes().unwrap_or_default().to_vec(),
    }
}

/// An image whose pixels are numbers.
#[allow(clippy::cast_possible_truncation, reason = "they were f32")]
fn numbers(image: &ImageData) -> linelit_film::Image {
    linelit_film::Image::from_fn(image.width(), image.height(), |x, y| {
        image.pixel(x, y).to_array().map(|v| v as f32)
    })
}
