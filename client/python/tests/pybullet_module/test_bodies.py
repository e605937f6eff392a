"""Bodies that scripts make, change, push, hold and gear together."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import simd_client.pybullet as pybullet

from .conftest import BENCH_ARM, SEVEN_ARM

H = 1.0 / 240.0


def box(script: ModuleType, mass: float, place: "tuple[float, float, float]" = (0.0, 0.0, 3.0)) -> int:
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    drawn = script.createVisualShape(script.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3], rgbaColor=[1, 0, 0, 1])
    body: int = script.createMultiBody(mass, shape, drawn, place)
    return body


def test_a_box_weighs_what_it_is_given_and_has_a_boxs_inertia(script: ModuleType) -> None:
    body = box(script, 2.0)
    info = script.getDynamicsInfo(body, -1)
    assert info[0] == 2.0
    # m (b^2 + c^2) / 12, of full sides.
    assert info[2] == pytest.approx((2 * (0.16 + 0.36) / 12, 2 * (0.04 + 0.36) / 12, 2 * (0.04 + 0.16) / 12))
    assert script.getBodyInfo(body)[0] == b"link0"
    assert script.getNumJoints(body) == 0


def test_a_box_falls_as_semi_implicit_euler_says(script: ModuleType) -> None:
    body = box(script, 2.0)
    script.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    script.setGravity(0, 0, -9.81)
    for _ in range(24):
        script.stepSimulation()
    position, _ = script.getBasePositionAndOrientation(body)
    # z = z0 - g h^2 n (n + 1) / 2.
    assert position[2] == pytest.approx(3.0 - 9.81 * H * H * 24 * 25 / 2, abs=1e-9)
    assert script.getBaseVelocity(body)[0][2] == pytest.approx(-9.81 * 24 * H, abs=1e-9)


def test_a_body_without_mass_is_part_of_the_world(script: ModuleType) -> None:
    body = box(script, 0.0)
    script.setGravity(0, 0, -9.81)
    script.stepSimulation()
    assert script.getBasePositionAndOrientation(body)[0] == (0.0, 0.0, 3.0)
    assert script.getDynamicsInfo(body, -1)[0] == 0.0


def test_spheres_cylinders_capsules_and_planes_are_bodies_too(script: ModuleType) -> None:
    ball = script.createMultiBody(1.0, script.createCollisionShape(script.GEOM_SPHERE, radius=0.5))
    assert script.getDynamicsInfo(ball, -1)[2] == pytest.approx((0.1, 0.1, 0.1))
    can = script.createMultiBody(
        1.0, script.createCollisionShape(script.GEOM_CYLINDER, radius=0.5, height=2.0)
    )
    across = (3 * 0.25 + 4) / 12
    assert script.getDynamicsInfo(can, -1)[2] == pytest.approx((across, across, 0.125))
    pill = script.createMultiBody(
        1.0, script.createCollisionShape(script.GEOM_CAPSULE, radius=0.5, height=2.0)
    )
    assert script.getDynamicsInfo(pill, -1)[0] == 1.0
    floor = script.createMultiBody(0.0, script.createCollisionShape(script.GEOM_PLANE))
    assert script.getDynamicsInfo(floor, -1)[0] == 0.0
    with pytest.raises(NotImplementedError, match="createVisualShape"):
        script.createVisualShape(script.GEOM_HEIGHTFIELD)


def linked(script: ModuleType) -> int:
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    turn = [[0.0, 0.0, 0.0, 1.0]] * 2
    body: int = script.createMultiBody(
        *(0, shape, -1, [0, 0, 3]),
        linkMasses=[1, 1],
        linkCollisionShapeIndices=[shape, shape],
        linkVisualShapeIndices=[-1, -1],
        linkPositions=[[1, 0, 0], [0, 1, 0]],
        linkOrientations=turn,
        linkInertialFramePositions=[[0, 0, 0.1], [0, 0, 0]],
        linkInertialFrameOrientations=turn,
        linkParentIndices=[0, 0],
        linkJointTypes=[script.JOINT_REVOLUTE] * 2,
        linkJointAxis=[[0, 0, 1]] * 2,
    )
    return body


def test_links_of_a_body_are_named_as_pybullet_names_them(script: ModuleType) -> None:
    body = linked(script)
    assert [script.getJointInfo(body, j)[1] for j in range(2)] == [b"joint1", b"joint2"]
    assert [script.getJointInfo(body, j)[12] for j in range(2)] == [b"link1", b"link2"]
    assert script.getJointInfo(body, 0)[13:] == ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), -1)
    assert script.getLinkState(body, 0)[0] == pytest.approx((1.0, 0.0, 3.1))
    assert script.getLinkState(body, 1)[4] == pytest.approx((0.0, 1.0, 3.0))


def test_a_gear_turns_one_joint_by_the_other_as_pybullets_does(script: ModuleType) -> None:
    """PyBullet 3.2.7 with ratio 2: velocities 1 and -2."""
    body = linked(script)
    # Its own brake would slow both: simd's motor gives way to a load.
    script.setJointMotorControl2(body, 0, script.VELOCITY_CONTROL, force=0)
    gear = script.createConstraint(body, 0, body, 1, script.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
    script.changeConstraint(gear, gearRatio=2, maxForce=10000)
    for _ in range(120):
        script.setJointMotorControl2(body, 1, script.VELOCITY_CONTROL, targetVelocity=1)
        script.stepSimulation()
    (first, first_velocity, *_), (second, second_velocity, *_) = script.getJointStates(body, [0, 1])
    assert second_velocity == pytest.approx(1.0, rel=0.01)
    assert first_velocity == pytest.approx(-2.0, rel=0.02)
    assert first == pytest.approx(-2.0 * second, abs=0.02)
    assert script.getConstraintInfo(gear)[11] == 2.0
    script.removeConstraint(gear)
    assert script.getNumConstraints() == 0
    for _ in range(60):
        script.setJointMotorControl2(body, 0, script.VELOCITY_CONTROL, targetVelocity=0)
        script.stepSimulation()
    assert script.getJointState(body, 0)[1] == pytest.approx(0.0, abs=1e-3)


def test_a_robot_is_loaded_by_the_old_forms(script: ModuleType) -> None:
    for numbers in ((1, 2, 3), (1, 2, 3, 0, 0, math.sqrt(0.5), math.sqrt(0.5))):
        arm = script.loadURDF(str(SEVEN_ARM), *numbers)
        new = script.loadURDF(str(SEVEN_ARM), numbers[:3], numbers[3:] or None)
        assert script.getBasePositionAndOrientation(arm) == script.getBasePositionAndOrientation(new)


def test_a_search_path_also_applies_to_a_name_with_a_slash_in_front(script: ModuleType) -> None:
    script.setAdditionalSearchPath(str(SEVEN_ARM.parent))
    assert script.getNumJoints(script.loadURDF("/" + SEVEN_ARM.name)) > 0


def test_a_gear_is_for_a_file_with_a_blank_line_in_front_too(script: ModuleType, tmp_path: Path) -> None:
    links = "".join(f"<link name='{name}'/>" for name in "abc")
    joints = "".join(
        f"<joint name='{child}' type='continuous'><parent link='{parent}'/><child link='{child}'/></joint>"
        for parent, child in ("ab", "bc")
    )
    file = tmp_path / "geared.urdf"
    file.write_text(f"\n<?xml version='1.0'?><robot name='geared'>{links}{joints}</robot>")
    body = script.loadURDF(str(file), useFixedBase=1)
    gear = script.createConstraint(body, 0, body, 1, script.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
    script.changeConstraint(gear, gearRatio=2)
    assert script.getConstraintInfo(gear)[11] == 2.0


def test_a_base_is_held_moved_and_let_go(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), [0, 0, 1])
    script.resetJointState(arm, 2, 0.4)
    script.setGravity(0, 0, -9.81)
    held = script.createConstraint(arm, -1, -1, -1, script.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0.5, 0, 2])
    for _ in range(240):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(arm)[0] == pytest.approx((0.5, 0.0, 2.0), abs=1e-3)
    script.changeConstraint(held, [0.5, 0, 2.5])
    for _ in range(60):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(arm)[0] == pytest.approx((0.5, 0.0, 2.5), abs=1e-3)
    script.removeConstraint(held)
    for _ in range(24):
        script.stepSimulation()
    assert script.getBasePositionAndOrientation(arm)[0][2] < 2.49
    with pytest.raises(script.error, match="createConstraint failed"):
        script.createConstraint(arm, 0, -1, -1, script.JOINT_SPHERICAL, [0, 0, 0], [0, 0, 0], [0, 0, 0])


def test_a_heavier_link_pulls_harder(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setGravity(0, 0, -9.81)

    def hold() -> float:
        for _ in range(120):
            script.setJointMotorControl2(arm, 0, script.POSITION_CONTROL, targetPosition=0.0)
            script.stepSimulation()
        effort: float = script.getJointState(arm, 0)[3]
        return effort

    before, mass = hold(), script.getDynamicsInfo(arm, 0)[0]
    script.changeDynamics(arm, 0, mass=3 * mass)
    assert script.getDynamicsInfo(arm, 0)[0] == pytest.approx(3 * mass)
    assert script.getJointInfo(arm, 0)[1] == b"shoulder"
    assert hold() == pytest.approx(3 * before, rel=1e-3)


def test_a_joints_damping_and_limits_change(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    script.changeDynamics(arm, 3, jointDamping=0.7, jointLowerLimit=-0.2, jointUpperLimit=0.2)
    assert script.getJointInfo(arm, 3)[6] == 0.7
    assert script.getJointInfo(arm, 3)[8:10] == (-0.2, 0.2)
    for _ in range(240):
        script.setJointMotorControl2(arm, 3, script.POSITION_CONTROL, targetPosition=0.5)
        script.stepSimulation()
    assert script.getJointState(arm, 3)[0] == pytest.approx(0.2, abs=1e-3)


def test_settings_of_bullets_solver_are_kept_and_reported_as_without_effect(
    script: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    body = box(script, 1.0)
    script.changeDynamics(body, -1, collisionMargin=0.01, linearDamping=0)
    script.changeDynamics(body, -1, collisionMargin=0.02, linearDamping=0)
    assert script.getDynamicsInfo(body, -1)[11] == 0.02
    assert capsys.readouterr().err.count("do nothing") == 1


def test_friction_against_rolling_and_spinning_is_the_daemons(script: ModuleType) -> None:
    body = box(script, 1.0)
    assert script.getDynamicsInfo(body, -1)[6:8] == (0, 0)
    script.changeDynamics(body, -1, rollingFriction=0.01, spinningFriction=0.02)
    script.changeDynamics(body, -1, lateralFriction=0.7)
    assert script.getDynamicsInfo(body, -1)[6:8] == (0.01, 0.02)


@pytest.mark.parametrize("frame", [pybullet.WORLD_FRAME, pybullet.LINK_FRAME])
def test_a_force_acts_for_one_step_at_its_place(script: ModuleType, frame: int) -> None:
    """At the centre of mass it only pushes: v = h F / m; a torque only rotates: w = h T / I."""
    body = box(script, 2.0)
    script.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    place = (0.0, 0.0, 3.0) if frame == pybullet.WORLD_FRAME else (0.0, 0.0, 0.0)
    script.applyExternalForce(body, -1, [0, 4, 0], place, frame)
    script.stepSimulation()
    linear, angular = script.getBaseVelocity(body)
    assert linear == pytest.approx((0.0, 4 * H / 2, 0.0), abs=1e-12)
    assert angular == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    script.applyExternalTorque(body, -1, [0, 0, 3], frame)
    script.stepSimulation()
    linear, angular = script.getBaseVelocity(body)
    assert angular[2] == pytest.approx(3 * H / script.getDynamicsInfo(body, -1)[2][2], rel=1e-9)
    script.stepSimulation()
    assert script.getBaseVelocity(body)[1][2] == pytest.approx(angular[2], rel=1e-9)


def test_a_log_has_pybullets_columns_and_a_row_a_step(script: ModuleType, tmp_path: Path) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    log = script.startStateLogging(script.STATE_LOGGING_GENERIC_ROBOT, str(tmp_path / "log"), [arm])
    for _ in range(5):
        script.setJointMotorControl2(arm, 3, script.POSITION_CONTROL, targetPosition=0.5)
        script.stepSimulation()
    reached = script.getJointState(arm, 3)[0]
    script.stopStateLogging(log)
    script.stepSimulation()
    names, kinds, rest = (tmp_path / "log").read_bytes().split(b"\n", 2)
    columns = names.decode().split(",")
    assert len(columns) == len(kinds)
    assert columns[:3] == ["stepCount", "timeStamp", "objectId"]
    row = struct.Struct("<" + kinds.decode())
    assert len(rest) == 5 * (row.size + 2)
    last = rest[4 * (row.size + 2) :]
    assert last[:2] == b"\xaa\xbb"
    values = dict(zip(columns, row.unpack(last[2:]), strict=True))
    assert values["stepCount"] == 4 and values["qNum"] == 7
    assert values["timeStamp"] == pytest.approx(5 * H, rel=1e-6)
    assert math.isclose(values["q3"], reached, rel_tol=1e-6)


def test_a_fixed_base_is_freed_by_a_mass_and_fixed_by_none(script: ModuleType) -> None:
    """Like PyBullet, which computes the inertia from the collision shape."""
    real: Any = pytest.importorskip("pybullet", exc_type=ImportError)
    server = real.connect(real.DIRECT)
    found: list[list[Any]] = [[], []]
    for p, rows in ((real, found[0]), (script, found[1])):
        p.setGravity(0, 0, -9.81)
        box = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.4, 0.3]), -1, [0, 0, 5])
        arm = p.loadURDF(str(SEVEN_ARM), [9, 0, 5], useFixedBase=1)
        p.resetJointState(arm, 2, 0.3, 1.0)
        for body, mass in ((box, 2.0), (arm, 3.0)):
            rows.append(p.getDynamicsInfo(body, -1)[0])
            p.changeDynamics(body, -1, mass=-1)
            p.changeDynamics(body, -1, mass=mass)
            rows.append(p.getDynamicsInfo(body, -1)[0])
        rows.append(p.getDynamicsInfo(box, -1)[2])
        rows.append(p.getJointState(arm, 2)[:2])
        for _ in range(24):
            p.stepSimulation()
        rows.append(p.getBasePositionAndOrientation(box)[0])
        p.resetBaseVelocity(box, [0, 0, 0])
        p.changeDynamics(box, -1, mass=0)
        rows.append(p.getDynamicsInfo(box, -1)[0])
        rows.append(p.getDynamicsInfo(box, -1)[2])
        at = p.getBasePositionAndOrientation(box)
        for _ in range(24):
            p.stepSimulation()
        assert p.getBasePositionAndOrientation(box) == at
    for theirs, ours in zip(*found, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-3)
    real.disconnect(server)


def test_a_base_that_a_constraint_holds_is_not_freed_by_its_mass(script: ModuleType) -> None:
    script.setGravity(0, 0, -9.81)
    box = script.createMultiBody(1, script.createCollisionShape(script.GEOM_BOX), -1, [0, 0, 5])
    script.createConstraint(box, -1, -1, -1, script.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 5])
    script.changeDynamics(box, -1, mass=4)
    script.stepSimulation()
    assert script.getBasePositionAndOrientation(box)[0] == pytest.approx((0, 0, 5))


def test_numbers_of_removed_bodies_are_given_again_as_in_pybullet(bullet: Any, script: ModuleType) -> None:
    def numbers(p: Any) -> list[object]:
        found: list[object] = [box(p, 1.0, (float(each), 0.0, 3.0)) for each in range(6)]
        for gone in (1, 4, 0):
            p.removeBody(gone)
            found.append([p.getBodyUniqueId(index) for index in range(p.getNumBodies())])
        found += [box(p, 1.0, (float(each), 2.0, 3.0)) for each in range(4)]
        found.append([p.getBodyUniqueId(index) for index in range(p.getNumBodies())])
        p.resetSimulation()
        return [*found, box(p, 1.0), p.getBodyUniqueId(0)]

    assert numbers(script) == numbers(bullet)
