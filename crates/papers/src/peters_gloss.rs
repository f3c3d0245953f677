//! Peters 2021, Figs. 1 and 7: gloss under linear lights, and how the random numbers are placed.

use crate::measured::Measured;
use crate::picture_study::{
    Context, PictureStudy, Row, blurred_rmse, exposed, render_with, rmse, section, table,
};
use anyhow::Result;
use linelit_bsdf::{Bsdf, Frostbite, Layers, Lobe, Reflection};
use linelit_elementary::{cos, sin};
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_lights::linear::{LinearSampler, LinearTechnique};
use linelit_lights::{Light, LinearPointTechnique};
use linelit_samplers::SamplerKind;
use linelit_study::engine::{Cell, run_cell};
use linelit_study::scene_study::{self, Targets, all_pixels};

/// Pixels of the pictures.
const SIZE: [u32; 2] = [320, 200];
/// Samples of each technique in the reference of Fig. 7.
const MANY: u32 = 96;
/// Seeds over which the errors of Fig. 1 are taken.
const TRIALS: u64 = 6;
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
    let wave = sin(1.7 * p.x) + cos(2.3 * p.z + 0.8 * p.x);
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
const VARIANTS: [(&str, &str, u32); 9] = [
    ("clipped solid angle, 1 sample", CLIPPED, 1),
    ("projected solid angle, 1 sample", "point-linear", 1),
    ("clipped solid angle, 2 samples", CLIPPED, 2),
    ("projected solid angle, 2 samples", "point-linear", 2),
    ("clipped + LTC, balance", CLIPPED_LTC, 1),
    ("projected + LTC, balance", BALANCE, 1),
    ("projected + LTC, weighted balance", WEIGHTED, 1),
    ("projected + LTC, optimal", OPTIMAL, 1),
    ("projected + LTC, clamped optimal", LTC, 1),
];

const CLIPPED: &str = "point-linear[technique=clipped-solid-angle]";
const CLIPPED_LTC: &str = "point-linear[technique=ltc,mis=balance,with=clipped-solid-angle]";
const LTC: &str = "point-linear[technique=ltc]";
const BALANCE: &str = "point-linear[technique=ltc,mis=balance]";
const WEIGHTED: &str = "point-linear[technique=ltc,mis=weighted-balance]";
const OPTIMAL: &str = "point-linear[technique=ltc,mis=optimal]";

/// One variant of Fig. 1: squared errors of its trials on puddles and elsewhere, and its time.
#[derive(Clone, Debug)]
pub(crate) struct Variant {
    /// Caption of the picture.
    pub what: &'static str,
    /// Mean squared errors over all pixels, over puddles and over the rest, trial by trial.
    pub errors: [Vec<f64>; 3],
    /// Processor time of a picture over that of the first variant, taken in turns.
    pub time: Measured,
}

/// Fig. 1: clipped solid angle, projected solid angle, and both with LTC by MIS; one sample each.
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
    let reference = render(&settings("line-analytic", SamplerKind::Sobol, 1, 99)?);
    let moments = second_moments(&renderer, size, context);
    let is_wet: Vec<bool> = moments.rgb.iter().map(|m| m[2] > 0.0).collect();
    let times = times(&renderer, size, context)?;
    let mut pictures = Vec::new();
    let mut variants = Vec::new();
    for ((what, estimator, samples), time) in VARIANTS.into_iter().zip(times) {
        let trials: Vec<Image> = (0..context.or_least(TRIALS, 2))
            .map(|k| {
                let seed = context.seed.wrapping_add(k);
                let s = settings(estimator, SamplerKind::BlueNoise, samples, seed)?;
                Ok(render(&s))
            })
            .collect::<Result<_>>()?;
        let of = |counts: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let square = |i: &Image| mse_where(i, &reference, counts);
            trials.iter().map(square).collect()
        };
        let errors = [of(&|_| true), of(&|i| is_wet[i]), of(&|i| !is_wet[i])];
        let all = Measured::root_mean(&errors[0]);
        let caption = format!("{what}: RMSE {:.4}", all.value);
        pictures.push(exposed(&trials[0], &reference, &caption)?);
        variants.push(Variant { what, errors, time });
    }
    let caption = "reference: one line query, and quadrature along what is visible";
    pictures.push(exposed(&reference, &reference, caption)?);
    let row = |v: &Variant| {
        let [all, wet, dry] = [0, 1, 2].map(|k| Measured::root_mean(&v.errors[k]));
        let values: Vec<_> = COLUMNS.into_iter().zip([all, wet, dry, v.time]).collect();
        Row::measured(v.what, &values)
    };
    let rows: Vec<Row> = variants.iter().map(row).collect();
    let sum = |c: usize| moments.rgb.iter().map(|m| f64::from(m[c])).sum::<f64>();
    let said = sentences(&variants, sum(0) / sum(1));
    let lead = "A long linear light in the colonnade; all materials are Frostbite's, with puddles of low \
                roughness on the floor.";
    let caption = format!(
        "One or two rays a pixel, blue noise; errors over {TRIALS} seeds, puddles apart. Times are of the \
         processor, in turns, over that of the first row; the paper's frames take 1.1, 1.1 and 1.5 ms for clipped and \
         projected solid angle and both with LTC."
    );
    let tables = vec![table(&caption, &COLUMNS, &rows)];
    Ok(PictureStudy {
        title: "Linear lights, gloss: Peters 2021, Fig. 1".to_owned(),
        summary: [vec![lead.to_owned()], said].concat(),
        sections: vec![section("Fig. 1", "", pictures, tables)],
        rows,
    })
}

