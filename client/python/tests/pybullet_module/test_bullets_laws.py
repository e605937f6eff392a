"""Bullet's laws of overlaps, hits, limits, speeds and damping: numbers of PyBullet 3.2.7, and random ones where it is installed."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ARM = """<robot name="arm"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.02"/></inertial></link>
<joint name="j" type="{kind}"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-0.5" upper="0.7" effort="0" velocity="0"/></joint></robot>"""


def begin(p: Any, gravity: float, time_step: float) -> None:
    p.resetSimulation()
    p.setGravity(0, 0, gravity)
    p.setTimeStep(time_step)


def steps(p: Any, marks: tuple[int, ...], read: Callable[[], list[float]]) -> list[float]:
    """Readings after these numbers of steps."""
    found: list[float] = []
    for step in range(1, marks[-1] + 1):
        p.stepSimulation()
        if step in marks:
            found += read()
    return found


def height(p: Any, body: int) -> list[float]:
    return [p.getBasePositionAndOrientation(body)[0][2], p.getBaseVelocity(body)[0][2]]


def arm(p: Any, folder: Path, kind: str, position: float, velocity: float) -> int:
    file = folder / f"{kind}.urdf"
    file.write_text(ARM.format(kind=kind))
    body: int = p.loadURDF(str(file), useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.resetJointState(body, 0, position, velocity)
    return body


def sunk(p: Any, depth: float, time_step: float, gravity: float) -> list[float]:
    begin(p, gravity, time_step)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    ball = p.createMultiBody(2, p.createCollisionShape(p.GEOM_SPHERE, radius=0.5), basePosition=[0, 0, 0.5 - depth])
    return steps(p, (1, 2, 20, 240), lambda: height(p, ball))


SUNK = {
    (0.011306259157317372, 1 / 240, 0.0): [0.4896, 0.21689, 0.4905, 0.21684, 0.50673, 0.21605, 0.70042, 0.20667],
    (0.27827769170082084, 1 / 100, -10.0): [0.24398, 2.22614, 0.26522, 2.12327, 0.47358, 0.30081, 0.49999, 0.0],
}


@pytest.mark.parametrize("case", SUNK)
def test_a_ball_in_the_ground_leaves_it_as_in_pybullet(script: ModuleType, case: tuple[float, float, float]) -> None:
    assert sunk(script, *case) == pytest.approx(SUNK[case], abs=1e-4)


BOXES = {0.05: [-0.71986, 0.23995, 0.951, -0.70782, 0.23705, 1.00962], 0.4: [-5.75985, 1.91995, 0.608, -5.39884, 1.86608, 1.0732]}


@pytest.mark.parametrize("depth", BOXES)
def test_boxes_in_each_other_fly_apart_as_in_pybullet(script: ModuleType, depth: float) -> None:
    begin(script, 0, 1 / 240)
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.5] * 3)
    light, heavy = (script.createMultiBody(mass, shape, basePosition=[0, 0, z]) for mass, z in ((1, 0.0), (3, 1 - depth)))

    def read() -> list[float]:
        return [height(script, light)[1], height(script, heavy)[1], height(script, heavy)[0]]

    assert steps(script, (1, 60), read) == pytest.approx(BOXES[depth], abs=1e-3)


def beyond(p: Any, folder: Path, kind: str, time_step: float, position: float, velocity: float, gravity: float) -> list[float]:
    begin(p, gravity, time_step)
    body = arm(p, folder, kind, position, velocity)
    return steps(p, (1, 2, 5, 40), lambda: list(p.getJointState(body, 0)[:2]))


BEYOND = {
    ("revolute", 1 / 240, 1.0, 5.0, -10.0): [1.0, 0.0, 0.99979, -0.05009, 0.99791, -0.20028, 0.84017, -1.88312],
    ("prismatic", 0.01, -0.52, 0.0, -10.0): [-0.516, 0.4, -0.512, 0.4, -0.5, 0.4, -0.36, 0.4],
    ("prismatic", 1 / 240, 0.73, -1.0, 0.0): [0.724, -1.44, 0.718, -1.44, 0.7, -1.44, 0.49, -1.44],
    ("revolute", 0.01, 0.739, 2.0, -10.0): [0.7312, -0.78, 0.72245, -0.87539, 0.69056, -1.15553, -0.12165, -2.79706],
    ("prismatic", 0.01, -0.6, 0.0, 0.0): [-0.6, 0.0, -0.6, 0.0, -0.6, 0.0, -0.6, 0.0],
}


