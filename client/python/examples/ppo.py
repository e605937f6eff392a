"""Learns to balance a pole by proximal policy optimization (Schulman et al., 2017), in numpy. The 128 environments are
copies of a world in this process. Needs gymnasium, `pip install 'gymnasium>=1.1,<2'`, and the wheel `simd-embedded`.

    python ppo.py [--iterations 30] [--seed 1]
"""

from __future__ import annotations

import argparse
import time

import gymnasium
import numpy as np

import simd_client.gymnasium as environments
from simd_client.geometry import FloatArray

ENVIRONMENTS, STEPS, EPOCHS, PARTS = 128, 32, 6, 8
HIDDEN, RATE, DISCOUNT, TRACE, CLIP = 32, 3e-3, 0.99, 0.95, 0.2
SCALE = np.array([1.0, 5.0, 1.0, 1.0])  # of slide, pole, and their velocities


class Network:
    """One hidden layer, and Adam (Kingma and Ba, 2015)."""

    def __init__(self, random: np.random.Generator, inputs: int, outputs: int, last: float) -> None:
        self.weights = [
            random.normal(0.0, 1.0 / np.sqrt(inputs), (inputs, HIDDEN)),
            np.zeros(HIDDEN),
            random.normal(0.0, last / np.sqrt(HIDDEN), (HIDDEN, outputs)),
            np.zeros(outputs),
        ]
        self.means = [np.zeros_like(each) for each in self.weights]
        self.squares = [np.zeros_like(each) for each in self.weights]
        self.count = 0

    def __call__(self, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns the outputs, and the hidden layer."""
        inner = np.tanh(seen @ self.weights[0] + self.weights[1])
        return inner @ self.weights[2] + self.weights[3], inner

    def learn(self, seen: FloatArray, inner: FloatArray, slopes: FloatArray) -> None:
        """Goes one step against the slopes of a loss by the outputs."""
        back = (slopes @ self.weights[2].T) * (1.0 - inner**2)
        self.count += 1
        for index, slope in enumerate((seen.T @ back, back.sum(axis=0), inner.T @ slopes, slopes.sum(axis=0))):
            self.means[index] += 0.1 * (slope - self.means[index])
            self.squares[index] += 0.001 * (slope**2 - self.squares[index])
            mean = self.means[index] / (1.0 - 0.9**self.count)
            square = self.squares[index] / (1.0 - 0.999**self.count)
            self.weights[index] -= RATE * mean / (np.sqrt(square) + 1e-8)


def learn(envs: environments.RobotVectorEnv, iterations: int, seed: int) -> Network:
    """Returns the policy's mean. Prints a line for each iteration."""
    random = np.random.default_rng(seed)
    policy, value = Network(random, 4, 1, 0.01), Network(random, 4, 1, 1.0)
    states, ended = envs.reset(seed=seed)[0] * SCALE, np.zeros(ENVIRONMENTS, dtype=bool)
    running, returns = np.zeros(ENVIRONMENTS), [0.0]
    for iteration in range(iterations):
        deviation = 0.6 * (1.0 - iteration / iterations) + 0.2
        shape = (STEPS, ENVIRONMENTS)
        seen, drawn = np.zeros((*shape, 4)), np.zeros((*shape, 1))
        rewards, after, over, counts = np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape)
        for step in range(STEPS):
            actions = policy(states)[0] + deviation * random.normal(size=(ENVIRONMENTS, 1))
            seen[step], drawn[step], counts[step] = states, actions, ~ended
            states, rewards[step], terminated, truncated, _ = envs.step(actions)
            states = states * SCALE
            after[step] = np.where(terminated, 0.0, value(states)[0][:, 0])
            ended = terminated | truncated
            over[step] = ended
            running += rewards[step]
            returns += running[ended].tolist()
            running[ended] = 0.0
        before = value(seen)[0][..., 0]
        errors = rewards + DISCOUNT * after - before
        advantages, later = np.zeros(shape), np.zeros(ENVIRONMENTS)
        for step in reversed(range(STEPS)):
            # The step after the end of an episode resets the environment, and does not count.
            later = counts[step] * (errors[step] + DISCOUNT * TRACE * (1.0 - over[step]) * later)
            advantages[step] = later
        rows = np.flatnonzero(counts)
        seen, drawn, advantages, before = seen.reshape(-1, 4), drawn.reshape(-1, 1), advantages.ravel(), before.ravel()
        wanted = advantages + before
        gains = (advantages - advantages[rows].mean()) / (advantages[rows].std() + 1e-8)
        means = policy(seen)[0]
        for _ in range(EPOCHS):
            for part in np.array_split(random.permutation(rows), PARTS):
                found, inner = policy(seen[part])
                away = (drawn[part] - found) / deviation
                ratio = np.exp(0.5 * (((drawn[part] - means[part]) / deviation) ** 2 - away**2))
                gain = gains[part, None]
                goes_on = np.where(gain > 0.0, ratio < 1.0 + CLIP, ratio > 1.0 - CLIP)
                policy.learn(seen[part], inner, np.where(goes_on, -gain * ratio * away / deviation, 0.0) / len(part))
                guess, inner = value(seen[part])
                value.learn(seen[part], inner, (guess - wanted[part, None]) / len(part))
        print(f"iteration {iteration:2}: mean return of the last 50 episodes {np.mean(returns[-50:]):5.0f}", flush=True)
    return policy


def main() -> None:
    """Learns, and prints the return of the policy's mean."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--iterations", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    envs = environments.RobotVectorEnv("simd/CartPole-v0", ENVIRONMENTS)
    begin = time.perf_counter()
    policy = learn(envs, asked.iterations, asked.seed)
    took = time.perf_counter() - begin
    envs.close()
    env = gymnasium.make("simd/CartPole-v0")
    state, total, ended = env.reset(seed=1000)[0], 0.0, False
    while not ended:
        state, reward, terminated, truncated, _ = env.step(policy(state * SCALE)[0])
        total, ended = total + float(reward), terminated or truncated
    env.close()
    print(f"after {took:.0f} s of learning the return is {total:.0f} of 500")


if __name__ == "__main__":
    main()
