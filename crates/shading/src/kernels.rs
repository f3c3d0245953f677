//! The line integrals over columns of segments, eight at a time.

use crate::fast_path;
use linelit_geometry::DVec3;
use linelit_simd::{Isa, Simd, dispatch};

/// Segments that a kernel takes at once.
pub(crate) const LANES: usize = 8;

/// The most segments taken in one call.
pub(crate) const BLOCK: usize = 1024;

/// Segments in columns: x, y, z of the first ends, then of the second.
pub(crate) type Columns<'a> = [&'a [f64]; 6];

/// The models of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// See [`ribbon`](crate::ribbon).
    Ribbon,
    /// See [`cylinder`](crate::cylinder).
    Cylinder,
}

/// A loop over rounds of eight for one model.
macro_rules! kernel {
    ($kernel:ident, $name:ident, $model:path) => {
        #[inline(always)]
        fn $kernel<S: Simd>(
            s: S,
            columns: &Columns<'_>,
            n: DVec3,
            out: &mut [f64],
            held: &mut [u8; BLOCK / LANES],
        ) {
            let n = [s.dsplat(n.x), s.dsplat(n.y), s.dsplat(n.z)];
            let out = out.as_chunks_mut::<LANES>().0;
            let rounds = out.len();
            let mut rows = [&[] as &[[f64; LANES]]; 6];
            for (row, column) in rows.iter_mut().zip(columns) {
                *row = &column.as_chunks::<LANES>().0[..rounds];
            }
            let [x0, y0, z0, x1, y1, z1] = rows;
            let held = &mut held[..rounds];
            for i in 0..rounds {
                let p0 = [s.dload(&x0[i]), s.dload(&y0[i]), s.dload(&z0[i])];
                let p1 = [s.dload(&x1[i]), s.dload(&y1[i]), s.dload(&z1[i])];
                let (value, conditions) = $model(s, p0, p1, n);
                s.dstore(value, &mut out[i]);
                held[i] = s.bits(conditions);
            }
        }
        dispatch! {
            fn $name = $kernel(
                columns: &Columns<'_>,
                n: DVec3,
                out: &mut [f64],
                held: &mut [u8; BLOCK / LANES],
            )
        }
    };
}

kernel!(ribbon_kernel, ribbons, fast_path::ribbon);
kernel!(cylinder_kernel, cylinders, fast_path::cylinder);

/// The integrals of at most [`BLOCK`] segments, a multiple of [`LANES`], and a bit for each whose
/// value holds (see [`fast_path`]). All columns are as long as `out`.
#[inline]
pub(crate) fn lines(
    model: Model,
    columns: &Columns<'_>,
    n: DVec3,
    out: &mut [f64],
    isa: Isa,
    held: &mut [u8; BLOCK / LANES],
) {
    match model {
        Model::Ribbon => ribbons(isa, columns, n, out, held),
        Model::Cylinder => cylinders(isa, columns, n, out, held),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    /// Every instruction set that this machine has.
    fn all() -> Vec<Isa> {
        let mut all: Vec<_> = InstructionSet::ALL.into_iter().map(Isa::detect).collect();
        all.dedup();
        all
    }

    #[test]
    fn lines_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(6);
        for _ in 0..300 {
            let columns: [[f64; BLOCK]; 6] =
                std::array::from_fn(|_| std::array::from_fn(|_| rng.in_range(-1.0, 1.5)));
            let block: Columns<'_> = std::array::from_fn(|j| &columns[j][..]);
            let n = DVec3::from_array(rng.unit_vector());
            for model in [Model::Ribbon, Model::Cylinder] {
                let results: Vec<([u64; BLOCK], [u8; BLOCK / 8])> = all()
                    .into_iter()
                    .map(|isa| {
                        let (mut out, mut bits) = ([0.0; BLOCK], [0; BLOCK / 8]);
                        lines(model, &block, n, &mut out, isa, &mut bits);
                        for (i, value) in out.iter_mut().enumerate() {
                            if bits[i / 8] >> (i % 8) & 1 == 0 {
                                *value = 0.0;
                            }
                        }
                        (out.map(f64::to_bits), bits)
                    })
                    .collect();
                assert!(results[0].1 != [0; BLOCK / 8] && results[0].1 != [u8::MAX; BLOCK / 8]);
                assert!(
                    results.iter().all(|r| *r == results[0]),
                    "{model:?} {columns:?} {n}"
                );
            }
        }
    }
}
