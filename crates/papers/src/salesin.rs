//! Salesin & Jarosz 2019, Figs. 1, 3 and 5 to 11: points and lines in one estimator.
//!
//! The paper plots variance; its orders are halved here, to be orders of the standard deviation.

use linelit_integrator::{Estimator, LightChoice};
use linelit_samplers::SamplerKind;
use linelit_study::pixels::{Pixels, Resolution};
use linelit_study::spec::{Budget, Gallery, PaperOrder, REFERENCE_LIMIT, Spot, StudySpec};
use std::time::Duration;

/// The studies' names.
pub(super) const NAMES: [&str; 9] = [
    "salesin-fig1",
    "salesin-fig3",
    "salesin-fig5",
    "salesin-fig6",
    "salesin-fig7",
    "salesin-fig8",
    "salesin-fig9",
    "salesin-fig10",
    "salesin-fig11",
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
    samplers: &'a [SamplerKind],
    samples: &'a [u32],
    trials: u32,
    papers: Vec<PaperOrder>,
    gallery: Option<Pictures<'a>>,
}

impl Default for Figure<'_> {
    /// Orders over the image from few samples.
    fn default() -> Self {
        Self {
            title: "",
            scene: "",
            spots: &[],
            estimators: &[],
            samplers: &[SamplerKind::MultiJitter],
            samples: &[4, 16, 64],
            trials: 16,
            papers: Vec::new(),
            gallery: None,
        }
    }
}

/// A gallery, before its texts are read.
struct Pictures<'a> {
    size: [u32; 2],
    budget: Budget,
    estimators: &'a [&'a str],
}

/// The study of a figure; `scene` replaces the built-in one. `None` for a figure that has no scene
/// of ours and was given none.
pub(super) fn spec(name: &str, scene: Option<&str>) -> Option<StudySpec> {
    let figure = figure(name)?;
    let scene = scene.unwrap_or(figure.scene);
    let built_in = scene == figure.scene;
    (!scene.is_empty()).then(|| StudySpec {
        title: format!("Salesin & Jarosz 2019, {}", figure.title),
        scenes: vec![scene.to_owned()],
        estimators: estimators(figure.estimators),
        samplers: figure.samplers.to_vec(),
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
        gallery: figure.gallery.as_ref().map(Pictures::gallery),
        reference_limit: REFERENCE_LIMIT,
        cell_seconds: linelit_study::engine::CELL_SECONDS,
    })
}

fn figure(name: &str) -> Option<Figure<'static>> {
    Some(match name {
        "salesin-fig1" => fig1(),
        "salesin-fig3" => fig3(),
        "salesin-fig5" => fig5(),
        "salesin-fig6" => fig6(),
        "salesin-fig7" => fig7(),
        "salesin-fig8" => fig8(),
        "salesin-fig9" => fig9(),
        "salesin-fig10" => fig10(),
        "salesin-fig11" => fig11(),
        _ => return None,
    })
}

/// The estimators of these texts; a text that is none stops the study before it begins.
fn estimators(names: &[&str]) -> Vec<Estimator> {
    let parse = |name: &&str| name.parse().expect("texts of this file name estimators");
    names.iter().map(parse).collect()
}

impl Pictures<'_> {
    fn gallery(&self) -> Gallery {
        Gallery {
            width: self.size[0],
            height: self.size[1],
            budget: self.budget,
            sampler: SamplerKind::MultiJitter,
            estimators: estimators(self.estimators),
            reference_limit: Duration::from_secs(40),
        }
    }
}

