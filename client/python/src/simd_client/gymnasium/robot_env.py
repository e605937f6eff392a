"""One robot as an environment, in a world in this process."""

from __future__ import annotations

import os
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box

from simd_client import proto
from simd_client.geometry import FloatArray
from simd_client.proto import methods
from simd_client.renderer_process import RendererProcess

from .ids import task_of
from .readings import Readings
from .task import Task, World

Action = npt.NDArray[np.float32]

_PICTURE = (480, 360)
_FAR_AWAY = np.array([0.9, -1.1, 0.6])


class RobotEnv(gymnasium.Env[FloatArray, Action]):
    """An environment of one robot. Actions are between -1 and 1 for each driven joint. Observations are the state
    of `Task`, or its features, and readings of sensors.

    Equal seeds and actions give equal bits on one build and machine.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(
        self,
        robot: str | os.PathLike[str] | Task,
        *,
        render_mode: str | None = None,
        sensors: tuple[str, ...] = (),
        **settings: Any,
    ) -> None:
        """`robot` is a URDF, the folder of a package, a task, or the id of one. `settings` are those of `Task`.

        `sensors` are names of the robot's sensors, whose newest readings are added to observations. Raises
        `ValueError` for another `render_mode` than `rgb_array`.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode={render_mode!r} is not there; there is rgb_array")
        self.task = task_of(robot, settings)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / (self.task.time_step * self.task.frame_skip)))}
        self._renderer: RendererProcess | None = None
        self._age = 0
        self._world = world = self.task.open()
        try:
            self._positions = np.array([each.positions.start for each in world.single])
            self._velocities = np.array([each.velocities.start for each in world.single])
            self._readings = Readings(world.robot, sensors)
            self._step, self._numbers = _request(world, sensors)
            self._begin = world.sim.save_state("begin")
            self._first = world.robot.read().position[self._positions]
            size = self._observation(self._now()).size
        except BaseException:
            world.sim.close()
            raise
        self.observation_space = Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = Box(-1.0, 1.0, (len(world.driven),), np.float32)

    @property
    def sim(self) -> Any:
        """The world, for what this class has no function for. It is put back at each reset."""
        return self._world.sim

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Puts the robot to the start of an episode."""
        super().reset(seed=seed)
        world = self._world
        world.sim.restore_state(self._begin)
        if self.task.spread or self.task.ranges:
            positions, velocities = world.deviations(self.np_random, self._first)
            names = [each.name for each in world.single]
            world.robot.reset_joints(dict(zip(names, positions.tolist())), dict(zip(names, velocities.tolist())))
        self._age = 0
        self._readings.forget()
        return self._observation(self._now()), {}

    def step(self, action: npt.ArrayLike) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Applies an action for `frame_skip` steps."""
        for number, value in zip(self._numbers, self._world.targets(action).tolist(), strict=True):
            number(value)
        answer = self._world.sim.call(methods.StepSimulation, self._step)
        self._readings.take(answer.sensors)
        state = self._state(answer.states.robots[0], answer.link_states)
        self._age += 1
        truncated = self._age >= self.task.max_episode_steps
        if not np.isfinite(state).all():
            return np.zeros(self.observation_space.shape or ()), self.task.failure, True, False, {}
        bounded = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        reward = 0.0 if self.task.reward is None else float(np.asarray(self.task.reward(state, bounded)))
        over = self.task.is_over is not None and bool(np.asarray(self.task.is_over(state)))
        return self._observation(state), reward, over, truncated and not over, {}

    def render(self) -> Any:
        """Returns a picture, rows x columns x 3. Needs the program `simd-camera`, which is started at the first
        picture."""
        if self.render_mode is None:
            return None
        if self._renderer is None:
            self._renderer = RendererProcess(self._world.sim)
        eye, target = self.task.camera or self._following()
        width, height = _PICTURE
        return self._world.sim.take_picture(eye, target, width=width, height=height).color

    def close(self) -> None:
        """Ends the world."""
        if self._renderer is not None:
            self._renderer.end()
            self._renderer = None
        self._world.sim.close()

    def _following(self) -> tuple[FloatArray, FloatArray]:
        at = self._world.robot.pose.position
        return at + _FAR_AWAY, at

    def _now(self) -> FloatArray:
        """Returns the present state."""
        sim, name = self._world.sim, self._world.robot.name
        states = sim.call(methods.GetJointStates, proto.GetJointStatesRequest(selections=self._step.selections)).states
        links = []
        if self._world.is_free:
            links = sim.call(methods.GetLinkStates, proto.GetLinkStatesRequest(robots=[name])).robots
        return self._state(states.robots[0], links)

    def _state(self, joints: proto.RobotJointStates, links: Any) -> FloatArray:
        positions = np.array(joints.position[:])[self._positions]
        velocities = np.array(joints.velocity[:])[self._velocities]
        if not self._world.is_free:
            return np.concatenate([positions, velocities])
        return np.concatenate([positions, velocities, links[0].poses[:7], links[0].twists[:6]])

    def _observation(self, state: FloatArray) -> FloatArray:
        seen = state if self.task.features is None else np.asarray(self.task.features(state), dtype=np.float64)
        return np.concatenate([seen, *self._readings.numbers()])


def _request(world: World, sensors: tuple[str, ...]) -> tuple[proto.StepSimulationRequest, list[Any]]:
    """Returns the request of all actions, with functions that set its numbers."""
    name = world.robot.name
    request = proto.StepSimulationRequest(
        steps=world.task.frame_skip, return_states=True, return_link_states=world.is_free
    )
    request.selections.add(robot=name)
    if sensors:
        request.sensors.add(robot=name, sensors=sensors)
    targets = request.robots.add(robot=name)
    numbers: list[Any] = []
    for joint in world.driven:
        target: Any = getattr(targets.joints.add(joint=joint.name), world.task.mode)
        target.SetInParent()
        numbers.append(partial(setattr, target, world.task.mode))
    return request, numbers
