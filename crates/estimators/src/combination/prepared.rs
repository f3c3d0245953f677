//! One technique of a combination, made ready for a shading point and a light.

use super::domain::Domain;
use crate::{EmissionTexture, LineDirection, Pieces, PointBy, Query, Technique, Weights};
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
            let count = match lines.direction {
                LineDirection::Spread(count) => count,
                LineDirection::Adaptive
                | LineDirection::Fixed(_)
                | LineDirection::Parallel
                | LineDirection::UniformPerLine => {
                    push_lines(lines.fraction(query, u(index + 1)), expected);
                    continue;
                }
            };
            for k in 0..count {
                let fraction = lines.measure().spread(u(index + 1), k, count);
                push_lines(fraction, expected / f64::from(count));
            }
        }
    }
}

/// Gives whole numbers of samples with the expected means: systematic rounding of the running sum.
pub(super) fn allot<P, L>(techniques: &mut [PreparedTechnique<P, L>], u: f64) {
    let (mut sum, mut given) = (u, 0.0);
    for technique in techniques {
        sum += technique.expected / f64::from(technique.points);
        let upto = sum.floor();
        technique.count = whole(upto - given);
        given = upto;
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
