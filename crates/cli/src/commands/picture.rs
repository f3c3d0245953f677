//! Pictures as plans: a unit is a tile of all its camera samples, or of a trial or a block of them.

use super::aovs::{self, Rendered, Surface};
use super::units::{self, RENDER, program};
use super::{pool_of, render};
use crate::args::{MergeArgs, PictureArgs, PlanRenderArgs, ReadArgs, UsageError};
use crate::inputs;
use crate::output::Output;
use anyhow::{Context as _, Result, bail};
use linelit_film::{Image, MomentImage, Moments, Placement, Tile, tiles};
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, LightChoice, Renderer, Workspace};
use linelit_plan::{BoxError, Folder, Input, Plan, PlanError, Ran, Run, Unit};
use linelit_scene::Scene;
use linelit_study::{engine, memory};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// What a unit takes if all goes as it should, in seconds of one thread: at least, so that writing
/// its part is little beside it, and at most, so that a kill costs little.
const UNIT_SECONDS: [f64; 2] = [0.25, 2.0];
/// So many units are enough to share out.
const ENOUGH: f64 = 256.0;
/// Sides of tiles: the largest that is tried, and that below which camera samples are split first.
const SIDES: [u32; 2] = [1024, 8];

/// What the settings of such a plan say.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Spec {
    scene: String,
    read: ReadArgs,
    /// Pixels of the film across and down.
    film: [u32; 2],
    /// Columns from and to, rows from and to.
    window: [u32; 4],
    picture: PictureArgs,
}

/// What the plan says of a unit.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Work {
    /// Columns from and to, rows from and to.
    tile: [u32; 4],
    /// Which of the blocks of camera samples; all if none is named.
    block: Option<u32>,
}

const fn tile_of([x0, x1, y0, y1]: [u32; 4]) -> Tile {
    Tile { x0, y0, x1, y1 }
}

const fn bounds(tile: Tile) -> [u32; 4] {
    [tile.x0, tile.x1, tile.y0, tile.y1]
}

/// Makes the plan of a picture, and gives the files to be packed.
pub(super) fn plan(args: &PlanRenderArgs) -> Result<(Plan, BTreeMap<String, Vec<u8>>)> {
    aovs::check(&args.picture, false)?;
    let planned = inputs::plan(&args.scene, &args.read, args.planned.pack)?;
    let mut scene = planned.loaded.scene;
    let window = render::set_film(&mut scene, &args.picture);
    render::check_lights(&scene, &args.picture)?;
    let cut = Cut {
        side: args.tile,
        split: args.split_samples,
    };
    let wanted = Wanted {
        scene: &args.scene,
        read: &args.read,
        picture: &args.picture,
        window,
    };
    Ok((wanted.plan(&scene, planned.input, cut)?, planned.packed))
}

/// Seconds of one thread for a pixel, by what is asked for: within a factor of ten.
pub(super) fn pixel_seconds(scene: &Scene, picture: &PictureArgs) -> f64 {
    let lights = match picture.lights {
        LightChoice::All => scene.lights.len() as f64,
        _ => 1.0,
    };
    let light = 1e-6 + 5e-7 * f64::from(picture.samples);
    picture.camera_samples() * (1e-6 + lights * light)
}

/// How units are asked to be.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cut {
    /// The side of tiles, in place of one by what they cost.
    side: Option<u32>,
    /// Whether a tile's blocks of camera samples are units of their own, whatever they cost.
    split: bool,
}

/// The picture of a plan.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub(super) scene: &'a str,
    pub(super) read: &'a ReadArgs,
    pub(super) picture: &'a PictureArgs,
    pub(super) window: Tile,
}

impl Wanted<'_> {
    /// Its plan, of a scene with these files.
    pub(super) fn plan(&self, scene: &Scene, input: Input, cut: Cut) -> Result<Plan> {
        let pixel = pixel_seconds(scene, self.picture);
        let mut read = self.read.clone();
        if let Some(root) = &read.root {
            let root = std::path::absolute(root).context("finding the whole path of --root")?;
            read.root = Some(root);
        }
        let spec = Spec {
            scene: self.scene.to_owned(),
            read,
            film: [scene.film.width, scene.film.height],
            window: bounds(self.window),
            picture: self.picture.clone(),
        };
        Ok(Plan {
            program: program(),
            kind: RENDER.to_owned(),
            settings: serde_json::to_string_pretty(&spec)?,
            inputs: vec![input],
            units: units(self.window, cut, self.picture.blocks(), pixel)?,
        })
    }
}

