"""Environment-steps a second: `RolloutEnv` in this process or over Zenoh, compared with the same environment in MuJoCo.

    python benches/learning_env.py [--robot cart_pole|a1] [--environments 64] [--turns 300] [--embedded]

MuJoCo is used through gymnasium. cart_pole: an action is a force for four steps of 5 ms; environments with a
fallen pole are reset. a1: an action is targets of twelve joints, around A1's standing posture, for ten steps
of 2 ms; gymnasium's environment is `Ant-v5` with A1's model. MuJoCo also has a process for each processor, with its part of
the environments, which do not wait for each other. Actions are drawn again for each turn, and kinds
alternate. Needs `gymnasium[mujoco]` and `pybullet_data`; SIMD_BINARY selects the daemon.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import a1
import mujoco_models
import numpy as np
from mujoco_models import mujoco

import simd_client
from simd_client import Simulation
from simd_client.geometry import FloatArray
from simd_client.gymnasium import RolloutEnv

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from daemon import Daemon

# It has no types for this.
gymnasium: Any = importlib.import_module("gymnasium")

Draw = Callable[[np.random.Generator, int], FloatArray]
"""Draws actions for this many environments."""

ROUNDS = 5
LARGER = 16  # Factor of simd's environments in its second row
MODES = ("sync", "async")
PROCESSES = len(os.sched_getaffinity(0))
FORCE = 20.0
ROBOT = Path(__file__).parents[1] / "examples" / "robots" / "cart_pole.urdf"
# Same masses, inertias, limits and damping as in the URDF.
IN_MUJOCO = """<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody>
<body name="cart"><inertial pos="0 0 0" mass="1" diaginertia=".004 .004 .004"/>
<joint name="slide" type="slide" axis="1 0 0" range="-1.8 1.8" limited="true" damping=".1"/>
<body name="pole" pos="0 .08 0"><inertial pos="0 0 .4" mass=".2" diaginertia=".011 .011 .0001"/>
<joint name="pole" type="hinge" axis="0 1 0" damping=".002"/></body></body></worldbody>
<actuator><motor joint="slide" ctrllimited="true" ctrlrange="-20 20"/></actuator></mujoco>"""


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--robot", choices=("cart_pole", "a1"), default="cart_pole")
    parser.add_argument("--environments", type=int, default=64)
    parser.add_argument("--turns", type=int, default=300)
    parser.add_argument("--embedded", action="store_true", help="simd in this process: needs the wheel simd-embedded")
    asked = parser.parse_args()
    with ExitStack() as opened:
        file = Path(opened.enter_context(tempfile.TemporaryDirectory())) / "model.xml"
        if asked.embedded:
            sim = simd_client.connect("embedded", config={"paused": True})
        else:
            sim = simd_client.connect(opened.enter_context(Daemon("--paused")).endpoint)
        opened.enter_context(sim)
        make = quadrupeds if asked.robot == "a1" else poles
        kinds, draw = make(sim, asked.environments, file)
        throughputs: dict[str, list[float]] = {name: [] for name in kinds}
        for _ in range(ROUNDS):
            for name, envs in kinds.items():
                throughputs[name].append(throughput(envs, draw, asked.turns // ROUNDS))
        for envs in kinds.values():
            envs.close()
    print(f"{asked.robot}, {len(os.sched_getaffinity(0))} processors")
    print(f"{'environment-steps a second':40}{'median':>10}{'highest':>10}")
    for name, of in throughputs.items():
        print(f"{name:40}{statistics.median(of):10.0f}{max(of):10.0f}")


def poles(sim: Simulation, count: int, file: Path) -> tuple[dict[str, Any], Draw]:
    """A pole on a cart, of each kind, with a source of actions."""
    sim.set_physics(time_step=0.005)
    cart = sim.load(ROBOT, "cart_pole", fixed=True, passive=True)
    file.write_text(IN_MUJOCO)
    kinds: dict[str, Any] = {
        f"simd, {copies} environments": RolloutEnv(
            sim, cart, copies=copies, joints=["slide"], limit=FORCE, steps=4, spread=0.01,
            is_over=lambda seen: np.abs(seen[:, 1]) > 0.2,
            reward=lambda seen, actions: np.ones(len(seen)),
        )
        for copies in (count, LARGER * count)
    }  # fmt: skip
    settings = {"id": "InvertedPendulum-v5", "xml_file": str(file), "frame_skip": 4}
    for mode in MODES:
        kinds[f"MuJoCo, {count} environments, {mode}"] = gymnasium.make_vec(
            num_envs=count, vectorization_mode=mode, **settings
        )
    kinds[f"MuJoCo, {count} environments, {PROCESSES} processes"] = Processes(count, settings)
    return kinds, lambda random, copies: random.uniform(-FORCE, FORCE, (copies, 1))


def quadrupeds(sim: Simulation, count: int, file: Path) -> tuple[dict[str, Any], Draw]:
    """A1 on the ground, of each kind, with a source of actions."""
    time_step = 0.002
    sim.set_physics(time_step=time_step)
    robot = a1.standing(sim)
    names = robot.joint_names
    root = 2 * len(names)  # Index of the root's pose in an observation; its twist is seven numbers further
    file.write_text(mujoco_models.standing(robot, a1.urdf(), a1.HEIGHT, a1.FRICTION, time_step))
    kinds: dict[str, Any] = {
        f"simd, {copies} environments": RolloutEnv(
            sim, robot, copies=copies, mode="position", limit=3.0, steps=10, episode=1000, spread=0.01,
            is_over=lambda seen: seen[:, root + 2] < 0.15,
            reward=lambda seen, actions: seen[:, root + 7],
        )
        for copies in (count, LARGER * count)
    }  # fmt: skip
    begin = mujoco_models.posed(mujoco.MjModel.from_xml_path(str(file)), a1.STAND)
    settings: dict[str, Any] = {
        "id": "Ant-v5", "xml_file": str(file), "frame_skip": 10, "healthy_z_range": (0.15, 1.0), "reset_noise_scale": 0.01,
        "ctrl_cost_weight": 0.0, "contact_cost_weight": 0.0, "healthy_reward": 0.0,
        "include_cfrc_ext_in_observation": False, "exclude_current_positions_from_observation": False,
    }  # fmt: skip
    for mode in MODES:
        envs = gymnasium.make_vec(num_envs=count, vectorization_mode=mode, **settings)
        envs.set_attr("init_qpos", begin)
        kinds[f"MuJoCo, {count} environments, {mode}"] = envs
    kinds[f"MuJoCo, {count} environments, {PROCESSES} processes"] = Processes(count, settings, begin)
    pose = np.array([a1.STAND[name] for name in names])
    return kinds, lambda random, copies: pose + random.uniform(-0.1, 0.1, (copies, len(names)))


class Processes:
    """Environments of MuJoCo in some processes, each of which steps its part one after the other."""

    def __init__(self, count: int, settings: dict[str, Any], begin: Any = None) -> None:
        self.num_envs = count
        self.workers: list[Any] = []
        spawn = multiprocessing.get_context("spawn")
        for part in np.array_split(np.arange(count), PROCESSES):
            ours, theirs = spawn.Pipe()
            process = spawn.Process(target=serve, args=(theirs, len(part), settings, begin), daemon=True)
            process.start()
            self.workers.append((process, ours, part))

    def reset(self, seed: int) -> None:
        """Resets all of them."""
        self._each(lambda part: ("reset", seed))

    def turns(self, actions: list[FloatArray]) -> None:
        """Makes all turns: a process does not wait for the others between two of them."""
        self._each(lambda part: ("turns", [each[part] for each in actions]))

    def close(self) -> None:
        """Ends the processes."""
        self._each(lambda part: ("close", None))

    def _each(self, request: Callable[[Any], Any]) -> None:
        for _, pipe, part in self.workers:
            pipe.send(request(part))
        for _, pipe, _ in self.workers:
            pipe.recv()


def serve(pipe: Any, count: int, settings: dict[str, Any], begin: Any) -> None:
    """Steps a part of the environments, in a process."""
    envs = gymnasium.make_vec(num_envs=count, vectorization_mode="sync", **settings)
    if begin is not None:
        envs.set_attr("init_qpos", begin)
    kind = ""
    while kind != "close":
        kind, what = pipe.recv()
        if kind == "reset":
            envs.reset(seed=what)
        for actions in what if kind == "turns" else ():
            envs.step(actions)
        pipe.send(None)


def throughput(envs: Any, draw: Draw, turns: int) -> float:
    """Returns environment-steps a second, of all environments together."""
    random = np.random.default_rng(1)
    envs.reset(seed=1)
    actions = [draw(random, envs.num_envs) for _ in range(turns)]
    begin = time.perf_counter()
    if isinstance(envs, Processes):
        envs.turns(actions)
    else:
        for each in actions:
            envs.step(each)
    return envs.num_envs * turns / (time.perf_counter() - begin)


if __name__ == "__main__":
    main()
