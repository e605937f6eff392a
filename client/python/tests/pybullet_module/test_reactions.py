"""Reactions of joints, measured by force-torque sensors: the same numbers as PyBullet's."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ARM = """<robot name="hang"><link name="base"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="upper"><inertial><origin xyz="0.1 0.02 -0.2" rpy="0.3 0 0"/><mass value="2"/>
  <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.05 0 -0.1" rpy="0 0 0.5"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool"><inertial><origin xyz="0 0.03 -0.05"/><mass value="0.5"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0 0 1" rpy="0.4 0 0.2"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="500" velocity="10"/></joint>
<joint name="second" type="{kind}"><parent link="upper"/><child link="lower"/>
  <origin xyz="0.1 0 -0.4" rpy="0 0.5 0"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" effort="500" velocity="10"/></joint>
<joint name="mount" type="fixed"><parent link="lower"/><child link="tool"/>
  <origin xyz="0 0 -0.2" rpy="0.7 0 0"/></joint>
</robot>"""
JOINTS = (0, 1, 2)


@pytest.fixture
def bullet() -> Iterator[Any]:
    """PyBullet itself, if a wheel of it exists."""
    module: Any = pytest.importorskip("pybullet", exc_type=ImportError)
    module.connect(module.DIRECT)
    yield module
    module.disconnect()


def hung(p: ModuleType, path: Path, kind: str = "revolute") -> int:
    """The arm, held at a slant until it is at rest."""
    path.write_text(ARM.format(kind=kind))
    p.setGravity(0, 0, -9.81)
    arm: int = p.loadURDF(str(path), useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
    for joint in JOINTS:
        p.enableJointForceTorqueSensor(arm, joint)
    for joint, at in ((0, 0.3), (1, 0.1)):
        p.resetJointState(arm, joint, at)
        p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, at, force=400)
    for _ in range(240):
        p.stepSimulation()
    return arm


def reactions(p: ModuleType, arm: int) -> list[Any]:
    return [pytest.approx(state[2], abs=0.02) for state in p.getJointStates(arm, JOINTS)]


def test_a_held_arms_reactions_are_those_of_pybullet(
    script: ModuleType, bullet: ModuleType, tmp_path: Path
) -> None:
    ours, theirs = hung(script, tmp_path / "arm.urdf"), hung(bullet, tmp_path / "arm.urdf")
    states = script.getJointStates(ours, JOINTS)
    assert [state[2] for state in states] == reactions(bullet, theirs)
    # Only gravity acts on the tool, in its centre of mass.
    assert states[2][2][3:] == pytest.approx((0, 0, 0), abs=1e-6)
    assert sum(x * x for x in states[0][2][:3]) == pytest.approx((3.5 * 9.81) ** 2, rel=1e-3)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_efforts_of_a_script_are_in_the_reactions_and_those_of_motors_are_not(
    script: ModuleType, bullet: ModuleType, tmp_path: Path, kind: str
) -> None:
    found: list[Any] = []
    for p in (script, bullet):
        arm = hung(p, tmp_path / "arm.urdf", kind)
        for joint in (0, 1):
            held = p.getJointState(arm, joint)[3]
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
            p.setJointMotorControl2(arm, joint, p.TORQUE_CONTROL, force=held)
        p.stepSimulation()
        at_rest = p.getJointStates(arm, JOINTS)
        # And then it falls.
        p.stepSimulation()
        found.append([state[2] for state in (*at_rest, *p.getJointStates(arm, JOINTS))])
    for ours, theirs in zip(*found, strict=True):
        assert ours == pytest.approx(theirs, abs=0.05)


def test_without_a_sensor_a_joint_reports_zeros(script: ModuleType, tmp_path: Path) -> None:
    arm = hung(script, tmp_path / "arm.urdf")
    assert any(script.getJointState(arm, 1)[2])
    script.enableJointForceTorqueSensor(arm, 1, 0)
    assert script.getJointState(arm, 1)[2] == (0.0,) * 6
    assert any(script.getJointStateMultiDof(arm, 2)[2])
    with pytest.raises(script.error):
        script.enableJointForceTorqueSensor(arm, 9)
