//! Every claim of the papers, measured: what is expected, what came out, and the verdict.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

mod bench;
mod claim;
mod list;
mod measure;
mod page;

use crate::Findings;
use crate::measured::Measured;
use crate::picture_study::Context;
use anyhow::{Context as _, Result, ensure};
use bench::{Bench, Effort, Figures};
use claim::{Claim, Expected, Verdict};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Instant;

/// A claim with what was measured.
#[derive(Clone, Debug)]
struct Judged {
    claim: Claim,
    measured: Option<Measured>,
    verdict: Verdict,
    /// The study that shows more of the same.
    study: &'static str,
    /// What the figure of the reason is, and whether it is as the reason says.
    check: Option<(Option<Measured>, bool)>,
}

/// All claims, judged by what is measured now. What differs from the record is an error of the
/// findings, but at the smallest, which tells nothing.
pub(crate) fn run(context: &Context<'_>) -> Result<Findings> {
    let effort = match (context.smallest, context.full) {
        (true, _) => Effort::Smallest,
        (false, true) => Effort::Full,
        (false, false) => Effort::Quick,
    };
    let bench = Bench { context, effort };
    let mut figures = Figures::new();
    let mut studies = BTreeMap::new();
    let mut groups = Vec::new();
    for group in measure::GROUPS {
        context.progress.set_message(group.name);
        let start = Instant::now();
        let found = (group.run)(&bench).with_context(|| group.name)?;
        groups.push((group.name, start.elapsed().as_secs_f64()));
        studies.extend(found.keys().map(|name| (name.clone(), group.study)));
        figures.extend(found);
    }
    let mut claims = list::all();
    if effort == Effort::Full {
        claims = claims.into_iter().map(Claim::in_full).collect();
    }
    let judged = judge(claims, &figures, &studies)?;
    let failures = if effort == Effort::Smallest {
        Vec::new()
    } else {
        failures(&judged)
    };
    Ok(Findings {
        report: page::report(&judged, &groups),
        files: Vec::new(),
        text: page::text(&judged),
        rows: document(&judged),
        failures,
    })
}

/// Each claim with its figure.
///
/// # Errors
/// If a claim names a figure that nothing measures: that is an error of this file, which the
/// smallest run finds.
fn judge(
    claims: Vec<Claim>,
    figures: &Figures,
    studies: &BTreeMap<String, &'static str>,
) -> Result<Vec<Judged>> {
    let wanted = claims.iter().flat_map(|claim| {
        let own = (claim.expected != Expected::Elsewhere).then_some(claim.figure.as_str());
        let reasons = [claim.reason, claim.otherwise.and_then(|(_, reason)| reason)];
        let checks = reasons.into_iter().flatten().filter_map(|r| r.check);
        own.into_iter().chain(checks.map(|(name, _)| name))
    });
    let missing: Vec<&str> = wanted.filter(|name| !figures.contains_key(*name)).collect();
    ensure!(
        missing.is_empty(),
        "nothing measures {}",
        missing.join(", ")
    );
    let judge = |claim: Claim| {
        let measured = match claim.expected {
            Expected::Elsewhere => None,
            _ => figures.get(&claim.figure).copied(),
        };
        let check = match claim.reason.and_then(|reason| reason.check) {
            Some((name, expected)) => {
                let found = figures.get(name).copied();
                let verdict = expected.judge(found);
                // Of times a busy machine may tell nothing.
                let untold = claim.is_timed && verdict == Verdict::Weaker;
                let holds = verdict == Verdict::Confirmed || untold;
                Some((found, holds))
            }
            None => None,
        };
        Judged {
            verdict: claim.expected.judge(measured),
            study: studies.get(&claim.figure).copied().unwrap_or(""),
            measured,
            check,
            claim,
        }
    };
    Ok(claims.into_iter().map(judge).collect())
}

/// What a run says that the record does not: verdicts, and reasons that do not hold.
fn failures(judged: &[Judged]) -> Vec<String> {
    let mut all = Vec::new();
    for one in judged {
        let (id, recorded, verdict) = (&one.claim.id, one.claim.recorded, one.verdict);
        if one.claim.differs(verdict) {
            let found = one.measured.map_or("nothing".to_owned(), |m| m.to_string());
            all.push(format!(
                "`{id}` is {verdict} ({found}, expected {}), {recorded} on record",
                one.claim.expected.text()
            ));
        }
        if let Some((found, false)) = one.check {
            let found = found.map_or("nothing".to_owned(), |m| m.to_string());
            all.push(format!("`{id}`: its reason does not hold: {found}"));
        }
    }
    all
}

/// How many have each verdict.
fn counts(judged: &[Judged]) -> [usize; Verdict::ALL.len()] {
    Verdict::ALL.map(|verdict| judged.iter().filter(|j| j.verdict == verdict).count())
}

