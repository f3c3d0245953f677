//! Rules about who may depend on whom.

use super::House;
use crate::manifest;
use std::fs;

/// Crate, crates of the house it may know, crates of others it may know. The table of
/// `docs/architecture.md`.
const MAY_KNOW: &[(&str, &[&str], &[&str])] = &[
    ("simd", &[], &[]),
    ("geometry", &[], &["glam", "smallvec"]),
    ("samplers", &[], &["rand", "rand_pcg", "sobol_burley"]),
    ("lights", &["geometry"], &[]),
    ("bsdf", &["geometry"], &[]),
    ("shading", &["geometry", "simd"], &[]),
    ("penumbra", &["geometry"], &[]),
    ("visibility", &["geometry", "simd"], &["obvhs", "rayon"]),
    ("mis", &[], &[]),
    ("scene", &["geometry", "lights", "bsdf"], &[]),
    (
        "assembly",
        &["scene", "geometry", "film"],
        &["flate2", "strsim", "thiserror"],
    ),
    ("pbrt", &["assembly", "scene", "geometry", "lights"], &[]),
    (
        "formats",
        // Lights and film in tests.
        &["assembly", "pbrt", "scene", "geometry", "lights", "film"],
        &["base64", "gltf", "serde", "serde_json", "tobj"],
    ),
    (
        "estimators",
        &[
            "geometry",
            "samplers",
            "mis",
            "lights",
            "bsdf",
            "penumbra",
            "visibility",
            "shading",
        ],
        &[],
    ),
    (
        "integrator",
        &[
            "scene",
            "geometry",
            "lights",
            "samplers",
            "bsdf",
            "shading",
            "visibility",
            "estimators",
        ],
        &[],
    ),
    (
        "film",
        &[],
        &["exr", "flate2", "png", "thiserror", "zune-jpeg"],
    ),
    (
        "scenes",
        &["geometry", "lights", "scene", "formats", "film"],
        &["anyhow"],
    ),
    (
        "study",
        &[
            "scene",
            "geometry",
            "samplers",
            "estimators",
            "integrator",
            "film",
        ],
        &[
            "anyhow",
            "base64",
            "rand",
            "rand_pcg",
            "indicatif",
            "maud",
            "rayon",
            "rustix",
            "serde",
            "serde_json",
        ],
    ),
    (
        "papers",
        &[
            "scene",
            "formats",
            "scenes",
            "geometry",
            "lights",
            "samplers",
            "bsdf",
            "shading",
            "estimators",
            "integrator",
            "film",
            "study",
        ],
        &["anyhow", "indicatif", "serde", "serde_json"],
    ),
    (
        "linelit",
        &[
            "assembly",
            "bsdf",
            "estimators",
            "film",
            "formats",
            "geometry",
            "integrator",
            "lights",
            "mis",
            "pbrt",
            "penumbra",
            "simd",
            "samplers",
            "scene",
            "shading",
            "study",
            "visibility",
        ],
        &[],
    ),
    (
        "cli",
        &[
            "scene",
            "formats",
            "scenes",
            "geometry",
            "lights",
            "bsdf",
            "simd",
            "samplers",
            "integrator",
            "film",
            "study",
            "papers",
        ],
        &[
            "anyhow",
            "clap",
            "indicatif",
            "rayon",
            "rustix",
            "serde",
            "serde_json",
        ],
    ),
    (
        "workshop",
        &[
            "scene",
            "formats",
            "scenes",
            "geometry",
            "lights",
            "shading",
            "testkit",
            "bsdf",
            "simd",
            "samplers",
            "visibility",
            "estimators",
            "integrator",
            "film",
            "study",
            "cli",
        ],
        &[
            "anyhow",
            "clap",
            "indicatif",
            "obvhs",
            "rand",
            "rand_pcg",
            "rayon",
            "serde",
            "serde_json",
        ],
    ),
    ("testkit", &[], &["dashu-float", "puruspe", "proptest"]),
    ("xtask", &[], &[]),
];

/// What any crate may use in its tests and benches, beside what it may know anyway.
const FOR_TESTS: &[&str] = &[
    "linelit-testkit",
    // Scenes for benches and tests of queries.
    "linelit-scenes",
    // What shading's transformed cosines are fitted to.
    "linelit-bsdf",
    "proptest",
    "criterion",
    "insta",
    "sobol_burley",
    "serde_json",
    "rustix",
];

