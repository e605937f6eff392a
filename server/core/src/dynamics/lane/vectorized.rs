//! Choice of the vectors for lanes.
//!
//! A single lane is not used: a robot that steps alone is faster in the one-robot step, which has the same
//! bits. Only tests compile the code of lanes for [`pulp::Scalar`].

use pulp::{Arch, Simd, WithSimd};

/// Runs work with the widest vectors of the processor that have at most `most` numbers. Returns the work as
/// an error if there are none.
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
