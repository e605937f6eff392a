"""The loop of a script: the request of a step, and its answer.

A step costs one round trip: motors are sent with it, its answer has the joint states, and readings use those.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from typing import TYPE_CHECKING, TypeVar

from simd_client.proto import (
    ApplyLinkWrenchRequest,
    GetPhysicsRequest,
    GetSimulationStateRequest,
    Integrator,
    JointReset,
    NextJointStatesRequest,
    Physics,
    ResetJointsRequest,
    SetJointPropertiesRequest,
    SetPhysicsRequest,
    SimulationState,
    StepSimulationResponse,
    methods,
)

from .arguments import ORIGIN
from .bodies import Body, BodyJoint, JointBounds, put_limits
from .errors import error
from .step_targets import Key, StepTargets
from .readings import Readings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from simd_client.embedded_link import RobotNumbers

    from .arguments import Vector
    from .wire import Wire


Answer = TypeVar("Answer")

# Seconds that stepSimulation waits for the next state of a world that plays.
_NEXT_STATE = 1.0
# Maximum number of waiting wrenches.
_WRENCHES = 256
# Wall seconds for which settings are assumed unchanged.
_SEEN = 0.5
# The daemon's time steps, seconds, and how many of them may form one of the script.
_SHORTEST, _LONGEST, _MAX_STEPS = 1e-6, 0.1, 1000
# Maximum values of the daemon for Bullet's contacts.
_MAX_CONTACTS = {"error_reduction": 1.0, "slop": 0.1, "bounce_speed": 1e6}
# PyBullet's time step, until a script sets another.
TIME_STEP = 1.0 / 240.0


class Loop(Readings):
    """Data sent with each step, and the settings of steps."""

    def __init__(self, wire: Wire) -> None:
        super().__init__(wire)
        self.bodies: dict[int, Body] = {}
        # Settings as last read.
        self.physics = Physics()
        self.gravity: Vector = (0.0, 0.0, 0.0)
        self.time_step = TIME_STEP
        # Steps of the daemon for one of the script.
        self.steps_at_once = 1
        # Bullet's defaults, until a script changes them: they have no effect here.
        self.solver_iterations, self.inner_iterations = 50, 1
        # Motors that have changed since the last step, by body and joint.
        self._waiting: dict[Key, None] = {}
        self._step_targets = StepTargets()
        # Torques of the script that acted over the last step, N m or N: one number, or three of a spherical joint.
        self.torques: dict[Key, Sequence[float]] = {}
        # Held while a torque is added, and while torques are taken: scripts also command from other threads
        # than the stepping one.
        self.commands = threading.RLock()
        # Pending resets of joints, by robot: position and velocity by the joint's name and axis. They go with
        # the next call of any kind.
        self._resets: dict[str, dict[tuple[str, int], JointReset]] = {}
        # Pending limits of joints, by robot and the joint's name: they go before the resets.
        self._bounds: dict[str, dict[str, JointBounds]] = {}
        # Wrenches for the next step, sent together with that call.
        self._wrenches: list[ApplyLinkWrenchRequest] = []
        # The wall time at which the settings were read or changed.
        self._physics_at = -math.inf
        wire.before = self._send_before

    def drive(self, body: Body, joints: Iterable[int]) -> None:
        """Marks motors as changed: they are sent with the next step, or immediately if the world plays."""
        number = body.unique_id
        for index in joints:
            self._waiting[number, index] = None

    def forget_motors(self, number: int, robot: str) -> None:
        """Drops everything that waits for a deleted robot."""
        for key in [key for key in self._waiting if key[0] == number]:
            del self._waiting[key]
        self._bounds.pop(robot, None)
        self._resets.pop(robot, None)
        self._wrenches = [each for each in self._wrenches if each.robot != robot]

    def put_joints(self, body: Body, joints: Mapping[tuple[str, int], JointReset]) -> None:
        """Resets joints, by name and axis."""
        self._resets.setdefault(body.robot, {}).update(joints)
        if self.playing:
            self._send_before()
        self.forget_states()

    def apply_wrench(self, request: ApplyLinkWrenchRequest) -> None:
        """Adds a wrench for the next step to the waiting ones."""
        self._wrenches.append(request)
        if self.playing or len(self._wrenches) >= _WRENCHES:
            self._send_before()

    def bound(self, body: Body, joint: BodyJoint, limits: JointBounds) -> None:
        """Sets limits of a joint, with the next call of any kind."""
        self._bounds.setdefault(body.robot, {})[joint.name] = limits

    def _send_before(self) -> None:
        """Sends everything that must precede other calls."""
        if self._bounds:
            bounds, self._bounds = self._bounds, {}
            for robot, joints in bounds.items():
                properties = SetJointPropertiesRequest(robot=robot)
                for name, limits in joints.items():
                    put_limits(properties.joints.add(joint=name).limits, limits)
                self.wire.call(methods.SetJointProperties, properties)
        if self._wrenches:
            wrenches, self._wrenches = self._wrenches, []
            self.wire.call_all(methods.ApplyLinkWrench, wrenches)
        if self._resets:
            resets, self._resets = self._resets, {}
            request = ResetJointsRequest()
            for name, joints in resets.items():
                request.robots.add(robot=name, joints=joints.values())
            self.wire.call(methods.ResetJoints, request)

    def sent_if_playing(self) -> None:
        """Sends the motors immediately if the world plays."""
        if self.playing:
            self.flush()

    def flush(self) -> None:
        """Sends the changed motors, and pending resets of joints. While the world is paused, torques wait for
        its step."""
        self._send_before()
        if self._waiting:
            self._with_motors(
                lambda: self.wire.call(methods.SetJointTargets, self._step_targets.targets()), with_torques=self.playing
            )

    def advance(self) -> None:
        """Makes one step, or waits for the next state of a playing world."""
        if self.playing:
            self._follow()
        else:
            try:
                answer = self._with_motors(self._step, with_torques=True)
            except error as refusal:
                if refusal.reason != "WRONG_STATE":
                    raise
                # Another client started the world.
                self.now_playing(True)
                self._follow()
            else:
                if isinstance(answer, StepSimulationResponse):
                    self.take_step(answer)
                else:
                    self.take_numbers(*answer)

    def _follow(self) -> None:
        """Waits for a state that is newer than the last, in a playing world."""
        self.flush()
        request = NextJointStatesRequest(after_sequence=self.sequence, timeout=_NEXT_STATE)
        before = self.sequence
        self.take(self.wire.call(methods.NextJointStates, request).states)
        if self.sequence == before:
            # No step for a second: another client may have paused the world.
            self.read_state()
            if not self.playing:
                self.advance()

    def _step(self) -> StepSimulationResponse | tuple[int, float, list[RobotNumbers]]:
        links, contacts = self.wants_links(), self.wants_contacts()
        if self.wire.keeps_steps and not (links or contacts):
            kept = self._step_targets.kept(self.wire.keep_step, self.steps_at_once)
            if kept is not None:
                return self.wire.run_step(*kept)
        request = self._step_targets.step(links, contacts, self.steps_at_once)
        return self.wire.call(methods.StepSimulation, request)

    def _with_motors(self, call: Callable[[], Answer], with_torques: bool) -> Answer:
        """Makes a call that has the changed motors. Changes by another thread meanwhile go with the next
        call; so do all of them if this one is refused."""
        # Marks are cleared before motors are read, and commands mark after they have changed one: an unread
        # change is marked again.
        sending = list(self._waiting)
        for key in sending:
            self._waiting.pop(key, None)
        with self.commands:
            step = self.time_step, self.substeps
            frictions = self._step_targets.put(sending, self.bodies, *step, with_torques)
            torques = self._take_torques(sending, with_torques) if self._step_targets.has_torques else {}
        try:
            for body, friction in frictions:
                self._set_friction(body, friction)
            answer = call()
        except BaseException as problem:
            # A refused target is dropped: each step would be refused again.
            if getattr(problem, "reason", "") != "INVALID_VALUE":
                self._waiting.update({key: None for key in sending if key[0] in self.bodies})
                with self.commands:
                    for key, joint in self._joints(torques):
                        joint.add_torque(torques[key])
            raise
        if with_torques and (torques or self.torques):
            self.torques_acted(torques)
        return answer

    def torques_acted(self, torques: Mapping[Key, Sequence[float]]) -> None:
        """Sets the torques of the script over the last step, and clears all others."""
        for _, joint in self._joints(self.torques):
            joint.torque_acted(ORIGIN)
        self.torques = dict(torques)
        for key, joint in self._joints(torques):
            joint.torque_acted(torques[key])

    def _joints(self, keys: Iterable[Key]) -> Iterator[tuple[Key, BodyJoint]]:
        """Yields the existing joints of these keys."""
        for number, index in keys:
            body = self.bodies.get(number)
            if body is not None and index < len(body.joints):
                yield (number, index), body.joints[index]

    def _take_torques(self, sending: Iterable[Key], with_torques: bool) -> dict[Key, Sequence[float]]:
        """Returns the torques among these motors, which last one step; afterwards the motors are sent again
        without them. If they do not go with this request, they go with the step after it."""
        torques: dict[Key, Sequence[float]] = {}
        for key, joint in self._joints(sending):
            motor = joint.motor if joint.ball is None else joint.ball
            if motor.torque is None:
                continue
            self._waiting[key] = None
            torque = joint.take_torque() if with_torques else None
            if torque is not None:
                torques[key] = torque
        return torques

    def _set_friction(self, body: Body, friction: Iterable[tuple[BodyJoint, float]]) -> None:
        request = SetJointPropertiesRequest(robot=body.robot)
        for joint, value in friction:
            request.joints.add(joint=joint.name, friction=value)
            joint.friction_sent = value
        self.wire.call(methods.SetJointProperties, request)

    # The settings.

    def set_physics(self, request: SetPhysicsRequest) -> None:
        """Changes only the given settings."""
        self._learn(self.wire.call(methods.SetPhysics, request).physics)

    @property
    def has_bullets_laws(self) -> bool:
        """Whether contacts and limits follow Bullet's laws, as in a world that this script began."""
        return self.physics.integrator == Integrator.INTEGRATOR_BULLET

    def set_contacts(self, **given: float) -> bool:
        """Changes parameters of Bullet's contacts, as far as they are in the daemon's ranges. Returns false if the world has other laws."""
        if not self.has_bullets_laws:
            return False
        request = SetPhysicsRequest(integrator=Integrator.INTEGRATOR_BULLET)
        request.bullet_contacts.CopyFrom(self.physics.bullet_contacts)
        for name, value in given.items():
            setattr(request.bullet_contacts, name, min(value, _MAX_CONTACTS[name]))
        self.set_physics(request)
        return True

    def set_time_step(self, seconds: float) -> None:
        """Sets any positive time step, as in PyBullet: a longer one is several of the daemon's steps."""
        if not 0.0 < seconds < math.inf:
            print(f"simd: a time step of {seconds:g} s is not valid; it stays {self.time_step:g} s", file=sys.stderr)
            return
        count = min(math.ceil(seconds / _LONGEST - 1e-9), _MAX_STEPS)
        self.steps_at_once = max(count, 1)
        self.set_physics(SetPhysicsRequest(time_step=min(max(seconds / self.steps_at_once, _SHORTEST), _LONGEST)))

    def has_gravity(self, gravity: Vector) -> bool:
        """Whether this is the gravity, as far as recently seen: scripts set it at each step."""
        return gravity == self.gravity and time.monotonic() - self._physics_at < _SEEN

    def read_state(self) -> None:
        """Fetches the settings of the world, and whether it plays."""
        self._learn(self.wire.call(methods.GetPhysics, GetPhysicsRequest()).physics)
        state = self.wire.call(methods.GetSimulationState, GetSimulationStateRequest()).state
        self.now_playing(state == SimulationState.SIMULATION_STATE_PLAYING)

    def _learn(self, physics: Physics) -> None:
        self.physics, self._physics_at = physics, time.monotonic()
        self.gravity = (physics.gravity.x, physics.gravity.y, physics.gravity.z)
        self.time_step = physics.time_step * self.steps_at_once
        if self.substeps or physics.substeps > 1:
            self.substeps = physics.substeps
