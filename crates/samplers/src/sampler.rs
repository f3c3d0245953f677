//! This module holds the sampler, which maps (seed, pixel, dimension) to a set of points.

use crate::block::Block;
use crate::blue_noise::{BlueIndependent, blue_uniform_jitter};
use crate::burley::SobolBurley;
use crate::halton::Halton;
use crate::hash::{lane, mix, stream_key};
use crate::independent::{Independent, generator};
use crate::kind::SamplerKind;
use crate::sobol::OwenSobol;
use crate::stratified::{MultiJitter, Stratified, UniformJitter};
use crate::zsobol::z_sobol;
use rand::Rng;
use std::fmt::Debug;

/// A sampling pattern with a seed: a pure function from (pixel, dimension, sample) to numbers in
/// [0, 1).
///
/// Two samplers with different seeds give independent numbers, for independent trials of an
/// experiment.
///
/// ```
/// use linelit_samplers::{Sampler, SamplerKind};
/// let sampler = Sampler::new(SamplerKind::Stratified, 42);
/// let set = sampler.points([17, 4], 0, 8);
/// let mut strata: Vec<f64> = set.iter_1d().map(|x| (8.0 * x).floor()).collect();
/// strata.sort_by(f64::total_cmp);
/// assert_eq!(strata, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    kind: SamplerKind,
    salted_seed: u64,
}

impl Sampler {
    /// Makes a sampler of the given kind; all seeds are equally good.
    #[inline]
    #[must_use]
    pub const fn new(kind: SamplerKind, seed: u64) -> Self {
        Self {
            kind,
            salted_seed: mix(mix(seed ^ 0x6C69_6E65_6C69_7421) ^ kind.salt()),
        }
    }

    /// Returns the pattern.
    #[inline]
    #[must_use]
    pub const fn kind(&self) -> SamplerKind {
        self.kind
    }

    /// Returns the `count` samples of a pixel in one dimension.
    ///
    /// `dimension` names a stream. Different dimensions, like different pixels, are independent of
    /// each other (the numbers are *padded*: each dimension is a stratified set of its own, in its
    /// own random order). Draw either 1-D or 2-D numbers from a dimension, since the 1-D and 2-D
    /// numbers of one dimension are not independent.
    ///
    /// `count` = 0 counts as 1. Sample indices of `count` and more are allowed, and continue with
    /// further, independent sets of `count` samples ([progressive](SamplerKind::is_progressive)
    /// patterns simply continue). This does not allocate.
    #[must_use]
    pub fn points(&self, pixel: [u32; 2], dimension: u32, count: u32) -> SampleSet {
        self.block(pixel, dimension, count, Block::WHOLE)
    }

    /// Returns the `count` samples of a pixel in one dimension that belong to one [`Block`] of a
    /// larger pattern, which consists of as many such blocks as there are. For a single block they
    /// are [`Sampler::points`].
    ///
    /// Blocks of sequences (`sobol`, `halton`, `zsobol`) are runs of the sequence; blocks of nets
    /// are nets. For strata, each block has one sample in each of its own `count` strata, and all
    /// blocks together have one sample in each part of them. Blocks of another `count`, like other
    /// dimensions, belong to another pattern.
    #[must_use]
    pub fn block(&self, pixel: [u32; 2], dimension: u32, count: u32, block: Block) -> SampleSet {
        let count = count.max(1);
        let key = stream_key(self.salted_seed, pixel, dimension);
        let keys = block.keys(key, if self.kind.is_progressive() { 0 } else { count });
        let [_, own] = keys;
        // A pattern is large: it is built where it is stored.
        let set = |pattern| SampleSet {
            pattern,
            count,
            block,
            sampler: *self,
            pixel,
            dimension,
        };
        match self.kind {
            SamplerKind::Independent => set(Pattern::Independent(Independent::new(own))),
            SamplerKind::Stratified => {
                set(Pattern::Stratified(Stratified::new(keys, count, block)))
            }
            SamplerKind::Sobol => set(Pattern::Sobol(OwenSobol::new(keys, count, block))),
            SamplerKind::SobolBurley => {
                set(Pattern::SobolBurley(SobolBurley::new(keys, count, block)))
            }
            SamplerKind::Auto if is_power_of_two(count, &block) => {
                set(Pattern::Sobol(OwenSobol::new(keys, count, block)))
            }
            SamplerKind::MultiJitter | SamplerKind::Auto => {
                set(Pattern::MultiJitter(MultiJitter::new(keys, count, block)))
            }
            SamplerKind::Halton => set(Pattern::Halton(Halton::new(keys, count, block))),
            SamplerKind::UniformJitter => set(Pattern::UniformJitter(UniformJitter::new(
                keys, count, block,
            ))),
            SamplerKind::BlueNoise => set(Pattern::UniformJitter(blue_uniform_jitter(
                self.dimension_key([0, 0], dimension),
                keys,
                pixel,
                count,
                block,
            ))),
            SamplerKind::BlueNoiseIndependent => {
                let [_, tile] = block.keys(self.dimension_key([0, 0], dimension), 0);
                set(Pattern::Blue(BlueIndependent::new(tile, own, pixel)))
            }
            SamplerKind::ZSobol => {
                let tile = self.dimension_key(pixel.map(|c| c >> 16), dimension);
                let [tile, _] = block.keys(tile, count);
                set(Pattern::Sobol(z_sobol([tile, own], pixel, count, block)))
            }
        }
    }

