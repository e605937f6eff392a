"""Spherical joints compared with PyBullet's."""

from __future__ import annotations

import math
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from .conftest import REPOSITORY

PENDULUM = REPOSITORY / "tests/reference/robots/ball_pendulum.urdf"
PLACE, SPIN = (0.48, 0.0, 0.64, 0.6), (1.0, 2.0, 3.0)


@pytest.fixture
def turned(tmp_path: Path) -> str:
    """A pendulum with rotated axes of inertia: Bullet expresses a joint's orientations in them."""
    text = PENDULUM.read_text().replace('-0.4"/>', '-0.4" rpy="0.4 0.5 -0.6"/>')
    assert "0.5 -0.6" in text
    urdf = tmp_path / "turned.urdf"
    urdf.write_text(text)
    return str(urdf)


def test_a_spherical_joint_is_reported_as_pybullet_does(script: ModuleType, bullet: Any, turned: str) -> None:
    ours, theirs = (each.loadURDF(turned, useFixedBase=True) for each in (script, bullet))
    got, wanted = (each.getJointInfo(body, 0) for each, body in ((script, ours), (bullet, theirs)))
    assert got[:5] == wanted[:5] and got[2] == script.JOINT_SPHERICAL
    assert got[14] == pytest.approx(wanted[14], abs=1e-6)
    assert got[15] == pytest.approx(wanted[15], abs=1e-6)
    assert script.computeDofCount(ours) == 3


def test_a_reset_puts_it_where_pybullet_does(script: ModuleType, bullet: Any, turned: str) -> None:
    seen: list[Any] = []
    for each in (script, bullet):
        body = each.loadURDF(turned, useFixedBase=True)
        each.resetJointStateMultiDof(body, 0, PLACE, SPIN)
        position, velocity, reaction, _ = each.getJointStateMultiDof(body, 0)
        assert position == pytest.approx(PLACE, abs=1e-7) and velocity == pytest.approx(SPIN, abs=1e-7)
        assert len(reaction) == 6
        link = each.getLinkState(body, 0, computeLinkVelocity=1, computeForwardKinematics=1)
        seen.append((link[4], link[5], link[7]))
    for got, wanted in zip(*seen, strict=True):
        assert got == pytest.approx(wanted, abs=1e-6)


def test_a_motor_turns_it_to_an_orientation_and_holds_it_there(script: ModuleType, turned: str) -> None:
    script.setGravity(0, 0, -9.81)
    body = script.loadURDF(turned, useFixedBase=True)
    script.setJointMotorControlMultiDof(
        body, 0, script.POSITION_CONTROL, targetPosition=PLACE, positionGain=0.2, velocityGain=1, force=[200, 200, 200]
    )
    for _ in range(480):
        script.stepSimulation()
    position, velocity, _, torque = script.getJointStateMultiDof(body, 0)
    assert abs(sum(a * b for a, b in zip(position, PLACE, strict=True))) > 1.0 - 1e-5
    assert max(map(abs, velocity)) < 1e-3 and 0.5 < max(map(abs, torque)) < 200.0
    # Released, it falls.
    script.setJointMotorControlMultiDof(body, 0, script.POSITION_CONTROL, targetPosition=PLACE, force=[0, 0, 0])
    for _ in range(60):
        script.stepSimulation()
    assert max(map(abs, script.getJointStateMultiDof(body, 0)[1])) > 0.5


def test_a_new_joint_swings_as_pybullets_does(script: ModuleType, bullet: Any, turned: str) -> None:
    for each in (script, bullet):
        each.setGravity(0, 0, -9.81)
        body = each.loadURDF(turned, useFixedBase=True)
        each.resetJointStateMultiDof(body, 0, PLACE)
        for _ in range(60):
            each.stepSimulation()
        position = each.getJointStateMultiDof(body, 0)[0]
        turned_by = 2.0 * math.acos(min(1.0, abs(sum(a * b for a, b in zip(position, PLACE, strict=True)))))
        assert turned_by > 0.2, (each, position)


def test_torques_of_a_step_add_up_and_last_it_and_are_none_of_the_motors(
    script: ModuleType, bullet: Any, turned: str
) -> None:
    for each in (script, bullet):
        bodies = [each.loadURDF(turned, [4 * x, 0, 0], useFixedBase=True) for x in (0, 1)]
        for body in bodies:
            each.setJointMotorControlMultiDof(body, 0, each.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], force=[0, 0, 0])
        parts, sums = ((0.1, -0.2, 0.3), (0.2, 0.1, -0.1)), ((0.3, -0.1, 0.2),)
        for torques in ((parts, sums), ((), ())):
            for body, values in zip(bodies, torques, strict=True):
                for torque in values:
                    each.setJointMotorControlMultiDof(body, 0, each.TORQUE_CONTROL, force=torque)
            each.stepSimulation()
            (_, first, _, motor), (_, second, _, _) = (each.getJointStateMultiDof(body, 0) for body in bodies)
            assert motor == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
            assert first == pytest.approx(second, abs=1e-9) and max(map(abs, first)) > 1e-4


def test_stable_pd_control_is_taken_where_pybullet_takes_it(script: ModuleType, bullet: Any, turned: str) -> None:
    for each in (script, bullet):
        body = each.loadURDF(turned, useFixedBase=True)
        mode = each.STABLE_PD_CONTROL
        assert each.setJointMotorControlMultiDofArray(
            body, [0], mode, targetPositions=[PLACE], positionGains=[1000], velocityGains=[100], forces=[[200, 200, 200]]
        ) is None
        with pytest.raises(each.error, match="Illegal control mode"):
            each.setJointMotorControlMultiDof(body, 0, mode, PLACE)
        with pytest.raises(each.error, match="Illegal control mode"):
            each.setJointMotorControl2(body, 0, mode, 0.3)
    for _ in range(480):
        script.stepSimulation()
    position = script.getJointStateMultiDof(0, 0)[0]
    assert abs(sum(a * b for a, b in zip(position, PLACE, strict=True))) > 1.0 - 1e-5
