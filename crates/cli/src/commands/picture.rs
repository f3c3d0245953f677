//! Pictures in units: a unit is a tile of all its camera samples, or of a trial or a block of them.
//! They are computed at once, or kept as parts of a plan.

use super::aovs::{self, Rendered, Surface};
use super::tev::Viewer;
use super::units::check;
use super::{bar, pool_of, render};
use crate::args::{Again, MergeArgs, PictureArgs, PlanRenderArgs, ReadArgs, UsageError, given};
use crate::inputs::{self, Sources, locked};
use crate::output::Output;
use anyhow::{Context as _, Result, bail};
use clap::Parser as _;
use linelit_film::{Image, Moments, Placement, Tile, tiles};
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, LightChoice, Renderer, Workspace};
use linelit_plan::{BoxError, Folder, Plan, PlanError, Ran, Run, Unit};
use linelit_scene::SceneDescription;
use linelit_study::{engine, memory};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::{Mutex, PoisonError};

/// The kind of plans of pictures.
pub(super) const RENDER: &str = "render";

/// The bounds of a unit's expected time, in seconds of one thread: the least, so that writing its
/// part is little beside it, and the most, so that a kill costs little.
const UNIT_SECONDS: [f64; 2] = [0.25, 2.0];
/// The number of units that is enough for sharing them out.
const ENOUGH: f64 = 256.0;
/// Sides of tiles: the largest that is tried, and that below which camera samples are split first.
const SIDES: [u32; 2] = [1024, 8];
/// The side of tiles that are computed at once, not kept.
const SIDE_AT_ONCE: u32 = 16;

/// The settings of such a plan.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// The words of `render` that numbers depend on.
    render: Vec<String>,
    scene: String,
    /// Pixels of the film across and down.
    film: [u32; 2],
    /// Columns from and to, rows from and to.
    window: [u32; 4],
    /// The matrices of the camera ([`Document::world_to`](linelit_film::Document::world_to)).
    world_to: [Option<[f32; 16]>; 2],
    /// Whether it is lit by a lamp that is not in the scene's file.
    has_lamp: bool,
}

/// The work of a unit.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Work {
    /// Columns from and to, rows from and to.
    tile: [u32; 4],
    /// The number of its block of camera samples; all if none is named.
    block: Option<u32>,
}

impl Work {
    const fn tile(self) -> Tile {
        let [x0, x1, y0, y1] = self.tile;
        Tile { x0, y0, x1, y1 }
    }

    fn is_first(self) -> bool {
        self.block.is_none_or(|k| k == 0)
    }
}

const fn bounds(tile: Tile) -> [u32; 4] {
    [tile.x0, tile.x1, tile.y0, tile.y1]
}

/// A picture in units.
pub(super) struct Picture {
    scene: String,
    args: PictureArgs,
    film: [u32; 2],
    window: Tile,
    world_to: [Option<[f32; 16]>; 2],
    has_lamp: bool,
    work: Vec<Work>,
}

/// Seconds of one thread for a pixel, by what is asked for: within a factor of ten.
pub(super) fn pixel_seconds(scene: &SceneDescription, picture: &PictureArgs) -> f64 {
    let lights = match picture.lights {
        LightChoice::All => scene.lights.len() as f64,
        _ => 1.0,
    };
    let light = 1e-6 + 5e-7 * f64::from(picture.samples);
    picture.camera_samples() * (1e-6 + lights * light)
}

/// The plan that `plan render` asks for.
pub(super) fn plan(args: &PlanRenderArgs) -> Result<Plan> {
    aovs::check(&args.picture, false)?;
    let sources = Sources::new(&args.read);
    let mut scene = sources.load(&args.scene)?;
    let window = render::set_film(&mut scene, &args.picture);
    render::check_lights(&scene, &args.picture)?;
    let pixel = pixel_seconds(&scene, &args.picture);
    let cut = size(
        args.tile,
        args.split_samples,
        pixel,
        window,
        args.picture.blocks(),
    );
    Picture::new(&args.scene, &scene, &args.picture, window)
        .cut(cut)
        .plan(pixel, &sources)
}

