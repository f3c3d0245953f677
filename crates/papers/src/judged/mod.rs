//! The judge of the papers' claims: it measures what the claims in `claims.toml` need, and compares
//! the results with the papers and with the recorded verdicts.

mod bench;
pub(crate) mod data;
mod formula;
mod page;
pub(crate) mod special;
mod verdict;

use crate::measured::Measured;
use crate::{Context, Findings};
use anyhow::{Context as _, Result};
use bench::{Bench, Effort, Measurements};
use data::{Book, Claim};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::time::Instant;
use verdict::{Expected, Verdict};

/// A claim with its measurement and verdict.
#[derive(Clone, Debug)]
struct Judged {
    claim: Claim,
    /// The name of the study that shows more about the claim.
    study: String,
    measured: Option<Measured>,
    verdict: Verdict,
    /// The number that checks the reason why the claim is not confirmed, and whether the number
    /// agrees with the reason.
    check: Option<(Measured, bool)>,
}

/// Measures and judges the claims of a study (all claims for the study `claims`). A verdict that
/// contradicts the recorded one is a failure of the findings, except at the smallest effort, whose
/// results do not matter.
pub(crate) fn run(context: &Context<'_>, study: &str, title: &str) -> Result<Findings> {
    // Measure.
    let effort = match (context.smallest, context.full) {
        (true, _) => Effort::Smallest,
        (false, true) => Effort::Full,
        (false, false) => Effort::Quick,
    };
    let bench = Bench { context, effort };
    let book = Book::own();
    let claims: Vec<&Claim> = book.claims_of(study).collect();
    let (measurements, times) = measure(&bench, book, &claims)?;
    // Judge.
    let judge = |claim: &&Claim| judge(claim, book.study(claim), &measurements);
    let judged = claims.iter().map(judge).collect::<Result<Vec<_>>>()?;
    let failures = match effort {
        Effort::Smallest => Vec::new(),
        _ => failures(&judged),
    };
    Ok(Findings {
        report: page::report(title, &judged, &times),
        files: Vec::new(),
        text: page::text(&judged),
        rows: document(&judged),
        failures,
    })
}

/// The name of a part of the measurements, and the seconds that it took.
type Took = (String, f64);

/// Measures all entries of points and functions that claims and their checks need.
#[allow(clippy::disallowed_methods, reason = "says how long it took")]
fn measure(bench: &Bench<'_>, book: &Book, claims: &[&Claim]) -> Result<(Measurements, Vec<Took>)> {
    let (mut out, mut times) = (Measurements::default(), Vec::new());
    let mut timed = |name: &str, run: &mut dyn FnMut() -> Result<()>| -> Result<()> {
        bench.context.progress.set_message(name.to_owned());
        let start = Instant::now();
        run().with_context(|| name.to_owned())?;
        times.push((name.to_owned(), start.elapsed().as_secs_f64()));
        Ok(())
    };
    // Measure the points that are needed, then run the functions that are needed.
    let groups: BTreeSet<&str> = claims.iter().flat_map(|c| c.groups()).collect();
    for points in &book.points {
        if groups.contains(points.name.as_str()) {
            timed(&points.name, &mut || bench.measure(points, &mut out))?;
        }
    }
    for (name, _, special) in special::ALL {
        if groups.contains(name) {
            timed(name, &mut || {
                let mut found = special::Out::new();
                special(bench, &mut found)?;
                let path = |(what, m)| (format!("{name}/{what}"), m);
                out.special.extend(found.into_iter().map(path));
                Ok(())
            })?;
        }
    }
    Ok((out, times))
}

/// Judges a claim, and the reason why it is not confirmed, by what was measured.
fn judge(claim: &Claim, study: &str, measurements: &Measurements) -> Result<Judged> {
    let find = |figure: &formula::Formula| {
        let found = figure.evaluate(measurements);
        found.with_context(|| format!("the claim `{}`", claim.id))
    };
    let measured = claim.figure.as_ref().map(find).transpose()?;
    let verdict = match (claim.expect, measured) {
        (Some(expect), Some(measured)) => expect.judge(measured),
        _ => Verdict::NotMeasurable,
    };
    let check = claim.check.as_ref().map(|check| {
        let found = find(&check.figure)?;
        let verdict = check.expect.judge(found);
        let holds = matches!(verdict, Verdict::Confirmed | Verdict::Consistent);
        anyhow::Ok((found, holds))
    });
    Ok(Judged {
        claim: claim.clone(),
        study: study.to_owned(),
        measured,
        verdict,
        check: check.transpose()?,
    })
}

