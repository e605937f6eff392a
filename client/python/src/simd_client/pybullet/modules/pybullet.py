"""The module `pybullet` of processes that a script of the runner starts: it is simd's."""

import simd_client.pybullet
from simd_client.pybullet import stand_in

stand_in.replace(simd_client.pybullet)
