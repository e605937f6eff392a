"""What a world looks like, as far as a script read it: each state once a step."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from simd_client.proto import (
    GetEntityStateRequest,
    GetEntityStateResponse,
    GetJointStatesRequest,
    GetLinkPosesRequest,
    GetLinkStatesRequest,
    JointStates,
    RobotJointStates,
    RobotLinkPoses,
    RobotLinkStates,
    methods,
)

from .errors import error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .bodies import Body
    from .wire import Wire

State = TypeVar("State")


class Readings:
    """Copies of the newest states. A paused world's are good until the next step, or until the script
    changes something else; those of a world that plays are read anew, or were published."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        # Steps come by themselves.
        self.playing = False
        # The next state must be newer than this.
        self.sequence = 0
        self.sim_time = 0.0
        self._joint_states: dict[str, RobotJointStates] | None = None
        self._link_poses: dict[str, RobotLinkPoses] = {}
        self._link_states: dict[str, RobotLinkStates] = {}
        self._roots: dict[str, GetEntityStateResponse] = {}
        # Joint states of a world that plays arrive by themselves.
        self._publishes = False
        self._watching = False

    def now_playing(self, playing: bool) -> None:
        """Somebody made the world play, or pause."""
        self.playing = playing
        if playing and not self._watching:
            self._watching = True
            self.wire.watch_states()

    def joint_states(self, body: Body) -> RobotJointStates:
        """Of the newest step, or of now where something else changed since or the world plays."""
        if self._joint_states is None:
            self.take(self._ask_joint_states())
        elif self.playing:
            self._take_published(body)
        states = self._joint_states.get(body.robot) if self._joint_states else None
        if states is None or states.layout_version != body.layout_version:
            raise error(f"the robot {body.robot} is gone, or somebody reloaded it")
        return states

    def _ask_joint_states(self) -> JointStates:
        return self.wire.call(methods.GetJointStates, GetJointStatesRequest()).states

    def _take_published(self, body: Body) -> None:
        """What the daemon published last; where it publishes nothing, what it answers."""
        published = self.wire.published(body.robot)
        if published is None:
            if self._publishes:
                return
            self.take(self._ask_joint_states())
        elif self._joint_states is not None and published.stamp.sequence > self.sequence:
            self._publishes = True
            for robot in published.robots:
                self._joint_states[robot.robot] = robot

    def link_poses(self, body: Body) -> RobotLinkPoses | RobotLinkStates:
        """Poses of a body's links: of the newest step, as `joint_states`."""
        states = None if self.playing else self._link_states.get(body.robot)
        if states is not None:
            return states
        if self.playing or not self._link_poses:
            answer = self.wire.call(methods.GetLinkPoses, GetLinkPosesRequest())
            self._link_poses = {robot.robot: robot for robot in answer.robots}
        return _of(self._link_poses, body)

    def link_states(self, body: Body) -> RobotLinkStates:
        """Poses and rates of a body's links: of the newest step, as `joint_states`."""
        if self.playing or not self._link_states:
            answer = self.wire.call(methods.GetLinkStates, GetLinkStatesRequest())
            self._link_states = {robot.robot: robot for robot in answer.robots}
        return _of(self._link_states, body)

    def root(self, body: Body) -> GetEntityStateResponse:
        """Pose and rates of a body's root: of the newest step, as `joint_states`."""
        state = None if self.playing else self._roots.get(body.robot)
        if state is None:
            state = self.wire.call(methods.GetEntityState, GetEntityStateRequest(robot=body.robot))
            self._roots[body.robot] = state
        return state

    def forget_states(self) -> None:
        """Something changed other than by a step."""
        self._joint_states = None
        self._forget_places()

    def _forget_places(self) -> None:
        self._link_poses, self._link_states, self._roots = {}, {}, {}

    def take(self, states: JointStates) -> None:
        """States of all robots arrived: those are the newest."""
        self.sequence = states.stamp.sequence
        self.sim_time = states.stamp.sim_time
        self._joint_states = {robot.robot: robot for robot in states.robots}
        self._forget_places()


def _of(found: Mapping[str, State], body: Body) -> State:
    """What was told of a body."""
    state = found.get(body.robot)
    if state is None:
        raise error(f"the robot {body.robot} is gone")
    return state
