//! Calling a kernel for the instruction set that was chosen at run time.

/// Instantiates a kernel `#[inline(always)] fn kernel<S: Simd>(s: S, …)` for every instruction set,
/// behind one function that takes an [`Isa`](crate::Isa) in the place of `s`. Constants of the
/// function (`fn name<const N: usize> = …`) are handed to the kernel after `S`.
///
/// The kernel and all that it calls with its token must be `#[inline(always)]`, and closures do not
/// do: what is not inlined is compiled without the instructions, and slow.
#[macro_export]
macro_rules! dispatch {
    ($(#[$doc:meta])* $vis:vis fn $name:ident $(<$(const $c:ident: $ct:ty),+>)? =
        $kernel:ident($($arg:ident: $ty:ty),* $(,)?) $(-> $ret:ty)?) => {
        $(#[$doc])*
        #[inline]
        $vis fn $name $(<$(const $c: $ct),+>)? (isa: $crate::Isa, $($arg: $ty),*) $(-> $ret)? {
            use $crate::Simd as _;
            match isa {
                $crate::Isa::Scalar => $crate::Scalar.vectorize(
                    #[inline(always)]
                    move || $kernel::<_ $($(, $c)+)?>($crate::Scalar, $($arg),*)
                ),
                #[cfg(target_arch = "x86_64")]
                $crate::Isa::Avx2(s) => s.vectorize(
                    #[inline(always)]
                    move || $kernel::<_ $($(, $c)+)?>(s, $($arg),*)
                ),
                #[cfg(target_arch = "x86_64")]
                $crate::Isa::Avx512(s) => s.vectorize(
                    #[inline(always)]
                    move || $kernel::<_ $($(, $c)+)?>(s, $($arg),*)
                ),
            }
        }
    };
}
