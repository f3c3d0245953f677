//! Salesin & Jarosz 2019: orders at single pixels, and strategies for the same samples and time.

use super::super::bench::{Answer, Ask, Bench, Effort, Figures};
use crate::measured::{Measured, largest};
use crate::salesin;
use anyhow::Result;
use linelit_integrator::Estimator;
use linelit_samplers::SamplerKind;
use linelit_study::scene_study::{StudySpec, Targets};
use linelit_study::tables::{ResultRow, StudyRecord};

const LINE1: &str = "line-solid-angle[orientation=fixed:0]";
const LINE2: &str = "line-solid-angle[orientation=fixed:0.5]";
const AREA1: &str = "line-area[orientation=fixed:0,pieces=each]";
const AREA2: &str = "line-area[orientation=fixed:0.5,pieces=each]";
const MIS: &str = "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]";
const AVERAGE: &str =
    "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5,mis=average]";
const AREA_MIS: &str = "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5]";
const AREA_AVERAGE: &str =
    "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=average]";
const WITH_BSDF: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf";
const WITH_BSDF_AVERAGE: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=average]";
const SMOOTH: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]";

/// Has noise where a part of the light is seen, and nowhere else.
const BY_PROJECTION: &str = "point-projected-solid-angle";

/// A study at its pixels.
struct Spots(StudyRecord);

impl Spots {
    fn run(bench: &Bench<'_>, name: &str, change: impl FnOnce(&mut StudySpec)) -> Result<Self> {
        let mut spec = salesin::spec(name, None).unwrap_or_default();
        spec.samplers = vec![SamplerKind::MultiJitter];
        spec.papers.clear();
        change(&mut spec);
        Ok(Self(bench.record(spec)?))
    }

    /// The order of the standard deviation at a pixel; unknown where too little has noise.
    fn order(&self, spot: &str, estimator: &str) -> Option<Measured> {
        let row = *self.rows(spot, estimator).first()?;
        let mut own = self.0.slopes.iter().filter(|s| s.scene == row.scene);
        let found = own.find(|s| s.estimator == row.estimator);
        Some(found.map_or(Measured::UNKNOWN, Measured::from))
    }

    /// The rows of an estimator at a pixel, by samples.
    fn rows(&self, spot: &str, estimator: &str) -> Vec<&ResultRow> {
        // As it prints itself.
        let name = estimator.parse::<Estimator>().map(|e| e.to_string());
        let name = name.unwrap_or_default();
        let spot = format!(", {spot}:");
        let own = self.0.rows.iter().filter(|r| r.scene.contains(&spot));
        own.filter(|r| r.estimator == name).collect()
    }

    /// The ratio of squared errors, the geometric mean over all numbers of samples.
    fn ratio(&self, spot: &str, a: &str, b: &str) -> Option<Measured> {
        let (a, b) = (self.rows(spot, a), self.rows(spot, b));
        let ratios = a.iter().zip(b).map(|(a, b)| Measured::variance_ratio(a, b));
        Measured::pooled(&ratios.collect::<Vec<_>>())
    }
}

/// Inserts what there is.
fn put(figures: &mut Figures, name: impl Into<String>, found: Option<Measured>) {
    if let Some(found) = found {
        figures.insert(name.into(), found);
    }
}

/// Fig. 5.
pub(super) fn directions(bench: &Bench<'_>) -> Result<Figures> {
    let spots = Spots::run(bench, "salesin-fig5", |spec| {
        spec.reference_rounds = 2;
    })?;
    let mut figures = Figures::new();
    for (kind, [one, two, mis, average]) in [
        ("area", [AREA1, AREA2, AREA_MIS, AREA_AVERAGE]),
        ("solid angle", [LINE1, LINE2, MIS, AVERAGE]),
    ] {
        // At A the second direction sees no jump, the first does.
        for (name, estimator) in [
            ("worst", one),
            ("best", two),
            ("MIS", mis),
            ("average", average),
        ] {
            put(
                &mut figures,
                format!("Fig. 5/{kind}/{name}"),
                spots.order("A", estimator),
            );
        }
        let both = |a, b| largest(["A", "B"].into_iter().filter_map(|s| spots.ratio(s, a, b)));
        let over = both(mis, average);
        put(
            &mut figures,
            format!("Fig. 5/{kind}/MIS over average"),
            over,
        );
        let worse = spots.ratio("A", mis, one);
        put(&mut figures, format!("Fig. 5/{kind}/MIS over worst"), worse);
        let better = spots.ratio("A", mis, two);
        put(&mut figures, format!("Fig. 5/{kind}/MIS over best"), better);
    }
    Ok(figures)
}

