"""Spherical joints: read, reset and driven by quaternions."""

from __future__ import annotations

import numpy as np
import pytest
from daemon import ASSETS

from simd_client import JointMode, Robot, Simulation, Target, Whole
from simd_client.geometry import FloatArray

PLACE = np.array([0.48, 0.0, 0.64, 0.6])
PENDULUM = ASSETS.parent / "reference/robots/ball_pendulum.urdf"


@pytest.fixture
def pendulum(sim: Simulation) -> Robot:
    sim.set_physics(gravity=(0, 0, 0))
    return sim.load(PENDULUM, name="pendulum", fixed=True)


def apart(one: FloatArray, other: FloatArray) -> float:
    """Returns the angle between two orientations."""
    return 2.0 * float(np.arccos(min(1.0, abs(float(one @ other)))))


def test_a_spherical_joint_is_a_quaternion_and_three_velocities(pendulum: Robot) -> None:
    ball = pendulum.joints["ball"]
    assert str(ball.type) == "spherical" and ball.axis is None and ball.info.dof == 3
    np.testing.assert_array_equal(pendulum.position, [0, 0, 0, 1])
    ball.reset(PLACE, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(pendulum.position, PLACE, atol=1e-15)
    np.testing.assert_array_equal(pendulum.velocity, [1, 2, 3])
    pendulum.reset_joints([0, 0, 0, 2], [0, 0, 0.5])
    np.testing.assert_array_equal(pendulum.position, [0, 0, 0, 1])
    np.testing.assert_array_equal(ball.read().velocities, [0, 0, 0.5])
    with pytest.raises(ValueError, match="4 values"):
        _ = ball.position


def test_its_targets_are_orientations_velocities_and_torques(sim: Simulation, pendulum: Robot) -> None:
    ball = pendulum.joints["ball"]
    for ask in [
        lambda: ball.set_target(Target.orientation(PLACE)),
        lambda: ball.set_target(PLACE.tolist()),
        lambda: pendulum.set_targets(Whole.positions(PLACE)),
    ]:
        ball.reset([0.0, 0.0, 0.0, 1.0])
        ask()
        assert ball.mode is JointMode.POSITION
        np.testing.assert_allclose(ball.read().targets, 2.0 * np.arccos(0.6) * np.array([0.6, 0.0, 0.8]), atol=1e-12)
        sim.step(500)
        assert apart(pendulum.position, PLACE) < 1e-6
    ball.set_target(Target.angular_velocity([0.0, 0.5, 1.0]))
    sim.step(300)
    np.testing.assert_allclose(pendulum.velocity, [0.0, 0.5, 1.0], atol=1e-2)
    ball.set_target(Target.torque([0.1, 0.0, -0.2]))
    sim.step()
    np.testing.assert_array_equal(pendulum.effort, [0.1, 0.0, -0.2])
    ball.set_passive()
    assert pendulum.read().mode.tolist() == [JointMode.PASSIVE] * 3


def test_it_starts_at_an_orientation(sim: Simulation) -> None:
    ball = sim.load(PENDULUM, name="turned", fixed=True, joint_positions={"ball": PLACE}).joints["ball"]
    np.testing.assert_allclose(ball.read().positions, PLACE, atol=1e-15)
    # A quaternion of any length is accepted.
    other = sim.load(PENDULUM, name="other", fixed=True, joint_positions={"ball": [0, 0, 0, 2]})
    np.testing.assert_array_equal(other.position, [0, 0, 0, 1])
    with pytest.raises(ValueError, match="the orientation of joint 'ball' has 4 numbers"):
        sim.load(PENDULUM, name="wrong", fixed=True, joint_positions={"ball": [0, 0, 1]})
    with pytest.raises(Exception, match="joint_orientations"):
        sim.load(PENDULUM, name="wrong", fixed=True, joint_positions={"ball": 0.5})
