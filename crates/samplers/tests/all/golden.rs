//! These tests freeze the streams: a change of any number here is a breaking change, to be named in
//! the changelog under "Sampler streams". The values are the ones that this crate gave when the
//! streams were frozen; there is no other source for them.

use linelit_samplers::hash::mix;
use linelit_samplers::{Block, Sampler, SamplerKind};
use rand::Rng;

/// Kind, the first 1-D number and the first point of a set, and a digest of many sets.
const GOLDEN: [(SamplerKind, f64, [f64; 2], u64); 11] = [
    (
        SamplerKind::Independent,
        0.747_876_723_290_567_3,
        [0.631_102_231_697_165_2, 0.345_003_371_086_900_16],
        0x35DF_9464_9684_9AA8,
    ),
    (
        SamplerKind::Stratified,
        0.341_754_451_041_311_4,
        [0.367_017_804_165_245_65, 0.344_245_585_538_658_8],
        0xB601_0F11_F99F_EF6E,
    ),
    (
        SamplerKind::MultiJitter,
        0.729_554_681_422_456_6,
        [0.854_554_681_422_456_6, 0.511_527_849_874_842_1],
        0x2175_9643_642E_082C,
    ),
    (
        SamplerKind::Sobol,
        0.595_441_284_534_319_7,
        [0.595_441_284_534_319_7, 0.817_092_948_240_812_4],
        0x40C4_C1B9_86B7_AA07,
    ),
    (
        SamplerKind::Halton,
        0.265_781_408_740_186_96,
        [0.265_781_408_740_186_96, 0.344_633_874_980_026_57],
        0x2B31_12CF_8060_6216,
    ),
    (
        SamplerKind::UniformJitter,
        0.665_526_369_648_084_2,
        [0.665_526_369_648_084_2, 0.567_587_398_580_477_4],
        0x54D3_DA8E_2109_1DF9,
    ),
    (
        SamplerKind::BlueNoise,
        0.196_247_832_532_159_13,
        [0.196_247_832_532_159_13, 0.665_419_157_498_689_7],
        0xB829_35C2_9735_1C24,
    ),
    (
        SamplerKind::BlueNoiseIndependent,
        0.292_065_340_669_491_75,
        [0.292_065_340_669_491_75, 0.260_466_072_245_509_5],
        0x5FA9_F57A_D92B_26D5,
    ),
    (
        SamplerKind::ZSobol,
        0.798_670_438_082_556_3,
        [0.798_670_438_082_556_3, 0.400_147_687_171_334_1],
        0xABD2_21BA_6AE9_C692,
    ),
    (
        SamplerKind::Auto,
        0.531_320_385_705_926_3,
        [0.531_320_385_705_926_3, 0.968_525_316_802_436_3],
        0x6730_7354_A634_DDE2,
    ),
    (
        SamplerKind::SobolBurley,
        0.616_335_153_579_711_9,
        [0.616_335_153_579_711_9, 0.576_826_691_627_502_4],
        0x582A_8C70_63D3_6632,
    ),
];

/// A digest of the bits of sets of many sizes, pixels and dimensions.
fn digest(kind: SamplerKind) -> u64 {
    let mut state = 0;
    for (seed, count) in [
        (0, 1),
        (1, 4),
        (2, 7),
        (u64::MAX, 64),
        (3, 65),
        (4, 100),
        (5, 1024),
    ] {
        for (pixel, dimension) in [([0, 0], 0), ([640, 359], 3), ([70_000, 1 << 31], u32::MAX)] {
            let set = Sampler::new(kind, seed).points(pixel, dimension, count);
            for i in 0..count + 2 {
                let [x, y] = set.get_2d(i);
                for v in [set.get_1d(i), x, y] {
                    state = mix(state ^ v.to_bits());
                }
            }
        }
    }
    state
}

#[test]
fn streams_are_frozen() {
    for (kind, line, point, many) in GOLDEN {
        let set = Sampler::new(kind, 42).points([3, 7], 2, 16);
        let got = (set.get_1d(0), set.get_2d(0), digest(kind));
        assert!(
            got == (line, point, many),
            "(SamplerKind::{kind:?}, {:?}, {:?}, 0x{:016X}),",
            got.0,
            got.1,
            got.2
        );
    }
}

/// A digest of the bits of blocks of several sizes.
fn digest_of_blocks(kind: SamplerKind) -> u64 {
    let mut state = 0;
    for (count, blocks) in [(1, 64), (4, 16), (6, 10), (7, 13), (100, 3)] {
        for index in 0..blocks.min(5) {
            let block = Block::new(7 * index, blocks);
            let set = Sampler::new(kind, 42).block([3, 70_000], 2, count, block);
            for i in 0..count + 2 {
                let [x, y] = set.get_2d(i);
                for v in [set.get_1d(i), x, y] {
                    state = mix(state ^ v.to_bits());
                }
            }
        }
    }
    state
}

/// These digests, in the order of the kinds.
const BLOCKS: [u64; 11] = [
    0x98BB_83D0_7E0E_D9B7,
    0xECBA_0C25_C564_CE0D,
    0x6EFB_9880_7352_2997,
    0x8F44_2277_3C11_BD76,
    0x770C_DD21_BD8C_9E30,
    0x11EF_9531_1ECE_2462,
    0x1D34_0DF6_B896_E7B4,
    0x845A_68B6_6530_34CC,
    0x3167_8F84_32D9_8314,
    0xCD4B_08AB_67D7_D4F6,
    0xFD5C_2872_97C6_DFB3,
];

#[test]
fn streams_of_blocks_are_frozen() {
    let got = SamplerKind::ALL.map(digest_of_blocks);
    assert_eq!(got, BLOCKS, "{got:#018X?}");
}

#[test]
fn generators_are_frozen() {
    let mut rng = Sampler::new(SamplerKind::Sobol, 42).rng([3, 7], 2);
    let want = [11_886_577_688_120_377_200_u64, 17_593_523_789_373_299_087];
    assert_eq!([rng.next_u64(), rng.next_u64()], want);
}
