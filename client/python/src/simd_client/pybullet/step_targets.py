"""Targets that a step sends, in messages that are kept from step to step.

A loop sets the same motors at each step, and changes one number of each motor. So messages are made once;
while the same motors change, only that number is written. A world in this process keeps the request, and
receives only numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from simd_client.embedded_link import KeptStep
from simd_client.proto import JointTarget, RobotTargets, SetJointTargetsRequest, StepSimulationRequest

from . import constants, motors
from .ball_motors import ball_target
from .bodies import Body, BodyJoint, JointBounds
from .targets import joint_target

Key = tuple[int, int]
"""Number of the body, index of the joint."""

Friction = tuple[Body, list[tuple[BodyJoint, float]]]
"""Joints of a body with dry friction that changes with their motors, N m or N."""


@dataclass(slots=True)
class _Row:
    """One motor, and its index in the request."""

    joint: BodyJoint
    target: JointTarget
    # Inputs of the target, except the number that loops change; None if it must be made again.
    made_of: tuple[object, ...] | None = None
    # Part with that number: `servo`, `position`, `velocity` or `effort`.
    kind: str = ""
    part: Any = None
    number: float = 0.0
    # Revisions of the motor and joint when the target was made: while these stay, only that number changes.
    revision: int = -1
    velocity: float = 0.0
    limits: JointBounds | None = None
    # Limits of the joint's position, rad or m: as in PyBullet, a position target beyond them is moved there.
    lowest: float = -math.inf
    highest: float = math.inf
    # Maximum velocity of the joint, rad/s or m/s.
    fastest: float = motors.FASTEST
    # Dry friction of the motor, N m or N.
    friction: float = 0.0


class StepTargets:
    """Targets that the next step sends."""

    def __init__(self) -> None:
        self._request = StepSimulationRequest(steps=1, return_states=True)
        # For steps before which no motor has changed: the contents of the other request stay.
        self._plain = StepSimulationRequest(steps=1, return_states=True)
        self._is_empty = True
        # Whether numbers of rows are not in the request yet.
        self._is_behind = False
        # Whether the last targets are new messages, and not only new numbers.
        self._is_new = True
        # Both requests as the world keeps them, by number of steps.
        self._kept: KeptStep | None = None
        self._kept_plain: KeptStep | None = None
        self._kept_steps = 0
        self._keys: list[Key] = []
        self._robots: list[tuple[Body, list[_Row]]] = []
        # Seconds of a substep, and number of substeps of a step.
        self._step = (0.0, 1)
        self._with_torques = True
        # Whether any of the last added motors has a torque for the next step.
        self.has_torques = False

    def step(self, links: bool, contacts: bool, steps: int = 1) -> StepSimulationRequest:
        """Returns the request of a step with the last targets, which also requests states of links or contact
        points."""
        request = self._plain if self._is_empty else self._filled()
        request.return_link_states = links
        request.return_contacts = contacts
        request.steps = steps
        return request

    def targets(self) -> SetJointTargetsRequest:
        """Returns the same targets without a step."""
        return SetJointTargetsRequest(robots=() if self._is_empty else self._filled().robots)

    def kept(self, keep: Callable[[bytes], KeptStep], steps: int = 1) -> tuple[KeptStep, list[float]] | None:
        """Returns a kept step with the last targets, and their numbers; `None` if targets are new."""
        if steps != self._kept_steps:
            self._kept, self._kept_plain, self._kept_steps = None, None, steps
        if self._is_empty:
            if self._kept_plain is None:
                self._kept_plain = keep(self.step(False, False, steps).SerializeToString())
            return self._kept_plain, []
        if self._is_new:
            return None
        if self._kept is None:
            self._kept = keep(self.step(False, False, steps).SerializeToString())
        return self._kept, [row.number for _, rows in self._robots for row in rows]

    def _filled(self) -> StepSimulationRequest:
        """Returns the request with the numbers of all rows."""
        if self._is_behind:
            self._is_behind = False
            for _, rows in self._robots:
                for row in rows:
                    if row.kind in ("servo", "position"):
                        row.part.position = row.number
                    elif row.kind == "velocity":
                        row.part.velocity = row.number
                    elif row.kind == "effort":
                        row.part.effort = row.number
        return self._request

    def put(
        self,
        waiting: Iterable[Key],
        bodies: Mapping[int, Body],
        time_step: float,
        substeps: int = 1,
        with_torques: bool = True,
    ) -> list[Friction]:
        """Sets the targets of these motors and of no others, with or without the torques for the next step. A
        step takes `time_step` seconds, in `substeps` substeps. Returns the frictions that must be set before
        they apply."""
        self.has_torques, self._with_torques = False, with_torques
        keys, step = list(waiting), (time_step / max(substeps, 1), max(substeps, 1))
        self._is_empty = not keys
        if not keys:
            return []
        is_same = keys == self._keys and step == self._step
        self._is_behind, self._is_new = True, not is_same
        if not is_same or any(bodies.get(body.unique_id) is not body for body, _ in self._robots):
            self._keys, self._step, self._is_new = keys, step, True
            self._lay_out(bodies)
        frictions: list[Friction] = []
        for body, rows in self._robots:
            changed: list[tuple[BodyJoint, float]] = []
            for row in rows:
                self._put(body, row)
                joint = row.joint
                friction = joint.friction + row.friction
                if friction != joint.friction_sent and joint.ball is None:
                    changed.append((joint, friction))
            if changed:
                frictions.append((body, changed))
        if self._is_new:
            self._kept = None
        return frictions

    def _lay_out(self, bodies: Mapping[int, Body]) -> None:
        """Makes room for the targets of the motors, robot by robot."""
        by_body: dict[int, list[int]] = {}
        for number, index in self._keys:
            by_body.setdefault(number, []).append(index)
        del self._request.robots[:]
        self._robots = []
        for number, indices in by_body.items():
            body = bodies[number]
            message: RobotTargets = self._request.robots.add(robot=body.robot)
            self._robots.append((body, [_Row(body.joints[index], message.joints.add()) for index in indices]))

    def _put(self, body: Body, row: _Row) -> None:
        joint = row.joint
        if joint.ball is not None:
            h, parts = self._step
            self._is_new = True
            row.target.Clear()
            turn, ball = body.frame(joint.link)[1], joint.ball
            if ball.torque is not None:
                self.has_torques = True
                ball = ball if self._with_torques else replace(ball, torque=None)
            ball_target(joint.name, ball, joint.inertia, h, turn, row.target, parts)
            return
        motor = joint.motor
        torque, mode = motor.torque, motor.mode
        if row.revision == motor.revision and row.limits is joint.limits and torque is None:
            if row.kind == "velocity":
                row.number = _within(motor.velocity, -row.fastest, row.fastest)
                return
            if row.velocity == motor.velocity:
                row.number = _within(motor.position, row.lowest, row.highest)
                return
        if torque is not None:
            self.has_torques = True
            if not self._with_torques:
                motor, torque = replace(motor, torque=None), None
        made_of: tuple[object, ...] | None = None
        if torque is not None:
            if torque and (motor.force == 0.0 or mode == constants.TORQUE_CONTROL):
                made_of = ("effort",)
        elif mode == constants.VELOCITY_CONTROL and motor.velocity_gain == 1.0:
            made_of = (mode, motor.force)
        else:
            made_of = (
                mode,
                motor.force,
                motor.position_gain,
                motor.velocity_gain,
                motor.velocity,
                motor.max_velocity,
                joint.limits[3],
            )
        lower, upper = joint.limits[:2]
        row.lowest, row.highest = -math.inf if lower is None else lower, math.inf if upper is None else upper
        row.fastest = motors.FASTEST if joint.limits[3] is None else joint.limits[3]
        if made_of is None or made_of != row.made_of:
            self._make(row, motors.law(motor, joint.inertia, *self._step, row.fastest), made_of)
        row.revision = motor.revision if torque is None else -1
        row.velocity, row.limits = motor.velocity, joint.limits
        if row.kind == "velocity":
            row.number = _within(motor.velocity, -row.fastest, row.fastest)
        elif row.kind == "effort":
            row.number = torque or 0.0
        else:
            row.number = _within(motor.position, row.lowest, row.highest)

    def _make(self, row: _Row, law: motors.Law, made_of: tuple[object, ...] | None) -> None:
        self._is_new = True
        row.target.Clear()
        joint_target(row.joint.name, law, row.target)
        row.made_of, row.kind, row.friction = made_of, law.kind, law.friction
        row.part = getattr(row.target, law.kind)


def _within(value: float, least: float, most: float) -> float:
    """Returns the value, or the bound that it exceeds."""
    return value if least <= value <= most else most if value > most else least
