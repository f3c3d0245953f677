//! `linelit convert`: a scene as pbrt-v4 text.

use crate::args::ConvertArgs;
use crate::output::note;
use anyhow::Result;
use linelit_bsdf::Reflection;
use linelit_film::{ByteImage, FilmError, encode_tga, write_atomically, write_atomically_with};
use linelit_formats::{ExportOptions, LoadOptions};
use linelit_geometry::{DVec3, Frame};
use linelit_integrator::{Renderer, Workspace};
use linelit_lights::Light;
use linelit_scene::{ImageData, ImageTexture, Material, Scene};
use std::cell::RefCell;
use std::fs::File;
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
    let scene = args.read.library().load(&args.scene)?.scene;
    let images = Images {
        from: parent(&linelit_scenes::locate(&args.scene)?),
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
    say_what_is_lost(&scene, &options);
    if !options.extensions
        && let Some(change) = Change::largest(&scene)
    {
        note(format_args!("{change}"));
    }
    Ok(())
}

/// Change of albedo by the replacement of a material.
struct Change {
    /// Materials that are replaced.
    count: usize,
    name: String,
    kinds: [&'static str; 2],
    /// Share of light from all directions alike that they reflect.
    albedos: [f64; 2],
}

impl Change {
    /// The material that its replacement changes most, of those that pbrt-v4 does not have.
    fn largest(scene: &Scene) -> Option<Self> {
        let replaced = scene.materials.iter().zip(0_u32..);
        let replaced =
            replaced.filter_map(|(m, k)| Some((m, k, linelit_formats::nearest_in_pbrt_v4(m)?)));
        let changes = replaced.map(|(material, k, nearest)| {
            let mut materials = scene.materials.clone();
            let before = albedo(&materials, k);
            materials[k as usize] = nearest.clone();
            Self {
                count: 0,
                name: material.name.clone(),
                kinds: [material.kind.name(), nearest.kind.name()],
                albedos: [before, albedo(&materials, k)],
            }
        });
        let mut changes: Vec<Self> = changes.collect();
        let count = changes.len();
        changes.sort_by(|a, b| b.ratio().abs().total_cmp(&a.ratio().abs()));
        let largest = changes.into_iter().next()?;
        Some(Self { count, ..largest })
    }

    /// The logarithm of the ratio of the albedos.
    fn ratio(&self) -> f64 {
        let [before, after] = self.albedos.map(|a| a.max(1e-6));
        (after / before).ln()
    }
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [before, after] = self.albedos;
        let [ours, theirs] = self.kinds;
        let several = if self.count == 1 {
            "material is"
        } else {
            "materials are"
        };
        let percent = 100.0 * self.ratio().exp_m1();
        write!(
            f,
            "warning: {} {several} written as the nearest that pbrt-v4 has; read back by linelit, `{}` reflects \
             {after:.3} of the light as `{theirs}` where it reflects {before:.3} as `{ours}` ({percent:+.0} %; \
             --extensions writes it as it is)",
            self.count, self.name
        )
    }
}

/// What a material reflects, in the mean over the channels, of light from all directions alike (its
/// bihemispherical reflectance), where the texture coordinates are ½: 32 × 8 × 8 directions drawn
/// by the material itself, good to about a percent.
fn albedo(materials: &[Material], material: u32) -> f64 {
    const VIEWS: u32 = 32;
    const DRAWN: u32 = 8;
    let text = "Camera \"orthographic\" WorldBegin Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \
                \"point3 P\" [ -1 -1 1 1 -1 1 1 1 1 -1 1 1 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]";
    let Ok(probe) = linelit_formats::from_pbrt_str(text, "probe", &LoadOptions::default()) else {
        return 0.0;
    };
    let mut probe = probe.scene;
    probe.materials = materials.to_vec();
    probe.meshes[0].material = material;
    probe.set_resolution(1, 1);
    let renderer = Renderer::new(&probe);
    let Some(point) = renderer.shading_point([0, 0], &mut Workspace::new()) else {
        return 0.0;
    };
    let frame = Frame::from_normal(point.normal);
    let middle = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n);
    let mut sum = DVec3::ZERO;
    for view in 0..VIEWS {
        // By the cosine.
        let cosine = (1.0 - middle(view, VIEWS)).sqrt();
        let sine = (1.0 - cosine * cosine).sqrt();
        let outgoing = frame.x * sine + point.normal * cosine;
        for u in 0..DRAWN {
            for v in 0..DRAWN {
                let drawn = [middle(u, DRAWN), middle(v, DRAWN)];
                let Some(wi) = point.bsdf.sample(drawn, outgoing, point.normal) else {
                    continue;
                };
                let density = point.bsdf.pdf(wi, outgoing, point.normal);
                let cosine = point.cosine(wi);
                if density > 0.0 && cosine > 0.0 {
                    let value = point.bsdf.eval(wi, outgoing, point.normal);
                    sum += value * (cosine / density);
                }
            }
        }
    }
    let reflected = sum / f64::from(VIEWS * DRAWN * DRAWN);
    let mirrored: DVec3 = point.bounces.iter().map(|b| b.weight).sum();
    (reflected + mirrored).element_sum() / 3.0
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
    if lines > 0 && !options.extensions {
        note(format_args!(
            "warning: pbrt-v4 has no linear lights: {lines} are written as comments \
             (--extensions writes them for linelit)"
        ));
    }
}

fn parent(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_owned()
}

/// Names of images in the new file.
struct Images<'a> {
    /// Folder that the old names are relative to.
    from: PathBuf,
    /// The new file.
    to: &'a Path,
    /// Images that have no file yet.
    written: RefCell<Vec<Arc<ImageData>>>,
    /// Files of images to copy beside the new file, and their names there.
    copied: RefCell<Vec<(PathBuf, String)>>,
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
        let whole = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_owned());
        if whole(&self.from) == whole(&parent(self.to)) {
            return image.filename.clone();
        }
        let path = whole(&self.from.join(&image.filename));
        let mut copied = self.copied.borrow_mut();
        if let Some((_, name)) = copied.iter().find(|(from, _)| *from == path) {
            return name.clone();
        }
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        // Files of several folders may have one name.
        let name = format!("{stem}-{}-{file}", copied.len());
        copied.push((path, name.clone()));
        name
    }

    /// The file of an image that was inside the scene file.
    fn file_name(&self, number: usize, image: &ImageData) -> String {
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let kind = if image.is_linear() { "pfm" } else { "tga" };
        format!("{stem}-image{number}.{kind}")
    }

    fn write(&self) -> Result<(), FilmError> {
        for (from, name) in self.copied.borrow().iter() {
            write_atomically_with(&parent(self.to).join(name), |mut file| {
                io::copy(&mut File::open(from)?, &mut file).map(|_| ())
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
