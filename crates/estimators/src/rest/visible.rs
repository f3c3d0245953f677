//! Points of the visible region of a polygon are sampled here. They need no visibility queries,
//! since they are drawn where the light is visible.

use crate::integrand::Integrand;
use crate::known::region::RegionMemory;
use crate::streams::Samples;
use crate::view::LightView;
use crate::{EmissionTexture, Stream};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::DVec3;
use linelit_lights::{RegionSampler, VisiblePolygonLtc};

/// The number of samples for each pilot sample, and the least and largest number of pilot samples.
const SAMPLES_FOR_ONE_AHEAD: u32 = 4;
const LEAST_AHEAD: u32 = 8;
const MOST_AHEAD: u32 = 2 * LEAST_AHEAD;

/// Samples points of the visible region in proportion to LTCs. The memory has the region's boundary
/// in a plane. Returns the factor β, and the mean of L (f cos θ − β g)/p.
///
/// In the tail of a lobe, g may be many times f cos θ. So β is the factor that fits a few pilot
/// samples best. It does not depend on the other samples, so that the estimate is unbiased. `None`
/// if a part of the light is visible whose area is rounded to zero.
pub(crate) fn points<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    view: &LightView<'_>,
    cosines: &LtcMixture,
    plane: [DVec3; 3],
    samples: Samples<'_>,
    memory: &RegionMemory,
    region: &mut RegionSampler,
) -> Option<(f64, DVec3)> {
    let (light, known) = (view.polygon()?, integrand.known?);
    let (point, x) = (integrand.point, view.at.position);
    // Set up a sampler of the visible region.
    let pieces = memory.penumbra.latest();
    if pieces.is_empty() {
        return Some((1.0, DVec3::ZERO));
    }
    let [origin, along_p, along_q] = plane;
    let pieces = pieces.iter().map(|edge| [edge.from, edge.to]);
    region.set([origin + x, along_p, along_q], pieces);
    if region.area() <= 0.0 {
        return None;
    }
    let lobes = VisiblePolygonLtc::within(region, light, x, cosines, &memory.reflected);
    // Draw a point, and return f cos θ/p and g/p there.
    let draw = |u: [f64; 2]| {
        let (at, density) = lobes.draw(u, light, x)?;
        let cosine = point.cosine(at.direction);
        (cosine > 0.0 && density > 0.0).then(|| {
            let f = point.bsdf.eval(at.direction, point.outgoing, point.normal);
            [f * cosine, known.cosines.at(at.direction, cosine)].map(|v| v / density)
        })
    };
    // Fit β to pilot samples, which are independent of the others.
    let count = (samples.count / SAMPLES_FOR_ONE_AHEAD).min(MOST_AHEAD);
    let beta = if count < LEAST_AHEAD {
        1.0
    } else {
        let ahead = samples.numbers.points(Stream::Ahead, count);
        let drawn = (0..count).map(|i| draw(ahead.get_2d(i)).unwrap_or_default());
        slope(drawn.map(|pair| pair.map(DVec3::element_sum)))
    };
    // Add up the difference over all samples.
    let set = samples.set();
    let sum: DVec3 = (0..samples.count)
        .filter_map(|i| draw(set.get_2d(i)))
        .map(|[f, g]| f - g * beta)
        .sum();
    Some((beta, known.emitted * (sum / f64::from(samples.count))))
}

/// The slope of the line that fits pairs of f and g best, if it is between 0 and 1 and leaves at
/// most half of the variance of f − g; otherwise one.
fn slope(pairs: impl Iterator<Item = [f64; 2]>) -> f64 {
    let (mut n, mut sums, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
    for [f, g] in pairs {
        n += 1.0;
        sums = [sums[0] + f, sums[1] + g];
        squares = [squares[0] + f * f, squares[1] + f * g, squares[2] + g * g];
    }
    let [f, g] = sums;
    let [ff, fg, gg] = [
        squares[0] - f * f / n,
        squares[1] - f * g / n,
        squares[2] - g * g / n,
    ];
    let left = |beta: f64| ff - 2.0 * beta * fg + beta * beta * gg;
    let beta = (fg / gg).clamp(0.0, 1.0);
    if left(beta) < 0.5 * left(1.0) {
        beta
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::slope;

    /// The slope is used if it leaves much less variance than a slope of one, and is within bounds.
    #[test]
    fn slopes_that_fit_are_taken() {
        let of = |pairs: &[[f64; 2]]| slope(pairs.iter().copied());
        // A dozen roundings of numbers below ten, over squares of two.
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-14, "{got} for {want}");
        // The tail of a lobe; a line that misses zero; f that falls as g grows; a slope above one.
        close(of(&[[0.15, 1.0], [0.45, 3.0], [0.3, 2.0]]), 0.15);
        close(of(&[[1.25, 1.0], [1.75, 3.0], [1.5, 2.0]]), 0.25);
        close(of(&[[3.0, 1.0], [1.0, 3.0], [2.0, 2.0]]), 0.0);
        close(of(&[[2.0, 1.0], [6.0, 3.0], [4.0, 2.0]]), 1.0);
        // The slope of 0.9 leaves more than half of the variance that a slope of one leaves.
        close(of(&[[1.0, 1.0], [2.4, 3.0], [2.5, 2.0], [0.0, 0.0]]), 1.0);
        // There is no information.
        close(of(&[]), 1.0);
        close(of(&[[1.0, 2.0]; 8]), 1.0);
        close(of(&[[0.0, 0.0]; 8]), 1.0);
    }
}
