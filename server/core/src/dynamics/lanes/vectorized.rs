//! Which vectors lanes are those of.
//!
//! One lane is none: a robot that steps alone steps faster by the one-robot step, which has the same bits. So the code of lanes is not
//! compiled for [`pulp::Scalar`], but by tests.

use pulp::{Arch, Simd, WithSimd};

/// Does work with the widest vectors that the processor has, of at most so many numbers. Gives it back where it has none.
#[inline(always)]
pub fn vectorized<W: WithSimd>(most: usize, work: W) -> Result<W::Output, W> {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) if most >= 8 => Ok(Simd::vectorize(simd, work)),
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Ok(Simd::vectorize(*simd, work)),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Ok(Simd::vectorize(simd, work)),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Ok(Simd::vectorize(simd, work)),
        _ => Err(work),
    }
}
