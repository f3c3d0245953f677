//! Which of two patterns converges faster: what a paper says, and what was measured.

use crate::plots::signed;
use crate::tables::SlopeRow;
use linelit_elementary::hypot;

/// Two patterns of one estimator on one scene, the paper's faster one first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranking<'a> {
    faster: &'a SlopeRow,
    slower: &'a SlopeRow,
    /// The paper's difference of orders, not positive.
    paper: f64,
}

/// What the measured orders say of a paper's ranking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judged {
    /// The same, beyond what their intervals leave open.
    Confirmed,
    /// The other way round.
    Reversed,
    /// Intervals leave both open, or there are none.
    Open,
}

impl Ranking<'_> {
    /// The measured difference of orders, and half of its interval: those of independent orders add
    /// as standard errors do.
    fn difference(&self) -> [f64; 2] {
        let half = |s: &SlopeRow| 0.5 * (s.ci_high - s.ci_low);
        let difference = self.faster.order - self.slower.order;
        [difference, hypot(half(self.faster), half(self.slower))]
    }

    pub(super) fn judged(&self) -> Judged {
        let [difference, half] = self.difference();
        if difference + half < 0.0 {
            Judged::Confirmed
        } else if difference - half > 0.0 {
            Judged::Reversed
        } else {
            Judged::Open
        }
    }

    fn text(&self) -> String {
        let [difference, half] = self.difference();
        let (a, b) = (&self.faster.sampler, &self.slower.sampler);
        let word = match self.judged() {
            Judged::Confirmed => "confirmed",
            Judged::Reversed => "the other way round",
            Judged::Open => "open",
        };
        format!(
            "{}: {a} before {b}, {} in the paper, {} ± {half:.3} here: {word}",
            self.faster.estimator,
            signed(self.paper, 3),
            signed(difference, 3)
        )
    }
}

/// Orders closer than this are no ranking: two digits of a fitted order are luck.
const TIE: f64 = 0.02;

/// All pairs of patterns that a paper ranks for one estimator on one scene, of different speed.
pub(super) fn rankings<'a>(slopes: &[&'a SlopeRow]) -> Vec<Ranking<'a>> {
    let mut out = Vec::new();
    for (k, &a) in slopes.iter().enumerate() {
        for &b in &slopes[k + 1..] {
            let (Some(p), Some(q)) = (a.paper_order, b.paper_order) else {
                continue;
            };
            if a.estimator != b.estimator || (p - q).abs() < TIE {
                continue;
            }
            let (faster, slower) = if p < q { (a, b) } else { (b, a) };
            out.push(Ranking {
                faster,
                slower,
                paper: -(p - q).abs(),
            });
        }
    }
    out
}

/// A remark on a paper's ranking of patterns on one scene; `None` where it has none.
pub(super) fn note(slopes: &[&SlopeRow]) -> Option<String> {
    let all = rankings(slopes);
    let of = |judged| all.iter().filter(move |r| r.judged() == judged).count();
    let list: Vec<String> = all.iter().map(Ranking::text).collect();
    (!all.is_empty()).then(|| {
        format!(
            "The paper's ranking of patterns by order: {} of {} pairs confirmed, {} the other way round. {}.",
            of(Judged::Confirmed),
            all.len(),
            of(Judged::Reversed),
            list.join("; ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(sampler: &str, order: f64, paper: f64) -> SlopeRow {
        SlopeRow {
            estimator: "line-analytic".to_owned(),
            sampler: sampler.to_owned(),
            order,
            ci_low: order - 0.05,
            ci_high: order + 0.05,
            ..SlopeRow::default()
        }
        .with_paper(paper, "Fig. 9")
    }

    #[test]
    fn rankings_are_judged_by_intervals() {
        let stratified = slope("stratified", -1.2, -1.15);
        for (order, judged) in [
            (-1.0, Judged::Confirmed),
            (-1.4, Judged::Reversed),
            (-1.18, Judged::Open),
        ] {
            let sobol = slope("sobol", order, -1.02);
            let rows = [&sobol, &stratified];
            let all = rankings(&rows);
            assert_eq!(all.len(), 1);
            assert_eq!(all[0].faster.sampler, "stratified");
            assert_eq!(all[0].judged(), judged, "{order}");
        }
        let none = SlopeRow {
            ci_low: f64::NAN,
            ..slope("sobol", -9.0, -1.02)
        };
        assert_eq!(rankings(&[&none, &stratified])[0].judged(), Judged::Open);
        // Ties and patterns without the paper's order are no ranking.
        assert!(rankings(&[&stratified, &slope("halton", -1.0, -1.16)]).is_empty());
        assert!(note(&[&SlopeRow::default(), &stratified]).is_none());
        let sobol = slope("sobol", -1.0, -1.02);
        assert!(note(&[&sobol, &stratified]).is_some_and(|n| n.contains("1 of 1 pairs confirmed")));
    }
}
