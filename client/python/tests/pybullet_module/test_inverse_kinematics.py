"""Several links brought to positions at once, compared with PyBullet."""

from __future__ import annotations

import math
import random
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from simd_client import embedded_link
from simd_client.pybullet.connections import connected

from .conftest import SEVEN_ARM

START = [0.3, 0.5, 0.2, -0.8, 0.1, 0.6, 0.2]


def bent(p: Any, arm: int, by: float) -> list[float]:
    """Puts the rotating joints near the start. Returns their positions."""
    turning = [joint for joint in range(p.getNumJoints(arm)) if p.getJointInfo(arm, joint)[2] == p.JOINT_REVOLUTE]
    values = [value + by for value in START[: len(turning)]]
    for joint, value in zip(turning, values, strict=True):
        p.resetJointState(arm, joint, value)
    return values


def reached(p: Any, arm: int, links: list[int], goals: list[Any]) -> float:
    places = [p.getLinkState(arm, link, computeForwardKinematics=1)[4] for link in links]
    return max(math.dist(place, goal) for place, goal in zip(places, goals, strict=True))


def test_links_come_to_their_places_as_in_pybullet(bullet: Any, script: ModuleType) -> None:
    """The origin of a link's frame reaches the target, and the base is rotated and moved."""
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), [0.3, -0.2, 0.5], p.getQuaternionFromEuler([0.1, 0.2, 0.7]), useFixedBase=1)
        turning = [joint for joint in range(p.getNumJoints(arm)) if p.getJointInfo(arm, joint)[2] == p.JOINT_REVOLUTE]
        for links in ([turning[-1]], [turning[3]], [turning[3], turning[-1]]):
            bent(p, arm, 0.2)
            goals = [p.getLinkState(arm, link, computeForwardKinematics=1)[4] for link in links]
            bent(p, arm, 0.0)
            answer = p.calculateInverseKinematics2(arm, links, goals, maxNumIterations=1000, residualThreshold=1e-6)
            assert len(answer) == len(turning)
            assert [p.getJointState(arm, joint)[0] for joint in turning] == pytest.approx(START)
            for joint, value in zip(turning, answer, strict=True):
                p.resetJointState(arm, joint, value)
            # PyBullet's own search ends some millimetres away if two links have targets.
            assert reached(p, arm, links, goals) < (2e-6 if p is script else 5e-3)


def test_the_search_ends_at_the_limits_and_as_near_as_can_be(script: ModuleType, tmp_path: Path) -> None:
    """A pillar of 1 m with a slide on it, up to 0.2 m: 2 m above the ground the nearest is 1.2 m."""
    inertial = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
    (tmp_path / "pillar.urdf").write_text(
        f"<robot name='pillar'><link name='base'>{inertial}</link><link name='top'>{inertial}</link>"
        "<joint name='slide' type='prismatic'><parent link='base'/><child link='top'/><origin xyz='0 0 1'/>"
        "<axis xyz='0 0 1'/><limit lower='-0.1' upper='0.2' effort='1' velocity='1'/></joint></robot>"
    )
    pillar = script.loadURDF(str(tmp_path / "pillar.urdf"), useFixedBase=1)
    for height, expected in ((2.0, 0.2), (1.05, 0.05), (0.0, -0.1)):
        answer = script.calculateInverseKinematics2(pillar, [0], [[0, 0, height]], residualThreshold=1e-9)
        assert answer == pytest.approx((expected,), abs=1e-6)
    assert script.calculateInverseKinematics2(pillar, [0], [[0, 0, 1.1]], currentPositions=[0.1]) == (0.1,)


def test_steps_towards_a_pose_are_pybullets(bullet: Any, script: ModuleType) -> None:
    """From the current positions, even if the steps end before the pose; a tree with a base that is rotated
    and moved."""
    seed = random.randrange(1 << 32)
    print(f"seed {seed}")
    for p in (bullet, script):
        p.loadURDF(str(SEVEN_ARM), [0.3, -0.2, 0.5], p.getQuaternionFromEuler([0.1, 0.2, 0.7]), useFixedBase=1)
    draw = random.Random(seed)
    for case in range(40):
        start = [draw.uniform(-1.0, 1.0) if case % 4 else 0.0 for _ in range(7)]
        goal = [draw.uniform(-0.5, 0.8), draw.uniform(-0.6, 0.5), draw.uniform(0.4, 1.3)]
        link, more = draw.randrange(3, 7), dict[str, Any]()
        if case % 3:
            # Grippers that point down need half a turn.
            angles = (0.0, math.pi, -math.pi, draw.uniform(-3.0, 3.0))
            more["targetOrientation"] = bullet.getQuaternionFromEuler([draw.choice(angles) for _ in range(3)])
        if case % 5 == 1:
            more["jointDamping"] = [draw.uniform(0.01, 1.0) for _ in range(7)]
        if case % 5 in (2, 3):
            more["restPoses"] = [draw.uniform(-0.5, 0.5) for _ in range(7)]
            more |= {"lowerLimits": [-9.0] * 7, "upperLimits": [9.0] * 7, "jointRanges": [4.0] * 7}
        if case % 5 == 4:
            more["currentPositions"] = [draw.uniform(-0.5, 0.5) for _ in range(7)]
        if case % 7 == 0:
            more |= {"maxNumIterations": draw.randrange(1, 60), "residualThreshold": draw.uniform(1e-5, 1e-2)}
        found: list[Any] = []
        for p in (bullet, script):
            for joint, value in enumerate(start):
                p.resetJointState(0, joint, value)
            found.append(p.calculateInverseKinematics(0, link, goal, **more))
        assert found[1] == pytest.approx(found[0], abs=1e-5), (case, more)


