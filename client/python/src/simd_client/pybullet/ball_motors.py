"""PyBullet's motors of spherical joints as targets of simd, and the frames of such joints.

The law of `motors.py` about each of the child's three axes (btMultiBodySphericalJointMotor), with the
rotation from the joint to its target as the position error. Bullet expresses orientations and velocities of a
spherical joint in the axes of the child's inertia, simd in the link's axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from simd_client.proto import JointTarget, SphericalReset

from . import constants
from .arguments import ORIGIN, UPRIGHT, Quaternion, Vector
from .motors import MAX, NO_LIMIT
from .rotations import conjugate, product, rotate

FIRST_GAIN = 0.2
# The largest velocityGain: one would need infinite gains. It leaves 0.1 % of the effort's effect.
_STIFFEST = 1.0 - 1.0 / 1000.0


@dataclass(slots=True)
class BallMotor:
    """The settings of PyBullet's motor of one spherical joint, in Bullet's axes."""

    mode: int = constants.POSITION_CONTROL
    orientation: Quaternion = UPRIGHT
    velocity: Vector = ORIGIN
    # Maximum torque about each axis, N m. A new joint swings freely: PyBullet 3.2.7's does, although it has a
    # motor.
    force: float = 0.0
    position_gain: float = FIRST_GAIN
    velocity_gain: float = 1.0
    max_velocity: float = 0.0
    # TORQUE_CONTROL, for the next step only: the sum of the torques since the last one.
    torque: Vector | None = None
    # Torque of the last step.
    torque_sent: Vector = ORIGIN


def unit(values: Sequence[float]) -> Quaternion:
    """Returns a quaternion of unit length; a quaternion of length zero becomes no rotation."""
    x, y, z, w = values
    length = math.hypot(x, y, z, w)
    return (x / length, y / length, z / length, w / length) if length > 0.0 else UPRIGHT


def to_simd(orientation: Quaternion, turn: Quaternion) -> Quaternion:
    """Returns Bullet's orientation in the link's axes; `turn` is link_from_inertia."""
    return product(product(turn, orientation), conjugate(turn))


def to_bullet(orientation: Quaternion, turn: Quaternion) -> Quaternion:
    """Returns the link's orientation in Bullet's axes."""
    return product(product(conjugate(turn), orientation), turn)


def spherical_reset(orientation: Quaternion, velocity: Vector, turn: Quaternion, reset: SphericalReset) -> None:
    """Sets a reset from Bullet's numbers."""
    q = reset.orientation
    q.x, q.y, q.z, q.w = to_simd(orientation, turn)
    w = reset.angular_velocity
    w.x, w.y, w.z = rotate(turn, velocity)


def _gains(position_gain: float, velocity_gain: float, inertia: float, h: float) -> tuple[float, float, float]:
    """Returns stiffness and damping with the effect of these gains in one step, and the damper's velocity for
    a target of one:

    v+ = (v + (b / h) (target - q) + a velocity) / (1 + a + b),  a = h damping / inertia, b = h^2 stiffness / inertia
    """
    kp = max(position_gain, 0.0)
    whole = 1.0 / (1.0 - min(max(velocity_gain, 0.0), _STIFFEST))
    b = kp * whole
    a = max(whole - 1.0 - b, 0.0)
    velocity = velocity_gain * (1.0 + a + b) / a if a > 0.0 else 0.0
    return min(b * inertia / (h * h), MAX), min(a * inertia / h, MAX), velocity


def ball_target(
    joint: str, motor: BallMotor, inertia: float, h: float, turn: Quaternion, target: JointTarget, parts: int = 1
) -> None:
    """Sets `target` to the motor's law for the next step. Its `parts` substeps take `h` seconds each, and the
    joint's actuator sees `inertia` (kg m^2) about an axis."""
    target.joint = joint
    limit = motor.force if motor.mode == constants.PD_CONTROL else motor.force * parts
    torque = rotate(turn, motor.torque) if motor.torque is not None else ORIGIN
    if limit == 0.0 or motor.mode == constants.TORQUE_CONTROL:
        if motor.torque is None:
            target.passive.SetInParent()
        else:
            t = target.spherical_effort.torque
            t.x, t.y, t.z = torque
        return
    velocity = rotate(turn, motor.velocity)
    most = None if limit >= NO_LIMIT else limit + max(map(abs, torque))
    if motor.mode == constants.VELOCITY_CONTROL:
        keep = target.spherical_velocity
        w, ff = keep.angular_velocity, keep.feed_forward_torque
        if motor.velocity_gain < _STIFFEST:
            keep.damping = inertia / h * max(motor.velocity_gain, 0.0) / (1.0 - motor.velocity_gain)
    else:
        keep = target.spherical_position
        w, ff = keep.angular_velocity, keep.feed_forward_torque
        q = keep.orientation
        q.x, q.y, q.z, q.w = to_simd(motor.orientation, turn)
        if motor.mode == constants.PD_CONTROL:
            keep.stiffness, keep.damping = motor.position_gain, motor.velocity_gain
        else:
            keep.stiffness, keep.damping, part = _gains(motor.position_gain, motor.velocity_gain, inertia, h)
            velocity = (velocity[0] * part, velocity[1] * part, velocity[2] * part)
            if motor.max_velocity:
                keep.max_velocity = motor.max_velocity
    w.x, w.y, w.z = velocity
    ff.x, ff.y, ff.z = torque
    if most is not None:
        keep.max_effort = most