    /// Returns a generator of random numbers for a pixel and a dimension, for code that takes one
    /// of `rand`'s: PCG-XSH-RR 64/32 with its own state and stream (O'Neill 2014, *PCG*).
    ///
    /// It is independent of [`Self::points`] and of the generators of other pixels, dimensions,
    /// patterns and seeds, except for 127-bit birthday collisions. Its numbers are frozen as well.
    ///
    /// ```
    /// use linelit_samplers::{Sampler, SamplerKind};
    /// use rand::Rng;
    /// let mut rng = Sampler::new(SamplerKind::Sobol, 42).rng([17, 4], 0);
    /// assert_ne!(rng.next_u64(), rng.next_u64());
    /// ```
    #[must_use]
    pub fn rng(&self, pixel: [u32; 2], dimension: u32) -> impl Rng + Clone + Debug + use<> {
        let key = stream_key(lane(self.salted_seed, 1 << 63), pixel, dimension);
        generator(key)
    }

    /// Returns a key that depends on the tile of the pixel, but not on the pixel within it.
    fn dimension_key(&self, tile: [u32; 2], dimension: u32) -> u64 {
        stream_key(lane(self.salted_seed, 0), tile, dimension)
    }
}

/// The samples of one pixel in one dimension, from [`Sampler::points`]. They have random access;
/// the set is `Copy` and does not allocate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleSet {
    pattern: Pattern,
    count: u32,
    block: Block,
    sampler: Sampler,
    pixel: [u32; 2],
    dimension: u32,
}

/// The pattern of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "sets live on the stack, are copied rarely, and must not allocate"
)]
enum Pattern {
    Independent(Independent),
    Stratified(Stratified),
    MultiJitter(MultiJitter),
    Sobol(OwenSobol),
    SobolBurley(SobolBurley),
    Halton(Halton),
    UniformJitter(UniformJitter),
    Blue(BlueIndependent),
}

impl SampleSet {
    /// Returns the number of samples for which the set was made, at least 1.
    #[inline]
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// Whether the `count` numbers of [`SampleSet::get_1d`] lie one in each of `count` equal
    /// strata, each uniform in its stratum and independent of the positions of the others in
    /// theirs.
    ///
    /// This holds for `stratified`, `multijitter` and `auto`, and for powers of two for the
    /// scrambled nets: `sobol`, `halton` and `zsobol`.
    ///
    /// ```
    /// use linelit_samplers::{Sampler, SamplerKind};
    /// let free = |kind, count| {
    ///     let set = Sampler::new(kind, 1).points([0, 0], 0, count);
    ///     set.has_independent_strata()
    /// };
    /// assert!(free(SamplerKind::Sobol, 16) && !free(SamplerKind::Sobol, 12));
    /// assert!(!free(SamplerKind::UniformJitter, 16));
    /// ```
    #[inline]
    #[must_use]
    pub const fn has_independent_strata(&self) -> bool {
        match self.sampler.kind {
            SamplerKind::Stratified | SamplerKind::MultiJitter | SamplerKind::Auto => true,
            SamplerKind::Sobol
            | SamplerKind::SobolBurley
            | SamplerKind::Halton
            | SamplerKind::ZSobol => self.count.is_power_of_two(),
            SamplerKind::Independent
            | SamplerKind::UniformJitter
            | SamplerKind::BlueNoise
            | SamplerKind::BlueNoiseIndependent => false,
        }
    }