const COLUMNS: [&str; 4] = ["RMSE", "on puddles", "elsewhere", "seconds over the first"];

/// Processor time of each variant over that of the first, on every eighth pixel both ways, in
/// turns.
fn times(renderer: &Renderer<'_>, size: [u32; 2], context: &Context<'_>) -> Result<Vec<Measured>> {
    let pixels: Vec<[u32; 2]> = all_pixels(size[0], size[1])
        .into_iter()
        .filter(|[x, y]| context.smallest || (x % 8 == 0 && y % 8 == 0))
        .collect();
    let mut targets = Targets::find(renderer, &pixels);
    for (_, point) in &mut targets.points {
        frostbite(point, puddle);
    }
    let mut seconds = vec![Vec::new(); VARIANTS.len()];
    for _ in 0..context.or_least(10, 2) {
        for ((_, estimator, samples), seconds) in VARIANTS.into_iter().zip(&mut seconds) {
            let settings = settings(estimator, SamplerKind::BlueNoise, samples, context.seed)?;
            let cell = Cell {
                settings,
                samples,
                seed: context.seed,
                trials: context.or_least(8, 2),
            };
            seconds.push(run_cell(&targets, cell).times.seconds());
        }
    }
    let over_first = |own: &Vec<f64>| {
        let ratios = own.iter().zip(&seconds[0]).map(|(a, b)| a / b);
        Measured::geometric_mean(&ratios.collect::<Vec<_>>())
    };
    Ok(seconds.iter().map(over_first).collect())
}

/// What the numbers say; `moments` is the second moment of an unshadowed sample on puddles by
/// projected over that by clipped solid angle.
fn sentences(variants: &[Variant], moments: f64) -> Vec<String> {
    let find = |what| variants.iter().find(|v| v.what == what);
    let mut out = Vec::new();
    if let (Some(clipped), Some(projected)) = (find(VARIANTS[0].0), find(VARIANTS[1].0)) {
        let ratio = |k: usize| Measured::ratio(&projected.errors[k], &clipped.errors[k]);
        let [wet, dry] = [ratio(1).map(f64::sqrt), ratio(2).map(f64::sqrt)];
        let word = match (wet.is_above(1.0), wet.is_below(1.0)) {
            (true, _) => "worse",
            (_, true) => "better",
            _ => "no different",
        };
        out.push(format!(
            "With one sample, projected solid angle alone is {word} than clipped solid angle on puddles: {wet} times its \
             RMSE, where elsewhere it is {dry} times. A puddle looks brightest where it mirrors the light at a grazing \
             angle, where the cosine is small: fewer samples go there, and f² cos² divided by a density in proportion \
             to the cosine makes the second moment of an unshadowed sample {moments:.2} times that of clipped solid \
             angle."
        ));
    }
    let all = [VARIANTS[0].0, VARIANTS[1].0, VARIANTS[8].0].map(find);
    if let [Some(clipped), Some(projected), Some(both)] = all {
        let ratio = |v: &Variant| Measured::ratio(&clipped.errors[0], &v.errors[0]).map(f64::sqrt);
        out.push(format!(
            "At {} and {} times the time of clipped solid angle (paper: 1.0 and 1.4), projected solid angle has {} times \
             less RMSE over the whole picture, and with LTC by clamped optimal MIS {} times less.",
            projected.time,
            both.time,
            ratio(projected),
            ratio(both)
        ));
    }
    out
}

