//! `linelit info`: prints the contents of a scene, and what the plan skips.

use super::image::numbers;
use super::threads::pool;
use crate::args::InfoArgs;
use crate::output::{Output, OutputError};
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_film::Tile;
use linelit_formats::Loaded;
use linelit_integrator::{Renderer, Settings, Spheres};
use linelit_lights::Light;
use linelit_scene::{LUMINANCE, Mesh, Projection, SceneDescription};
use linelit_study::scene_study;
use linelit_study::short_name;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// The largest number of pairs of a pixel and a light in the coarse picture by which `info` counts
/// what the plan skips. Scenes with many lights get a smaller picture.
const MAX_PAIRS: usize = 1 << 16;

/// The contents of a scene.
#[derive(Debug, Serialize)]
struct Info {
    scene: String,
    triangles: usize,
    vertices: usize,
    meshes: usize,
    /// The number of meshes with holes.
    cutouts: usize,
    /// The number of objects that the file instantiates, and of their instances. The triangles of
    /// each instance are copied.
    objects: usize,
    instances: usize,
    /// The same as `triangles`.
    triangles_in_world: usize,
    bounds: Option<[[f64; 3]; 2]>,
    geometry_bytes: usize,
    texture_bytes: usize,
    /// The lights by kind, with round lights as they are sampled: as spheres, disks and cylinders.
    lights: BTreeMap<&'static str, LightGroup>,
    /// The same as `lights`, which listed facets in earlier versions.
    exact_lights: BTreeMap<&'static str, LightGroup>,
    /// The lights by kind with `--spheres facets`.
    facet_lights: BTreeMap<&'static str, LightGroup>,
    /// The lights of the file, in the order of the file.
    light_rows: Vec<LightRow>,
    /// The number of materials, and of triangles that have them, by model.
    materials: BTreeMap<&'static str, MaterialGroup>,
    camera: String,
    resolution: [u32; 2],
    plan: PlanInfo,
    warnings: Vec<String>,
}

/// A light of the file: a shape that emits, or a light without a shape.
#[derive(Debug, Serialize)]
struct LightRow {
    /// The first and last of the numbers by which `--light-estimator` and `--light-apart` refer to
    /// it.
    numbers: [u32; 2],
    /// The same numbers with `--spheres facets`.
    facets: [u32; 2],
    kind: &'static str,
    #[serde(flatten)]
    sum: LightGroup,
    /// The number of lights of this row that emit no light and are not sampled.
    dark: usize,
}

/// The number of lights of one kind, and the sums of their areas, lengths and powers.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct LightGroup {
    lights: usize,
    /// The area of the surfaces, in m².
    area: f64,
    /// The length of the lines, in m.
    length: f64,
    /// The emitted power, in W, averaged over the channels.
    power: f64,
    /// The luminance of the power by channel, in W.
    power_luminance: f64,
}

impl LightGroup {
    /// Returns the group of one light.
    fn of(light: &Light) -> Self {
        let length = match light {
            Light::Linear(l) => l.segment.length(),
            _ => 0.0,
        };
        Self {
            lights: 1,
            area: light.area(),
            length,
            power: light.power(),
            power_luminance: light.power_by_channel().dot(LUMINANCE),
        }
    }

    /// Describes the group in words.
    fn describe(&self, kind: &str) -> String {
        let size = match kind {
            "linear" => format!(", length {:.4} m", self.length),
            "point" | "distant" | "sky" => String::new(),
            _ => format!(", area {:.4} m²", self.area),
        };
        let count = match self.lights {
            1 => String::new(),
            n => format!("{n} × "),
        };
        let [power, luminance] = [self.power, self.power_luminance].map(watts);
        format!("{count}{kind}{size}, power {power} W (mean of RGB; luminance {luminance} W)")
    }
}

impl AddAssign for LightGroup {
    fn add_assign(&mut self, other: Self) {
        self.lights += other.lights;
        self.area += other.area;
        self.length += other.length;
        self.power += other.power;
        self.power_luminance += other.power_luminance;
    }
}

impl LightRow {
    /// Returns the indices of the light as text, and its description.
    fn describe(&self) -> [String; 2] {
        let range = |[first, last]: [u32; 2]| match first == last {
            true => format!("light {first}"),
            false => format!("lights {first} to {last}"),
        };
        let mut text = self.sum.describe(self.kind);
        match self.dark {
            0 => {}
            n if n == self.sum.lights => text += "; emits nothing",
            n => text += &format!("; {n} of them emit nothing"),
        }
        if self.facets != self.numbers {
            text += &format!("; {} with --spheres facets", range(self.facets));
        }
        [range(self.numbers), text]
    }
}

/// The number of materials of one model, and of the triangles that have them.
#[derive(Debug, Default, Serialize)]
struct MaterialGroup {
    materials: usize,
    triangles: usize,
}

/// Counts of skipped work: for the whole scene, and at the points that a coarse picture sees.
#[derive(Debug, Serialize)]
struct PlanInfo {
    dark_lights: usize,
    pixels: [u32; 2],
    counts: BTreeMap<&'static str, u64>,
}

