//! Salesin & Jarosz 2019, Figs. 1, 3 and 5 to 11: points and lines in one estimator.
//!
//! The paper plots variance; its orders are halved here, to be orders of the standard deviation.

use linelit_integrator::Estimator;
use linelit_samplers::SamplerKind;
use linelit_study::pixels::{Pixels, Resolution};
use linelit_study::record::PaperOrder;
use linelit_study::scene_study::{Budget, Gallery, Spot, StudySpec};

/// The name of a figure's study, what it shows in a line, and how it is made.
type Figure = (&'static str, &'static str, fn() -> StudySpec);

const FIGURES: [Figure; 9] = [
    (
        "salesin-fig1",
        "points, lines and BSDF samples for the same time (Salesin & Jarosz 2019, Fig. 1)",
        fig1,
    ),
    (
        "salesin-fig3",
        "one sample a pixel: what solid angle adds to lines (Salesin & Jarosz 2019, Fig. 3)",
        fig3,
    ),
    (
        "salesin-fig5",
        "two directions of lines, one without a discontinuity (Salesin & Jarosz 2019, Fig. 5)",
        fig5,
    ),
    (
        "salesin-fig6",
        "BSDF samples and lines on rough and glossy strips (Salesin & Jarosz 2019, Fig. 6)",
        fig6,
    ),
    (
        "salesin-fig7",
        "the heuristic that smooths discontinuities (Salesin & Jarosz 2019, Fig. 7)",
        fig7,
    ),
    (
        "salesin-fig8",
        "all strategies on the Cornell box, for the same time (Salesin & Jarosz 2019, Fig. 8)",
        fig8,
    ),
    (
        "salesin-fig9",
        "ratios of lines to BSDF samples, on a scene of your own (Salesin & Jarosz 2019, Fig. 9)",
        fig9,
    ),
    (
        "salesin-fig10",
        "plates from glossy to rough under lights of several sizes (Salesin & Jarosz 2019, Fig. 10)",
        fig10,
    ),
    (
        "salesin-fig11",
        "points and lines that know a light's image or not (Salesin & Jarosz 2019, Fig. 11)",
        fig11,
    ),
];

/// The studies' names, and what each shows.
pub(super) fn studies() -> impl Iterator<Item = (&'static str, &'static str)> {
    FIGURES.into_iter().map(|(name, about, _)| (name, about))
}

/// Lines along the first edge of the light, and across.
const LINE1: &str = "line-solid-angle[orientation=fixed:0]";
const LINE2: &str = "line-solid-angle[orientation=fixed:0.5]";

/// The study of a figure; `scene` replaces the built-in one. `None` for a figure that has no scene
/// of ours and was given none.
pub(super) fn spec(name: &str, scene: Option<&str>) -> Option<StudySpec> {
    let (.., figure) = FIGURES.into_iter().find(|figure| figure.0 == name)?;
    let mut spec = figure();
    if let Some(scene) = scene.filter(|scene| spec.scenes != [*scene]) {
        spec.scenes = vec![scene.to_owned()];
        spec.spots.clear();
    }
    (!spec.scenes.is_empty()).then_some(spec)
}

/// Orders over the image from few samples; a title without the paper's name, and our scene if there
/// is one.
fn study(title: &str, scene: &str, names: &[&str]) -> StudySpec {
    StudySpec {
        title: format!("Salesin & Jarosz 2019, {title}"),
        scenes: (!scene.is_empty())
            .then(|| scene.to_owned())
            .into_iter()
            .collect(),
        estimators: estimators(names),
        samplers: vec![SamplerKind::MultiJitter],
        samples: vec![4, 16, 64],
        pixels: Pixels::Grid(Resolution {
            width: 32,
            height: 20,
        }),
        ..StudySpec::default()
    }
}

/// The estimators of these texts; a text that is none stops the study before it begins.
fn estimators(names: &[&str]) -> Vec<Estimator> {
    let parse = |name: &&str| name.parse().expect("texts of this file name estimators");
    names.iter().map(parse).collect()
}

fn gallery([width, height]: [u32; 2], budget: Budget, names: &[&str]) -> Option<Gallery> {
    Some(Gallery {
        width,
        height,
        budget,
        sampler: SamplerKind::MultiJitter,
        estimators: estimators(names),
        reference_rounds: 4,
    })
}

/// Points and lines, alone and with BSDF samples, for the same time.
fn fig1() -> StudySpec {
    const NAMES: &[&str] = &[
        "point-bsdf",
        "point-solid-angle",
        "point-solid-angle+point-bsdf",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+point-bsdf",
        "line-warped[orientation=fixed:0]+point-bsdf",
        "line-area[orientation=fixed:0]+point-bsdf",
    ];
    StudySpec {
        gallery: gallery([320, 200], Budget::Seconds(3.0), NAMES),
        ..study(
            "Fig. 1: monoliths, equal time",
            "monoliths",
            &[
                "point-solid-angle+point-bsdf",
                "line-solid-angle+point-bsdf",
            ],
        )
    }
}

/// One sample a pixel: what solid angle adds to lines.
fn fig3() -> StudySpec {
    const NAMES: &[&str] = &[
        "point-area",
        "point-solid-angle",
        "line-area[orientation=fixed:0,pieces=one]",
        "line-solid-angle[orientation=fixed:0,pieces=one]",
        "line-solid-angle[orientation=fixed:0]",
        "line-projected[orientation=fixed:0]",
    ];
    StudySpec {
        samples: vec![1, 4, 16],
        gallery: gallery([256, 256], Budget::Samples(1), NAMES),
        ..study(
            "Fig. 3: one sample at each point",
            "cornell-box-large",
            &["point-solid-angle", "line-solid-angle"],
        )
    }
}

