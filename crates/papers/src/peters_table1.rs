//! Peters 2021, Table 1: what sampling a linear light costs, as ratios.
#![allow(clippy::disallowed_methods, reason = "the table is of times")]

use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::{Result, bail};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_integrator::Renderer;
use linelit_lights::linear::{
    LineView, LinearSample, LinearSampler, LinearTechnique, LtcSampler, ProjectedLine,
};
use linelit_lights::{
    AngularLines, Light, LineTechnique, LinearPointTechnique, PointTechnique, SolidAngleSampler,
};
use linelit_study::engine::CpuClock;
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_testkit::peters_as_printed;
use std::hint::black_box;
use std::rc::Rc;
use std::time::Instant;

/// Shading points that a round runs through.
const POINTS: usize = 512;
/// Samples of one light in a batch, as in the paper.
const SAMPLES: usize = 128;
/// Rounds, of which the fastest counts: being interrupted does not.
const ROUNDS: usize = 60;

/// A technique, and the paper's milliseconds for 128 lights and for 128 samples.
struct Entry<'a> {
    name: &'static str,
    paper: Option<[f64; 2]>,
    /// Sets up and takes one sample at each point.
    lights: Box<dyn FnMut() + 'a>,
    /// Takes `SAMPLES` samples one by one for some points.
    scalar: Box<dyn FnMut() + 'a>,
    /// The same samples at once.
    batched: Option<Box<dyn FnMut() + 'a>>,
    least: [f64; 3],
}

/// Points around the light: near and far, some with the light partly below the horizon.
fn receivers() -> Vec<(DVec3, DVec3)> {
    let number = |i: usize, k: f64| ((i as f64 + 0.5) * k).fract();
    let point = |i: usize| {
        let at = |k: f64| 2.0 * number(i, k) - 1.0;
        let x = DVec3::new(
            3.0 * at(0.618_034),
            3.0 * at(0.754_878),
            0.4 * at(0.569_840),
        );
        (x, DVec3::new(at(0.819_173), at(0.671_044), 1.2).normalize())
    };
    (0..POINTS).map(point).collect()
}

/// Points at which a sample is measured: every eighth.
const STRIDE: usize = 8;

fn entry<'a, S: 'a>(
    name: &'static str,
    paper: Option<[f64; 2]>,
    (points, numbers): (&'a [(DVec3, DVec3)], &'a [f64]),
    new: impl Fn(DVec3, DVec3) -> Option<S> + 'a,
    sample: impl Fn(&S, f64) + Copy + 'a,
    batch: Option<fn(&S, &[f64])>,
) -> Entry<'a> {
    let some = points.iter().step_by(STRIDE);
    let ready: Rc<[S]> = some.filter_map(|&(x, n)| new(x, n)).collect();
    let again = Rc::clone(&ready);
    Entry {
        name,
        paper,
        lights: Box::new(move || {
            for (&(x, n), &u) in points.iter().zip(numbers) {
                if let Some(s) = &new(black_box(x), black_box(n)) {
                    sample(s, u);
                }
            }
        }),
        scalar: Box::new(move || {
            for s in ready.iter() {
                for &u in &numbers[..SAMPLES] {
                    sample(s, black_box(u));
                }
            }
        }),
        batched: batch.map(|batch| -> Box<dyn FnMut() + 'a> {
            Box::new(move || {
                for s in again.iter() {
                    batch(s, black_box(&numbers[..SAMPLES]));
                }
            })
        }),
        least: [f64::INFINITY; 3],
    }
}

/// Runs the table.
pub(super) fn table_1(context: &Context<'_>) -> Result<PictureStudy> {
    let points = receivers();
    let numbers: Vec<f64> = (0..POINTS)
        .map(|i| ((i as f64 + 0.5) * 0.618_034).fract())
        .collect();
    let light = Segment::new(DVec3::new(-1.0, 0.2, 1.0), DVec3::new(1.5, -0.3, 1.3));
    let mut entries = entries(&light, (&points, &numbers));
    for _ in 0..context.or_least(ROUNDS, 1) {
        for entry in &mut entries {
            let time = |run: &mut Box<dyn FnMut() + '_>| {
                let start = Instant::now();
                run();
                start.elapsed().as_secs_f64() * 1e9
            };
            let taken = POINTS.div_ceil(STRIDE) * SAMPLES;
            let (lights, samples) = (POINTS as f64, taken as f64);
            entry.least[0] = entry.least[0].min(time(&mut entry.lights) / lights);
            entry.least[1] = entry.least[1].min(time(&mut entry.scalar) / samples);
            if let Some(batched) = &mut entry.batched {
                entry.least[2] = entry.least[2].min(time(batched) / samples);
            }
        }
    }
    let mut study = picture_study(&entries);
    let scenes = ["cornell-box-line", "colonnade-line"]
        .into_iter()
        .map(|scene| scene_cost(context, scene, &numbers))
        .collect::<Result<Vec<_>>>()?;
    add_scenes(&mut study, &scenes);
    Ok(study)
}

