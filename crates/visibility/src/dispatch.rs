//! Calling a kernel for the instruction set that was chosen at run time.

/// Instantiates a generic kernel `fn kernel<S: Simd>(s: S, …)` for every instruction set, behind
/// one function that takes an [`Isa`](linelit_geometry::isa::Isa).
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $kernel:ident($($arg:ident: $ty:ty),* $(,)?) $(-> $ret:ty)?) => {
        $(#[$doc])*
        #[allow(unsafe_code, reason = "calls into code for a detected instruction set")]
        #[inline]
        pub(crate) fn $name(isa: linelit_geometry::isa::Isa, $($arg: $ty),*) $(-> $ret)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx512(s: linelit_geometry::isa::Avx512, $($arg: $ty),*) $(-> $ret)? {
                $kernel(s, $($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2(s: linelit_geometry::isa::Avx2, $($arg: $ty),*) $(-> $ret)? {
                $kernel(s, $($arg),*)
            }
            match isa {
                linelit_geometry::isa::Isa::Scalar => $kernel($crate::simd::Scalar, $($arg),*),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the token proves that the processor has these instructions.
                linelit_geometry::isa::Isa::Avx2(s) => unsafe { avx2(s, $($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the token proves that the processor has these instructions.
                linelit_geometry::isa::Isa::Avx512(s) => unsafe { avx512(s, $($arg),*) },
            }
        }
    };
}
pub(crate) use dispatch;
