//! Every named study, at its smallest size: that it runs, and what it leaves.
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{folder, linelit, names, path, text};
use serde_json::Value;
use std::time::Instant;

#[test]
fn every_named_study_runs() {
    let dir = folder("studies");
    let mut count = 0;
    for (name, _) in linelit_papers::studies() {
        let out = dir.join(name);
        let mut arguments = vec!["converge", name];
        if name == "salesin-fig9" {
            // The one that needs a scene.
            arguments.push("cornell-box-small");
        }
        arguments.extend(["--smallest", "--out", path(&out)]);
        let start = Instant::now();
        let output = linelit(&arguments);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        assert!(output.status.success(), "{name}: {}", text(&output.stderr));
        let said = text(&output.stdout);
        assert!(said.lines().count() > 1, "{name}: {said}");
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(page.ends_with("</html>"), "{name}");
        // Numbers as text or data, and nothing hidden but the list of files.
        let files = names(&out);
        let data = files.iter().any(|f| f.ends_with(".json"));
        assert!(data, "{name}: {files:?}");
        let hidden: Vec<&String> = files.iter().filter(|f| f.starts_with('.')).collect();
        assert_eq!(hidden, [".linelit-files"], "{name}");
        count += 1;
    }
    assert_eq!(count, 27);
    std::fs::remove_dir_all(dir).unwrap();
}

/// The claims as a user runs them: the verdicts are those on record, or the program says which are
/// not and fails.
#[test]
#[ignore = "long: all claims of the papers, in their quick form"]
fn the_verdicts_are_those_on_record() {
    let dir = folder("claims");
    let output = linelit(&["converge", "claims", "--json", "--out", path(&dir)]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let count = |key: &str| found[key].as_u64().unwrap();
    // What is neither confirmed nor stronger nor refuted is explained, and little.
    let told = count("confirmed") + count("stronger") + count("refuted");
    let all = told + count("weaker") + count("not_measurable");
    assert!(all >= 60 && told * 6 >= all * 5, "{told} of {all}");
    std::fs::remove_dir_all(dir).unwrap();
}
