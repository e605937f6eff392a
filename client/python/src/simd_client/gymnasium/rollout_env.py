"""A vector environment for learners, on rollouts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from simd_client.blocking.robot import Robot
from simd_client.blocking.simulation import Simulation
from simd_client.geometry import FloatArray
from simd_client.layout import ONE_AXIS
from simd_client.rollout import Control, Cost, Mode, Observation, Start, Variation
from simd_client.rollout_answer import Rollout
from simd_client.world import SavedState


BoolArray = npt.NDArray[np.bool_]
"""Boolean array."""


class RolloutEnv(VectorEnv[FloatArray, FloatArray, npt.NDArray[Any]]):
    """Environments that are copies of one world; the world itself is none of them. An action holds for
    `steps` steps of the actuators. An observation has the robot's joint positions and velocities, a free
    root's pose and twist, and the readings of `observe`.

    Each step is one rollout, from the final positions and velocities of the copies. No other state is kept:
    contacts begin each action with new impulses. Environments are reset by the step after they ended
    (`AutoresetMode.NEXT_STEP`). A copy with a state that is not finite is terminated, with the reward
    `failure`.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        sim: Simulation,
        robot: Robot,
        *,
        copies: int,
        joints: Sequence[str] = (),
        mode: Mode = "effort",
        limit: npt.ArrayLike = 1.0,
        steps: int = 10,
        episode: int = 200,
        observe: Sequence[Observation] = (),
        costs: Sequence[Cost] = (),
        reward: Callable[[FloatArray, FloatArray], npt.ArrayLike] | None = None,
        is_over: Callable[[FloatArray], npt.ArrayLike] | None = None,
        spread: float = 0.0,
        variations: Sequence[Variation] = (),
        failure: float = -1000.0,
        saved_state: str | SavedState = "",
    ) -> None:
        """`joints` are driven by actions, by default all; `limit` bounds actions, for all joints or for each.
        An episode is truncated after `episode` actions.

        The reward of an action is `reward(observations, actions)`, or by default its negative cost: the sum
        of `costs` over its steps. `is_over(observations)` selects the terminated environments. A reset puts
        joints to their positions in the world, or in a saved state. It adds normal deviates with the standard
        deviation `spread` to positions and velocities. `variations` are the differences between environments:
        masses, friction, damping, gains. Random ones are drawn again at each reset of all environments, and
        hold until the next one. Each action begins with them, so they cannot be positions and velocities: see
        `spread`.

        Raises `ValueError` for a variation of positions or velocities.
        """
        for variation in variations:
            if variation.of in ("joint_positions", "joint_velocities"):
                raise ValueError(
                    f"a variation of {variation.of} would be added at each action: `spread` is of where episodes begin"
                )
        self._sim = sim
        self._robot = robot
        self._mode: Mode = mode
        self._steps = steps
        self._episode = episode
        self._costs = tuple(costs)
        self._reward = reward
        self._is_over = is_over
        self._spread = spread
        self._variations = tuple(variations)
        # Source of random variations.
        self._draw = 0
        # Separate source for each environment with a separate seed.
        self._sources: list[np.random.Generator] = []
        self._failure = failure
        self._saved_state = saved_state
        layout = sim.layout(robot.name)
        single = [each for each in layout.joints if each.type in ONE_AXIS and each.mimic is None]
        self._names = [each.name for each in single]
        self._driven = list(joints) or self._names
        self._is_free = not robot.info().is_fixed
        self._observe = [
            Observation("joint_positions", robot, self._names),
            Observation("joint_velocities", robot, self._names),
            *([Observation("root_pose", robot), Observation("root_twist", robot)] if self._is_free else []),
            *observe,
        ]
        self._limit = np.broadcast_to(np.asarray(limit, dtype=np.float64), (len(self._driven),)).copy()
        # Values of each part of a state at a reset, a row for each copy.
        first = sim.rollout(1, copies=1, observe=self._observe, record_start=True, saved_state=saved_state)
        parts = first.observations[: self._state_parts]
        self._begin = [np.repeat(part[:, 0], copies, axis=0) for part in parts]
        self._state = [part.copy() for part in self._begin]
        self._age = np.zeros(copies, dtype=np.int64)
        self._done = np.zeros(copies, dtype=np.bool_)
        self.num_envs = copies
        size = sum(part[0, 0].size for part in first.observations)
        self.single_observation_space = Box(-np.inf, np.inf, (size,), np.float64)
        self.single_action_space = Box(-self._limit, self._limit, dtype=np.float64)
        self.observation_space = batch_space(self.single_observation_space, copies)
        self.action_space = batch_space(self.single_action_space, copies)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Resets all environments, or those of `options["reset_mask"]`. Returns the observations.

        `seed` is one for all of them, or one for each. With a seed for each, an environment's start depends
        only on its seed, and is drawn without a seed for `None`. The draws of `variations` depend on all of
        them. Raises `ValueError` if the number of seeds differs from the number of environments.
        """
        mask = (options or {}).get("reset_mask")
        if seed is None or isinstance(seed, (int, np.integer)):
            super().reset(seed=None if seed is None else int(seed))
            if seed is not None:
                self._sources = []
        else:
            seeds = list(seed)
            if len(seeds) != self.num_envs:
                raise ValueError(f"there are {len(seeds)} seeds for {self.num_envs} environments")
            sources = [np.random.default_rng(each) for each in seeds]
            # Environments that continue keep their sources.
            if mask is not None and self._sources:
                sources = [new if put_back else old for new, old, put_back in zip(sources, self._sources, mask)]
            self._sources = sources
            known = [each for each in seeds if each is not None]
            self.np_random = np.random.default_rng(known or None)
        if mask is None:
            self._draw = int(self.np_random.integers(2**63)) if self._variations else 0
        self._put_back(np.full(self.num_envs, True) if mask is None else np.asarray(mask, dtype=np.bool_))
        return self._rows(self._roll(1, ()), 0), {}

    def step(
        self, actions: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Applies an action in each environment. Environments that ended with the last one are reset instead,
        with a reward of 0."""
        again = self._done.copy()
        self._put_back(again)
        bounded = np.clip(np.asarray(actions, dtype=np.float64), -self._limit, self._limit)
        control = Control(self._robot, bounded[:, None, :], self._driven, self._mode)
        found = self._roll(self._steps, (control,))
        failed = found.steps_done < self._steps
        # Environments that were reset, or have no state any more, get their initial state.
        stays = again | failed
        observations = np.where(stays[:, None], self._rows(found, 0), self._rows(found, -1))
        for index, part in enumerate(found.observations[: self._state_parts]):
            self._state[index] = np.where(stays[:, None], part[:, 0], part[:, -1])
        self._age[~again] += 1
        over = np.zeros(self.num_envs, dtype=np.bool_)
        if self._is_over is not None:
            over = np.asarray(self._is_over(observations), dtype=np.bool_)
        terminated = (failed | over) & ~again
        truncated = (self._age >= self._episode) & ~terminated & ~again
        if self._reward is None:
            rewards = -found.costs
        else:
            rewards = np.asarray(self._reward(observations, bounded), dtype=np.float64)
        rewards = np.where(again, 0.0, np.where(failed, self._failure, rewards))
        self._done = terminated | truncated
        return observations, rewards, terminated, truncated, {}

    @property
    def _state_parts(self) -> int:
        """Returns how many numbers of an observation are the state."""
        return 4 if self._is_free else 2

    def _put_back(self, which: BoolArray) -> None:
        """Puts environments to the start of an episode."""
        for index, begin in enumerate(self._begin):
            begins = begin.copy()
            if index < 2 and self._spread > 0.0:
                begins += self._deviates(which, begin.shape)
            self._state[index] = np.where(which[:, None], begins, self._state[index])
        self._age[which] = 0
        self._done[which] = False

    def _deviates(self, which: BoolArray, shape: tuple[int, ...]) -> FloatArray:
        """Returns normal deviates for environments that are reset, a row for each."""
        if not self._sources:
            return self.np_random.normal(0.0, self._spread, shape)
        deviates = np.zeros(shape)
        for index, source in enumerate(self._sources):
            if which[index]:
                deviates[index] = source.normal(0.0, self._spread, shape[1:])
        return deviates

    def _roll(self, steps: int, controls: Sequence[Control]) -> Rollout:
        """Makes `steps` steps from the current state of the copies."""
        positions, velocities, *root = self._state
        start = Start(
            self._robot,
            positions,
            velocities,
            self._names,
            roots=root[0] if root else None,
            root_twists=root[1] if root else None,
        )
        return self._sim.rollout(
            steps,
            controls,
            copies=self.num_envs,
            starts=[start],
            variations=self._variations,
            seed=self._draw,
            observe=self._observe,
            record_start=True,
            costs=self._costs,
            saved_state=self._saved_state,
        )

    def _rows(self, found: Rollout, row: int) -> FloatArray:
        """Returns all observations of one moment, a row for each environment."""
        parts = [part[:, row].reshape(self.num_envs, -1) for part in found.observations]
        return np.concatenate(parts, axis=1)
