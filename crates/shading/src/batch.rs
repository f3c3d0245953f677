//! Many segments seen from one shading point, by the widest vector instructions of the machine.
//!
//! Each function gives the same bits as its integral of one segment: lanes for which the fast path
//! does not hold (cut by the horizon, grazing, nearly through the shading point, tiny or huge) are
//! evaluated by the robust form.

use crate::kernels::{self, BLOCK, LANES, Model};
use crate::{cylinder, ribbon};
use linelit_geometry::{DVec3, Segment};
use linelit_simd::Isa;

/// Segments in columns, all of one length (the shortest counts): what vector registers load at
/// once.
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
}

/// [`ribbon::irradiance`] of each segment (relative to the shading point), into `out`; the shorter
/// of the two slices counts.
///
/// ```
/// use linelit_shading::geometry::{DVec3, Segment};
/// use linelit_shading::{batch, ribbon};
/// let segments: Vec<Segment> = (0..20)
///     .map(|i| Segment::new(DVec3::new(-1.0, f64::from(i), 2.0), DVec3::new(1.0, 0.5, 2.0)))
///     .collect();
/// let mut out = vec![0.0; segments.len()];
/// batch::ribbons(&segments, DVec3::Z, &mut out);
/// assert_eq!(out[7], ribbon::irradiance(segments[7].p0, segments[7].p1, DVec3::Z));
/// ```
pub fn ribbons(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    rows(Model::Ribbon, segments, n, out);
}

/// [`cylinder::irradiance`] of each segment; see [`ribbons`].
pub fn cylinders(segments: &[Segment], n: DVec3, out: &mut [f64]) {
    rows(Model::Cylinder, segments, n, out);
}

/// [`ribbons`] for segments that are kept in columns: no transposition.
pub fn ribbons_columns(columns: &Columns<'_>, n: DVec3, out: &mut [f64]) {
    in_columns(Model::Ribbon, columns, n, out);
}

/// [`cylinders`] for segments that are kept in columns.
pub fn cylinders_columns(columns: &Columns<'_>, n: DVec3, out: &mut [f64]) {
    in_columns(Model::Cylinder, columns, n, out);
}

fn in_columns(model: Model, columns: &Columns<'_>, n: DVec3, out: &mut [f64]) {
    let count = columns.len().min(out.len());
    let isa = Isa::best();
    let mut at = 0;
    while count - at >= LANES {
        let size = (count - at).min(BLOCK) / LANES * LANES;
        let [a, b, c] = columns.p0.map(|c| &c[at..at + size]);
        let [d, e, f] = columns.p1.map(|c| &c[at..at + size]);
        let block = [a, b, c, d, e, f];
        evaluate(model, &block, n, &mut out[at..at + size], isa);
        at += size;
    }
    // What is left does not fill the lanes.
    let mut store = [[0.0; LANES]; 6];
    let rest = count - at;
    if rest > 0 {
        for (column, from) in store.iter_mut().zip(columns.p0.iter().chain(&columns.p1)) {
            column[..rest].copy_from_slice(&from[at..count]);
        }
        padded(model, &store, n, &mut out[at..count], isa);
    }
}

/// Segments transposed at once: six columns of them stay in the nearest cache.
const ROWS: usize = 256;

fn rows(model: Model, segments: &[Segment], n: DVec3, out: &mut [f64]) {
    let isa = Isa::best();
    let mut store = [[0.0; ROWS]; 6];
    for (segments, out) in segments.chunks(ROWS).zip(out.chunks_mut(ROWS)) {
        let count = segments.len().min(out.len());
        for (i, s) in segments.iter().take(count).enumerate() {
            let row = [s.p0.x, s.p0.y, s.p0.z, s.p1.x, s.p1.y, s.p1.z];
            for (column, x) in store.iter_mut().zip(row) {
                column[i] = x;
            }
        }
        padded(model, &store, n, &mut out[..count], isa);
    }
}

/// The first of a block of segments; the others are any.
fn padded<const N: usize>(
    model: Model,
    store: &[[f64; N]; 6],
    n: DVec3,
    out: &mut [f64],
    isa: Isa,
) {
    let size = out.len().next_multiple_of(LANES);
    let block = store.each_ref().map(|c| &c[..size]);
    if out.len() == size {
        evaluate(model, &block, n, out, isa);
        return;
    }
    let mut values = [0.0; N];
    evaluate(model, &block, n, &mut values[..size], isa);
    out.copy_from_slice(&values[..out.len()]);
}

fn evaluate(model: Model, block: &kernels::Columns<'_>, n: DVec3, out: &mut [f64], isa: Isa) {
    let mut held = [0; BLOCK / 8];
    kernels::lines(model, block, n, out, isa, &mut held);
    for (round, bits) in held.iter().enumerate().take(out.len() / 8) {
        if *bits != u8::MAX {
            robust_lanes(model, block, n, 8 * round, *bits, out);
        }
    }
}

/// The segments of eight that were not held.
#[inline(never)]
fn robust_lanes(
    model: Model,
    block: &kernels::Columns<'_>,
    n: DVec3,
    at: usize,
    held: u8,
    out: &mut [f64],
) {
    for i in (0..8).filter(|i| held >> i & 1 == 0).map(|i| at + i) {
        let c = |j: usize| block[j][i];
        let (p0, p1, n) = ([c(0), c(1), c(2)], [c(3), c(4), c(5)], n.to_array());
        out[i] = match model {
            Model::Ribbon => ribbon::robust(p0, p1, n),
            Model::Cylinder => cylinder::robust(p0, p1, n),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::rng::SplitMix64;

    type One = fn(DVec3, DVec3, DVec3) -> f64;
    type Many = fn(&[Segment], DVec3, &mut [f64]);
    type InColumns = fn(&Columns<'_>, DVec3, &mut [f64]);

    const MODELS: [(One, Many, InColumns); 2] = [
        (ribbon::irradiance, ribbons, ribbons_columns),
        (cylinder::irradiance, cylinders, cylinders_columns),
    ];

    fn segments(count: usize, rng: &mut SplitMix64) -> Vec<Segment> {
        let mut point = || {
            let scale = 10f64.powf(rng.in_range(-3.0, 3.0));
            DVec3::from_array(rng.unit_vector()) * scale + DVec3::Z * rng.in_range(0.0, 2.0)
        };
        (0..count).map(|_| Segment::new(point(), point())).collect()
    }

    fn column(segments: &[Segment], f: impl Fn(&Segment) -> f64) -> Vec<f64> {
        segments.iter().map(f).collect()
    }

    fn compare(segments: &[Segment], n: DVec3) {
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let ends: [Vec<f64>; 6] = [
            column(segments, |s| s.p0.x),
            column(segments, |s| s.p0.y),
            column(segments, |s| s.p0.z),
            column(segments, |s| s.p1.x),
            column(segments, |s| s.p1.y),
            column(segments, |s| s.p1.z),
        ];
        let [a, b, c, d, e, f] = &ends;
        let columns = Columns {
            p0: [a, b, c],
            p1: [d, e, f],
        };
        for (one, rows, in_columns) in MODELS {
            let count = segments.len();
            let want = bits(&column(segments, |s| one(s.p0, s.p1, n)));
            let mut out = [-1.0, -2.0].map(|x| vec![x; count]);
            rows(segments, n, &mut out[0]);
            in_columns(&columns, n, &mut out[1]);
            assert_eq!(bits(&out[0]), want, "{count} segments");
            assert_eq!(bits(&out[1]), want, "{count} segments in columns");
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