/// Points and lines, alone and with BSDF samples, for the same time.
fn fig1() -> Figure<'static> {
    const NAMES: &[&str] = &[
        "point-bsdf",
        "point-solid-angle",
        "point-solid-angle+point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-warped[orientation=fixed:0]+point-bsdf",
        "line-area[orientation=fixed:0]+point-bsdf",
    ];
    Figure {
        title: "Fig. 1: monoliths, equal time",
        scene: "monoliths",
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        gallery: Some(Pictures {
            size: [320, 200],
            budget: Budget::Seconds(3.0),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// One sample a pixel: what solid angle adds to lines.
fn fig3() -> Figure<'static> {
    const NAMES: &[&str] = &[
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
        estimators: &["point-solid-angle", "line-solid-angle"],
        samples: &[1, 4, 16],
        gallery: Some(Pictures {
            size: [256, 256],
            budget: Budget::Samples(1),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// Two directions, one of which sees no discontinuity: alone, averaged, weighted.
fn fig5() -> Figure<'static> {
    const SCENE: &str = "floating-quad, A: shadow edge across the second direction";
    const SPOTS: [Spot; 2] = [
        Spot {
            label: "A: shadow edge across the second direction",
            pixel: [128, 240],
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
        ..Figure::default()
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
    const NAMES: &[&str] = &[
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
            "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=optimal]",
            "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
            "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]+point-bsdf",
        ],
        samples: &[4, 16, 64, 256, 1024],
        trials: 64,
        gallery: Some(Pictures {
            size: [320, 200],
            budget: Budget::Samples(16),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// The heuristic that smooths discontinuities.
fn fig7() -> Figure<'static> {
    const JITTER: SamplerKind = SamplerKind::MultiJitter;
    const A: &str = "A: nothing between";
    const B: &str = "B: partly hidden";
    const SPOTS: [Spot; 2] = [
        Spot {
            label: A,
            pixel: [120, 185],
        },
        Spot {
            label: B,
            pixel: [98, 122],
        },
    ];
    const BALANCE: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf";
    const SMOOTH: &str = "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]";
    let paper = |spot: &str, estimator, sampler, order: f64| PaperOrder {
        scene: format!("strips, {spot}"),
        estimator,
        sampler,
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
        samplers: &[SamplerKind::MultiJitter, SamplerKind::Sobol],
        samples: &[64, 256, 1024, 4096],
        trials: 64,
        papers: vec![
            paper(A, BALANCE, JITTER, -1.4),
            paper(A, SMOOTH, JITTER, -2.04),
            paper(B, BALANCE, JITTER, -1.53),
            paper(B, SMOOTH, JITTER, -1.68),
            // Sobol' points, which the paper does not have.
            paper(A, SMOOTH, SamplerKind::Sobol, -2.04),
            paper(B, SMOOTH, SamplerKind::Sobol, -1.68),
        ],
        ..Figure::default()
    }
}

/// All strategies on the Cornell box, for the same time.
fn fig8() -> Figure<'static> {
    const NAMES: &[&str] = &[
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
        estimators: &[
            "point-solid-angle",
            LINE1,
            "line-projected",
            "line-analytic",
        ],
        gallery: Some(Pictures {
            size: [256, 256],
            budget: Budget::Seconds(2.0),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// Ratios of lines to BSDF samples: for the kitchen, which is not ours to ship.
fn fig9() -> Figure<'static> {
    const NAMES: &[&str] = &[
        "point-bsdf",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf:3",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
        "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf",
        LINE2,
        "line-area[orientation=fixed:0.5]+point-bsdf",
        "line-area:3[orientation=fixed:0.5]+point-bsdf",
        "point-solid-angle+point-bsdf:3",
        "point-solid-angle+point-bsdf",
        "point-solid-angle:3+point-bsdf",
        "point-solid-angle",
    ];
    Figure {
        title: "Fig. 9: ratios of lines to BSDF samples, equal time",
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        samples: &[4, 16],
        trials: 8,
        gallery: Some(Pictures {
            size: [96, 54],
            budget: Budget::Seconds(5.0),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// Plates from glossy to rough under lights of several sizes, for the same time.
fn fig10() -> Figure<'static> {
    const NAMES: &[&str] = &[
        "point-bsdf",
        "point-solid-angle",
        "point-solid-angle+point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth]",
        "line-warped[orientation=fixed:0]+point-bsdf",
        "line-area[orientation=fixed:0]+point-bsdf",
    ];
    Figure {
        title: "Fig. 10: plates, equal time",
        scene: "plates",
        estimators: &[
            "point-solid-angle+point-bsdf",
            "line-solid-angle+point-bsdf",
        ],
        gallery: Some(Pictures {
            size: [240, 160],
            budget: Budget::Seconds(4.0),
            estimators: NAMES,
        }),
        ..Figure::default()
    }
}

/// A light that emits an image: points and lines that know it or not, four samples each.
fn fig11() -> Figure<'static> {
    const NAMES: &[&str] = &[
        "point-solid-angle",
        "point-texture",
        LINE1,
        "point-texture:3+line-solid-angle[orientation=fixed:0]",
        "point-texture+line-solid-angle:3[orientation=fixed:0]",
        "line-texture[orientation=fixed:0]",
        "line-texture[orientation=fixed:0]+line-solid-angle[orientation=fixed:0]",
    ];
    const SPOTS: [Spot; 2] = [
        Spot {
            label: "A: beside the window",
            pixel: [58, 60],
        },
        Spot {
            label: "B: on the floor",
            pixel: [150, 225],
        },
    ];
    Figure {
        title: "Fig. 11: a textured light, four samples",
        scene: "window",
        spots: &SPOTS,
        estimators: NAMES,
        samplers: &[SamplerKind::Independent],
        samples: &[4, 16, 64, 256],
        trials: 64,
        gallery: Some(Pictures {
            size: [256, 256],
            budget: Budget::Samples(4),
            estimators: NAMES,
        }),
        ..Figure::default()
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
            let figure = figure(name).unwrap();
            assert_eq!(spec.estimators.len(), figure.estimators.len(), "{name}");
            if let (Some(read), Some(texts)) = (&spec.gallery, &figure.gallery) {
                assert_eq!(read.estimators.len(), texts.estimators.len(), "{name}");
            }
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
