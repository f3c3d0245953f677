//! Salesin & Jarosz 2019, Figs. 1, 3 and 5 to 10: points and lines in one estimator.
//!
//! The paper plots variance; its orders are halved here, to be orders of the standard deviation.

use super::{Budget, Gallery, PaperOrder, Spot, StudySpec};
use crate::cli::{Pixels, Resolution};
use linelit_integrator::{Estimator, LightChoice};
use linelit_samplers::SamplerKind;

/// The studies' names.
pub(super) const NAMES: [&str; 8] = [
    "salesin-fig1",
    "salesin-fig3",
    "salesin-fig5",
    "salesin-fig6",
    "salesin-fig7",
    "salesin-fig8",
    "salesin-fig9",
    "salesin-fig10",
];

/// Lines along the first edge of the light, and across.
const LINE1: &str = "line-solid-angle[orientation=fixed:0]";
const LINE2: &str = "line-solid-angle[orientation=fixed:0.5]";

/// A figure, before its texts are read.
struct Figure<'a> {
    title: &'a str,
    scene: &'a str,
    spots: &'a [Spot],
    estimators: &'a [&'a str],
    samples: &'a [u32],
    trials: u32,
    papers: Vec<PaperOrder>,
    gallery: Option<Gallery>,
}

/// The study of a figure; `scene` replaces the built-in one. `None` for a figure that has no scene
/// of ours and was given none.
pub(super) fn spec(name: &str, scene: Option<&str>) -> Option<StudySpec> {
    let figure = match name {
        "salesin-fig1" => fig1(),
        "salesin-fig3" => fig3(),
        "salesin-fig5" => fig5(),
        "salesin-fig6" => fig6(),
        "salesin-fig7" => fig7(),
        "salesin-fig8" => fig8(),
        "salesin-fig9" => fig9(),
        "salesin-fig10" => fig10(),
        _ => return None,
    };
    let scene = scene.unwrap_or(figure.scene);
    let built_in = scene == figure.scene;
    (!scene.is_empty()).then(|| StudySpec {
        title: format!("Salesin & Jarosz 2019, {}", figure.title),
        scenes: vec![scene.to_owned()],
        estimators: estimators(figure.estimators),
        samplers: vec![SamplerKind::MultiJitter],
        samples: figure.samples.to_vec(),
        trials: figure.trials,
        independent_trials: None,
        pixels: Pixels::Grid(Resolution {
            width: 32,
            height: 20,
        }),
        time_budget: None,
        seed: 1,
        skip: true,
        lights: LightChoice::All,
        papers: figure.papers,
        spots: if built_in {
            figure.spots.to_vec()
        } else {
            Vec::new()
        },
        gallery: figure.gallery,
    })
}

fn estimators(names: &[&str]) -> Vec<Estimator> {
    names.iter().filter_map(|name| name.parse().ok()).collect()
}

fn gallery(size: [u32; 2], budget: Budget, names: &[&str]) -> Option<Gallery> {
    Some(Gallery {
        width: size[0],
        height: size[1],
        budget,
        sampler: SamplerKind::MultiJitter,
        estimators: estimators(names),
    })
}

/// Points and lines, alone and with BSDF samples, for the same time.
fn fig1() -> Figure<'static> {
    let names = [
        "point-bsdf",
        "point-solid-angle",
        "point-solid-angle+point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
    ];
    Figure {
        title: "Fig. 1: monoliths, equal time",
        scene: "monoliths",
        spots: &[],
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        samples: &[4, 16, 64],
        trials: 16,
        papers: Vec::new(),
        gallery: gallery([320, 200], Budget::Seconds(3.0), &names),
    }
}

/// One sample a pixel: what solid angle adds to lines.
fn fig3() -> Figure<'static> {
    let names = [
        "point-area",
        "point-solid-angle",
        "line-area[orientation=fixed:0,pieces=one]",
        "line-solid-angle[orientation=fixed:0,pieces=one]",
        "line-solid-angle[orientation=fixed:0]",
        "line-projected[orientation=fixed:0]",
    ];
    Figure {
        title: "Fig. 3: one sample at each point",
        scene: "cornell-box-large",
        spots: &[],
        estimators: &["point-solid-angle", "line-solid-angle"],
        samples: &[1, 4, 16],
        trials: 16,
        papers: Vec::new(),
        gallery: gallery([256, 256], Budget::Samples(1), &names),
    }
}

/// Two directions, one of which sees no discontinuity: alone, averaged, weighted.
fn fig5() -> Figure<'static> {
    const SCENE: &str = "floating-quad, A: shadow edge across the second direction";
    const SPOTS: [Spot; 2] = [
        Spot {
            label: "A: shadow edge across the second direction",
            pixel: [128, 234],
        },
        Spot {
            label: "B: shadow edge across the first direction",
            pixel: [84, 226],
        },
    ];
    let paper = |estimator, order: f64| PaperOrder {
        scene: SCENE.to_owned(),
        estimator,
        sampler: SamplerKind::MultiJitter,
        order: 0.5 * order,
        source: "Fig. 5, half the order of variance",
    };
    Figure {
        title: "Fig. 5: two line directions",
        scene: "floating-quad",
        spots: &SPOTS,
        estimators: &[
            "line-area[orientation=fixed:0,pieces=each]",
            "line-area[orientation=fixed:0.5,pieces=each]",
            "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5]",
            "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=average]",
            LINE1,
            LINE2,
            "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]",
            "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5,mis=average]",
            "line-solid-angle[orientation=spread:4]",
        ],
        samples: &[4, 16, 64, 256, 1024],
        trials: 64,
        papers: vec![paper(LINE1, -2.0), paper(LINE2, -3.0)],
        gallery: None,
    }
}

