//! `docs/formats.schema.json` and `docs/formats.md` describe exactly what the program writes.

use crate::common::{folder, late_study, path, read, small_study, smallest, succeeded};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

fn page(name: &str) -> String {
    let path = format!("{}/../../docs/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn document(arguments: &[&str]) -> Value {
    let output = succeeded(arguments);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A checker of documents for the keywords that our schema uses: type, properties, required,
/// additionalProperties, items, minItems, maxItems, $ref.
struct Schema {
    root: Value,
    /// The keys that were found, by definition.
    seen: BTreeSet<(String, String)>,
}

impl Schema {
    fn check(&mut self, name: &str, value: &Value) -> Result<(), String> {
        let schema = self.root["$defs"][name].clone();
        assert!(schema.is_object(), "no definition `{name}`");
        self.value(name, &schema, value)
    }

    /// `owner` is the definition that the schema is in.
    fn value(&mut self, owner: &str, schema: &Value, value: &Value) -> Result<(), String> {
        if let Some(name) = schema["$ref"].as_str() {
            return self.check(name.strip_prefix("#/$defs/").unwrap(), value);
        }
        let types = match &schema["type"] {
            Value::String(one) => vec![one.as_str()],
            Value::Array(several) => several.iter().map(|t| t.as_str().unwrap()).collect(),
            other => panic!("{owner}: type {other}"),
        };
        let is = |name: &&str| match *name {
            "null" => value.is_null(),
            "string" => value.is_string(),
            "number" => value.is_number(),
            "integer" => value.is_u64() || value.is_i64(),
            "boolean" => value.is_boolean(),
            "array" => value.is_array(),
            "object" => value.is_object(),
            other => panic!("{owner}: type {other}"),
        };
        if !types.iter().any(is) {
            return Err(format!("{owner}: {value} is none of {types:?}"));
        }
        if let Some(items) = value.as_array() {
            let count = items.len() as u64;
            let bound = |key: &str, other| schema[key].as_u64().unwrap_or(other);
            if count < bound("minItems", 0) || count > bound("maxItems", u64::MAX) {
                return Err(format!("{owner}: {count} items in {value}"));
            }
            for item in items {
                self.value(owner, &schema["items"], item)?;
            }
        }
        let Some(object) = value.as_object() else {
            return Ok(());
        };
        for key in schema["required"].as_array().unwrap_or(&Vec::new()) {
            if !object.contains_key(key.as_str().unwrap()) {
                return Err(format!("{owner}: {key} is missing"));
            }
        }
        for (key, value) in object {
            let known = &schema["properties"][key];
            if known.is_object() {
                self.seen.insert((owner.to_owned(), key.clone()));
                self.value(owner, known, value)?;
            } else if schema["additionalProperties"].is_object() {
                self.value(owner, &schema["additionalProperties"], value)?;
            } else {
                return Err(format!("{owner}: `{key}` is not described"));
            }
        }
        Ok(())
    }
}

#[test]
fn documents_schema_and_page_agree() {
    let dir = folder("described");
    let mut schema = Schema {
        root: serde_json::from_str(&page("formats.schema.json")).unwrap(),
        seen: BTreeSet::new(),
    };
    let mut check = |name: &str, arguments: &[&str]| {
        let found = document(&[arguments, &["--json"]].concat());
        schema.check(name, &found).unwrap_or_else(|e| panic!("{e}"));
        found
    };
    let (image, out) = (dir.join("a.exr"), dir.join("out"));
    let size = ["--resolution", "8x8", "--crop", "0,1,0,0.5"];
    check(
        "render",
        &[&["render", "plates", "-o", path(&image)], &size[..]].concat(),
    );
    let plan = dir.join("plan");
    let tiles = ["plan", "render", "plates", "--tile", "4", "-o", path(&plan)];
    check("plan", &[&tiles[..], &size[..]].concat());
    check("run", &["run", path(&plan)]);
    check("status", &["status", path(&plan)]);
    check("merge", &["merge", path(&plan), "-o", path(&image)]);
    let part = ["--crop", "0,0.5,0,1"];
    check("compare", &["compare", path(&image), path(&image)]);
    check(
        "compare",
        &[&["compare", path(&image), path(&image)], &part[..]].concat(),
    );
    let factors = dir.join("f.csv");
    let facets = ["viewfactors", "cornell-box", "--tolerance", "0.1", "-o"];
    check("viewfactors", &[&facets[..], &[path(&factors)]].concat());
    check("list", &["list"]);
    for scene in ["plates", "window", "cornell-box-line"] {
        check("info", &["info", scene]);
    }
    let bulb = dir.join("bulb.pbrt");
    std::fs::write(
        &bulb,
        "WorldBegin AreaLightSource \"diffuse\" Shape \"sphere\"",
    )
    .unwrap();
    let exact = check("info", &["info", path(&bulb)]);
    assert!(exact["exact_lights"]["sphere"].is_object(), "{exact}");

    let study = check("converge", &small_study("cornell-box", &out));
    tables_are_of(&schema.root, &study, &out);
    let mut found = vec![("converge", document(&late_study(&out)))];
    found.push(("claims", read(&smallest("claims").folder, "claims.json")));
    for study in ["salesin-fig8", "billen-orders"] {
        found.push(("converge", read(&smallest(study).folder, "results.json")));
    }
    for (name, found) in found {
        schema.check(name, &found).unwrap_or_else(|e| panic!("{e}"));
    }

    all_is_there(&schema);
}

/// The rows of the tables are those of the document, and their columns described.
fn tables_are_of(schema: &Value, study: &Value, out: &Path) {
    for (file, key, name) in [
        ("results.csv", "rows", "result"),
        ("slopes.csv", "slopes", "slope"),
    ] {
        let table = std::fs::read_to_string(out.join(file)).unwrap();
        let (head, rows) = table.split_once('\n').unwrap();
        assert_eq!(
            rows.lines().count(),
            study[key].as_array().unwrap().len(),
            "{file}"
        );
        let of_json = schema["$defs"][name]["properties"].as_object().unwrap();
        let only = |text: &Value| {
            text["description"]
                .as_str()
                .unwrap()
                .ends_with("(JSON only).")
        };
        let columns: Vec<&str> = head.split(',').collect();
        let described = of_json
            .iter()
            .filter(|(_, text)| !only(text))
            .map(|(key, _)| key.as_str());
        let sorted = |names: Vec<&str>| {
            names
                .into_iter()
                .map(str::to_owned)
                .collect::<BTreeSet<_>>()
        };
        assert_eq!(
            sorted(columns.clone()),
            sorted(described.collect()),
            "{file}"
        );
        let list: Vec<String> = columns.iter().map(|c| format!("`{c}`")).collect();
        let words = page("formats.md")
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert!(
            words.contains(&list.join(", ")),
            "columns of {file} on the page"
        );
    }
}

/// Every described key occurs in some document, and the page has a row for each key of a
/// definition.
fn all_is_there(schema: &Schema) {
    let page = page("formats.md");
    for (name, definition) in schema.root["$defs"].as_object().unwrap() {
        let start = format!("| `{name}` | ");
        let row = page.lines().find(|line| line.starts_with(&start));
        let row = row.and_then(|line| line.strip_suffix(" |")?.rsplit(" | ").next());
        let mut described = Vec::new();
        for key in definition["properties"].as_object().unwrap().keys() {
            let seen = schema.seen.contains(&(name.clone(), key.clone()));
            assert!(seen, "{name}: `{key}` was never written");
            described.push(format!("`{key}`"));
        }
        let mut listed: Vec<_> = row.unwrap_or_default().split(", ").collect();
        listed.sort_unstable();
        described.sort_unstable();
        assert_eq!(listed, described, "{name} on the page");
    }
}
