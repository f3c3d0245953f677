//! A technique of a combination is set up here for a shading point and a light, and gets its number
//! of samples.

use crate::{
    EmissionTexture, LightSource, LineBy, LineDirection, Lines, MOST_TECHNIQUES, Pieces, PointBy,
    PointDensity, RandomNumbers, Technique, Weighted, Weights,
};
use linelit_geometry::DVec3;
use linelit_lights::{LightPoint, LineFamily, LineSetup, PointSource, Surface, Viewer};
use std::f64::consts::PI;

/// A visible point of the light that one of the techniques drew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// The index of the technique that drew it.
    pub technique: usize,
    pub at: LightPoint,
    /// The value of the integrand.
    pub value: DVec3,
    /// The density per solid angle by which its own technique drew it.
    pub density: f64,
    /// The density per solid angle of each technique, as weights use it.
    pub densities: [f64; MOST_TECHNIQUES],
    /// The factor by which smoothing reduces the densities of points in weights.
    pub smooth: f64,
}

/// A technique that is set up for a shading point and a light, with its numbers of samples.
#[derive(Clone, Debug)]
pub(super) struct Prepared<'t> {
    pub source: Family<'t>,
    /// The expected number of samples N_i, which weights and contributions use. For a line
    /// technique this counts points on a piece.
    pub expected: f64,
    /// The number of draws this time; its mean is `expected` divided by `points`.
    pub count: u32,
    /// The random numbers of these draws.
    pub numbers: RandomNumbers,
    /// The number of samples for each draw, which is the number of points on a piece of a line.
    pub points: u8,
}

/// The points or the lines that a technique draws.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there are a few of them")]
pub(super) enum Family<'t> {
    /// Points by a density, or directions from the BSDF if there is no density. A source is large,
    /// a family of lines is not.
    Points(Option<Box<PointSource<'t>>>),
    Lines(LineFamily<'t>, Pieces),
}

/// The part of a light on which techniques draw, and the shading point that sees it.
pub(super) struct Domain<'t, T> {
    /// The part of the surface above the horizons.
    pub surface: Surface<'t>,
    /// The angle from the first edge of that part to the first edge of the whole light, in radians.
    pub turn: f64,
    pub light: &'t LightSource<'t, T>,
    pub viewer: Viewer<'t>,
}

impl<'t, T: EmissionTexture> Domain<'t, T> {
    /// Points on this part by a density.
    fn points(&self, by: PointBy) -> Family<'t> {
        let Some(by) = by.on_surface() else {
            return Family::Points(None);
        };
        let source = PointSource::new(by, self.surface, self.light.texture, &self.viewer);
        Family::Points(Some(Box::new(source)))
    }

    /// Lines on this part in a direction that is a fraction of a half turn from the light's first
    /// edge; `None` on a light without lines.
    fn lines(&self, lines: &Lines, fraction: f64) -> Option<LineFamily<'t>> {
        let setup = LineSetup {
            fraction,
            angle: fraction * PI + self.turn,
            fixed: matches!(lines.direction, LineDirection::Fixed(_)),
            offset: lines.offset,
        };
        let by = lines.measure();
        LineFamily::new(by, self.surface, self.light.texture, setup, &self.viewer)
    }
}

impl<'t> Prepared<'t> {
    /// Sets up the techniques of a combination that has this many samples in the mean; `u(k)` are
    /// independent random numbers. On a light without lines, points by solid angle replace the
    /// lines, one for each draw.
    pub(super) fn all<T: EmissionTexture>(
        weighted: &Weighted<'_>,
        samples: f64,
        domain: &Domain<'t, T>,
        numbers: &RandomNumbers,
        u: impl Fn(u32) -> f64,
    ) -> Vec<Self> {
        let total: f64 = weighted.techniques().map(|p| f64::from(p.share)).sum();
        let mut out = Vec::with_capacity(weighted.parts.len() + 1);
        // Give each technique its share of the samples.
        for (index, part) in (1..).zip(weighted.techniques()) {
            let mut expected = samples * f64::from(part.share) / total;
            let lines = match part.technique {
                Technique::Points(points) => {
                    out.push(Self::new(domain.points(points.by), expected, 1, numbers));
                    continue;
                }
                Technique::Lines(lines) => lines,
            };
            // Spread the samples of lines over their directions.
            let optimal = matches!(weighted.weights, Weights::Optimal(_));
            let points = if optimal { 1 } else { lines.points };
            let (first, count) = (u(index), lines.directions());
            expected /= f64::from(count);
            for k in 0..count {
                // Find the direction, in half turns from the light's first edge.
                let fraction = match (lines.direction, lines.measure()) {
                    // Lines by texture run along the two edges of the light in turn.
                    (LineDirection::Spread(_), LineBy::Texture) => {
                        0.5 * ((2.0 * first).floor() + f64::from(k))
                    }
                    (LineDirection::Spread(_), _) => first + f64::from(k) / f64::from(count),
                    _ => lines.fraction(&domain.light.occlusion, first),
                };
                out.push(match domain.lines(&lines, fraction) {
                    Some(family) => {
                        let source = Family::Lines(family, lines.pieces);
                        Self::new(source, expected, points, numbers)
                    }
                    None => {
                        let source = domain.points(PointDensity::SolidAngle.into());
                        Self::new(source, expected, 1, numbers)
                    }
                });
            }
        }
        out
    }

    /// A technique with this many draws in the mean, before whole numbers are assigned.
    fn new(source: Family<'t>, draws: f64, points: u8, numbers: &RandomNumbers) -> Self {
        Self {
            source,
            expected: draws * f64::from(points),
            count: 0,
            numbers: *numbers,
            points,
        }
    }
}

/// Assigns whole numbers of samples to techniques, with the expected means, by systematic sampling:
/// the running sum of the expected numbers is rounded after adding `u`, the number of the block of
/// `numbers`.
pub(super) fn allot(techniques: &mut [Prepared<'_>], numbers: &RandomNumbers, u: f64) {
    let (mut sum, mut given, mut expected) = (u, 0.0, 0.0_f64);
    for technique in techniques {
        let draws = technique.expected / f64::from(technique.points);
        sum += draws;
        let upto = sum.floor();
        technique.count = whole(upto - given);
        given = upto;
        // The marks are the values of u above which the techniques before this one, and then this
        // one too, get one more sample.
        let marks = [expected, expected + draws].map(|e| 1.0 - e.fract());
        technique.numbers = numbers.among(u, marks);
        expected += draws;
    }
}

/// The whole number as `u32`.
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

    /// Each block has all its samples, and over all blocks each technique has its share. The blocks
    /// that give a technique equally many samples are numbered as the blocks of a pattern of their
    /// own.
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
                    let one =
                        |draws: &f64| Prepared::new(Family::Points(None), *draws, 1, &numbers);
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
