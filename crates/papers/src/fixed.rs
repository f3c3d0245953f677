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

pub(super) const BILLEN_TABLE1: Fixed = Fixed {
    estimators: "line-analytic[orientation=parallel]",
    samplers: "stratified",
    lights: ONE_LIGHT,
    spheres: NO_SPHERES,
    samples: "1024 lines a point",
    trials: "one, timed again and again",
    pixels: "32x32",
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
    trials: "4",
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
    lights: "one line, without a scene",
    spheres: "two rectangles beside the line",
    samples: "128 of a light, and one",
    trials: "60 rounds, of which the fastest counts",
    pixels: "512 points around the light",
    seed: Some("fixed numbers, spread evenly"),
    no_scene: Some("one line, without a scene"),
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
