"""Rollouts compared with `mujoco.rollout` with as many threads: the seven-joint arm, and A1 standing on the ground.

    python benches/mujoco_rollouts.py [--copies 1024] [--steps 200] [--rounds 15] [--mjx] [--out target/rollouts/mujoco_rollouts.png]

Steps are of 1 ms, with targets of all joints that change every 50 steps, the same numbers in both, in
alternating batches. simd computes in a daemon, on all processors since its world is paused, and each batch is
a call over Zenoh with its answer. MuJoCo computes in this process, on a thread for each processor. A1 stands
on a plane, with targets around its standing posture; the arm touches nothing. With `--mjx` MJX takes a turn
with the arm too: all copies in one program that XLA compiles for the processors, in double precision. The
time of compilation is left out. On two processors 64 copies of 20 steps took it 28 s: ask for few. Needs
`mujoco`, `mujoco-mjx` and `pybullet_data`; SIMD_BINARY selects the daemon.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import a1
import mujoco_models
import numpy as np
from mujoco_models import mujoco
from plotting import TARGET, save, spread, subplots

import simd_client
from simd_client import Control, Observation, Robot, Simulation
from simd_client.geometry import FloatArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from daemon import ASSETS, Daemon

TIME_STEP = 0.001
KNOT = 50  # Steps for which a target holds
ARM = ASSETS / "seven_arm" / "urdf" / "seven_arm.urdf"


@dataclass
class Case:
    """A robot in both, and targets of its joints: (copies, knots, joints)."""

    name: str
    sim: Simulation
    robot: Robot
    values: FloatArray
    steps: int
    pool: Any
    model: Any
    datas: list[Any]
    state: FloatArray
    """MuJoCo's initial state of all copies."""
    went: FloatArray
    """Columns of the state that MuJoCo writes after each step."""
    observe: list[Observation]
    compiled: Any = None
    """Computes the last `qpos` of all copies from targets (copies, steps, joints) by MJX, if it takes
    part."""

    def ours(self) -> tuple[float, FloatArray]:
        """Returns seconds, and the final joints and root: (copies, numbers)."""
        control = Control(self.robot, self.values, knot_steps=KNOT)
        begin = time.perf_counter()
        found = self.sim.rollout(self.steps, [control], observe=self.observe)
        seconds = time.perf_counter() - begin
        return seconds, np.concatenate([each[:, -1] for each in found.observations], axis=1)

    def targets(self) -> FloatArray:
        """Targets of each step: (copies, steps, joints)."""
        return np.repeat(self.values, KNOT, axis=1)[:, : self.steps]

    def by_mjx(self) -> tuple[float, FloatArray]:
        """Returns seconds, and the last `qpos` of each copy."""
        targets = self.targets()
        begin = time.perf_counter()
        found: FloatArray = np.asarray(self.compiled(targets))
        return time.perf_counter() - begin, found

    def theirs(self) -> tuple[float, FloatArray]:
        """Returns seconds, and the last `qpos` of each copy."""
        targets = self.targets()
        states = np.tile(self.state, (len(self.values), 1))
        begin = time.perf_counter()
        self.pool.rollout(self.model, self.datas, states, targets, nstep=self.steps, state=self.went)
        seconds = time.perf_counter() - begin
        # A full state begins with the time, and the positions follow.
        return seconds, self.went[:, -1, 1 : 1 + self.model.nq]


