"""Many copies of one robot as a vector environment, in a world in this process."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector.utils import batch_space

from simd_client.geometry import FloatArray

from .ids import task_of
from .rollout_env import BoolArray, RolloutEnv
from .task import Task


class RobotVectorEnv(RolloutEnv):
    """The environments of `RobotEnv` as copies of one world, which step on threads and in vectors of the processor.

    Environment i of a reset with the seed s begins as a `RobotEnv` with the seed s + i. Without contacts it has the
    same bits. Impulses of contacts restart with each action. Sensors are not there.
    """

    def __init__(
        self, robot: str | os.PathLike[str] | Task, num_envs: int = 1, *, render_mode: str | None = None, **settings: Any
    ) -> None:
        """`robot` and `settings` are those of `RobotEnv`."""
        if render_mode is not None:
            raise ValueError("a vector environment of copies draws no pictures: make one environment with render_mode")
        self.task = task = task_of(robot, settings)
        self._world = world = task.open()
        self._actions = np.zeros((num_envs, len(world.driven)))
        try:
            super().__init__(
                world.sim,
                world.robot,
                copies=num_envs,
                joints=[each.name for each in world.driven],
                mode=task.mode,
                limit=np.maximum(np.abs(world.low), np.abs(world.high)),
                steps=task.frame_skip,
                episode=task.max_episode_steps,
                reward=self._rewards,
                is_over=task.is_over,
                failure=task.failure,
            )
            self._first = self._begin[0][0].copy()
            size = self._seen(np.concatenate([part[0] for part in self._begin])).size
        except BaseException:
            world.sim.close()
            raise
        self._sources = [np.random.default_rng() for _ in range(num_envs)]
        self.single_observation_space = Box(-np.inf, np.inf, (size,), np.float64)
        self.single_action_space = Box(-1.0, 1.0, (len(world.driven),), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Resets all environments, or those of `options["reset_mask"]`. The seeds of a number are this and the
        following ones."""
        seeds = [int(seed) + index for index in range(self.num_envs)] if isinstance(seed, (int, np.integer)) else seed
        states, info = super().reset(seed=seeds, options=options)
        return self._seen(states), info

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Applies an action in each environment. Environments that ended with the last one are reset instead."""
        self._actions = np.clip(np.asarray(actions, dtype=np.float64), -1.0, 1.0)
        states, rewards, terminated, truncated, info = super().step(self._world.targets(self._actions))
        return self._seen(states), rewards, terminated, truncated, info

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the world."""
        self._world.sim.close()

    def _rewards(self, states: FloatArray, targets: FloatArray) -> npt.ArrayLike:
        return np.zeros(len(states)) if self.task.reward is None else self.task.reward(states, self._actions)

    def _seen(self, states: FloatArray) -> FloatArray:
        return states if self.task.features is None else np.asarray(self.task.features(states), dtype=np.float64)

    def _put_back(self, which: BoolArray) -> None:
        for index, source in enumerate(self._sources):
            if which[index]:
                positions, velocities = self._world.deviations(source, self._first)
                self._begin[0][index], self._begin[1][index] = positions, velocities
        super()._put_back(which)