/// The units of a window, whose pixels take so many seconds each: tiles, and perhaps blocks of
/// their samples.
fn units(window: Tile, cut: Cut, blocks: u32, pixel: f64) -> Result<Vec<Unit>> {
    let (side, split) = size(cut, pixel, window, blocks);
    let mut units = Vec::new();
    for tile in tiles(window, side) {
        let each = split.then_some(0..blocks).into_iter().flatten().map(Some);
        let each: Vec<Option<u32>> = if split { each.collect() } else { vec![None] };
        for block in &each {
            let [x0, x1, y0, y1] = bounds(tile);
            let mut name = format!("pixels {x0}..{x1} x {y0}..{y1}");
            if let Some(k) = block {
                name += &format!(", block {} of {blocks}", k + 1);
            }
            let work = Work {
                tile: bounds(tile),
                block: *block,
            };
            let cost = pixel * tile.area() as f64 / each.len() as f64;
            units.push(Unit::new(name, cost, serde_json::to_string(&work)?));
        }
    }
    Ok(units)
}

/// The side of tiles, and whether their samples are split: what was asked for, or the largest that
/// are short enough.
fn size(cut: Cut, pixel: f64, window: Tile, blocks: u32) -> (u32, bool) {
    let [least, most] = UNIT_SECONDS;
    let seconds = (pixel * window.area() as f64 / ENOUGH).clamp(least, most);
    let fits =
        |side: u32, parts: u32| f64::from(side).powi(2) * pixel / f64::from(parts) <= seconds;
    let [largest, small] = SIDES;
    let split = blocks > 1 && (cut.split || !fits(cut.side.unwrap_or(small), 1));
    let halves = std::iter::successors(Some(largest), |side| Some(side / 2).filter(|s| *s > 0));
    let mut sides = halves.filter(|side| fits(*side, if split { blocks } else { 1 }));
    let side = cut.side.or_else(|| sides.next()).unwrap_or(1);
    (side, split)
}

/// A plan of a picture.
pub(super) struct PicturePlan {
    spec: Spec,
    work: Vec<Work>,
}

impl PicturePlan {
    pub(super) fn open(folder: &Folder) -> Result<Self> {
        let plan = folder.plan();
        let what = || format!("{}: no plan of a picture", folder.path().display());
        let spec: Spec = serde_json::from_str(&plan.settings).with_context(what)?;
        let work = plan.units.iter().map(|u| serde_json::from_str(&u.work));
        let work: Vec<Work> = work.collect::<Result<_, _>>().with_context(what)?;
        let window = tile_of(spec.window);
        let within = |work: &Work| {
            let [x0, x1, y0, y1] = work.tile;
            let columns = window.x0 <= x0 && x0 < x1 && x1 <= window.x1;
            columns && window.y0 <= y0 && y0 < y1 && y1 <= window.y1
        };
        if !work.iter().all(within) {
            bail!("{}: a tile beyond the picture", folder.path().display());
        }
        Ok(Self { spec, work })
    }

    /// Computes what is left of it.
    pub(super) fn run(&self, folder: &Folder, options: &Run<'_>) -> Result<Ran> {
        let picture = &self.spec.picture;
        let Some(input) = folder.plan().inputs.first() else {
            bail!("{}: a picture of no scene", folder.path().display());
        };
        let mut scene = inputs::open(folder, input, &self.spec.read)?.scene;
        render::set_film(&mut scene, picture);
        let pool = pool_of(options.threads)?;
        let mut renderer = pool.install(|| Renderer::new(&scene));
        render::set_lights(&mut renderer, picture)?;
        Ok(self.run_with(&renderer, folder, options)?)
    }

    /// The same by a renderer of its scene.
    pub(super) fn run_with(
        &self,
        renderer: &Renderer<'_>,
        folder: &Folder,
        options: &Run<'_>,
    ) -> Result<Ran, PlanError> {
        linelit_plan::run(folder, options, |task| {
            let work = self.work[task.number() as usize];
            self.compute(renderer, work).map_err(BoxError::from)
        })
    }

