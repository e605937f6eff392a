//! Arithmetic over lanes of the processor's vectors.
//!
//! * [`vectorized`]: code for these vectors. [`number`]: a number of each lane. [`vectors`]: vectors and matrices of them.

pub(in crate::dynamics) mod number;
mod vectorized;
pub(in crate::dynamics) mod vectors;

pub use vectorized::vectorized;
