"""PyBullet's joint motors as targets of simd.

PyBullet's motor sets the joint's next velocity, held by up to `force` (btMultiBodyJointMotor):

    v+ = positionGain (target - q) / h + v + velocityGain (targetVelocity - v)

so its gains are per step of h seconds. simd's actuator is an implicit spring and damper
in SI units; over one step of a joint with inertia M it gives

    v+ = (v + (b / h) (target - q) + a targetVelocity) / (1 + a + b),  a = h damping / M, b = h^2 stiffness / M

A world that the script steps gets that law anew for each step, as a velocity target (`pursuit`): within the force, nothing else
bounds it. In a world that plays by itself it is a position target (`law`), on whose way the daemon speeds up and brakes with
half of the force.

With substeps both hold for each of them: gains are per substep of h seconds. Bullet bounds a motor's impulse by `force` times
the whole time step, in each substep anew, so that its effort is bounded by `force` times their number.

Equal coefficients give the gains below. A velocityGain of one needs infinite gains: a position target has that of `STIFFEST`, which
leaves 0.1 % of the effort's effect, and a velocity target that of `STIFF`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import constants

STIFFEST = 1.0 - 1.0 / 1000.0
# a of a velocity target for a velocityGain of one or more.
STIFF = 1e5
# And the least velocityGain: below it a is nothing, and the velocity that has an effect has no bound.
_SOFTEST = 1e-6
# Largest velocity of Bullet's joints until a script sets maxJointVelocity, rad/s or m/s.
FASTEST = 100.0
# Values and gains that the daemon takes.
MOST = 1e12
# PyBullet's motors have no limit unless a force is given; this value replaces it.
NO_LIMIT = 100000.0
# The motor that each joint has from the start, in N m s (or N s) per step or substep.
FIRST_IMPULSE = 1.0


@dataclass(slots=True)
class Motor:
    """The settings of PyBullet's motor of one joint."""

    mode: int = constants.VELOCITY_CONTROL
    position: float = 0.0
    velocity: float = 0.0
    # The most effort, N m or N; `None` means a new joint's impulse of 1 a step.
    force: float | None = None
    position_gain: float = 0.1
    velocity_gain: float = 1.0
    # On the way to a position, rad/s or m/s; 0 is no limit.
    max_velocity: float = 0.0
    # TORQUE_CONTROL, for the next step only: the sum of what was asked for since the last one.
    torque: float | None = None
    # What the script gave beside position and velocity, which loops alone change.
    given: tuple[float, float, float, float] | None = None

    def limit(self, h: float, parts: int = 1) -> float:
        """The most effort over a substep of h seconds, of which a step has `parts`. A force without a limit stays one."""
        if self.force is None:
            return FIRST_IMPULSE / h
        # The spring and damper of PD_CONTROL are a force and no impulse.
        return self.force if self.mode == constants.PD_CONTROL else self.force * parts


@dataclass(frozen=True, slots=True)
class MotorLoop:
    """The motors that a script set together last: a loop sets the same ones again, to other positions and velocities."""

    joints: list[int]
    mode: int
    forces: list[Any] | None
    position_gains: list[Any] | None
    velocity_gains: list[Any] | None
    motors: list[Motor]

    def is_like(self, joints: Any, mode: int, forces: Any, position_gains: Any, velocity_gains: Any) -> bool:
        """Whether nothing else changes."""
        return (
            mode == self.mode
            and _same(joints, self.joints)
            and _same(forces, self.forces)
            and _same(position_gains, self.position_gains)
            and _same(velocity_gains, self.velocity_gains)
        )

    def set(self, positions: list[float], velocities: list[float]) -> bool:
        """Changes those, unless there are some that the daemon does not take as they are."""
        if not self.motors or min(positions) < -MOST or max(positions) > MOST or min(velocities) < -MOST or max(velocities) > MOST:
            return False
        for motor, position, velocity in zip(self.motors, positions, velocities, strict=True):
            motor.position, motor.velocity = position, velocity
        return True


def _same(given: Any, known: list[Any] | None) -> bool:
    """Whether a script's argument has these values."""
    if given is None or known is None or not hasattr(given, "__iter__"):
        return given is known
    return (given if type(given) is list else [*given]) == known


@dataclass(frozen=True, slots=True)
class Law:
    """A target of simd: a position's, a velocity's, or an effort's."""

    kind: str
    value: float = 0.0
    # Of a position: the velocity that its damper pulls towards.
    damper_velocity: float = 0.0
    stiffness: float | None = None
    damping: float | None = None
    feed_forward: float = 0.0
    max_effort: float | None = None
    max_velocity: float | None = None
    # Dry friction beside the joint's own, N m or N.
    friction: float = 0.0


