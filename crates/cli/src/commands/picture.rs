//! Pictures in units: pieces of work that any thread or machine can compute in any order.
//!
//! ```text
//!     the whole frame           a unit: one tile of the window, with all its camera
//!     ┌────────────────────┐    samples or with one block of them
//!     │   the window       │
//!     │   ┌────┬────┬────┐ │         Work ───── compute ─────► Part
//!     │   │tile│tile│    │ │
//!     │   ├────┼────┼────┤ │         Part, Part, … ── add ──► Assembly ──► Rendered
//!     │   │    │    │    │ │
//!     │   └────┴────┴────┘ │
//!     └────────────────────┘
//! ```
//!
//! There are two ways from work to picture:
//!
//! - *at once* ([`Picture::at_once`]): parts go to the assembly as they come, and none is stored;
//! - *by a plan*, which `render` takes too for long pictures: [`Picture::plan`] lists all work,
//!   [`Picture::run_with`] computes what is missing and keeps its parts in a folder (it may be
//!   killed and started again, on any machine), and [`Picture::gather`] combines them.
//!
//! A block is some of a pixel's camera samples, or one of its trials ([`PictureArgs::blocks`]). A
//! part depends on its work alone, and blocks are added in their order, so that the picture has the
//! same bits either way, however it was cut.

mod assembly;
mod part;

use super::aovs::{self, Rendered};
use super::cut::{Cut, pixel_seconds};
use super::image;
use super::tev::Viewer;
use super::threads::{bar, pool_of};
use super::units::check;
use crate::args::{
    MergeArgs, PictureArgs, PlanRenderArgs, PlannedArguments, ReadArgs, UsageError, given,
};
use crate::inputs::{self, Sources, locked};
use crate::output::Output;
use anyhow::{Context as _, Result, bail};
use assembly::Assembly;
use clap::Parser as _;
use linelit_film::{Tile, tiles};
use linelit_integrator::{Counts, Renderer, Workspace};
use linelit_plan::{BoxError, Folder, Plan, PlanError, Run, RunCounts, Unit};
use linelit_scene::SceneDescription;
use linelit_study::{engine, memory};
use part::{Part, Work, bounds};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The kind of plans of pictures.
pub(super) const RENDER: &str = "render";

/// The settings in a plan of a picture. With the units, they make the picture the same on any
/// machine.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanSettings {
    /// The words of the command line that the picture depends on, which are parsed again.
    render: Vec<String>,
    scene: String,
    /// The width and height of the film, in pixels.
    film: [u32; 2],
    /// The first column and the one after the last, then the rows.
    window: [u32; 4],
    /// The matrices of the camera ([`Document::world_to`](linelit_film::Document::world_to)).
    world_to: [Option<[f32; 16]>; 2],
    /// Whether the picture is lit by a light that is not in the scene's file.
    has_lamp: bool,
}

/// A picture that is cut into units.
pub(super) struct Picture {
    scene: String,
    args: PictureArgs,
    film: [u32; 2],
    window: Tile,
    world_to: [Option<[f32; 16]>; 2],
    has_lamp: bool,
    work: Vec<Work>,
}

/// Returns the plan that `plan render` writes.
pub(super) fn plan(args: &PlanRenderArgs) -> Result<Plan> {
    aovs::check(&args.picture, false)?;
    // Read the scene.
    let sources = Sources::new(&args.read);
    let mut scene = sources.load(&args.scene)?;
    let window = image::set_film(&mut scene, &args.picture);
    image::check_lights(&scene, &args.picture)?;
    // Cut the picture by the estimated time of a pixel.
    let pixel = pixel_seconds(&scene, &args.picture);
    let cut = Cut::choose(&args.picture, window, pixel, args.tile, args.split_samples);
    Picture::new(&args.scene, &scene, &args.picture, window)
        .cut(cut)
        .plan(pixel, &sources)
}

