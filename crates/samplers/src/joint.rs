//! Up to 256 jointly stratified dimensions, from the `sobol_burley` crate within its limits.

use crate::hash::{lane, mix, stream_key, unit_f64};

/// An Owen-scrambled Sobol' sequence of 256 dimensions that are stratified *together*.
///
/// [`Sampler`](crate::Sampler) pads: each of its dimensions is a one- or two-dimensional net of its
/// own, independent of the others, and without limits. Where three or more numbers of one sample
/// should be stratified together (line orientation, offset and position, say), take them from one
/// `JointSobol`. Its numbers come from the crate [sobol_burley](https://docs.rs/sobol_burley)
/// (Burley 2020, direction numbers of Joe & Kuo), whose limits are the argument types here: 2¹⁶
/// samples (`u16`) and 256 dimensions (`u8`). Its 23 bits are continued at random.
///
/// ```
/// use linelit_samplers::JointSobol;
/// let set = JointSobol::new(1, [10, 20], 0);
/// let [orientation, offset, position] = [0, 1, 2].map(|d| set.get(5, d));
/// assert!([orientation, offset, position].iter().all(|x| (0.0..1.0).contains(x)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointSobol {
    seed: u32,
    key: u64,
}

impl JointSobol {
    /// The sequence of a seed, a pixel and a stream; different ones are independent (but for 32-bit
    /// birthdays).
    #[inline]
    #[must_use]
    pub const fn new(seed: u64, pixel: [u32; 2], stream: u32) -> Self {
        let key = stream_key(mix(mix(seed) ^ 0x4A6F_696E_7453_6F62), pixel, stream);
        Self {
            seed: (key >> 32) as u32,
            key,
        }
    }

    /// Number `dimension` of sample `sample`, in [0, 1).
    #[inline]
    #[must_use]
    pub fn get(&self, sample: u16, dimension: u8) -> f64 {
        let coarse = f64::from(sobol_burley::sample(
            u32::from(sample),
            u32::from(dimension),
            self.seed,
        ));
        // `coarse` is a multiple of 2⁻²³ below one, so the sum is exact to 53 bits and below one.
        let counter = u64::from(sample) << 8 | u64::from(dimension);
        let fine = unit_f64(lane(self.key, counter) & !((1 << 34) - 1));
        coarse + fine * (1.0 / f64::from(1 << 23))
    }
}
