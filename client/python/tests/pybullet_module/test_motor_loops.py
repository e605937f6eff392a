"""Commands that change only positions and velocities, as in loops, compared with the same commands to a robot for
which each is new."""

from __future__ import annotations

import random
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from simd_client.pybullet import joint_motors
from simd_client.pybullet.bodies import Body
from simd_client.pybullet.connections import connected

from .conftest import SEVEN_ARM

GIVEN = ("mode", "position", "velocity", "position_gain", "velocity_gain", "force", "max_velocity", "torque")


def motors_of(body: Body) -> list[list[Any]]:
    """The settings of all motors."""
    return [[getattr(joint.motor, name) for name in GIVEN] for joint in body.joints]


def test_a_loop_sets_what_its_commands_say(script: ModuleType) -> None:
    rng = random.Random(11)
    numbers = [script.loadURDF(str(SEVEN_ARM), useFixedBase=True) for _ in range(2)]
    bodies = [connected(0).bodies[number] for number in numbers]
    joints = [index for index, joint in enumerate(bodies[0].joints) if joint.driven]
    kept: dict[str, Any] = {}
    for _ in range(600):
        if rng.random() < 0.3:
            kept = {name: [rng.choice([0.1, 0.5, 20.0])] * len(joints) for name in ("forces", "positionGains", "velocityGains")}
        some: dict[str, Any] = {name: rng.choice([values, np.array(values), tuple(values)]) for name, values in kept.items()}
        mode = rng.choice([script.POSITION_CONTROL, script.POSITION_CONTROL, script.VELOCITY_CONTROL, script.TORQUE_CONTROL])
        positions: list[float] = [rng.uniform(-1.0, 1.0) for _ in joints]
        velocities = rng.choice([None, [rng.choice([0.0, 1.0]) for _ in joints]])
        single = rng.choice([0.0, 2e12, rng.uniform(-1.0, 1.0)])
        is_single = rng.random() < 0.4
        for number, body in zip(numbers, bodies, strict=True):
            if body is bodies[1]:
                body.loop = None
                for joint in body.joints:
                    joint.motor.given = None
            if is_single:
                script.setJointMotorControl2(number, joints[2], mode, single, force=7.0)
            else:
                script.setJointMotorControlArray(
                    number, joints, mode, targetPositions=positions, targetVelocities=velocities, **some
                )
        assert motors_of(bodies[0]) == motors_of(bodies[1])
    with pytest.raises(script.error):
        script.setJointMotorControl2(numbers[0], joints[2], script.POSITION_CONTROL, float("nan"), force=7.0)
    assert motors_of(bodies[0]) == motors_of(bodies[1]), "a refused command leaves nothing behind"


def test_a_loop_judges_no_more_than_it_changes(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = script.loadURDF(str(SEVEN_ARM), useFixedBase=True)
    body = connected(0).bodies[robot]
    joints = [index for index, joint in enumerate(body.joints) if joint.driven]

    def turn(position: float) -> None:
        positions = [position] * len(joints)
        script.setJointMotorControlArray(robot, joints, script.POSITION_CONTROL, targetPositions=positions, forces=[9.0] * len(joints))
        script.setJointMotorControl2(robot, joints[0], script.POSITION_CONTROL, -position, force=9.0)
        script.stepSimulation()

    def never(*arguments: Any) -> None:
        raise AssertionError("nothing but positions has changed")

    turn(0.1)
    monkeypatch.setattr(joint_motors, "_command", never)
    turn(0.2)
    assert [body.joints[index].motor.position for index in joints] == [-0.2, *[0.2] * (len(joints) - 1)]
