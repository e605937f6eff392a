//! The Rust client of simd.
