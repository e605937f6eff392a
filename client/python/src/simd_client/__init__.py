"""The Python client of simd."""
