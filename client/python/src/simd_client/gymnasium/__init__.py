"""Environments of gymnasium for robots: needs gymnasium.

    pip install 'gymnasium>=1.1,<2'

    import gymnasium, simd_client.gymnasium
    env = gymnasium.make("simd/CartPole-v0")
    envs = gymnasium.make_vec("simd/CartPole-v0", num_envs=64)

Importing this registers the ids. `RobotEnv` is the environment of any robot, and `RobotVectorEnv` many of them.
"""

from __future__ import annotations

from simd_client import extras

try:
    import gymnasium
except ImportError as missing:
    raise ImportError(f"environments need gymnasium: {extras.GYM}") from missing

from .ids import TASKS
from .robot_env import RobotEnv
from .robot_vector_env import RobotVectorEnv
from .rollout_env import RolloutEnv
from .task import Task

__all__ = ["TASKS", "RobotEnv", "RobotVectorEnv", "RolloutEnv", "Task"]

for _id, _task in TASKS.items():
    gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
        id=_id,
        entry_point="simd_client.gymnasium:RobotEnv",
        vector_entry_point="simd_client.gymnasium:RobotVectorEnv",
        max_episode_steps=_task.max_episode_steps,
        kwargs={"robot": _id},
    )
