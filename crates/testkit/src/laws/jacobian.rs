//! The density of a sampler from derivatives of its samples by their random numbers. There is no
//! randomness in it, so that it checks six digits where a histogram checks two.

/// The estimated relative error of a derivative below which it is compared with the density;
/// positions with a larger error are skipped.
const SURE: f64 = 1e-8;

/// The number of positions at which densities are compared.
const PLACES: u32 = 200;

/// The steps of the differences, relative to the distance to the nearer end of [0, 1].
const STEPS: [f64; 3] = [1.0 / 128.0, 1.0 / 181.0, 1.0 / 256.0];

/// A position where samples are spread over another measure than the density says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Off {
    pub(super) at: Vec<f64>,
    /// The density times the measure over which samples are spread; it should be one.
    pub(super) product: f64,
}

/// Checks that a density is the inverse of the Jacobian determinant of the sampling.
/// `coordinates(u)` returns coordinates of the sample of the uniform numbers `u`, and `density(u)`
/// its density by their measure. Returns the fraction of 200 positions at which the derivatives are
/// accurate enough to compare (they are not across a corner of the density or a seam of the
/// coordinates).
///
/// The derivatives are differences of the fourth order with three steps, the last of which is half
/// of the first. The result of the finest step is used. Its distance from the other two is 15 times
/// its error where the map is smooth, and more than its error elsewhere; with three steps, rounding
/// errors seldom agree by chance. Densities may be off by `tolerance`, relative to themselves, and
/// by that distance.
pub(super) fn densities<const N: usize>(
    tolerance: f64,
    mut coordinates: impl FnMut([f64; N]) -> Option<[f64; N]>,
    mut density: impl FnMut([f64; N]) -> f64,
) -> Result<f64, Off> {
    let mut sure = 0.0;
    for k in 0..PLACES {
        let u = place(k);
        // The determinant with each of the three steps.
        let by = STEPS.map(|step| spread(&mut coordinates, u, step));
        let [Some(coarse), Some(middle), Some(fine)] = by else {
            continue;
        };
        let product = density(u) * fine;
        // Skip positions where the three disagree.
        let apart = |other: f64| (other / fine - 1.0).abs();
        let error = apart(coarse).max(apart(middle));
        if !(error < SURE) {
            continue;
        }
        sure += 1.0 / f64::from(PLACES);
        // The density times the determinant has to be one.
        if !((product - 1.0).abs() <= tolerance + error) {
            return Err(Off {
                at: u.to_vec(),
                product,
            });
        }
    }
    Ok(sure)
}

/// Returns the k-th of the uniformly spread positions inside (0, 1) at which densities are
/// compared, by the powers of the inverse of the root of x³ = x + 1 (the plastic number).
fn place<const N: usize>(k: u32) -> [f64; N] {
    const ROOTS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    std::array::from_fn(|i| ((f64::from(k) + 0.5) * ROOTS[i]).fract())
}

/// Returns the absolute determinant of the derivatives, or `None` if a sample or a positive
/// determinant is missing.
fn spread<const N: usize>(
    coordinates: &mut impl FnMut([f64; N]) -> Option<[f64; N]>,
    u: [f64; N],
    step: f64,
) -> Option<f64> {
    let mut columns = [[0.0; N]; N];
    for (axis, column) in columns.iter_mut().enumerate() {
        let h = step * u[axis].min(1.0 - u[axis]);
        let mut at = |steps: f64| {
            let mut moved = u;
            moved[axis] += steps * h;
            coordinates(moved)
        };
        let [a, b, c, d] = [at(-2.0)?, at(-1.0)?, at(1.0)?, at(2.0)?];
        *column = std::array::from_fn(|i| (8.0 * (c[i] - b[i]) - (d[i] - a[i])) / (12.0 * h));
    }
    let value = match columns.as_flattened() {
        [x] => x.abs(),
        [a, b, c, d] => (a * d - b * c).abs(),
        _ => return None,
    };
    (value > 0.0 && value.is_finite()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_of_smooth_maps_are_held_to_six_digits() {
        let ramp = |[u]: [f64; 1]| Some([u.sqrt()]);
        assert!(densities(3e-7, ramp, |[u]| 2.0 * u.sqrt()).unwrap() > 0.99);
        let off = densities(3e-7, ramp, |[u]| 2.0 * u.sqrt() * (1.0 + 1e-6)).unwrap_err();
        assert!((off.product - 1.0 - 1e-6).abs() < 1e-8, "{off:?}");
        // A map whose coordinates depend on both numbers: (u + v², v u).
        let both = |[u, v]: [f64; 2]| Some([u + v * v, v * u]);
        let inverse = |[u, v]: [f64; 2]| 1.0 / (u - 2.0 * v * v).abs();
        assert!(densities(3e-7, both, inverse).unwrap() > 0.8);
        assert!(densities(3e-7, both, |u| inverse(u) * (1.0 - 1e-6)).is_err());
    }

    #[test]
    fn corners_are_left_out_and_counted() {
        let bent = |[u]: [f64; 1]| Some([if u < 0.5 { u } else { 2.0 * u - 0.5 }]);
        let share = densities(3e-7, bent, |[u]| if u < 0.5 { 1.0 } else { 0.5 }).unwrap();
        assert!((0.9..1.0).contains(&share), "{share}");
        // Differences of random samples are accurate nowhere.
        let mut rng = crate::rng::SplitMix64::new(1);
        assert!(
            densities(
                1e-7,
                |[u]: [f64; 1]| Some([u + 1e-3 * rng.next_f64()]),
                |_| 1.0
            )
            .unwrap()
                < 0.01
        );
    }
}
