"""Tests of `simd_client.pybullet`."""
