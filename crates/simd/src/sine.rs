//! The sine by polynomials: without calls or branches, and with bit-identical results on every
//! machine.

use crate::Lanes;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// π minus the nearest `f64` to π; half of it is the same difference for π/2.
const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;

/// The Taylor coefficients of (sin v − v)/v³ and of (cos v − 1 + v²/2)/v⁴ as polynomials in v²; the
/// truncation error is below 2e-19 for v ≤ π/4.
const SERIES: [[f64; 2]; 8] = {
    let mut out = [[0.0; 2]; 8];
    let (mut k, mut n, mut term) = (0, 3.0, -1.0 / 6.0);
    while k < 8 {
        let next = -term / (n + 1.0);
        out[k] = [term, next];
        term = next / (n + 2.0);
        n += 2.0;
        k += 1;
    }
    out
};

/// Returns the sine for 0 ≤ x ≤ π, with a small relative error even near both ends, where the sine
/// is close to zero.
///
/// **Error**: 1.5 ulp: half an ulp of the last sum, plus the rounding of its second term, which is
/// at most 0.44 of the result; x − π/2 and π − x are exact to half an ulp. The largest error found
/// is 1.28 ulp.
///
/// ```
/// use linelit_simd::{One, sine};
/// assert!((sine(One, 0.5) - 0.5f64.sin()).abs() < 1e-16);
/// assert!((sine(One, std::f64::consts::PI) / 1.2246467991473532e-16 - 1.0).abs() < 1e-15);
/// ```
#[inline(always)]
pub fn sine<L: Lanes>(l: L, x: L::D) -> L::D {
    // Find the distance from the nearer end, and from π/2; each difference is exact where it is
    // used.
    let near = l.dmin(x, (l.dsplat(PI) - x) + PI_LOW);
    let middle = l.dlt(l.dsplat(FRAC_PI_4), near);
    let from_top = (l.dsplat(FRAC_PI_2) - x) + 0.5 * PI_LOW;
    let v = l.select(middle, near, from_top);
    let s = v * v;
    // Use the sine's series near the ends, and the cosine's in the middle.
    let [sine, cosine] = l.polynomials(&SERIES, s);
    let top = l.dsplat(1.0) - (s * 0.5 - s * s * cosine);
    l.select(middle, v + v * (s * sine), top)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::One;
    use linelit_testkit::dd::Dd;

    #[test]
    fn is_within_its_bound() {
        let dense = (1..=200_000).map(|i| PI * f64::from(i) / 200_000.0);
        let near_ends = (0..3000)
            .map(|i| 0.99_f64.powi(i))
            .flat_map(|x| [x, PI - x]);
        let mut worst = 0.0_f64;
        for x in dense.chain(near_ends) {
            // To 106 bits.
            let want = Dd::from(x).sin();
            let ulp = want.hi().next_up() - want.hi();
            let error = (Dd::from(sine(One, x)) - want).hi() / ulp;
            worst = worst.max(error.abs());
        }
        assert!(worst <= 1.5, "{worst} ulp");
        assert_eq!(sine(One, 0.0).to_bits(), 0);
    }
}
