//! `linelit convert`: a scene as pbrt-v4 text.

use crate::cli::ConvertArgs;
use crate::scenes;
use anyhow::{Context, Result, bail};
use linelit_lights::Light;
use linelit_scene::{ExportOptions, ImageData, ImageTexture, Scene};
use std::cell::RefCell;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes a scene as pbrt text, and beside it the images that it had inside itself.
///
/// # Errors
/// If the scene cannot be read or a file cannot be written.
pub fn run(args: &ConvertArgs) -> Result<()> {
    if args.output.extension().is_none_or(|e| e != "pbrt") {
        bail!(
            "cannot write {}: the name must end in .pbrt",
            args.output.display()
        );
    }
    let scene = scenes::load(&args.scene, args.strict)?.scene;
    let images = Images {
        from: parent(&scenes::locate(&args.scene)?),
        to: &args.output,
        written: RefCell::default(),
    };
    let options = ExportOptions {
        extensions: args.extensions,
        image_name: &|image| images.name(image),
    };
    let failed = || format!("writing {}", args.output.display());
    let mut file = BufWriter::new(File::create(&args.output).with_context(failed)?);
    scene.write_pbrt(&mut file, &options).with_context(failed)?;
    file.flush().with_context(failed)?;
    images.write()?;
    say_what_is_lost(&scene, &options);
    Ok(())
}

fn say_what_is_lost(scene: &Scene, options: &ExportOptions<'_>) {
    let maps = scene.lights.iter().filter_map(|l| l.map.as_ref());
    let maps = maps.filter(|map| !options.writes(map)).count();
    if maps > 0 {
        eprintln!("warning: the textured emission of {maps} lights is written as its means");
    }
    let is_line = |light: &&Light| matches!(light, Light::Linear(_));
    let lines = scene
        .lights
        .iter()
        .map(|l| &l.light)
        .filter(is_line)
        .count();
    if lines > 0 && !options.extensions {
        eprintln!(
            "warning: pbrt-v4 has no linear lights: {lines} are written as comments (--extensions writes them for linelit)"
        );
    }
}

fn parent(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_owned()
}

/// Names of images in the new file.
struct Images<'a> {
    /// Where the old names start.
    from: PathBuf,
    /// The new file.
    to: &'a Path,
    /// Images that have no file yet.
    written: RefCell<Vec<Arc<ImageData>>>,
}

impl Images<'_> {
    /// The name to write: the old one within the same folder, the whole path of an image
    /// elsewhere, and a new file for what was inside the scene file.
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
        let whole = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_owned());
        if whole(&self.from) == whole(&parent(self.to)) {
            return image.filename.clone();
        }
        let path = whole(&self.from.join(&image.filename));
        path.to_string_lossy().into_owned()
    }

    /// The file of an image that was inside the scene file.
    fn file_name(&self, number: usize, image: &ImageData) -> String {
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let kind = if image.is_linear() { "pfm" } else { "tga" };
        format!("{stem}-image{number}.{kind}")
    }

    fn write(&self) -> Result<()> {
        for (number, image) in self.written.borrow().iter().enumerate() {
            let path = parent(self.to).join(self.file_name(number, image));
            let failed = || format!("writing {}", path.display());
            if image.is_linear() {
                linelit_film::write_pfm(&path, &numbers(image)).with_context(failed)?;
                continue;
            }
            let mut file = BufWriter::new(File::create(&path).with_context(failed)?);
            image.write_tga(&mut file).with_context(failed)?;
            file.flush().with_context(failed)?;
        }
        Ok(())
    }
}

/// An image whose pixels are numbers.
#[allow(clippy::cast_possible_truncation, reason = "they were f32")]
fn numbers(image: &ImageData) -> linelit_film::Image {
    linelit_film::Image::from_fn(image.width(), image.height(), |x, y| {
        image.pixel(x, y).to_array().map(|v| v as f32)
    })
}
