"""Restored properties of a saved state, and kept settings of the script, compared with PyBullet."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from simd_client.pybullet.connections import connected

INERTIAL = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
ARM = (
    f"<robot name='arm'><link name='post'>{INERTIAL}</link><link name='arm'>{INERTIAL}</link><joint name='turn' type='revolute'>"
    "<parent link='post'/><child link='arm'/><axis xyz='0 0 1'/><limit lower='-2' upper='2' effort='{effort}' velocity='0'/>"
    "</joint></robot>"
)
WAYS = ["memory", "file"]


def arm(p: Any, folder: Path, effort: float = 0.0) -> int:
    """A link of 1 kg m^2 that rotates about z, without Bullet's own damping; an effort of 0 means no
    limit."""
    (folder / "arm.urdf").write_text(ARM.format(effort=effort))
    body: int = p.loadURDF(str(folder / "arm.urdf"), [5, 0, 0], useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
    p.changeDynamics(body, 0, linearDamping=0, angularDamping=0)
    return body


def ball(p: Any, x: float = 0.0) -> int:
    body: int = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [x, 0, 50])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    return body


def step(p: Any, count: int) -> None:
    for _ in range(count):
        p.stepSimulation()


class Kept:
    """A state in memory or in a file."""

    def __init__(self, p: Any, way: str, folder: Path) -> None:
        self._p = p
        self._file = "" if way == "memory" else str(folder / f"{p.__name__}.bullet")
        self._number = p.saveState() if way == "memory" else -1
        if self._file:
            p.saveBullet(self._file)

    def restore(self) -> None:
        if self._file:
            self._p.restoreState(fileName=self._file)
        else:
            self._p.restoreState(self._number)


@pytest.mark.parametrize("way", WAYS)
def test_motors_and_settings_of_the_world_stay(bullet: Any, script: ModuleType, tmp_path: Path, way: str) -> None:
    found: list[list[Any]] = []
    for p in (bullet, script):
        body, falling = arm(p, tmp_path), ball(p)
        p.setGravity(0, 0, -10)
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, 0.5)
        step(p, 10)
        kept = Kept(p, way, tmp_path)
        before = p.getJointState(body, 0)[:2], p.getBasePositionAndOrientation(falling), p.getBaseVelocity(falling)
        p.setGravity(0, 0, -3)
        p.setPhysicsEngineParameter(fixedTimeStep=1 / 120, numSubSteps=2)
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, -0.4, positionGain=0.05)
        step(p, 5)
        kept.restore()
        assert before == (
            p.getJointState(body, 0)[:2], p.getBasePositionAndOrientation(falling), p.getBaseVelocity(falling)
        )
        settings = p.getPhysicsEngineParameters()
        found.append([settings[name] for name in ("gravityAccelerationZ", "fixedTimeStep", "numSubSteps")])
        for _ in range(5):
            step(p, 3)
            found[-1] += [p.getJointState(body, 0)[0], p.getBasePositionAndOrientation(falling)[0][2]]
    assert found[0][0] == -3.0
    assert found[1] == pytest.approx(found[0], abs=2e-3)


@pytest.mark.parametrize("way", WAYS)
def test_a_torque_that_waits_for_its_step_goes_on_waiting(
    bullet: Any, script: ModuleType, tmp_path: Path, way: str
) -> None:
    for p in (bullet, script):
        body = arm(p, tmp_path)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=24)
        kept = Kept(p, way, tmp_path)
        step(p, 1)
        assert p.getJointState(body, 0)[1] == pytest.approx(0.1)
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=48)
        kept.restore()
        assert p.getJointState(body, 0)[1] == 0.0
        step(p, 2)
        assert p.getJointState(body, 0)[1] == pytest.approx(0.2)


@pytest.mark.parametrize("way", WAYS)
def test_masses_surfaces_limits_and_damping_stay(bullet: Any, script: ModuleType, tmp_path: Path, way: str) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        body, thrown = arm(p, tmp_path), ball(p)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(body, 0, 0.0, 0.25)
        p.resetBaseVelocity(thrown, [1, 0, 0])
        step(p, 10)
        kept = Kept(p, way, tmp_path)
        p.changeDynamics(thrown, -1, mass=3, lateralFriction=0.9)
        p.changeDynamics(body, 0, jointLowerLimit=-0.1, jointUpperLimit=0.1, jointDamping=0.5)
        step(p, 10)
        kept.restore()
        mass, friction, inertia, *_ = p.getDynamicsInfo(thrown, -1)
        numbers = [mass, friction, *inertia]
        p.applyExternalForce(thrown, -1, [0, 72, 0], [0, 0, 0], p.LINK_FRAME)
        step(p, 1)
        numbers += [*p.getBaseVelocity(thrown)[0], *p.getJointState(body, 0)[:2]]
        for _ in range(300):
            p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=0.5)
            p.stepSimulation()
        found.append([*numbers, p.getJointState(body, 0)[0]])
    assert found[1] == pytest.approx(found[0], abs=2e-3)
    assert found[1][0] == 3.0 and found[1][-1] == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize("way", WAYS)
def test_a_base_that_was_fixed_since_stays_fixed(bullet: Any, script: ModuleType, tmp_path: Path, way: str) -> None:
    for p in (bullet, script):
        held = ball(p)
        step(p, 1)
        kept = Kept(p, way, tmp_path)
        p.changeDynamics(held, -1, mass=0)
        kept.restore()
        p.setGravity(0, 0, -10)
        step(p, 24)
        assert p.getDynamicsInfo(held, -1)[0] == 0.0
        assert p.getBasePositionAndOrientation(held)[0] == pytest.approx((0, 0, 50))


@pytest.mark.parametrize("way", WAYS)
def test_constraints_are_those_of_now(bullet: Any, script: ModuleType, tmp_path: Path, way: str) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -10)
        balls = [ball(p, float(x)) for x in range(4)]

        def hang(number: int, p: Any = p, balls: list[int] = balls) -> int:
            at = p.getBasePositionAndOrientation(balls[number])[0]
            made: int = p.createConstraint(balls[number], -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], at)
            return made

        # One is removed, one stays, one moves; the last one comes later.
        made = [hang(number) for number in range(3)]
        step(p, 2)
        kept = Kept(p, way, tmp_path)
        p.removeConstraint(made[0])
        p.changeConstraint(made[2], [2, 0, 50.02], maxForce=400)
        hang(3)
        step(p, 10)
        kept.restore()
        assert p.getNumConstraints() == 3
        step(p, 120)
        found.append([p.getBasePositionAndOrientation(body)[0][2] for body in balls])
    assert found[0][0] < 49.0
    # The last one was not held when the state was saved, and gets its original pose.
    assert found[1] == pytest.approx(found[0], abs=5e-3)


def test_gears_are_those_of_now_and_go_on_from_where_the_joints_are(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    found: list[list[float]] = []
    for p in (bullet, script):
        first, second = arm(p, tmp_path), arm(p, tmp_path)
        for body in (first, second):
            p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.setJointMotorControl2(first, 0, p.VELOCITY_CONTROL, targetVelocity=0.5)
        step(p, 24)
        kept = p.saveState()
        made = p.createConstraint(first, 0, second, 0, p.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
        p.changeConstraint(made, gearRatio=-2, maxForce=10000)
        step(p, 24)
        p.restoreState(kept)
        assert p.getJointState(second, 0)[0] == pytest.approx(0.0, abs=1e-9)
        step(p, 24)
        found.append([p.getJointState(body, 0)[0] for body in (first, second)])
    assert found[1] == pytest.approx(found[0], abs=5e-3) and found[1][1] > 0.02


@pytest.mark.parametrize("way", WAYS)
def test_collision_filters_stay(bullet: Any, script: ModuleType, tmp_path: Path, way: str) -> None:
    for p in (bullet, script):
        p.setGravity(0, 0, -10)
        floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[9, 9, 1]), -1, [0, 0, 48.8])
        lies, falls = ball(p, 0.0), ball(p, 2.0)
        step(p, 2)
        kept = Kept(p, way, tmp_path)
        p.setCollisionFilterPair(falls, floor, -1, -1, 0)
        kept.restore()
        step(p, 120)
        heights = [p.getBasePositionAndOrientation(body)[0][2] for body in (lies, falls)]
        assert heights[0] == pytest.approx(49.9, abs=0.02) and heights[1] < 49.0


def test_settings_before_a_saved_state_are_not_sent_again(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A restore costs the same calls, regardless of the number of unchanged robots."""
    body = arm(script, tmp_path)
    balls = [ball(script, float(x)) for x in range(8)]
    script.setCollisionFilterPair(balls[0], balls[1], -1, -1, 0)
    script.createConstraint(balls[0], -1, -1, -1, script.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 50])
    kept = script.saveState()
    step(script, 3)
    wire = connected(0).wire
    calls: list[str] = []
    call = wire.call

    def counting(method: Any, request: Any) -> Any:
        calls.append(method.key.rpartition("/")[2])
        return call(method, request)

    monkeypatch.setattr(wire, "call", counting)
    script.restoreState(kept)
    assert sorted(calls) == sorted(
        ["GetPhysics", "GetSimulationState", "ListConstraints"] * 2 + ["ListEntities", "RestoreState", "GetJointLayout"]
    )
    calls.clear()
    step(script, 1)
    # A world in the process is stepped without messages.
    assert calls in (["StepSimulation"], []) and script.getJointState(body, 0)[0] == 0.0


def test_a_joint_that_was_beyond_its_limit_is_there_again(script: ModuleType, tmp_path: Path) -> None:
    body = arm(script, tmp_path)
    script.setJointMotorControl2(body, 0, script.VELOCITY_CONTROL, force=0)
    script.resetJointState(body, 0, 2.5)
    step(script, 2)
    kept = script.saveState()
    script.resetJointState(body, 0, 0.5)
    step(script, 2)
    script.restoreState(kept)
    step(script, 5)
    assert script.getJointState(body, 0)[0] == pytest.approx(2.5)
    # It returns, and then its limit holds: as in PyBullet, it comes back from a little beyond.
    script.resetJointState(body, 0, 2.5, -6.0)
    step(script, 60)
    script.resetJointState(body, 0, 1.5, 6.0)
    farthest = 0.0
    for _ in range(60):
        step(script, 1)
        farthest = max(farthest, script.getJointState(body, 0)[0])
    assert 2.0 <= farthest < 2.04
