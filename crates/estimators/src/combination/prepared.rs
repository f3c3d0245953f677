//! One technique of a combination, made ready for a shading point and a light.

use crate::techniques::lines::LineFamily;
use crate::techniques::points::{PointSource, Polygon};
use crate::{EmissionTexture, Estimator, LineDirection, Pieces, PointBy, Technique, Weights};

/// A technique, the samples expected of it and the samples it gets.
#[derive(Clone, Debug)]
pub(super) struct PreparedTechnique<'t> {
    pub source: Source<'t>,
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
pub(super) enum Source<'t> {
    Points(PointSource<'t>),
    Lines(LineFamily<'t>, Pieces),
}

impl<'t> PreparedTechnique<'t> {
    /// The techniques of a combination with this many samples in the mean; `u(k)` are independent
    /// random numbers. `dense` says that too much stands in between to keep it.
    pub(super) fn all<T: EmissionTexture>(
        estimator: &Estimator,
        samples: f64,
        part: &Polygon<'t, T>,
        dense: bool,
        u: impl Fn(u32) -> f64,
        out: &mut Vec<Self>,
    ) {
        out.clear();
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
                    let source = PointSource::new(points.by, part);
                    push(Source::Points(source), expected, 1);
                    continue;
                }
                Technique::Lines(lines) => lines,
            };
            if dense
                && lines
                    .integration
                    .is_some_and(|i| i.points_if_dense().is_some())
            {
                let source = PointSource::new(PointBy::Area, part);
                push(Source::Points(source), expected, 1);
                continue;
            }
            let optimal = matches!(estimator.weights(), Weights::Optimal(_));
            let points = if optimal { 1 } else { lines.points };
            let mut push_lines = |fraction, expected| {
                let family = LineFamily::new(&lines, part, fraction);
                push(Source::Lines(family, lines.pieces), expected, points);
            };
            let count = match lines.direction {
                LineDirection::Fixed(fraction) => {
                    push_lines(fraction, expected);
                    continue;
                }
                LineDirection::Parallel | LineDirection::UniformPerLine => 1,
                LineDirection::Spread(count) => count,
            };
            for k in 0..count {
                let fraction = lines.measure().spread(u(index + 1), k, count);
                push_lines(fraction, expected / f64::from(count));
            }
        }
    }
}

/// Gives whole numbers of samples with the expected means: systematic rounding of the running sum.
pub(super) fn allot(techniques: &mut [PreparedTechnique<'_>], u: f64) {
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
