"""The loop of a script: what a step sends, and what its answer brings.

A step costs one round trip: motors are sent with it, its answer has the joint states, and
readings are answered from those.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from simd_client.proto import (
    ApplyLinkWrenchRequest,
    GetPhysicsRequest,
    GetSimulationStateRequest,
    JointReset,
    NextJointStatesRequest,
    Physics,
    ResetJointsRequest,
    SetJointPropertiesRequest,
    SetPhysicsRequest,
    SimulationState,
    methods,
)

from .bodies import Body, BodyJoint, Limits, put_limits
from .errors import error
from .outgoing import Outgoing
from .readings import Readings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from .arguments import Vector
    from .wire import Wire


# How long stepSimulation waits for the next state of a world that plays, seconds.
_NEXT_STATE = 1.0
# How many forces wait at the most.
_PUSHES = 256
# Wall seconds for which settings are taken to be as they were seen.
_SEEN = 0.5
# PyBullet's time step, until a script sets another.
TIME_STEP = 1.0 / 240.0


class Loop(Readings):
    """What goes to the daemon with each step, and the settings by which it steps."""

    def __init__(self, wire: Wire) -> None:
        super().__init__(wire)
        self.bodies: dict[int, Body] = {}
        # As they were last read.
        self.physics = Physics()
        self.gravity: Vector = (0.0, 0.0, 0.0)
        self.time_step = TIME_STEP
        self.substeps = 0
        # Motors that have changed since the last step, by body and joint.
        self._waiting: dict[tuple[int, int], None] = {}
        self._outgoing = Outgoing()
        # Joints to be put elsewhere, by robot: position and velocity by the joint's name and axis. They go with the next call
        # of any kind.
        self._resets: dict[str, dict[tuple[str, int], JointReset]] = {}
        # Limits that joints get, by robot and the joint's name: they go before that.
        self._bounds: dict[str, dict[str, Limits]] = {}
        # Forces for the next step, which go with that call too, together.
        self._pushes: list[ApplyLinkWrenchRequest] = []
        # The wall time at which the settings were read or changed.
        self._physics_at = -math.inf
        wire.before = self._send_before

    def drive(self, body: Body, joints: Iterable[int]) -> None:
        """Marks motors as changed: they are sent with the next step, or at once if the world plays."""
        number = body.unique_id
        self._waiting.update({(number, index): None for index in joints})

    def put_joints(self, body: Body, joints: Mapping[tuple[str, int], JointReset]) -> None:
        """Puts joints elsewhere, by name and axis."""
        self._resets.setdefault(body.robot, {}).update(joints)
        if self.playing:
            self._send_before()
        self.forget_states()

    def push(self, request: ApplyLinkWrenchRequest) -> None:
        """A force or a torque for the next step, beside those that wait."""
        self._pushes.append(request)
        if self.playing or len(self._pushes) >= _PUSHES:
            self._send_before()

    def bound(self, body: Body, joint: BodyJoint, limits: Limits) -> None:
        """Gives a joint limits, with the next call of any kind."""
        self._bounds.setdefault(body.robot, {})[joint.name] = limits

    def _send_before(self) -> None:
        """Sends what other calls come after."""
        if self._bounds:
            bounds, self._bounds = self._bounds, {}
            for robot, joints in bounds.items():
                properties = SetJointPropertiesRequest(robot=robot)
                for name, limits in joints.items():
                    put_limits(properties.joints.add(joint=name).limits, limits)
                self.wire.call(methods.SetJointProperties, properties)
        if self._pushes:
            pushes, self._pushes = self._pushes, []
            self.wire.call_all(methods.ApplyLinkWrench, pushes)
        if self._resets:
            resets, self._resets = self._resets, {}
            request = ResetJointsRequest()
            for name, joints in resets.items():
                request.robots.add(robot=name, joints=joints.values())
            self.wire.call(methods.ResetJoints, request)

    def sent_if_playing(self) -> None:
        """Sends the motors at once if the world plays."""
        if self.playing:
            self.flush()

    def flush(self) -> None:
        """Sends the changed motors, and joints that are put elsewhere."""
        self._send_before()
        if self._waiting:
            self._put_targets()
            self.wire.call(methods.SetJointTargets, self._outgoing.targets())
            self._sent()

    def advance(self) -> None:
        """One step, or the next state of a world that plays by itself."""
        if self.playing:
            self._follow()
        else:
            self._put_targets()
            request = self._outgoing.step(self.wants_links(), self.wants_contacts())
            try:
                answer = self.wire.call(methods.StepSimulation, request)
            except error as refusal:
                if refusal.reason != "WRONG_STATE":
                    raise
                # Another client started the world.
                self.now_playing(True)
                self._follow()
            else:
                self._sent()
                self.take_step(answer)

    def _follow(self) -> None:
        """Waits for a state that is newer than the last, in a world that plays by itself."""
        self.flush()
        request = NextJointStatesRequest(after_sequence=self.sequence, timeout=_NEXT_STATE)
        before = self.sequence
        self.take(self.wire.call(methods.NextJointStates, request).states)
        if self.sequence == before:
            # There was no step for a second: another client may have paused the world.
            self.read_state()
            if not self.playing:
                self.advance()

    def _put_targets(self) -> None:
        """Puts the changed motors into the next request."""
        for body, friction in self._outgoing.put(self._waiting, self.bodies, self.time_step):
            self._set_friction(body, friction)

    def _set_friction(self, body: Body, friction: Iterable[tuple[BodyJoint, float]]) -> None:
        request = SetJointPropertiesRequest(robot=body.robot)
        for joint, value in friction:
            request.joints.add(joint=joint.name, friction=value)
            joint.friction_sent = value
        self.wire.call(methods.SetJointProperties, request)

    def _sent(self) -> None:
        """The daemon has the changed motors. A torque lasts one step; then the motor is set again."""
        waiting = self._waiting
        self._waiting = {}
        if not self._outgoing.sent():
            return
        for number, index in waiting:
            joint = self.bodies[number].joints[index]
            motor = joint.motor if joint.ball is None else joint.ball
            joint.torque_sent = joint.motor.torque or 0.0
            if motor.torque is not None:
                motor.torque = None
                self._waiting[(number, index)] = None

    # The settings.

    def set_physics(self, request: SetPhysicsRequest) -> None:
        """Changes only what is given."""
        self._learn(self.wire.call(methods.SetPhysics, request).physics)

    def has_gravity(self, gravity: Vector) -> bool:
        """Whether that is the gravity, as far as was seen a moment ago: scripts set it at each step."""
        return gravity == self.gravity and time.monotonic() - self._physics_at < _SEEN

    def read_state(self) -> None:
        """Fetches the settings of the world, and whether it plays."""
        self._learn(self.wire.call(methods.GetPhysics, GetPhysicsRequest()).physics)
        state = self.wire.call(methods.GetSimulationState, GetSimulationStateRequest()).state
        self.now_playing(state == SimulationState.SIMULATION_STATE_PLAYING)

    def _learn(self, physics: Physics) -> None:
        self.physics, self._physics_at = physics, time.monotonic()
        self.gravity = (physics.gravity.x, physics.gravity.y, physics.gravity.z)
        self.time_step = physics.time_step
        if self.substeps or physics.substeps > 1:
            self.substeps = physics.substeps