    /// The bytes of a unit's part.
    fn compute(&self, renderer: &Renderer<'_>, work: Work) -> Result<Vec<u8>> {
        let (picture, layers) = (&self.spec.picture, self.layers());
        let settings = &picture.settings();
        let tile = tile_of(work.tile);
        let (mut counts, mut workspace) = (Counts::default(), Workspace::new());
        let mut part = Part::default();
        if picture.camera_samples() <= 1.0 && !layers.moments {
            let mut row = vec![DVec3::ZERO; tile.width() as usize];
            for y in tile.y0..tile.y1 {
                renderer.row(settings, [tile.x0, y], &mut row, &mut workspace);
                part.sums.extend(row.iter().map(|value| value.to_array()));
            }
            counts += workspace.take_counts();
        } else {
            let blocks = work.block.map_or(0..picture.blocks(), |k| k..k + 1);
            for pixel in tile.pixels() {
                let blocks = blocks.clone();
                let found = aovs::samples(renderer, picture, pixel, blocks, &mut workspace);
                part.sums.push(found.sum.to_array());
                if layers.moments {
                    let Moments { count, mean, m2 } = found.moments;
                    let visibility = &found.counts.visibility;
                    let cost = [visibility.rays, visibility.line_queries];
                    part.spreads.push(Spread {
                        count,
                        mean,
                        m2,
                        cost,
                    });
                }
                counts += found.counts;
            }
        }
        if layers.surfaces && work.is_first() {
            let surface = |pixel| aovs::surface(renderer, pixel, &mut workspace);
            part.surfaces = tile.pixels().map(surface).collect();
        }
        part.counted = Value::from(render::counted(&counts)).to_string();
        Ok(engine::to_bytes(&part))
    }

    fn layers(&self) -> Layers {
        let aovs = &self.spec.picture.aovs;
        Layers {
            moments: aovs::wants_moments(aovs),
            surfaces: aovs::wants_surfaces(aovs),
        }
    }

    /// Puts the parts together, with what was counted.
    pub(super) fn gather(&self, folder: &Folder) -> Result<(Rendered, Map<String, Value>)> {
        let window = tile_of(self.spec.window);
        memory::check_picture(window, aovs::bytes_per_pixel(&self.spec.picture))?;
        let mut film = Film::new(self, window);
        let missing = folder.read_all(|number, payload| {
            let work = self.work[number as usize];
            film.add(work, &payload).map_err(|error| PlanError::Work {
                number,
                name: folder.plan().units[number as usize].name.clone(),
                error,
            })
        })?;
        units::check(folder, &missing)?;
        let counted = std::mem::take(&mut film.counted);
        Ok((film.finish(), counted))
    }

    /// Puts the parts together, and writes the image.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let Some(path) = &args.output else {
            let text = "merging a picture writes an image: -o IMAGE.exr or IMAGE.png";
            return Err(UsageError(text.to_owned()).into());
        };
        if !path.extension().is_some_and(|e| e == "exr" || e == "png") {
            let text = format!("{}: the name must end in .exr or .png", path.display());
            return Err(UsageError(text).into());
        }
        render::check_file(&args.file, path)?;
        aovs::check(&self.spec.picture, render::is_png(path))?;
        linelit_film::check_writable(path)?;
        let (rendered, counted) = self.gather(folder)?;
        let scene = &self.spec.scene;
        let result =
            (args.json).then(|| render::picture_json(scene, path, &rendered.image, counted));
        let to = (&**path, &args.file);
        pool_of(args.threads)?
            .install(|| render::write(rendered, to, scene, &self.spec.picture))?;
        if let Some(result) = result {
            writeln!(out, "{}", Value::from(result))?;
        }
        Ok(())
    }
}

impl Work {
    fn is_first(&self) -> bool {
        self.block.is_none_or(|k| k == 0)
    }
}

/// What a unit leaves.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Part {
    /// What was counted, as JSON.
    counted: String,
    /// The sum of the camera samples of each pixel.
    sums: Vec<[f64; 3]>,
    /// How they are spread, of each pixel, with `variance` or `samples`.
    spreads: Vec<Spread>,
    /// With `albedo`, `normal` or `depth`, what is seen in each pixel; of the first block alone.
    surfaces: Vec<Surface>,
}

/// Number, mean and M2 of some camera samples of a pixel, and their rays and lines.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Spread {
    count: u64,
    mean: [f64; 3],
    m2: [f64; 3],
    cost: [u64; 2],
}

/// Some camera samples of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    sum: DVec3,
    moments: Moments,
    cost: [u64; 2],
}

/// What parts hold beside the sums of pixels.
#[derive(Clone, Copy, Debug)]
struct Layers {
    moments: bool,
    surfaces: bool,
}

/// A picture in the making.
struct Film {
    window: Tile,
    placement: Option<Placement>,
    layers: Layers,
    /// Blocks of a tile's samples that are units of their own.
    last_block: u32,
    samples: f64,
    image: Image,
    moments: Vec<Moments>,
    cost: [Vec<u32>; 2],
    surfaces: Vec<Surface>,
    /// The pixels of the tile that is being read.
    tile: Vec<Pixel>,
    counted: Map<String, Value>,
}

