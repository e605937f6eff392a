"""What touches what, and what rays hit."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest


@pytest.fixture
def resting(script: ModuleType) -> "tuple[int, int]":
    """A floor, and a box of 2 kg that lies on it."""
    floor = script.createMultiBody(0.0, script.createCollisionShape(script.GEOM_PLANE))
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    box = script.createMultiBody(2.0, shape, -1, [0, 0, 0.1])
    script.setGravity(0, 0, -9.81)
    for _ in range(240):
        script.stepSimulation()
    return floor, box


def test_what_lies_is_carried(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    points: tuple[Any, ...] = script.getContactPoints(box, floor)
    assert len(points) >= 3
    # A is the box: the normal on the floor shows up to it.
    assert {point[1:5] for point in points} == {(box, floor, -1, -1)}
    for point in points:
        assert len(point) == 14
        assert point[7] == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
        assert point[5][2] == pytest.approx(0.0, abs=2e-3)
        assert point[6][2] - point[5][2] == pytest.approx(-point[8], abs=1e-9)
    assert sum(point[9] for point in points) == pytest.approx(2.0 * 9.81, rel=0.01)


def test_the_first_body_asked_for_is_a(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    swapped = script.getContactPoints(floor, box)
    assert {point[1:3] for point in swapped} == {(floor, box)}
    assert all(point[7] == pytest.approx((0.0, 0.0, -1.0), abs=1e-3) for point in swapped)
    assert len(script.getContactPoints()) == len(swapped)
    assert len(script.getContactPoints(box)) == len(swapped)
    assert script.getContactPoints(box, floor, linkIndexA=3) == ()
    assert script.getContactPoints(77) == ()


def test_rays_stop_at_what_they_hit(script: ModuleType, resting: "tuple[int, int]") -> None:
    floor, box = resting
    (hit,) = script.rayTest([0, 0, 2.2], [0, 0, -1.8])
    assert hit[:2] == (box, -1)
    assert hit[2] == pytest.approx(0.5, abs=1e-3)
    assert hit[3] == pytest.approx((0.0, 0.0, 0.2), abs=2e-3)
    assert hit[4] == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert script.rayTest([5, 0, 2], [5, 0, 3]) == ((-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),)
    many = script.rayTestBatch(
        [[x * 0.01, 3, 1] for x in range(2500)], [[x * 0.01, 3, -1] for x in range(2500)]
    )
    assert len(many) == 2500
    assert {ray[0] for ray in many} == {floor}
    (beside,) = script.rayTestBatch([[0, 3, 1]], [[0, 3, -1]], parentObjectUniqueId=box)
    assert beside[0] == floor and beside[3][2] == pytest.approx(0.0, abs=1e-6)


def test_friction_and_restitution_are_changed(script: ModuleType, resting: "tuple[int, int]") -> None:
    _, box = resting
    script.changeDynamics(box, -1, lateralFriction=0.05, restitution=0.3)
    info = script.getDynamicsInfo(box, -1)
    assert (info[1], info[5]) == (0.05, 0.3)
