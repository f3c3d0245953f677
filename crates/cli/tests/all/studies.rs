//! Every named study at its smallest size: it runs, and its files are as expected.
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{Smallest, folder, names, path, smallest, succeeded};
use serde_json::Value;
use std::time::Instant;

#[test]
fn every_named_study_runs() {
    // In reverse order, so as not to wait for the tests that read the same runs.
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
        // There are numbers as text or data, and no hidden file but the list of files.
        let files = names(folder);
        let data = files.iter().any(|f| f.ends_with(".json"));
        assert!(data, "{name}: {files:?}");
        let hidden: Vec<&String> = files.iter().filter(|f| f.starts_with('.')).collect();
        assert_eq!(hidden, [".linelit-files"], "{name}");
    }
}

/// No sentence under the title is repeated above a section.
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

/// The claims as a user runs them: the verdicts agree with the record, or the program names those
/// that do not and fails.
#[test]
#[ignore = "long: all claims of the papers, in their quick form"]
fn the_verdicts_are_those_on_record() {
    let dir = folder("claims");
    let output = succeeded(&["converge", "claims", "--json", "--out", path(&dir)]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let count = |key: &str| found[key].as_u64().unwrap();
    // There is no quota for any verdict, but most of a hundred or more claims have one.
    let told = count("confirmed") + count("stronger") + count("weaker") + count("refuted");
    assert!(told >= 100 && told > count("consistent"), "{told}");
}
