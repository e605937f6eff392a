"""Learns to keep a pole upright on a cart, by the cross-entropy method (Mannor, Rubinstein and Gat, 2003): thirty lines of numpy.

Each environment is a copy of the world and has a separate policy, a network with one layer. After an episode
the next policies are drawn around the best ones. `RolloutEnv` is a vector environment of gymnasium, which
this needs: `pip install 'gymnasium>=1.1,<2'`.

    python learning.py [--generations 25] [--seed 1]
"""

from __future__ import annotations

import argparse
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import numpy.typing as npt

import simd_client
from simd_client import Robot, Simulation
from simd_client.geometry import FloatArray
from simd_client.gymnasium import RolloutEnv

ROBOT = Path(__file__).parent / "robots" / "cart_pole.urdf"
COPIES, BEST = 64, 12
HIDDEN, ACTIONS = 6, 150  # an action is 4 steps of 5 ms: an episode has three seconds
SIZE = 4 * HIDDEN + HIDDEN  # slide, pole, their velocities; the force
FORCE = 20.0  # newtons


def forces(policies: FloatArray, observations: FloatArray) -> FloatArray:
    """Returns the action of each policy in its environment."""
    inner = policies[:, : 4 * HIDDEN].reshape(-1, HIDDEN, 4)
    outer = policies[:, 4 * HIDDEN :].reshape(-1, 1, HIDDEN)
    seen = np.tanh(np.einsum("chi,ci->ch", inner, observations))
    return FORCE * np.tanh(np.einsum("cah,ch->ca", outer, seen))


def reward(observations: FloatArray, actions: FloatArray) -> FloatArray:
    """Returns at most 1: upright, in the middle, with little force."""
    slide, pole = observations[:, 0], observations[:, 1]
    return np.cos(pole) - 0.1 * slide**2 - 0.1 * (actions[:, 0] / FORCE) ** 2


def is_over(observations: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether the pole has fallen, or the cart is at the end of its rail."""
    return (np.abs(observations[:, 1]) > 0.6) | (np.abs(observations[:, 0]) > 1.7)


def episode(envs: RolloutEnv, policies: FloatArray) -> FloatArray:
    """Returns the sum of the rewards of each policy, until its pole falls."""
    observations, _ = envs.reset()
    sums, goes_on = np.zeros(COPIES), np.ones(COPIES, dtype=bool)
    for _ in range(ACTIONS):
        observations, rewards, terminated, _, _ = envs.step(forces(policies, observations))
        sums += np.where(goes_on, rewards, 0.0)
        goes_on &= ~terminated
        if not goes_on.any():
            break
    return sums


def environments(sim: Simulation, cart: Robot) -> RolloutEnv:
    """One seed for each policy."""
    return RolloutEnv(
        sim, cart, copies=COPIES, joints=["slide"], limit=FORCE, steps=4, episode=ACTIONS, reward=reward,
        is_over=is_over, spread=0.1,
    )  # fmt: skip


def learn(envs: RolloutEnv, generations: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Returns the mean policy, and the result of each policy in each generation: (generations, copies).
    Prints a line for each generation."""
    random = np.random.default_rng(seed)
    mean, deviation = np.zeros(SIZE), np.ones(SIZE)
    envs.reset(seed=seed)
    got: list[FloatArray] = []
    for generation in range(generations):
        policies = mean + deviation * random.normal(size=(COPIES, SIZE))
        sums = episode(envs, policies)
        best = policies[sums.argsort()[-BEST:]]
        # The added term keeps it from settling on the first useful policy.
        mean, deviation = best.mean(axis=0), best.std(axis=0) + 0.5 / (generation + 2)
        print(f"generation {generation:2}: mean {sums.mean():6.1f}, best {sums.max():6.1f} of {ACTIONS}")
        got.append(sums)
    return mean, np.array(got)


def upright(envs: RolloutEnv, policy: FloatArray) -> int:
    """Returns the fraction of episodes in which a policy keeps the pole upright until the end."""
    return int((episode(envs, np.tile(policy, (COPIES, 1))) > 0.9 * ACTIONS).sum())


def main() -> None:
    """Learns, and prints the success of the mean policy."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--generations", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.005)
        cart = sim.load(ROBOT, "learner", fixed=True, passive=True, allow_renaming=True)
        cleanup.callback(cart.delete)
        envs = environments(sim, cart)
        begin = time.perf_counter()
        policy, _ = learn(envs, asked.generations, asked.seed)
        took = time.perf_counter() - begin
        kept = upright(envs, policy)
        print(f"after {took:.0f} s the policy keeps the pole upright in {kept} of {COPIES} episodes")


if __name__ == "__main__":
    main()
