//! The choice of vector instructions, made once at run time.
//!
//! Kernels for an instruction set are called with its token, [`Avx2`] or [`Avx512`]. Only this
//! module can create tokens, so that having one is proof that the processor has the instructions.
//!
//! ```
//! use linelit_simd::{InstructionSet, Isa};
//! assert!(Isa::detect(InstructionSet::Scalar).name() == InstructionSet::Scalar);
//! assert!(Isa::detect(InstructionSet::Avx2).name() <= InstructionSet::Avx2);
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicU8, Ordering};

/// The instruction sets for which there are kernels, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Plain Rust, on any processor.
    Scalar = 1,
    /// x86-64 with AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT.
    Avx2 = 2,
    /// The instructions of AVX2, plus AVX-512 F, VL, DQ and BW.
    Avx512 = 3,
}

impl InstructionSet {
    /// All instruction sets.
    pub const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// The name of the instruction set, as it is parsed and printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Whether the processor has this instruction set, and [`InstructionSet::limit`] allows it.
    #[must_use]
    pub fn is_available(self) -> bool {
        self as u8 <= best()
    }

    /// Prevents the whole process from using a higher instruction set than this, from the next
    /// query on. Existing [`Isa`] values keep theirs. The limit can only be lowered.
    ///
    /// This is for tests and measurements: results are bit-identical on every instruction set. The
    /// limit is the only global state of this crate, apart from what the standard library caches
    /// about the processor.
    pub fn limit(self) {
        best();
        BEST.fetch_min(self as u8, Ordering::Relaxed);
    }
}

impl fmt::Display for InstructionSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The error for text that does not name an instruction set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseInstructionSetError;

impl fmt::Display for ParseInstructionSetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected scalar, avx2 or avx512")
    }
}

impl std::error::Error for ParseInstructionSetError {}

impl FromStr for InstructionSet {
    type Err = ParseInstructionSetError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let named = Self::ALL.into_iter().find(|set| set.name() == text);
        named.ok_or(ParseInstructionSetError)
    }
}

/// The best instruction set available, as the number of its variant; zero before it is known.
static BEST: AtomicU8 = AtomicU8::new(0);

/// Returns the best instruction set available, as the number of its variant.
#[inline]
fn best() -> u8 {
    match BEST.load(Ordering::Relaxed) {
        0 => find(),
        best => best,
    }
}

/// Detects the best instruction set, caches it, and returns the number of its variant.
#[cold]
fn find() -> u8 {
    let found = processor() as u8;
    // Another thread may have detected the same set meanwhile, or lowered the limit.
    match BEST.compare_exchange(0, found, Ordering::Relaxed, Ordering::Relaxed) {
        Ok(_) => found,
        Err(best) => best,
    }
}

/// Returns the best instruction set of the processor, regardless of the limit.
fn processor() -> InstructionSet {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        let avx2 = has!("avx2")
            && has!("fma")
            && has!("bmi1")
            && has!("bmi2")
            && has!("lzcnt")
            && has!("popcnt");
        let avx512 = has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw");
        if avx2 && avx512 {
            return InstructionSet::Avx512;
        }
        if avx2 {
            return InstructionSet::Avx2;
        }
    }
    InstructionSet::Scalar
}

/// Proof that the processor has the instructions of [`InstructionSet::Avx2`].
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Avx2(());

/// Proof that the processor has the instructions of [`InstructionSet::Avx512`].
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Avx512(());

/// An instruction set, with the proof that the processor has it; kernels are
/// dispatched (`dispatch!`) by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// Plain Rust: [`InstructionSet::Scalar`].
    Scalar,
    /// AVX2: [`InstructionSet::Avx2`].
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// AVX-512: [`InstructionSet::Avx512`].
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Isa {
    /// Returns the best instruction set that the processor has and that [`InstructionSet::limit`]
    /// allows.
    #[inline]
    #[must_use]
    pub fn best() -> Self {
        Self::numbered(best())
    }

    /// Returns the best instruction set available that is not above `limit`.
    #[must_use]
    pub fn detect(limit: InstructionSet) -> Self {
        Self::numbered(best().min(limit as u8))
    }

    /// Returns the instruction set with the number of its variant, which must not exceed [`best`].
    #[inline]
    fn numbered(number: u8) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if number >= InstructionSet::Avx512 as u8 {
                return Self::Avx512(Avx512(()));
            }
            if number >= InstructionSet::Avx2 as u8 {
                return Self::Avx2(Avx2(()));
            }
        }
        let _ = number;
        Self::Scalar
    }

    /// Returns the instruction set without the proof that it is available.
    #[must_use]
    pub const fn name(self) -> InstructionSet {
        match self {
            Self::Scalar => InstructionSet::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => InstructionSet::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => InstructionSet::Avx512,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for set in InstructionSet::ALL {
            assert_eq!(set.to_string().parse(), Ok(set));
            assert!(Isa::detect(set).name() <= set);
        }
        let wrong = "sse9".parse::<InstructionSet>().unwrap_err();
        assert_eq!(wrong.to_string(), "expected scalar, avx2 or avx512");
    }

    /// A limit above the best set has no effect.
    #[test]
    fn limits_are_never_raised() {
        let best = Isa::best().name();
        InstructionSet::Avx512.limit();
        assert_eq!(Isa::best().name(), best);
        best.limit();
        assert_eq!(Isa::best().name(), best);
        assert!(best.is_available() && InstructionSet::Scalar.is_available());
    }
}