    /// Returns the number of equal parts of [0, 1) in one of which each number is uniform, for any
    /// values of the other numbers, if the set has [independent
    /// strata](Self::has_independent_strata). For a whole pattern the parts are the strata; for a
    /// [`Block`] they are the strata of all blocks together.
    ///
    /// ```
    /// use linelit_samplers::{Block, Sampler, SamplerKind};
    /// let sampler = Sampler::new(SamplerKind::Stratified, 1);
    /// assert_eq!(sampler.points([0, 0], 0, 4).parts(), 4.0);
    /// assert_eq!(sampler.block([0, 0], 0, 4, Block::new(2, 16)).parts(), 64.0);
    /// ```
    #[must_use]
    pub fn parts(&self) -> f64 {
        let all = u64::from(self.count) * u64::from(self.block.of());
        let parts = match &self.pattern {
            Pattern::Sobol(_) | Pattern::SobolBurley(_) | Pattern::Halton(_) => {
                all.checked_next_power_of_two().unwrap_or(all)
            }
            _ => all,
        };
        parts as f64
    }

    /// Returns the number of sample `i`, in [0, 1).
    ///
    /// The `count` numbers together are stratified according to the pattern; each alone is uniform,
    /// to 2⁻⁵³, over random seeds.
    #[inline]
    #[must_use]
    pub fn get_1d(&self, i: u32) -> f64 {
        if i >= self.count && !self.sampler.kind.is_progressive() {
            let (set, i) = self.beyond(i);
            return set.get_1d(i);
        }
        match &self.pattern {
            Pattern::Independent(p) => p.get_1d(i),
            Pattern::Stratified(p) => p.get_1d(i),
            Pattern::MultiJitter(p) => p.get_1d(i),
            Pattern::Sobol(p) => p.get_1d(i),
            Pattern::SobolBurley(p) => p.get_1d(i),
            Pattern::Halton(p) => p.get_1d(i),
            Pattern::UniformJitter(p) => p.get_1d(i),
            Pattern::Blue(p) => p.get_1d(i),
        }
    }

    /// Returns the point of sample `i`, in [0, 1)².
    #[inline]
    #[must_use]
    pub fn get_2d(&self, i: u32) -> [f64; 2] {
        if i >= self.count && !self.sampler.kind.is_progressive() {
            let (set, i) = self.beyond(i);
            return set.get_2d(i);
        }
        match &self.pattern {
            Pattern::Independent(p) => p.get_2d(i),
            Pattern::Stratified(p) => p.get_2d(i),
            Pattern::MultiJitter(p) => p.get_2d(i),
            Pattern::Sobol(p) => p.get_2d(i),
            Pattern::SobolBurley(p) => p.get_2d(i),
            Pattern::Halton(p) => p.get_2d(i),
            Pattern::UniformJitter(p) => p.get_2d(i),
            Pattern::Blue(p) => p.get_2d(i),
        }
    }

    /// Fills both columns with the points of the samples from `first` on, until the shorter column
    /// is full. They are the points that [`SampleSet::get_2d`] returns one by one, and each of them
    /// is cheaper.
    pub fn fill_2d(&self, first: u32, [x, y]: [&mut [f64]; 2]) {
        let len = x.len().min(y.len());
        let (x, y) = (&mut x[..len], &mut y[..len]);
        let end = u64::from(first) + len as u64;
        match &self.pattern {
            Pattern::Independent(p) if end <= u64::from(u32::MAX) => p.fill_2d(first, x, y),
            Pattern::Stratified(p) if end <= u64::from(self.count) => p.fill_2d(first, x, y),
            Pattern::Sobol(p) if end <= u64::from(self.count) => p.fill_2d(first, x, y),
            _ => {
                let mut i = first;
                for (x, y) in x.iter_mut().zip(y) {
                    [*x, *y] = self.get_2d(i);
                    i = i.wrapping_add(1);
                }
            }
        }
    }

    /// Returns the `count` numbers, in sample order.
    pub fn iter_1d(&self) -> impl ExactSizeIterator<Item = f64> + use<> {
        let set = *self;
        (0..set.count).map(move |i| set.get_1d(i))
    }

    /// Returns the `count` points, in sample order.
    pub fn iter_2d(&self) -> impl ExactSizeIterator<Item = [f64; 2]> + use<> {
        let set = *self;
        (0..set.count).map(move |i| set.get_2d(i))
    }

    /// Returns the set, and the index in it, that continue a pattern of fixed size.
    #[cold]
    fn beyond(&self, i: u32) -> (Self, u32) {
        let again = lane(self.sampler.salted_seed, 1 + u64::from(i / self.count));
        let sampler = Sampler {
            salted_seed: again,
            ..self.sampler
        };
        (
            sampler.block(self.pixel, self.dimension, self.count, self.block),
            i % self.count,
        )
    }
}

/// Whether all blocks together have a power of two of samples.
const fn is_power_of_two(count: u32, block: &Block) -> bool {
    count.is_power_of_two() && block.of().is_power_of_two()
}
