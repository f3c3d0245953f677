//! `linelit info`: what is in a scene, and what the plan skips.

use super::pool;
use crate::args::InfoArgs;
use crate::output::{Output, OutputError};
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_film::Tile;
use linelit_formats::Loaded;
use linelit_integrator::{Renderer, Settings, Spheres};
use linelit_lights::Light;
use linelit_scene::{Mesh, Projection, Scene};
use linelit_study::scene_study;
use linelit_study::short_name;
use serde::Serialize;
use std::collections::BTreeMap;

/// Pairs of pixel and light that the look at the plan costs at most.
const MAX_PAIRS: usize = 1 << 16;

/// Contents of a scene.
#[derive(Debug, Serialize)]
struct Info {
    scene: String,
    triangles: usize,
    vertices: usize,
    meshes: usize,
    /// Meshes with holes.
    cutouts: usize,
    /// Zero, as `instances`: what a scene places many times is copied.
    objects: usize,
    instances: usize,
    /// The number of triangles again, as in `triangles`.
    triangles_in_world: usize,
    bounds: Option<[[f64; 3]; 2]>,
    geometry_bytes: usize,
    texture_bytes: usize,
    lights: BTreeMap<&'static str, LightGroup>,
    /// The lights that `--spheres exact` puts in the place of facets.
    exact_lights: BTreeMap<&'static str, LightGroup>,
    /// Number of materials and of triangles that have them, by model.
    materials: BTreeMap<&'static str, MaterialGroup>,
    camera: String,
    resolution: [u32; 2],
    plan: PlanInfo,
    warnings: Vec<String>,
}

/// Lights of one type.
#[derive(Debug, Default, Serialize)]
struct LightGroup {
    lights: usize,
    /// Area of the surfaces, m².
    area: f64,
    /// Length of the lines, m.
    length: f64,
    /// Emitted, W, averaged over the channels.
    power: f64,
}

impl LightGroup {
    fn describe(&self, kind: &str) -> String {
        let size = if kind == "linear" {
            format!("length {:.4} m", self.length)
        } else {
            format!("area {:.4} m²", self.area)
        };
        format!("{} {kind}, {size}, power {:.4} W", self.lights, self.power)
    }
}

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

/// Says what is in a scene.
pub fn run(args: &InfoArgs, out: &mut Output) -> Result<()> {
    let mut loaded = args.common.read.library().load(&args.scene)?;
    let resolution = [loaded.scene.film.width, loaded.scene.film.height];
    let looked = pool(&args.common)?.install(|| look(&mut loaded.scene));
    let info = describe(&loaded, &args.scene, resolution, looked);
    if args.common.json {
        writeln!(out, "{}", serde_json::to_string(&info)?)?;
    } else {
        print(&info, out)?;
    }
    Ok(())
}

/// Renders a few pixels to see what the plan does; and what is exact in place of facets.
fn look(scene: &mut Scene) -> (PlanInfo, BTreeMap<&'static str, LightGroup>) {
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
    let mut exact = BTreeMap::new();
    let lights = renderer.plan().lights_of(Spheres::Exact).iter();
    let round = lights.filter(|l| !matches!(*l.light, Light::Area(_) | Light::Linear(_)));
    round.for_each(|l| add_light(&mut exact, &l.light));
    let plan = PlanInfo {
        dark_lights: scene.lights.len() - renderer.plan().lights_of(Spheres::Facets).len(),
        pixels: [side, side],
        counts: counts.plan.rows().collect(),
    };
    (plan, exact)
}

fn describe(
    loaded: &Loaded,
    name: &str,
    resolution: [u32; 2],
    (plan, exact_lights): (PlanInfo, BTreeMap<&'static str, LightGroup>),
) -> Info {
    let scene = &loaded.scene;
    let mut lights: BTreeMap<&'static str, LightGroup> = BTreeMap::new();
    for light in &scene.lights {
        add_light(&mut lights, &light.light);
    }
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
        objects: 0,
        instances: 0,
        triangles_in_world: scene.triangles.len(),
        bounds: scene
            .bounds()
            .map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
        geometry_bytes: scene.memory(),
        texture_bytes: scene.texture_memory(),
        lights,
        exact_lights,
        materials,
        camera: camera(scene.camera.projection()),
        resolution,
        plan,
        warnings: loaded
            .warnings
            .iter()
            .map(|w| w.message().to_owned())
            .collect(),
    }
}

fn camera(projection: Projection) -> String {
    match projection {
        Projection::Perspective { fov_degrees } => {
            format!("perspective, {fov_degrees:.4} degrees over the shorter side")
        }
        Projection::Orthographic => "orthographic".to_owned(),
        Projection::Spherical { .. } => "spherical".to_owned(),
    }
}

fn add_light(groups: &mut BTreeMap<&'static str, LightGroup>, light: &Light) {
    let (name, area, length) = match light {
        Light::Area(a) => {
            let name = match a.polygon.vertices().len() {
                3 => "triangle",
                4 => "quad",
                _ => "polygon",
            };
            (name, a.polygon.area(), 0.0)
        }
        Light::Linear(l) => ("linear", 0.0, l.segment.length()),
        Light::Sphere(s) => ("sphere", s.sphere.area(), 0.0),
        Light::Disk(d) => ("disk", d.disk.area(), 0.0),
        Light::Cylinder(c) => ("cylinder", c.cylinder.area(), 0.0),
        Light::Point(_) => ("point", 0.0, 0.0),
        Light::Distant(_) => ("distant", 0.0, 0.0),
        Light::Sky(_) => ("sky", 0.0, 0.0),
    };
    let group = groups.entry(name).or_default();
    group.lights += 1;
    group.area += area;
    group.length += length;
    group.power += light.power();
}

fn print(info: &Info, out: &mut Output) -> Result<(), OutputError> {
    let mut row = |key: &str, value: String| writeln!(out, "{key:>20}  {value}");
    row("scene", info.scene.clone())?;
    row(
        "triangles",
        format!("{} in {} meshes", info.triangles, info.meshes),
    )?;
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
    for (kind, group) in &info.lights {
        row("lights", group.describe(kind))?;
    }
    if info.lights.is_empty() {
        row("lights", "none".into())?;
    }
    for (kind, group) in &info.exact_lights {
        row("with --spheres exact", group.describe(kind))?;
    }
    for (kind, group) in &info.materials {
        let text = format!(
            "{} {kind}, on {} triangles",
            group.materials, group.triangles
        );
        row("materials", text)?;
    }
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
    row(
        "warnings",
        match info.warnings.len() {
            0 => "none".into(),
            n => format!("{n}, printed above"),
        },
    )
}

fn mebibytes(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1u32 << 20)
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("({x:.4}, {y:.4}, {z:.4})")
}