@pytest.mark.parametrize("case", BEYOND)
def test_a_joint_beyond_its_limit_comes_back_as_in_pybullet(
    script: ModuleType, tmp_path: Path, case: tuple[str, float, float, float, float]
) -> None:
    assert beyond(script, tmp_path, *case) == pytest.approx(BEYOND[case], abs=1e-3)


def test_velocities_end_at_a_hundred_or_the_maximum_of_the_joint(script: ModuleType, tmp_path: Path) -> None:
    p = script
    begin(p, 0, 1 / 240)
    free, slow = (arm(p, tmp_path, "prismatic", 0.1, 120.0) for _ in range(2))
    p.changeDynamics(slow, 0, maxJointVelocity=30)
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 9])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.resetBaseVelocity(body, [150, -30, 0], [120, 130, 0])
    p.stepSimulation()
    assert p.getJointState(free, 0)[:2] == pytest.approx((0.51667, 100.0), abs=1e-5)
    assert p.getJointState(slow, 0)[:2] == pytest.approx((0.225, 30.0), abs=1e-5)
    linear, angular = p.getBaseVelocity(body)
    assert linear == pytest.approx((100.0, -30.0, 0.0)) and angular == pytest.approx((100.0, 100.0, 0.0))


def test_links_are_damped_as_in_pybullet(script: ModuleType) -> None:
    p = script
    begin(p, 0, 1 / 50)
    body = p.createMultiBody(1.5, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    p.changeDynamics(body, -1, linearDamping=0.04, angularDamping=3.0)
    p.resetBaseVelocity(body, [9.08259, 3.55696, 2.22793], [16.24701, 0, 0])
    found = steps(p, (1, 5, 100), lambda: [*p.getBaseVelocity(body)[0], p.getBaseVelocity(body)[1][0]])
    theirs = [9.00262, 3.52564, 2.20831, -0.56573, 8.69581, 3.40549, 2.13305, -0.38872, 4.72441, 1.85019, 1.15888, -0.00077]
    assert found == pytest.approx(theirs, abs=2e-5)


@pytest.mark.parametrize("seed", range(4))
def test_random_overlaps_and_limits_are_pybullets(bullet: Any, script: ModuleType, tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    overlap = rng.choice([0.001, 0.02, 0.2]) * (0.5 + rng.random()), rng.choice([1 / 240, 1 / 1000]), rng.choice([0.0, -10.0])
    kind, time_step = rng.choice(["revolute", "prismatic"]), rng.choice([1 / 240, 1 / 100])
    limit = kind, time_step, 0.7 + rng.choice([-0.01, 0.02, 0.2]) * rng.random(), 8 * rng.random() - 4, rng.choice([0.0, -10.0])
    theirs, ours = ([sunk(p, *overlap), beyond(p, tmp_path, *limit)] for p in (bullet, script))
    assert ours[0] == pytest.approx(theirs[0], abs=2e-3), f"seed {seed}: {overlap}"
    assert ours[1] == pytest.approx(theirs[1], abs=2e-3), f"seed {seed}: {limit}"


@pytest.mark.parametrize("limits", [{}, {"jointLowerLimit": -0.2}, {"jointUpperLimit": 0.2}, {"jointUpperLimit": 1.5}, {"jointLowerLimit": 1, "jointUpperLimit": -1}])
def test_limits_that_are_not_in_order_change_nothing(bullet: Any, script: ModuleType, tmp_path: Path, limits: dict[str, float]) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        begin(p, 0, 1 / 240)
        body = arm(p, tmp_path, "prismatic", 0.1, 3.0)
        p.changeDynamics(body, 0, **limits)
        found.append(steps(p, (20, 60, 120), lambda: list(p.getJointState(body, 0)[:2])))
    assert found[1] == pytest.approx(found[0], abs=1e-4)


def test_contacts_are_set_by_the_script(bullet: Any, script: ModuleType) -> None:
    """The ERP, the slop and the threshold of restitution, and their defaults after resetSimulation."""
    found: list[list[float]] = []
    for p in (bullet, script):
        found.append([])
        for number in range(3):
            if number < 2:
                begin(p, 0, 1 / 240)
            if number == 1:
                p.setPhysicsEngineParameter(contactERP=0.3, contactSlop=0.002, restitutionVelocityThreshold=2.0)
            if number == 2:
                p.resetSimulation()
                p.setDefaultContactERP(0.5)
            plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
            ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.5), basePosition=[0, 0, 0.49])
            for body in (plane, ball):
                p.changeDynamics(body, -1, restitution=0.5)
            p.resetBaseVelocity(ball, [0, 0, -1.0])
            found[-1] += steps(p, (1, 2, 10), lambda: height(p, ball))
    assert found[1] == pytest.approx(found[0], abs=1e-4)
