//! What the words of a report mean.

use super::Entry;

/// Terms of a convergence study, in the order in which a reader meets them.
const GLOSSARY: [(&str, &str); 15] = [
    (
        "N, samples",
        "Light samples that each shading point draws of each light: points on the light (one shadow \
         ray each), or lines on it.",
    ),
    (
        "line sample",
        "A segment on the light. Which parts of it a shading point sees is found exactly, and their \
         light is integrated in closed form or by points on them.",
    ),
    (
        "pattern, sampler",
        "How random numbers are spread: independent of each other; stratified, one in each of N \
         cells; or sobol, Owen-scrambled points of a Sobol’ sequence.",
    ),
    (
        "penumbra",
        "Where part of the light is hidden: there, points are noisiest.",
    ),
    (
        "trial",
        "One estimate of all pixels. Trials differ in their seed alone, and are independent.",
    ),
    (
        "reference",
        "What errors are measured against: the mean of many estimates with far more samples, whose \
         own error is stated.",
    ),
    (
        "MSE, RMSE",
        "Mean squared error over trials, pixels and colour channels, on linear radiance that is never \
         tone-mapped, less the reference’s own by the spread of its replicates; 0 where that is \
         negative. RMSE is its square root.",
    ),
    (
        "MRSE",
        "The mean of the same squared errors each divided by the reference’s square there and 10⁻⁶: \
         dark pixels count as much as bright ones.",
    ),
    (
        "variance, no noise",
        "Mean squared distance of an estimate from the mean of its trials. Where that is rounding \
         alone the estimator has no noise: it is a closed form, and its MSE is 0 or what rounding and \
         the reference leave. Plots mark it by open marks on the edge.",
    ),
    (
        "bias",
        "Mean of estimate − reference. bias / s.e. is how many standard errors that is: an unbiased \
         estimator stays within about three.",
    ),
    (
        "time",
        "Processor time of one trial on all pixels: loading and building are not in it. It grows \
         where other programs run; counts of rays and tests do not.",
    ),
    (
        "order",
        "The slope of log σ over log N, σ being the standard deviation: −0.5 for independent samples, \
         which need four times as many for half the error; −1 needs twice as many.",
    ),
    (
        "95 %",
        "The interval that holds the order in 95 of 100 such studies, from the spread of \
         fits without one trial each; none below five trials.",
    ),
    (
        "efficiency",
        "1/(MSE · time): twice the efficiency is the same error in half the time, for independent \
         samples.",
    ),
    (
        "lack of fit",
        "χ² of the fitted line over its degrees of freedom: about one where the curve is straight.",
    ),
];

/// The glossary of a convergence study.
pub(super) fn glossary() -> Vec<Entry> {
    let entry = |(name, words): (&str, &str)| Entry {
        name: name.to_owned(),
        words: words.to_owned(),
        sources: Vec::new(),
    };
    GLOSSARY.map(entry).into()
}
