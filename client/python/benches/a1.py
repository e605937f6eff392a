"""A1, a robot with four legs from the package `pybullet_data`, on level ground."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from simd_client import Robot, Simulation, Surface

# It has no types.
data: Any = importlib.import_module("pybullet_data")

LEGS = ("FR", "FL", "RR", "RL")
"""Legs: front right, and so on."""

JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in ("hip", "upper", "lower"))
STAND = dict(zip(JOINTS, (0.0, 0.8, -1.6) * 4))
"""rad."""

HEIGHT = 0.2987
"""Height of the standing trunk: two parts of 0.2 m at 0.8 rad, and a foot of 0.02 m."""

FRICTION = 0.8
GROUND = "ground"


def urdf() -> Path:
    """Its description."""
    return Path(data.getDataPath()) / "a1" / "a1.urdf"


def standing(sim: Simulation) -> Robot:
    """Loads it into a paused world, on a plane, and lets it stand for a second."""
    sim.add_plane(name=GROUND, friction=FRICTION)
    robot = sim.load(
        urdf(), "a1", fixed=False, position=(0, 0, HEIGHT), joint_positions=STAND, surfaces=Surface(friction=FRICTION)
    )
    sim.step(round(1.0 / sim.physics.time_step))
    return robot