/// BSDF samples and lines on rough and glossy strips.
fn fig6() -> Figure<'static> {
    const SPOTS: [Spot; 2] = [
        Spot {
            label: "A: rough",
            pixel: [75, 140],
        },
        Spot {
            label: "B: glossy",
            pixel: [245, 140],
        },
    ];
    let names = [
        "point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=average]",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
    ];
    Figure {
        title: "Fig. 6: lines and BSDF samples on strips, rough to glossy",
        scene: "strips",
        spots: &SPOTS,
        estimators: &[
            "point-bsdf",
            LINE1,
            LINE2,
            "line-solid-angle[orientation=fixed:0]+point-bsdf",
            "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=average]",
            "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
            "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]+point-bsdf",
        ],
        samples: &[4, 16, 64, 256, 1024],
        trials: 64,
        papers: Vec::new(),
        gallery: gallery([320, 200], Budget::Samples(16), &names),
    }
}

/// The heuristic that smooths discontinuities.
fn fig7() -> Figure<'static> {
    const A: &str = "A: nothing between";
    const B: &str = "B: partly hidden";
    const SPOTS: [Spot; 2] = [
        Spot {
            label: A,
            pixel: [110, 165],
        },
        Spot {
            label: B,
            pixel: [98, 118],
        },
    ];
    const BALANCE: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf";
    const SMOOTH: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]";
    let paper = |spot: &str, estimator, order: f64| PaperOrder {
        scene: format!("strips, {spot}"),
        estimator,
        sampler: SamplerKind::MultiJitter,
        order: 0.5 * order,
        source: "Fig. 7, half the order of variance",
    };
    Figure {
        title: "Fig. 7: smoothed discontinuities",
        scene: "strips",
        spots: &SPOTS,
        estimators: &[
            "point-bsdf",
            LINE1,
            "line-solid-angle[orientation=fixed:0,pieces=one]+point-bsdf",
            "line-solid-angle[orientation=fixed:0,pieces=one]+point-bsdf[mis=smooth]",
            BALANCE,
            SMOOTH,
            "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth-fixed]",
        ],
        samples: &[16, 64, 256, 1024, 4096],
        trials: 96,
        papers: vec![
            paper(A, BALANCE, -1.4),
            paper(A, SMOOTH, -2.04),
            paper(B, BALANCE, -1.53),
            paper(B, SMOOTH, -1.68),
        ],
        gallery: None,
    }
}

/// All strategies on the Cornell box, for the same time.
fn fig8() -> Figure<'static> {
    let names = [
        "point-area",
        "point-solid-angle",
        "line-area[orientation=fixed:0,pieces=each]",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5,mis=average]",
        "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]",
        "line-projected",
        "line-analytic",
    ];
    Figure {
        title: "Fig. 8: the Cornell box, equal time",
        scene: "cornell-box-large",
        spots: &[],
        estimators: &[
            "point-solid-angle",
            LINE1,
            "line-projected",
            "line-analytic",
        ],
        samples: &[4, 16, 64],
        trials: 16,
        papers: Vec::new(),
        gallery: gallery([256, 256], Budget::Seconds(2.0), &names),
    }
}

/// Ratios of lines to BSDF samples: for the kitchen, which is not ours to ship.
fn fig9() -> Figure<'static> {
    let names = [
        "point-bsdf",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf:3",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
        "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf",
        LINE2,
        "point-solid-angle+point-bsdf:3",
        "point-solid-angle+point-bsdf",
        "point-solid-angle:3+point-bsdf",
        "point-solid-angle",
    ];
    Figure {
        title: "Fig. 9: ratios of lines to BSDF samples, equal time",
        scene: "",
        spots: &[],
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        samples: &[4, 16],
        trials: 8,
        papers: Vec::new(),
        gallery: gallery([96, 54], Budget::Seconds(5.0), &names),
    }
}

/// Plates from glossy to rough under lights of several sizes, for the same time.
fn fig10() -> Figure<'static> {
    let names = [
        "point-bsdf",
        "point-solid-angle",
        "point-solid-angle+point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]",
    ];
    Figure {
        title: "Fig. 10: plates, equal time",
        scene: "plates",
        spots: &[],
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        samples: &[4, 16, 64],
        trials: 16,
        papers: Vec::new(),
        gallery: gallery([240, 160], Budget::Seconds(4.0), &names),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every text is an estimator's, and prints as the paper's orders name it.
    #[test]
    fn all_estimators_are_understood() {
        for name in NAMES {
            let spec = spec(name, Some("x.pbrt")).unwrap();
            assert!(spec.estimators.len() >= 2, "{name}");
            assert!(
                spec.gallery.is_none_or(|g| g.estimators.len() >= 5),
                "{name}"
            );
        }
        for name in ["salesin-fig5", "salesin-fig7"] {
            let spec = spec(name, None).unwrap();
            for paper in &spec.papers {
                assert!(
                    spec.estimators
                        .iter()
                        .any(|e| e.to_string() == paper.estimator),
                    "{}",
                    paper.estimator
                );
                assert!(spec.views().iter().any(|v| v.label == paper.scene));
            }
        }
        assert!(spec("salesin-fig9", None).is_none());
    }
}
