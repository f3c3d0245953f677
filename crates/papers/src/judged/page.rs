//! The page of the claims, and the lines on the terminal.

use super::data::{Claim, Paper};
use super::verdict::{Expected, Verdict};
use super::{Judged, Took, counts, summary};
use linelit_elementary::log10;
use linelit_study::plots::{IntervalRow, intervals};
use linelit_study::report::{Cell, Plot, Report, Section, Table};

/// The page.
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

fn section(paper: Paper, own: &[Judged]) -> Section {
    let told = Verdict::ALL.into_iter().zip(counts(own));
    let told = told.filter(|(_, count)| *count > 0);
    let told: Vec<String> = told
        .map(|(verdict, count)| format!("{count} {verdict}"))
        .collect();
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
        plots: plots(own),
        tables: vec![table(own)],
        notes: noted.map(note).collect(),
        ..Section::default()
    }
}

fn table(own: &[Judged]) -> Table {
    let columns = ["where", "claim", "expected", "measured", "verdict", "study"];
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

/// Plots how far the figures are on the way from no effect to the paper's, and where ratios lie
/// relative to their bounds.
fn plots(own: &[Judged]) -> Vec<Plot> {
    // The labels name figures and tables: the paper stands above them.
    let paper = own.first().map_or("", |one| one.claim.paper.citation());
    let heading = IntervalRow {
        label: paper.to_owned(),
        heading: true,
        ..IntervalRow::default()
    };
    let headed = |row: fn(&Judged) -> Option<IntervalRow>| -> Vec<IntervalRow> {
        let rows = own.iter().filter_map(row);
        std::iter::once(heading.clone()).chain(rows).collect()
    };
    let (shares, bounds) = (headed(share), headed(bound));
    let mut plots = Vec::new();
    if shares.len() > 1 {
        let guides = [(0.0, "no effect"), (1.0, "the paper's")];
        plots.push(Plot {
            svg: intervals(
                &format!("{paper}: claims of figures"),
                &shares,
                &guides,
                [-0.5, 2.0],
            ),
            caption:
                "Figures on the way from no effect to the paper's, with 95 % intervals; boxes are \
                      tolerances."
                    .to_owned(),
        });
    }
    if bounds.len() > 1 {
        let guides = [
            (-2.0, "100 times within"),
            (-1.0, "10 times"),
            (0.0, "bound"),
            (1.0, "10 times beyond"),
        ];
        plots.push(Plot {
            svg: intervals(
                &format!("{paper}: claims of orderings"),
                &bounds,
                &guides,
                [-2.5, 1.5],
            ),
            caption: "Orderings: how far the figure is within its bound, as a power of ten."
                .to_owned(),
        });
    }
    plots
}

/// A row of the first plot.
fn share(one: &Judged) -> Option<IntervalRow> {
    let Some(Expected::Figure {
        value,
        tolerance,
        none: Some(none),
    }) = one.claim.expect
    else {
        return None;
    };
    let m = one.measured?;
    let interval = m.interval.unwrap_or([f64::NAN; 2]);
    let place = |v: f64| (v - none) / (value - none);
    Some(IntervalRow {
        label: shorten(&one.claim.id),
        value: place(m.value),
        interval: sorted(interval.map(place)),
        band: Some([place(value - tolerance), place(value + tolerance)]),
        ..marked(one)
    })
}

/// A row of the second plot: bounds of positive figures.
fn bound(one: &Judged) -> Option<IntervalRow> {
    let (bound, sign) = match one.claim.expect? {
        Expected::Below(bound) => (bound, 1.0),
        Expected::Above(bound) => (bound, -1.0),
        Expected::Figure { .. } => return None,
    };
    let m = one.measured.filter(|m| m.is_above(0.0) && bound > 0.0)?;
    let interval = m.known()?;
    let place = |v: f64| sign * log10(v / bound);
    Some(IntervalRow {
        label: shorten(&one.claim.id),
        value: place(m.value),
        interval: sorted(interval.map(place)),
        ..marked(one)
    })
}

/// Returns the measured figure, in words.
pub(super) fn found(one: &Judged) -> String {
    one.measured.map_or("–".to_owned(), |m| m.to_string())
}

/// Returns the expected figure as text.
pub(super) fn expected(claim: &Claim) -> String {
    claim.expect.map_or("–".to_owned(), Expected::text)
}

/// Mark and hover of a claim: the verdicts have a colour each.
fn marked(one: &Judged) -> IntervalRow {
    let kind = match one.verdict {
        Verdict::Confirmed => 1,
        Verdict::Stronger => 0,
        Verdict::Consistent => 2,
        Verdict::Weaker => 3,
        Verdict::Refuted => 5,
        Verdict::NotMeasurable => 4,
    };
    let measured = found(one);
    let expected = expected(&one.claim);
    IntervalRow {
        kind,
        hover: format!("{}: {measured}, expected {expected}", one.verdict),
        ..IntervalRow::default()
    }
}

fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

fn shorten(id: &str) -> String {
    const MOST: usize = 47;
    if id.chars().count() <= MOST {
        return id.to_owned();
    }
    let mut short: String = id.chars().take(MOST - 1).collect();
    short.push('…');
    short
}

/// The claims as lines.
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
