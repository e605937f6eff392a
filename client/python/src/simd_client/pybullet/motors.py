"""PyBullet's joint motors as targets of simd.

PyBullet's motor is a constraint on the joint's next velocity, held by an impulse of up to `force` h (btMultiBodyJointMotor):

    v+ = positionGain (target - q) / h + v + velocityGain (targetVelocity - v)

So its gains are per step of h seconds, and v is the joint's velocity without any motor. This is simd's servo
(`ServoTarget`), which the world computes again in each substep:

    v+ = velocity + rate (target - q) + slip v,  rate = positionGain / h, slip = 1 - velocityGain

A velocity target with a velocityGain of one has neither rate nor slip.

With substeps both hold for each of them: gains are per substep of h seconds. In each substep Bullet bounds a
motor's impulse by `force` times the whole time step. So its effort is bounded by `force` times the number of
substeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import constants

# h damping / inertia of a motor: 1e-5 of the difference between the velocities is left after a step.
STIFF = 1e5
# Maximum velocity of Bullet's joints until a script sets maxJointVelocity, rad/s or m/s.
FASTEST = 100.0
# Maximum values and gains of the daemon.
MAX = 1e12
# PyBullet's motors have no limit unless a force is given; this value replaces it.
NO_LIMIT = 100000.0
# Default motor of each joint, in N m s (or N s) per step or substep.
FIRST_IMPULSE = 1.0


@dataclass(slots=True)
class Motor:
    """Settings of PyBullet's motor of one joint."""

    mode: int = constants.VELOCITY_CONTROL
    position: float = 0.0
    velocity: float = 0.0
    # Maximum effort, N m or N; `None` means a new joint's impulse of 1 a step.
    force: float | None = None
    position_gain: float = 0.1
    velocity_gain: float = 1.0
    # Maximum velocity towards a position, rad/s or m/s; 0 means no limit.
    max_velocity: float = 0.0
    # TORQUE_CONTROL, for the next step only: the sum of the torques since the last one.
    torque: float | None = None
    # Settings other than position and velocity, which loops rarely change; a count of their changes.
    given: tuple[float, float, float, float] | None = None
    revision: int = 0

    def limit(self, h: float, parts: int = 1) -> float:
        """Maximum effort over a substep of h seconds; a step has `parts` substeps. An unlimited force stays
        unlimited."""
        if self.force is None:
            return FIRST_IMPULSE / h
        # The spring and damper of PD_CONTROL are a force and no impulse.
        return self.force if self.mode == constants.PD_CONTROL else self.force * parts


@dataclass(frozen=True, slots=True)
class MotorLoop:
    """The motors that a script last set together: a loop sets the same ones again, to other positions and
    velocities."""

    joints: list[int]
    mode: int
    forces: list[Any] | None
    position_gains: list[Any] | None
    velocity_gains: list[Any] | None
    motors: list[Motor]

    def is_like(self, joints: Any, mode: int, forces: Any, position_gains: Any, velocity_gains: Any) -> bool:
        """Whether only positions and velocities change."""
        return (
            mode == self.mode
            and _same(joints, self.joints)
            and _same(forces, self.forces)
            and _same(position_gains, self.position_gains)
            and _same(velocity_gains, self.velocity_gains)
        )

    def set(self, positions: list[float], velocities: list[float]) -> bool:
        """Changes these motors. Returns false, and changes none, if the daemon cannot take some of them
        unchanged."""
        if not self.motors or min(positions) < -MAX or max(positions) > MAX or min(velocities) < -MAX or max(velocities) > MAX:
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
    """A target of simd: servo, position, velocity or effort."""

    kind: str
    value: float = 0.0
    # Velocity of a servo at its target; for a position, the velocity that its damper pulls towards.
    velocity: float = 0.0
    rate: float = 0.0
    slip: float = 0.0
    stiffness: float | None = None
    damping: float | None = None
    feed_forward: float = 0.0
    max_effort: float | None = None
    max_velocity: float | None = None
    # Dry friction in addition to the joint's own, N m or N.
    friction: float = 0.0


def law(motor: Motor, inertia: float, h: float, parts: int = 1, fastest: float = FASTEST) -> Law:
    """Returns the target for the next step. Its `parts` substeps take `h` seconds each. The joint's actuator
    sees `inertia` (kg m^2 or kg), and the joint is no faster than `fastest`."""
    limit = motor.limit(h, parts)
    torque = motor.torque or 0.0
    if limit == 0.0 or motor.mode == constants.TORQUE_CONTROL:
        return Law("effort", torque) if torque else Law("passive")
    if motor.torque is not None and motor.mode == constants.VELOCITY_CONTROL and motor.velocity == 0.0:
        # A motor that brakes with at most its force, in addition to a torque, is dry friction.
        return Law("effort", torque, friction=limit)
    most = None if limit >= NO_LIMIT else limit + abs(torque)
    if motor.mode == constants.PD_CONTROL:
        # Gains in SI units, as in simd.
        return Law(
            "position",
            motor.position,
            velocity=motor.velocity,
            stiffness=max(motor.position_gain, 0.0),
            damping=max(motor.velocity_gain, 0.0),
            feed_forward=torque,
            max_effort=most,
        )
    damping = min(STIFF * inertia / h, MAX)
    gain = max(0.0, min(motor.velocity_gain, 2.0))
    if motor.mode == constants.VELOCITY_CONTROL and gain == 1.0:
        aim = max(-fastest, min(motor.velocity, fastest))
        return Law("velocity", aim, damping=damping, feed_forward=torque, max_effort=most)
    rate = max(motor.position_gain, 0.0) / h if motor.mode == constants.POSITION_CONTROL else 0.0
    return Law(
        "servo",
        motor.position,
        velocity=max(-MAX, min(gain * motor.velocity, MAX)),
        rate=min(rate, MAX),
        slip=1.0 - gain,
        damping=damping,
        feed_forward=torque,
        max_effort=min(limit + abs(torque), MAX),
        max_velocity=min(motor.max_velocity or fastest, fastest),
    )