/// Fig. 6.
pub(super) fn strips(bench: &Bench<'_>) -> Result<Figures> {
    let spots = Spots::run(bench, "salesin-fig6", |_| {})?;
    let mut figures = Figures::new();
    for (spot, name) in [("A", "rough"), ("B", "glossy")] {
        let mut add = |what: &str, a, b| {
            put(
                &mut figures,
                format!("Fig. 6/{name}/{what}"),
                spots.ratio(spot, a, b),
            );
        };
        add("MIS over average", WITH_BSDF, WITH_BSDF_AVERAGE);
        add("MIS over BSDF", WITH_BSDF, "point-bsdf");
        add("MIS over lines", WITH_BSDF, LINE1);
        add("lines over BSDF", LINE1, "point-bsdf");
    }
    let ground = |name: &str| {
        figures
            .get(&format!("Fig. 6/{name}/lines over BSDF"))
            .copied()
    };
    if let (Some(rough), Some(glossy)) = (ground("rough"), ground("glossy")) {
        figures.insert(
            "Fig. 6/lines, glossy over rough".to_owned(),
            glossy.over(rough),
        );
    }
    Ok(figures)
}

/// Fig. 7.
pub(super) fn smoothing(bench: &Bench<'_>) -> Result<Figures> {
    let spots = Spots::run(bench, "salesin-fig7", |spec| {
        if bench.effort == Effort::Quick {
            spec.samples = vec![64, 256, 1024];
        }
    })?;
    let mut figures = Figures::new();
    for spot in ["A", "B"] {
        let order = |estimator| spots.order(spot, estimator);
        put(
            &mut figures,
            format!("Fig. 7/{spot}/balance"),
            order(WITH_BSDF),
        );
        put(&mut figures, format!("Fig. 7/{spot}/smooth"), order(SMOOTH));
        if let (Some(smooth), Some(balance)) = (order(SMOOTH), order(WITH_BSDF)) {
            let gain = smooth.minus(balance);
            figures.insert(format!("Fig. 7/{spot}/gain"), gain);
        }
        if let (Some(smooth), Some(lines)) = (order(SMOOTH), order(LINE1)) {
            figures.insert(
                format!("Fig. 7/{spot}/smooth beside lines"),
                smooth.minus(lines),
            );
        }
    }
    Ok(figures)
}

/// The paper's sampler and one sample of each strategy at each point; independent samples keep
/// squared error times seconds the same, so that this compares pictures for the same time.
fn independent(estimator: &str) -> Ask<'_> {
    Ask {
        estimator,
        sampler: SamplerKind::Independent,
        samples: 1,
        trials: 96,
    }
}

