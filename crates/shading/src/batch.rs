//! This module integrates many segments for one shading point, by the widest vector instructions of
//! the machine.
//!
//! The results are to the bit the integrals of single segments. Lanes for which the fast path is
//! not accurate (cut by the horizon, grazing, nearly through the shading point, tiny or huge) are
//! evaluated by the robust form.

use crate::{fast_path, ribbon};
use linelit_geometry::{DVec3, Segment};
use linelit_simd::{Isa, Simd, dispatch};

/// The number of segments in one round of the kernel.
pub(crate) const LANES: usize = 8;

/// The number of rounds whose segments are transposed at once: six columns of them fit the nearest
/// cache.
const ROUNDS: usize = 32;

/// The number of rounds for few segments, whose columns take less time to clear.
const FEW: usize = 2;

/// One coordinate of the segments in some rounds.
type Column = [[f64; LANES]];

/// Computes [`ribbon::line_integral`] of each segment (relative to the shading point) into `out`,
/// until one of the two slices ends.
///
/// ```
/// use linelit_shading::geometry::{DVec3, Segment};
/// use linelit_shading::{batch, ribbon};
/// let segments: Vec<Segment> = (0..20)
///     .map(|i| Segment::new(DVec3::new(-1.0, f64::from(i), 2.0), DVec3::new(1.0, 0.5, 2.0)))
///     .collect();
/// let mut out = vec![0.0; segments.len()];
/// batch::ribbons(&segments, DVec3::Z, &mut out);
/// assert_eq!(out[7], ribbon::line_integral(segments[7].p0, segments[7].p1, DVec3::Z));
/// ```
pub fn ribbons(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    by(Isa::best(), segments, n, out);
}

/// Computes [`ribbons`] by a given instruction set.
fn by(isa: Isa, segments: &[Segment], n: DVec3, out: &mut [f64]) {
    if segments.len() <= FEW * LANES {
        transposed::<FEW>(isa, segments, n, out);
    } else {
        transposed::<ROUNDS>(isa, segments, n, out);
    }
}

/// Computes the integrals of segments, `ROUNDS` rounds at a time.
fn transposed<const ROUNDS: usize>(isa: Isa, segments: &[Segment], n: DVec3, out: &mut [f64]) {
    // The columns are x, y, z of the first ends, and then of the second ends.
    let mut columns = [[[0.0; LANES]; ROUNDS]; 6];
    let (mut values, mut held) = ([[0.0; LANES]; ROUNDS], [0; ROUNDS]);
    let rows = ROUNDS * LANES;
    for (segments, out) in segments.chunks(rows).zip(out.chunks_mut(rows)) {
        let count = segments.len().min(out.len());
        // Transpose the segments.
        for (i, s) in segments.iter().take(count).enumerate() {
            let row = [s.p0.x, s.p0.y, s.p0.z, s.p1.x, s.p1.y, s.p1.z];
            for (column, x) in columns.iter_mut().zip(row) {
                column.as_flattened_mut()[i] = x;
            }
        }
        let rounds = count.div_ceil(LANES);
        let columns = columns.each_ref().map(|column| &column[..rounds]);
        let held = &mut held[..rounds];
        // Integrate; a last round that is not full is filled with old segments, whose results are
        // dropped.
        match out[..count].as_chunks_mut() {
            (full, []) => kernel(isa, &columns, n, full, held),
            _ => {
                // Write a last round that is not full to memory of its own.
                kernel(isa, &columns, n, &mut values[..rounds], held);
                out[..count].copy_from_slice(&values.as_flattened()[..count]);
            }
        }
        // Repeat segments for which the fast path is not accurate by the robust form.
        let pieces = segments.chunks(LANES).zip(out.chunks_mut(LANES));
        for (bits, (segments, out)) in held.iter().zip(pieces) {
            if *bits != u8::MAX {
                robust_lanes(segments, n, *bits, out);
            }
        }
    }
}

/// Integrates the segments of a round whose bits in `held` are zero.
#[inline(never)]
fn robust_lanes(segments: &[Segment], n: DVec3, held: u8, out: &mut [f64]) {
    for (i, (s, out)) in segments.iter().zip(out).enumerate() {
        if held >> i & 1 == 0 {
            *out = ribbon::robust(s.p0.to_array(), s.p1.to_array(), n.to_array());
        }
    }
}

/// Computes the integrals of rounds of segments, and a bit for each segment on whose accuracy one
/// can rely (see [`fast_path`]).
#[inline(always)]
fn rounds<S: Simd>(s: S, columns: &[&Column; 6], n: DVec3, out: &mut Column, held: &mut [u8]) {
    let n = [s.dsplat(n.x), s.dsplat(n.y), s.dsplat(n.z)];
    let rounds = out.len();
    let [x0, y0, z0, x1, y1, z1] = columns.map(|column| &column[..rounds]);
    let held = &mut held[..rounds];
    for i in 0..rounds {
        let p0 = [s.dload(&x0[i]), s.dload(&y0[i]), s.dload(&z0[i])];
        let p1 = [s.dload(&x1[i]), s.dload(&y1[i]), s.dload(&z1[i])];
        let (value, conditions) = fast_path::ribbon(s, p0, p1, n);
        s.dstore(value, &mut out[i]);
        held[i] = s.bits(conditions);
    }
}
dispatch! {
    fn kernel = rounds(columns: &[&Column; 6], n: DVec3, out: &mut Column, held: &mut [u8])
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    fn segments(count: usize, rng: &mut SplitMix64) -> Vec<Segment> {
        let mut point = || {
            let scale = 10f64.powf(rng.in_range(-3.0, 3.0));
            DVec3::from_array(rng.unit_vector()) * scale + DVec3::Z * rng.in_range(0.0, 2.0)
        };
        (0..count).map(|_| Segment::new(point(), point())).collect()
    }

    /// Compares on every instruction set that this machine has.
    fn compare(segments: &[Segment], n: DVec3) {
        let one = |s: &Segment| ribbon::line_integral(s.p0, s.p1, n).to_bits();
        let want: Vec<u64> = segments.iter().map(one).collect();
        for set in InstructionSet::ALL {
            let mut out = vec![-1.0; segments.len()];
            by(Isa::detect(set), segments, n, &mut out);
            let got: Vec<u64> = out.iter().map(|x| x.to_bits()).collect();
            assert_eq!(got, want, "{} segments by {set}", segments.len());
        }
    }

    #[test]
    fn same_bits_as_one_by_one() {
        let mut rng = SplitMix64::new(3);
        for count in [0, 1, 7, 8, 9, 64, 255, 257, 1001, 1024, 1025, 5000] {
            let segments = segments(count, &mut rng);
            compare(&segments, DVec3::from_array(rng.unit_vector()));
        }
    }

    #[test]
    fn what_is_no_number_stays_in_its_lane() {
        let mut rng = SplitMix64::new(4);
        let bad = [f64::NAN, f64::INFINITY, -f64::INFINITY, 0.0, 1e200, 1e-200];
        for x in bad {
            let mut segments = segments(33, &mut rng);
            segments[3].p0.y = x;
            segments[17].p1.z = x;
            segments[18].p1 = segments[18].p0;
            segments[32].p0.x = x;
            compare(&segments, DVec3::Z);
            compare(&segments, DVec3::new(0.0, x, 1.0));
        }
    }
}
