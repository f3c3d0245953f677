//! The page of the claims, and the lines on the terminal.

use super::claim::{Expected, Paper, Verdict};
use super::{Judged, checked, summary};
use linelit_study::plots::{IntervalRow, intervals};
use linelit_study::report::{Cell, Plot, Report, Section, Table};

/// The page.
pub(super) fn report(judged: &[Judged], groups: &[(&str, f64)]) -> Report {
    let mut sections: Vec<Section> = Paper::ALL
        .into_iter()
        .map(|paper| {
            let own: Vec<&Judged> = judged.iter().filter(|j| j.claim.paper == paper).collect();
            section(paper, &own)
        })
        .collect();
    sections.retain(|section| !section.tables.is_empty());
    let words = "A claim is confirmed where its figure is within the tolerance of the paper's by its \
                 whole 95 % interval, stronger or weaker beyond it, refuted where nothing of the effect \
                 is there or it is the other way round. Each verdict follows from the figures beside it; \
                 this run is held to the verdicts on record, of which a few are others with --full.";
    let title = "Every claim of the papers, with a verdict";
    let mut report = Report::new(title, vec![summary(judged), words.to_owned()], sections);
    let took =
        |(name, seconds): &(&str, f64)| (format!("time of {name}"), format!("{seconds:.1} s"));
    report.facts.extend(groups.iter().map(took));
    report
}

fn section(paper: Paper, own: &[&Judged]) -> Section {
    if own.is_empty() {
        return Section::default();
    }
    let told: Vec<String> = Verdict::ALL
        .into_iter()
        .filter_map(|verdict| {
            let count = own.iter().filter(|j| j.verdict == verdict).count();
            (count > 0).then(|| format!("{count} {verdict}"))
        })
        .collect();
    let mut notes = Vec::new();
    let noted = |j: &&&Judged| j.verdict.needs_reason() || j.claim.otherwise.is_some();
    for one in own.iter().filter(noted) {
        let claim = &one.claim;
        let mut note = format!("{}, {}: {}", claim.place, one.verdict, claim.says);
        match claim.reason {
            Some(reason) => note = format!("{note} {}", reason.words),
            None if claim.is_timed && one.verdict == Verdict::Weaker => {
                note = format!(
                    "{note} This run's times tell less; {} is on record.",
                    claim.recorded
                );
            }
            None if one.verdict.needs_reason() => note.push_str(" No reason is on record."),
            None => (),
        }
        if let Some(check) = checked(one) {
            note = format!("{note} {check}");
        }
        if let Some((verdict, reason)) = claim.otherwise {
            let words = reason.map_or("", |r| r.words);
            note = format!("{note} On record of the other form: {verdict}. {words}");
        }
        notes.push(note);
    }
    Section {
        title: paper.citation().to_owned(),
        lead: format!("{} claims: {}.", own.len(), told.join(", ")),
        plots: plots(own),
        tables: vec![table(own)],
        notes,
        ..Section::default()
    }
}

fn table(own: &[&Judged]) -> Table {
    let columns = [
        "where",
        "claim",
        "expected",
        "measured",
        "verdict",
        "what follows",
        "by",
    ];
    let row = |one: &&Judged| {
        let claim = &one.claim;
        let measured = found(one);
        let value = one.measured.map_or(f64::NAN, |m| m.value);
        let differs = claim.differs(one.verdict);
        let record = if differs {
            format!("{} (record: {})", one.verdict, claim.recorded)
        } else {
            one.verdict.name().to_owned()
        };
        let tolerance = format!("{}; tolerance: {}", claim.read, claim.why);
        vec![
            Cell::text(claim.place),
            Cell::text(claim.says.clone()).hover(claim.id.clone()),
            Cell::number(claim.expected.text()).hover(tolerance),
            Cell::number(measured).sorted_by(value),
            Cell::text(record).strong(one.verdict != Verdict::Confirmed),
            Cell::text(claim.expected.sentence(one.measured)),
            Cell::text(one.study),
        ]
    };
    let caption =
        "Hovering over what is expected says how it was read and why the tolerance is what it is.";
    Table::new(caption, columns, own.iter().map(row))
}

/// How far the figures are on the way from no effect to the paper's, and where ratios are beside
/// their bounds.
fn plots(own: &[&Judged]) -> Vec<Plot> {
    let shares: Vec<IntervalRow> = own.iter().filter_map(|one| share(one)).collect();
    let bounds: Vec<IntervalRow> = own.iter().filter_map(|one| bound(one)).collect();
    let mut plots = Vec::new();
    if !shares.is_empty() {
        let guides = [(0.0, "no effect"), (1.0, "the paper's")];
        plots.push(Plot {
            svg: intervals("claims of figures", &shares, &guides, [-0.5, 2.0]),
            caption:
                "Figures on the way from no effect to the paper's, with 95 % intervals; boxes are \
                      tolerances."
                    .to_owned(),
        });
    }
    if !bounds.is_empty() {
        let guides = [
            (-2.0, "100 times within"),
            (-1.0, "10 times"),
            (0.0, "bound"),
            (1.0, "10 times beyond"),
        ];
        plots.push(Plot {
            svg: intervals("claims of orderings", &bounds, &guides, [-2.5, 1.5]),
            caption: "Orderings: how far the figure is within its bound, as a power of ten."
                .to_owned(),
        });
    }
    plots
}

/// A row of the first plot.
fn share(one: &Judged) -> Option<IntervalRow> {
    let Expected::Figure {
        value,
        tolerance,
        none: Some(none),
    } = one.claim.expected
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
    let (bound, sign) = match one.claim.expected {
        Expected::AtMost(bound) => (bound, 1.0),
        Expected::AtLeast(bound) => (bound, -1.0),
        _ => return None,
    };
    let m = one.measured.filter(|m| m.is_above(0.0) && bound > 0.0)?;
    let interval = m.known()?;
    let place = |v: f64| sign * (v / bound).log10();
    Some(IntervalRow {
        label: shorten(&one.claim.id),
        value: place(m.value),
        interval: sorted(interval.map(place)),
        ..marked(one)
    })
}

/// What was measured, in words.
fn found(one: &Judged) -> String {
    one.measured.map_or("–".to_owned(), |m| m.to_string())
}

/// Mark and hover of a claim: the verdicts have a colour each.
fn marked(one: &Judged) -> IntervalRow {
    let kind = match one.verdict {
        Verdict::Confirmed => 1,
        Verdict::Stronger => 0,
        Verdict::Weaker => 3,
        Verdict::Refuted => 5,
        Verdict::NotMeasurable => 4,
    };
    let measured = found(one);
    let expected = one.claim.expected.text();
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
    let mut out = String::new();
    for one in judged {
        let measured = found(one);
        let (verdict, id) = (one.verdict.name(), &one.claim.id);
        let expected = one.claim.expected.text();
        out.push_str(&format!(
            "{verdict:<20} {expected:>16}  {measured:<28} {id}\n"
        ));
    }
    out + &summary(judged) + "\n"
}
