"""getNumJoints and getJointInfo against PyBullet's own, field by field, on the robots that come with
PyBullet."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

real: Any = pytest.importorskip("pybullet", exc_type=ImportError)
pybullet_data: Any = pytest.importorskip("pybullet_data")

from .conftest import BENCH_ARM, SEVEN_ARM

DATA = Path(pybullet_data.getDataPath())
ROBOTS = [
    *(
        DATA / name
        for name in (
            "kuka_iiwa/model.urdf",
            "r2d2.urdf",
            "a1/a1.urdf",
            "laikago/laikago_toes.urdf",
            "franka_panda/panda.urdf",
            "cartpole.urdf",
            "racecar/racecar.urdf",
            "mini_cheetah/mini_cheetah.urdf",
            "aliengo/aliengo.urdf",
            "pr2_gripper.urdf",
            "quadruped/minitaur.urdf",
            "TwoJointRobot_w_fixedJoints.urdf",
            "TwoJointRobot_wo_fixedJoints.urdf",
        )
    ),
    BENCH_ARM,
    SEVEN_ARM,
]
FIELDS = (
    *("index", "name", "type", "qIndex", "uIndex", "flags", "damping", "friction", "lower", "upper"),
    *("maxForce", "maxVelocity", "linkName", "axis", "parentFramePos", "parentFrameOrn", "parentIndex"),
)


@pytest.fixture(scope="module")
def theirs() -> Iterator[Any]:
    real.connect(real.DIRECT)
    yield real
    real.disconnect()


def same(field: str, ours: Any, wanted: Any) -> bool:
    if field == "axis":
        # A deliberate difference: simd's axes have unit length, PyBullet's have the file's.
        length = math.sqrt(sum(x * x for x in wanted))
        wanted = tuple(x / length for x in wanted) if length > 0.0 else wanted
    if isinstance(wanted, tuple):
        signs = (1.0, -1.0) if field == "parentFrameOrn" else (1.0,)
        return any(all(abs(s * a - b) < 1e-9 for a, b in zip(ours, wanted, strict=True)) for s in signs)  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
    return ours == wanted


def without_impossible_limits(joint: tuple[Any, ...], continuous: set[str]) -> tuple[Any, ...]:
    """A deliberate difference: PyBullet reports the limits that a file gives a continuous or a fixed joint, and
    bounds the continuous one by them. URDF has none for either, nor has simd."""
    fields = list(joint)
    if joint[1].decode() in continuous:
        fields[8:10] = [0.0, -1.0]
    if joint[2] == real.JOINT_FIXED:
        fields[8:12] = [0.0, -1.0, 0.0, 0.0]
    return tuple(fields)


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_joints_are_reported_as_pybullet_does(path: Path, theirs: Any, script: ModuleType) -> None:
    wanted = theirs.loadURDF(str(path), useFixedBase=1)
    ours = script.loadURDF(str(path), useFixedBase=1)
    assert script.getNumJoints(ours) == theirs.getNumJoints(wanted)
    continuous = set(re.findall(r'<joint\s+name="([^"]*)"\s+type="continuous"', path.read_text()))
    for joint in range(theirs.getNumJoints(wanted)):
        found, right = script.getJointInfo(ours, joint), theirs.getJointInfo(wanted, joint)
        right = without_impossible_limits(right, continuous)
        wrong = {f: (a, b) for f, a, b in zip(FIELDS, found, right, strict=True) if not same(f, a, b)}
        assert wrong == {}, (path.name, right[1])
        assert [type(a) for a in found] == [type(b) for b in right]
    assert script.getBodyInfo(ours) == theirs.getBodyInfo(wanted)


def test_places_of_a_base_and_its_links_are_pybullets(theirs: Any, script: ModuleType) -> None:
    """A free robot with joints away from zero; PyBullet keeps link frames in single precision."""
    path = str(DATA / "a1/a1.urdf")
    place, turn = [0.3, 0.1, 1.0], theirs.getQuaternionFromEuler([0.2, 0.3, 0.5])
    right = theirs.loadURDF(path, place, turn)
    ours = script.loadURDF(path, place, turn)
    moving = [
        joint for joint in range(theirs.getNumJoints(right)) if theirs.getJointInfo(right, joint)[2] != 4
    ]
    for number, joint in enumerate(moving):
        low, high = theirs.getJointInfo(right, joint)[8:10]
        q = min(max(0.1 * (number % 3 + 1), low), high)
        theirs.resetJointState(right, joint, q, 0.5)
        script.resetJointState(ours, joint, q, 0.5)
    for module, body in ((theirs, right), (script, ours)):
        module.resetBaseVelocity(body, [1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    close(script.getBasePositionAndOrientation(ours), theirs.getBasePositionAndOrientation(right), 1e-9)
    close(script.getBaseVelocity(ours), theirs.getBaseVelocity(right), 1e-9)
    for link in range(theirs.getNumJoints(right)):
        close(script.getLinkState(ours, link, 1, 1), theirs.getLinkState(right, link, 1, 1), 1e-6)


def test_jacobians_and_inertia_are_pybullets(theirs: Any, script: ModuleType) -> None:
    """A fixed and a free robot, with the inertias of the file and of the shapes."""
    from_file = theirs.URDF_USE_INERTIA_FROM_FILE
    for name, link, flags in (
        ("kuka_iiwa/model.urdf", 6, from_file),
        ("quadruped/minitaur.urdf", 6, from_file),
        ("kuka_iiwa/model.urdf", 6, 0),
    ):
        path = str(DATA / name)
        right = theirs.loadURDF(path, flags=flags)
        ours = script.loadURDF(path, flags=flags)
        moving = [
            joint for joint in range(theirs.getNumJoints(right)) if theirs.getJointInfo(right, joint)[2] != 4
        ]
        limits = [theirs.getJointInfo(right, joint)[8:10] for joint in moving]
        q = [min(max(0.1 * (n % 5 + 1), low), high) for n, (low, high) in enumerate(limits)]
        still = [0.0] * len(q)
        point = [0.01, 0.02, 0.03]
        close(
            script.calculateJacobian(ours, link, point, q, still, still),
            theirs.calculateJacobian(right, link, point, q, still, still),
            1e-6,
        )
        close(script.calculateMassMatrix(ours, q), theirs.calculateMassMatrix(right, q), 1e-5)
        # Numbers beyond the joints are ignored.
        longer = [*q, 0.7, 0.8]
        close(script.calculateMassMatrix(ours, longer), theirs.calculateMassMatrix(right, longer), 1e-5)


def test_inverse_dynamics_are_pybullets(theirs: Any, script: ModuleType) -> None:
    path = str(DATA / "kuka_iiwa/model.urdf")
    right = theirs.loadURDF(path, useFixedBase=1, flags=theirs.URDF_USE_INERTIA_FROM_FILE)
    ours = script.loadURDF(path, useFixedBase=1, flags=script.URDF_USE_INERTIA_FROM_FILE)
    q, qd, qdd = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], [0.1] * 7, [0.2] * 7
    for module in (theirs, script):
        module.setGravity(0, 0, -9.81)
    expected = theirs.calculateInverseDynamics(right, q, qd, qdd)
    # simd includes the joints' own damping, 0.5 N m s/rad; PyBullet leaves it out.
    damped = [effort + 0.5 * velocity for effort, velocity in zip(expected, qd, strict=True)]
    assert script.calculateInverseDynamics(ours, q, qd, qdd) == pytest.approx(damped, abs=1e-6)


def test_inverse_kinematics_reach_the_target(script: ModuleType) -> None:
    ours = script.loadURDF(str(DATA / "kuka_iiwa/model.urdf"), useFixedBase=1)
    target = [0.3, 0.2, 0.6]
    for joint in range(7):
        script.resetJointState(ours, joint, 0.3)
    solved = script.calculateInverseKinematics(ours, 6, target, maxNumIterations=500)
    assert len(solved) == 7
    for joint, q in enumerate(solved):
        script.resetJointState(ours, joint, q)
    assert script.getLinkState(ours, 6)[4] == pytest.approx(target, abs=1e-3)


def close(ours: Any, theirs: Any, tolerance: float) -> None:
    a, b = list(flat(ours)), list(flat(theirs))
    assert len(a) == len(b)
    worst = max(abs(x - y) for x, y in zip(a, b, strict=True))
    assert worst < tolerance, worst


def flat(value: Any) -> Iterator[float]:
    if isinstance(value, tuple):
        for item in value:  # pyright: ignore[reportUnknownVariableType]
            yield from flat(item)
    else:
        yield float(value)


@pytest.mark.parametrize("order", [0, real.URDF_MAINTAIN_LINK_ORDER], ids=["by joints", "by links"])
def test_joints_are_numbered_as_pybullet_numbers_them(order: int, theirs: Any, script: ModuleType) -> None:
    """In the file the links of a humanoid come in another order than a walk along its joints. It ends with a zero byte."""
    path = str(DATA / "humanoid/humanoid.urdf")
    right = theirs.loadURDF(path, globalScaling=0.25, flags=order)
    ours = script.loadURDF(path, globalScaling=0.25, flags=order)
    assert script.getNumJoints(ours) == theirs.getNumJoints(right)
    for joint in range(theirs.getNumJoints(right)):
        got, wanted = script.getJointInfo(ours, joint), theirs.getJointInfo(right, joint)
        assert [got[index] for index in (0, 1, 2, 3, 4, 12, 16)] == [wanted[index] for index in (0, 1, 2, 3, 4, 12, 16)]
