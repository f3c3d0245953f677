//! Sample dimensions and their uses: the one table.

use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind};

/// Sample dimensions of one (shading point, light) pair.
const PER_LIGHT: u32 = 16;
/// Sample dimensions before the first light's.
const BEFORE_LIGHTS: u32 = 4;

/// The sample dimension of places in the pixel's filter.
pub const CAMERA: u32 = 0;

/// The sample dimension of the numbers that pick lights for a shading point; the one below it is
/// that of points on lights that the choice looks at. `path` numbers the shading points of a camera
/// sample.
///
/// They count down from the largest, far from those of the lights.
#[must_use]
pub const fn light_choice(path: u32) -> u32 {
    u32::MAX.wrapping_sub(path.wrapping_mul(2))
}

/// Uses of the random numbers of a (shading point, light) pair.
///
/// Streams that share a dimension are never asked for by one estimate, or differ in the pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Samples of a technique that stands alone: dimension 0 of the pair.
    Samples,
    /// Directions of lines and whole numbers of samples, always independent: dimension 1.
    Orientation,
    /// Glossy samples of a linear light, beside its diffuse ones: dimension 1.
    Glossy,
    /// Samples of a technique in a combination, by its index: dimensions 2 to 9.
    Technique(u32),
    /// Samples that go ahead, to tell how others are drawn and counted: dimension 10.
    Ahead,
}

/// The random numbers of one (shading point, light) pair: pure functions of seed, pixel and
/// dimension.
#[derive(Clone, Copy, Debug)]
pub struct RandomNumbers {
    /// The pattern.
    pub sampler: SamplerKind,
    /// The seed; two seeds give independent estimates.
    pub seed: u64,
    /// The pixel.
    pub pixel: [u32; 2],
    /// The pair's number in the pixel, the same in each pixel for patterns that reach across them,
    /// and for each of its camera samples.
    pub pair: u32,
    /// The block of the pixel's patterns that these are: each of several camera samples takes one.
    pub block: Block,
}

impl RandomNumbers {
    /// The numbers of a pair in a pixel of one camera sample.
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

    /// Returns the numbers of another block.
    #[must_use]
    pub const fn with_block(self, block: Block) -> Self {
        Self { block, ..self }
    }

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

    /// `count` points of a stream, by the pattern.
    #[must_use]
    pub fn points(&self, stream: Stream, count: u32) -> SampleSet {
        let sampler = Sampler::new(self.sampler, self.seed);
        // What others depend on does not go along with them from block to block.
        let block = match stream {
            Stream::Ahead => self.block.interleaved(),
            _ => self.block,
        };
        sampler.block(self.pixel, self.dimension(stream), count, block)
    }

    /// `count` independent points of a stream, whatever the pattern.
    #[must_use]
    pub fn independent(&self, stream: Stream, count: u32) -> SampleSet {
        let sampler = Sampler::new(SamplerKind::Independent, self.seed);
        sampler.block(self.pixel, self.dimension(stream), count, self.block)
    }

    /// `count` independent points that all blocks have in common, but for patterns of independent
    /// samples.
    pub(crate) fn in_common(&self, stream: Stream, count: u32) -> SampleSet {
        let block = if self.sampler.is_progressive() {
            self.block
        } else {
            Block::WHOLE
        };
        self.with_block(block).independent(stream, count)
    }

    /// A number of the block for what it chooses once, from one in [0, 1) that all have [in
    /// common](Self::in_common): over all blocks, these are spread evenly.
    pub(crate) fn spread(&self, u: f64) -> f64 {
        if self.sampler.is_progressive() {
            return u;
        }
        self.block.spread(u)
    }

    /// The numbers of what the block has chosen by a number `v`, where those between two marks
    /// choose alike and those outside: of all blocks that do, each takes its own part of one
    /// pattern.
    pub(crate) fn among(&self, v: f64, marks: [f64; 2]) -> Self {
        if self.sampler.is_progressive() {
            return *self;
        }
        self.with_block(self.block.among(v, marks))
    }
}

/// The random numbers of so many samples of one technique.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples<'a> {
    pub numbers: &'a RandomNumbers,
    pub count: u32,
}

impl Samples<'_> {
    /// The numbers of a technique that stands alone.
    pub(crate) fn set(&self) -> SampleSet {
        self.numbers.points(Stream::Samples, self.count)
    }
}
