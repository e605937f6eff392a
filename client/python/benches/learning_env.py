"""Environment-steps a second of a pole on a cart: `RolloutEnv` over Zenoh, beside the same in MuJoCo by way of gymnasium.

    python benches/learning_env.py [--environments 64] [--turns 300]

An action is a force for four steps of 5 ms, drawn anew for each turn; environments whose pole fell are reset. Kinds take their places by turns. Needs
`gymnasium[mujoco]`; SIMD_BINARY says which daemon.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import simd_client
from simd_client.gym import RolloutEnv

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from daemon import Daemon

# It has no types for this.
gymnasium: Any = importlib.import_module("gymnasium")

ROUNDS = 5
FORCE = 20.0
ROBOT = Path(__file__).parents[1] / "examples" / "robots" / "cart_pole.urdf"
# The same masses, inertias, limits and damping as the URDF's.
IN_MUJOCO = """<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody>
<body name="cart"><inertial pos="0 0 0" mass="1" diaginertia=".004 .004 .004"/>
<joint name="slide" type="slide" axis="1 0 0" range="-1.8 1.8" limited="true" damping=".1"/>
<body name="pole" pos="0 .08 0"><inertial pos="0 0 .4" mass=".2" diaginertia=".011 .011 .0001"/>
<joint name="pole" type="hinge" axis="0 1 0" damping=".002"/></body></body></worldbody>
<actuator><motor joint="slide" ctrllimited="true" ctrlrange="-20 20"/></actuator></mujoco>"""


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--environments", type=int, default=64)
    parser.add_argument("--turns", type=int, default=300)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, Daemon("--paused") as daemon:
        model = Path(folder) / "cart_pole.xml"
        model.write_text(IN_MUJOCO)
        with simd_client.connect(daemon.endpoint) as sim:
            sim.set_physics(time_step=0.005)
            cart = sim.load(ROBOT, "cart_pole", fixed=True, passive=True)
            kinds: dict[str, Any] = {
                f"simd, {copies} environments": RolloutEnv(
                    sim, cart, copies=copies, joints=["slide"], limit=FORCE, steps=4, spread=0.01,
                    is_over=lambda seen: np.abs(seen[:, 1]) > 0.2,
                    reward=lambda seen, actions: np.ones(len(seen)),
                )
                for copies in (asked.environments, 16 * asked.environments)
            }  # fmt: skip
            for mode in ("sync", "async"):
                kinds[f"MuJoCo, {asked.environments} environments, {mode}"] = gymnasium.make_vec(
                    "InvertedPendulum-v5", asked.environments, vectorization_mode=mode, xml_file=str(model), frame_skip=4
                )
            rates: dict[str, list[float]] = {name: [] for name in kinds}
            for _ in range(ROUNDS):
                for name, envs in kinds.items():
                    rates[name].append(rate(envs, asked.turns // ROUNDS))
            for envs in kinds.values():
                envs.close()
    print(f"{'environment-steps a second':40}{'median':>10}{'highest':>10}")
    for name, of in rates.items():
        print(f"{name:40}{statistics.median(of):10.0f}{max(of):10.0f}")


def rate(envs: Any, turns: int) -> float:
    """Environment-steps a second, of all environments together."""
    random = np.random.default_rng(1)
    envs.reset(seed=1)
    actions = [random.uniform(-FORCE, FORCE, (envs.num_envs, 1)) for _ in range(turns)]
    begin = time.perf_counter()
    for each in actions:
        envs.step(each)
    return envs.num_envs * turns / (time.perf_counter() - begin)


if __name__ == "__main__":
    main()