/// The cost of Newton-bisection over projected solid angle's at the shading points of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SceneCost {
    /// The scene.
    pub scene: &'static str,
    /// For each light; the paper's algorithms as printed.
    pub per_light: Measured,
    /// For each sample.
    pub per_sample: Measured,
    /// The slowest of 32 neighbouring points over their mean, as a warp of a GPU waits for it: of
    /// Newton-bisection, and of the algorithms as printed.
    pub waiting: [f64; 2],
}

/// Points of a warp.
const WARP: usize = 32;

/// Measures both techniques at the points that the camera sees, in turns.
pub(crate) fn scene_cost(
    context: &Context<'_>,
    name: &'static str,
    numbers: &[f64],
) -> Result<SceneCost> {
    let mut scene = context.library.load(name)?.scene;
    let size = context.size([32, 16]);
    scene.set_resolution(size[0], size[1]);
    let Some(Light::Linear(light)) = scene.lights.first().map(|l| *l.light) else {
        bail!("`{name}` has no linear light");
    };
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(size[0], size[1]));
    let points: Vec<(DVec3, DVec3)> = targets
        .points
        .iter()
        .map(|(_, p)| (p.position, p.normal))
        .collect();
    let input = (&points[..], numbers);
    let segment = light.segment;
    let technique = LinearTechnique::NewtonBisection;
    let new = move |x, n| LinearSampler::new(technique, &segment, x, n);
    let one = |s: &LinearSampler, u| {
        black_box(s.sample(u));
    };
    let mut bisection = entry("", None, input, new, one, None);
    let mut printed = printed(&segment, input);
    let time = |run: &mut Box<dyn FnMut() + '_>| {
        let clock = CpuClock::start();
        run();
        clock.seconds()
    };
    let (mut lights, mut samples) = (Vec::new(), Vec::new());
    for _ in 0..context.or_least(ROUNDS, 2) {
        lights.push(time(&mut bisection.lights) / time(&mut printed.lights));
        samples.push(time(&mut bisection.scalar) / time(&mut printed.scalar));
    }
    let rounds = context.or_least(ROUNDS, 1);
    let waits_bisection = waiting(&points, rounds, |x, n| {
        let s = LinearSampler::new(technique, &segment, x, n)?;
        numbers[..SAMPLES.min(numbers.len())].iter().for_each(|u| {
            black_box(s.sample(black_box(*u)));
        });
        Some(())
    });
    let narrow = |v: DVec3| v.as_vec3().to_array();
    let waits_printed = waiting(&points, rounds, |x, n| {
        let (a, b) = (narrow(segment.p0 - x), narrow(segment.p1 - x));
        let s = peters_as_printed::Line::new(a, b, narrow(n))?;
        numbers[..SAMPLES.min(numbers.len())].iter().for_each(|u| {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "single precision is the point"
            )]
            black_box(s.sample(black_box(*u) as f32));
        });
        Some(())
    });
    Ok(SceneCost {
        scene: name,
        per_light: Measured::geometric_mean(&lights),
        per_sample: Measured::geometric_mean(&samples),
        waiting: [waits_bisection, waits_printed],
    })
}

/// The time of the slowest of [`WARP`] neighbouring points over their mean, averaged; of each point
/// the least of some rounds counts. Points without a sample wait for nobody.
fn waiting(
    points: &[(DVec3, DVec3)],
    rounds: usize,
    run: impl Fn(DVec3, DVec3) -> Option<()>,
) -> f64 {
    let mut least = vec![f64::INFINITY; points.len()];
    for _ in 0..rounds {
        for (least, &(x, n)) in least.iter_mut().zip(points) {
            let clock = CpuClock::start();
            if run(x, n).is_some() {
                *least = least.min(clock.seconds());
            }
        }
    }
    let (mut slowest, mut mean) = (0.0, 0.0);
    for warp in least.chunks(WARP) {
        let ran = warp.iter().filter(|t| t.is_finite());
        slowest += ran.clone().copied().fold(0.0, f64::max);
        mean += ran.clone().sum::<f64>() / ran.count().max(1) as f64;
    }
    slowest / mean
}

const SCENE_COLUMNS: [&str; 4] = [
    "seconds of a light, over as printed",
    "seconds of a sample, over as printed",
    "seconds that a warp waits, Newton-bisection",
    "seconds that a warp waits, as printed",
];

