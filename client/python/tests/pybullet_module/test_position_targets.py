"""Position targets move joints like PyBullet's: the same trajectory as the real one's, within the script's
force."""

from __future__ import annotations

import random
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import simd_client.pybullet as pybullet
from simd_client import embedded_link
from simd_client.pybullet.connections import connected

AT = (1, 5, 10, 20, 100)
ROD = """<robot name="r"><link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
</inertial></link><link name="l"><inertial><origin xyz="0 0 0.3"/><mass value="{mass}"/>
<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>
<joint name="j" type="{type}"><parent link="b"/><child link="l"/><axis xyz="0 1 0"/>
<limit lower="-1000" upper="1000" effort="5" velocity="0.5"/></joint></robot>"""
TWO = """<robot name="two"><link name="b"/><link name="l"/><link name="m"/>
<joint name="left" type="prismatic"><parent link="b"/><child link="l"/><axis xyz="1 0 0"/><limit lower="0" upper="1" effort="20" velocity="1"/></joint>
<joint name="right" type="prismatic"><parent link="b"/><child link="m"/><axis xyz="-1 0 0"/><limit lower="0" upper="1" effort="20" velocity="1"/>
<mimic joint="left"/></joint></robot>"""


def rod(folder: Path, mass: float = 3.0, inertia: float = 0.3, type: str = "revolute") -> str:
    """A file with one joint. PyBullet ignores its limits of effort and velocity."""
    # PyBullet caches files by their names.
    file = folder / f"rod{len(list(folder.iterdir()))}.urdf"
    file.write_text(ROD.format(mass=mass, inertia=inertia, type=type))
    return str(file)


def another(option: str) -> int:
    """Another connection, with an option."""
    where = "--embedded" if embedded_link.is_installed() else "--new"
    return pybullet.connect(pybullet.DIRECT, options=f"{where} {option}")


