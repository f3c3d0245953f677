//! The estimators in words, and where they come from.

use linelit_estimators::{Estimator, Technique};
use linelit_study::report::Entry;

const BILLEN: (&str, &str) = ("Billen & Dutré 2016", "https://doi.org/10.1111/cgf.12948");
const SALESIN: (&str, &str) = ("Salesin & Jarosz 2019", "https://doi.org/10.1111/cgf.13779");
const PETERS: (&str, &str) = ("Peters 2021", "https://doi.org/10.1111/cgf.14379");
const SHIRLEY: (&str, &str) = (
    "Shirley & Wang 1991",
    "https://doi.org/10.1007/978-3-642-57963-9_6",
);
const HEITZ: (&str, &str) = (
    "Heitz et al. 2016",
    "https://doi.org/10.1145/2897824.2925895",
);

/// A technique by its name, in a sentence, and its source.
type Words = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

const WORDS: [Words; 17] = [
    (
        "point-area",
        "N shadow rays to points uniform on the light's area.",
        &[],
    ),
    (
        "point-visible-area",
        "N shadow rays to points uniform on the part of the light that faces the shading point.",
        &[],
    ),
    (
        "point-solid-angle",
        "N shadow rays to points uniform in the solid angle of the light: near lights have less noise.",
        &[],
    ),
    (
        "point-proxy",
        "N shadow rays, uniform on triangles at unit distance that look nearly like the light.",
        &[SHIRLEY],
    ),
    (
        "point-projected-solid-angle",
        "N shadow rays uniform in the projected solid angle: no noise on diffuse surfaces that see all \
         of the light.",
        &[],
    ),
    (
        "point-ltc",
        "N shadow rays by linearly transformed cosines that look like the material.",
        &[HEITZ],
    ),
    (
        "point-texture",
        "N shadow rays to points in proportion to the image that the light emits.",
        &[],
    ),
    (
        "point-bsdf",
        "N rays in directions drawn from the material.",
        &[],
    ),
    (
        "point-linear",
        "N shadow rays to points on a linear light, by what the material makes of it.",
        &[PETERS],
    ),
    (
        "line-area",
        "N lines on the light; what is visible of each is found exactly, and lit by one point of it.",
        &[BILLEN],
    ),
    (
        "line-solid-angle",
        "N lines, and a point on the visible part of each, as a point uniform in solid angle would have \
         them.",
        &[SALESIN],
    ),
    (
        "line-warped",
        "N lines nearly uniform in solid angle, at less than half the cost of a line.",
        &[SALESIN],
    ),
    (
        "line-projected",
        "N lines by projected solid angle.",
        &[SALESIN],
    ),
    (
        "line-texture",
        "N lines, and points on them, by the image that the light emits.",
        &[],
    ),
    (
        "line-analytic",
        "N lines on the light; what is visible of each is found exactly, and its light integrated in \
         closed form where the material has one.",
        &[BILLEN],
    ),
    (
        "exact",
        "The visible part of the light as a polygon, and its light in closed form: no samples and no \
         noise where the material has a closed form and nothing with holes is in between; lines elsewhere.",
        &[],
    ),
    (
        "hybrid",
        "Whichever of exact, lines and points costs least for its error, chosen at each shading point by \
         what stands between it and the light.",
        &[],
    ),
];

/// The words on a technique.
fn words(technique: &Technique) -> Option<&'static Words> {
    WORDS.iter().find(|(name, ..)| *name == technique.name())
}

/// What an estimator is.
pub(super) fn entry(estimator: &Estimator) -> Entry {
    let all: Vec<&Words> = estimator
        .parts()
        .filter_map(|p| words(&p.technique))
        .collect();
    let mut text: Vec<&str> = all.iter().map(|(_, text, _)| *text).collect();
    if text.len() > 1 {
        text.insert(0, "Several techniques, weighted by their densities:");
    }
    let mut sources: Vec<(String, String)> = Vec::new();
    for (citation, address) in all.iter().flat_map(|(.., sources)| *sources) {
        let source = ((*citation).to_owned(), (*address).to_owned());
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    Entry {
        name: estimator.to_string(),
        words: text.join(" "),
        sources,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_has_words() {
        let names: Vec<&str> = Technique::all().map(|t| t.name()).collect();
        for technique in Technique::all() {
            assert!(words(&technique).is_some(), "{}", technique.name());
        }
        let unknown = WORDS.iter().find(|(name, ..)| !names.contains(name));
        assert!(unknown.is_none(), "{unknown:?}");
    }

    #[test]
    fn combinations_name_each_part_and_each_source_once() {
        let both: Estimator = "line-area+line-analytic+point-bsdf".parse().unwrap();
        let entry = entry(&both);
        assert!(entry.words.starts_with("Several") && entry.words.contains("drawn from"));
        assert_eq!(entry.sources.len(), 1);
    }
}
