//! One line for each scene, estimator and sampler: a hash of the bits of its pixels.
//!
//! `cargo xtask pixels > before`, change the program, `cargo xtask pixels | diff before -`: a
//! change that claims to leave all values as they are prints the same lines. The list compares two
//! programs on one machine; it is kept nowhere, since lobes and angles call the C library's
//! functions, whose last bit differs from one to another. Words after `pixels` keep the lines that
//! hold all of them, and only those are computed.

#![allow(clippy::print_stdout, reason = "a command-line tool talks to its user")]

use linelit_formats::LoadOptions;
use linelit_integrator::{LightChoice, Renderer, Settings, Spheres, Workspace};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::rooms::{CLUTTER, MATTE, PHONG, SQUARE, THROUGH_THE_FLOOR, TRIANGLE};
use std::path::Path;

/// Pixels across and down, spread evenly over each picture.
const GRID: [u32; 2] = [24, 16];

/// Samples for each shading point and light: no power of two, so that shares round.
const SAMPLES: u32 = 5;

const ESTIMATORS: [&str; 55] = [
    "point-area",
    "point-visible-area",
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-bsdf",
    "point-area[visibility=shaft]",
    "point-solid-angle[visibility=shaft]",
    "point-linear",
    "point-linear[technique=area]",
    "point-linear[technique=solid-angle]",
    "point-linear[technique=clipped-solid-angle]",
    "point-linear[technique=linear-cosine]",
    "point-linear[technique=quadratic-cosine]",
    "point-linear[technique=newton-bisection]",
    "point-linear[technique=ltc]",
    "point-linear[technique=ltc,mis=balance]",
    "point-linear[technique=ltc,mis=weighted-balance]",
    "point-linear[technique=ltc,mis=optimal,nu=0.25]",
    "line-area",
    "line-area[orientation=fixed:0.25]",
    "line-area[orientation=uniform]",
    "line-area[offset=uniform]",
    "line-analytic",
    "line-analytic[orientation=fixed:0.25,offset=uniform]",
    "line-analytic[orientation=uniform]",
    "exact",
    "exact[limit=16]",
    "hybrid",
    "point-area[mis=balance]",
    "point-texture",
    "point-texture:3+line-solid-angle[orientation=fixed:0]",
    "line-area[mis=balance]",
    "line-area[pieces=one]",
    "line-area[pieces=one,points=4]",
    "line-solid-angle",
    "line-warped[orientation=fixed:0]",
    "line-projected",
    "line-projected[orientation=spread:3,pieces=one]",
    "line-texture",
    "line-texture[orientation=fixed:0.2]",
    "line-texture[orientation=spread:2]+point-texture",
    "line-solid-angle:3+point-bsdf",
    "line-solid-angle+point-bsdf[mis=smooth]",
    "line-solid-angle[pieces=one]+point-bsdf[mis=smooth-fixed]",
    "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=average]",
    "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=smooth]",
    "line-solid-angle+point-bsdf[mis=optimal]",
    "line-warped:2+point-area+point-bsdf[mis=clamped-optimal]",
    "line-area+point-area[mis=maximum]",
    "point-solid-angle+point-bsdf[mis=power]",
    "line-projected+line-area+point-solid-angle+point-bsdf",
    "line-analytic[mis=balance]",
    "line-analytic+point-bsdf",
    "line-analytic[orientation=fixed:0.1]+point-bsdf:3",
    "hybrid+point-bsdf",
];

/// Estimators that stand for all where something other than the estimator varies.
const SOME: [&str; 8] = [
    "point-area",
    "point-projected-solid-angle",
    "point-bsdf",
    "line-area",
    "line-analytic",
    "exact",
    "hybrid",
    "line-solid-angle+point-bsdf",
];

/// Floors, lights and occluders of scenes that no file holds.
const ROOMS: [(&str, &str, &str); 6] = [
    ("phong-room", PHONG, SQUARE),
    ("microfacet-room", METAL, TRIANGLE),
    ("mixed-room", MIXED, THROUGH_THE_FLOOR),
    ("two-lights-room", MATTE, TWO_LIGHTS),
    ("sphere-room", PHONG, SPHERE),
    ("line-room", MIXED, LINE),
];