/// Lists a run's failures: verdicts that contradict the record, reasons that do not hold, numbers
/// that could not be measured.
fn failures(judged: &[Judged]) -> Vec<String> {
    let mut all = Vec::new();
    for one in judged {
        let (claim, found) = (&one.claim, page::found(one));
        if one.measured.is_some_and(|m| m.known().is_none()) {
            all.push(format!("`{}` could not be measured", claim.id));
        }
        if claim.verdict.contradicts(one.verdict) {
            all.push(format!(
                "`{}` is {} ({found}, expected {}), {} on record",
                claim.id,
                one.verdict,
                page::expected(claim),
                claim.verdict
            ));
        }
        if let Some((found, false)) = one.check {
            all.push(format!("`{}`: its reason does not hold: {found}", claim.id));
        }
    }
    all
}

/// Counts the claims with each verdict.
fn counts(judged: &[Judged]) -> [usize; Verdict::ALL.len()] {
    Verdict::ALL.map(|verdict| judged.iter().filter(|j| j.verdict == verdict).count())
}

/// Returns the summary line: how many claims have each verdict.
fn summary(judged: &[Judged]) -> String {
    let counts = Verdict::ALL.into_iter().zip(counts(judged));
    let words: Vec<String> = counts.map(|(v, n)| format!("{n} {v}")).collect();
    format!("{} claims: {}.", judged.len(), words.join(", "))
}

/// Returns the claims as data for JSON.
fn document(judged: &[Judged]) -> Value {
    let of = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let claim = |one: &Judged| {
        let claim = &one.claim;
        // Describe the expected number or bound.
        let (relation, expected, tolerance, none) = match claim.expect {
            Some(Expected::Figure {
                value,
                tolerance,
                none,
            }) => (
                "equal",
                of(value),
                of(tolerance),
                none.map_or(Value::Null, of),
            ),
            Some(Expected::Below(bound)) => ("below", of(bound), Value::Null, Value::Null),
            Some(Expected::Above(bound)) => ("above", of(bound), Value::Null, Value::Null),
            None => ("none", Value::Null, Value::Null, Value::Null),
        };
        let end = |k: usize| {
            let ends = one.measured.and_then(|m| m.interval);
            ends.map_or(Value::Null, |ends| of(ends[k]))
        };
        json!({
            "id": claim.id,
            "paper": claim.paper.citation(),
            "place": claim.place,
            "claim": claim.says,
            "relation": relation,
            "expected": expected,
            "tolerance": tolerance,
            "no_effect": none,
            "read": claim.read,
            "why": claim.why,
            "study": one.study,
            "figure": claim.figure.as_ref().map_or("", formula::Formula::text),
            "measured": one.measured.map_or(Value::Null, |m| of(m.value)),
            "low": end(0),
            "high": end(1),
            "verdict": one.verdict.name(),
            "recorded": claim.verdict.name(),
            "timed": claim.figure.as_ref().is_some_and(formula::Formula::is_timed),
            "reason": claim.because,
            "checked": one.check.map_or(Value::Null, |(m, _)| of(m.value)),
            "reason_holds": one.check.map_or(Value::Null, |(_, holds)| json!(holds)),
        })
    };
    // Add the number of claims with each verdict.
    let mut document = json!({ "claims": judged.iter().map(claim).collect::<Vec<_>>() });
    for (verdict, count) in Verdict::ALL.into_iter().zip(counts(judged)) {
        let key = match verdict {
            Verdict::NotMeasurable => "not_measurable",
            other => other.name(),
        };
        document[key] = json!(count);
    }
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_book_is_whole() {
        let claims = &Book::own().claims;
        assert!(claims.len() >= 100, "{}", claims.len());
    }
}