impl Film {
    fn new(plan: &PicturePlan, window: Tile) -> Self {
        let layers = plan.layers();
        let all = |wanted: bool| if wanted { window.area() } else { 0 };
        let cost = || vec![0; all(layers.moments)];
        Self {
            window,
            placement: aovs::placement(window, plan.spec.film),
            layers,
            last_block: plan.work.iter().filter_map(|w| w.block).max().unwrap_or(0),
            samples: plan.spec.picture.camera_samples(),
            image: Image::new(window.width(), window.height()),
            moments: vec![Moments::default(); all(layers.moments)],
            cost: [cost(), cost()],
            surfaces: vec![Surface::default(); all(layers.surfaces)],
            tile: Vec::new(),
            counted: Map::new(),
        }
    }

    /// Adds a part; those of a tile come in the order of their blocks.
    fn add(&mut self, work: Work, payload: &[u8]) -> Result<(), BoxError> {
        let part: Part = engine::from_bytes(payload)?;
        self.read(work, part)
            .ok_or_else(|| BoxError::from("its part does not hold what one of a picture does"))
    }

    fn read(&mut self, work: Work, part: Part) -> Option<()> {
        let tile = tile_of(work.tile);
        let count = |there: bool| if there { tile.area() } else { 0 };
        let lengths = [part.sums.len(), part.spreads.len(), part.surfaces.len()];
        let surfaces = self.layers.surfaces && work.is_first();
        if lengths != [tile.area(), count(self.layers.moments), count(surfaces)] {
            return None;
        }
        add_counts(&mut self.counted, serde_json::from_str(&part.counted).ok()?);
        if work.is_first() {
            self.tile = vec![Pixel::default(); tile.area()];
        }
        if self.tile.len() != tile.area() {
            return None;
        }
        for (pixel, sum) in self.tile.iter_mut().zip(part.sums) {
            // Of a first one as it is: the sign of 0 counts.
            let sum = DVec3::from_array(sum);
            pixel.sum = if work.is_first() {
                sum
            } else {
                pixel.sum + sum
            };
        }
        for (pixel, found) in self.tile.iter_mut().zip(part.spreads) {
            let Spread {
                count,
                mean,
                m2,
                cost,
            } = found;
            // Into none, those of others are taken as they are.
            pixel.moments.merge(&Moments { count, mean, m2 });
            pixel.cost = [0, 1].map(|k| pixel.cost[k] + cost[k]);
        }
        for ([x, y], surface) in tile.pixels().zip(part.surfaces) {
            let place = self.place(x, y);
            self.surfaces[place] = surface;
        }
        if work.block.is_none_or(|block| block == self.last_block) {
            self.store(tile);
        }
        Some(())
    }

    fn place(&self, x: u32, y: u32) -> usize {
        let [column, row] = [x - self.window.x0, y - self.window.y0];
        row as usize * self.window.width() as usize + column as usize
    }

    /// What is known of a tile, now that all of it is.
    fn store(&mut self, tile: Tile) {
        for (i, [x, y]) in tile.pixels().enumerate() {
            let (place, pixel) = (self.place(x, y), self.tile[i]);
            self.image.rgb[place] = aovs::single(pixel.sum / self.samples);
            if self.layers.moments {
                self.moments[place] = pixel.moments;
                for (to, cost) in self.cost.iter_mut().zip(pixel.cost) {
                    to[place] = aovs::clamped(cost);
                }
            }
        }
    }

    fn finish(self) -> Rendered {
        let (width, height) = (self.window.width(), self.window.height());
        let film = MomentImage::from_pixels(width, height, self.moments);
        let film = film.filter(|_| self.layers.moments);
        Rendered {
            image: self.image,
            placement: self.placement,
            pixels: film.map(|film| (film, self.cost)),
            surfaces: self.surfaces,
        }
    }
}

/// Adds numbers of the same names.
fn add_counts(to: &mut Map<String, Value>, from: Map<String, Value>) {
    for (name, value) in from {
        let there = to.entry(name).or_insert(Value::Null);
        match (there, value) {
            (Value::Object(there), Value::Object(value)) => add_counts(there, value),
            (there, value) => match (there.as_u64(), value.as_u64()) {
                (Some(a), Some(b)) => *there = (a + b).into(),
                _ => *there = value,
            },
        }
    }
}
