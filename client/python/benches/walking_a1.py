"""A1 learns to trot, by an evolution strategy: Ros and Hansen's separable one (2008) with only its rank-mu
update.

A gait is 16 numbers, all zero for standing. It has Fourier coefficients of the joints of a leg over its
stride, offsets of the posture, and a frequency. The stride is the same for all legs, the diagonal ones
together. Each copy has a gait for four seconds, drawn masses of its links and a drawn friction of the ground.
The copies of a generation are one rollout.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import a1
import numpy as np

from simd_client import Control, Cost, Observation, Robot, Rollout, Simulation, Variation
from simd_client.geometry import FloatArray

COPIES, BEST = 64, 16
TIME_STEP, KNOT_STEPS, KNOTS = 0.002, 5, 400  # targets each 10 ms, for four seconds
STEPS = KNOT_STEPS * KNOTS
RAMP = 0.5  # Seconds over which the gait begins

FREQUENCY = 2.0  # Standard deviations of the first generation: frequency; sine and cosine of the upper part, once and twice a stride, and of the lower part. Then sine and cosine of the hip; offsets of upper part, lower part and hip, and of upper and lower part in front.
DEVIATIONS = np.array([0.2, *(0.15, 0.15, 0.06, 0.06), *(0.2, 0.2, 0.1, 0.1), *(0.05, 0.05), *(0.1, 0.1, 0.05, 0.1, 0.1)])
"""Standard deviations of the first generation. The order is: frequency; sine and cosine of the upper part,
once and twice a stride, then of the lower part. Sine and cosine of the hip follow, then offsets of upper
part, lower part and hip, and of upper and lower part in front."""
SIZE = len(DEVIATIONS)
LEARNING = 0.3  # of the variances, each generation

PHASES = np.array([np.pi, 0.0, 0.0, np.pi])
SIDES = np.array([-1.0, 1.0, -1.0, 1.0])
FRONTS = np.array([1.0, 1.0, -1.0, -1.0])
"""Phases, sides and fronts of `a1.LEGS`."""


@dataclass(frozen=True)
class Walk:
    """Results of gaits, a number for each copy."""

    scores: FloatArray
    distances: FloatArray
    """Metres forward, until the fall or the end."""
    upright: FloatArray
    """Fraction of the time before the fall."""


@dataclass(frozen=True)
class Learned:
    """A gait, and its history."""

    gait: FloatArray
    scores: FloatArray
    """(generations, copies)."""
    distances: FloatArray
    """(generations, copies), metres."""
    seconds: float


def targets(gaits: FloatArray) -> FloatArray:
    """(copies, knots, joints), rad, in the order of `a1.JOINTS`."""
    times = KNOT_STEPS * TIME_STEP * np.arange(KNOTS)
    frequencies = FREQUENCY * np.exp(np.clip(gaits[:, 0], -1.0, 0.7))
    # (copies, knots, legs)
    phases = 2.0 * np.pi * frequencies[:, None, None] * times[:, None] + PHASES
    once, twice = [np.sin(phases), np.cos(phases)], [np.sin(2.0 * phases), np.cos(2.0 * phases)]
    waves = np.stack(once + twice, axis=-1)
    number = gaits[:, :, None, None]
    upper = np.einsum("cklw,cw->ckl", waves, gaits[:, 1:5]) + number[:, 11] + FRONTS * number[:, 14]
    lower = np.einsum("cklw,cw->ckl", waves, gaits[:, 5:9]) + number[:, 12] + FRONTS * number[:, 15]
    hip = SIDES * (np.einsum("cklw,cw->ckl", waves[..., :2], gaits[:, 9:11]) + number[:, 13])
    sets_in = np.minimum(times / RAMP, 1.0)[:, None, None]
    stand = np.array([a1.STAND[name] for name in a1.JOINTS])
    added = sets_in * np.stack([hip, upper, lower], axis=-1)
    return stand + added.reshape(len(gaits), KNOTS, len(stand))


def tried(sim: Simulation, robot: Robot, gaits: FloatArray, seed: int, varied: bool = True) -> Rollout:
    """Makes each copy walk by its gait."""
    variations = [
        Variation("link_masses", robot, uniform=(0.9, 1.1)),
        Variation("surface_friction", a1.GROUND, uniform=(0.7, 1.0)),
    ]
    return sim.rollout(
        STEPS,
        [Control(robot, targets(gaits), a1.JOINTS, "position", knot_steps=KNOT_STEPS)],
        variations=variations if varied else [],
        observe=[Observation("root_pose", robot)],
        record_steps=2 * KNOT_STEPS,
        record_start=True,
        costs=[Cost.joint_efforts(robot, weight=1.0 / STEPS)],
        seed=seed,
    )


def judged(found: Rollout) -> Walk:
    """Rewards forward motion and staying up; penalises sideways motion, turning and much effort."""
    poses = found.observations[0]
    x, y, z = np.moveaxis(poses[..., 3:6], -1, 0)
    # A state that is not finite counts as a fall.
    stands = (poses[..., 2] > 0.18) & (1.0 - 2.0 * (x**2 + y**2) > 0.7)
    stands = np.logical_and.accumulate(stands, axis=1)
    counts = stands.sum(axis=1)
    copies, last = np.arange(len(poses)), np.maximum(counts - 1, 0)
    moved = poses[copies, last, :3] - poses[copies, 0, :3]
    turned = (2.0 * (y**2 + z**2))[copies, last]
    upright = counts / stands.shape[1]
    # N^2 m^2, the mean over the steps.
    efforts = np.minimum(found.costs, 1e4)
    scores = moved[:, 0] - 0.5 * np.abs(moved[:, 1]) - 0.5 * turned - (1.0 - upright) - 1e-4 * efforts
    return Walk(scores, moved[:, 0], upright)


def learn(sim: Simulation, robot: Robot, generations: int, seed: int) -> Learned:
    """Prints a line for each generation."""
    random = np.random.default_rng(seed)
    weights = np.log(BEST + 0.5) - np.log(np.arange(1, BEST + 1))
    weights /= weights.sum()
    mean, variances = np.zeros(SIZE), DEVIATIONS**2
    scores, distances = list[FloatArray](), list[FloatArray]()
    begin = time.perf_counter()
    for generation in range(generations):
        gaits = mean + np.sqrt(variances) * random.normal(size=(COPIES, SIZE))
        done = judged(tried(sim, robot, gaits, 1_000 * seed + generation))
        steps = gaits[done.scores.argsort()[::-1][:BEST]] - mean
        # Variances are of steps from the previous mean, so that they grow when the mean moves.
        variances = (1.0 - LEARNING) * variances + LEARNING * (weights @ steps**2)
        mean = mean + weights @ steps
        scores.append(done.scores)
        distances.append(done.distances)
        print(
            f"generation {generation:2}: score {done.scores.mean():5.2f}, best {done.scores.max():5.2f}; "
            f"{np.median(done.distances):5.2f} m, {(done.upright == 1.0).sum():2} of {COPIES} stay up",
            flush=True,
        )
    return Learned(mean, np.array(scores), np.array(distances), time.perf_counter() - begin)


def walk(sim: Simulation, robot: Robot, gait: FloatArray) -> tuple[FloatArray, bool]:
    """Walks in the world itself. Returns the distance x y z, and whether a copy had ended at the same place,
    to the bit."""
    begin = robot.pose.position
    copied = tried(sim, robot, gait[None], 0, varied=False).observations[0][0, -1]
    for knot in targets(gait[None])[0].tolist():
        sim.step(KNOT_STEPS, {robot: dict(zip(a1.JOINTS, knot, strict=True))})
    pose = robot.pose
    ended = np.concatenate([pose.position, pose.orientation])
    return pose.position - begin, bool(np.array_equal(ended, copied))
