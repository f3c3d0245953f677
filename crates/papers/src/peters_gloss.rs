//! Peters 2021, Figs. 1 and 7: gloss under linear lights, and how the random numbers are placed.

use crate::picture_study::{
    Context, PictureStudy, Row, blurred_rmse, exposed, render_with, rmse, section, table,
};
use anyhow::Result;
use linelit_bsdf::{Bsdf, Frostbite, Layers, Lobe, Reflection};
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint};
use linelit_samplers::SamplerKind;

/// Pixels of the pictures.
const SIZE: [u32; 2] = [320, 200];
/// Samples of each technique in the reference.
const MANY: u32 = 96;
/// Roughness of the puddle in Fig. 1.
const WET: f64 = 0.22;

/// Gives all surfaces Frostbite's material with their diffuse colour, and those `wet` says a low
/// roughness.
fn frostbite(point: &mut ShadingPoint, wet: impl Fn(&ShadingPoint) -> bool) {
    let n = point.normal;
    let colour = point.bsdf.eval(n, point.outgoing, n) * std::f64::consts::PI;
    let roughness = if wet(point) { WET } else { 0.6 };
    let mut layers = Layers::new(DVec3::ZERO);
    let material = Frostbite::new(colour, DVec3::splat(0.04), roughness);
    let fits = layers.add(DVec3::ONE, Lobe::Frostbite(material));
    debug_assert!(fits, "one lobe fits");
    point.bsdf = Bsdf::from(layers);
}

/// A floor that is wet in puddles.
fn puddle(point: &ShadingPoint) -> bool {
    let p = point.position;
    let wave = (1.7 * p.x).sin() + (2.3 * p.z + 0.8 * p.x).cos();
    point.normal.y > 0.99 && p.y < 0.1 && wave > -0.6
}

fn settings(estimator: &str, sampler: SamplerKind, samples: u32, seed: u64) -> Result<Settings> {
    Ok(Settings {
        estimator: estimator.parse()?,
        sampler,
        samples,
        seed,
        show_lights: false,
        ..Settings::default()
    })
}

/// The pictures of Fig. 1: caption, estimator, samples.
const VARIANTS: [(&str, &str, u32); 8] = [
    ("clipped solid angle, 1 sample", CLIPPED, 1),
    ("projected solid angle, 1 sample", "point-linear", 1),
    ("clipped solid angle, 2 samples", CLIPPED, 2),
    ("projected solid angle, 2 samples", "point-linear", 2),
    ("projected + LTC, balance", BALANCE, 1),
    ("projected + LTC, weighted balance", WEIGHTED, 1),
    ("projected + LTC, optimal", OPTIMAL, 1),
    ("projected + LTC, clamped optimal", LTC, 1),
];

const CLIPPED: &str = "point-linear[technique=clipped-solid-angle]";
const LTC: &str = "point-linear[technique=ltc]";
const BALANCE: &str = "point-linear[technique=ltc,mis=balance]";
const WEIGHTED: &str = "point-linear[technique=ltc,mis=weighted-balance]";
const OPTIMAL: &str = "point-linear[technique=ltc,mis=optimal]";

/// Fig. 1: clipped solid angle, projected solid angle, and projected solid angle with LTC by
/// clamped optimal MIS; one sample each.
pub(super) fn figure_1(context: &Context<'_>) -> Result<PictureStudy> {
    let mut scene = context.library.load("colonnade-line")?.scene;
    let size = context.size(SIZE);
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let render = |s: &Settings| {
        render_with(&renderer, s, size, context.progress, |p| {
            frostbite(p, puddle)
        })
    };
    let reference = render(&settings(LTC, SamplerKind::UniformJitter, MANY, 99)?);
    let mut pictures = Vec::new();
    let mut rows = Vec::new();
    for (what, estimator, samples) in VARIANTS {
        let image = render(&settings(
            estimator,
            SamplerKind::BlueNoise,
            samples,
            context.seed,
        )?);
        let error = rmse(&image, &reference);
        let caption = format!("{what}: RMSE {error:.4}");
        pictures.push(exposed(&image, &reference, &caption)?);
        rows.push(Row::new(what, &[("RMSE", error)]));
    }
    let caption = format!("reference: projected + LTC, {MANY} samples of each");
    pictures.push(exposed(&reference, &reference, &caption)?);
    let lead = "A long linear light in the colonnade; all materials are Frostbite's, with puddles of low \
                roughness on the floor. Sampling by projected solid angle is clean on what is diffuse and \
                misses the highlights; a second sample by an LTC finds them.";
    let tables = vec![table(
        "One or two rays a pixel, blue noise.",
        &["RMSE"],
        &rows,
    )];
    Ok(PictureStudy {
        title: "Linear lights, gloss: Peters 2021, Fig. 1".to_owned(),
        summary: vec![lead.to_owned()],
        sections: vec![section("Fig. 1", lead, pictures, tables)],
        rows,
    })
}

/// Fig. 7: white and blue noise, independent and jittered uniformly, three samples of each
/// technique.
pub(super) fn figure_7(context: &Context<'_>) -> Result<PictureStudy> {
    let size = context.size([224; 2]);
    let mut scene = context.library.load("cornell-box-line")?.scene;
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let render = |s: &Settings| {
        render_with(&renderer, s, size, context.progress, |p| {
            frostbite(p, |q| q.normal.y > 0.99)
        })
    };
    let reference = render(&settings(LTC, SamplerKind::UniformJitter, MANY, 99)?);
    let patterns = [
        ("(a) independent, white", SamplerKind::Independent),
        ("(b) independent, blue", SamplerKind::BlueNoiseIndependent),
        ("uniform jittered, white", SamplerKind::UniformJitter),
        ("(c) uniform jittered, blue", SamplerKind::BlueNoise),
    ];
    let (mut pictures, mut rows) = (Vec::new(), Vec::new());
    for (what, sampler) in patterns {
        let trials: Vec<Image> = (0..4)
            .map(|k| Ok(render(&settings(LTC, sampler, 3, context.seed + k)?)))
            .collect::<Result<_>>()?;
        let mean = |f: &dyn Fn(&Image) -> f64| {
            (trials.iter().map(|i| f(i).powi(2)).sum::<f64>() / trials.len() as f64).sqrt()
        };
        let (error, blurred) = (
            mean(&|i| rmse(i, &reference)),
            mean(&|i| blurred_rmse(i, &reference, 1.5)),
        );
        let caption = format!("{what}: RMSE {error:.4}, blurred {blurred:.5}");
        pictures.push(exposed(&trials[0], &reference, &caption)?);
        rows.push(Row::new(
            what,
            &[("RMSE", error), ("RMSE, blurred", blurred)],
        ));
    }
    let caption = format!("(d) reference: {MANY} samples of each technique");
    pictures.push(exposed(&reference, &reference, &caption)?);
    let lead = "Six samples a pixel, three diffuse and three by the LTC, clamped optimal MIS. Uniform \
                jitter takes variance from penumbrae; blue noise moves what is left to high frequencies, \
                which shows in the error that survives a blur of 1.5 pixels.";
    let tables = vec![table(
        "Errors over four seeds.",
        &["RMSE", "RMSE, blurred"],
        &rows,
    )];
    Ok(PictureStudy {
        title: "Linear lights, stratification: Peters 2021, Fig. 7".to_owned(),
        summary: vec![lead.to_owned()],
        sections: vec![section("Fig. 7", lead, pictures, tables)],
        rows,
    })
}
