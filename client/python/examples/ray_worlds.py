"""Tries controls of an arm in worlds on the nodes of a Ray cluster, and prints the best. It needs Ray, `pip install
'ray>=2.40,<3'`, and the wheel `simd-embedded` on each node.

    ray start --head                     # on one machine
    ray start --address HOST:6379        # on each other one
    python ray_worlds.py [--worlds 4] [--parts 32]

Without a cluster, Ray starts one on this machine.
"""

# The tests of types have no Ray.
# pyright: reportMissingImports=false, reportUnknownMemberType=false

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import ray

import simd_client
from simd_client import Control, Cost, Simulation
from simd_client.geometry import FloatArray
from simd_client.ray import Worlds

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "seven_arm"
GOAL = [0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1]


def arm() -> Simulation:
    """Opens a world with an arm: in the process of an actor, whose node has the file too."""
    sim = simd_client.connect("embedded", config={"paused": True})
    sim.load(ROBOT, "arm", fixed=True)
    return sim


def costs(sim: Simulation, tried: FloatArray) -> FloatArray:
    """Returns the costs of a part of the controls."""
    cost = [Cost.joint_positions("arm", targets=GOAL)]
    return sim.rollout(200, [Control("arm", tried, knot_steps=100)], costs=cost).costs


def main() -> None:
    """Prints the least cost, which does not depend on the number of worlds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--worlds", type=int, default=4)
    parser.add_argument("--parts", type=int, default=32)
    asked = parser.parse_args()
    tried = np.random.default_rng(1).normal(0.3, 0.3, (64 * asked.parts, 3, 7))
    ray.init()
    with Worlds(arm, asked.worlds) as worlds:
        found = np.concatenate(worlds.map(costs, np.split(tried, asked.parts)))
    best = int(found.argmin())
    print(f"{len(found)} tries; the best is number {best} with a cost of {found[best]:.6f}")


if __name__ == "__main__":
    main()
