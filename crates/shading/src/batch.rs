//! Many segments seen from one shading point, by the widest vector instructions of the machine.
//!
//! Each function gives the same bits as calling its scalar twin on each segment: lanes that are not
//! ordinary (cut by the horizon, grazing, nearly through the shading point, tiny or huge) are
//! evaluated by the twin itself.

use crate::ribbon;
use crate::simd::{self, Block, LANES, Level};
use linelit_geometry::{DVec3, Segment};

/// Segments in columns, all of one length (the shortest counts): what vector registers load at once.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    /// x, y and z of the first ends, relative to the shading point.
    pub p0: [&'a [f64]; 3],
    /// x, y and z of the second ends.
    pub p1: [&'a [f64]; 3],
}

impl Columns<'_> {
    fn len(&self) -> usize {
        self.p0
            .iter()
            .chain(&self.p1)
            .map(|c| c.len())
            .min()
            .unwrap_or(0)
    }

    fn segment(&self, i: usize) -> (DVec3, DVec3) {
        let end = |c: &[&[f64]; 3]| DVec3::new(c[0][i], c[1][i], c[2][i]);
        (end(&self.p0), end(&self.p1))
    }
}

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
    const BLOCK: usize = 8 * LANES;
    let mut store = [[0.0; BLOCK]; 6];
    for (segments, out) in segments.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
        let count = segments.len().min(out.len());
        for (i, s) in segments.iter().take(count).enumerate() {
            let row = [s.p0.x, s.p0.y, s.p0.z, s.p1.x, s.p1.y, s.p1.z];
            for (column, x) in store.iter_mut().zip(row) {
                column[i] = x;
            }
        }
        let [a, b, c, d, e, f] = &store;
        let columns = Columns {
            p0: [&a[..count], &b[..count], &c[..count]],
            p1: [&d[..count], &e[..count], &f[..count]],
        };
        ribbons_columns(&columns, n, &mut out[..count]);
    }
}

/// [`ribbons`] for segments that are kept in columns: no transposition.
pub fn ribbons_columns(columns: &Columns<'_>, n: DVec3, out: &mut [f64]) {
    let count = columns.len().min(out.len());
    let level = Level::best();
    let whole = count - count % LANES;
    for (index, values) in out[..whole]
        .as_chunks_mut::<LANES>()
        .0
        .iter_mut()
        .enumerate()
    {
        let at = index * LANES;
        let block: Block<'_> = std::array::from_fn(|j| {
            let column = if j < 3 {
                columns.p0[j]
            } else {
                columns.p1[j - 3]
            };
            &column[..whole].as_chunks::<LANES>().0[index]
        });
        let trusted = simd::ribbons(&block, n, values, level);
        if trusted != u8::MAX {
            for (i, value) in values
                .iter_mut()
                .enumerate()
                .filter(|(i, _)| trusted >> i & 1 == 0)
            {
                let (p0, p1) = columns.segment(at + i);
                *value = ribbon::general(p0, p1, n);
            }
        }
    }
    for (i, value) in out[..count].iter_mut().enumerate().skip(whole) {
        let (p0, p1) = columns.segment(i);
        *value = ribbon::irradiance(p0, p1, n);
    }
}

/// [`ribbons`] one by one: its scalar twin.
pub fn ribbons_scalar(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    for (segment, value) in segments.iter().zip(out) {
        *value = ribbon::irradiance(segment.p0, segment.p1, n);
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
            let segments: Vec<Segment> = (0..count)
                .map(|_| Segment::new(point(&mut rng), point(&mut rng)))
                .collect();
            let n = DVec3::from_array(rng.unit_vector());
            let (mut fast, mut slow) = (vec![-1.0; count], vec![-2.0; count]);
            ribbons(&segments, n, &mut fast);
            ribbons_scalar(&segments, n, &mut slow);
            let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&fast), bits(&slow), "{count} segments");
        }
    }
}
