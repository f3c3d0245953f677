//! As much of `Cargo.toml` as the house rules need: sections, keys, dependency names.

use std::fs;
use std::path::{Path, PathBuf};

/// A member's manifest.
#[derive(Debug, Default)]
pub(crate) struct Manifest {
    /// Folder of the crate.
    pub(crate) folder: PathBuf,
    /// `package.name`.
    pub(crate) name: String,
    /// Keys of `[package]`, without `.workspace`.
    pub(crate) package: Vec<(String, String)>,
    /// Keys of `[dependencies]` with what stands right of `=`.
    pub(crate) dependencies: Vec<(String, String)>,
    /// The same of `[dev-dependencies]`.
    pub(crate) dev_dependencies: Vec<(String, String)>,
    /// The same of `[build-dependencies]` and of all target-specific tables.
    pub(crate) other_dependencies: Vec<(String, String)>,
    /// Keys of `[features]`.
    pub(crate) features: Vec<String>,
    /// Whether `[lints]` inherits the workspace's.
    pub(crate) inherits_lints: bool,
}

/// The manifests of all members, `crates/*` by name and then `xtask`.
pub(crate) fn members(root: &Path) -> Vec<Manifest> {
    let mut folders: Vec<PathBuf> = fs::read_dir(root.join("crates"))
        .map(|entries| entries.flatten().map(|e| e.path()).collect())
        .unwrap_or_default();
    folders.sort();
    folders.push(root.join("xtask"));
    folders.iter().filter_map(|folder| read(folder)).collect()
}

fn read(folder: &Path) -> Option<Manifest> {
    let text = fs::read_to_string(folder.join("Cargo.toml")).ok()?;
    Some(Manifest {
        folder: folder.to_path_buf(),
        ..parse(&text)
    })
}

/// Sections as (name, entries); entries as (key, value).
pub(crate) fn sections(text: &str) -> Vec<(String, Vec<(String, String)>)> {
    let mut found: Vec<(String, Vec<(String, String)>)> = Vec::new();
    // A value that spans lines ends where its brackets do.
    let mut open = 0_i32;
    for line in text.lines() {
        let line = line
            .split_once(" #")
            .map_or(line, |(before, _)| before)
            .trim();
        if line.starts_with('#') || line.is_empty() {
            continue;
        }
        if open == 0 && line.starts_with('[') {
            found.push((line.trim_matches(['[', ']']).to_owned(), Vec::new()));
        } else if let (0, Some((key, value)), Some((_, entries))) =
            (open, line.split_once('='), found.last_mut())
        {
            entries.push((
                key.trim().trim_matches('"').to_owned(),
                value.trim().to_owned(),
            ));
            open += balance(value);
        } else {
            open += balance(line);
        }
    }
    found
}

fn balance(text: &str) -> i32 {
    text.chars().fold(0, |n, c| match c {
        '[' | '{' => n + 1,
        ']' | '}' => n - 1,
        _ => n,
    })
}

fn parse(text: &str) -> Manifest {
    let mut manifest = Manifest::default();
    for (section, entries) in sections(text) {
        // `[dependencies.foo]` is one dependency; `foo.workspace = true` is one too.
        let plain = |entries: &[(String, String)]| -> Vec<(String, String)> {
            let name = |key: &str| key.split('.').next().unwrap_or(key).to_owned();
            entries
                .iter()
                .map(|(k, v)| (name(k), format!("{}={v}", &k[name(k).len()..])))
                .collect()
        };
        match section.as_str() {
            "package" => manifest.package = plain(&entries),
            "dependencies" => manifest.dependencies.extend(plain(&entries)),
            "dev-dependencies" => manifest.dev_dependencies.extend(plain(&entries)),
            "features" => manifest.features = entries.into_iter().map(|(k, _)| k).collect(),
            "lints" => {
                manifest.inherits_lints =
                    entries.iter().any(|(k, v)| k == "workspace" && v == "true")
            }
            other => match other.rsplit_once("dependencies") {
                Some((kind, "")) if !kind.is_empty() => {
                    manifest.other_dependencies.extend(plain(&entries))
                }
                Some((kind, one)) => {
                    let name = one.trim_start_matches('.').to_owned();
                    let entry = (
                        name,
                        entries.iter().map(|(k, v)| format!(".{k}={v}")).collect(),
                    );
                    match kind {
                        "" => manifest.dependencies.push(entry),
                        "dev-" => manifest.dev_dependencies.push(entry),
                        _ => manifest.other_dependencies.push(entry),
                    }
                }
                None => {}
            },
        }
    }
    let name = manifest
        .package
        .iter()
        .find(|(k, _)| k == "name")
        .map(|(_, v)| v.clone());
    manifest.name = name
        .unwrap_or_default()
        .trim_start_matches('=')
        .trim_matches(['"', ' '])
        .to_owned();
    manifest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_the_rules_need() {
        let text = "[package]\nname = \"x\"\nversion.workspace = true\n[lints]\nworkspace = true\n\
            [dependencies]\nfoo.workspace = true # why\nbar = { version = \"1\", features = [\n  \"a\",\n] }\n\
            [dependencies.baz]\nversion = \"2\"\n[dev-dependencies]\nqux = \"3\"\n\
            [target.'cfg(unix)'.dependencies]\nlibc = \"1\"\n[features]\ndefault = []\nsimd = [\"foo/simd\"]\n";
        let m = parse(text);
        let names =
            |list: &[(String, String)]| list.iter().map(|(k, _)| k.clone()).collect::<Vec<_>>();
        assert_eq!(m.name, "x");
        assert!(m.inherits_lints);
        assert_eq!(names(&m.dependencies), ["foo", "bar", "baz"]);
        assert_eq!(names(&m.dev_dependencies), ["qux"]);
        assert_eq!(names(&m.other_dependencies), ["libc"]);
        assert_eq!(m.features, ["default", "simd"]);
        assert_eq!(m.dependencies[0].1, ".workspace=true");
    }
}
