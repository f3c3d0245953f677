//! Peters 2021, Table 1: what sampling a linear light costs, as ratios.
#![allow(clippy::disallowed_methods, reason = "the table is of times")]

use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::Result;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_lights::linear::{
    LineView, LinearSample, LinearSampler, LinearTechnique, LtcSampler, ProjectedLine,
};
use linelit_lights::{
    AngularLines, LineTechnique, LinearPointTechnique, PointTechnique, SolidAngleSampler,
};
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
    Ok(picture_study(&entries))
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
    out.extend(projected(light, input));
    out.extend(quads(input));
    out
}

/// Projected solid angle to the error of Newton-bisection, and in single precision.
fn projected<'a>(light: &'a Segment, input: (&'a [(DVec3, DVec3)], &'a [f64])) -> [Entry<'a>; 2] {
    let coarse = move |x: DVec3, n: DVec3| {
        let ends = [light.p0 - x, light.p1 - x].map(|p| p.to_array());
        let edge = light.vector().to_array();
        LineView::with_edge(ends[0], ends[1], edge, Some(n.to_array())).and_then(ProjectedLine::of)
    };
    let one = |s: &ProjectedLine<f64>, u: f64| {
        black_box(s.sample_coarse(u));
    };
    let coarse = entry(COARSE, None, input, coarse, one, None);
    let narrow = |v: DVec3| v.as_vec3().to_array();
    let single = move |x: DVec3, n: DVec3| {
        ProjectedLine::new(narrow(light.p0 - x), narrow(light.p1 - x), narrow(n))
    };
    let one = |s: &ProjectedLine<f32>, u: f64| {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "single precision is the point"
        )]
        black_box(s.sample(u as f32));
    };
    let name = "projected-solid-angle, f32";
    [coarse, entry(name, None, input, single, one, None)]
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
    let (equal, tight) = (find(COARSE), find(TIGHT));
    let found = format!(
        "Projected solid angle costs {:.2} times less than Newton-bisection for each light (paper: 2.3), and for each sample {:.2} times less one by one, {:.2} times less in a batch (paper: 2.5). It is exact to rounding, where Newton-bisection ends at 1.6e-5. At equal errors it costs {:.2} times less for each light and {:.2} times for each sample at 1.6e-5; Newton-bisection to 1e-12 costs {:.2} and {:.2} times as much, {:.2} times what a sample of a batch does.",
        theirs[0] / ours[0],
        theirs[1] / ours[1],
        theirs[1] / ours[2],
        theirs[0] / equal[0],
        theirs[1] / equal[1],
        tight[0] / ours[0],
        tight[1] / ours[1],
        tight[1] / ours[2],
    );
    let note = "A light is set up and sampled once; a sample is one of 128 of the same light. The least of \
                60 interleaved rounds. The paper's are a GPU's times above its baseline, ours a core's, in \
                f64 unless said otherwise and to rounding rather than to 1.6e-5 but for Newton-bisection, which has no batch: \
                compare ratios."
        .to_owned();
    let tables = vec![table(&note, &COLUMNS, &rows)];
    PictureStudy {
        title: "Cost of linear lights: Peters 2021, Table 1".to_owned(),
        summary: vec![found.clone()],
        sections: vec![section("Table 1", &found, Vec::new(), tables)],
        rows,
    }
}

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
