"""Effects of changeDynamics and resetJointStatesMultiDof on joints, compared with PyBullet."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

INERTIAL = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
JOINT = (
    "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><axis xyz='0 0 1'/>"
    "<limit lower='-5' upper='5' effort='1000' velocity='7'/></joint>"
)


@pytest.fixture
def chain(tmp_path: Any) -> str:
    """A rotating, a sliding and a rotating joint, without effects on each other."""
    links = "".join(f"<link name='l{index}'>{INERTIAL}</link>" for index in range(4))
    joints = "".join(
        JOINT.format(name=f"j{index}", kind=kind, parent=f"l{index}", child=f"l{index + 1}")
        for index, kind in enumerate(("revolute", "prismatic", "revolute"))
    )
    file = tmp_path / "chain.urdf"
    file.write_text(f"<robot name='chain'>{links}{joints}</robot>")
    return str(file)


@pytest.mark.parametrize("link", [-1, 1])
def test_a_highest_velocity_is_of_all_joints_whichever_link_is_named(
    bullet: Any, script: ModuleType, chain: str, link: int
) -> None:
    found: list[list[Any]] = []
    for p in (bullet, script):
        body = p.loadURDF(chain, useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
        p.changeDynamics(body, link, maxJointVelocity=0.5)
        # Negative values are ignored.
        p.changeDynamics(body, link, maxJointVelocity=-1, lateralFriction=0.4)
        for joint in range(3):
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=2.0)
        for _ in range(10):
            p.stepSimulation()
        found.append([p.getJointState(body, joint)[1] for joint in range(3)])
        found[-1] += [p.getJointInfo(body, joint)[11] for joint in range(3)]
    assert found[1] == pytest.approx(found[0], abs=2e-3) and found[1] == pytest.approx([0.5] * 3 + [7.0] * 3, abs=2e-3)


def test_joints_are_put_elsewhere_by_arrays(bullet: Any, script: ModuleType, chain: str) -> None:
    for p in (bullet, script):
        body = p.loadURDF(chain, useFixedBase=1)
        values, speeds = np.array([[0.1], [0.2], [0.3]]), np.array([[1.0], [2.0], [3.0]])
        p.resetJointStatesMultiDof(body, np.arange(3), values, targetVelocities=speeds)
        states = p.getJointStates(body, range(3))
        assert [number for state in states for number in state[:2]] == pytest.approx([0.1, 1.0, 0.2, 2.0, 0.3, 3.0])
        p.resetJointStatesMultiDof(body, [0, 1, 2], values)
        assert [state[1] for state in p.getJointStates(body, range(3))] == [0.0] * 3


@pytest.mark.parametrize("force", [1e5, 3.0])
def test_no_velocity_target_is_beyond_a_hundred(bullet: Any, script: ModuleType, chain: str, force: float) -> None:
    """Bullet's highest velocity of a joint, also with a target far above it, and after another of `changeDynamics`."""
    found: list[list[float]] = []
    for p in (bullet, script):
        body = p.loadURDF(chain, useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
        for link in range(-1, 3):
            p.changeDynamics(body, link, linearDamping=0, angularDamping=0)
        speeds: list[float] = []
        for target, fastest in ((300.0, None), (-250.0, None), (300.0, 120.0), (90.0, None)):
            if fastest is not None:
                p.changeDynamics(body, 0, maxJointVelocity=fastest)
            p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, targetVelocity=target, force=force)
            for _ in range(40):
                p.resetJointState(body, 0, 0.0, p.getJointState(body, 0)[1])
                p.stepSimulation()
            speeds.append(p.getJointState(body, 0)[1])
        found.append(speeds)
    assert found[1] == pytest.approx(found[0], rel=2e-3, abs=2e-2)
    assert force < 1e5 or found[1][:3] == pytest.approx([100.0, -100.0, 120.0], rel=1e-3)
