"""Matrices and efforts of free robots with spherical joints compared with PyBullet, in the coordinates of DeepMimic's controllers."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from .conftest import BENCH_ARM

# Name, mass, radius, centre of mass. PyBullet's model for these coordinates takes the inertia of the shapes.
LINKS = (
    ("base", 2.0, 0.3, "0 0 0"),
    ("arm", 1.0, 0.2, "0 0 0.2"),
    ("ball", 1.5, 0.25, "0 0.1 -0.2"),
    ("leg", 1.1, 0.15, "0.1 0 -0.2"),
    ("tip", 0.5, 0.1, "0.1 0 0"),
)
# Name, kind, parent, child, place, axis. In that model every hinge turns about z, and none slides.
JOINTS = (
    ("to_leg", "revolute", "base", "leg", "0 0.5 0", "0 0 1"),
    ("to_arm", "revolute", "base", "arm", "0.5 0 0", "0 0 1"),
    ("to_ball", "spherical", "arm", "ball", "0 0 0.5", "1 0 0"),
    ("to_tip", "revolute", "ball", "tip", "0 0 -0.4", "0 0 1"),
)
POSITIONS = [0.4, -0.2, 0.9, 0.48, 0.0, 0.64, 0.6, 0.7, -0.4, 0.25, 0.36, 0.48, -0.64, 0.48]
# A deliberate difference: for a base that rotates while it moves, PyBullet's model has a force of its mass
# times both velocities. That force does not exist for a velocity in world axes.
VELOCITIES = [0.0, 0.0, 0.0, 0.6, 0.7, -0.8, 0.0, 0.9, 1.3, 0.35, 1.0, -1.1, 1.2, 0.0]


def link(name: str, mass: float, radius: float, center: str) -> str:
    moment = 0.4 * mass * radius**2
    return (
        f'<link name="{name}"><inertial><origin xyz="{center}"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><origin xyz="{center}"/><geometry><sphere radius="{radius}"/></geometry></collision></link>'
    )


def joint(name: str, kind: str, parent: str, child: str, place: str, axis: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{place}"/>'
        f'<axis xyz="{axis}"/><limit lower="-9" upper="9" effort="50" velocity="60"/></joint>'
    )


@pytest.fixture
def limbs(tmp_path: Path) -> str:
    text = "".join([*(link(*each) for each in LINKS), *(joint(*each) for each in JOINTS)])
    (tmp_path / "limbs.urdf").write_text(f'<robot name="limbs">{text}</robot>')
    return str(tmp_path / "limbs.urdf")


@pytest.mark.parametrize("in_order", [False, True], ids=["by joints", "by links"])
def test_long_coordinates_are_those_of_pybullet(bullet: Any, script: ModuleType, limbs: str, in_order: bool) -> None:
    found: list[list[Any]] = []
    for p in (bullet, script):
        body = p.loadURDF(limbs, flags=p.URDF_MAINTAIN_LINK_ORDER if in_order else 0)
        p.setGravity(1, 2, -9)
        kinds = [p.getJointInfo(body, number)[2] for number in range(4)]
        # The base's, three hinges', and the ball's, which has the index of the ball.
        q, v = POSITIONS[:10], VELOCITIES[:10]
        ball = 7 + kinds.index(p.JOINT_SPHERICAL)
        q[ball:ball], v[ball:ball] = POSITIONS[10:], VELOCITIES[10:]
        still = [0.0] * len(q)
        found.append([
            kinds,
            np.array(p.calculateMassMatrix(body, q, flags=1)),
            np.array(p.calculateInverseDynamics(body, q, still, still, flags=1)),
            np.array(p.calculateInverseDynamics(body, q, v, still, flags=1)),
        ])
    theirs, ours = found
    assert ours[0] == theirs[0]
    for got, wanted in zip(ours[1:], theirs[1:], strict=True):
        assert got.shape == wanted.shape
        # PyBullet has the file's numbers in single precision.
        assert np.abs(got - wanted).max() < 1e-4, (got, wanted)


# A deliberate difference: for a base that is rotated about more than one axis PyBullet takes the angles in
# another order.
@pytest.mark.parametrize("turn", [(0.6, 0.0, 0.0, 0.8), (0.0, -0.6, 0.0, 0.8), (0.0, 0.0, 0.6, 0.8)], ids=["x", "y", "z"])
def test_inverse_dynamics_of_a_free_base_are_those_of_pybullet(
    bullet: Any, script: ModuleType, tmp_path: Path, turn: tuple[float, ...]
) -> None:
    # Its balls are spherical joints, which Bullet's inverse dynamics do not take.
    hinges = [each for each in JOINTS if each[1] == "revolute" and each[0] != "to_tip"]
    links = [each for each in LINKS if each[0] in ("base", "arm", "leg")]
    off = [("base", 2.0, 0.3, "0.1 -0.2 0.3"), *links[1:]]
    text = "".join([*(link(*each) for each in off), *(joint(*each) for each in hinges)])
    (tmp_path / "free.urdf").write_text(f'<robot name="free">{text}</robot>')
    place = [0.4, -0.2, 0.9, *turn, 0.7, -0.4]
    moving = [0.6, 0.7, -0.8, 0.3, -0.5, 0.2, 0.9, 1.3]
    faster = [1.0, -2.0, 3.0, 0.5, 0.4, -0.6, 2.0, -1.0]
    still = [0.0] * 8
    found: list[list[Any]] = []
    for p in (bullet, script):
        body = p.loadURDF(str(tmp_path / "free.urdf"), flags=p.URDF_USE_INERTIA_FROM_FILE)
        p.setGravity(1, 2, -9)
        asked = [(still, still), (moving, still), (still, faster), (moving, faster)]
        found.append([p.calculateInverseDynamics(body, place, *each) for each in asked])
    theirs, ours = found
    for got, wanted in zip(ours, theirs, strict=True):
        # PyBullet has the file's numbers in single precision.
        assert got == pytest.approx(wanted, abs=1e-4)
    with pytest.raises(script.error, match="free has 9 positions and 8 velocities, its free base's first"):
        script.calculateInverseDynamics(0, place[:8], still, still)


def test_long_coordinates_need_a_free_base_and_all_numbers(script: ModuleType, limbs: str) -> None:
    held = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    with pytest.raises(NotImplementedError, match="free base"):
        script.calculateMassMatrix(held, [0.0] * 20, flags=1)
    free = script.loadURDF(limbs)
    with pytest.raises(script.error, match="13 positions, where limbs has 14"):
        script.calculateMassMatrix(free, [0.0] * 13, flags=1)


def test_a_base_that_goes_along_needs_no_force_for_that(script: ModuleType, limbs: str) -> None:
    body = script.loadURDF(limbs)
    still = [0.0] * 14
    turning = script.calculateInverseDynamics(body, POSITIONS, VELOCITIES, still, flags=1)
    moving = script.calculateInverseDynamics(body, POSITIONS, [3.0, -4.0, 5.0, *VELOCITIES[3:]], still, flags=1)
    assert moving == pytest.approx(turning, abs=1e-9)
    assert max(map(abs, turning)) > 1.0
