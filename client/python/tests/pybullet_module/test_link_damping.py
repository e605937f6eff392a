"""Damping of links compared with PyBullet, whose articulated bodies have 0.04 per second until changeDynamics."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest

from .conftest import SEVEN_ARM

# Linear and angular damping that a script sets; `None` sets nothing.
CASES = [(None, None), (0.0, 0.0), (0.5, None), (None, 2.0), (-1.0, 0.3)]


def damped(p: Any, body: int, linear: float | None, angular: float | None) -> None:
    given = {name: value for name, value in (("linearDamping", linear), ("angularDamping", angular)) if value is not None}
    if given:
        p.changeDynamics(body, -1, **given)


@pytest.mark.parametrize(("linear", "angular"), CASES)
def test_flying_and_spinning_bodies_slow_down_as_in_pybullet(
    bullet: Any, script: ModuleType, linear: float | None, angular: float | None
) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -10)
        body = p.createMultiBody(2.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 50])
        damped(p, body, linear, angular)
        p.resetBaseVelocity(body, [3, -2, 1], [0, 0, 7])
        for _ in range(240):
            p.stepSimulation()
        velocity, spin = p.getBaseVelocity(body)
        found.append([*p.getBasePositionAndOrientation(body)[0], *velocity, spin[2]])
    # Bullet damps explicitly; here h k (1 + v) of the damping is missing.
    assert found[1] == pytest.approx(found[0], rel=1e-2, abs=6e-3)


@pytest.mark.parametrize(("linear", "angular"), CASES)
def test_an_arm_that_swings_slows_down_as_in_pybullet(
    bullet: Any, script: ModuleType, linear: float | None, angular: float | None
) -> None:
    """Each link has its own share. Without motors, and so briefly that no joint meets a limit."""
    found: list[list[float]] = []
    for p in (bullet, script):
        p.setTimeStep(5e-4)
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        damped(p, arm, linear, angular)
        for joint in range(p.getNumJoints(arm)):
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
            p.changeDynamics(arm, joint, jointDamping=0.0)
            p.resetJointState(arm, joint, 0.1, 2.0)
        for _ in range(200):
            p.stepSimulation()
        found.append([value for joint in range(p.getNumJoints(arm)) for value in p.getJointState(arm, joint)[:2]])
    assert found[1] == pytest.approx(found[0], abs=1e-2)


def test_a_rigid_body_in_maximal_coordinates_is_not_damped(bullet: Any, script: ModuleType) -> None:
    found: list[float] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -10)
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        body = p.createMultiBody(2.0, shape, basePosition=[0, 0, 50], useMaximalCoordinates=1)
        for _ in range(240):
            p.stepSimulation()
        found.append(p.getBaseVelocity(body)[0][2])
    assert found[1] == pytest.approx(found[0], rel=1e-5)


def test_damping_stays_through_a_new_mass_a_new_base_and_a_restored_state(script: ModuleType) -> None:
    """A body falls as fast as one to which nothing of that happened."""
    script.setGravity(0, 0, -10)
    shape = script.createCollisionShape(script.GEOM_SPHERE, radius=0.1)
    plain, changed = (script.createMultiBody(2.0, shape, basePosition=[x, 0, 50]) for x in (0, 5))
    saved = script.saveState()
    for body in (plain, changed):
        script.changeDynamics(body, -1, linearDamping=0.7)
    script.restoreState(saved)
    script.changeDynamics(changed, -1, mass=0)
    script.changeDynamics(changed, -1, mass=3)
    for _ in range(240):
        script.stepSimulation()
    speeds = [script.getBaseVelocity(body)[0][2] for body in (plain, changed)]
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-9) and -6.0 < speeds[0] < -1.0
