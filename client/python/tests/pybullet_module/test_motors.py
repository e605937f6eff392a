"""PyBullet's law of a motor against the target that stands for it, without a daemon."""

from __future__ import annotations

import math
import random

import pytest

from simd_client.pybullet import constants
from simd_client.pybullet.motors import Law, Motor, law


def bullet(motor: Motor, q: float, free: float, h: float) -> float:
    """Returns the velocity after a step, of btMultiBodyJointMotor without its force limit. `free` is the
    velocity without the motor."""
    towards = (
        motor.position_gain * (motor.position - q) / h if motor.mode == constants.POSITION_CONTROL else 0.0
    )
    return towards + free + motor.velocity_gain * (motor.velocity - free)


def aimed_at(target: Law, q: float, free: float) -> float:
    """Returns the velocity after a step, of simd's targets: docs/physics.md."""
    if target.kind == "velocity":
        return target.value
    assert target.kind == "servo"
    most = target.max_velocity or 0.0
    return max(-most, min(target.velocity + target.rate * (target.value - q) + target.slip * free, most))


@pytest.mark.parametrize("mode", [constants.POSITION_CONTROL, constants.VELOCITY_CONTROL])
def test_a_step_is_bullets_for_all_gains(mode: int) -> None:
    rng = random.Random(3)
    for _ in range(2000):
        h, inertia = 10 ** rng.uniform(-4.0, -2.0), 10 ** rng.uniform(-4.0, 2.0)
        kp, kd = rng.uniform(0.0, 2.0), rng.choice([0.0, 1.0, 1.5, rng.uniform(0.01, 0.99)])
        motor = Motor(mode, rng.uniform(-2, 2), rng.uniform(-2, 2), 100.0, kp, kd)
        q, free = rng.uniform(-2, 2), rng.uniform(-2, 2)
        wanted = max(-100.0, min(bullet(motor, q, free, h), 100.0))
        assert aimed_at(law(motor, inertia, h), q, free) == pytest.approx(wanted, abs=1e-9)


def test_max_velocity_bounds_the_way() -> None:
    motor = Motor(constants.POSITION_CONTROL, 1.0, 0.0, 100.0, 0.1, 1.0, 0.5)
    assert aimed_at(law(motor, 1.0, 0.01), 0.0, 0.0) == 0.5
    assert aimed_at(law(motor, 1.0, 0.01, fastest=0.25), 0.0, 0.0) == 0.25


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


def test_gains_of_any_size_are_finite_and_within_the_bounds_of_the_daemon() -> None:
    for kp in (-1.0, 0.0, 0.1, 1.0, 1e12):
        for kd in (-1.0, 0.0, 0.5, 1.0, 1e12):
            target = law(Motor(constants.POSITION_CONTROL, 1.0, 1e12, 5.0, kp, kd), 0.01, 1e-6)
            assert 0.0 <= target.rate <= 1e12 and -1.0 <= target.slip <= 1.0
            assert math.isfinite(target.velocity) and target.damping is not None and target.damping <= 1e12
