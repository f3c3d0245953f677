//! Descriptions of the estimators in words, with the papers that they come from, for reports and
//! help.

use crate::report::Entry;
use linelit_estimators::{Estimator, Technique};

/// The papers that techniques come from: the citation and the address of each.
const SOURCES: [[&str; 2]; 5] = [
    ["Billen & Dutré 2016", "https://doi.org/10.1111/cgf.12948"],
    [
        "Heitz et al. 2016",
        "https://doi.org/10.1145/2897824.2925895",
    ],
    ["Peters 2021", "https://doi.org/10.1111/cgf.14379"],
    ["Salesin & Jarosz 2019", "https://doi.org/10.1111/cgf.13779"],
    [
        "Shirley & Wang 1991",
        "https://doi.org/10.1007/978-3-642-57963-9_6",
    ],
];

/// The techniques, one in each line: the name, what it does, and its paper in brackets if it has
/// one.
const WORDS: &str = "\
point-area: points uniform on the area
point-visible-area: points uniform on the part that faces the shading point (spheres)
point-solid-angle: points uniform in the solid angle
point-proxy: points by the triangles that a polygon spans at unit distance [Shirley & Wang 1991]
point-projected-solid-angle: points uniform in the projected solid angle
point-ltc: points by transformed cosines that look like the reflection [Heitz et al. 2016]
point-texture: points by the image of a textured light
point-bsdf: directions drawn from the material
point-linear: points on linear lights by one of Peters' techniques [Peters 2021]
line-area: lines, a point of what is visible of each, uniform in length [Billen & Dutré 2016]
line-solid-angle: lines, points on them uniform in solid angle [Salesin & Jarosz 2019]
line-warped: nearly the same for less than half of the time a line [Salesin & Jarosz 2019]
line-projected: lines, points on them uniform in projected solid angle [Salesin & Jarosz 2019]
line-texture: lines, and points on them, by the image of a textured light
line-analytic: lines, the light along their visible parts in closed form [Billen & Dutré 2016]
exact: closed form over what is visible, lines past holes
hybrid: the cheapest of exact, lines, points and rays, at each point: the default
";

/// Returns the line about a technique, without its name.
fn line(technique: &Technique) -> &'static str {
    let mut lines = WORDS.lines().filter_map(|line| line.split_once(": "));
    let own = lines.find(|(name, _)| *name == technique.name());
    own.map_or("", |(_, line)| line)
}

/// Returns a description of a technique in one line; `docs/estimators.md` has more.
#[must_use]
pub fn about(technique: &Technique) -> &'static str {
    let line = line(technique);
    line.split_once(" [").map_or(line, |(words, _)| words)
}

/// Returns the description of an estimator for the report.
pub(super) fn entry(estimator: &Estimator) -> Entry {
    let techniques = || estimator.parts().iter().map(|part| part.technique);
    let mut words: Vec<&str> = techniques().map(|t| about(&t)).collect();
    if words.len() > 1 {
        words.insert(0, "several techniques, weighted by their densities");
    }
    let cited = |citation: &str| techniques().any(|t| line(&t).contains(citation));
    let sources = SOURCES.into_iter().filter(|[citation, _]| cited(citation));
    Entry {
        name: estimator.to_string(),
        words: words.join("; "),
        sources: sources
            .map(|source| source.map(str::to_owned).into())
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_has_words_and_every_source_is_known() {
        for technique in Technique::all() {
            assert!(!about(&technique).is_empty(), "{}", technique.name());
            let cited = line(&technique).strip_prefix(about(&technique)).unwrap();
            let known = |[citation, _]: &[&str; 2]| cited == format!(" [{citation}]");
            assert!(cited.is_empty() || SOURCES.iter().any(known), "{cited}");
        }
        assert_eq!(WORDS.lines().count(), Technique::all().count());
    }

    #[test]
    fn combinations_name_each_part_and_each_source_once() {
        let both: Estimator = "line-area+line-analytic+point-bsdf".parse().unwrap();
        let entry = entry(&both);
        assert!(entry.words.starts_with("several") && entry.words.contains("drawn from"));
        assert_eq!(entry.sources.len(), 1);
    }
}