impl Picture {
    /// Creates a picture with the units in which it is computed at once.
    pub(super) fn new(
        name: &str,
        scene: &SceneDescription,
        args: &PictureArgs,
        window: Tile,
    ) -> Self {
        let picture = Self {
            scene: name.to_owned(),
            args: args.clone(),
            film: [scene.film.width, scene.film.height],
            window,
            world_to: (scene.camera.matrices())
                .map(|matrix| Some(matrix?.as_mat4().to_cols_array())),
            has_lamp: scene.has_lamp,
            work: Vec::new(),
        };
        picture.cut(Cut::AT_ONCE)
    }

    /// Cuts the picture into other units: tile after tile, and the blocks of each in their order.
    pub(super) fn cut(mut self, cut: Cut) -> Self {
        let blocks: Vec<Option<u32>> = match cut.by_block {
            true => (0..self.args.blocks()).map(Some).collect(),
            false => vec![None],
        };
        let tiles = tiles(self.window, cut.side).into_iter().map(bounds);
        let units = tiles.flat_map(|tile| blocks.iter().map(move |&block| Work { tile, block }));
        self.work = units.collect();
        self
    }

    /// Returns the plan of the picture, given an estimate of the seconds that a pixel takes.
    pub(super) fn plan(&self, pixel_seconds: f64, sources: &Sources<'_>) -> Result<Plan> {
        let settings = PlanSettings {
            render: given::<PlannedArguments<PictureArgs>>()?,
            scene: self.scene.clone(),
            film: self.film,
            window: bounds(self.window),
            world_to: self.world_to,
            has_lamp: self.has_lamp,
        };
        // Name each unit by its pixels and its block, and estimate its cost.
        let blocks = self.args.blocks();
        let unit = |work: &Work| -> Result<Unit> {
            let [x0, x1, y0, y1] = work.tile;
            let mut name = format!("pixels {x0}..{x1} x {y0}..{y1}");
            let mut cost = pixel_seconds * work.tile().area() as f64;
            if let Some(k) = work.block {
                name += &format!(", block {} of {blocks}", k + 1);
                cost /= f64::from(blocks);
            }
            Ok(Unit::new(name, cost, serde_json::to_string(work)?))
        };
        let units = self.work.iter().map(unit).collect::<Result<_>>()?;
        sources.plan(RENDER, &settings, std::slice::from_ref(&self.scene), units)
    }

    /// Returns the picture of a plan, and the options for reading its scene.
    pub(super) fn open(folder: &Folder) -> Result<(Self, ReadArgs)> {
        // Read the settings, the words of the command line, and the work of all units.
        let plan = folder.plan();
        let what = || format!("{}: no plan of a picture", folder.path().display());
        let settings: PlanSettings = serde_json::from_str(&plan.settings).with_context(what)?;
        let again =
            PlannedArguments::<PictureArgs>::try_parse_from(settings.render).with_context(what)?;
        let work = plan.units.iter().map(|u| serde_json::from_str(&u.work));
        let work: Vec<Work> = work.collect::<Result<_, _>>().with_context(what)?;
        // Check that all tiles are in the window: the film has no other pixels.
        let [left, right, top, bottom] = settings.window;
        let within = |work: &Work| {
            let [x0, x1, y0, y1] = work.tile;
            let columns = left <= x0 && x0 < x1 && x1 <= right;
            columns && top <= y0 && y0 < y1 && y1 <= bottom
        };
        if !work.iter().all(within) {
            bail!("{}: a tile beyond the picture", folder.path().display());
        }
        let picture = Self {
            scene: settings.scene,
            args: again.args,
            film: settings.film,
            window: Tile {
                x0: left,
                y0: top,
                x1: right,
                y1: bottom,
            },
            world_to: settings.world_to,
            has_lamp: settings.has_lamp,
            work,
        };
        Ok((picture, again.read))
    }

    /// Computes the remaining units of a plan.
    pub(super) fn run(
        &self,
        read: &ReadArgs,
        folder: &Folder,
        options: &Run<'_>,
    ) -> Result<RunCounts> {
        let mut scene = inputs::open(folder, 0, read)?;
        image::set_film(&mut scene, &self.args);
        let pool = pool_of(options.threads)?;
        let renderer = pool.install(|| image::renderer(&scene, &self.args))?;
        Ok(self.run_with(&renderer, folder, options)?)
    }

