//! Choosing the widest vector instructions that the machine has.
//!
//! A kernel is plain scalar code over a fixed number of lanes, inlined into one copy for each
//! instruction set; the compiler vectorises each copy. Rust neither fuses nor reorders floating
//! point operations, so all copies give the same bits, and the plain copy is the scalar twin.

/// Runs `kernel` compiled for the machine.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a CPU feature; each call is guarded by its detection"
)]
pub(crate) fn with<R>(kernel: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f") && has!("avx512dq") && has!("avx512vl") {
            // SAFETY: the three features of `avx512` were detected just now.
            return unsafe { avx512(kernel) };
        }
        if has!("avx2") {
            // SAFETY: the feature of `avx2` was detected just now.
            return unsafe { avx2(kernel) };
        }
    }
    kernel()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn avx512<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<R>(kernel: impl FnOnce() -> R) -> R {
    kernel()
}
