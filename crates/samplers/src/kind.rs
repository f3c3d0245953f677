//! This module holds the names of the sampling patterns.
#![allow(clippy::disallowed_types, reason = "the name that an error quotes")]

use std::fmt;
use std::str::FromStr;

/// A sampling pattern. [`FromStr`] and [`Display`](fmt::Display) use the names of the command line.
///
/// The variance exponents are for N samples of an integrand in one and in two dimensions that is
/// smooth / has a jump (Billen & Dutré 2016, section 3; Owen 1997, *Scrambled net variance*;
/// measured in this crate's tests).
///
/// ```
/// use linelit_samplers::SamplerKind;
/// assert_eq!("sobol".parse(), Ok(SamplerKind::Sobol));
/// assert_eq!(SamplerKind::UniformJitter.to_string(), "uniform-jitter");
/// assert!("white".parse::<SamplerKind>().unwrap_err().to_string().contains("bluenoise"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SamplerKind {
    /// `independent`: uniform random numbers. The variance is always N⁻¹.
    Independent,
    /// `stratified`: one jittered sample per stratum or cell. 1-D N⁻³ / N⁻², 2-D N⁻² / N^−1.5.
    Stratified,
    /// `multijitter`: one sample per cell and per stratum of each axis. 2-D N⁻² or better / N^−1.5,
    /// and N⁻³ for the part of an integrand that depends on one axis only.
    MultiJitter,
    /// `sobol`: Owen-scrambled Sobol' (0,2)-nets. 1-D N⁻³ / N⁻², 2-D N⁻³ log N / N^−1.5.
    Sobol,
    /// `halton`: Owen-scrambled Halton points in bases 2 and 3. The variance of a mean over N
    /// points in 2-D falls as N⁻² for smooth integrands and as N^−1.5 where an edge crosses them,
    /// equally well for any N; in 1-D it falls as for [`Self::Sobol`].
    Halton,
    /// `uniform-jitter`: (ξ + k)/N with one ξ for all k; in 2-D a randomly shifted lattice. 1-D N⁻²
    /// / N⁻², 2-D N⁻² / N^−1.5.
    UniformJitter,
    /// `bluenoise`: uniform jitter whose ξ comes from a 64×64 blue-noise tile, so that the error is
    /// high-frequency across pixels.
    BlueNoise,
    /// `bluenoise-independent`: each sample has its own placement of the blue-noise tile and no
    /// stratification; N⁻¹ (the comparison of Peters 2021, Fig. 7).
    BlueNoiseIndependent,
    /// `zsobol`: one Owen–Sobol' sequence for the whole image, distributed over the pixels along a
    /// shuffled Z-order curve.
    ZSobol,
    /// `auto`: the points of `sobol` if their number is a power of two, and of `multijitter`
    /// otherwise. It is as good as the better of the two, and better than `stratified` in two
    /// dimensions.
    Auto,
    /// `sobol-burley`: the sequence of the `sobol_burley` crate (Burley 2020), for comparison with
    /// `sobol`. Its numbers have 24 bits; after 2¹⁶ points another sequence begins.
    SobolBurley,
}

impl SamplerKind {
    /// All patterns, in the order of their declaration.
    pub const ALL: [Self; 11] = [
        Self::Independent,
        Self::Stratified,
        Self::MultiJitter,
        Self::Sobol,
        Self::Halton,
        Self::UniformJitter,
        Self::BlueNoise,
        Self::BlueNoiseIndependent,
        Self::ZSobol,
        Self::Auto,
        Self::SobolBurley,
    ];

    /// Returns the name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Stratified => "stratified",
            Self::MultiJitter => "multijitter",
            Self::Sobol => "sobol",
            Self::Halton => "halton",
            Self::UniformJitter => "uniform-jitter",
            Self::BlueNoise => "bluenoise",
            Self::BlueNoiseIndependent => "bluenoise-independent",
            Self::ZSobol => "zsobol",
            Self::Auto => "auto",
            Self::SobolBurley => "sobol-burley",
        }
    }

    /// Whether sample i does not depend on the number of samples, so that a larger set extends a
    /// smaller one.
    #[must_use]
    pub const fn is_progressive(self) -> bool {
        matches!(self, Self::Independent | Self::BlueNoiseIndependent)
    }

    /// Whether different pixels have independent numbers. Blue-noise and Z-order patterns couple
    /// neighbours on purpose.
    #[must_use]
    pub const fn pixels_are_independent(self) -> bool {
        !matches!(
            self,
            Self::BlueNoise | Self::BlueNoiseIndependent | Self::ZSobol
        )
    }

    /// Returns a salt that separates the streams of different patterns. It is frozen with the order
    /// of the variants, which the golden values of the tests check.
    pub(crate) const fn salt(self) -> u64 {
        self as u64 + 1
    }
}

impl fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for SamplerKind {
    type Err = UnknownSampler;

    fn from_str(name: &str) -> Result<Self, UnknownSampler> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownSampler {
                name: name.to_owned(),
            })
    }
}

/// The error that [`SamplerKind`] cannot be parsed because no pattern has this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownSampler {
    name: String,
}

impl fmt::Display for UnknownSampler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no sampler is called '{}'; there are", self.name)?;
        for (i, kind) in SamplerKind::ALL.iter().enumerate() {
            write!(f, "{} {}", if i == 0 { "" } else { "," }, kind.name())?;
        }
        Ok(())
    }
}

impl std::error::Error for UnknownSampler {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for kind in SamplerKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
            assert_eq!(kind.to_string(), kind.name());
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let message = "Sobol".parse::<SamplerKind>().unwrap_err().to_string();
        assert_eq!(
            message,
            "no sampler is called 'Sobol'; there are independent, stratified, multijitter, sobol, halton, \
             uniform-jitter, bluenoise, bluenoise-independent, zsobol, auto, sobol-burley"
        );
    }
}
