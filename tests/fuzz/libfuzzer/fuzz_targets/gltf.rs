//! Fuzzes `simd_fuzz_targets::gltf`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| simd_fuzz_targets::gltf(bytes));
