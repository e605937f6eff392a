"""The targets that a step takes along, in messages that are kept from step to step.

A loop sets the same motors at each step, and of each motor one number. So messages are made once; while the same motors change,
only that number is put into them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from simd_client.proto import JointTarget, RobotTargets, SetJointTargetsRequest, StepSimulationRequest

from . import constants, motors
from .ball_motors import ball_target
from .bodies import Body, BodyJoint
from .targets import joint_target

Key = tuple[int, int]
"""Number of the body, index of the joint."""

Values = tuple[float, float]
"""Position and velocity of a joint of one axis."""

Friction = tuple[Body, list[tuple[BodyJoint, float]]]
"""Joints of a body whose dry friction changes with their motors, N m or N."""


@dataclass(slots=True)
class _Row:
    """One motor, and its index in the request."""

    joint: BodyJoint
    target: JointTarget
    key: Key
    # Nothing else of its robot moves.
    is_alone: bool = False
    # What the target was made of, but for the number that loops change; None where it is to be made again.
    made_of: tuple[object, ...] | None = None
    # Where that number is: `position`, `velocity` or `effort` in the part of the same name.
    kind: str = ""
    part: Any = None
    # Dry friction that the motor brings, N m or N.
    friction: float = 0.0
    # Last value sent for a position target; see `motors.pursued`.
    pursued: tuple[float, float] | None = None


# rad/s or m/s: a velocity that changes by no more is not sent again.
_SAME = 1e-9


class Outgoing:
    """What the next step takes along."""

    def __init__(self) -> None:
        self._request = StepSimulationRequest(steps=1, return_states=True)
        # For steps before which no motor has changed: what is in the other one stays as it is.
        self._plain = StepSimulationRequest(steps=1, return_states=True)
        self._is_empty = True
        self._keys: list[Key] = []
        self._robots: list[tuple[Body, list[_Row]]] = []
        # Seconds of a substep, and how many a step has.
        self._step = (0.0, 1)
        self._with_torques = True
        self._pursuing: Mapping[Key, Values] = {}
        # Whether any of the motors that were put in last has a torque for the next step.
        self.has_torques = False

    def step(self, links: bool, contacts: bool, steps: int = 1) -> StepSimulationRequest:
        """The request of a step with what was put in last, which answers also with states of links or with contact points."""
        request = self._plain if self._is_empty else self._request
        request.return_link_states = links
        request.return_contacts = contacts
        request.steps = steps
        return request

    def targets(self) -> SetJointTargetsRequest:
        """The same targets without a step."""
        return SetJointTargetsRequest(robots=() if self._is_empty else self._request.robots)

    def put(
        self,
        waiting: Iterable[Key],
        bodies: Mapping[int, Body],
        time_step: float,
        substeps: int = 1,
        with_torques: bool = True,
        pursuing: Mapping[Key, Values] | None = None,
        is_due: bool = True,
    ) -> list[Friction]:
        """Puts in the targets of these motors and of no others, for steps of so many seconds and substeps, with the torques
        for the next step or without. Those that are `pursuing` go to a position from where they are, which only they need: where
        their velocities stay as they are, nothing is put in unless it `is_due`. Returns the frictions that have to be set before they
        hold."""
        self.has_torques, self._with_torques = False, with_torques
        self._pursuing = pursuing or {}
        keys, step = list(waiting), (time_step / max(substeps, 1), max(substeps, 1))
        self._is_empty = not keys
        if not keys:
            return []
        is_same = keys == self._keys and step == self._step
        if not is_same or any(bodies.get(body.unique_id) is not body for body, _ in self._robots):
            self._keys, self._step = keys, step
            self._lay_out(bodies)
        elif not is_due and not self._has_news():
            self._is_empty = True
            return []
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
            is_alone = body.fixed and sum(joint.width for joint in body.joints) == 1
            rows = [_Row(body.joints[index], message.joints.add(), (number, index), is_alone) for index in indices]
            self._robots.append((body, rows))

    def _has_news(self) -> bool:
        """Whether a motor on its way to a position needs another velocity than it had last."""
        for _, rows in self._robots:
            for row in rows:
                values = self._pursuing.get(row.key)
                if values is None or row.pursued is None:
                    return True
                velocity, gain = _pursued(row, values, self._step)
                if abs(velocity - row.pursued[0]) > _SAME or gain != row.pursued[1]:
                    return True
        return False

    def _put(self, body: Body, row: _Row) -> None:
        joint = row.joint
        if joint.ball is not None:
            h, parts = self._step
            row.target.Clear()
            turn, ball = body.frame(joint.link)[1], joint.ball
            if ball.torque is not None:
                self.has_torques = True
                ball = ball if self._with_torques else replace(ball, torque=None)
            ball_target(joint.name, ball, joint.inertia, h, turn, row.target, parts)
            return
        motor = joint.motor
        torque, mode = motor.torque, motor.mode
        if torque is not None:
            self.has_torques = True
            if not self._with_torques:
                motor, torque = replace(motor, torque=None), None
        made_of: tuple[object, ...] | None = None
        values = self._pursuing.get(row.key) if mode == constants.POSITION_CONTROL else None
        row.pursued = None
        if values is not None:
            row.pursued = velocity, gain = _pursued(row, values, self._step)
            made_of = None if torque is not None else ("pursuit", motor.force, gain)
            if made_of is None or made_of != row.made_of:
                self._make(row, motors.pursuit(motor, velocity, gain, joint.inertia, *self._step), made_of)
            elif row.kind == "velocity":
                row.part.velocity = velocity
            return
        if torque is not None:
            if torque and (motor.force == 0.0 or mode == constants.TORQUE_CONTROL):
                made_of = ("effort",)
        elif mode == constants.VELOCITY_CONTROL:
            made_of = (mode, motor.force, motor.velocity_gain)
        else:
            made_of = (
                mode,
                motor.force,
                motor.position_gain,
                motor.velocity_gain,
                motor.velocity,
                motor.max_velocity,
            )
        if made_of is None or made_of != row.made_of:
            self._make(row, motors.law(motor, joint.inertia, *self._step), made_of)
        elif row.kind == "position":
            row.part.position = motor.position
        elif row.kind == "velocity":
            row.part.velocity = motor.velocity
        elif row.kind == "effort":
            row.part.effort = torque

    def _make(self, row: _Row, law: motors.Law, made_of: tuple[object, ...] | None) -> None:
        row.target.Clear()
        joint_target(row.joint.name, law, row.target)
        row.made_of, row.kind, row.friction = made_of, law.kind, law.friction
        row.part = getattr(row.target, law.kind)


def _pursued(row: _Row, values: Values, step: tuple[float, int]) -> tuple[float, float]:
    fastest = row.joint.limits[3]
    most = motors.FASTEST if fastest is None else fastest
    return motors.pursued(row.joint.motor, *values, *step, most, row.is_alone)
