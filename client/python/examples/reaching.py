"""Reaches past a post with an arm, by path integral control (Williams et al., "Information theoretic MPC", 2017), in real time.

The world plays in the daemon. Fifty times a second copies of it try changes of the plan, starting from the
arm's predicted state. The program sends the first knot of the new plan: velocities of the joints. The arm
must press against the goal, and not against the post. With --lockstep the world waits for each turn, so that
any machine is fast enough.

    python reaching.py [--starts 20] [--seed 1] [--lockstep]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import simd_client
from simd_client import Control, Cost, Observation, Simulation, Whole
from simd_client.geometry import FloatArray

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "seven_arm"
HAND = "link_7"
COPIES, KNOTS, STEPS = 40, 8, 10  # steps from knot to knot: a plan has 0.8 s
STEP, TURN = 0.01, 0.02  # seconds
FASTEST, DEVIATION = 1.6, 0.8  # rad/s
BEGIN = np.array([-0.6, 1.1, 0.0, -0.9, 0.0, -0.6, 0.0])  # rad
NEAR, SECONDS = 0.04, 8.0  # metres, and within this simulated time
POST, RADIUS = (0.55, 0.0), 0.03  # metres


@dataclass(frozen=True)
class Trial:
    """Result of one start."""

    reached: bool
    """Reached the goal without touching anything on the way."""
    touched: bool
    seconds: float
    """Simulated seconds."""
    calls: list[float]
    """Wall seconds of each rollout."""
    path: FloatArray
    """(turns, 3): positions of the hand."""
    goal: FloatArray
    """Goal x y z."""


def main() -> None:
    """Counts the starts from which the hand reaches the goal, and the arm touches nothing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--lockstep", action="store_true")
    asked = parser.parse_args()
    with simd_client.connect() as sim:
        done = list(trials(sim, asked.starts, asked.seed, asked.lockstep))
    reached, touched = sum(each.reached for each in done), sum(each.touched for each in done)
    took = np.median([each.seconds for each in done])
    calls = [call for each in done for call in each.calls]
    print(f"reached from {reached} of {asked.starts} starts, in {took:.1f} s; {touched} touched something")
    print(f"a call took {1e3 * np.median(calls):.1f} ms, one in twenty more than {1e3 * np.quantile(calls, 0.95):.1f} ms")


def trials(sim: Simulation, starts: int, seed: int, lockstep: bool = False) -> Iterator[Trial]:
    """Reaches from several positions, one after the other, and leaves the world unchanged."""
    random = np.random.default_rng(seed)
    sim.pause()
    # Any end, including Ctrl-C, restores the world.
    with ExitStack() as cleanup:
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        cleanup.callback(sim.pause)
        sim.set_physics(time_step=STEP)
        yield from _trials(sim, starts, random, lockstep, cleanup)


def _trials(
    sim: Simulation, starts: int, random: np.random.Generator, lockstep: bool, cleanup: ExitStack
) -> Iterator[Trial]:
    # The arm stands next to everything that is in the world already.
    aside = np.array([10 + max((robot.pose.position[0] for robot in sim.robots.values()), default=0.0), 0.0, 0.0])
    arm = sim.load(ROBOT, "reaching_arm", fixed=True, allow_renaming=True, position=aside)
    cleanup.callback(arm.delete)
    # The goal is the pose of the hand on the other side.
    arm.reset_joints(BEGIN * [-1, 1, 1, 1, 1, 1, 1])
    goal = arm.link_poses()[HAND]
    post = sim.add_cylinder(RADIUS, 0.5, position=aside + (*POST, 0.25), fixed=True)
    cleanup.callback(post.delete)
    costs = [
        Cost.link_position(arm, HAND, goal.position, final_weight=20.0),
        Cost.link_orientation(arm, HAND, goal.orientation, weight=0.03),
        Cost.nearness(arm, 0.08, link="link_5", other=post, weight=300.0),
        Cost.nearness(arm, 0.08, link=HAND, other=post, weight=300.0),
        Cost.joint_velocities(arm, weight=0.01),
        Cost.joint_efforts(arm, weight=1e-7),
    ]
    # Stamp of the state that the copies start from.
    seen = [Observation("link_poses", arm, [HAND]), Observation("contact_count", arm)]
    for _ in range(starts):
        sim.pause()
        arm.reset_joints(BEGIN + random.normal(0.0, 0.1, 7))
        arm.set_targets(Whole.velocities(np.zeros(7)))
        if not lockstep:
            sim.play()
        plan: FloatArray = np.zeros((KNOTS, 7))
        begin, at = sim.stamp.sim_time, 0.0
        distance, touches = np.inf, 0
        calls, path = list[float](), list[FloatArray]()
        while at < SECONDS and distance > NEAR:
            due = time.monotonic() + TURN
            noise = np.repeat(random.normal(0.0, DEVIATION, (COPIES, KNOTS // 2, 7)), 2, axis=1)
            # Half of them cover the way, and half the last centimetres.
            noise[: COPIES // 2] *= 0.25
            tried = np.clip(plan + noise, -FASTEST, FASTEST)
            control = Control(arm, tried, mode="velocity", knot_steps=STEPS, interpolation="linear")
            asked_at = time.monotonic()
            found = sim.rollout(KNOTS * STEPS, [control], costs=costs, observe=seen, record_start=True)
            calls.append(time.monotonic() - asked_at)
            # A copy that ended early has infinite costs.
            spread = found.costs[np.isfinite(found.costs)].std()
            weights = np.exp((found.costs.min() - found.costs) / (0.05 * spread + 1e-9))
            plan = (weights[:, None, None] * tried).sum(axis=0) / weights.sum()
            arm.stream_targets(Whole.velocities(plan[0]))
            hand, contacts = found.observations
            path.append(hand[0, 0, 0, :3])
            distance = float(np.linalg.norm(path[-1] - goal.position))
            touches += int(contacts[0, 0, 0] > 0)
            if lockstep:
                sim.step(round(TURN / STEP))
            else:
                time.sleep(max(0.0, due - time.monotonic()))
            # By the next turn the plan has aged by the simulated time since.
            passed, at = found.start.sim_time - begin - at, found.start.sim_time - begin
            knots = np.arange(KNOTS) + max(passed, TURN) / (STEP * STEPS)
            plan = np.stack([np.interp(knots, np.arange(KNOTS), plan[:, joint]) for joint in range(7)], axis=1)
        reached = distance <= NEAR and touches == 0
        yield Trial(reached, touches > 0, at, calls, np.array(path), goal.position)


if __name__ == "__main__":
    main()
