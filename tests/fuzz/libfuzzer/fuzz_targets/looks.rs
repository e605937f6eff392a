//! Fuzzes `simd_fuzz_targets::looks`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| simd_fuzz_targets::looks(bytes));
