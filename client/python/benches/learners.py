"""Results of learners by generation and seed: a pole on a cart, and A1 that learns to walk.

    python benches/learners.py [--pole 25] [--walk 60] [--seeds 1 2 3] [--out target/rollouts/learners.png]

The pole is `examples/learning.py`, A1 `walking_a1.py`. The options are numbers of generations; 0 leaves one
out. Draws the curves, and prints the results of the learned policies. Needs gymnasium for the pole and
`pybullet_data` for A1; SIMD_BINARY selects the daemon.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from plotting import TARGET, save, subplots

import simd_client
from simd_client import Simulation
from simd_client.geometry import FloatArray

sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in ("tests", "examples")]
from daemon import Daemon

SHOWN = 1000  # seed of the trials after learning, which no learner has


def main() -> None:
    """Prints a line for each generation and for the learned policies, and draws."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pole", type=int, default=25)
    parser.add_argument("--walk", type=int, default=60)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--out", type=Path, default=TARGET / "learners.png")
    asked = parser.parse_args()
    learners = [(learn, count) for learn, count in ((poles, asked.pole), (walks, asked.walk)) if count]
    seeds = ", ".join(str(seed) for seed in asked.seeds)
    processors = len(os.sched_getaffinity(0))
    figure, axes = subplots(max(len(learners), 1), f"seeds {seeds}; line: mean of 64, band: from the least to the best")
    print(f"{processors} processors")
    for (learn, count), axis in zip(learners, axes):
        with Daemon("--paused") as daemon, simd_client.connect(daemon.endpoint) as sim:
            learn(sim, count, asked.seeds, axis)
    save(figure, asked.out)


def poles(sim: Simulation, count: int, seeds: list[int], axis: Any) -> None:
    """The pole on a cart."""
    import learning

    sim.set_physics(time_step=0.005)
    cart = sim.load(learning.ROBOT, "cart_pole", fixed=True, passive=True)
    envs = learning.environments(sim, cart)
    for seed in seeds:
        begin = time.perf_counter()
        policy, got = learning.learn(envs, count, seed)
        took = time.perf_counter() - begin
        kept = learning.upright(envs, policy)
        print(f"pole, seed {seed}: {took:.1f} s; the policy keeps the pole upright in {kept} of {learning.COPIES} episodes")
        curve(axis, got, seed)
    axis.set(title="pole on a cart, cross-entropy method", xlabel="generation", ylabel=f"reward of {learning.ACTIONS}")
    axis.legend()


def walks(sim: Simulation, count: int, seeds: list[int], axis: Any) -> None:
    """A1."""
    import a1
    import walking_a1

    sim.set_physics(time_step=walking_a1.TIME_STEP)
    robot = a1.standing(sim)
    start = sim.save_state("standing")
    seconds = walking_a1.STEPS * walking_a1.TIME_STEP
    for seed in seeds:
        sim.restore_state(start)
        learned = walking_a1.learn(sim, robot, count, seed)
        each_second = learned.scores.size * walking_a1.STEPS / learned.seconds
        print(f"A1, seed {seed}: {learned.seconds:.1f} s, {each_second:,.0f} robot-steps a second")
        again = np.tile(learned.gait, (walking_a1.COPIES, 1))
        shown = walking_a1.judged(walking_a1.tried(sim, robot, again, SHOWN))
        least, middle, most = np.percentile(shown.distances, [0, 50, 100])
        stay = int((shown.upright == 1.0).sum())
        print(f"A1, seed {seed}: with other masses and friction {stay} of {len(again)} stay up for {seconds:g} s, "
              f"and get {middle:.2f} m far ({least:.2f} to {most:.2f})")  # fmt: skip
        moved, same = walking_a1.walk(sim, robot, learned.gait)
        print(f"A1, seed {seed}: in the world it walks {moved[0]:.2f} m, and {moved[1]:.2f} m aside; as its copy, to the bit: {same}")
        print(f"A1, seed {seed}: the gait is {np.round(learned.gait, 3).tolist()}", flush=True)
        curve(axis, learned.distances, seed)
    axis.set(title="A1, evolution strategy", xlabel="generation", ylabel=f"metres forward in {seconds:g} s")
    axis.legend()


def curve(axis: Any, got: FloatArray, seed: int) -> None:
    """Draws the mean of each generation, and its range."""
    generations = np.arange(len(got))
    (line,) = axis.plot(generations, got.mean(axis=1), marker=".", label=f"seed {seed}")
    axis.fill_between(generations, got.min(axis=1), got.max(axis=1), color=line.get_color(), alpha=0.12)


if __name__ == "__main__":
    main()