/// The side of tiles, and whether their blocks of samples are units of their own: what was asked
/// for, or the largest that are short enough, of a window whose pixels take so many seconds each.
pub(super) fn size(
    side: Option<u32>,
    split: bool,
    pixel: f64,
    window: Tile,
    blocks: u32,
) -> (u32, bool) {
    let [least, most] = UNIT_SECONDS;
    let seconds = (pixel * window.area() as f64 / ENOUGH).clamp(least, most);
    let fits =
        |side: u32, parts: u32| f64::from(side).powi(2) * pixel / f64::from(parts) <= seconds;
    let [largest, small] = SIDES;
    let split = blocks > 1 && (split || !fits(side.unwrap_or(small), 1));
    let halves = std::iter::successors(Some(largest), |side| Some(side / 2).filter(|s| *s > 0));
    let mut sides = halves.filter(|side| fits(*side, if split { blocks } else { 1 }));
    (side.or_else(|| sides.next()).unwrap_or(1), split)
}

impl Picture {
    /// A picture in the tiles in which it is computed at once.
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
        picture.cut((SIDE_AT_ONCE, false))
    }

    /// Cuts the picture into tiles with this side, and their samples into blocks if asked.
    pub(super) fn cut(mut self, size: (u32, bool)) -> Self {
        let (side, split) = size;
        let blocks: Vec<Option<u32>> = match split {
            true => (0..self.args.blocks()).map(Some).collect(),
            false => vec![None],
        };
        let tiles = tiles(self.window, side).into_iter().map(bounds);
        let units = tiles.flat_map(|tile| blocks.iter().map(move |&block| Work { tile, block }));
        self.work = units.collect();
        self
    }

    /// Returns the plan of the picture, if a pixel takes so many seconds.
    pub(super) fn plan(&self, pixel: f64, sources: &Sources<'_>) -> Result<Plan> {
        let settings = Settings {
            render: given::<Again<PictureArgs>>()?,
            scene: self.scene.clone(),
            film: self.film,
            window: bounds(self.window),
            world_to: self.world_to,
            has_lamp: self.has_lamp,
        };
        let blocks = self.args.blocks();
        let unit = |work: &Work| -> Result<Unit> {
            let [x0, x1, y0, y1] = work.tile;
            let mut name = format!("pixels {x0}..{x1} x {y0}..{y1}");
            let mut cost = pixel * work.tile().area() as f64;
            if let Some(k) = work.block {
                name += &format!(", block {} of {blocks}", k + 1);
                cost /= f64::from(blocks);
            }
            Ok(Unit::new(name, cost, serde_json::to_string(work)?))
        };
        let units = self.work.iter().map(unit).collect::<Result<_>>()?;
        sources.plan(RENDER, &settings, std::slice::from_ref(&self.scene), units)
    }

    /// The picture of a plan, and how its scene is read.
    pub(super) fn open(folder: &Folder) -> Result<(Self, ReadArgs)> {
        let plan = folder.plan();
        let what = || format!("{}: no plan of a picture", folder.path().display());
        let settings: Settings = serde_json::from_str(&plan.settings).with_context(what)?;
        let again = Again::<PictureArgs>::try_parse_from(settings.render).with_context(what)?;
        let work = plan.units.iter().map(|u| serde_json::from_str(&u.work));
        let work: Vec<Work> = work.collect::<Result<_, _>>().with_context(what)?;
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
    pub(super) fn run(&self, read: &ReadArgs, folder: &Folder, options: &Run<'_>) -> Result<Ran> {
        let mut scene = inputs::open(folder, 0, read)?;
        render::set_film(&mut scene, &self.args);
        let pool = pool_of(options.threads)?;
        let renderer = pool.install(|| render::renderer(&scene, &self.args))?;
        Ok(self.run_with(&renderer, folder, options)?)
    }

    /// Computes the picture's units in a folder by a renderer of its scene.
    pub(super) fn run_with(
        &self,
        renderer: &Renderer<'_>,
        folder: &Folder,
        options: &Run<'_>,
    ) -> Result<Ran, PlanError> {
        linelit_plan::run(folder, options, |task| {
            let work = self.work[task.number() as usize];
            let (part, _) = self.compute(renderer, work, &mut Workspace::new());
            Ok(engine::to_bytes(&part))
        })
    }

    /// Computes all of it by the threads of the current pool, shows its tiles, and keeps nothing.
    pub(super) fn at_once(
        &self,
        renderer: &Renderer<'_>,
        viewer: Option<&mut Viewer>,
    ) -> (Rendered, Vec<u64>, Counts) {
        let film = Mutex::new((Film::new(self), viewer));
        let progress = bar("rendering");
        progress.set_length(self.work.len() as u64);
        let each = self
            .work
            .par_iter()
            .map_init(Workspace::new, |workspace, work| {
                let (part, counts) = self.compute(renderer, *work, workspace);
                let (film, viewer) = &mut *locked(&film);
                if let (Some(tile), Some(viewer)) = (film.add(*work, part), viewer) {
                    viewer.show(tile, &film.rendered.image);
                }
                progress.inc(1);
                counts
            });
        let mut counts = Counts::default();
        let each: Vec<Counts> = each.collect();
        each.into_iter().for_each(|own| counts += own);
        progress.finish_and_clear();
        let film = film.into_inner().unwrap_or_else(PoisonError::into_inner).0;
        (film.rendered, film.counted, counts)
    }

    /// Computes a unit.
    fn compute(
        &self,
        renderer: &Renderer<'_>,
        work: Work,
        workspace: &mut Workspace,
    ) -> (Part, Counts) {
        let (args, tile) = (&self.args, work.tile());
        let (mut part, mut counts) = (Part::default(), Counts::default());
        let moments = aovs::wants_moments(&args.aovs);
        if args.camera_samples() <= 1.0 && !moments {
            let mut row = vec![DVec3::ZERO; tile.width() as usize];
            for y in tile.y0..tile.y1 {
                renderer.row(&args.settings(), [tile.x0, y], &mut row, workspace);
                part.sums.extend(row.iter().map(|value| value.to_array()));
            }
            counts += workspace.take_counts();
        } else {
            let blocks = work.block.map_or(0..args.blocks(), |k| k..k + 1);
            for pixel in tile.pixels() {
                let (sum, found) = aovs::samples(renderer, args, pixel, blocks.clone(), workspace);
                let own = workspace.take_counts();
                part.sums.push(sum.to_array());
                if moments {
                    part.spreads.push(Spread {
                        moments: found,
                        cost: [own.visibility.rays, own.visibility.line_queries],
                    });
                }
                counts += own;
            }
        }
        part.counted = render::counted(&counts).map(|(_, n)| n).collect();
        if work.is_first() && aovs::wants_surfaces(&args.aovs) {
            let surface = |pixel| aovs::surface(renderer, pixel, workspace);
            part.surfaces = tile.pixels().map(surface).collect();
            // Nobody asks what these rays cost.
            workspace.take_counts();
        }
        (part, counts)
    }

    /// Whether a part holds what that of a unit does.
    fn fits(&self, work: Work, part: &Part) -> bool {
        let count = |there: bool| if there { work.tile().area() } else { 0 };
        let aovs = &self.args.aovs;
        let surfaces = work.is_first() && aovs::wants_surfaces(aovs);
        let lengths = [part.sums.len(), part.spreads.len(), part.surfaces.len()];
        lengths
            == [
                count(true),
                count(aovs::wants_moments(aovs)),
                count(surfaces),
            ]
            && part.counted.len() == render::counted(&Counts::default()).count()
    }

    /// Puts the parts of a plan together, with what was counted.
    pub(super) fn gather(&self, folder: &Folder) -> Result<(Rendered, Vec<u64>)> {
        memory::check_picture(self.window, aovs::bytes_per_pixel(&self.args))?;
        let mut film = Film::new(self);
        let missing = folder.read_all(|number, payload| {
            let work = self.work[number as usize];
            let part = engine::from_bytes(&payload).ok();
            let Some(part) = part.filter(|part| self.fits(work, part)) else {
                return Err(PlanError::Work {
                    number,
                    name: folder.plan().units[number as usize].name.clone(),
                    error: BoxError::from("its part does not hold what one of a picture does"),
                });
            };
            film.add(work, part);
            Ok(())
        })?;
        check(folder, &missing)?;
        Ok((film.rendered, film.counted))
    }

    /// Puts the parts of a plan together, and writes the image.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let Some(path) = &args.output else {
            let text = "merging a picture writes an image: -o IMAGE.exr, .pfm or .png";
            return Err(UsageError(text.to_owned()).into());
        };
        if !["exr", "pfm", "png"]
            .iter()
            .any(|ending| render::ends_in(path, ending))
        {
            let text = format!(
                "{}: the name must end in .exr, .pfm or .png",
                path.display()
            );
            return Err(UsageError(text).into());
        }
        render::check_file(&args.file, path)?;
        aovs::check(&self.args, !render::ends_in(path, "exr"))?;
        linelit_film::check_writable(path)?;
        let (rendered, counted) = self.gather(folder)?;
        let scene = &self.scene;
        let result = render::picture_json(scene, path, &rendered, &counted);
        let to = (&**path, &args.file);
        pool_of(args.threads)?.install(|| render::write(rendered, to, scene, &self.args))?;
        if args.json {
            writeln!(out, "{}", Value::from(result))?;
        }
        Ok(())
    }
}

