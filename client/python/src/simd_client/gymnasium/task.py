"""A robot, its world, and what it learns: the same for one environment and for many."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from simd_client.blocking.connect import connect
from simd_client.blocking.robot import Robot
from simd_client.blocking.simulation import Simulation
from simd_client.geometry import FloatArray
from simd_client.layout import ONE_AXIS, Gains, JointInfo
from simd_client.rollout import Mode

GROUND = "ground"
"""Name of the plane below a robot."""

_UNBOUNDED = {"effort": 1.0, "velocity": 1.0, "position": np.pi}
"""Bounds of actions for joints without limits."""


@dataclass(frozen=True)
class Task:
    """The settings of an environment. Functions get arrays whose last axis is one observation or action, so that they
    serve one environment and many.

    The state has the positions of joints with one axis, then their velocities. For a free robot it also has the pose
    and the twist of its root. A pose is x y z and a quaternion x y z w. A twist is m/s and rad/s in world axes.
    """

    description: str | os.PathLike[str]
    """A URDF, or the folder of a package."""
    fixed: bool = False
    """Whether the base is fixed to the world."""
    ground: bool = False
    """Whether there is a plane below it."""
    position: Sequence[float] = (0.0, 0.0, 0.0)
    """Position of the root at the start, metres."""
    joint_positions: Mapping[str, float] = field(default_factory=dict[str, float])
    """Positions of joints at the start, by name, rad or m."""
    load: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Further arguments of `Simulation.load`."""
    joints: Sequence[str] = ()
    """Joints that actions drive; by default all that take targets."""
    mode: Mode = "effort"
    """Kind of actions: efforts, velocities or positions."""
    low: npt.ArrayLike | None = None
    """Target of an action of -1, for all joints or for each; by default the joint's limit."""
    high: npt.ArrayLike | None = None
    """Target of an action of 1."""
    gains: Gains | None = None
    """Gains of position targets, which act at once, without a profile; by default the joint's."""
    time_step: float = 0.002
    """Seconds of a step."""
    frame_skip: int = 10
    """Steps of an action."""
    max_episode_steps: int = 1000
    """Actions after which an episode is truncated."""
    spread: float = 0.0
    """Standard deviation of positions and velocities of joints at a reset."""
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    """Joints that begin anywhere between two positions."""
    features: Callable[[FloatArray], FloatArray] | None = None
    """The observations of states; by default they are the states."""
    reward: Callable[[FloatArray, FloatArray], npt.ArrayLike] | None = None
    """Rewards, of states after an action and of actions between -1 and 1. By default 0."""
    is_over: Callable[[FloatArray], npt.ArrayLike] | None = None
    """States that end an episode."""
    camera: tuple[Sequence[float], Sequence[float]] | None = None
    """Eye of pictures, and what it looks at, metres; by default they follow the robot."""
    failure: float = -100.0
    """Reward of an action after which the state is not finite."""

    def __post_init__(self) -> None:
        if not self.time_step > 0.0 or self.frame_skip < 1 or self.max_episode_steps < 1:
            raise ValueError(
                f"time_step={self.time_step}, frame_skip={self.frame_skip}, max_episode_steps={self.max_episode_steps}: "
                "each is above 0"
            )

    def open(self) -> World:
        """Opens a world in this process, with the robot. Its integrator is Euler's, whose state is positions and
        velocities only."""
        sim = connect("embedded", config={"paused": True, "physics.time_step": self.time_step, "physics.integrator": "euler"})
        try:
            if self.ground:
                sim.add_plane(name=GROUND)
            settings: dict[str, Any] = {
                "fixed": self.fixed,
                "position": self.position,
                "joint_positions": self.joint_positions,
                "passive": True,
                **self.load,
            }
            robot = sim.load(self.description, "robot", **settings)
            world = World(self, sim, robot)
            if self.mode == "position":
                # A profile would be state that observations do not have.
                names = [each.name for each in world.driven]
                robot.set_joint_properties(*names, default_gains=self.gains, profile=False)
            return world
        except BaseException:
            sim.close()
            raise


class World:
    """The opened world of a task."""

    def __init__(self, task: Task, sim: Simulation, robot: Robot) -> None:
        self.task = task
        self.sim = sim
        self.robot = robot
        layout = sim.layout(robot.name)
        self.single = [each for each in layout.joints if each.type in ONE_AXIS and each.mimic is None]
        known = {each.name: each for each in self.single}
        for name in (*task.joints, *task.ranges):
            if name not in known:
                raise ValueError(f"robot `{robot.name}` has no joint `{name}` of one axis; it has {', '.join(known)}")
        self.driven = [known[name] for name in task.joints] or [each for each in self.single if each.is_actuated]
        if not self.driven:
            raise ValueError("no joint of the robot takes targets, so there are no actions")
        low, high = zip(*(_bounds(each, task.mode) for each in self.driven))
        size = (len(self.driven),)
        self.low = np.broadcast_to(np.asarray(low if task.low is None else task.low, dtype=np.float64), size)
        self.high = np.broadcast_to(np.asarray(high if task.high is None else task.high, dtype=np.float64), size)
        if not (self.low < self.high).all():
            raise ValueError(f"low={self.low} is not below high={self.high}: an action of -1 is `low`, and 1 is `high`")
        if not robot.info().is_fixed and task.fixed:
            raise ValueError("the base of the robot is not fixed")
        self.is_free = not robot.info().is_fixed

    def targets(self, actions: npt.ArrayLike) -> FloatArray:
        """Returns targets of joints for actions between -1 and 1."""
        bounded = np.clip(np.asarray(actions, dtype=np.float64), -1.0, 1.0)
        return self.low + 0.5 * (bounded + 1.0) * (self.high - self.low)

    def deviations(self, random: np.random.Generator, begin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Draws positions and velocities of joints for the start of an episode, around the positions `begin`."""
        positions = begin + random.normal(0.0, self.task.spread, begin.shape) if self.task.spread else begin.copy()
        velocities = random.normal(0.0, self.task.spread, begin.shape) if self.task.spread else np.zeros(begin.shape)
        for index, joint in enumerate(self.single):
            if joint.name in self.task.ranges:
                positions[index] = random.uniform(*self.task.ranges[joint.name])
                velocities[index] = 0.0
        return positions, velocities


def _bounds(joint: JointInfo, mode: Mode) -> tuple[float, float]:
    """Returns the targets of a joint's limits."""
    limits = joint.limits
    if mode == "position":
        none = _UNBOUNDED[mode]
        return (-none if limits.lower is None else limits.lower, none if limits.upper is None else limits.upper)
    most = limits.effort if mode == "effort" else limits.velocity
    most = _UNBOUNDED[mode] if most is None else most
    return -most, most
