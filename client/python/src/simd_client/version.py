"""The version of the package, and of the schema that it uses."""

__version__ = "0.1.0"

API_VERSION = (1, 0)
"""Major and minor number of the schema `simd.v1` that this client uses."""
