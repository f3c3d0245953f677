//! The page of the judged claims, and their lines on the terminal.

use super::data::{Claim, Paper};
use super::verdict::{Expected, Verdict};
use super::{Judged, Took, counts, summary};
use linelit_study::report::{Cell, Report, Section, Table};

/// Returns the page: a section for each paper, and how long each measurement took.
pub(super) fn report(title: &str, judged: &[Judged], times: &[Took]) -> Report {
    let sections = Paper::ALL.into_iter().filter_map(|paper| {
        let own = judged.iter().filter(|j| j.claim.paper == paper).cloned();
        let own: Vec<Judged> = own.collect();
        (!own.is_empty()).then(|| section(paper, &own))
    });
    let words = "A claim is confirmed where the whole 95 % interval of its figure is within the \
                 tolerance of the paper's, or strictly on the claimed side; consistent where the \
                 interval touches that; else stronger, weaker or refuted. A run is held to the \
                 verdicts on record: it fails where one is on the other side of consistent.";
    let lead = match judged {
        [] => Vec::new(),
        _ => vec![summary(judged), words.to_owned()],
    };
    let mut report = Report::new(title, lead, sections.collect());
    let took = |(name, seconds): &Took| (format!("time of {name}"), format!("{seconds:.1} s"));
    report.facts.extend(times.iter().map(took));
    report
}

/// Returns the section of a paper: a table of its claims, and notes on those that are not
/// confirmed.
fn section(paper: Paper, own: &[Judged]) -> Section {
    // Count the verdicts.
    let told = Verdict::ALL.into_iter().zip(counts(own));
    let told = told.filter(|(_, count)| *count > 0);
    let told: Vec<String> = told
        .map(|(verdict, count)| format!("{count} {verdict}"))
        .collect();
    // Explain claims that are not confirmed, and others with a remark.
    let note = |one: &Judged| {
        let claim = &one.claim;
        let check = one.check.map(|(found, holds)| {
            let word = if holds { "holds" } else { "does not hold" };
            format!(" The check {word}: {found}.")
        });
        let (place, verdict, says) = (claim.source(), one.verdict, &claim.says);
        let check = check.unwrap_or_default();
        format!("{place}, {verdict}: {says} {}{check}", claim.because)
    };
    let noted = own
        .iter()
        .filter(|j| j.verdict.needs_reason() || !j.claim.because.is_empty());
    Section {
        title: paper.citation().to_owned(),
        lead: format!("{} claims: {}.", own.len(), told.join(", ")),
        tables: vec![table(own)],
        notes: noted.map(note).collect(),
        ..Section::default()
    }
}

/// Returns the table of claims.
fn table(own: &[Judged]) -> Table {
    let columns = ["where", "claim", "expected", "measured", "verdict", "study"];
    // Show a contradiction to the record next to the verdict, and explain the numbers on hovering.
    let row = |one: &Judged| {
        let claim = &one.claim;
        let value = one.measured.map_or(f64::NAN, |m| m.value);
        let record = if claim.verdict.contradicts(one.verdict) {
            format!("{} (record: {})", one.verdict, claim.verdict)
        } else {
            one.verdict.name().to_owned()
        };
        let tolerance = format!("{}; tolerance: {}", claim.read, claim.why);
        let figure = claim
            .figure
            .as_ref()
            .map_or("", super::formula::Formula::text);
        vec![
            Cell::text(claim.source()),
            Cell::text(claim.says.clone()).hover(claim.id.clone()),
            Cell::number(expected(claim)).hover(tolerance),
            Cell::number(found(one)).sorted_by(value),
            Cell::text(record)
                .strong(one.verdict != Verdict::Confirmed)
                .hover(figure),
            Cell::text(one.study.clone()),
        ]
    };
    let caption =
        "Hovering over what is expected says how it was read and why the tolerance is what it is.";
    Table::new(caption, columns, own.iter().map(row))
}

/// Returns the measured number as text.
pub(super) fn found(one: &Judged) -> String {
    one.measured.map_or("–".to_owned(), |m| m.to_string())
}

/// Returns the expected number as text.
pub(super) fn expected(claim: &Claim) -> String {
    claim.expect.map_or("–".to_owned(), Expected::text)
}

/// Returns a line for each claim, and the summary.
pub(super) fn text(judged: &[Judged]) -> String {
    if judged.is_empty() {
        return String::new();
    }
    let mut out = String::new();
    for one in judged {
        let measured = found(one);
        let (verdict, id, paper) = (
            one.verdict.name(),
            &one.claim.id,
            one.claim.paper.citation(),
        );
        let expected = expected(&one.claim);
        out.push_str(&format!(
            "{verdict:<20} {expected:>16}  {measured:<28} {id} ({paper})\n"
        ));
    }
    out + &summary(judged) + "\n"
}
