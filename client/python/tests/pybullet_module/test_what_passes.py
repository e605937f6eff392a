"""Arguments that PyBullet tolerates are tolerated: unknown names, missing values, and excessive numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from .conftest import BENCH_ARM

MJCF = (
    '<mujoco model="m"><compiler angle="degree" coordinate="{coordinate}"/><!-- {comment} --><worldbody><body name="a" pos="{x} 0 1">'
    '<joint name="s" type="slide" axis="1 0 0"/><geom type="capsule" fromto="0 0 0.2 0 0 -0.2" size="0.05" {mass}/></body></worldbody></mujoco>'
)


@pytest.fixture
def cube(script: ModuleType, tmp_path: Path) -> int:
    """A free box of 0.2 m."""
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1] * 3)
    return script.createMultiBody(1.0, shape, basePosition=[2, 0, 1])


def test_constraints_take_none_and_axes_of_zero(script: ModuleType, cube: int) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    fixed = script.createConstraint(cube, -1, -1, -1, script.JOINT_FIXED, None, [0, 0, 0], [2, 0, 1], None, [0, 0, 0, 1])
    slide = script.createConstraint(cube, -1, -1, -1, script.JOINT_PRISMATIC, [0, 0, 0], [0, 0, 0], [2, 0, 1])
    # A base has no joint.
    gear = script.createConstraint(arm, 0, arm, -1, script.JOINT_GEAR, [0, 1, 0], [0, 0, 0], [0, 0, 0])
    script.changeConstraint(gear, gearRatio=2, maxForce=10)
    assert [script.getConstraintInfo(each)[4] for each in (fixed, slide, gear)] == [
        script.JOINT_FIXED,
        script.JOINT_PRISMATIC,
        script.JOINT_GEAR,
    ]
    script.setGravity(0, 0, -10)
    for _ in range(50):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(cube)[0] == pytest.approx((2, 0, 1), abs=1e-3)
    for each in (fixed, slide, gear):
        script.removeConstraint(each)


def placed(p: Any, **given: Any) -> Any:
    """Returns pose and collision shape of a body with these arguments."""
    body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), **given)
    return p.getBasePositionAndOrientation(body), p.getCollisionShapeData(body, -1)[0][3:]


def shaped(p: Any, **given: Any) -> Any:
    """Returns the shape of a body from these arguments of a box."""
    return p.getCollisionShapeData(p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, **given)), -1)[0][3:]


def thrown(p: Any, **velocities: Any) -> Any:
    body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    p.resetBaseVelocity(body, [1, 2, 3], [4, 5, 6])
    p.resetBaseVelocity(body, **velocities)
    return p.getBaseVelocity(body)


def held(p: Any, **frames: Any) -> Any:
    body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    return p.getConstraintInfo(p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, **frames))[5:10]


ZERO = [0, 0, 0]


ODD: list[tuple[Callable[..., Any], dict[str, Any]]] = [
    (placed, {"basePosition": [1, 2, 3], "baseOrientation": [0, 0, 1]}),
    (placed, {"basePosition": [1, 2, 3], "baseOrientation": "upright"}),
    (placed, {"basePosition": [1, 2]}),
    (placed, {"basePosition": 3}),
    (placed, {"baseInertialFramePosition": [0, 1], "baseInertialFrameOrientation": [0, 1, 0]}),
    (shaped, {"halfExtents": 0.2}),
    (shaped, {"halfExtents": [0.1, 0.2]}),
    (shaped, {"halfExtents": [0.1] * 3, "collisionFramePosition": [1, 2], "collisionFrameOrientation": [1, 2, 3]}),
    (thrown, {"linearVelocity": [1, 2, 3], "angularVelocity": [0, 0]}),
    (thrown, {"linearVelocity": 5, "angularVelocity": [0, 0, 1]}),
    (held, {"jointAxis": [0, 0], "parentFramePosition": ZERO, "childFramePosition": [0, 0, 1]}),
    (held, {"jointAxis": ZERO, "parentFramePosition": [0, 1], "childFramePosition": [0, 1]}),
    (held, {"jointAxis": ZERO, "parentFramePosition": ZERO, "childFramePosition": ZERO, "parentFrameOrientation": [0, 0, 1]}),
]


@pytest.mark.parametrize(("of", "given"), ODD)
def test_vectors_of_another_length_are_not_read_as_in_pybullet(
    bullet: Any, script: ModuleType, of: Callable[..., Any], given: dict[str, Any]
) -> None:
    expected, found = of(bullet, **given), of(script, **given)
    assert flat(found) == pytest.approx(flat(expected), abs=1e-6)


def flat(values: Any) -> list[float]:
    """Returns the numbers in tuples of tuples."""
    return [number for value in values if not isinstance(value, bytes) for number in (flat(value) if isinstance(value, tuple) else [value])]


def test_missing_objects_are_reported_and_change_nothing(
    script: ModuleType, cube: int, capfd: pytest.CaptureFixture[str]
) -> None:
    script.changeDynamics(cube, 7, lateralFriction=1.0)
    script.changeDynamics(77, -1, mass=2.0)
    script.applyExternalForce(cube, 9, [1, 0, 0], [0, 0, 0], script.WORLD_FRAME)
    script.stepSimulation()
    said = capfd.readouterr().err
    assert "no link 7 of body 0" in said and "no link -1 of body 77" in said and "a force on link 9 of body 0" in said
    assert script.getBaseVelocity(cube)[0] == (0.0, 0.0, 0.0)


def test_values_beyond_what_can_be_are_as_large_as_can_be(script: ModuleType, cube: int) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.changeDynamics(cube, -1, lateralFriction=-1, restitution=2)
    assert script.getDynamicsInfo(cube, -1)[1] == 0.0 and script.getDynamicsInfo(cube, -1)[5] == 1.0
    script.resetBaseVelocity(cube, [1e13, 0, 0], [0, 0, 0])
    script.resetBaseVelocity(cube, [0, 0, 0], [0, 0, 0])
    for motor in (
        {"controlMode": script.POSITION_CONTROL, "targetPosition": 1e13},
        {"controlMode": script.VELOCITY_CONTROL, "targetVelocity": 1e13, "force": 1.0},
        {"controlMode": script.POSITION_CONTROL, "targetPosition": 0.1, "positionGain": 1e13, "velocityGain": 1e13},
        {"controlMode": script.POSITION_CONTROL, "targetPosition": 0.1, "positionGain": -1.0, "force": 1e30},
    ):
        script.setJointMotorControl2(arm, 0, **motor)
        script.stepSimulation()
        assert math.isfinite(script.getJointState(arm, 0)[0])


def test_an_error_belongs_to_its_call_and_leaves_nothing_behind(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    for argument in ("force", "targetVelocity", "targetPosition", "positionGain"):
        with pytest.raises(script.error, match=f"{argument} is NaN; the motor stays as it was"):
            script.setJointMotorControl2(arm, 0, script.TORQUE_CONTROL, **{argument: math.nan})
    with pytest.raises(script.error):
        script.setJointMotorControlArray(arm, [0], script.TORQUE_CONTROL, forces=[math.nan])
    for _ in range(3):
        script.stepSimulation()
    # A removed body also drops its waiting commands.
    script.resetJointState(arm, 0, 0.1)
    script.applyExternalForce(arm, 0, [1, 0, 0], [0, 0, 0], script.LINK_FRAME)
    script.removeBody(arm)
    script.stepSimulation()


def test_any_time_step_that_is_positive_is_taken(script: ModuleType, cube: int, capfd: pytest.CaptureFixture[str]) -> None:
    script.setGravity(0, 0, -10)
    script.changeDynamics(cube, -1, linearDamping=0)
    script.setTimeStep(0.5)
    script.stepSimulation()
    # Half a second in one step of the script.
    assert script.getBaseVelocity(cube)[0][2] == pytest.approx(-5.0, rel=1e-6)
    assert script.getPhysicsEngineParameters()["fixedTimeStep"] == pytest.approx(0.5)
    script.setTimeStep(0)
    assert "a time step of 0 s is not valid" in capfd.readouterr().err
    script.setTimeStep(1 / 240)
    script.stepSimulation()
    assert script.getBaseVelocity(cube)[0][2] == pytest.approx(-5.0 - 10 / 240, rel=1e-6)


@pytest.mark.parametrize(
    "changed", [{"coordinate": "global", "mass": 'mass="1"'}, {"x": "0.13/2"}, {"comment": "arm -- upper"}, {"mass": 'mass="1"'}]
)
def test_mjcf_of_2017_is_read(script: ModuleType, tmp_path: Path, changed: dict[str, str]) -> None:
    file = tmp_path / "model.xml"
    file.write_text(MJCF.format(**{"coordinate": "local", "mass": "", "x": "0", "comment": "x", **changed}))
    bodies = script.loadMJCF(str(file), useMultiBody=1)
    assert len(bodies) == 1 and script.getNumJoints(bodies[0]) > 0
    if "x" in changed:
        # Bullet reads 0.13/2 as 0.13.
        assert script.getLinkState(bodies[0], 0)[0][0] == pytest.approx(0.13)


def test_a_visual_shape_without_its_mesh_draws_nothing(script: ModuleType, capfd: pytest.CaptureFixture[str]) -> None:
    visual = script.createVisualShape(script.GEOM_MESH, fileName="nowhere.obj")
    assert visual >= 0 and "Not found: nowhere.obj" in capfd.readouterr().err
    assert script.createMultiBody(1.0, -1, visual) >= 0


@pytest.mark.parametrize("changed", [("' rpy", "'rpy"), ('"1" iyy', '"1"iyy'), ('"1"\n    izz', '"1"izz'), ("?>", "?>\r\n* a remark")])
def test_xml_that_a_strict_reader_refuses_is_read(
    bullet: Any, script: ModuleType, tmp_path: Path, changed: tuple[str, str]
) -> None:
    urdf = """<?xml version="1.0" ?><robot name="r"><link name="base"><inertial><origin xyz='0 0 0.5' rpy='0 0 0'/><mass value="2"/>
    <inertia ixx="1" iyy="1"
    izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
    assert changed[0] in urdf
    file = tmp_path / "joined.urdf"
    file.write_text(urdf.replace(*changed))
    for p in (bullet, script):
        assert p.getDynamicsInfo(p.loadURDF(str(file)), -1)[0] == 2.0


def test_numbers_are_read_as_far_as_they_go(
    bullet: Any, script: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    inertial = '<inertial><mass value="2kg"/><inertia ixx="1" iyy="1.0 kg m^2" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    file = tmp_path / "units.urdf"
    file.write_text(
        f'<robot name="r"><link name="a">{inertial}</link><link name="b">{inertial}</link><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><origin xyz="0.1 0.2m ${0.3 + 0.4}"/><axis xyz="0 0 1"/><limit lower="-pi" upper="1.5rad" effort="3 N" velocity="1"/></joint></robot>'
    )
    found: list[Any] = []
    for p in (bullet, script):
        body = p.loadURDF(str(file))
        found.append((p.getDynamicsInfo(body, -1)[0], p.getJointInfo(body, 0)[8:12], p.getJointInfo(body, 0)[14]))
    assert found[0] == found[1] == (2.0, (0.0, 1.5, 3.0, 1.0), (0.1, 0.2, 0.0))
    said = capfd.readouterr().err
    assert 'limit lower="-pi" is read as 0' in said and 'origin xyz="0.1 0.2m ${0.3 + 0.4}" is read as 0.1 0.2 0' in said