/// Runs these estimators, one sample each but as said.
fn compare<const N: usize>(
    bench: &Bench<'_>,
    targets: &Targets<'_>,
    asks: [Ask<'_>; N],
) -> Result<[Answer; N]> {
    let found = bench.ask(targets, &asks)?;
    found
        .try_into()
        .map_err(|_| anyhow::anyhow!("an answer for each question"))
}

/// Figs. 3 and 8: the Cornell box.
pub(super) fn cornell(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let scene = bench.scene("cornell-box-large")?;
    bench.on_grid(scene, [28, 28], |targets| {
        let single = "line-solid-angle[orientation=fixed:0,pieces=one]";
        let area = "line-area[orientation=fixed:0,pieces=one]";
        let partly = bench.noisy(targets, BY_PROJECTION)?;
        if !partly.points.is_empty() {
            let asks = ["point-solid-angle", single, LINE1].map(independent);
            let [points, lines, pieces] = compare(bench, &partly, asks)?;
            let mrse = Measured::ratio(&lines.mrse, &points.mrse);
            figures.insert("Fig. 3/soft shadows".to_owned(), mrse);
            let cost = pieces.cost_ratio(&points);
            figures.insert("Fig. 8/soft shadows for the same time".to_owned(), cost);
        }
        let asks = [single, area, LINE1, AVERAGE, MIS, "line-analytic"];
        let all = compare(
            bench,
            targets,
            asks.map(|estimator| Ask {
                // Two strategies with a sample each, and one with two.
                samples: 2,
                ..independent(estimator)
            }),
        )?;
        let [by_angle, by_area, lines, average, mis, analytic] = all;
        let mrse = Measured::ratio(&by_angle.mrse, &by_area.mrse);
        figures.insert("Fig. 3/solid angle over area".to_owned(), mrse);
        figures.insert(
            "Fig. 8/MIS over average".to_owned(),
            mis.cost_ratio(&average),
        );
        figures.insert(
            "Fig. 8/lines over closed form".to_owned(),
            lines.cost_ratio(&analytic),
        );
        let more = |a: &Answer| a.counts.line_queries as f64;
        // Of a line and a point for each, over a line for each.
        let both = Ask {
            samples: 2,
            ..independent(WITH_BSDF)
        };
        let [combined, alone] = compare(bench, targets, [both, independent(LINE1)])?;
        let queries = Measured::exact(more(&combined) / more(&alone).max(1.0));
        figures.insert("line queries of a combination".to_owned(), queries);
        Ok(())
    })?;
    bright(bench, &mut figures)?;
    Ok(figures)
}

/// Fig. 8 where the whole light is seen: how much longer lines take for the same error.
fn bright(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    let scene = bench.scene("cornell-box-large")?;
    bench.on_grid(scene, [28, 28], |targets| {
        // Those that see next to nothing of the light, which few samples meet, are not among them.
        let bright = bench.calm(targets, BY_PROJECTION)?;
        if bright.points.is_empty() {
            return Ok(());
        }
        let asks = [LINE1, "point-solid-angle"].map(independent);
        let [lines, points] = compare(bench, &bright, asks)?;
        let cost = lines.cost_ratio(&points);
        figures.insert("Fig. 8/unshadowed for the same time".to_owned(), cost);
        Ok(())
    })
}

/// Figs. 1, 9, 10 and 11: monoliths, ratios, plates, a textured light.
pub(super) fn scenes(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    for (figure, scene) in [("Fig. 1", "monoliths"), ("Fig. 10", "plates")] {
        bench.on_grid(bench.scene(scene)?, [36, 24], |targets| {
            let half = |estimator| Ask {
                samples: 2,
                ..independent(estimator)
            };
            let asks = [
                half("point-bsdf"),
                half("point-solid-angle"),
                half(LINE1),
                half("point-solid-angle+point-bsdf"),
                half(WITH_BSDF),
            ];
            let [bsdf, points, lines, points_bsdf, both] = compare(bench, targets, asks)?;
            let mut add = |what: &str, other: &Answer| {
                figures.insert(format!("{figure}/{what}"), both.cost_ratio(other));
            };
            add("MIS over BSDF", &bsdf);
            add("MIS over points", &points);
            add("MIS over lines", &lines);
            add("MIS over points with BSDF", &points_bsdf);
            let error = Measured::ratio(&both.mrse, &lines.mrse);
            figures.insert(format!("{figure}/error over lines"), error);
            for (name, other) in [("points", &points), ("points with BSDF", &points_bsdf)] {
                let time = both.time_ratio(other);
                figures.insert(format!("{figure}/time over {name}"), time);
            }
            Ok(())
        })?;
    }
    ratios(bench, &mut figures)?;
    textured(bench, &mut figures)?;
    Ok(figures)
}

/// Fig. 9 on our own scene: four samples, shared out three ways.
fn ratios(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    bench.on_grid(bench.scene("monoliths")?, [36, 24], |targets| {
        let four = |estimator| Ask {
            samples: 4,
            ..independent(estimator)
        };
        let asks = [
            "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf",
            "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
            "line-solid-angle[orientation=fixed:0.5]+point-bsdf:3",
            "point-bsdf",
            LINE2,
        ];
        let [three, even, one, bsdf, lines] = compare(bench, targets, asks.map(four))?;
        let others = [even, one, bsdf, lines];
        let worst = largest(others.iter().map(|other| three.cost_ratio(other)));
        put(figures, "Fig. 9/three lines to a point", worst);
        Ok(())
    })
}

/// Fig. 11: four samples, some of which know the image.
fn textured(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    bench.on_grid(bench.scene("window")?, [24, 24], |targets| {
        let four = |estimator| Ask {
            samples: 4,
            ..independent(estimator)
        };
        let asks = [
            "point-solid-angle",
            "point-texture",
            "point-texture:3+line-solid-angle[orientation=fixed:0]",
            LINE1,
        ];
        let [blind, textured, three, lines] = compare(bench, targets, asks.map(four))?;
        let mut add = |what: &str, a: &Answer, b: &Answer| {
            let ratio = Measured::ratio(&a.mrse, &b.mrse);
            figures.insert(format!("Fig. 11/{what}"), ratio);
        };
        add("textured points over points", &textured, &blind);
        add("textured points over lines", &textured, &lines);
        add("one line of four", &three, &textured);
        Ok(())
    })?;
    let spots = Spots::run(bench, "salesin-fig11", |spec| {
        spec.samplers = vec![SamplerKind::Independent];
        spec.samples = vec![4, 16];
        spec.trials = 256;
    })?;
    let mixed = "point-texture:3+line-solid-angle[orientation=fixed:0]";
    put(
        figures,
        "Fig. 11/beside the window",
        spots.ratio("A", mixed, "point-texture"),
    );
    Ok(())
}