/// The result of a unit.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Part {
    /// The numbers of [`render::counted`].
    counted: Vec<u64>,
    /// The sum of the camera samples of each pixel.
    sums: Vec<[f64; 3]>,
    /// The spread of each pixel's samples, for `variance` or `samples`.
    spreads: Vec<Spread>,
    /// The surface seen in each pixel, for `albedo`, `normal` or `depth`; of the first block alone.
    surfaces: Vec<Surface>,
}

/// Moments of some camera samples of a pixel, and their rays and lines.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Spread {
    #[serde(with = "MomentsAsStored")]
    moments: Moments,
    cost: [u64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Moments")]
struct MomentsAsStored {
    count: u64,
    mean: [f64; 3],
    m2: [f64; 3],
}

/// A picture in the making.
struct Film {
    window: Tile,
    /// The last block of a tile's samples that are units of their own.
    last_block: u32,
    samples: f64,
    rendered: Rendered,
    /// The blocks of a tile that were added, added up.
    tile: Part,
    counted: Vec<u64>,
}

impl Film {
    fn new(picture: &Picture) -> Self {
        let (window, aovs) = (picture.window, &picture.args.aovs);
        let all = |wanted: bool| if wanted { window.area() } else { 0 };
        let moments = all(aovs::wants_moments(aovs));
        let [width, height] = picture.film;
        let at = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
        Self {
            window,
            last_block: picture
                .work
                .iter()
                .filter_map(|w| w.block)
                .max()
                .unwrap_or(0),
            samples: picture.args.camera_samples(),
            rendered: Rendered {
                image: Image::new(window.width(), window.height()),
                placement: (window != Tile::whole(width, height)).then(|| Placement {
                    origin: [at(window.x0), at(window.y0)],
                    full: picture.film,
                    corner: [0, 0],
                }),
                world_to: picture.world_to,
                has_lamp: picture.has_lamp,
                moments: vec![Moments::default(); moments],
                cost: [vec![0; moments], vec![0; moments]],
                surfaces: vec![Surface::default(); all(aovs::wants_surfaces(aovs))],
            },
            tile: Part::default(),
            counted: vec![0; render::counted(&Counts::default()).count()],
        }
    }

    /// Adds the part of a unit; those of a tile come in the order of their blocks.
    fn add(&mut self, work: Work, part: Part) -> Option<Tile> {
        for (sum, own) in self.counted.iter_mut().zip(&part.counted) {
            *sum += own;
        }
        if work.is_first() {
            // As it is: the sign of 0 counts.
            self.tile = part;
        } else {
            for (sum, own) in self.tile.sums.iter_mut().zip(part.sums) {
                *sum = (DVec3::from_array(*sum) + DVec3::from_array(own)).to_array();
            }
            for (all, own) in self.tile.spreads.iter_mut().zip(part.spreads) {
                all.moments.merge(&own.moments);
                all.cost = [0, 1].map(|k| all.cost[k] + own.cost[k]);
            }
        }
        let is_whole = work.block.is_none_or(|block| block == self.last_block);
        is_whole.then(|| self.store(work.tile()))
    }

    /// Stores what is known of a tile, now that all of it is.
    fn store(&mut self, tile: Tile) -> Tile {
        let (part, to) = (std::mem::take(&mut self.tile), &mut self.rendered);
        for (i, [x, y]) in tile.pixels().enumerate() {
            let [column, row] = [x - self.window.x0, y - self.window.y0];
            let place = row as usize * self.window.width() as usize + column as usize;
            if let Some(sum) = part.sums.get(i) {
                to.image.rgb[place] = aovs::single(DVec3::from_array(*sum) / self.samples);
            }
            if let Some(spread) = part.spreads.get(i) {
                to.moments[place] = spread.moments;
                for (to, cost) in to.cost.iter_mut().zip(spread.cost) {
                    to[place] = aovs::clamped(cost);
                }
            }
            if let Some(surface) = part.surfaces.get(i) {
                to.surfaces[place] = *surface;
            }
        }
        tile
    }
}