def moved(p: Any, file: str, time_step: float, gravity: float, motor: dict[str, Any]) -> list[float]:
    """Returns the joint's position after 1, 5, 10, 20 and 100 steps."""
    p.resetSimulation()
    p.setTimeStep(time_step)
    p.setGravity(0, 0, gravity)
    body = p.loadURDF(file, useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    for link in (-1, 0):
        p.changeDynamics(body, link, linearDamping=0, angularDamping=0)
    p.setJointMotorControl2(body, 0, **motor)
    found: list[float] = []
    for _ in range(max(AT)):
        p.stepSimulation()
        found.append(p.getJointState(body, 0)[0])
    return [found[at - 1] for at in AT]


def drawn(rng: random.Random, inertia: float) -> dict[str, Any]:
    """The arguments of a motor."""
    motor: dict[str, Any] = {"controlMode": pybullet.POSITION_CONTROL, "targetPosition": rng.uniform(-1, 1)}
    if rng.random() < 0.25:
        return {"controlMode": pybullet.VELOCITY_CONTROL, "targetVelocity": rng.uniform(-3, 3), "force": inertia * 10 ** rng.uniform(1, 4)}
    if rng.random() < 0.8:
        motor["force"] = inertia * 10 ** rng.uniform(1, 4)
    if rng.random() < 0.5:
        motor["positionGain"] = 10 ** rng.uniform(-2, 0)
    if rng.random() < 0.5:
        motor["velocityGain"] = rng.choice([0.1, 0.5, 0.8, rng.random()])
    if rng.random() < 0.3:
        motor["maxVelocity"] = rng.uniform(0.1, 3)
    if rng.random() < 0.2:
        motor["targetVelocity"] = rng.uniform(-1, 1)
    return motor


CHAIN = """<robot name="chain"><link name="b"/>
<link name="l1"><inertial><origin xyz="0.1 0 0.2"/><mass value="2"/>
<inertia ixx="0.03" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.02"/></inertial></link>
<link name="l2"><inertial><origin xyz="0 0.05 0.15"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
<link name="l3"><inertial><origin xyz="0.02 0 0.1"/><mass value="0.5"/>
<inertia ixx="0.002" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.001"/></inertial></link>
<joint name="j1" type="continuous"><parent link="b"/><child link="l1"/><axis xyz="0 1 0"/></joint>
<joint name="j2" type="continuous"><parent link="l1"/><child link="l2"/><origin xyz="0 0 0.4" rpy="0.3 0 0"/><axis xyz="1 0 0"/></joint>
<joint name="j3" type="prismatic"><parent link="l2"/><child link="l3"/><origin xyz="0.1 0 0.3"/><axis xyz="0 0.6 0.8"/>
<limit lower="-10" upper="10" effort="1" velocity="1"/></joint></robot>"""
GO, TURN = pybullet.POSITION_CONTROL, pybullet.VELOCITY_CONTROL
# Time step, substeps, the motors of three joints, and PyBullet 3.2.7's positions after 1, 5, 10, 20 and 100
# steps.
KNOWN: list[tuple[float, int, list[dict[str, Any]], list[list[float]]]] = [
    (
        0.002,
        0,
        [
            {"controlMode": GO, "targetPosition": 0.3, "force": 20},
            {"controlMode": GO, "targetPosition": -0.2, "force": 5},
            {"controlMode": GO, "targetPosition": 0.1, "force": 30},
        ],
        [
            [0.00013, 8e-05, 0.00024],
            [0.00196, 0.00125, 0.00357],
            [0.00718, 0.00452, 0.01308],
            [0.02702, 0.0163, 0.0498],
            [0.44263, -0.32746, 0.09999],
        ],
    ),
    (
        1 / 240,
        0,
        [{"controlMode": GO, "targetPosition": target, "velocityGain": 0.5} for target in (0.3, -0.2, 0.1)],
        [
            [0.03002, -0.02005, 0.00991],
            [0.18958, -0.12118, 0.06796],
            [0.27929, -0.18082, 0.09762],
            [0.30064, -0.20057, 0.09948],
            [0.3006, -0.20087, 0.09916],
        ],
    ),
    (
        1 / 240,
        0,
        [
            {"controlMode": GO, "targetPosition": 0.5, "positionGain": 0.3, "velocityGain": 0.1, "force": 60},
            {"controlMode": GO, "targetPosition": 0.4, "positionGain": 0.3, "velocityGain": 0.9, "force": 8},
            {"controlMode": TURN, "targetVelocity": -0.2, "velocityGain": 0.3},
        ],
        [
            [0.00135, 0.0008, -0.00038],
            [0.02037, 0.01395, -0.00377],
            [0.07553, 0.05628, -0.00883],
            [0.29722, 0.22749, -0.01272],
            [0.29982, 0.39364, -0.01535],
        ],
    ),
    (
        0.01,
        4,
        [
            {"controlMode": GO, "targetPosition": 0.3, "force": 10},
            {"controlMode": GO, "targetPosition": -0.2, "force": 5},
            {"controlMode": TURN, "targetVelocity": 0.1, "force": 20},
        ],
        [
            [0.00354, -0.00957, 0.001],
            [0.07191, -0.14836, 0.005],
            [0.26144, -0.19373, 0.01],
            [0.42236, -0.19991, 0.02],
            [0.3, -0.20001, 0.1],
        ],
    ),
    (
        0.002,
        2,
        [
            {"controlMode": GO, "targetPosition": -0.4, "velocityGain": 0.7, "maxVelocity": 1.5},
            {"controlMode": TURN, "targetVelocity": 1.0, "force": 3},
            {"controlMode": GO, "targetPosition": 0.2, "targetVelocity": 0.3},
        ],
        [
            [-0.003, 0.03855, 0.03857],
            [-0.015, 0.11414, 0.13222],
            [-0.03, 0.1405, 0.17832],
            [-0.06, 0.14943, 0.2],
            [-0.3, 0.29937, 0.203],
        ],
    ),
]


def moved_together(p: Any, file: str, time_step: float, parts: int, motors: list[dict[str, Any]], gravity: float) -> list[list[float]]:
    """Returns positions of all joints of a robot after 1, 5, 10, 20 and 100 steps."""
    p.resetSimulation()
    # simd's motors are solved exactly, and PyBullet's by iteration.
    p.setPhysicsEngineParameter(numSubSteps=parts, numSolverIterations=1000)
    p.setTimeStep(time_step)
    p.setGravity(0, 0, gravity)
    body = p.loadURDF(file, useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    for link in range(-1, len(motors)):
        p.changeDynamics(body, link, linearDamping=0, angularDamping=0)
    for joint, motor in enumerate(motors):
        p.setJointMotorControl2(body, joint, **motor)
    found: list[list[float]] = []
    for step in range(1, max(AT) + 1):
        p.stepSimulation()
        if step in AT:
            found.append([state[0] for state in p.getJointStates(body, range(len(motors)))])
    return found


def farthest(ways: list[list[float]]) -> float:
    """The largest of all positions."""
    return max(max(map(abs, way)) for way in ways)


@pytest.mark.parametrize("case", range(len(KNOWN)))
def test_three_joints_move_as_pybullets_committed_values(script: ModuleType, tmp_path: Path, case: int) -> None:
    """Gains below one, substeps, weak forces and velocities, under gravity: within 2 % of the farthest way."""
    file = tmp_path / "chain.urdf"
    file.write_text(CHAIN)
    time_step, parts, motors, wanted = KNOWN[case]
    got = moved_together(script, str(file), time_step, parts, motors, -9.81)
    for row, known in zip(got, wanted, strict=True):
        assert row == pytest.approx(known, abs=0.02 * farthest(wanted))


@pytest.mark.parametrize("seed", range(3))
def test_random_motors_of_three_joints_move_as_in_pybullet(script: ModuleType, bullet: Any, tmp_path: Path, seed: int) -> None:
    rng = random.Random(100 + seed)
    file = tmp_path / "chain.urdf"
    file.write_text(CHAIN)
    for _ in range(8):
        motors = [drawn(rng, inertia) for inertia in (0.4, 0.05, 0.5)]
        time_step, parts, gravity = rng.choice([0.001, 1 / 240, 0.01]), rng.choice([0, 2, 4]), rng.choice([0.0, -9.81])
        substep = time_step / max(parts, 1)
        if any(motor.get("positionGain", 0.1) * abs(motor.get("targetPosition", 0.0)) > 90.0 * substep for motor in motors):
            # PyBullet clamps velocities to 100 rad/s, after the whole motion.
            continue
        wanted = moved_together(bullet, str(file), time_step, parts, motors, gravity)
        if farthest(wanted) > 1.5:
            # A motor that is too weak lets the arm fall, which differs between any two solvers.
            continue
        got = moved_together(script, str(file), time_step, parts, motors, gravity)
        for row, known in zip(got, wanted, strict=True):
            assert row == pytest.approx(known, abs=0.02 * farthest(wanted) + 1e-5), (motors, time_step, parts, gravity)


@pytest.mark.parametrize("seed", range(4))
def test_random_joints_move_as_in_pybullet(script: ModuleType, bullet: Any, tmp_path: Path, seed: int) -> None:
    """Within 2 % of the way, for joints of one axis that rotate and slide."""
    rng = random.Random(seed)
    for _ in range(10):
        mass, inertia, type = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-3, 0), rng.choice(["revolute", "prismatic"])
        file = rod(tmp_path, mass, inertia, type)
        time_step, gravity = rng.choice([0.001, 0.002, 1 / 240, 0.01]), rng.choice([0.0, -9.81])
        motor = drawn(rng, mass * 0.09 + inertia if type == "revolute" else mass)
        wanted = moved(bullet, file, time_step, gravity, motor)
        got = moved(script, file, time_step, gravity, motor)
        assert got == pytest.approx(wanted, abs=0.02 * max(map(abs, wanted)) + 1e-6), (motor, time_step, gravity, mass, inertia, type)


def test_a_small_step_with_a_force_needs_no_profile(script: ModuleType, tmp_path: Path) -> None:
    """PyBullet's own values, with 2 ms and 87 N m."""
    motor = {"controlMode": pybullet.POSITION_CONTROL, "targetPosition": 0.05, "force": 87}
    assert moved(script, rod(tmp_path), 0.002, 0.0, motor) == pytest.approx([0.0006, 0.0092, 0.0256, 0.0415, 0.05], abs=6e-5)


def test_an_arm_goes_on_its_way_as_in_pybullet(script: ModuleType, bullet: Any) -> None:
    """All joints at once, also with a velocityGain below one: within 2 % of the farthest way."""
    file = str(Path(__file__).resolve().parents[4] / "tests/assets/seven_arm/urdf/seven_arm.urdf")
    for gain in (1.0, 0.5):
        ways: list[list[float]] = []
        for p in (bullet, script):
            p.resetSimulation()
            p.setGravity(0, 0, -9.81)
            arm = p.loadURDF(file, useFixedBase=True)
            joints = [each for each in range(p.getNumJoints(arm)) if p.getJointInfo(arm, each)[2] == p.JOINT_REVOLUTE]
            for each in range(-1, p.getNumJoints(arm)):
                p.changeDynamics(arm, each, linearDamping=0, angularDamping=0, jointDamping=0)
            goals = [0.1 * (-1) ** each for each in range(len(joints))]
            p.setJointMotorControlArray(
                arm, joints, p.POSITION_CONTROL, targetPositions=goals, forces=[300.0] * len(joints), velocityGains=[gain] * len(joints)
            )
            way: list[float] = []
            for step in range(1, 101):
                p.stepSimulation()
                if step in AT:
                    way += [state[0] for state in p.getJointStates(arm, joints)]
            ways.append(way)
        assert ways[1] == pytest.approx(ways[0], abs=0.02 * 0.1)


def test_a_motor_that_has_arrived_is_not_sent_again(script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body = script.loadURDF(rod(tmp_path), useFixedBase=True)
    script.setJointMotorControl2(body, 0, script.POSITION_CONTROL, targetPosition=0.05, force=87)
    for _ in range(400):
        script.stepSimulation()
    sent: list[int] = []
    wire = connected(0).wire
    call, run_step = wire.call, wire.run_step

    def counted(method: Any, request: Any, wait: float = 0.0) -> Any:
        sent.append(len(request.robots))
        return call(method, request, wait)

    def kept(step: Any, numbers: list[float]) -> Any:
        sent.append(len(numbers))
        return run_step(step, numbers)

    monkeypatch.setattr(wire, "call", counted)
    monkeypatch.setattr(wire, "run_step", kept)
    for _ in range(10):
        script.stepSimulation()
    assert sent == [0] * 10


def test_limits_of_a_file_are_an_option_and_say_what_they_change(
    script: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    limited = another("--limits")
    speeds: list[float] = []
    for number in (0, limited):
        body = pybullet.loadURDF(rod(tmp_path), useFixedBase=True, physicsClientId=number)
        assert pybullet.getJointInfo(body, 0, physicsClientId=number)[10:12] == (5.0, 0.5)
        for _ in range(20):
            pybullet.setJointMotorControl2(
                body, 0, pybullet.POSITION_CONTROL, targetPosition=2.0, force=87, physicsClientId=number
            )
            pybullet.stepSimulation(physicsClientId=number)
        speeds.append(pybullet.getJointState(body, 0, physicsClientId=number)[1])
    assert speeds[0] > 2.0 and 0.0 < speeds[1] <= 0.5
    said = [line for line in capfd.readouterr().err.splitlines() if "limits of effort" in line]
    assert len(said) == 1 and "as 87 of j to 5 (--limits)" in said[0]
    pybullet.disconnect(limited)


def test_mimic_is_an_option_and_says_what_it_changes(
    script: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "two.urdf"
    file.write_text(TWO)
    follows = another("--mimic")
    places: list[float] = []
    for number in (0, follows):
        body = pybullet.loadURDF(str(file), useFixedBase=True, physicsClientId=number)
        for joint, target in ((0, 0.4), (1, 0.1)):
            pybullet.setJointMotorControl2(
                body, joint, pybullet.POSITION_CONTROL, targetPosition=target, force=170, physicsClientId=number
            )
        for _ in range(240):
            pybullet.stepSimulation(physicsClientId=number)
        places.append(pybullet.getJointState(body, 1, physicsClientId=number)[0])
    assert places == pytest.approx([0.1, 0.4], abs=1e-3)
    said = [line for line in capfd.readouterr().err.splitlines() if "--mimic" in line]
    assert len(said) == 1 and "joints that follow others, as right, have no motors" in said[0]
    pybullet.disconnect(follows)


LIMITS = [(-0.5, 0.5, 1.0), (-0.5, 0.5, -3.0), (0.2, 0.8, 0.0), (-0.5, 0.5, 0.3), (0.5, -0.5, 1.0)]


@pytest.mark.parametrize("way", ["one", "several", "one in a loop", "several in a loop"])
@pytest.mark.parametrize(("lower", "upper", "target"), LIMITS)
def test_a_target_beyond_the_limits_of_the_joint_is_moved_to_them(
    bullet: Any, script: ModuleType, tmp_path: Path, way: str, lower: float, upper: float, target: float
) -> None:
    """So the motor slows down before the limit, and does not press. A lower limit above the upper one is none."""
    file = tmp_path / f"limited {lower} {upper} {target} {way}.urdf"
    limits = f'lower="{lower}" upper="{upper}"'
    file.write_text(ROD.format(mass=3, inertia=0.3, type="revolute").replace('lower="-1000" upper="1000"', limits))
    found: list[list[float]] = []
    for p in (bullet, script):
        body = p.loadURDF(str(file), useFixedBase=True)
        p.resetJointState(body, 0, 0.3)
        found.append([])
        for step in range(100):
            if step == 0 or "loop" in way:
                if "several" in way:
                    p.setJointMotorControlArray(body, [0], p.POSITION_CONTROL, targetPositions=[target], forces=[500])
                else:
                    p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=target, force=500)
            p.stepSimulation()
            found[-1].append(p.getJointState(body, 0)[0])
        # It does not press against the limit.
        assert abs(p.getJointState(body, 0)[3]) < 1e-2
    assert found[1] == pytest.approx(found[0], abs=2e-4)


def test_a_target_follows_limits_that_the_script_changes(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "changed limits.urdf"
    file.write_text(ROD.format(mass=3, inertia=0.3, type="revolute").replace("1000", "0.5"))
    for p in (bullet, script):
        body = p.loadURDF(str(file), useFixedBase=True)
        for upper in (0.5, 0.7, 0.4):
            p.changeDynamics(body, 0, jointLowerLimit=-0.5, jointUpperLimit=upper)
            p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=2.0, force=500)
            for _ in range(200):
                p.stepSimulation()
            assert p.getJointState(body, 0)[0] == pytest.approx(upper, abs=1e-4)


@pytest.mark.parametrize("target", [None, 0.5, 2.0])
def test_joints_begin_at_zero_outside_of_their_limits_too(bullet: Any, script: ModuleType, tmp_path: Path, target: float | None) -> None:
    """As the knees of quadrupeds do. They stay there until a motor brings them back."""
    file = tmp_path / f"away {target}.urdf"
    file.write_text(ROD.format(mass=3, inertia=0.3, type="revolute").replace('lower="-1000" upper="1000"', 'lower="0.2" upper="0.8"'))
    found: list[list[float]] = []
    for p in (bullet, script):
        body = p.loadURDF(str(file), useFixedBase=True)
        found.append([p.getJointState(body, 0)[0]])
        if target is not None:
            p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=target, force=500)
        for _ in range(60):
            p.stepSimulation()
            found[-1].append(p.getJointState(body, 0)[0])
    assert found[0][0] == found[1][0] == 0.0
    assert found[1] == pytest.approx(found[0], abs=2e-4)
