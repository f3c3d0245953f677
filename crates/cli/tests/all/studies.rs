//! Every named study, at its smallest size: that it runs, and what it leaves.
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{Smallest, folder, names, path, smallest, succeeded};
use serde_json::Value;
use std::time::Instant;

#[test]
fn every_named_study_runs() {
    // From the other end than those who read the same runs, so as not to wait for them.
    let all: Vec<&str> = linelit_papers::studies().map(|(name, _)| name).collect();
    assert_eq!(all.len(), 32);
    for name in all.into_iter().rev() {
        let start = Instant::now();
        let Smallest { said, folder } = smallest(name);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        assert!(said.lines().count() > 1, "{name}: {said}");
        let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
        assert!(page.ends_with("</html>"), "{name}");
        says_nothing_twice(name, &page);
        // Numbers as text or data, and nothing hidden but the list of files.
        let files = names(folder);
        let data = files.iter().any(|f| f.ends_with(".json"));
        assert!(data, "{name}: {files:?}");
        let hidden: Vec<&String> = files.iter().filter(|f| f.starts_with('.')).collect();
        assert_eq!(hidden, [".linelit-files"], "{name}");
    }
}

/// No sentence under the title stands over a section once more.
fn says_nothing_twice(name: &str, page: &str) {
    let paragraphs = |class: &str| -> Vec<&str> {
        let begin = format!("<p class=\"{class}\">");
        let starts = page.split(&begin).skip(1);
        starts
            .map(|rest| rest.split("</p>").next().unwrap())
            .collect()
    };
    let summary = [paragraphs("lede"), paragraphs("more")].concat();
    for lead in paragraphs("lead") {
        assert!(
            summary.iter().all(|said| !said.contains(lead)),
            "{name}: {lead}"
        );
    }
}

/// The claims as a user runs them: the verdicts are those on record, or the program says which are
/// not and fails.
#[test]
#[ignore = "long: all claims of the papers, in their quick form"]
fn the_verdicts_are_those_on_record() {
    let dir = folder("claims");
    let output = succeeded(&["converge", "claims", "--json", "--out", path(&dir)]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let count = |key: &str| found[key].as_u64().unwrap();
    // No quota for any verdict; but most of a hundred claims or more are told.
    let told = count("confirmed") + count("stronger") + count("weaker") + count("refuted");
    assert!(told >= 100 && told > count("consistent"), "{told}");
}
