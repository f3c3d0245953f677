//! Choosing the widest vector instructions that the machine has.
//!
//! A kernel is plain scalar code over a fixed number of lanes, inlined into one copy for each
//! instruction set; the compiler vectorises each copy. Rust neither fuses nor reorders floating
//! point operations, so all copies give the same bits, and the plain copy is the scalar twin.

/// Runs `kernel(data, x)` compiled for the machine.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a CPU feature; each call is guarded by its detection"
)]
pub(crate) fn run<T, R>(data: &T, x: f64, kernel: impl Fn(&T, f64) -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f")
            && std::arch::is_x86_feature_detected!("avx512dq")
            && std::arch::is_x86_feature_detected!("avx512vl")
        {
            // SAFETY: the feature was detected just now.
            return unsafe { avx512(data, x, kernel) };
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was detected just now.
            return unsafe { avx2(data, x, kernel) };
        }
    }
    kernel(data, x)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn avx512<T, R>(data: &T, x: f64, kernel: impl Fn(&T, f64) -> R) -> R {
    kernel(data, x)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<T, R>(data: &T, x: f64, kernel: impl Fn(&T, f64) -> R) -> R {
    kernel(data, x)
}
