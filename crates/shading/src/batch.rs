//! Many segments seen from one shading point, by the widest vector instructions of the machine.
//!
//! Each function gives the same bits as calling its scalar twin on each segment: lanes that are not
//! ordinary (cut by the horizon, grazing, nearly through the shading point, tiny or huge) are
//! evaluated by the twin itself.

use crate::{dispatch, ribbon};
use linelit_geometry::{DVec3, Segment};

/// Lanes at once: one register of AVX-512, two of AVX2, four of SSE2.
const LANES: usize = 8;

/// [`ribbon::irradiance`] of each segment (relative to the shading point), into `out`; the shorter
/// of the two slices counts.
///
/// ```
/// use linelit_geometry::{DVec3, Segment};
/// use linelit_shading::{batch, ribbon};
/// let segments: Vec<Segment> = (0..20)
///     .map(|i| Segment::new(DVec3::new(-1.0, f64::from(i), 2.0), DVec3::new(1.0, 0.5, 2.0)))
///     .collect();
/// let mut out = vec![0.0; segments.len()];
/// batch::ribbons(&segments, DVec3::Z, &mut out);
/// assert_eq!(out[7], ribbon::irradiance(segments[7].p0, segments[7].p1, DVec3::Z));
/// ```
pub fn ribbons(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    dispatch::with(|| all(segments, n, out));
}

/// [`ribbons`] without vector instructions beyond the compiler's baseline: its scalar twin.
pub fn ribbons_scalar(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    for (segment, value) in segments.iter().zip(out) {
        *value = ribbon::irradiance(segment.p0, segment.p1, n);
    }
}

#[inline(always)]
fn all(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    let count = segments.len().min(out.len());
    let (segments, out) = (&segments[..count], &mut out[..count]);
    let (chunks, rest) = segments.as_chunks::<LANES>();
    let (values, last) = out.as_chunks_mut::<LANES>();
    for (chunk, value) in chunks.iter().zip(values) {
        lanes(chunk, n, value);
    }
    for (segment, value) in rest.iter().zip(last) {
        *value = ribbon::irradiance(segment.p0, segment.p1, n);
    }
}

#[inline(always)]
fn lanes(segments: &[Segment; LANES], n: DVec3, out: &mut [f64; LANES]) {
    let mut columns = [[0.0; LANES]; 6];
    for (i, segment) in segments.iter().enumerate() {
        let row = [segment.p0.to_array(), segment.p1.to_array()];
        for j in 0..3 {
            columns[j][i] = row[0][j];
            columns[3 + j][i] = row[1][j];
        }
    }
    let mut ordinary = [true; LANES];
    let c = &columns;
    for i in 0..LANES {
        let p0 = DVec3::new(c[0][i], c[1][i], c[2][i]);
        let p1 = DVec3::new(c[3][i], c[4][i], c[5][i]);
        (out[i], ordinary[i]) = ribbon::ordinary(p0, p1, n);
    }
    if ordinary.iter().all(|&o| o) {
        return;
    }
    for i in 0..LANES {
        if !ordinary[i] {
            out[i] = ribbon::general(segments[i].p0, segments[i].p1, n);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::rng::SplitMix64;

    #[test]
    fn same_bits_as_the_scalar_twin() {
        let mut rng = SplitMix64::new(3);
        for count in [0, 1, 7, 8, 9, 64, 1001] {
            let point = |rng: &mut SplitMix64| {
                let scale = 10f64.powf(rng.in_range(-3.0, 3.0));
                DVec3::from_array(rng.unit_vector()) * scale + DVec3::Z * rng.in_range(0.0, 2.0)
            };
            let segments: Vec<Segment> =
                (0..count).map(|_| Segment::new(point(&mut rng), point(&mut rng))).collect();
            let n = DVec3::from_array(rng.unit_vector());
            let (mut fast, mut slow) = (vec![-1.0; count], vec![-2.0; count]);
            ribbons(&segments, n, &mut fast);
            ribbons_scalar(&segments, n, &mut slow);
            let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&fast), bits(&slow), "{count} segments");
        }
    }
}
