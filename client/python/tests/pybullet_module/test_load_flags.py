"""Flags of loadURDF that change the description, compared with PyBullet."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SHAPE = "<{tag}><origin xyz='{xyz}' rpy='{rpy}'/><geometry><box size='0.1 0.2 0.3'/></geometry></{tag}>"


def link(name: str, mass: float, xyz: str, rpy: str = "0 0 0") -> str:
    shapes = "".join(SHAPE.format(tag=tag, xyz=xyz, rpy=rpy) for tag in ("visual", "collision"))
    inertial = (
        f"<inertial><origin xyz='{xyz}' rpy='{rpy}'/><mass value='{mass}'/>"
        "<inertia ixx='0.02' iyy='0.03' izz='0.04' ixy='0' ixz='0' iyz='0'/></inertial>"
    )
    return f"<link name='{name}'>{inertial}{shapes}</link>"


def joint(name: str, kind: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> str:
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}' rpy='{rpy}'/><axis xyz='0 1 0'/><limit lower='-2' upper='2' effort='9' velocity='9'/></joint>"
    )


@pytest.fixture
def tree(tmp_path: Path) -> str:
    """A base with a held camera that has an arm, and an arm with a held gripper of two fingers."""
    parts = [
        link("base", 2.0, "0 0 0.1"),
        link("camera", 0.5, "0.1 0 0"),
        link("mount", 0.25, "0 0 0.05"),
        link("arm", 1.0, "0 0 0.2"),
        link("flange", 0.1, "0 0 0"),
        link("hand", 0.4, "0 0 0.1", "0 0 1.5707963267948966"),
        link("left", 0.2, "0 0.1 0"),
        link("right", 0.2, "0 -0.1 0"),
        link("pan", 0.3, "0 0 0.1"),
        joint("held", "fixed", "base", "camera", "0.3 0 0", "0 0 0.5"),
        joint("shoulder", "revolute", "base", "arm", "0 0 0.4"),
        joint("above", "fixed", "camera", "mount", "0 0 0.2", "0.3 0 0"),
        joint("panning", "continuous", "mount", "pan", "0 0 0.1"),
        joint("flat", "fixed", "arm", "flange", "0 0 0.3"),
        joint("gripping", "fixed", "flange", "hand", "0 0 0.1", "0 0.4 0"),
        joint("finger_left", "prismatic", "hand", "left", "0 0 0.2"),
        joint("finger_right", "prismatic", "hand", "right", "0 0 0.2", "0 0 3.14159265"),
    ]
    file = tmp_path / "tree.urdf"
    file.write_text(f"<robot name='tree'>{''.join(parts)}</robot>")
    return str(file)


def described(p: Any, body: int) -> dict[Any, Any]:
    """Joints with their links, parents and frames; masses, inertias and places of the links."""
    found: dict[Any, Any] = {}
    for index in range(-1, p.getNumJoints(body)):
        if index >= 0:
            info = p.getJointInfo(body, index)
            found[index, "joint"] = (info[1], info[2], info[12], info[16])
            found[index, "frame"] = [*info[14], *signed(info[15])]
        dynamics = p.getDynamicsInfo(body, index)
        found[index, "mass"], found[index, "inertia"] = [dynamics[0]], list(dynamics[2])
        found[index, "center"] = [*dynamics[3], *signed(dynamics[4])]
        place = p.getBasePositionAndOrientation(body) if index < 0 else p.getLinkState(body, index)[:2]
        found[index, "place"] = [*place[0], *signed(place[1])]
        drawn = [each for each in p.getVisualShapeData(body) if each[1] == index]
        found[index, "shapes"] = (len(drawn), len(p.getCollisionShapeData(body, index)))
    return found


def signed(turn: Any) -> list[float]:
    largest = max(turn, key=abs)
    return [part if largest > 0 else -part for part in turn]


@pytest.mark.parametrize("more", ["", "URDF_USE_INERTIA_FROM_FILE", "URDF_MAINTAIN_LINK_ORDER"])
@pytest.mark.parametrize("fixed", [0, 1])
def test_links_that_fixed_joints_hold_become_one(bullet: Any, script: ModuleType, tree: str, more: str, fixed: int) -> None:
    found: list[dict[Any, Any]] = []
    for p in (bullet, script):
        flags = p.URDF_MERGE_FIXED_LINKS | (getattr(p, more) if more else 0)
        body = p.loadURDF(tree, [0.5, -0.2, 1.0], [0, 0, 0.6, 0.8], useFixedBase=fixed, flags=flags)
        found.append(described(p, body))
    theirs, ours = found
    assert ours.keys() == theirs.keys()
    for key, value in ours.items():
        assert value == (pytest.approx(theirs[key], rel=1e-4, abs=1e-5) if isinstance(value, list) else theirs[key]), key


@pytest.mark.parametrize("flag", ["URDF_IGNORE_VISUAL_SHAPES", "URDF_IGNORE_COLLISION_SHAPES"])
def test_shapes_are_left_out(bullet: Any, script: ModuleType, tree: str, flag: str) -> None:
    counts: list[list[int]] = []
    for p in (bullet, script):
        body = p.loadURDF(tree, flags=getattr(p, flag))
        drawn = len(p.getVisualShapeData(body))
        counts.append([drawn, sum(len(p.getCollisionShapeData(body, each)) for each in range(-1, p.getNumJoints(body)))])
    assert counts[1] == counts[0]


def test_a_flag_without_effect_is_said_by_its_name(script: ModuleType, tree: str, capsys: pytest.CaptureFixture[str]) -> None:
    granted = script.URDF_ENABLE_SLEEPING | script.URDF_ENABLE_WAKEUP | script.URDF_MAINTAIN_LINK_ORDER
    script.loadURDF(tree, flags=granted)
    assert capsys.readouterr().err == ""
    for _ in range(2):
        script.loadURDF(tree, flags=granted | script.URDF_INITIALIZE_SAT_FEATURES)
    assert capsys.readouterr().err == "simd: loadURDF: URDF_INITIALIZE_SAT_FEATURES has no effect\n"


def test_maximal_coordinates_are_said_where_they_would_matter(
    script: ModuleType, tree: str, capsys: pytest.CaptureFixture[str]
) -> None:
    sphere = script.createCollisionShape(script.GEOM_SPHERE, radius=0.1)
    script.createMultiBody(1.0, sphere, useMaximalCoordinates=1)
    assert capsys.readouterr().err == ""
    for _ in range(2):
        script.loadURDF(tree, useMaximalCoordinates=1)
    assert capsys.readouterr().err == "simd: loadURDF: useMaximalCoordinates has no effect on bodies with joints\n"


def test_settings_for_other_programs_are_not_read_as_in_pybullet(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """Gazebo's self-collision and friction, and ROS 2 control's initial positions, drives and limits: two links that overlap stay."""
    parts = [link("base", 2.0, "0 0 0.1"), link("arm", 1.0, "0 0 0.2"), link("hand", 1.0, "0 0 0.2")]
    parts += [joint("shoulder", "revolute", "base", "arm", "0 0 0.3"), joint("wrist", "revolute", "arm", "hand", "0 0 -0.2")]
    parts += [f"<gazebo reference='{name}'><selfCollide>true</selfCollide><mu1>0.9</mu1></gazebo>" for name in ("base", "arm", "hand")]
    parts.append("<gazebo reference='shoulder'><springStiffness>90</springStiffness><springReference>1</springReference></gazebo>")
    parts.append(
        "<ros2_control name='c' type='system'><joint name='wrist'><command_interface name='position'/>"
        "<state_interface name='position'><param name='initial_value'>0.7</param></state_interface></joint></ros2_control>"
    )
    file = tmp_path / "settings.urdf"
    file.write_text(f"<robot name='r'>{''.join(parts)}</robot>")
    found: list[Any] = []
    for p in (bullet, script):
        body = p.loadURDF(str(file), useFixedBase=1)
        at_start = p.getJointState(body, 1)[0]
        for _ in range(50):
            p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=0.2)
            p.stepSimulation()
        friction = p.getDynamicsInfo(body, 0)[1]
        found.append((at_start, friction, *[p.getJointState(body, number)[0] for number in (0, 1)]))
        assert len(p.getContactPoints()) == 0
    assert found[1] == pytest.approx(found[0], abs=1e-3)
