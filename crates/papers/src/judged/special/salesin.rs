//! Formulas and weights of Salesin & Jarosz 2019, and the effect of scrambling on the nets of
//! Billen & Dutré.

use super::{Numbers, Out, integral};
use crate::drawings::{OCCLUDERS, Smoothing, visible, weight};
use crate::judged::bench::Bench;
use crate::measured::Measured;
use anyhow::Result;
use linelit_samplers::{Sampler, SamplerKind};

/// Evaluates Salesin & Jarosz, eq. 7, for two densities on [0, 1] as printed and without the factor
/// 1/S. Expectations are computed by quadrature.
pub(super) fn combination(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let numbers = &mut Numbers::new(bench.context.seed);
    let (a, b) = (numbers.between(0.2, 0.8), numbers.between(0.2, 0.8));
    let density = |s: usize, x: f64| match s {
        0 => 2.0 * (a + (1.0 - 2.0 * a) * x),
        _ => 3.0 * x * x * b + 1.0 - b,
    };
    let integrand = |x: f64| 1.0 + (3.0 * x).sin();
    let counts = [1.0, 3.0];
    // The expectation of the mean of w f/p over N_s samples is ∫ w f.
    let expectation = |s: usize| {
        let weight = |x: f64| {
            let all = counts[0] * density(0, x) + counts[1] * density(1, x);
            counts[s] * density(s, x) / all
        };
        integral(|x| weight(x) * integrand(x), 0.0, 1.0)
    };
    let exact = integral(integrand, 0.0, 1.0);
    let sum = (expectation(0) + expectation(1)) / exact;
    out.insert("eq. 7 as printed".to_owned(), Measured::exact(sum / 2.0));
    out.insert("eq. 7 mended".to_owned(), Measured::exact(sum));
    Ok(())
}

/// Measures how much scrambling adds to the order of the root mean squared error when the first
/// points of van der Corput's sequence integrate a ramp, whose ends differ.
pub(super) fn sequences(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let trials = bench.pick(2, 64, 256);
    // The error with Owen-scrambled points.
    let scrambled = |samples: u32| {
        let square = |seed: u64| {
            let set = Sampler::new(SamplerKind::Sobol, seed).points([0, 0], 0, samples);
            let sum: f64 = (0..samples).map(|k| set.get_1d(k)).sum();
            (sum / f64::from(samples) - 0.5).powi(2)
        };
        ((0..trials).map(square).sum::<f64>() / trials as f64).sqrt()
    };
    // The error with the sequence itself.
    let plain = |samples: u32| {
        let sum: f64 = (0..samples)
            .map(|k| f64::from(k.reverse_bits()) / 2f64.powi(32))
            .sum();
        (sum / f64::from(samples) - 0.5).abs()
    };
    // Compare the orders from 4 to 1024 points.
    let order = |few: f64, many: f64| (many / few).ln() / 256_f64.ln();
    let gain = order(scrambled(4), scrambled(1024)) - order(plain(4), plain(1024));
    out.insert("a ramp, scrambled".to_owned(), Measured::exact(gain));
    Ok(())
}

/// Measures the largest jumps of the weights of Fig. 4 between positions 2·10⁻⁷ apart: at the
/// light's borders, at the edges of the hidden parts, and where lines move across a corner of a
/// triangle.
pub(super) fn weights(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    const STEP: f64 = 1e-7;
    let places = bench.pick(4, 256, 1024);
    let along = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(places) - 1.0;
    for (smoothing, name) in [
        (Smoothing::None, "none"),
        (Smoothing::Fixed, "fixed"),
        (Smoothing::Variable, "variable"),
    ] {
        let [mut border, mut edge, mut corner] = [0.0_f64; 3];
        for axis in 0..2 {
            let of = |t: f64, offset: f64| {
                let at = if axis == 0 { [t, offset] } else { [offset, t] };
                weight(smoothing, at)
            };
            // Step across the borders of the light, and across the ends of each line's visible
            // parts.
            for offset in (0..places).map(along) {
                let step = |a: f64, b: f64| (of(a, offset) - of(b, offset)).abs();
                border = border.max(step(STEP - 1.0, -1.0 - STEP));
                border = border.max(step(1.0 - STEP, 1.0 + STEP));
                let ends = visible(axis, offset);
                let ends = ends.as_slice().iter().flat_map(|part| [part.lo, part.hi]);
                // The light's borders are measured above.
                for end in ends.filter(|t| 0.0 < *t && *t < 1.0) {
                    let end = 2.0 * end - 1.0;
                    edge = edge.max(step(end + STEP, end - STEP));
                }
            }
            // Step from lines that pass a corner on one side to lines that pass it on the other.
            // The hidden part of the light is twice as large as the triangle that hides it.
            for at in OCCLUDERS.iter().flatten() {
                let (u, v) = (2.0 * at[axis], 2.0 * at[1 - axis]);
                for t in (0..places).map(along).filter(|t| (t - u).abs() > 0.01) {
                    let both = [of(t, v + STEP), of(t, v - STEP)];
                    // Where the step crosses an edge of the hidden part itself, one of the weights
                    // is zero.
                    if both.iter().all(|w| *w > 0.0) {
                        corner = corner.max((both[0] - both[1]).abs());
                    }
                }
            }
        }
        for (place, step) in [("borders", border), ("edges", edge), ("corners", corner)] {
            out.insert(format!("{name}, {place}"), Measured::exact(step));
        }
    }
    Ok(())
}