/// The size of the coarse picture, and what its plan counted.
type Look = ([u32; 2], BTreeMap<&'static str, u64>);

/// Prints the contents of a scene.
pub fn run(args: &InfoArgs, out: &mut Output) -> Result<()> {
    let mut loaded = args.common.read.library().load(&args.scene)?;
    let resolution = [loaded.scene.film.width, loaded.scene.film.height];
    let look = pool(&args.common)?.install(|| look(&mut loaded.scene));
    let info = describe(&loaded, &args.scene, resolution, look);
    if args.common.json {
        writeln!(out, "{}", serde_json::to_string(&info)?)?;
    } else {
        print(&info, out)?;
    }
    Ok(())
}

/// Renders a coarse picture to count what the plan does.
fn look(scene: &mut SceneDescription) -> Look {
    let side = (MAX_PAIRS / scene.lights.len().max(1)).isqrt().clamp(1, 64);
    let side = u32::try_from(side).unwrap_or(1);
    scene.set_resolution(side, side);
    let renderer = Renderer::new(scene);
    let settings = Settings {
        samples: 1,
        ..Settings::default()
    };
    let window = Tile::whole(side, side);
    let (_, counts) = scene_study::render(&renderer, &settings, window, &ProgressBar::hidden());
    ([side, side], counts.plan.rows().collect())
}

/// Returns the lights of the file, in the order of the file. The facets of a shape that is sampled
/// as a whole are one light, and all polygons of one shape share a row.
fn light_rows(scene: &SceneDescription) -> Vec<LightRow> {
    let mut rows: Vec<LightRow> = Vec::new();
    let mut mesh_before = None;
    for number in numbers(scene, Spheres::Exact) {
        let light = &scene.lights[number as usize];
        // Take a round shape for its facets, and find the mesh of the light.
        let whole = scene.whole_of(number);
        let shown = whole.map_or(&*light.light, |round| &round.light);
        let mesh = match light.triangles.is_empty() {
            true => None,
            false => Some(scene.mesh_of(light.triangles.start)),
        };
        let (kind, sum) = (kind(shown), LightGroup::of(shown));
        let dark = usize::from(!(sum.power > 0.0));
        // Add a facet to the row of its mesh, or begin a row.
        match rows
            .last_mut()
            .filter(|_| mesh.is_some() && mesh == mesh_before)
        {
            Some(row) => {
                (row.numbers[1], row.facets[1]) = (number, number);
                row.sum += sum;
                row.dark += dark;
                if row.kind != kind {
                    row.kind = "polygon";
                }
            }
            None => rows.push(LightRow {
                numbers: [number; 2],
                facets: whole.map_or([number; 2], |r| [r.lights.start, r.lights.end - 1]),
                kind,
                sum,
                dark,
            }),
        }
        mesh_before = mesh;
    }
    rows
}

/// Returns the sums over lights by kind.
fn by_kind<'a>(lights: impl IntoIterator<Item = &'a Light>) -> BTreeMap<&'static str, LightGroup> {
    let mut groups: BTreeMap<_, LightGroup> = BTreeMap::new();
    for light in lights {
        *groups.entry(kind(light)).or_default() += LightGroup::of(light);
    }
    groups
}

/// Collects the contents of a scene.
fn describe(loaded: &Loaded, name: &str, resolution: [u32; 2], look: Look) -> Info {
    let (pixels, counts) = look;
    let scene = &loaded.scene;
    // The lights as they are sampled, and as they are with facets.
    let sampled = numbers(scene, Spheres::Exact).map(|number| {
        let facet = &*scene.lights[number as usize].light;
        scene.whole_of(number).map_or(facet, |round| &round.light)
    });
    let lights = by_kind(sampled);
    let facet_lights = by_kind(scene.lights.iter().map(|light| &*light.light));
    let light_rows = light_rows(scene);
    let dark_lights = light_rows.iter().map(|row| row.dark).sum();
    // Materials, and the triangles that have them.
    let mut materials: BTreeMap<&'static str, MaterialGroup> = BTreeMap::new();
    for material in &scene.materials {
        materials.entry(material.kind.name()).or_default().materials += 1;
    }
    for mesh in &scene.meshes {
        let kind = scene.materials[mesh.material as usize].kind.name();
        materials.entry(kind).or_default().triangles += mesh.triangles.len();
    }
    let holed = |mesh: &&Mesh| mesh.cutout.is_some();
    Info {
        scene: short_name(name),
        triangles: scene.triangles.len(),
        vertices: scene.positions.len(),
        meshes: scene.meshes.len(),
        cutouts: scene.meshes.iter().filter(holed).count(),
        objects: scene.placed.objects,
        instances: scene.placed.instances,
        triangles_in_world: scene.triangles.len(),
        bounds: scene
            .bounds()
            .map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
        geometry_bytes: scene.memory(),
        texture_bytes: scene.texture_memory(),
        exact_lights: lights.clone(),
        lights,
        facet_lights,
        light_rows,
        materials,
        camera: camera(scene.camera.projection()),
        resolution,
        plan: PlanInfo {
            dark_lights,
            pixels,
            counts,
        },
        warnings: loaded
            .warnings
            .iter()
            .map(|w| w.message().to_owned())
            .collect(),
    }
}

