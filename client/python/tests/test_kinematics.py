"""Kinematics of a robot agree with each other and with the motion of the world."""

from __future__ import annotations

import numpy as np
import pytest

import simd_client
from simd_client import Configuration, Robot, Simulation


def test_link_states_are_where_the_links_are(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints([0.3, -0.4], [0.5, 0.6])
    states = arm.link_states()
    poses = arm.link_poses()
    np.testing.assert_allclose(states.poses[2, :3], poses["forearm"].position, atol=1e-12)
    jacobian = arm.jacobian("forearm")
    # The twist of a link is its Jacobian times the joint velocities.
    np.testing.assert_allclose(jacobian.linear @ [0.5, 0.6], states.twists[2, :3], atol=1e-9)
    np.testing.assert_allclose(jacobian.angular @ [0.5, 0.6], states.twists[2, 3:], atol=1e-9)


def test_inverse_dynamics_is_the_mass_matrix_times_accelerations_beside_gravity(arm: Robot) -> None:
    there = Configuration(positions=[0.2, 0.7])
    mass = arm.mass_matrix(there)
    np.testing.assert_allclose(mass, np.transpose(mass), atol=1e-12)
    assert np.all(np.linalg.eigvalsh(mass) > 0)
    gravity = arm.inverse_dynamics(configuration=there)
    np.testing.assert_allclose(
        arm.inverse_dynamics([1.0, -2.0], there), mass @ [1.0, -2.0] + gravity, atol=1e-9
    )


def test_inverse_kinematics_finds_positions_that_lead_there(sim: Simulation, arm: Robot) -> None:
    arm.reset_joints([0.4, 0.5])
    point = (0.1, 0.0, 0.0)
    pose = arm.link_poses()["forearm"]
    target = (pose.matrix() @ [*point, 1.0])[:3]
    arm.reset_joints([0.2, 0.3])
    found = arm.inverse_kinematics("forearm", target, point=point, tolerance=1e-6)
    assert found.converged and found.position_error < 1e-6
    arm.reset_joints(found.positions)
    np.testing.assert_allclose((arm.link_poses()["forearm"].matrix() @ [*point, 1.0])[:3], target, atol=1e-5)


def test_a_link_that_is_not_there_and_a_configuration_without_positions_are_refused(arm: Robot) -> None:
    with pytest.raises(simd_client.LinkNotFound):
        arm.jacobian("hand")
    with pytest.raises(ValueError, match="begins with its positions"):
        arm.mass_matrix(Configuration(velocities=[0.0, 0.0]))