/// Adds the costs on scenes, and what they say beside the paper's.
fn add_scenes(study: &mut PictureStudy, scenes: &[SceneCost]) {
    let row = |s: &SceneCost| {
        let [a, b] = s.waiting.map(Measured::exact);
        let values: Vec<_> = SCENE_COLUMNS
            .into_iter()
            .zip([s.per_light, s.per_sample, a, b])
            .collect();
        Row::measured(s.scene, &values)
    };
    let rows: Vec<Row> = scenes.iter().map(row).collect();
    let said: Vec<String> = scenes
        .iter()
        .map(|s| {
            let [a, b] = s.waiting;
            format!(
                "{}: {} times for each light, {} times for each sample; where 32 neighbouring points wait for the \
                 slowest, they wait {a:.2} times their mean by Newton-bisection and {b:.2} times as printed, which \
                 makes {:.1} times of the latter",
                s.scene,
                s.per_light,
                s.per_sample,
                s.per_sample.value * a / b
            )
        })
        .collect();
    let lead = format!(
        "Newton-bisection (f64) over algorithms 1 and 2 as printed (f32), at the points that a camera sees. {}. The paper \
         has 2.3 and 2.5 times in its Cornell box, 3.3 and 4.5 times in the bistro, where its threads diverge.",
        said.join(". ")
    );
    let tables = vec![table("", &SCENE_COLUMNS, &rows)];
    study.summary.push(lead);
    let title = "A plain and a divergent scene";
    study.sections.push(section(title, "", Vec::new(), tables));
    study.rows.extend(rows);
}

fn entries<'a>(light: &'a Segment, input: (&'a [(DVec3, DVec3)], &'a [f64])) -> Vec<Entry<'a>> {
    let paper = [
        [0.47, 0.41],
        [0.75, 0.17],
        [1.29, 0.17],
        [2.32, 0.49],
        [4.78, 1.97],
        [10.0, 5.20],
        [4.40, 2.05],
    ];
    let mut out: Vec<Entry<'a>> = LinearTechnique::ALL
        .into_iter()
        .zip(paper)
        .map(|(technique, paper)| {
            let new = move |x, n| LinearSampler::new(technique, light, x, n);
            let batch: fn(&LinearSampler, &[f64]) = |s, u| {
                let mut out = [LinearSample::default(); SAMPLES];
                s.sample_into(u, &mut out);
                black_box(&out);
            };
            let one = |s: &LinearSampler, u| {
                black_box(s.sample(u));
            };
            entry(technique.name(), Some(paper), input, new, one, Some(batch))
        })
        .collect();
    let tight = move |x, n| LinearSampler::newton_bisection(light, x, n, 1e-12);
    let one = |s: &LinearSampler, u| {
        black_box(s.sample(u));
    };
    out.push(entry(TIGHT, None, input, tight, one, None));
    let m = DMat3::from_cols(
        DVec3::new(0.3, 0.0, 0.1),
        DVec3::new(0.0, 0.2, 0.0),
        DVec3::new(-0.4, 0.0, 1.0),
    );
    let batch: fn(&LtcSampler, &[f64]) = |s, u| {
        let mut out = [LinearSample::default(); SAMPLES];
        s.sample_into(u, &mut out);
        black_box(&out);
    };
    let new = move |x, n| LtcSampler::new(light, x, n, m);
    let one = |s: &LtcSampler, u| {
        black_box(s.sample(u));
    };
    out.push(entry("ltc", None, input, new, one, Some(batch)));
    out.push(printed(light, input));
    out.push(projected(light, input));
    out.extend(quads(input));
    out
}

/// Algorithms 1 and 2 word for word, in single precision as the paper's are.
fn printed<'a>(light: &'a Segment, input: (&'a [(DVec3, DVec3)], &'a [f64])) -> Entry<'a> {
    let narrow = |v: DVec3| v.as_vec3().to_array();
    let new = move |x: DVec3, n: DVec3| {
        peters_as_printed::Line::new(narrow(light.p0 - x), narrow(light.p1 - x), narrow(n))
    };
    let one = |s: &peters_as_printed::Line, u: f64| {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "single precision is the point"
        )]
        black_box(s.sample(u as f32));
    };
    entry(PRINTED, Some([4.40, 2.05]), input, new, one, None)
}

/// Projected solid angle to the error of Newton-bisection.
fn projected<'a>(light: &'a Segment, input: (&'a [(DVec3, DVec3)], &'a [f64])) -> Entry<'a> {
    let coarse = move |x: DVec3, n: DVec3| {
        LineView::with_edge(light.p0 - x, light.p1 - x, light.vector(), Some(n))
            .and_then(ProjectedLine::of)
    };
    let one = |s: &ProjectedLine, u: f64| {
        black_box(s.sample_coarse(u));
    };
    entry(COARSE, None, input, coarse, one, None)
}