/// Describes the camera.
fn camera(projection: Projection) -> String {
    match projection {
        Projection::Perspective { fov_degrees } => {
            format!("perspective, {fov_degrees:.4} degrees over the shorter side")
        }
        Projection::Orthographic => "orthographic".to_owned(),
        Projection::Spherical { .. } => "spherical".to_owned(),
    }
}

/// Returns the name of a light's kind.
fn kind(light: &Light) -> &'static str {
    match light {
        Light::Area(a) => match a.polygon.vertices().len() {
            3 => "triangle",
            4 => "quad",
            _ => "polygon",
        },
        Light::Linear(_) => "linear",
        other => other.name(),
    }
}

/// Prints the contents of a scene for people.
fn print(info: &Info, out: &mut Output) -> Result<(), OutputError> {
    let mut row = |key: &str, value: String| writeln!(out, "{key:>20}  {value}");
    // What the scene is made of.
    row("scene", info.scene.clone())?;
    row(
        "triangles",
        format!("{} in {} meshes", info.triangles, info.meshes),
    )?;
    if info.instances > 0 {
        let text = format!("{} copies of {} objects", info.instances, info.objects);
        row("placed", text)?;
    }
    if info.cutouts > 0 {
        row("with holes", format!("{} meshes", info.cutouts))?;
    }
    row("vertices", info.vertices.to_string())?;
    if let Some([lo, hi]) = info.bounds {
        row("bounds", format!("{} to {}", triple(lo), triple(hi)))?;
    }
    row(
        "memory",
        format!(
            "{:.1} MiB of geometry, {:.1} MiB of textures",
            mebibytes(info.geometry_bytes),
            mebibytes(info.texture_bytes)
        ),
    )?;
    row("camera", info.camera.clone())?;
    let [width, height] = info.resolution;
    row("film", format!("{width} x {height} pixels"))?;
    // Its lights and materials.
    for [numbers, text] in light_lines(info) {
        row(&numbers, text)?;
    }
    for (kind, group) in &info.materials {
        let text = format!(
            "{} {kind}, on {} triangles",
            group.materials, group.triangles
        );
        row("materials", text)?;
    }
    // What a quick look at it skips, and what the reader warned of.
    print_plan(info, &mut row)?;
    row(
        "warnings",
        match info.warnings.len() {
            0 => "none".into(),
            n => format!("{n}, printed above"),
        },
    )
}

/// Prints the counts of a quick look at the scene, and what its plan skips.
fn print_plan(
    info: &Info,
    mut row: impl FnMut(&str, String) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let [width, height] = info.plan.pixels;
    row("looked at", format!("through {width} x {height} pixels:"))?;
    let is_total = |what: &str| what == "shading points" || what == "(point, light) pairs";
    let counted = info.plan.counts.iter().filter(|(_, n)| **n > 0);
    let (totals, skipped): (Vec<_>, Vec<_>) = counted.partition(|(what, _)| is_total(what));
    let line = |(what, count): (&&str, &u64)| (count.to_string(), (*what).to_owned());
    let dark = format!("{} lights that emit nothing, and:", info.plan.dark_lights);
    let dark = ("the plan skips".to_owned(), dark);
    let rows = totals.into_iter().map(line).chain([dark]);
    for (name, text) in rows.chain(skipped.into_iter().map(line)) {
        row(&name, text)?;
    }
    Ok(())
}

/// The number of rows of lights that are printed at most.
const MOST_ROWS: usize = 100;

/// Returns the lines about the lights: their number, and a line for each row.
fn light_lines(info: &Info) -> Vec<[String; 2]> {
    let count: usize = info.lights.values().map(|group| group.lights).sum();
    let head = match count {
        0 => "none".to_owned(),
        n => format!("{n}, by the numbers of --light-estimator and --light-apart:"),
    };
    let mut lines = vec![["lights".to_owned(), head]];
    let rows = info.light_rows.iter();
    lines.extend(rows.take(MOST_ROWS).map(LightRow::describe));
    if let Some(more @ 1..) = info.light_rows.len().checked_sub(MOST_ROWS) {
        lines.push([String::new(), format!("and {more} more: --json has all")]);
    }
    lines
}

/// Formats a power with four decimals, or as a power of ten where these would say little.
fn watts(power: f64) -> String {
    match power != 0.0 && !(1e-2..1e9).contains(&power) {
        true => format!("{power:.4e}"),
        false => format!("{power:.4}"),
    }
}

/// Converts bytes to MiB.
fn mebibytes(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1u32 << 20)
}

/// Formats a point.
fn triple([x, y, z]: [f64; 3]) -> String {
    format!("({x:.4}, {y:.4}, {z:.4})")
}
