//! The vector kernels: the line integrals over columns of segments, and the nodes of a lobe's
//! panel, written once ([`kernels`]) and compiled for AVX-512 and AVX2 ([`x86`]).
//!
//! Every operation is the one of the scalar twin ([`ordinary`](crate::ordinary),
//! [`lobe`](crate::lobe)) in the same order, without fused operations, so the bits are the same;
//! tests hold them to it. The only unsafe code is loading and storing whole registers and calling a
//! function compiled for a CPU feature after detecting it.

#[cfg(target_arch = "x86_64")]
mod kernels;
mod pair;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::gauss::NODES;
use crate::lobe::Panel;
use crate::ordinary;
use linelit_geometry::DVec3;
use linelit_simd::Isa;

pub(crate) use pair::side_by_side;

/// The most lanes a kernel takes at once.
pub(crate) const LANES: usize = 8;

/// The most segments taken at once.
pub(crate) const BLOCK: usize = 1024;

/// Segments in columns: x, y, z of the first ends, then of the second.
pub(crate) type Columns<'a> = [&'a [f64]; 6];

/// The three models of a line, as the kernels know them.
const RIBBON: u8 = 0;
const CYLINDER: u8 = 1;
const POINT_LINE: u8 = 2;

/// The three models of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// See [`ribbon`](crate::ribbon).
    Ribbon,
    /// See [`cylinder`](crate::cylinder).
    Cylinder,
    /// See [`point_line`](crate::point_line).
    PointLine,
}

/// The integrals of at most [`BLOCK`] segments, a multiple of [`LANES`], and a bit for each that
/// may be trusted. All columns are as long as `out`.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a detected CPU feature"
)]
pub(crate) fn lines(
    model: Model,
    columns: &Columns<'_>,
    n: DVec3,
    out: &mut [f64],
    isa: Isa,
    trusted: &mut [u8; BLOCK / 8],
) {
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        Isa::Avx512(_) => unsafe {
            match model {
                Model::Ribbon => x86::avx512::ribbons(columns, n, out, trusted),
                Model::Cylinder => x86::avx512::cylinders(columns, n, out, trusted),
                Model::PointLine => x86::avx512::point_lines(columns, n, out, trusted),
            }
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        Isa::Avx2(_) => unsafe {
            match model {
                Model::Ribbon => x86::avx2::ribbons(columns, n, out, trusted),
                Model::Cylinder => x86::avx2::cylinders(columns, n, out, trusted),
                Model::PointLine => x86::avx2::point_lines(columns, n, out, trusted),
            }
        },
        Isa::Scalar => one_by_one(model, columns, n, out, trusted),
    }
}

fn one_by_one(
    model: Model,
    columns: &Columns<'_>,
    n: DVec3,
    out: &mut [f64],
    trusted: &mut [u8; BLOCK / 8],
) {
    let twin = match model {
        Model::Ribbon => ordinary::ribbon,
        Model::Cylinder => ordinary::cylinder,
        Model::PointLine => ordinary::point_line,
    };
    trusted.fill(0);
    for (i, value) in out.iter_mut().enumerate() {
        let c = |j: usize| columns[j][i];
        let ordinary;
        (*value, ordinary) = twin([c(0), c(1), c(2)], [c(3), c(4), c(5)], n.to_array());
        trusted[i / 8] |= u8::from(ordinary) << (i % 8);
    }
}

/// The terms of a lobe's panel.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a detected CPU feature"
)]
pub(crate) fn panel<const COUNT: usize>(
    panel: &Panel<COUNT>,
    k: f64,
    terms: &mut [f64; NODES],
    isa: Isa,
) {
    #[cfg(target_arch = "x86_64")]
    let (shape, factors) = ([panel.half_tan, panel.slope], panel.factors);
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        Isa::Avx512(_) => unsafe { x86::avx512::panel(shape, factors, k, terms) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        Isa::Avx2(_) => unsafe { x86::avx2::panel(shape, factors, k, terms) },
        Isa::Scalar => panel.terms(k, terms),
    }
}

/// The sum of a lobe's short panel; see [`Panel::few_sum`].
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a detected CPU feature"
)]
pub(crate) fn few<const COUNT: usize>(
    panel: &Panel<COUNT>,
    k: f64,
    offset: f64,
    narrow: bool,
    isa: Isa,
) -> f64 {
    // One by one, in registers: what is stored by halves and read in pairs stalls the processor.
    #[cfg(target_arch = "x86_64")]
    let (t, slope, [[a, b], [c, d]]) = (
        panel.half_tan,
        panel.slope,
        [panel.factors[0], panel.factors[COUNT - 1]],
    );
    match (isa, narrow) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        (Isa::Avx512(_), true) => unsafe {
            x86::avx512::few::<COUNT, true>(t, slope, a, b, c, d, k, offset)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        (Isa::Avx512(_), false) => unsafe {
            x86::avx512::few::<COUNT, false>(t, slope, a, b, c, d, k, offset)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        (Isa::Avx2(_), true) => unsafe {
            x86::avx2::few::<COUNT, true>(t, slope, a, b, c, d, k, offset)
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the token proves that the processor has these instructions.
        (Isa::Avx2(_), false) => unsafe {
            x86::avx2::few::<COUNT, false>(t, slope, a, b, c, d, k, offset)
        },
        (Isa::Scalar, _) => panel.few_sum(k, offset, narrow),
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
    fn panels_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(5);
        for _ in 0..2000 {
            let mut random = || rng.next_f64();
            let panel_data = Panel {
                half_tan: 0.3 * random(),
                slope: random(),
                factors: [[random(), random()], [random(), random()]],
            };
            let k = 10f64.powf(5.0 * random());
            let (offset, narrow) = (-50.0 * random(), random() < 0.5);
            let results: Vec<([u64; NODES], u64)> = all()
                .into_iter()
                .map(|isa| {
                    let mut terms = [0.0; NODES];
                    panel(&panel_data, k, &mut terms, isa);
                    let sum = few(&panel_data, k, offset, narrow, isa);
                    (terms.map(f64::to_bits), sum.to_bits())
                })
                .collect();
            assert!(
                results.iter().all(|r| *r == results[0]),
                "{panel_data:?} {k}"
            );
        }
    }

    #[test]
    fn lines_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(6);
        for _ in 0..300 {
            let columns: [[f64; BLOCK]; 6] =
                std::array::from_fn(|_| std::array::from_fn(|_| rng.in_range(-1.0, 1.5)));
            let block: Columns<'_> = std::array::from_fn(|j| &columns[j][..]);
            let n = DVec3::from_array(rng.unit_vector());
            for model in [Model::Ribbon, Model::Cylinder, Model::PointLine] {
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
