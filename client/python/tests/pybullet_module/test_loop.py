"""A turn of a script's loop: its cost, and its effect on the joints."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import simd_client.pybullet as pybullet
from simd_client.pybullet.connections import connected

from .conftest import BENCH_ARM, SEVEN_ARM

Calls = Counter[str]


STEP = "SimulationService/StepSimulation"


@pytest.fixture
def calls(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Calls:
    """Counts the calls to the daemon, by method."""
    counted: Calls = Counter()
    wire = connected(0).wire
    call = wire.call

    def counting(method: Any, request: Any, **options: Any) -> Any:
        counted[method.key] += 1
        return call(method, request, **options)

    monkeypatch.setattr(wire, "call", counting)
    return counted


def test_a_turn_costs_one_round_trip(script: ModuleType, calls: Calls) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    slider = script.addUserDebugParameter("elbow", -1, 1, 0.2)
    script.stepSimulation()
    calls.clear()
    for _ in range(50):
        wanted = script.readUserDebugParameter(slider)
        for joint in range(7):
            script.setJointMotorControl2(arm, joint, script.POSITION_CONTROL, wanted, force=200)
            script.getJointState(arm, joint)
        script.getJointStates(arm, range(7))
        script.stepSimulation()
    # Sliders are requested at intervals of the wall clock, in addition to publications.
    calls.pop("ParameterService/GetParameters", None)
    # A world in the process is stepped without messages after the first step of a loop.
    assert set(calls) == {STEP} and calls[STEP] in (1, 50)


def test_poses_of_links_and_bases_come_with_the_step_once_they_were_read(
    script: ModuleType, calls: Calls
) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    ball = script.createMultiBody(
        1.0, script.createCollisionShape(script.GEOM_SPHERE, radius=0.1), -1, [3, 0, 9]
    )
    script.changeDynamics(ball, -1, linearDamping=0)
    script.setGravity(0, 0, -9.81)
    script.getLinkState(arm, 6)
    calls.clear()
    for turn in range(1, 51):
        script.stepSimulation()
        script.getLinkStates(arm, range(7), computeLinkVelocity=1)
        script.getBasePositionAndOrientation(arm)
        # v = -g h n.
        assert script.getBaseVelocity(ball)[0][2] == pytest.approx(-9.81 * turn / 240, abs=1e-9)
        assert script.getBasePositionAndOrientation(ball)[0][0] == 3.0
    assert calls == {"SimulationService/StepSimulation": 50}
    # Answers are small again for a script that no longer looks.
    for _ in range(20):
        script.stepSimulation()
    assert not connected(0).wants_links()


def test_joints_that_are_put_elsewhere_one_by_one_are_one_round_trip(script: ModuleType, calls: Calls) -> None:
    arms = [script.loadURDF(str(SEVEN_ARM), [x, 0, 0], useFixedBase=1) for x in (0, 2)]
    turning = [joint for joint in range(script.getNumJoints(arms[0])) if script.getJointInfo(arms[0], joint)[2] == 0]
    script.stepSimulation()
    calls.clear()
    for arm in arms:
        for index, joint in enumerate(turning):
            script.resetJointState(arm, joint, 0.1 * index, 0.5)
            script.resetJointState(arm, joint, 0.05 * index, 0.25)
    assert calls == {}
    for arm in arms:
        rows = [script.getJointState(arm, joint)[:2] for joint in turning]
        assert rows == [pytest.approx((0.05 * index, 0.25)) for index in range(len(turning))]
    assert calls == {"JointService/ResetJoints": 1, "JointService/GetJointStates": 1}
    # Before the step, and before a robot is removed.
    script.resetJointState(arms[0], turning[0], 0.5)
    script.stepSimulation()
    assert script.getJointState(arms[0], turning[0])[0] == pytest.approx(0.5, abs=0.05)
    script.resetJointState(arms[0], turning[0], 0.1)
    script.removeBody(arms[0])
    script.resetJointState(arms[1], turning[0], 0.3)
    kept = script.saveState()
    script.resetJointState(arms[1], turning[0], 0.9)
    script.restoreState(kept)
    assert script.getJointState(arms[1], turning[0])[0] == pytest.approx(0.3)


def test_forces_go_to_the_daemon_together_and_before_what_comes_next(
    script: ModuleType, calls: Calls, monkeypatch: pytest.MonkeyPatch
) -> None:
    ball = script.createCollisionShape(script.GEOM_SPHERE, radius=0.1)
    balls = [script.createMultiBody(2, ball, -1, [x, 0, 0]) for x in (0, 1, 2)]
    for each in balls:
        script.changeDynamics(each, -1, linearDamping=0, angularDamping=0)
    script.getBasePositionAndOrientation(balls[0])
    script.stepSimulation()
    together: list[int] = []
    wire = connected(0).wire
    call_all = wire.call_all

    def counting(method: Any, requests: Any) -> None:
        together.append(len(requests))
        call_all(method, requests)

    monkeypatch.setattr(wire, "call_all", counting)
    calls.clear()
    for _ in range(10):
        for each in balls:
            script.applyExternalForce(each, -1, [0, 0, 24], [0, 0, 0], script.LINK_FRAME)
            script.applyExternalTorque(each, -1, [0, 0, 1], script.LINK_FRAME)
        script.stepSimulation()
    assert (calls, together) == ({"SimulationService/StepSimulation": 10}, [6] * 10)
    # v = F t / m
    assert [script.getBaseVelocity(each)[0][2] for each in balls] == pytest.approx([0.5] * 3)
    script.applyExternalForce(balls[0], -1, [0, 0, 24], [0, 0, 0], script.LINK_FRAME)
    script.removeBody(balls[1])
    script.stepSimulation()
    script.stepSimulation()
    assert script.getBaseVelocity(balls[0])[0][2] == pytest.approx(0.55)


def test_gravity_that_is_set_at_each_step_is_sent_when_it_changes(script: ModuleType, calls: Calls) -> None:
    script.setGravity(0, 0, -10)
    calls.clear()
    for _ in range(5):
        script.setGravity(0, 0, -10)
        script.stepSimulation()
    assert calls.get("SimulationService/SetPhysics", 0) <= 1
    script.setGravity(0, 0, -3)
    assert script.getPhysicsEngineParameters()["gravityAccelerationZ"] == -3.0


def test_properties_of_links_are_requested_once_a_step(script: ModuleType, calls: Calls) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    calls.clear()
    rows = [script.getDynamicsInfo(arm, link) for link in range(-1, script.getNumJoints(arm))]
    assert calls == {"EntityService/GetLinkProperties": 1} and rows[3][1] == 0.5
    script.changeDynamics(arm, 2, lateralFriction=0.25)
    assert script.getDynamicsInfo(arm, 2)[1] == 0.25


def test_contacts_come_with_the_step_once_they_were_read(script: ModuleType, calls: Calls) -> None:
    script.setGravity(0, 0, -10)
    floor = script.createMultiBody(0, script.createCollisionShape(script.GEOM_PLANE))
    box = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    boxes = [script.createMultiBody(1, box, -1, [x, 0, 0.1]) for x in (0, 1)]
    script.stepSimulation()
    script.getContactPoints()
    calls.clear()
    of_all: Any = ()
    of_one: Any = ()
    for _ in range(20):
        script.stepSimulation()
        of_all = script.getContactPoints()
        of_one = script.getContactPoints(boxes[0], floor)
    assert calls == {"SimulationService/StepSimulation": 20}
    assert {frozenset(row[1:3]) for row in of_all} == {frozenset((floor, each)) for each in boxes}
    assert sum(row[9] for row in of_one) == pytest.approx(10.0, rel=1e-3)
    # A removed robot touches nothing, and unread states are no longer requested.
    script.removeBody(boxes[1])
    assert all(boxes[1] not in row[1:3] for row in script.getContactPoints())
    for _ in range(20):
        script.stepSimulation()
    calls.clear()
    assert sum(row[9] for row in script.getContactPoints()) == pytest.approx(10.0, rel=1e-3)
    assert calls == {"ContactService/GetContacts": 1}


def test_a_position_is_approached_as_pybullet_does(script: ModuleType) -> None:
    """A tenth of the remaining distance in each step, if no limit of the joint slows it."""
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setTimeStep(1e-3)
    left = 0.3
    for _ in range(20):
        script.setJointMotorControl2(arm, 0, script.POSITION_CONTROL, targetPosition=0.3)
        script.stepSimulation()
        left *= 0.9
        assert 0.3 - script.getJointState(arm, 0)[0] == pytest.approx(left, rel=0.02)


def test_a_motor_goes_on_without_another_command(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setGravity(0, 0, -9.81)
    script.setJointMotorControl2(arm, 0, script.VELOCITY_CONTROL, targetVelocity=1.5)
    for _ in range(120):
        script.stepSimulation()
    position, velocity, _, _ = script.getJointState(arm, 0)
    assert velocity == pytest.approx(1.5, rel=0.01)
    assert position == pytest.approx(0.75, rel=0.01)


def test_gains_follow_the_time_step(script: ModuleType) -> None:
    """They are per step: a motor set before setTimeStep keeps its law after it."""
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setJointMotorControl2(arm, 0, script.POSITION_CONTROL, targetPosition=0.3)
    script.stepSimulation()
    script.setTimeStep(1e-3)
    for _ in range(19):
        script.stepSimulation()
    assert 0.3 - script.getJointState(arm, 0)[0] == pytest.approx(0.3 * 0.9**20, rel=0.05)


def test_a_torque_lasts_one_step(script: ModuleType) -> None:
    """One step of torque gives the velocity h torque / inertia, and none after."""
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.changeDynamics(arm, -1, linearDamping=0, angularDamping=0)
    script.setJointMotorControl2(arm, 0, script.VELOCITY_CONTROL, force=0)
    script.setJointMotorControl2(arm, 0, script.TORQUE_CONTROL, force=0.01)
    script.stepSimulation()
    first = script.getJointState(arm, 0)
    # The motor does nothing.
    assert first[1] > 1e-4 and first[3] == 0.0
    script.stepSimulation()
    second = script.getJointState(arm, 0)
    assert second[1] == pytest.approx(first[1], rel=1e-6) and second[3] == 0.0


def test_a_motor_with_a_small_force_brakes_a_torque_like_friction(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setJointMotorControl2(arm, 0, script.VELOCITY_CONTROL, force=0.05)
    for _ in range(10):
        script.setJointMotorControl2(arm, 0, script.TORQUE_CONTROL, force=0.04)
        script.stepSimulation()
    assert script.getJointState(arm, 0)[1] == pytest.approx(0.0, abs=1e-6)
    velocities: list[float] = []
    for _ in range(10):
        script.setJointMotorControl2(arm, 0, script.TORQUE_CONTROL, force=0.06)
        script.stepSimulation()
        velocities.append(script.getJointState(arm, 0)[1])
    # The remaining torque, 0.01 N m, accelerates the arm evenly.
    assert velocities[0] > 0.0
    assert velocities[9] == pytest.approx(10 * velocities[0], rel=0.02)


def test_force_is_the_most_that_a_motor_applies(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    script.setGravity(0, 0, -9.81)
    # The arm's weight needs 0.33 N m.
    script.setJointMotorControl2(arm, 0, script.POSITION_CONTROL, targetPosition=0.0, force=0.1)
    for _ in range(60):
        script.stepSimulation()
    position, _, _, torque = script.getJointState(arm, 0)
    assert abs(position) > 0.1
    assert abs(torque) <= 0.1 + 1e-12


def test_a_joint_is_put_elsewhere_at_once_and_its_motor_goes_on(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    for joint in range(7):
        script.resetJointState(arm, joint, 0.1 * joint, 0.2)
    assert [state[0] for state in script.getJointStates(arm, range(7))] == pytest.approx(
        [0.1 * j for j in range(7)]
    )
    assert script.getJointState(arm, 3)[1] == 0.2
    script.stepSimulation()
    # Motors of new joints hold zero velocity.
    assert script.getJointState(arm, 3)[1] == pytest.approx(0.0, abs=1e-3)


def test_a_kept_state_comes_back_to_the_bit(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    script.setGravity(0, 0, -9.81)
    for joint in range(7):
        script.setJointMotorControl2(arm, joint, script.POSITION_CONTROL, 0.3)
    for _ in range(5):
        script.stepSimulation()
    kept = script.saveState()

    def after_ten() -> Any:
        for _ in range(10):
            script.stepSimulation()
        return script.getJointStates(arm, range(7))

    first = after_ten()
    script.restoreState(kept)
    assert after_ten() == first
    script.removeState(kept)
    with pytest.raises(pybullet.error, match="Couldn't restore state"):
        script.restoreState(kept)


def test_resetting_gives_an_empty_world_without_gravity_and_keeps_the_time_step(script: ModuleType) -> None:
    script.setGravity(0, 0, -9.81)
    script.setTimeStep(1e-3)
    script.loadURDF(str(BENCH_ARM))
    script.addUserDebugParameter("a", 0, 1, 0)
    script.resetSimulation()
    settings = script.getPhysicsEngineParameters()
    assert settings["gravityAccelerationZ"] == 0.0
    assert settings["fixedTimeStep"] == 1e-3
    assert script.getNumBodies() == 0
    assert script.loadURDF(str(BENCH_ARM)) == 0


def test_refusals_are_pybullets_words(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), useFixedBase=1)
    for words, call in (
        ("GetJointInfo failed.", lambda: script.getJointInfo(arm, 99)),
        ("GetJointInfo failed.", lambda: script.getJointInfo(9, 0)),
        ("Joint index out-of-range.", lambda: script.setJointMotorControl2(arm, 99, script.POSITION_CONTROL)),
        ("Illegal control mode.", lambda: script.setJointMotorControl2(arm, 0, 7)),
        ("Joint index out-of-range.", lambda: script.getJointStates(arm, [0, 99])),
        ("Cannot load URDF file.", lambda: script.loadURDF("nowhere.urdf")),
        (
            "number of target positions should match the number of joint indices",
            lambda: script.setJointMotorControlArray(
                arm, [0], script.POSITION_CONTROL, targetPositions=[1, 2]
            ),
        ),
        ("Failed to read parameter.", lambda: script.readUserDebugParameter(5)),
    ):
        with pytest.raises(pybullet.error) as refused:
            call()
        assert str(refused.value).startswith(words)


ARM_WITHIN = """<robot name='a'><link name='post'/><link name='arm'><inertial><origin xyz='0 0 -0.5'/><mass value='1'/>
<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='revolute'><parent link='post'/>
<child link='arm'/><axis xyz='0 1 0'/><limit lower='0.5' upper='1' effort='0' velocity='0'/></joint></robot>"""


def test_a_joint_that_is_put_beyond_its_limit_stays_there_until_it_comes_back(
    bullet: Any, script: ModuleType, tmp_path: Path
) -> None:
    (tmp_path / "arm.urdf").write_text(ARM_WITHIN)
    paths: list[list[float]] = []
    for p in (bullet, script):
        arm = p.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=1, flags=p.URDF_USE_INERTIA_FROM_FILE)
        p.setJointMotorControl2(arm, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(arm, 0, 0)
        paths.append([])
        # Outwards, then nothing, then back, and outwards again.
        for torque in (-5, 0, 8, -8):
            for _ in range(60 if torque <= 0 else 120):
                p.setJointMotorControl2(arm, 0, p.TORQUE_CONTROL, force=torque)
                p.stepSimulation()
            paths[-1].append(p.getJointState(arm, 0)[0])
        assert p.getJointInfo(arm, 0)[8:10] == (0.5, 1.0)
        for _ in range(240):
            p.setJointMotorControl2(arm, 0, p.TORQUE_CONTROL, force=-8)
            p.stepSimulation()
        paths[-1].append(p.getJointState(arm, 0)[0])
    theirs, ours = paths
    assert theirs[:2] == pytest.approx([0.0, 0.0], abs=1e-3) and theirs[2] > 0.7
    assert ours[:2] == pytest.approx([0.0, 0.0], abs=1e-3) and ours[2] == pytest.approx(theirs[2], abs=0.02)
    # It has returned, so it may not move beyond again.
    assert (theirs[4], ours[4]) == (pytest.approx(0.5, abs=0.01), pytest.approx(0.5, abs=0.01))