/// The mean squared error of a picture over the pixels that `counts` chooses.
fn mse_where(image: &Image, reference: &Image, counts: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    let pixels = image.rgb.iter().zip(&reference.rgb).enumerate();
    for (_, (p, q)) in pixels.filter(|(i, _)| counts(*i)) {
        for (a, b) in p.iter().zip(q) {
            sum += (f64::from(*a) - f64::from(*b)).powi(2);
            n += 1.0;
        }
    }
    sum / n
}

/// For pixels on puddles, the second moments of one unshadowed sample by projected and by clipped
/// solid angle, and one; zero elsewhere.
fn second_moments(renderer: &Renderer<'_>, size: [u32; 2], context: &Context<'_>) -> Image {
    let light = renderer.plan().lights().first().map(|l| *l.light);
    let measure = |pixel: [u32; 2], workspace: &mut Workspace| {
        let point = renderer.shading_point(pixel, workspace);
        let (Some(mut point), Some(Light::Linear(light))) = (point, light) else {
            return DVec3::ZERO;
        };
        if !puddle(&point) {
            return DVec3::ZERO;
        }
        frostbite(&mut point, puddle);
        let sampler =
            |technique| LinearSampler::new(technique, &light.segment, point.position, point.normal);
        let clipped = sampler(LinearTechnique::ClippedSolidAngle);
        let projected = sampler(LinearTechnique::ProjectedSolidAngle);
        let (Some(clipped), Some(projected)) = (clipped, projected) else {
            return DVec3::Z;
        };
        // ∫ (f cos)²/p, the midpoint rule by clipped solid angle.
        let sum = (0..PER_PIXEL).fold([0.0; 2], |[a, b], i| {
            let at = clipped.sample((f64::from(i) + 0.5) / f64::from(PER_PIXEL));
            let f = point.reflected(light.radiance_radius, at.direction).x;
            let (p, q) = (at.pdf.value(), projected.pdf(at.t).value());
            [a + f * f / (p * q), b + f * f / (p * p)]
        });
        let [a, b] = sum.map(|s| s / f64::from(PER_PIXEL));
        DVec3::new(a, b, 1.0)
    };
    let window = Tile::whole(size[0], size[1]);
    scene_study::map(window, context.progress, measure).0
}

/// Places on the light in each pixel's moments: 256, finer than the highlights of puddles.
const PER_PIXEL: u32 = 256;

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
            .map(|k| {
                Ok(render(&settings(
                    LTC,
                    sampler,
                    3,
                    context.seed.wrapping_add(k),
                )?))
            })
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
    let lead = noise_sentence(&rows);
    let tables = vec![table(
        "Errors over four seeds.",
        &["RMSE", "RMSE, blurred"],
        &rows,
    )];
    Ok(PictureStudy {
        title: "Linear lights, stratification: Peters 2021, Fig. 7".to_owned(),
        summary: vec![lead],
        sections: vec![section("Fig. 7", "", pictures, tables)],
        rows,
    })
}

/// What jitter and blue noise leave of the errors.
fn noise_sentence(rows: &[Row]) -> String {
    let value = |k: usize, name| rows[k].values.get(name).copied().unwrap_or(f64::NAN);
    let over = |a: usize, b: usize, name| value(a, name) / value(b, name);
    format!(
        "Six samples a pixel, three diffuse and three by the LTC, clamped optimal MIS. Uniform jitter leaves {:.2} times \
         the RMSE of independent samples. Blue noise has {:.2} and {:.2} times the RMSE of white noise, but \
         {:.2} and {:.2} times of what survives a blur of 1.5 pixels; both together leave {:.2} times of that.",
        over(2, 0, "RMSE"),
        over(1, 0, "RMSE"),
        over(3, 2, "RMSE"),
        over(1, 0, "RMSE, blurred"),
        over(3, 2, "RMSE, blurred"),
        over(3, 0, "RMSE, blurred"),
    )
}
