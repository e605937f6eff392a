"""PyBullet's law of a motor against the gains that stand for it, without a daemon."""

from __future__ import annotations

import math
import random

import pytest

from simd_client.pybullet import constants
from simd_client.pybullet.motors import Law, Motor, law, pursued, pursuit


def bullet(motor: Motor, q: float, qd: float, h: float) -> float:
    """The velocity after a step, of btMultiBodyJointMotor without its force limit."""
    towards = (
        motor.position_gain * (motor.position - q) / h if motor.mode == constants.POSITION_CONTROL else 0.0
    )
    return towards + qd + motor.velocity_gain * (motor.velocity - qd)


def implicit(target: Law, inertia: float, q: float, qd: float, h: float) -> float:
    """The velocity after a step, of simd's actuator on a free joint: docs/physics.md."""
    kp, kd = target.stiffness or 0.0, target.damping
    if target.kind == "velocity":
        kd = 1000.0 * inertia / h if kd is None else kd
        impulse, velocity = 0.0, target.value
    else:
        impulse, velocity = h * kp * (target.value - q), target.damper_velocity
    assert kd is not None
    return (inertia * qd + impulse + h * kd * velocity) / (inertia + h * kd + h * h * kp)


@pytest.mark.parametrize("mode", [constants.POSITION_CONTROL, constants.VELOCITY_CONTROL])
def test_a_step_is_bullets(mode: int) -> None:
    """To 0.1 % of the velocities that a velocityGain of one lets through, and exactly below it."""
    rng = random.Random(3)
    for _ in range(2000):
        h, inertia = 10 ** rng.uniform(-4.0, -2.0), 10 ** rng.uniform(-4.0, 2.0)
        kd = rng.choice([1.0, rng.uniform(0.3, 0.99)])
        kp = rng.uniform(0.01, 0.25)
        motor = Motor(mode, rng.uniform(-2, 2), rng.uniform(-2, 2), None, kp, kd)
        q, qd = rng.uniform(-2, 2), rng.uniform(-2, 2)
        wanted = bullet(motor, q, qd, h)
        got = implicit(law(motor, inertia, h), inertia, q, qd, h)
        assert got == pytest.approx(wanted, abs=(0.0021 if kd == 1.0 else 1e-9) * (2.0 + abs(wanted)))


def test_the_velocity_that_a_position_asks_for_is_bullets() -> None:
    """For all gains, also where the motor moves among others: then what is left of the velocity before is put in, and not damped."""
    rng = random.Random(4)
    for _ in range(2000):
        h, inertia = 10 ** rng.uniform(-4.0, -2.0), 10 ** rng.uniform(-4.0, 2.0)
        kp, kd = rng.uniform(-0.1, 2.0), rng.choice([0.0, 1.0, 1.5, rng.uniform(0.01, 0.99)])
        motor = Motor(constants.POSITION_CONTROL, rng.uniform(-2, 2), rng.uniform(-2, 2), 100.0, kp, kd)
        q, qd = rng.uniform(-2, 2), rng.uniform(-2, 2)
        wanted = max(-100.0, min(bullet(motor, q, qd, h), 100.0))
        for is_alone in (True, False):
            velocity, gain = pursued(motor, q, qd, h, is_alone=is_alone)
            got = implicit(pursuit(motor, velocity, gain, inertia, h), inertia, q, qd, h)
            assert got == pytest.approx(wanted, abs=2e-5 * (2.0 + abs(wanted)))


def test_a_motor_without_force_lets_go() -> None:
    assert law(Motor(force=0.0), 1.0, 0.01) == Law("passive")
    assert law(Motor(force=0.0, torque=2.5), 1.0, 0.01) == Law("effort", 2.5)


def test_a_motor_that_brakes_beside_a_torque_is_friction() -> None:
    assert law(Motor(force=10.0, torque=30.0), 1.0, 0.01) == Law("effort", 30.0, friction=10.0)


def test_a_new_joint_is_braked_by_an_impulse_of_one_each_step() -> None:
    braked = law(Motor(), 1.0, 1.0 / 240.0)
    assert braked.kind == "velocity" and braked.value == 0.0
    assert braked.max_effort == pytest.approx(240.0)


def test_substeps_bound_the_impulse_of_a_whole_step_each() -> None:
    """btMultiBodyJointMotor has force times the time step, and the first impulse, in each of them; PD_CONTROL is a force."""
    h = 1.0 / 960.0
    assert law(Motor(force=5.0), 1.0, h, 4).max_effort == 20.0
    assert law(Motor(), 1.0, h, 4).max_effort == pytest.approx(960.0)
    assert law(Motor(force=10.0, torque=30.0), 1.0, h, 4) == Law("effort", 30.0, friction=40.0)
    assert law(Motor(constants.PD_CONTROL, force=5.0), 1.0, h, 4).max_effort == 5.0
    assert law(Motor(force=100000.0), 1.0, h, 4).max_effort is None


def test_pybullets_way_of_no_limit_is_no_limit() -> None:
    assert law(Motor(force=100000.0), 1.0, 0.01).max_effort is None


def test_gains_of_any_size_are_finite() -> None:
    for kp in (0.0, 0.1, 1.0, 50.0):
        for kd in (0.0, 0.5, 1.0, 20.0):
            target = law(Motor(constants.POSITION_CONTROL, 1.0, 0.5, 5.0, kp, kd), 0.01, 1e-4)
            assert all(
                value is None or math.isfinite(value)
                for value in (target.stiffness, target.damping, target.damper_velocity)
            )
