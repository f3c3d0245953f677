//! Tests that the reader agrees with the table in `docs/pbrt.md`, which says which of pbrt's
//! parameters are supported, cause a warning or have no effect. The reader must do what the table
//! says, and warn about every other parameter.

use linelit_formats::{LoadOptions, from_pbrt_str};
use std::collections::BTreeSet;

/// One type of a directive, such as `Material "matte"`, with its row of the table.
struct Row {
    directive: String,
    name: String,
    /// Whether the reader warns about the type itself. The table marks such types with asterisks.
    is_odd: bool,
    known: BTreeSet<String>,
    warned: Vec<String>,
    /// Parameters that the type needs in order to be read, as pbrt text.
    needed: &'static str,
}

/// Reads the table of `docs/pbrt.md`. A row for several types gives one [`Row`] for each of them.
fn table() -> Vec<Row> {
    // Read the page, and split lines of five cells.
    let path = format!("{}/../../docs/pbrt.md", env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(path).unwrap();
    let cells = |line: &str| -> Option<[String; 5]> {
        let line = line.strip_prefix('|')?.strip_suffix('|')?;
        let cells: Vec<String> = line.split('|').map(|c| c.trim().to_owned()).collect();
        cells.try_into().ok()
    };
    // Make a row for each type. The first two lines are the table's head.
    let mut rows = Vec::new();
    for [directive, names, done, warned, none] in page.lines().filter_map(cells).skip(2) {
        let (names, given) = names.split_once(": ").unwrap_or((&names, ""));
        for name in names.split(' ') {
            let bare = name.trim_matches('*');
            let words = |cell: &str| -> Vec<String> {
                cell.split_whitespace().map(str::to_owned).collect()
            };
            let warned = words(&warned);
            rows.push(Row {
                directive: directive.clone(),
                name: bare.to_owned(),
                is_odd: name.starts_with('*'),
                known: [words(&done), warned.clone(), words(&none)]
                    .concat()
                    .into_iter()
                    .collect(),
                warned,
                needed: match (bare, given) {
                    ("spherical", _) => "\"string mapping\" \"equirectangular\"",
                    ("mix", _) => "\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"a\"",
                    ("diffuse", "filename filter") => {
                        "\"string filename\" \"tests/images/ramp.png\" \"string filter\" \"ewa\""
                    }
                    ("conductor", "reflectance") => "\"rgb reflectance\" [ .5 .5 .5 ]",
                    _ => "",
                },
            });
        }
    }
    rows
}

/// Reads a scene in which the directive of the row has the given parameter, and returns the
/// warnings, or the error.
fn said(row: &Row, parameter: &str) -> Result<Vec<String>, String> {
    // Write the directive with its type and parameters.
    let name = if row.name.is_empty() {
        String::new()
    } else {
        format!("\"{}\"", row.name)
    };
    let (directive, needed) = (&row.directive, row.needed);
    let directive = format!("{directive} {name} {parameter} {needed}\n");
    // Put it where it belongs in a scene: in place of the camera, in the world, or before both.
    let square = "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]\n";
    let camera = "Camera \"perspective\"\n";
    let world = format!(
        "WorldBegin MakeNamedMaterial \"a\" \"string type\" \"matte\"\n\
         AttributeBegin AreaLightSource \"diffuse\" {square} AttributeEnd\n"
    );
    let text = match row.directive.as_str() {
        "Camera" => format!("Film \"rgb\" {directive} {world}"),
        "Material" | "AreaLightSource" | "LightSource" => {
            format!("{camera} {world} {directive} {square}")
        }
        _ => format!("{directive} {camera} {world}"),
    };
    match from_pbrt_str(&text, "table.pbrt", &LoadOptions::default()) {
        Ok(loaded) => Ok(loaded
            .warnings
            .iter()
            .map(|w| w.message().to_owned())
            .collect()),
        Err(error) => Err(error.message().to_owned()),
    }
}

#[test]
fn parameters_that_the_table_does_not_have_are_warned_about() {
    let rows = table();
    assert!(rows.len() > 50, "{}", rows.len());
    let mut all: BTreeSet<&str> = rows
        .iter()
        .flat_map(|row| &row.known)
        .map(|p| &**p)
        .collect();
    all.insert("bogus");
    for row in &rows {
        let is_given = |name: &&&str| row.needed.contains(&format!(" {name}\""));
        for name in all.iter().filter(|name| !is_given(name)) {
            let unknown = format!("has no parameter `{name}`");
            let is_known = match said(row, &format!("\"float {name}\" .5")) {
                Ok(warnings) => !warnings.iter().any(|w| w.contains(&unknown)),
                // An error about the parameter's type or value shows that the reader knows it.
                Err(error) => error.contains(&format!("`{name}`")),
            };
            let wanted = row.known.contains(*name);
            assert_eq!(
                is_known, wanted,
                "{} `{}`: `{name}`",
                row.directive, row.name
            );
        }
    }
}

#[test]
fn what_the_table_says_to_be_warned_about_is() {
    for row in table() {
        let bare = said(&row, "").unwrap();
        assert_eq!(
            bare.is_empty(),
            !row.is_odd,
            "{} `{}`: {bare:?}",
            row.directive,
            row.name
        );
        for name in &row.warned {
            let given = match name.as_str() {
                "sensor" => "\"string sensor\" \"canon_eos_100d\"".to_owned(),
                "forcediffuse" | "disabletexturefiltering" => format!("\"bool {name}\" true"),
                _ => format!("\"float {name}\" .5"),
            };
            let warnings = said(&row, &given).unwrap();
            assert_eq!(warnings.len(), bare.len() + 1, "{given}: {warnings:?}");
        }
        // A parameter with pbrt's default value causes no warning, because nothing is lost.
        for given in [
            "\"string sensor\" \"cie1931\"",
            "\"float lensradius\" 0",
            "\"float whitebalance\" 0",
        ] {
            let name = given.split(['"', ' ']).nth(2).unwrap();
            if row.known.contains(name) {
                assert_eq!(said(&row, given).unwrap(), bare, "{given}");
            }
        }
    }
}
