//! `dispatch!`: the macro by which a kernel is called on the instruction set
//! that was chosen at run time.

/// Defines a function that runs a kernel on the instruction set of an `Isa`. The
/// kernel has the form `#[inline(always)] fn kernel<S: Simd>(s: S, …)`, and is compiled once for
/// every instruction set; the function takes an `Isa` in place of `s`. Constant parameters of the
/// function (`fn name<const N: usize> = …`) are passed to the kernel after `S`.
///
/// The kernel, and all functions that it calls with its token, have to be `#[inline(always)]`, and
/// so have closures, which are not inlined by themselves: code that is not inlined is compiled
/// without the instructions, and is slow.
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