pub(super) fn dependency_table(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let folder = member
            .folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let Some((_, ours, theirs)) = MAY_KNOW.iter().find(|(name, ..)| *name == folder) else {
            problems.push(format!(
                "crates/{folder}: not in the table of crates (tidy and docs/architecture.md)"
            ));
            continue;
        };
        let allowed = |name: &str| match name.strip_prefix("linelit-") {
            Some(short) => ours.contains(&short),
            None => theirs.contains(&name),
        };
        for (name, _) in member.dependencies.iter().chain(&member.other_dependencies) {
            if !allowed(name) {
                problems.push(format!("{}: may not depend on {name}", member.name));
            }
        }
        for (name, _) in &member.dev_dependencies {
            // Tests of the crates that end in images may look at the whole way.
            let whole_way = matches!(folder.as_str(), "integrator" | "study" | "cli")
                && name.starts_with("linelit-");
            if !allowed(name) && !FOR_TESTS.contains(&name.as_str()) && !whole_way {
                problems.push(format!(
                    "{}: may not depend on {name}, not even in tests",
                    member.name
                ));
            }
        }
    }
    problems
}

/// What is for this repository alone: tests, tools, and what leans on the papers' numbers.
const UNPUBLISHED: [&str; 5] = [
    "linelit-testkit",
    "linelit-papers",
    "linelit-cli",
    "linelit-workshop",
    "xtask",
];

pub(super) fn hygiene(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let name = &member.name;
        if !member.inherits_lints {
            problems.push(format!("{name}: [lints] workspace = true is missing"));
        }
        let all = [
            &member.dependencies,
            &member.dev_dependencies,
            &member.other_dependencies,
        ];
        for (dependency, value) in all.into_iter().flatten() {
            if !value.contains("workspace") {
                problems.push(format!(
                    "{name}: {dependency} has its own version; versions stand in the root manifest"
                ));
            }
        }
        let has = |key: &str| member.package.iter().any(|(k, _)| k == key);
        let published = !member
            .package
            .iter()
            .any(|(k, v)| k == "publish" && v.contains("false"));
        for key in [
            "description",
            "readme",
            "license",
            "repository",
            "keywords",
            "categories",
            "rust-version",
        ] {
            if published && !has(key) {
                problems.push(format!(
                    "{name}: package.{key} is missing, crates.io wants it"
                ));
            }
        }
        if UNPUBLISHED.contains(&name.as_str()) == published {
            problems.push(format!(
                "{name}: publish = false belongs to {}, and to them alone",
                UNPUBLISHED.join(", ")
            ));
        }
    }
    problems
}

pub(super) fn unused_workspace_dependencies(house: &House) -> Vec<String> {
    let text = fs::read_to_string(house.root.join("Cargo.toml")).unwrap_or_default();
    let sections = manifest::sections(&text);
    let declared = sections
        .iter()
        .filter(|(name, _)| name == "workspace.dependencies")
        .flat_map(|(_, e)| e);
    let used = |name: &str| {
        house.members.iter().any(|m| {
            let all = [&m.dependencies, &m.dev_dependencies, &m.other_dependencies];
            all.into_iter().flatten().any(|(k, _)| k == name)
        })
    };
    declared
        .filter(|(name, _)| !used(name))
        .map(|(name, _)| format!("Cargo.toml: nobody uses the workspace dependency {name}"))
        .collect()
}

/// Crates whose types meet across crates, or that are large: one version each.
const ONE_OF_EACH: [&str; 5] = ["glam", "rand", "rand_core", "serde", "obvhs"];

pub(super) fn one_of_each(house: &House) -> Vec<String> {
    let lock = fs::read_to_string(house.root.join("Cargo.lock")).unwrap_or_default();
    let count = |name: &str| {
        lock.lines()
            .filter(|l| *l == format!("name = \"{name}\""))
            .count()
    };
    let several = ONE_OF_EACH.iter().filter(|name| count(name) > 1);
    several
        .map(|name| format!("Cargo.lock: {} versions of {name}", count(name)))
        .collect()
}
