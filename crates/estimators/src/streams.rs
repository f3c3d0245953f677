//! This module assigns the sample dimensions of a pixel to their uses: to lights, to techniques,
//! and to choices. The table is here and nowhere else, so that no two uses share random numbers by
//! accident.

use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind};

/// The number of sample dimensions of one pair of a shading point and a light.
const PER_LIGHT: u32 = 16;
/// The number of sample dimensions before the dimensions of the first light.
const BEFORE_LIGHTS: u32 = 4;

/// The sample dimension of positions in the pixel's filter.
pub const CAMERA: u32 = 0;

/// The sample dimension of the numbers by which lights are chosen for a shading point. The
/// dimension below it is for points on lights that the choice considers. `path` is the number of
/// the shading point among those of a camera sample.
///
/// These dimensions count down from the largest one, far away from the dimensions of lights.
#[must_use]
pub const fn light_choice(path: u32) -> u32 {
    u32::MAX.wrapping_sub(path.wrapping_mul(2))
}

/// The uses of the random numbers of one pair of a shading point and a light.
///
/// If two streams share a dimension, no estimate uses both, or they differ in the pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Samples of a technique that stands alone: dimension 0 of the pair.
    Samples,
    /// Directions of lines, and the rounding of numbers of samples, which are always independent:
    /// dimension 1.
    Orientation,
    /// Glossy samples of a linear light, which are drawn in addition to its diffuse ones: dimension
    /// 1.
    Glossy,
    /// Samples of a technique in a combination, by its index: dimensions 2 to 9.
    Technique(u32),
    /// Samples that are drawn first, and that decide how other samples are drawn and weighted:
    /// dimension 10.
    Ahead,
}

/// The random numbers of one pair of a shading point and a light. They are pure functions of the
/// seed, the pixel and the dimension.
#[derive(Clone, Copy, Debug)]
pub struct RandomNumbers {
    /// The sampling pattern.
    pub sampler: SamplerKind,
    /// The seed; two seeds give independent estimates.
    pub seed: u64,
    /// The pixel.
    pub pixel: [u32; 2],
    /// The number of the pair in the pixel. It has to be the same in each pixel, for patterns that
    /// extend over several pixels, and for all camera samples of a pixel.
    pub pair: u32,
    /// The block of the pixel's patterns to which these numbers belong: each of several camera
    /// samples has one block.
    pub block: Block,
}

impl RandomNumbers {
    /// The random numbers of a pair in a pixel that has one camera sample.
    #[must_use]
    pub const fn new(sampler: SamplerKind, seed: u64, pixel: [u32; 2], pair: u32) -> Self {
        Self {
            sampler,
            seed,
            pixel,
            pair,
            block: Block::WHOLE,
        }
    }

    /// Returns the same random numbers for another block.
    #[must_use]
    pub const fn with_block(self, block: Block) -> Self {
        Self { block, ..self }
    }

    /// The sample dimension of a stream of this pair.
    fn dimension(&self, stream: Stream) -> u32 {
        let first = self
            .pair
            .wrapping_mul(PER_LIGHT)
            .wrapping_add(BEFORE_LIGHTS);
        first.wrapping_add(match stream {
            Stream::Samples => 0,
            Stream::Orientation | Stream::Glossy => 1,
            Stream::Technique(index) => 2 + index,
            Stream::Ahead => 10,
        })
    }

    /// Returns `count` points of a stream, in the sampling pattern.
    #[must_use]
    pub fn points(&self, stream: Stream, count: u32) -> SampleSet {
        let sampler = Sampler::new(self.sampler, self.seed);
        // The points that go first decide about the others, so they must not vary with them from
        // block to block.
        let block = match stream {
            Stream::Ahead => self.block.interleaved(),
            _ => self.block,
        };
        sampler.block(self.pixel, self.dimension(stream), count, block)
    }

    /// Returns `count` independent points of a stream, for any pattern.
    #[must_use]
    pub fn independent(&self, stream: Stream, count: u32) -> SampleSet {
        let sampler = Sampler::new(SamplerKind::Independent, self.seed);
        sampler.block(self.pixel, self.dimension(stream), count, self.block)
    }

    /// Returns `count` independent points that are the same for all blocks. With a pattern of
    /// independent samples they differ from block to block.
    pub(crate) fn in_common(&self, stream: Stream, count: u32) -> SampleSet {
        let block = if self.sampler.is_progressive() {
            self.block
        } else {
            Block::WHOLE
        };
        self.with_block(block).independent(stream, count)
    }

    /// Returns the number by which this block makes a single choice, given a number `u` in [0, 1)
    /// that is the same for [all blocks](Self::in_common). Over all blocks these numbers are spread
    /// evenly.
    pub(crate) fn spread(&self, u: f64) -> f64 {
        if self.sampler.is_progressive() {
            return u;
        }
        self.block.spread(u)
    }

    /// The random numbers for what this block has chosen by its number `v`. All blocks with numbers
    /// between the two marks have made one choice, and all others the other; the blocks with the
    /// same choice then divide one pattern among them.
    pub(crate) fn among(&self, v: f64, marks: [f64; 2]) -> Self {
        if self.sampler.is_progressive() {
            return *self;
        }
        self.with_block(self.block.among(v, marks))
    }
}

/// The random numbers of `count` samples of one technique.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples<'a> {
    pub numbers: &'a RandomNumbers,
    pub count: u32,
}

impl Samples<'_> {
    /// The random numbers of a technique that stands alone.
    pub(crate) fn set(&self) -> SampleSet {
        self.numbers.points(Stream::Samples, self.count)
    }
}
