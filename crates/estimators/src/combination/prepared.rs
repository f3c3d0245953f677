//! One technique of a combination, made ready for a shading point and a light.

use super::domain::Domain;
use crate::{
    EmissionTexture, LineDirection, Pieces, PointBy, Query, RandomNumbers, Technique, Weights,
};
use linelit_bsdf::Reflection;

/// A technique, the samples expected of it and the samples it gets.
#[derive(Clone, Debug)]
pub(super) struct PreparedTechnique<P, L> {
    pub source: Source<P, L>,
    /// The expected number of samples N_i, which stands in weights and contributions; of a line
    /// technique, points on a piece.
    pub expected: f64,
    /// The number drawn this time; its mean is `expected` over `points`.
    pub count: u32,
    /// Where the random numbers of these come from.
    pub numbers: RandomNumbers,
    /// Samples of one draw: points on a piece of a line.
    pub points: u8,
}

/// What a technique draws from.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a few of them live in a buffer that is used again"
)]
pub(super) enum Source<P, L> {
    Points(P),
    Lines(L, Pieces),
}

impl<P, L> PreparedTechnique<P, L> {
    /// The techniques of a combination with this many samples in the mean; `u(k)` are independent
    /// random numbers, and `instead` says which points stand for the lines of integrals, if any do.
    pub(super) fn all<D: Domain<Points = P, Lines = L>>(
        query: &Query<'_, impl Reflection, impl EmissionTexture>,
        samples: f64,
        part: &D,
        instead: Option<PointBy>,
        u: impl Fn(u32) -> f64,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        let estimator = query.estimator;
        let total: f64 = estimator.parts().map(|p| f64::from(p.share)).sum();
        for (index, entry) in (0u32..).zip(estimator.parts()) {
            let expected = samples * f64::from(entry.share) / total;
            let mut push = |source, expected, points: u8| {
                out.push(Self {
                    source,
                    expected: expected * f64::from(points),
                    count: 0,
                    numbers: query.numbers,
                    points,
                });
            };
            let lines = match entry.technique {
                Technique::Points(points) => {
                    let source = part.points(points.by);
                    push(Source::Points(source), expected, 1);
                    continue;
                }
                Technique::Lines(lines) => lines,
            };
            let integral = lines.integration.filter(|i| !i.keeps_lines());
            if let (Some(by), Some(_)) = (instead, integral) {
                push(Source::Points(part.points(by)), expected, 1);
                continue;
            }
            let optimal = matches!(estimator.weights(), Weights::Optimal(_));
            let points = if optimal { 1 } else { lines.points };
            let mut push_lines = |fraction, expected| match part.lines(&lines, fraction) {
                Some(family) => push(Source::Lines(family, lines.pieces), expected, points),
                None => push(
                    Source::Points(part.points(PointBy::SolidAngle)),
                    expected,
                    1,
                ),
            };
            let LineDirection::Spread(count) = lines.direction else {
                push_lines(lines.fraction(query, u(index + 1)), expected);
                continue;
            };
            for k in 0..count {
                let fraction = lines.measure().spread(u(index + 1), k, count);
                push_lines(fraction, expected / f64::from(count));
            }
        }
    }
}

/// Gives whole numbers of samples with the expected means: systematic rounding of the running sum,
/// by the number `u` of the block of `numbers`.
pub(super) fn allot<P, L>(
    techniques: &mut [PreparedTechnique<P, L>],
    numbers: &RandomNumbers,
    u: f64,
) {
    let (mut sum, mut given, mut expected) = (u, 0.0, 0.0_f64);
    for technique in techniques {
        let draws = technique.expected / f64::from(technique.points);
        sum += draws;
        let upto = sum.floor();
        technique.count = whole(upto - given);
        given = upto;
        // From which u on one more is given to the techniques before this one, and with it.
        let marks = [expected, expected + draws].map(|e| 1.0 - e.fract());
        technique.numbers = numbers.among(u, marks);
        expected += draws;
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a difference of whole numbers between 0 and the number of samples"
)]
fn whole(number: f64) -> u32 {
    number as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_samplers::{Block, SamplerKind, hash::mix, hash::unit_f64};
    use std::collections::BTreeMap;

    /// Each block has all its samples, each technique its share of all blocks, and the blocks that
    /// give it as many are numbered as those of a pattern of their own.
    #[test]
    fn blocks_that_give_a_technique_as_many_samples_share_a_pattern() {
        for (shares, blocks) in [
            (&[0.75, 0.25][..], 64),
            (&[2.25, 0.75, 1.0], 16),
            (&[1.0, 2.0], 7),
            (&[0.4, 0.35, 0.25], 60),
        ] {
            for seed in 0..50 {
                let u = unit_f64(mix(seed + 1));
                let mut groups = vec![BTreeMap::<u32, Vec<Block>>::new(); shares.len()];
                for index in 0..blocks {
                    let numbers = RandomNumbers::new(SamplerKind::Sobol, 0, [0, 0], 0)
                        .with_block(Block::new(index, blocks));
                    let one = |expected: &f64| PreparedTechnique::<(), ()> {
                        source: Source::Points(()),
                        expected: *expected,
                        count: 0,
                        numbers,
                        points: 1,
                    };
                    let mut techniques: Vec<_> = shares.iter().map(one).collect();
                    allot(&mut techniques, &numbers, numbers.spread(u));
                    let count: u32 = techniques.iter().map(|t| t.count).sum();
                    assert_eq!(count, whole(shares.iter().sum::<f64>().round()));
                    for (groups, technique) in groups.iter_mut().zip(&techniques) {
                        let group = groups.entry(technique.count).or_default();
                        group.push(technique.numbers.block);
                    }
                }
                for (groups, share) in groups.iter().zip(shares) {
                    let samples = groups.iter().map(|(n, group)| *n as usize * group.len());
                    let error = samples.sum::<usize>() as f64 - share * f64::from(blocks);
                    assert!(error.abs() < 1.0, "{shares:?} {blocks}: {error}");
                    for group in groups.values() {
                        let mut numbers: Vec<u32> = group.iter().map(Block::index).collect();
                        numbers.sort_unstable();
                        assert!(numbers.iter().zip(0..).all(|(a, b)| *a == b), "{numbers:?}");
                        assert!(group.iter().all(|b| b.of() as usize == group.len()));
                    }
                }
            }
        }
    }
}
