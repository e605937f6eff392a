"""The module `pybullet` of processes that a script of the runner starts: it is simd's."""

import simd_client.pybullet
from simd_client.pybullet import import_hooks

import_hooks.replace(simd_client.pybullet)
