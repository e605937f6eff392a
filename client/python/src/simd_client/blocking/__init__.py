"""The blocking client. All files but `connect` and `runtime` are generated from `simd_client.aio`."""
