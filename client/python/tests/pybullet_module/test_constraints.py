"""Constraints between links, compared with PyBullet's."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from simd_client.pybullet.arguments import Vector

from .conftest import SEVEN_ARM
from .test_restoring import arm as turning_arm


def _box(p: Any, at: Vector, mass: float = 0.5) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.05])
    body: int = p.createMultiBody(mass, shape, basePosition=at)
    return body


def _run(p: Any, steps: int = 240) -> None:
    for _ in range(steps):
        p.stepSimulation()


def _both(bullet: Any, script: ModuleType) -> tuple[Any, ...]:
    for p in (bullet, script):
        p.setGravity(0, 0, -10)
    return (bullet, script)


@pytest.mark.parametrize("kind", ["JOINT_FIXED", "JOINT_POINT2POINT", "JOINT_PRISMATIC"])
def test_a_box_hangs_on_the_world_as_pybullets_does(bullet: Any, script: ModuleType, kind: str) -> None:
    found: list[Any] = []
    for p in _both(bullet, script):
        box = _box(p, (0, 0, 1))
        pivot = [0, 0, 0.05] if kind == "JOINT_POINT2POINT" else [0.05, 0.02, 0.01]
        child = [pivot[0], pivot[1], pivot[2] + 1]
        made = p.createConstraint(box, -1, -1, -1, getattr(p, kind), [1, 0, 0], pivot, child)
        _run(p)
        info = p.getConstraintInfo(made)
        found.append((p.getConstraintState(made), p.getBasePositionAndOrientation(box)[0], info[2:]))
    (state, place, info), (our_state, our_place, our_info) = found
    assert our_state == pytest.approx(state, abs=1e-3)
    # PyBullet creeps along the slide.
    assert our_place == pytest.approx(place, abs=1e-3)
    assert our_info == info


@pytest.mark.parametrize("kind", ["JOINT_FIXED", "JOINT_POINT2POINT"])
def test_two_boxes_hold_each_other_as_pybullets_do(bullet: Any, script: ModuleType, kind: str) -> None:
    found: list[Any] = []
    for p in _both(bullet, script):
        low, high = _box(p, (0, 0, 1)), _box(p, (0, 0, 1.3), 0.0)
        frames = ([0, 0, 0], [0, 0, 0.15], [0, 0, -0.15])
        made = p.createConstraint(low, -1, high, -1, getattr(p, kind), *frames)
        _run(p)
        assert p.getNumConstraints() == 1 and p.getConstraintUniqueId(0) == made
        seen = [p.getConstraintState(made), p.getBasePositionAndOrientation(low)[0]]
        infos = [p.getConstraintInfo(made)]
        # Moved by its frame on the child, and let go.
        p.changeConstraint(made, [0, 0, -0.25], maxForce=500)
        _run(p)
        seen += [p.getConstraintState(made), p.getBasePositionAndOrientation(low)[0]]
        infos.append(p.getConstraintInfo(made))
        found.append((seen, infos))
        p.removeConstraint(made)
        assert p.getNumConstraints() == 0
        _run(p, 24)
        assert p.getBasePositionAndOrientation(low)[0][2] < 0.87
    (seen, infos), (our_seen, our_infos) = found
    for ours, theirs in zip(our_seen, seen, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-3)
    assert our_infos == infos


def test_a_force_that_is_not_enough_lets_a_box_down(script: ModuleType) -> None:
    script.setGravity(0, 0, -10)
    box = _box(script, (0, 0, 1))
    script.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
    made = script.createConstraint(box, -1, -1, -1, script.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    script.changeConstraint(made, maxForce=3)
    _run(script)
    # On the child, as PyBullet has it.
    assert script.getConstraintState(made)[2] == pytest.approx(-3.0, abs=1e-6)
    # 5 N of weight less 3 N, for a second.
    assert script.getBasePositionAndOrientation(box)[0][2] == pytest.approx(1 - 2.0, abs=0.02)


def test_unknown_constraints_are_answered_as_by_pybullet(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        assert p.getConstraintUniqueId(5) == -1
        assert p.changeConstraint(99, [0, 0, 0]) is None
        assert p.removeConstraint(99) is None
        with pytest.raises(p.error, match="getConstraintState"):
            p.getConstraintState(99)
        with pytest.raises(p.error, match="user constraint info"):
            p.getConstraintInfo(99)
        box = _box(p, (0, 0, 1))
        with pytest.raises(p.error, match="createConstraint failed"):
            p.createConstraint(box, -1, -1, -1, p.JOINT_REVOLUTE, [0, 0, 1], [0, 0, 0], [0, 0, 1])


_CHANGES: list[dict[str, Any]] = [
    {"jointChildPivot": [0.1, 0.2, 0.3]},
    {"jointChildFrameOrientation": [0, 0, 0.6, 0.8]},
    {"maxForce": 12},
    {"maxForce": -5},
    {"gearRatio": -0.3},
    {"gearRatio": 0},
    {"gearAuxLink": 2},
    {"gearAuxLink": -1},
    {"relativePositionTarget": 0.4},
    {"relativePositionTarget": -0.2},
    {"erp": 0.3},
    {"erp": -1},
    {"maxForce": 0},
    {},
]


@pytest.mark.parametrize("kind", ["JOINT_FIXED", "JOINT_POINT2POINT", "JOINT_PRISMATIC", "JOINT_GEAR"])
def test_each_change_leaves_the_fields_that_pybullets_does(bullet: Any, script: ModuleType, kind: str) -> None:
    found: list[Any] = []
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        ends = (arm, 1, arm, 3) if kind == "JOINT_GEAR" else (_box(p, (0, 0, 5)), -1, _box(p, (0.3, 0, 5)), -1)
        frames = ([0, 0, 2], [0.15, 0, 0], [-0.15, 0, 0], [0, 0, 0.6, 0.8], [0.6, 0, 0, 0.8])
        made = p.createConstraint(*ends, getattr(p, kind), *frames)
        infos = [p.getConstraintInfo(made)]
        for change in _CHANGES:
            assert p.changeConstraint(made, **change) is None
            infos.append(p.getConstraintInfo(made))
        # PyBullet ends the process if a gear is asked for its force before a step.
        lengths = 0 if kind == "JOINT_GEAR" else len(p.getConstraintState(made))
        found.append((made, lengths, infos))
    assert found[0] == found[1]


def test_a_gear_turns_a_joint_as_pybullets_does(bullet: Any, script: ModuleType) -> None:
    found: list[Any] = []
    for p in _both(bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        for joint in range(p.getNumJoints(arm)):
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
        made = p.createConstraint(arm, 1, arm, 3, p.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
        p.changeConstraint(made, gearRatio=-0.5, maxForce=10000)
        _run(p, 60)
        (first, _, *_), (second, _, *_) = p.getJointState(arm, 1), p.getJointState(arm, 3)
        (size,) = p.getConstraintState(made)
        assert abs(size) > 0
        found.append((first, second))
    (theirs, their_second), (ours, our_second) = found
    assert ours - 0.5 * our_second == pytest.approx(0, abs=1e-6)
    # Bullet's slips.
    assert theirs - 0.5 * their_second == pytest.approx(0, abs=1e-2)
    assert ours == pytest.approx(theirs, abs=0.02)


@pytest.mark.parametrize("ratio", [-0.5, 2.0])
def test_a_gear_does_what_pybullets_does(bullet: Any, script: ModuleType, tmp_path: Path, ratio: float) -> None:
    """Two arms have 1 kg m^2, and one a torque of 6 N m: v + ratio * w = 0 takes 6 / (1 + ratio^2) of it."""
    found: list[Any] = []
    for p in (bullet, script):
        first, second = turning_arm(p, tmp_path), turning_arm(p, tmp_path)
        for body in (first, second):
            p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        made = p.createConstraint(first, 0, second, 0, p.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
        p.changeConstraint(made, gearRatio=ratio, maxForce=10000)
        for _ in range(24):
            p.setJointMotorControl2(first, 0, p.TORQUE_CONTROL, force=6)
            p.stepSimulation()
        # PyBullet ends the process if a gear is asked for this before a step.
        (effort,) = p.getConstraintState(made)
        joints = [p.getJointState(body, 0)[:2] for body in (first, second)]
        found.append((effort, joints, p.getConstraintInfo(made)))
    (effort, joints, info), (our_effort, our_joints, our_info) = found
    # Its size: PyBullet's has the sign of its effect on the first joint.
    assert our_effort == pytest.approx(6 / (1 + ratio**2), rel=1e-4)
    assert our_effort == pytest.approx(abs(effort), rel=1e-3)
    for (position, velocity), (our_position, our_velocity) in zip(joints, our_joints, strict=True):
        assert our_velocity == pytest.approx(velocity, rel=1e-3)
        assert our_position == pytest.approx(position, abs=2e-3)
    assert our_info == info


def test_numbers_come_and_go_as_pybullets_do(bullet: Any, script: ModuleType) -> None:
    found: list[Any] = []
    for p in (bullet, script):

        def numbers(p: Any = p) -> list[int]:
            count = p.getNumConstraints()
            assert p.getConstraintUniqueId(count) == p.getConstraintUniqueId(-1) == -1
            return [p.getConstraintUniqueId(index) for index in range(count)]

        def fixed(a: int, b: int, p: Any = p) -> int:
            made: int = p.createConstraint(a, -1, b, -1, p.JOINT_FIXED, [0, 0, 0], [0.15, 0, 0], [-0.15, 0, 0])
            return made

        seen: list[Any] = [numbers()]
        boxes = [_box(p, (0.3 * index, 0, 1)) for index in range(4)]
        made = [fixed(a, b) for a, b in ((0, 1), (1, 2), (2, 3), (0, 3), (0, -1), (3, 1))]
        seen += [boxes, made, numbers()]
        p.removeConstraint(made[1])
        seen.append(numbers())
        for gone in (p.getConstraintInfo, p.getConstraintState):
            with pytest.raises(p.error):
                gone(made[1])
        seen += [fixed(1, 2), numbers()]
        # Constraints of a body are deleted with it, as parent and as child.
        p.removeBody(boxes[1])
        seen.append(numbers())
        p.stepSimulation()
        p.resetSimulation()
        seen.append(numbers())
        seen.append(fixed(_box(p, (0, 0, 1)), -1))
        found.append(seen)
    assert found[0] == found[1]


def test_ends_that_are_not_there_are_refused(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        box, other = _box(p, (0, 0, 1)), _box(p, (0.3, 0, 1))
        for ends in ((9, -1, other, -1), (box, 3, other, -1), (box, -1, other, 4), (box, -2, other, -1)):
            for kind in (p.JOINT_FIXED, p.JOINT_GEAR):
                with pytest.raises(p.error, match="createConstraint"):
                    p.createConstraint(*ends, kind, [1, 0, 0], [0, 0, 0], [0, 0, 0])
        for kind in (p.JOINT_REVOLUTE, p.JOINT_SPHERICAL, p.JOINT_PLANAR, 77):
            with pytest.raises(p.error, match="createConstraint failed"):
                p.createConstraint(box, -1, -1, -1, kind, [1, 0, 0], [0, 0, 0], [0, 0, 0])
        assert p.getNumConstraints() == 0


def test_constraints_without_effect_in_pybullet_are_refused(bullet: Any, script: ModuleType) -> None:
    """An unknown child, and a link held to itself, make wrong constraints in PyBullet, or none."""
    for p, refuses in ((bullet, False), (script, True)):
        box = _box(p, (0, 0, 1))
        zero = [0, 0, 0]
        for ends, kind, axis in (
            ((box, -1, 9, -1), p.JOINT_FIXED, zero),
            ((box, -1, box, -1), p.JOINT_FIXED, zero),
        ):
            if refuses:
                with pytest.raises(p.error):
                    p.createConstraint(*ends, kind, axis, zero, zero)
            else:
                assert p.createConstraint(*ends, kind, axis, zero, zero) > 0
        made = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0], zero, [0, 0, 1])
        before = p.getConstraintInfo(made)
        p.changeConstraint(made, [1, 2])
        assert p.getConstraintInfo(made) == before


def test_refused_constraints_change_nothing(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    made = script.createConstraint(arm, 1, arm, 3, script.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
    before = script.getConstraintInfo(made)
    with pytest.raises(script.error, match="offset"):
        script.changeConstraint(made, maxForce=3, relativePositionTarget=1e300)
    assert script.getConstraintInfo(made) == before
