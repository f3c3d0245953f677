//! The estimators in words, and where they come from.

use crate::report::Entry;
use linelit_estimators::{Estimator, Technique};

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

/// A technique by its name, in a line, and its source.
type Words = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

const WORDS: [Words; 17] = [
    ("point-area", "points uniform on the area", &[]),
    (
        "point-visible-area",
        "points uniform on the part that faces the shading point (spheres)",
        &[],
    ),
    (
        "point-solid-angle",
        "points uniform in the solid angle",
        &[],
    ),
    (
        "point-proxy",
        "points by the triangles that a polygon spans at unit distance",
        &[SHIRLEY],
    ),
    (
        "point-projected-solid-angle",
        "points uniform in the projected solid angle",
        &[],
    ),
    (
        "point-ltc",
        "points by transformed cosines that look like the reflection",
        &[HEITZ],
    ),
    (
        "point-texture",
        "points by the image of a textured light",
        &[],
    ),
    ("point-bsdf", "directions drawn from the material", &[]),
    (
        "point-linear",
        "points on linear lights by one of Peters' techniques",
        &[PETERS],
    ),
    (
        "line-area",
        "lines, a point of what is visible of each, uniform in length",
        &[BILLEN],
    ),
    (
        "line-solid-angle",
        "lines, points on them uniform in solid angle",
        &[SALESIN],
    ),
    (
        "line-warped",
        "nearly the same for less than half of the time a line",
        &[SALESIN],
    ),
    (
        "line-projected",
        "lines, points on them uniform in projected solid angle",
        &[SALESIN],
    ),
    (
        "line-texture",
        "lines, and points on them, by the image of a textured light",
        &[],
    ),
    (
        "line-analytic",
        "lines, the light along their visible parts in closed form",
        &[BILLEN],
    ),
    (
        "exact",
        "closed form over what is visible, lines past holes",
        &[],
    ),
    (
        "hybrid",
        "the cheapest of exact, lines, points and rays, at each point: the default",
        &[],
    ),
];

/// The words on a technique.
fn words(technique: &Technique) -> Option<&'static Words> {
    WORDS.iter().find(|(name, ..)| *name == technique.name())
}

/// What a technique does, in a line; `docs/estimators.md` says more.
#[must_use]
pub fn about(technique: &Technique) -> &'static str {
    words(technique).map_or("", |(_, about, _)| about)
}

/// What an estimator is.
pub(super) fn entry(estimator: &Estimator) -> Entry {
    let all: Vec<&Words> = estimator
        .parts()
        .filter_map(|p| words(&p.technique))
        .collect();
    let mut text: Vec<&str> = all.iter().map(|(_, text, _)| *text).collect();
    if text.len() > 1 {
        text.insert(0, "several techniques, weighted by their densities");
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
        words: text.join("; "),
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
        assert!(entry.words.starts_with("several") && entry.words.contains("drawn from"));
        assert_eq!(entry.sources.len(), 1);
    }
}
