//! What studies of pictures and tables set themselves, by the flag that would change it elsewhere.

/// What a study of pictures and tables fixes, in words: each field stands for the flag of
/// `converge` of its name.
///
/// Such a study repeats a figure or a table; a program that is asked to change what is fixed
/// refuses, and says this instead.
#[derive(Clone, Copy, Debug)]
pub struct Fixed {
    /// The estimators.
    pub estimators: &'static str,
    /// The sampling patterns.
    pub samplers: &'static str,
    /// Which lights a point samples.
    pub lights: &'static str,
    /// The form of emissive spheres, disks and cylinders.
    pub spheres: &'static str,
    /// The numbers of samples.
    pub samples: &'static str,
    /// The numbers of trials.
    pub trials: &'static str,
    /// The pixels.
    pub pixels: &'static str,
    /// The random numbers, where there are none that a seed would change.
    pub seed: Option<&'static str>,
    /// What there is in place of a scene, where none is read.
    pub no_scene: Option<&'static str>,
}

/// What a study of a figure sets in any case, where nothing more is to be said.
pub(super) const FIGURE: Fixed = Fixed {
    estimators: "those that its figure compares",
    samplers: "those of its figure",
    lights: "those of its figure",
    spheres: "those of its figure",
    samples: "those of its figure",
    trials: "those of its figure",
    pixels: "those of its figure",
    seed: None,
    no_scene: None,
};

const NO_SPHERES: &str = "there are none in its scenes";
const ONE_LIGHT: &str = "its scenes have one light";

pub(super) const CLAIMS: Fixed = Fixed {
    estimators: "those that its claims are about",
    samplers: "those of its claims",
    lights: "those of its claims",
    spheres: "exact",
    samples: "those of its claims",
    trials: "enough for its verdicts; more with --full",
    pixels: "few of each scene; more with --full",
    ..FIGURE
};

pub(super) const BILLEN_TABLE1: Fixed = Fixed {
    estimators: "line-analytic[orientation=parallel,control=none]",
    samplers: "stratified",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "1024 lines a point, and 4 single ones",
    trials: "one, timed again and again",
    pixels: "32x32",
    ..FIGURE
};

pub(super) const BILLEN_GROWTH: Fixed = Fixed {
    estimators: "line-analytic[orientation=parallel,control=none], and the visibility of single lines",
    samplers: "stratified",
    lights: "single lines, and scenes with one light",
    spheres: NO_SPHERES,
    samples: "256 single lines, and 1 and 1024 lines a point",
    trials: "5 runs, of which the fastest counts, and 6 in turns",
    pixels: "12x12",
    ..FIGURE
};

pub(super) const BILLEN_ORIGIN: Fixed = Fixed {
    estimators: "line-analytic[orientation=parallel,control=none], and lines through two points of the light",
    samplers: "independent and stratified",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "4 to 256 lines a point",
    trials: "16",
    pixels: "8x8",
    ..FIGURE
};

pub(super) const BILLEN_TIME: Fixed = Fixed {
    estimators: "point-area and line-analytic[orientation=parallel,control=none]",
    samplers: "independent, stratified and sobol",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "4 to 256 lines, 4 to 4096 points",
    trials: "6 rounds of 4 in turns",
    pixels: "8x8",
    ..FIGURE
};

pub(super) const PETERS_FIG3: Fixed = Fixed {
    estimators: "the paper's iteration in f64",
    samplers: "independent",
    lights: "lines, without a scene",
    spheres: "lines alone",
    samples: "two million random cases",
    trials: "one",
    pixels: "none",
    no_scene: Some("lines, without a scene"),
    ..FIGURE
};

pub(super) const SALESIN_FIG4: Fixed = Fixed {
    estimators: "lines in two directions and BSDF samples, by three weights",
    samplers: "none: weights are computed, not sampled",
    lights: "one square, without a scene",
    spheres: "one square",
    samples: "none: weights are computed, not sampled",
    trials: "none: weights are computed, not sampled",
    pixels: "pictures of 256x256 places on the light",
    seed: Some("nothing is random"),
    no_scene: Some("one square behind two triangles"),
};

pub(super) const SALESIN_GAIN: Fixed = Fixed {
    estimators: "line-solid-angle and point-bsdf, alone and together by two weights",
    samplers: "multijitter and independent",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "16 to 1024, at one point to 16384",
    trials: "64",
    pixels: "16 points of `strips`",
    ..FIGURE
};

pub(super) const SALESIN_RAYS: Fixed = Fixed {
    estimators: "those of the pictures of Figs. 1 and 8 to 11",
    samplers: "independent, and multijitter for our terms",
    lights: "all",
    spheres: NO_SPHERES,
    samples: "1 and 4 a camera ray, and 16",
    trials: "6 batches of 16 camera rays",
    pixels: "pictures of 24 to 32 pixels across",
    ..FIGURE
};

pub(super) const BILLEN_FIGURES: Fixed = Fixed {
    estimators: "line-analytic in the orientations and densities of the figures",
    samplers: "stratified",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "4 lines a point in Figs. 2 and 3, 64 in Fig. 5",
    trials: "one of each picture",
    pixels: "pictures of 256x256",
    ..FIGURE
};

pub(super) const PETERS_FIG1: Fixed = Fixed {
    estimators: "point-linear by the techniques and heuristics of the figure",
    samplers: "blue noise",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "1 and 2 a pixel",
    trials: "6",
    pixels: "a picture of 320x200",
    ..FIGURE
};

pub(super) const PETERS_FIG4: Fixed = Fixed {
    estimators: "projected solid angle as printed and ours",
    samplers: "independent",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "16 a pixel, of which the worst counts",
    trials: "one",
    pixels: "a picture of 256x256",
    ..FIGURE
};

pub(super) const PETERS_FIG6: Fixed = Fixed {
    estimators: "point-linear by every technique",
    samplers: "blue noise",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "1 a pixel",
    trials: "8",
    pixels: "a picture of 256x256",
    ..FIGURE
};

pub(super) const PETERS_FIG7: Fixed = Fixed {
    estimators: "point-linear[technique=ltc]",
    samplers: "the four that the figure compares",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "3 of each of its two techniques",
    trials: "4",
    pixels: "a picture of 224x224",
    ..FIGURE
};

pub(super) const PETERS_TABLE1: Fixed = Fixed {
    estimators: "every technique for linear lights, alone",
    samplers: "no pattern: fixed numbers, spread evenly",
    lights: "one line, and those of two scenes with one each",
    spheres: "two rectangles beside the line",
    samples: "128 of a light, and one",
    trials: "60 rounds, of which the fastest counts",
    pixels: "512 points around the light, and 32x16 of each scene",
    seed: Some("fixed numbers, spread evenly"),
    ..FIGURE
};

pub(super) const SHIRLEY: Fixed = Fixed {
    estimators: "point-solid-angle, and three densities on a sphere",
    samplers: "independent",
    lights: "all, and one by each of the probabilities that are compared",
    spheres: "exact",
    samples: "those of the figures, from 1 to 1024",
    trials: "one of each picture; 8 and 32 of the ten thousand luminaires",
    pixels: "pictures of 128x128",
    ..FIGURE
};