/// The claims as data.
fn document(judged: &[Judged]) -> Value {
    let [confirmed, stronger, weaker, refuted, not_measurable] = counts(judged);
    let of = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let claim = |one: &Judged| {
        let claim = &one.claim;
        let (expected, tolerance, none) = match claim.expected {
            Expected::Figure {
                value,
                tolerance,
                none,
            } => (of(value), of(tolerance), none.map_or(Value::Null, of)),
            Expected::AtMost(bound) | Expected::AtLeast(bound) => {
                (of(bound), Value::Null, Value::Null)
            }
            Expected::Elsewhere => (Value::Null, Value::Null, Value::Null),
        };
        let relation = match claim.expected {
            Expected::Figure { .. } => "equal",
            Expected::AtMost(_) => "at most",
            Expected::AtLeast(_) => "at least",
            Expected::Elsewhere => "none",
        };
        let part = |f: fn(&Measured) -> Option<f64>| {
            one.measured.as_ref().and_then(f).map_or(Value::Null, of)
        };
        let checked = one.check.and_then(|(found, _)| found);
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
            "measured": part(|m| Some(m.value)),
            "low": part(|m| Some(m.interval?[0])),
            "high": part(|m| Some(m.interval?[1])),
            "verdict": one.verdict.name(),
            "recorded": claim.recorded.name(),
            "recorded_otherwise": claim.otherwise.map(|(verdict, _)| verdict.name()),
            "sentence": claim.expected.sentence(one.measured),
            "timed": claim.is_timed,
            "reason": claim.reason.map_or("", |r| r.words),
            "checked": checked.map_or(Value::Null, |m| of(m.value)),
            "reason_holds": one.check.map_or(Value::Null, |(_, holds)| json!(holds)),
        })
    };
    json!({
        "confirmed": confirmed,
        "stronger": stronger,
        "weaker": weaker,
        "refuted": refuted,
        "not_measurable": not_measurable,
        "claims": judged.iter().map(claim).collect::<Vec<_>>(),
    })
}

/// The summary line.
fn summary(judged: &[Judged]) -> String {
    let [confirmed, stronger, weaker, refuted, not_measurable] = counts(judged);
    format!(
        "{} claims: {confirmed} confirmed, {stronger} stronger, {weaker} weaker, {refuted} refuted, {not_measurable} not measurable here.",
        judged.len()
    )
}

/// What the check of a reason found, in words.
fn checked(one: &Judged) -> Option<String> {
    let (name, expected) = one.claim.reason?.check?;
    let (found, holds) = one.check?;
    let found = found.map_or("nothing".to_owned(), |m| m.to_string());
    let told = if holds {
        "as it says"
    } else {
        "it does not hold"
    };
    Some(format!(
        "Checked by {name}: {found}, expected {}: {told}.",
        expected.text()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn claims_are_told_apart_and_reasons_stand_where_they_are_wanted() {
        let all = list::all();
        assert!(all.len() >= 60, "{}", all.len());
        let ids: BTreeSet<&str> = all.iter().map(|c| c.id.as_str()).collect();
        assert_eq!(ids.len(), all.len());
        for claim in &all {
            let has = claim.reason.is_some();
            assert_eq!(has, claim.recorded.needs_reason(), "{}", claim.id);
            let full = claim.otherwise.map(|(verdict, _)| verdict);
            assert_ne!(full, Some(claim.recorded), "{}", claim.id);
            let elsewhere = claim.expected == Expected::Elsewhere;
            assert_eq!(
                elsewhere,
                claim.recorded == Verdict::NotMeasurable,
                "{}",
                claim.id
            );
            assert_eq!(elsewhere, claim.why.is_empty(), "{}: why", claim.id);
            assert!(claim.says.ends_with('.'), "{}", claim.id);
        }
    }

    #[test]
    fn another_verdict_than_the_record_fails_and_is_named() {
        let claim = list::all().remove(0);
        let (id, recorded) = (claim.id.clone(), claim.recorded);
        let Expected::Figure { value, none, .. } = claim.expected else {
            panic!("the first claim is of a figure");
        };
        let mut figures = Figures::new();
        // At no effect at all: refuted.
        figures.insert(claim.figure.clone(), Measured::exact(none.unwrap()));
        let judged = judge(vec![claim.clone()], &figures, &BTreeMap::new()).unwrap();
        let found = failures(&judged);
        assert_ne!(recorded, Verdict::Refuted);
        assert!(
            found[0].contains(&id) && found[0].contains("is refuted"),
            "{found:?}"
        );
        figures.insert(claim.figure.clone(), Measured::exact(value));
        let judged = judge(vec![claim.clone()], &figures, &BTreeMap::new()).unwrap();
        assert_eq!(failures(&judged).is_empty(), recorded == Verdict::Confirmed);
        figures.clear();
        assert!(judge(vec![claim], &figures, &BTreeMap::new()).is_err());
    }

    /// Of a claim with two verdicts on record each form is held to its own, by its own reason.
    #[test]
    fn both_forms_are_held_to_their_own_record() {
        let why = Some(("why", Expected::AtMost(0.0)));
        let claim = Claim::new(claim::Paper::Billen, "a", "b", "c.")
            .at_most(1.0, "d")
            .but_in_full(Verdict::Refuted, "e", why);
        let judged = |claim: &Claim, a: f64, why: f64| {
            let figures = [("a", a), ("why", why)];
            let figures = figures.map(|(name, v)| (name.to_owned(), Measured::exact(v)));
            judge(vec![claim.clone()], &figures.into(), &BTreeMap::new()).unwrap()
        };
        let failed = |claim: &Claim, a, why| failures(&judged(claim, a, why)).len();
        let full = claim.clone().in_full();
        assert_eq!([0.5, 2.0].map(|a| failed(&claim, a, 1.0)), [0, 1]);
        assert_eq!([0.5, 2.0].map(|a| failed(&full, a, 0.0)), [1, 0]);
        assert_eq!(failed(&full, 2.0, 1.0), 1);
        let page = page::report(&judged(&full, 2.0, 1.0), &[]);
        let note = &page.sections[0].notes[0];
        assert!(note.contains("refuted: c. e Checked by why"), "{note}");
        assert!(note.contains("of the other form: confirmed"), "{note}");
    }
}
