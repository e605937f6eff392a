"""Cache of the states that a script reads: each is fetched once per step."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeVar

from simd_client.proto import (
    Contact,
    GetContactsRequest,
    GetEntityStateRequest,
    GetJointReactionsRequest,
    GetJointReactionsResponse,
    GetJointStatesRequest,
    GetLinkPropertiesRequest,
    GetLinkPropertiesResponse,
    GetLinkPosesRequest,
    GetLinkStatesRequest,
    JointStates,
    RobotJointStates,
    RobotLinkPoses,
    RobotLinkStates,
    StepSimulationResponse,
    methods,
)

from .errors import error

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from simd_client.embedded_link import RobotNumbers

    from .arguments import Pose, Vector
    from .bodies import Body
    from .wire import Wire

    # world_from_root; velocity of its origin and angular velocity, world axes.
    Root = tuple[Pose, tuple[Vector, Vector]]

State = TypeVar("State")


class _Numbers(NamedTuple):
    """Values of `RobotJointStates`, without a message."""

    robot: str
    layout_version: int
    position: list[float]
    velocity: list[float]
    effort: list[float]


AnyJointStates = RobotJointStates | _Numbers

JointValues = tuple[list[float], list[float], list[float]]
"""Positions, velocities and efforts of motors of a robot's joints. Each has a 0 after the last, for joints
without a value. As in PyBullet, a motor's effort excludes the script's torque; with substeps it is divided by
their number."""

# Number of steps that include the states of links, and contact points, after a script has read any.
_LINKS_FOR = 16


class Readings:
    """Copies of the newest states. In a paused world they are valid until the next step or another change by
    the script. In a playing world they are fetched again, or were published."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        # Whether the world makes steps automatically.
        self.playing = False
        # Sequence; the next state must be newer.
        self.sequence = 0
        self.sim_time = 0.0
        # The script's value: 0 is one substep, like 1.
        self.substeps = 0
        self._joint_states: dict[str, AnyJointStates] | None = None
        # Extracted numbers of read states, by robot, with their message.
        self._joint_values: dict[str, tuple[AnyJointStates, JointValues]] = {}
        self._link_poses: dict[str, RobotLinkPoses] = {}
        self._link_states: dict[str, RobotLinkStates] = {}
        self._roots: dict[str, Root] = {}
        self._reactions: dict[str, GetJointReactionsResponse] = {}
        self._properties: dict[str, GetLinkPropertiesResponse] = {}
        # Contact points of all robots; None if they must be requested.
        self._contacts: list[Contact] | None = None
        # Number of further steps that include the states of links, because the script has read some.
        self._links_for = 0
        # Whether something was moved since the last step, and whether the script has then asked for contacts.
        self._is_moved = self.is_detected = False
        # Number of further steps that include contact points.
        self._contacts_for = 0
        # Whether joint states of a playing world arrive without requests.
        self._publishes = False
        self._watching = False

    def now_playing(self, playing: bool) -> None:
        """Sets whether the world plays."""
        self.playing = playing
        if playing and not self._watching:
            self._watching = True
            self.wire.watch_states()

    def joint_states(self, body: Body) -> AnyJointStates:
        """Returns the states of the newest step, or the current ones if something else has changed or the
        world plays."""
        if self._joint_states is None:
            self.take(self._ask_joint_states())
        elif self.playing:
            self._take_published(body)
        states = self._joint_states.get(body.robot) if self._joint_states else None
        if states is None or states.layout_version != body.layout_version:
            raise error(f"the robot {body.robot} was deleted or reloaded")
        return states

    def joint_values(self, body: Body) -> JointValues:
        """Returns the numbers of `joint_states`."""
        states = self.joint_states(body)
        known = self._joint_values.get(body.robot)
        if known is not None and known[0] is states:
            return known[1]
        # Lists: extracting one number of a message costs as much as extracting all of them at once.
        values = [*states.position, 0.0], [*states.velocity, 0.0], [*states.effort, 0.0]
        for joint in body.joints:
            if joint.torque_sent:
                values[2][joint.velocity_index] -= joint.torque_sent
        if self.substeps > 1:
            values[2][:] = [effort / self.substeps for effort in values[2]]
        self._joint_values[body.robot] = states, values
        return values

    def _ask_joint_states(self) -> JointStates:
        return self.wire.call(methods.GetJointStates, GetJointStatesRequest()).states

    def _take_published(self, body: Body) -> None:
        """Stores the last published states, or fetches them if none were published."""
        published = self.wire.published(body.robot)
        if published is None:
            if self._publishes:
                return
            self.take(self._ask_joint_states())
        elif self._joint_states is not None and published.stamp.sequence > self.sequence:
            self._publishes = True
            for robot in published.robots:
                self._joint_states[robot.robot] = robot

    def reactions(self, body: Body) -> GetJointReactionsResponse:
        """Returns the joint reactions of a body over the newest step."""
        found = None if self.playing else self._reactions.get(body.robot)
        if found is None:
            found = self.wire.call(methods.GetJointReactions, GetJointReactionsRequest(robot=body.robot))
            self._reactions[body.robot] = found
        if found.layout_version != body.layout_version:
            raise error(f"the robot {body.robot} was deleted or reloaded")
        return found

    def link_properties(self, body: Body) -> GetLinkPropertiesResponse:
        """Returns surfaces of a body's links."""
        found = self._properties.get(body.robot)
        if found is None:
            found = self.wire.call(methods.GetLinkProperties, GetLinkPropertiesRequest(robot=body.robot))
            self._properties[body.robot] = found
        return found

    def forget_properties(self, body: Body) -> None:
        """Marks the surfaces as changed."""
        self._properties.pop(body.robot, None)

    def contacts(self) -> list[Contact]:
        """Returns all contact points of the newest step."""
        self._contacts_for = _LINKS_FOR
        if self.playing or self._contacts is None:
            self._contacts = list(self.wire.call(methods.GetContacts, GetContactsRequest()).contacts)
        return self._contacts

    def link_poses(self, body: Body) -> RobotLinkPoses | RobotLinkStates:
        """Returns poses of a body's links, of the newest step, as `joint_states`."""
        self._links_for = _LINKS_FOR
        states = None if self.playing else self._link_states.get(body.robot)
        if states is not None:
            return states
        if self.playing or not self._link_poses:
            answer = self.wire.call(methods.GetLinkPoses, GetLinkPosesRequest())
            self._link_poses = {robot.robot: robot for robot in answer.robots}
        return _of(self._link_poses, body)

    def link_states(self, body: Body) -> RobotLinkStates:
        """Returns poses and velocities of a body's links, of the newest step, as `joint_states`."""
        self._links_for = _LINKS_FOR
        if self.playing or not self._link_states:
            answer = self.wire.call(methods.GetLinkStates, GetLinkStatesRequest())
            self._link_states = {robot.robot: robot for robot in answer.robots}
        return _of(self._link_states, body)

    def root(self, body: Body) -> Root:
        """Returns pose and velocities of a body's root, of the newest step, as `joint_states`."""
        self._links_for = _LINKS_FOR
        state = None if self.playing else self._roots.get(body.robot)
        if state is None:
            links = None if self.playing else self._link_states.get(body.robot)
            if links is not None:
                # The root is the first link.
                x, y, z, i, j, k, w = links.poses[:7]
                u, v, n, a, b, c = links.twists[:6]
                state = ((x, y, z), (i, j, k, w)), ((u, v, n), (a, b, c))
            else:
                state = self._ask_root(body)
            self._roots[body.robot] = state
        return state

    def _ask_root(self, body: Body) -> Root:
        answer = self.wire.call(methods.GetEntityState, GetEntityStateRequest(robot=body.robot))
        at, turn = answer.pose.position, answer.pose.orientation
        line, spin = answer.twist.linear, answer.twist.angular
        pose = (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
        return pose, ((line.x, line.y, line.z), (spin.x, spin.y, spin.z))

    def wants_links(self) -> bool:
        """Whether the next step includes the states of links."""
        return self._links_for > 0

    def wants_contacts(self) -> bool:
        """Whether the next step includes contact points."""
        return self._contacts_for > 0

    def forget_states(self) -> None:
        """Marks the states as old: something changed without a step."""
        self._joint_states = None
        self._is_moved, self.is_detected = True, False
        self._forget_rest()

    def detect(self) -> None:
        """Makes contacts belong to the current poses, until the next step or change."""
        self.is_detected = self._is_moved

    def _forget_rest(self) -> None:
        self._link_poses, self._link_states, self._roots, self._reactions = {}, {}, {}, {}
        self._contacts = None
        self._properties = {}

    def take_step(self, answer: StepSimulationResponse) -> None:
        """Stores a step's answer: joint states of all robots, and the requested states of links and contact
        points."""
        self.take(answer.states)
        if self._contacts_for > 0:
            self._contacts = list(answer.contacts)
            self._contacts_for -= 1
        if self._links_for > 0:
            self._link_states = {robot.robot: robot for robot in answer.link_states}
            self._links_for -= 1

    def take_numbers(self, sequence: int, sim_time: float, robots: Sequence[RobotNumbers]) -> None:
        """Stores a step's answer that has only joint states."""
        self._take(sequence, sim_time, {robot[0]: _Numbers._make(robot) for robot in robots})

    def take(self, states: JointStates) -> None:
        """Stores arrived states of all robots as the newest."""
        stamp = states.stamp
        self._take(stamp.sequence, stamp.sim_time, {robot.robot: robot for robot in states.robots})

    def _take(self, sequence: int, sim_time: float, robots: Mapping[str, AnyJointStates]) -> None:
        if sequence != self.sequence and self._joint_states is not None:
            self._is_moved = self.is_detected = False
        self.sequence, self.sim_time = sequence, sim_time
        self._joint_states = dict(robots)
        self._forget_rest()


def _of(found: Mapping[str, State], body: Body) -> State:
    """Returns the last states of a body."""
    state = found.get(body.robot)
    if state is None:
        raise error(f"the robot {body.robot} is gone")
    return state
