"""Constraints between links, beside PyBullet's own."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest

from simd_client.pybullet.arguments import Vector


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


def test_two_boxes_hold_each_other_as_pybullets_do(bullet: Any, script: ModuleType) -> None:
    found: list[Any] = []
    for p in _both(bullet, script):
        low, high = _box(p, (0, 0, 1)), _box(p, (0, 0, 1.3), 0.0)
        made = p.createConstraint(low, -1, high, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.15], [0, 0, -0.15])
        _run(p)
        assert p.getNumConstraints() == 1 and p.getConstraintUniqueId(0) == made
        found.append((p.getConstraintState(made), p.getBasePositionAndOrientation(low)[0]))
        # Moved by its frame on the child, and let go.
        p.changeConstraint(made, [0, 0, -0.25], maxForce=500)
        _run(p)
        found[-1] += (p.getBasePositionAndOrientation(low)[0],)
        p.removeConstraint(made)
        assert p.getNumConstraints() == 0
        _run(p, 24)
        assert p.getBasePositionAndOrientation(low)[0][2] < 0.87
    (state, *places), (our_state, *our_places) = found
    assert our_state == pytest.approx(state, abs=1e-3)
    for ours, theirs in zip(our_places, places, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-3)


def test_a_force_that_is_not_enough_lets_a_box_down(script: ModuleType) -> None:
    script.setGravity(0, 0, -10)
    box = _box(script, (0, 0, 1))
    made = script.createConstraint(box, -1, -1, -1, script.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    script.changeConstraint(made, maxForce=3)
    _run(script)
    # On the child, as PyBullet has it.
    assert script.getConstraintState(made)[2] == pytest.approx(-3.0, abs=1e-6)
    # 5 N of weight less 3 N, for a second.
    assert script.getBasePositionAndOrientation(box)[0][2] == pytest.approx(1 - 2.0, abs=0.02)


def test_what_is_not_there_is_answered_as_by_pybullet(bullet: Any, script: ModuleType) -> None:
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
