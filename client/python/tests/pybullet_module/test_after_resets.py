"""Contacts after a reset, and limits that are given to inverse kinematics."""

from __future__ import annotations

import math
from types import ModuleType

import pytest

from .conftest import SEVEN_ARM


def test_contacts_are_those_of_the_poses_that_were_just_set(script: ModuleType) -> None:
    floor = script.createMultiBody(0, script.createCollisionShape(script.GEOM_BOX, halfExtents=[5, 5, 0.5]), basePosition=[0, 0, -0.5])
    cube = script.createMultiBody(1, script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1] * 3), basePosition=[0, 0, 2])
    script.stepSimulation()
    assert script.getContactPoints(cube) == ()
    for height, touches in ((0.08, True), (2.0, False), (0.05, True)):
        script.resetBasePositionAndOrientation(cube, [0, 0, height], [0, 0, 0, 1])
        script.performCollisionDetection()
        for found in (script.getContactPoints(cube), script.getContactPoints(floor, cube), script.getContactPoints()):
            assert bool(found) == touches
            assert all(row[8] == pytest.approx(height - 0.1, abs=1e-6) for row in found)
        assert [row[1:3] for row in script.getContactPoints(cube, floor)] == ([(cube, floor)] if touches else [])
    # With a step they have forces again.
    script.setGravity(0, 0, -10)
    script.resetBasePositionAndOrientation(cube, [0, 0, 0.1], [0, 0, 0, 1])
    script.performCollisionDetection()
    for _ in range(20):
        script.stepSimulation()
    assert sum(row[9] for row in script.getContactPoints(cube, floor)) == pytest.approx(10.0, rel=0.05)


def test_a_pair_that_was_switched_off_does_not_touch(script: ModuleType) -> None:
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1] * 3)
    one, other = (script.createMultiBody(1, shape, basePosition=[x, 0, 0]) for x in (0, 5))
    script.setCollisionFilterPair(one, other, -1, -1, 0)
    script.resetBasePositionAndOrientation(other, [0.05, 0, 0], [0, 0, 0, 1])
    script.performCollisionDetection()
    assert script.getContactPoints(one, other) == ()


def test_inverse_kinematics_keeps_the_limits_that_it_is_given(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    rest = [0.0, 0.5, 0.0, -1.2, 0.0, 1.0, 0.0]
    for joint, at in enumerate(rest):
        script.resetJointState(arm, joint, at)
    hand = script.getNumJoints(arm) - 1
    (x, y, z) = script.getLinkState(arm, hand)[4]
    goal = [x * math.cos(0.4) - y * math.sin(0.4), x * math.sin(0.4) + y * math.cos(0.4), z]
    free = script.calculateInverseKinematics(arm, hand, goal, restPoses=rest)
    assert abs(free[0]) > 0.1
    low, high = [-0.1] + [-2.0] * 6, [0.1] + [2.0] * 6
    kept = script.calculateInverseKinematics(arm, hand, goal, lowerLimits=low, upperLimits=high, jointRanges=[1] * 7, restPoses=rest)
    assert all(a - 1e-9 <= q <= b + 1e-9 for a, q, b in zip(low, kept, high))
    # And the robot has its own limits again.
    assert script.calculateInverseKinematics(arm, hand, goal, restPoses=rest) == pytest.approx(free, abs=1e-6)
