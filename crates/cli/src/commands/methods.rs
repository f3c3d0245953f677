//! The methods that each technique leads to on each kind of light and of reflection. They are found
//! by the same data by which estimators choose their methods.

use linelit_estimators::{Estimator, KnownKind, LightKind, MethodFacts, Technique};
use serde::Serialize;

/// The number of samples of each estimate for which the methods are found.
const SAMPLES: u32 = 16;

/// A technique, with the kinds of lights and reflections on which it leads to the same method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Method {
    pub technique: &'static str,
    pub lights: Vec<String>,
    pub reflections: Vec<&'static str>,
    pub does: String,
    /// The number of points that are sampled in place of the closed form that the technique is
    /// named for; `None` if the technique uses it.
    pub points_in_place: Option<u32>,
}

/// Returns the methods of all techniques, each alone, on all lights and reflections. Kinds of
/// lights and reflections for which a technique leads to the same method share a row.
pub(super) fn all() -> Vec<Method> {
    let mut all: Vec<Method> = Vec::new();
    for technique in Technique::all() {
        let first = all.len();
        for (_, light) in LightKind::ALL {
            for row in on_light(&technique, light) {
                let same = |other: &&mut Method| {
                    (&other.reflections, &other.does) == (&row.reflections, &row.does)
                };
                match all[first..].iter_mut().find(same) {
                    Some(other) => other.lights.extend(row.lights),
                    None => all.push(row),
                }
            }
        }
    }
    all
}

/// Returns the methods of a technique on a kind of light, for all kinds of reflections.
fn on_light(technique: &Technique, light: LightKind) -> Vec<Method> {
    let mut rows: Vec<Method> = Vec::new();
    for (name, known) in KnownKind::ALL {
        let (estimator, facts) = (
            Estimator::from(*technique),
            MethodFacts::new(light, known, SAMPLES),
        );
        let does = estimator.explain(&facts);
        match rows.iter_mut().find(|row| row.does == does) {
            Some(row) => row.reflections.push(name),
            None => rows.push(Method {
                technique: technique.name(),
                lights: vec![light.to_string()],
                reflections: vec![name],
                does,
                points_in_place: estimator.points_in_place(&facts),
            }),
        }
    }
    rows
}

/// Returns a remark that points are sampled in place of a closed form; it is empty if `points` is
/// `None`.
pub(super) fn in_place(points: Option<u32>) -> String {
    points.map_or_else(String::new, |points| {
        format!(" ({points} points in place of a closed form)")
    })
}

/// Returns the rows as text: each technique, and below it the method for each kind of lights and
/// reflections.
pub(super) fn lines() -> Vec<String> {
    let mut lines = Vec::new();
    let mut technique = "";
    for row in all() {
        if row.technique != technique {
            technique = row.technique;
            lines.push(technique.to_owned());
        }
        let lights = match row.lights.len() == LightKind::ALL.len() {
            true => "any light".to_owned(),
            false => row.lights.join(", "),
        };
        let reflections = match row.reflections.len() == KnownKind::ALL.len() {
            true => "any reflection".to_owned(),
            false => row.reflections.join(", "),
        };
        let note = in_place(row.points_in_place);
        lines.push(format!("  {lights}; {reflections}: {}{note}", row.does));
    }
    lines
}