def pursued(
    motor: Motor,
    position: float,
    velocity: float,
    h: float,
    parts: int = 1,
    fastest: float = FASTEST,
    is_alone: bool = True,
) -> tuple[float, float]:
    """The velocity that a position target asks for from where the joint is, for a step of `parts` substeps of `h` seconds each, and
    the velocityGain with which. No joint is faster than `fastest`. What a velocityGain below one leaves of the velocity before is left to
    the damper where the joint `is_alone`, as its inertia is known then; among others that is the velocity of the last step."""
    kp, kd = motor.position_gain, motor.velocity_gain
    if parts > 1:
        # Each substep removes its part of what is left: the mean of that.
        kp = (1.0 - (1.0 - kp) ** parts) / parts
    correction = kp * (motor.position - position) / h
    after = correction + (1.0 - kd) * velocity + kd * motor.velocity
    most = min(motor.max_velocity or fastest, fastest)
    if kd >= 1.0 or not is_alone or abs(after) > most:
        return max(-most, min(after, most)), 1.0
    kd = max(kd, _SOFTEST)
    return max(-MOST, min(motor.velocity + correction / kd, MOST)), kd


def pursuit(motor: Motor, velocity: float, gain: float, inertia: float, h: float, parts: int = 1) -> Law:
    """The target that has this velocity, with this gain, after the next step (`pursued`), if the force is enough for that."""
    limit, torque = motor.limit(h, parts), motor.torque or 0.0
    if limit == 0.0:
        return Law("effort", torque) if torque else Law("passive")
    damping, most = _damping(gain, inertia, h), min(limit + abs(torque), MOST)
    return Law("velocity", velocity, damping=damping, feed_forward=torque, max_effort=most)


def _damping(gain: float, inertia: float, h: float) -> float:
    """Of a velocity target with this velocityGain, N m s/rad or N s/m."""
    a = STIFF if gain >= 1.0 else min(max(gain, 0.0) / (1.0 - gain), STIFF)
    return min(a * inertia / h, MOST)


def law(motor: Motor, inertia: float, h: float, parts: int = 1) -> Law:
    """The target for the next step, whose `parts` substeps take `h` seconds each, of a joint whose actuator sees
    `inertia` (kg m^2 or kg)."""
    limit = motor.limit(h, parts)
    torque = motor.torque or 0.0
    # A bound above any effort that occurs is left out: simd would plan the motion with it.
    most = None if limit >= NO_LIMIT else limit
    if limit == 0.0 or motor.mode == constants.TORQUE_CONTROL:
        return Law("effort", torque) if torque else Law("passive")
    if motor.torque is not None and motor.mode == constants.VELOCITY_CONTROL and motor.velocity == 0.0:
        # A motor that brakes with at most its force, beside a torque, is dry friction.
        return Law("effort", torque, friction=limit)
    if most is not None:
        most += abs(torque)
    if motor.mode == constants.VELOCITY_CONTROL:
        damping = _damping(motor.velocity_gain, inertia, h)
        return Law("velocity", motor.velocity, damping=damping, feed_forward=torque, max_effort=most)
    if motor.mode == constants.PD_CONTROL:
        # SI gains, as simd has them.
        return Law(
            "position",
            motor.position,
            damper_velocity=motor.velocity,
            stiffness=max(motor.position_gain, 0.0),
            damping=max(motor.velocity_gain, 0.0),
            feed_forward=torque,
            max_effort=most,
        )
    stiffness, damping, velocity = gains(motor, inertia, h)
    return Law(
        "position",
        motor.position,
        damper_velocity=velocity,
        stiffness=stiffness,
        damping=damping,
        feed_forward=torque,
        max_effort=most,
        max_velocity=motor.max_velocity or None,
    )


def gains(motor: Motor, inertia: float, h: float) -> tuple[float, float, float]:
    """Stiffness, damping, and the damper's velocity of PyBullet's position law."""
    kp = max(motor.position_gain, 0.0)
    kd = min(max(motor.velocity_gain, 0.0), STIFFEST)
    whole = 1.0 / (1.0 - kd)
    b = kp * whole
    a = max(whole - 1.0 - b, 0.0)
    velocity = motor.velocity_gain * motor.velocity * (1.0 + a + b) / a if a > 0.0 else 0.0
    return min(b * inertia / (h * h), MOST), min(a * inertia / h, MOST), velocity