def no_chain(steps: object, end: object) -> None:
    """Stands for an interpreter without the extension module."""


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_the_search_of_the_extension_module_is_the_clients(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, scale: float
) -> None:
    """Also for a large arm, whose null space needs a pseudoinverse, which only the client has."""
    seed = random.randrange(1 << 32)
    print(f"seed {seed}")
    draw = random.Random(seed)
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1, globalScaling=scale)
    chains = connected(0).bodies[arm].chains
    for case in range(40):
        more: dict[str, Any] = {"maxNumIterations": draw.choice((1, 5, 20))}
        for joint in range(7):
            script.resetJointState(arm, joint, draw.uniform(-1.0, 1.0))
        goal = [scale * draw.uniform(low, high) for low, high in ((-0.5, 0.8), (-0.6, 0.5), (0.4, 1.3))]
        if case % 2:
            more["targetOrientation"] = script.getQuaternionFromEuler([draw.uniform(-3.0, 3.0) for _ in range(3)])
        if case % 3 == 1:
            more |= {"lowerLimits": [-0.5] * 7, "upperLimits": [0.5] * 7}
        if case % 3 == 2:
            rest = [draw.uniform(-0.5, 0.5) for _ in range(7)]
            more |= {"lowerLimits": [-9.0] * 7, "upperLimits": [0.9] * 7, "jointRanges": [4.0] * 7, "restPoses": rest}
        compiled = script.calculateInverseKinematics(arm, 6, goal, **more)
        assert chains[6].compiled is not None
        chains.clear()
        with monkeypatch.context() as without:
            without.setattr(embedded_link, "chain", no_chain)
            plain = script.calculateInverseKinematics(arm, 6, goal, **more)
            assert chains[6].compiled is None
        chains.clear()
        assert compiled == pytest.approx(plain, abs=1e-8), (case, more)


def test_limits_of_a_call_are_kept(script: ModuleType) -> None:
    """PyBullet's own steps leave them."""
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    bent(script, arm, 0.0)
    lower, upper = [-0.1, *[-2.9] * 6], [0.1, *[2.9] * 6]
    goal = [0.3, 0.25, 0.7]
    plain = script.calculateInverseKinematics(arm, 6, goal)
    assert abs(plain[0]) > 0.1
    for more in ({}, {"jointRanges": [4.0] * 7, "restPoses": START}):
        answer = script.calculateInverseKinematics(
            arm, 6, goal, lowerLimits=lower, upperLimits=upper, maxNumIterations=500, **more
        )
        assert all(low <= value <= high for low, value, high in zip(lower, answer, upper, strict=True))
        for joint, value in enumerate(answer):
            script.resetJointState(arm, joint, value)
        assert reached(script, arm, [6], [goal]) < 1e-2
        bent(script, arm, 0.0)
    for odd in ({"jointDamping": [0.0] * 7}, {"lowerLimits": [0.2] * 7, "upperLimits": [0.1] * 7, "jointRanges": [0.0] * 7, "restPoses": START}):
        assert all(map(math.isfinite, script.calculateInverseKinematics(arm, 6, goal, **odd)))


def test_limits_may_be_infinite(bullet: Any, script: ModuleType) -> None:
    """As scripts have them for continuous joints. Fewer iterations than the search needs, so that each step counts."""
    answers: list[Any] = []
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        bent(p, arm, 0.0)
        no_limits = {"lowerLimits": [-math.inf] * 7, "upperLimits": [math.inf] * 7}
        answers.append(p.calculateInverseKinematics(arm, 6, [0.3, 0.25, 0.7], maxNumIterations=5, **no_limits))
    assert answers[1] == pytest.approx(answers[0], abs=1e-4)


def test_requests_that_cannot_be_are_refused(script: ModuleType) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    for links, goals, more, said in (
        ([3], [], {}, "0 target positions for 1 links"),
        ([], [], {}, "0 target positions for 0 links"),
        ([99], [[0, 0, 0]], {}, "out-of-range"),
        ([3], [[0, 0]], {}, "has 3 numbers"),
        ([3], [[0, 0, 1]], {"currentPositions": [0.0]}, "1 joint positions for 7 degrees"),
    ):
        with pytest.raises(script.error, match=said):
            script.calculateInverseKinematics2(arm, links, goals, **more)
    with pytest.raises(script.error, match="failed"):
        script.calculateInverseKinematics2(99, [1], [[0, 0, 0]])


def test_rest_poses_of_another_number_are_not_read_as_in_pybullet(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        bent(p, arm, 0.1)
        goal = [0.3, 0.1, 0.6]
        for solve, link, target in (
            (p.calculateInverseKinematics, 6, goal),
            (p.calculateInverseKinematics2, [6], [goal]),
        ):
            plain = solve(arm, link, target)
            for rest in ([0.0], [0.0] * 9, ()):
                assert solve(arm, link, target, restPoses=rest) == pytest.approx(plain, abs=1e-9)