def main() -> None:
    """Prints a table, and draws."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--copies", type=int, default=1024)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--mjx", action="store_true")
    parser.add_argument("--out", type=Path, default=TARGET / "mujoco_rollouts.png")
    asked = parser.parse_args()
    rollout: Any = importlib.import_module("mujoco.rollout")
    threads = len(os.sched_getaffinity(0))
    pool = rollout.Rollout(nthread=threads)
    with Daemon("--paused") as daemon, simd_client.connect(daemon.endpoint) as sim:
        sim.set_physics(time_step=TIME_STEP)
        print(f"{asked.copies} copies, {asked.steps} steps of 1 ms, {threads} threads each; load {os.getloadavg()[0]:.1f}")
        print(f"MuJoCo {mujoco.__version__}; millions of robot-steps a second: median (5 % to 95 %)")
        figure, axes = subplots(2, f"{asked.copies} copies, {asked.steps} steps, {threads} threads each")
        for make, axis in zip((arm, quadruped), axes, strict=True):
            case = make(sim, asked.copies, asked.steps, pool, threads)
            if asked.mjx and make is arm:
                case.compiled = by_mjx(case.model)
            throughputs = measured(case, asked.rounds)
            labels = {"simd": "simd, over Zenoh", "MuJoCo": "mujoco.rollout", "MJX": "MJX"}
            axis.boxplot(list(throughputs.values()))
            axis.set_xticks(range(1, len(throughputs) + 1), [labels[name] for name in throughputs])
            axis.set(title=case.name, ylabel="millions of robot-steps a second", ylim=(0, None))
            sim.reset(time=True, state=True, spawned=True)
    pool.close()
    save(figure, asked.out)


def measured(case: Case, rounds: int) -> dict[str, list[float]]:
    """Runs alternating batches, another one first each time, after a warm-up batch of each."""
    kinds = {"simd": case.ours, "MuJoCo": case.theirs}
    if case.compiled is not None:
        kinds["MJX"] = case.by_mjx
    ends = {name: batch()[1] for name, batch in kinds.items()}
    throughputs: dict[str, list[float]] = {name: [] for name in kinds}
    millions = len(case.values) * case.steps / 1e6
    for turn in range(rounds):
        for name in list(kinds) if turn % 2 else list(reversed(kinds)):
            seconds, _ = kinds[name]()
            throughputs[name].append(millions / seconds)
    ratios = [ours / theirs for ours, theirs in zip(throughputs["simd"], throughputs["MuJoCo"], strict=True)]
    print(f"{case.name:14} simd {spread(throughputs['simd']):>24}   MuJoCo {spread(throughputs['MuJoCo']):>24}   ratio {spread(ratios)}")
    if "MJX" in throughputs:
        times = [ours / theirs for ours, theirs in zip(throughputs["simd"], throughputs["MJX"], strict=True)]
        print(f"{'':14} MJX {spread(throughputs['MJX'])}   ratio {spread(times)}")
    report(case, ends)
    return throughputs


def report(case: Case, ends: dict[str, FloatArray]) -> None:
    """Checks that both did the same work, by distances of joints from their last targets, and heights of a
    free root."""
    names = case.robot.joint_names
    last = case.values[:, (case.steps - 1) // KNOT]
    joints = {"simd": ends["simd"][:, : len(names)], "MuJoCo": ends["MuJoCo"][:, mujoco_models.positions(case.model, names)]}
    lacks = {name: float(np.median(np.abs(at - last))) for name, at in joints.items()}
    difference = float(np.median(np.abs(joints["simd"] - joints["MuJoCo"])))
    print(f"{'':14} joints end {lacks['simd']:.4f} and {lacks['MuJoCo']:.4f} rad from their targets, {difference:.4f} from each other")
    if len(case.observe) > 1:
        for name, heights in (("simd", ends["simd"][:, len(names) + 2]), ("MuJoCo", ends["MuJoCo"][:, 2])):
            print(f"{'':14} in {name} the trunk is at {heights.min():.3f} to {heights.max():.3f} m")


def arm(sim: Simulation, copies: int, steps: int, pool: Any, threads: int) -> Case:
    """Returns the seven-joint arm, fixed, from its zero pose."""
    robot = sim.load(ARM, "arm", fixed=True)
    model = mujoco.MjModel.from_xml_string(mujoco_models.fixed(robot, ARM, TIME_STEP))
    values = np.random.default_rng(1).normal(0.0, 0.3, (copies, -(-steps // KNOT), len(robot.joint_names)))
    observe = [Observation("joint_positions", robot)]
    return case_of("seven_arm", sim, robot, values, steps, pool, model, threads, np.array(model.qpos0), observe, 0.0)


def by_mjx(model: Any) -> Any:
    """Returns the last `qpos` from the model's first one, for targets of all steps of all copies."""
    jax, mjx = importlib.import_module("jax"), importlib.import_module("mujoco.mjx")
    jax.config.update("jax_enable_x64", True)
    compiled = mjx.put_model(model)

    def step(data: Any, control: Any) -> tuple[Any, None]:
        return mjx.step(compiled, data.replace(ctrl=control)), None

    def last(controls: Any) -> Any:
        return jax.lax.scan(step, mjx.make_data(compiled), controls)[0].qpos

    return jax.jit(jax.vmap(last))


def quadruped(sim: Simulation, copies: int, steps: int, pool: Any, threads: int) -> Case:
    """Returns A1, after a second of standing."""
    robot = a1.standing(sim)
    text = mujoco_models.standing(robot, a1.urdf(), a1.HEIGHT, a1.FRICTION, TIME_STEP)
    model = mujoco.MjModel.from_xml_string(text)
    pose = np.array([a1.STAND[name] for name in robot.joint_names])
    values = pose + np.random.default_rng(1).normal(0.0, 0.02, (copies, -(-steps // KNOT), len(pose)))
    observe = [Observation("joint_positions", robot), Observation("root_pose", robot)]
    begin = mujoco_models.posed(model, a1.STAND)
    return case_of("A1 standing", sim, robot, values, steps, pool, model, threads, begin, observe, 1.0)


def case_of(
    name: str, sim: Simulation, robot: Robot, values: FloatArray, steps: int, pool: Any, model: Any, threads: int,
    qpos: FloatArray, observe: list[Observation], settle: float,
) -> Case:  # fmt: skip
    """Returns MuJoCo's state after it held its pose for some seconds."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    data.ctrl[:] = qpos[mujoco_models.positions(model, robot.joint_names)]
    mujoco.mj_step(model, data, nstep=round(settle / TIME_STEP))
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    size: int = mujoco.mj_stateSize(model, kind)
    state = np.zeros(size)
    mujoco.mj_getState(model, data, state, kind)
    datas = [mujoco.MjData(model) for _ in range(threads)]
    went = np.zeros((len(values), steps, len(state)))
    return Case(name, sim, robot, values, steps, pool, model, datas, state, went, observe)


if __name__ == "__main__":
    main()