/// Two directions, one of which sees no discontinuity: alone, averaged, weighted.
fn fig5() -> StudySpec {
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
        sampler: SamplerKind::MultiJitter.to_string(),
        order: 0.5 * order,
        source: "Fig. 5, half the order of variance",
    };
    StudySpec {
        spots: SPOTS.to_vec(),
        samples: vec![4, 16, 64, 256, 1024],
        trials: 64,
        papers: vec![paper(LINE1, -2.0), paper(LINE2, -3.0)],
        ..study(
            "Fig. 5: two line directions",
            "floating-quad",
            &[
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
        )
    }
}

/// BSDF samples and lines on rough and glossy strips.
fn fig6() -> StudySpec {
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
    StudySpec {
        spots: SPOTS.to_vec(),
        samples: vec![4, 16, 64, 256, 1024],
        trials: 64,
        gallery: gallery([320, 200], Budget::Samples(16), NAMES),
        ..study(
            "Fig. 6: lines and BSDF samples on strips, rough to glossy",
            "strips",
            &[
                "point-bsdf",
                LINE1,
                LINE2,
                "line-solid-angle[orientation=fixed:0]+point-bsdf",
                "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=average]",
                "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=optimal]",
                "line-solid-angle[orientation=fixed:0.5]+point-bsdf",
                "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]+point-bsdf",
            ],
        )
    }
}

/// The heuristic that smooths discontinuities.
fn fig7() -> StudySpec {
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
    let paper = |spot: &str, estimator, sampler: SamplerKind, order: f64| PaperOrder {
        scene: format!("strips, {spot}"),
        estimator,
        sampler: sampler.to_string(),
        order: 0.5 * order,
        source: "Fig. 7, half the order of variance",
    };
    StudySpec {
        spots: SPOTS.to_vec(),
        // The paper's terms: multi-jittered, and independent, where no weight gains an order.
        samplers: vec![
            SamplerKind::Independent,
            SamplerKind::MultiJitter,
            SamplerKind::Sobol,
        ],
        samples: vec![64, 256, 1024, 4096],
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
        ..study(
            "Fig. 7: smoothed discontinuities",
            "strips",
            &[
                "point-bsdf",
                LINE1,
                "line-solid-angle[orientation=fixed:0,pieces=one]+point-bsdf",
                "line-solid-angle[orientation=fixed:0,pieces=one]+point-bsdf[mis=smooth]",
                BALANCE,
                SMOOTH,
                "line-solid-angle[orientation=fixed:0]+point-bsdf[mis=smooth-fixed]",
            ],
        )
    }
}

/// All strategies on the Cornell box, for the same time.
fn fig8() -> StudySpec {
    const NAMES: &[&str] = &[
        "point-area",
        "point-solid-angle",
        "line-area[orientation=fixed:0,pieces=each]",
        LINE1,
        "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5,mis=average]",
        "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]",
        "line-projected",
        "line-analytic[control=none]",
    ];
    StudySpec {
        gallery: gallery([256, 256], Budget::Seconds(2.0), NAMES),
        ..study(
            "Fig. 8: the Cornell box, equal time",
            "cornell-box-large",
            &[
                "point-solid-angle",
                LINE1,
                "line-projected",
                "line-analytic[control=none]",
            ],
        )
    }
}

/// Ratios of lines to BSDF samples: for the kitchen, which is not ours to ship.
fn fig9() -> StudySpec {
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
    StudySpec {
        samples: vec![4, 16],
        trials: 8,
        gallery: gallery([96, 54], Budget::Seconds(5.0), NAMES),
        ..study(
            "Fig. 9: ratios of lines to BSDF samples, equal time",
            "",
            &[
                "point-solid-angle+point-bsdf",
                "line-solid-angle+point-bsdf",
            ],
        )
    }
}

/// Plates from glossy to rough under lights of several sizes, for the same time.
fn fig10() -> StudySpec {
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
    StudySpec {
        gallery: gallery([240, 160], Budget::Seconds(4.0), NAMES),
        ..study(
            "Fig. 10: plates, equal time",
            "plates",
            &[
                "point-solid-angle+point-bsdf",
                "line-solid-angle+point-bsdf",
            ],
        )
    }
}

/// A light that emits an image: points and lines that know it or not, four samples each.
fn fig11() -> StudySpec {
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
    StudySpec {
        spots: SPOTS.to_vec(),
        samplers: vec![SamplerKind::Independent],
        samples: vec![4, 16, 64, 256],
        trials: 64,
        gallery: gallery([256, 256], Budget::Samples(4), NAMES),
        ..study("Fig. 11: a textured light, four samples", "window", NAMES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every text is an estimator's, and prints as the paper's orders name it.
    #[test]
    fn all_estimators_are_understood() {
        assert!(studies().all(|(name, _)| spec(name, Some("x.pbrt")).is_some()));
        for name in ["salesin-fig5", "salesin-fig7"] {
            let spec = spec(name, None).unwrap();
            for paper in &spec.papers {
                let text = |e: &Estimator| e.to_string() == paper.estimator;
                assert!(spec.estimators.iter().any(text), "{}", paper.estimator);
                assert!(spec.views().iter().any(|v| v.label == paper.scene));
            }
        }
        assert!(spec("salesin-fig9", None).is_none());
    }
}
