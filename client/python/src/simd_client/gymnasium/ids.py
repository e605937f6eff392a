"""Tasks with ids, on robots of this package."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simd_client.geometry import FloatArray
from simd_client.layout import Gains

from .task import Task

_ROBOTS = Path(__file__).parent / "robots"

# Reacher: lengths of its parts. Pusher: the same, with the puck's goal.
_UPPER, _FORE = 0.3, 0.25
_GOAL = np.array([0.3, 0.3])

# Quadruped: hip, thigh and calf of each leg.
_STAND = (0.0, 0.8, -1.6) * 4
_LEGS = ("front_left", "front_right", "back_left", "back_right")
_JOINTS = tuple(f"{leg}_{part}" for leg in _LEGS for part in ("hip", "thigh", "calf"))
# First indices of its root's pose and twist in a state.
_POSE, _TWIST = 24, 31


def _tip(states: FloatArray) -> FloatArray:
    """Returns the place of the arm's tip in its plane."""
    first, both = states[..., 0], states[..., 0] + states[..., 1]
    x, y = _UPPER * np.cos(first) + _FORE * np.cos(both), _UPPER * np.sin(first) + _FORE * np.sin(both)
    return np.stack([x, y], axis=-1)


def _arm_features(states: FloatArray) -> FloatArray:
    """Returns sines and cosines of the joints, velocities, the place of what is sought, and its distance from the
    tip."""
    angles, sought = states[..., :2], states[..., 2:4]
    return np.concatenate([np.cos(angles), np.sin(angles), states[..., 4:], sought, sought - _tip(states)], axis=-1)


def _reach(states: FloatArray, actions: FloatArray) -> FloatArray:
    return -np.linalg.norm(states[..., 2:4] - _tip(states), axis=-1) - 0.02 * np.square(actions).sum(axis=-1)


def _push(states: FloatArray, actions: FloatArray) -> FloatArray:
    puck = states[..., 2:4]
    to_goal, to_puck = np.linalg.norm(puck - _GOAL, axis=-1), np.linalg.norm(puck - _tip(states), axis=-1)
    return -to_goal - 0.3 * to_puck - 0.02 * np.square(actions).sum(axis=-1)


def _upright(states: FloatArray) -> FloatArray:
    """Returns the cosine of the trunk's tilt."""
    x, y = states[..., _POSE + 3], states[..., _POSE + 4]
    return 1.0 - 2.0 * (x**2 + y**2)


def _walk(states: FloatArray, actions: FloatArray) -> FloatArray:
    """Returns at most 1.5 for speed along x, without going aside or turning."""
    forward, aside, turning = states[..., _TWIST], states[..., _TWIST + 1], states[..., _TWIST + 5]
    return np.clip(forward, -1.5, 1.5) - 0.3 * np.abs(aside) - 0.1 * np.abs(turning) - 0.02 * np.square(actions).sum(axis=-1) + 0.3


# An arm in a plane, and what it seeks there.
_ARM = Task(
    _ROBOTS / "reacher.urdf",
    fixed=True,
    joints=("shoulder", "elbow"),
    time_step=0.005,
    frame_skip=4,
    max_episode_steps=100,
    features=_arm_features,
)

TASKS: Mapping[str, Task] = {
    # The reward is 1 for each action that keeps the pole up.
    "simd/CartPole-v0": Task(
        _ROBOTS / "cart_pole.urdf",
        fixed=True,
        joints=("slide",),
        time_step=0.005,
        frame_skip=4,
        max_episode_steps=500,
        spread=0.02,
        camera=((0.0, -3.2, 0.6), (0.0, 0.0, 0.25)),
        reward=lambda states, actions: np.ones(states.shape[:-1]),
        is_over=lambda states: (np.abs(states[..., 1]) > 0.2) | (np.abs(states[..., 0]) > 1.7),
    ),
    # The reward is the negative distance of the tip from a place that differs in each episode.
    "simd/Reacher-v0": replace(
        _ARM,
        spread=0.05,
        ranges={"target_x": (-0.35, 0.35), "target_y": (-0.35, 0.35)},
        reward=_reach,
        camera=((0.0, -0.7, 1.2), (0.0, 0.0, 0.0)),
    ),
    # The reward is the negative distance of the puck from its goal, and a part of the distance of the tip from the puck.
    "simd/Pusher-v0": replace(
        _ARM,
        description=_ROBOTS / "pusher.urdf",
        load={"self_collision": True},
        joint_positions={"shoulder": -0.9, "elbow": 0.6},
        max_episode_steps=150,
        ranges={"puck_x": (0.3, 0.4), "puck_y": (0.0, 0.15)},
        reward=_push,
        camera=((0.25, -0.6, 1.0), (0.25, 0.1, 0.0)),
    ),
    # The reward is the speed along x. An action is positions of the joints around standing.
    "simd/Quadruped-v0": Task(
        _ROBOTS / "quadruped.urdf",
        ground=True,
        position=(0.0, 0.0, 0.2987),
        joint_positions=dict(zip(_JOINTS, _STAND)),
        joints=_JOINTS,
        mode="position",
        gains=Gains(60.0, 2.0),
        low=np.array(_STAND) - 0.4,
        high=np.array(_STAND) + 0.4,
        time_step=0.002,
        frame_skip=10,
        max_episode_steps=500,
        spread=0.02,
        # Its place along the ground does not matter.
        features=lambda states: np.delete(states, (_POSE, _POSE + 1), axis=-1),
        reward=_walk,
        is_over=lambda states: (states[..., _POSE + 2] < 0.17) | (_upright(states) < 0.7),
    ),
}
"""Tasks by the id of their environment."""


def task_of(robot: str | os.PathLike[str] | Task, settings: Mapping[str, Any]) -> Task:
    """Returns a task: of its id, of a description, or with other settings."""
    if isinstance(robot, Task):
        return replace(robot, **settings)
    if isinstance(robot, str) and robot in TASKS:
        return replace(TASKS[robot], **settings)
    return Task(robot, **settings)