    /// Computes the remaining units in a folder, by a renderer of the scene.
    pub(super) fn run_with(
        &self,
        renderer: &Renderer<'_>,
        folder: &Folder,
        options: &Run<'_>,
    ) -> Result<RunCounts, PlanError> {
        linelit_plan::run(folder, options, |task| {
            let work = self.work[task.number() as usize];
            let (part, _) = Part::compute(&self.args, renderer, work, &mut Workspace::new());
            Ok(engine::to_bytes(&part))
        })
    }

    /// Computes the picture on the threads of the current pool, shows tiles as they are finished,
    /// and stores no parts. Returns the picture, its numbers as [`image::counted`] names them, and
    /// all counts. The picture must not be cut by blocks, which would have to be added in their
    /// order.
    pub(super) fn at_once(
        &self,
        renderer: &Renderer<'_>,
        viewer: Option<&mut Viewer>,
    ) -> (Rendered, Vec<u64>, Counts) {
        // Compute the units, and add each to the picture as it comes: the iterator is lazy.
        let assembly = Mutex::new((Assembly::new(self), viewer));
        let progress = bar("rendering");
        progress.set_length(self.work.len() as u64);
        let computed = self
            .work
            .par_iter()
            .map_init(Workspace::new, |workspace, work| {
                let (part, counts) = Part::compute(&self.args, renderer, *work, workspace);
                let (assembly, viewer) = &mut *locked(&assembly);
                if let (Some(tile), Some(viewer)) = (assembly.add(*work, part), viewer) {
                    viewer.show(tile, &assembly.rendered.image);
                }
                progress.inc(1);
                counts
            });
        let computed: Vec<Counts> = computed.collect();
        progress.finish_and_clear();
        // Add up the counts, in the order of the units.
        let mut counts = Counts::default();
        computed.into_iter().for_each(|own| counts += own);
        let assembly = assembly
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .0;
        (assembly.rendered, assembly.counted, counts)
    }

    /// Puts the parts of a plan together, in the order of the units. Returns the picture, and its
    /// numbers as [`image::counted`] names them. Fails if parts are missing.
    pub(super) fn gather(&self, folder: &Folder) -> Result<(Rendered, Vec<u64>)> {
        memory::check_picture(self.window, aovs::bytes_per_pixel(&self.args))?;
        let mut assembly = Assembly::new(self);
        let missing = folder.read_all(|number, payload| {
            let work = self.work[number as usize];
            let part: Option<Part> = engine::from_bytes(&payload).ok();
            let Some(part) = part.filter(|part| part.fits(&self.args, work)) else {
                return Err(PlanError::Work {
                    number,
                    name: folder.plan().units[number as usize].name.clone(),
                    error: BoxError::from("it lacks values for pixels of its tile"),
                });
            };
            assembly.add(work, part);
            Ok(())
        })?;
        check(folder, &missing)?;
        Ok((assembly.rendered, assembly.counted))
    }

    /// Puts the parts of a plan together, and writes the image.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let path = self.image_path(args)?;
        let (rendered, counted) = self.gather(folder)?;
        let scene = &self.scene;
        let result = image::picture_json(scene, path, &rendered, &counted);
        let to = (path, &args.file);
        pool_of(args.threads)?.install(|| image::write(rendered, to, scene, &self.args))?;
        if args.json {
            writeln!(out, "{}", Value::from(result))?;
        }
        Ok(())
    }

    /// Returns the path of the image that merging should write, after checking that it can be
    /// written.
    fn image_path<'a>(&self, args: &'a MergeArgs) -> Result<&'a Path> {
        let Some(path) = &args.output else {
            let text = "merging a picture writes an image: -o IMAGE.exr, .pfm or .png";
            return Err(UsageError(text.to_owned()).into());
        };
        let is_image = |ending: &&str| image::ends_in(path, ending);
        if !["exr", "pfm", "png"].iter().any(is_image) {
            let shown = path.display();
            let text = format!("{shown}: the name must end in .exr, .pfm or .png");
            return Err(UsageError(text).into());
        }
        image::check_file(&args.file, path)?;
        aovs::check(&self.args, !image::ends_in(path, "exr"))?;
        linelit_film::check_writable(path)?;
        Ok(path)
    }
}