/// The paper's last rows: a rectangle by solid angle and by projected solid angle.
fn quads<'a>(input: (&'a [(DVec3, DVec3)], &'a [f64])) -> Vec<Entry<'a>> {
    let corner = DVec3::new(-0.5, -0.5, 1.0);
    let Ok(quad) = ConvexPolygon::parallelogram(corner, DVec3::X, DVec3::new(0.0, 1.0, 0.3)) else {
        return Vec::new();
    };
    let second = |u: f64| (u * 7.13).fract();
    let solid = entry(
        "quad, solid angle",
        Some([3.65, 1.11]),
        input,
        move |x, _| Some(SolidAngleSampler::new(&quad, x)),
        move |s: &SolidAngleSampler, u| {
            black_box(s.sample([u, second(u)]));
        },
        None,
    );
    let projected = entry(
        "quad, projected solid angle",
        Some([28.9, 11.5]),
        input,
        move |x, n| Some(AngularLines::by_projected_solid_angle(&quad, 0.0, x, n)),
        move |s: &AngularLines, u| {
            let whole = [linelit_geometry::intervals::Interval::UNIT];
            black_box(s.point(&s.sample(u), &whole, second(u)));
        },
        None,
    );
    vec![solid, projected]
}

fn picture_study(entries: &[Entry<'_>]) -> PictureStudy {
    let area = entries[0].least;
    let paper_area = entries[0].paper.unwrap_or([f64::NAN; 2]);
    let finite = |v: f64| if v.is_finite() { v } else { f64::NAN };
    let row = |e: &Entry<'_>| {
        let paper = e.paper.unwrap_or([f64::NAN; 2]);
        Row::new(
            e.name,
            &[
                (COLUMNS[0], e.least[0]),
                (COLUMNS[1], e.least[0] / area[0]),
                (COLUMNS[2], paper[0] / paper_area[0]),
                (COLUMNS[3], e.least[1]),
                (COLUMNS[4], e.least[1] / area[1]),
                (COLUMNS[5], paper[1] / paper_area[1]),
                (COLUMNS[6], finite(e.least[2])),
            ],
        )
    };
    let rows: Vec<Row> = entries.iter().map(row).collect();
    let find = |name: &str| {
        entries
            .iter()
            .find(|e| e.name == name)
            .map_or([f64::NAN; 3], |e| e.least)
    };
    let (theirs, ours) = (find("newton-bisection"), find("projected-solid-angle"));
    let printed = find(PRINTED);
    let (equal, tight) = (find(COARSE), find(TIGHT));
    let found = format!(
        "Projected solid angle costs {:.2} times less than Newton-bisection for each light (paper: 2.3), and for each sample {:.2} times less one by one, {:.2} times less in a batch (paper: 2.5). It is exact to rounding, where Newton-bisection ends at 1.6e-5. At equal errors it costs {:.2} times less for each light and {:.2} times for each sample at 1.6e-5; Newton-bisection to 1e-12 costs {:.2} and {:.2} times as much, {:.2} times what a sample of a batch does. Algorithms 1 and 2 as printed cost {:.2} times less than Newton-bisection for each light and {:.2} times for each sample.",
        theirs[0] / ours[0],
        theirs[1] / ours[1],
        theirs[1] / ours[2],
        theirs[0] / equal[0],
        theirs[1] / equal[1],
        tight[0] / ours[0],
        tight[1] / ours[1],
        tight[1] / ours[2],
        theirs[0] / printed[0],
        theirs[1] / printed[1],
    );
    let note = "A light is set up and sampled once; a sample is one of 128 of the same light. The least of \
                60 interleaved rounds. The paper's are a GPU's times above its baseline, ours a core's, in \
                f64 unless said otherwise and to rounding rather than to 1.6e-5 but for Newton-bisection, which has no batch: \
                compare ratios."
        .to_owned();
    let tables = vec![table(&note, &COLUMNS, &rows)];
    PictureStudy {
        title: "Cost of linear lights: Peters 2021, Table 1".to_owned(),
        summary: vec![found],
        sections: vec![section("Table 1", "", Vec::new(), tables)],
        rows,
    }
}

/// The row of the paper's algorithms as printed.
const PRINTED: &str = "algorithms 1 and 2 as printed, f32";

/// The row of equal error.
const COARSE: &str = "projected-solid-angle, to 1.6e-5";

/// Newton-bisection nearly as exact as it can be.
const TIGHT: &str = "newton-bisection, to 1e-12";

const COLUMNS: [&str; 7] = [
    "ns per light",
    "… over area",
    "paper: … over area",
    "ns per sample",
    "sample over area",
    "paper: sample over area",
    "ns per sample, batched",
];