const METAL: &str = r#"Material "metal" "float uroughness" .15 "float vroughness" .5 "bool remaproughness" "false""#;
const MIXED: &str = r#"
MakeNamedMaterial "a" "string type" "phong" "rgb Kd" [ .2 .1 .3 ] "rgb Ks" [ .5 .6 .7 ] "float exponent" 40.5
MakeNamedMaterial "b" "string type" "uber" "rgb Kd" [ .2 .2 .2 ] "rgb Ks" [ .5 .5 .5 ] "rgb opacity" [ .5 .7 .9 ] "float roughness" .1
Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b""#;
const TWO_LIGHTS: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ -0.8 -0.5 2  0.1 0.9 1.6  0.7 -0.4 2.2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -1.5 -1 -0.5  -1.5 1 -0.5  -1.5 1 1.5  -1.5 -1 1.5 ]
Shape "disk" "float radius" .4 "float height" 1.8
Shape "line" "point3 p0" [ -0.7 -0.3 1.2 ] "point3 p1" [ 0.8 0.4 1.5 ]"#;
const SPHERE: &str = "Translate 0.2 -0.4 1.5\nShape \"sphere\" \"float radius\" [ 0.4 ]";
const LINE: &str = r#"Shape "line" "point3 p0" [ -0.9 0.2 -0.4 ] "point3 p1" [ 0.7 -0.1 1.1 ]"#;

fn room((_, floor, light): &(&str, &str, &str)) -> String {
    format!(
        r#"
LookAt 0 -0.5 5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ]
Film "image" "integer xresolution" [ 96 ] "integer yresolution" [ 96 ]
WorldBegin
{floor}
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ]
    "normal N" [ -.1 0 1  .1 0 1  .1 .1 1  0 0 1 ]
{CLUTTER}
AttributeBegin
Translate 0.5 0.9 0.5
Material "glass"
Shape "sphere" "float radius" [ 0.3 ]
AttributeEnd
AttributeBegin
Material "matte" "rgb Kd" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
{light}
AttributeEnd
WorldEnd
"#
    )
}

/// What of the settings differs from the defaults.
type Variant = (&'static str, fn(&mut Settings));

const VARIANTS: [Variant; 12] = [
    ("no-skip", |s| s.skip = false),
    ("separate-rays", |s| s.share = false),
    ("jittered", |s| s.pixel_samples = 3),
    ("bounces", |s| s.bounces = 3),
    ("one:uniform", |s| s.lights = LightChoice::Uniform),
    ("one:power", |s| s.lights = LightChoice::Power),
    ("one:estimate", |s| s.lights = LightChoice::Estimate),
    ("one:exact", |s| s.lights = LightChoice::Exact),
    ("tree", |s| s.lights = LightChoice::Tree),
    ("spheres", |s| s.spheres = Spheres::Exact),
    ("one-sample", |s| s.samples = 1),
    ("32-samples", |s| s.samples = 32),
];

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn main() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()?;
    files.sort();
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if let Some(name) = name.strip_suffix(".pbrt")
            && !name.ends_with(".geometry")
        {
            let scene = linelit_formats::load(&path, &LoadOptions::default())?.scene;
            print(name, &scene, &words)?;
        }
    }
    for shown in &ROOMS {
        let scene =
            linelit_formats::from_pbrt_str(&room(shown), shown.0, &LoadOptions::default())?.scene;
        print(shown.0, &scene, &words)?;
    }
    Ok(())
}

/// The lines of one scene that hold all words.
fn print(name: &str, scene: &SceneDescription, words: &[String]) -> Outcome {
    let renderer = Renderer::new(scene);
    let mut workspace = Workspace::new();
    let mut one = |estimator: &str, sampler, (variant, change): Variant| -> Outcome {
        let row = format!("{name} {variant} {estimator} {sampler}");
        if !words.iter().all(|word| row.contains(word.as_str())) {
            return Ok(());
        }
        let mut settings = Settings {
            estimator: estimator.parse()?,
            sampler,
            samples: SAMPLES,
            spheres: Spheres::Facets,
            seed: 3,
            ..Settings::default()
        };
        change(&mut settings);
        let hash = hash(&renderer, &settings, &mut workspace);
        println!("{row} {hash:016x}");
        Ok(())
    };
    let plain: Variant = ("plain", |_| ());
    for estimator in ESTIMATORS {
        one(estimator, SamplerKind::Stratified, plain)?;
    }
    for estimator in SOME {
        for sampler in SamplerKind::ALL {
            if sampler != SamplerKind::Stratified {
                one(estimator, sampler, plain)?;
            }
        }
        for variant in VARIANTS {
            one(estimator, SamplerKind::Sobol, variant)?;
        }
    }
    Ok(())
}

/// FNV-1a over the bits of the pixels.
fn hash(renderer: &Renderer<'_>, settings: &Settings, workspace: &mut Workspace) -> u64 {
    let film = &renderer.scene().film;
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for j in 0..GRID[1] {
        for i in 0..GRID[0] {
            let pixel = [film.width * i / GRID[0], film.height * j / GRID[1]];
            let value = renderer.pixel(settings, pixel, workspace);
            for byte in value
                .to_array()
                .map(f64::to_bits)
                .map(u64::to_le_bytes)
                .as_flattened()
            {
                hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    hash
}
