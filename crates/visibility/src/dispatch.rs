//! Choosing the instruction set once, at run time.

#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx512};

/// The instruction sets that the kernels exist for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Plain Rust, on every processor.
    Scalar,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, DQ and BW.
    Avx512,
}

/// An instruction set with the proof that the processor has it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Isa {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Isa {
    /// The best up to `limit`.
    pub(crate) fn detect(limit: InstructionSet) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if limit >= InstructionSet::Avx512
                && let Some(token) = Avx512::detect()
            {
                return Self::Avx512(token);
            }
            if limit >= InstructionSet::Avx2
                && let Some(token) = Avx2::detect()
            {
                return Self::Avx2(token);
            }
        }
        let _ = limit;
        Self::Scalar
    }

    pub(crate) fn name(self) -> InstructionSet {
        match self {
            Self::Scalar => InstructionSet::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => InstructionSet::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => InstructionSet::Avx512,
        }
    }
}

/// Instantiates a generic kernel `fn kernel<S: Simd>(s: S, …)` for every instruction set, behind
/// one function that takes an [`Isa`].
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $kernel:ident($($arg:ident: $ty:ty),* $(,)?) $(-> $ret:ty)?) => {
        $(#[$doc])*
        #[allow(unsafe_code, reason = "calls into code for a detected instruction set")]
        #[inline]
        pub(crate) fn $name(isa: $crate::dispatch::Isa, $($arg: $ty),*) $(-> $ret)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx512(s: $crate::simd::Avx512, $($arg: $ty),*) $(-> $ret)? {
                $kernel(s, $($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2(s: $crate::simd::Avx2, $($arg: $ty),*) $(-> $ret)? {
                $kernel(s, $($arg),*)
            }
            match isa {
                $crate::dispatch::Isa::Scalar => $kernel($crate::simd::Scalar, $($arg),*),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the token proves that the processor has these instructions.
                $crate::dispatch::Isa::Avx2(s) => unsafe { avx2(s, $($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the token proves that the processor has these instructions.
                $crate::dispatch::Isa::Avx512(s) => unsafe { avx512(s, $($arg),*) },
            }
        }
    };
}
pub(crate) use dispatch;
