"""Requests of steps that are kept from step to step, without a daemon."""

from __future__ import annotations

import random

from simd_client.embedded_link import RobotNumbers
from simd_client.proto import StepSimulationRequest
from simd_client.pybullet import constants
from simd_client.pybullet.arguments import ORIGIN, UPRIGHT
from simd_client.pybullet.ball_motors import BallMotor
from simd_client.pybullet.bodies import Body, BodyJoint
from simd_client.pybullet.step_targets import Key, StepTargets

JOINTS = 4
TIME_STEP = 1.0 / 240.0


def joint(index: int, ball: BallMotor | None = None) -> BodyJoint:
    """A rotating joint, or a spherical one."""
    kind = constants.JOINT_REVOLUTE if ball is None else constants.JOINT_SPHERICAL
    name = f"joint_{index}"
    info = (index, name.encode(), kind, 0, 0, 0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, b"", ORIGIN, ORIGIN, UPRIGHT, -1)
    return BodyJoint(
        name=name,
        link=f"link_{index}",
        kind=kind,
        info=info,
        position_index=index,
        velocity_index=index,
        width=1 if ball is None else 3,
        count=1 if ball is None else 4,
        index=index,
        driven=ball is None,
        inertia=0.5,
        limits=(None, None, None, None),
        damping=0.0,
        friction=0.1,
        ball=ball,
    )


def arm(number: int) -> Body:
    """A robot of such joints, the last one spherical."""
    joints = [joint(index) for index in range(JOINTS - 1)] + [joint(JOINTS - 1, BallMotor())]
    return Body(
        unique_id=number,
        robot=f"arm_{number}",
        model="arm",
        own=True,
        fixed=True,
        layout_version=1,
        base_link="base",
        joints=joints,
        by_joint={},
        link_indices={},
        links=[],
        frames={},
    )


def request_of(kept: StepTargets) -> StepSimulationRequest:
    """A copy of the request."""
    return StepSimulationRequest.FromString(kept.step(False, False).SerializeToString())


def change(body: Body, index: int, rng: random.Random) -> None:
    """Changes a motor as setJointMotorControl2 does."""
    of = body.joints[index]
    if of.ball is not None:
        of.ball.mode = rng.choice([constants.POSITION_CONTROL, constants.VELOCITY_CONTROL])
        of.ball.force = rng.choice([0.0, 5.0])
        return
    motor = of.motor
    motor.revision += 1
    motor.torque = rng.choice([None, None, None, 0.0, rng.uniform(-1.0, 1.0)])
    motor.mode = rng.choice([constants.POSITION_CONTROL, constants.VELOCITY_CONTROL, constants.PD_CONTROL])
    motor.position, motor.velocity = rng.uniform(-1.0, 1.0), rng.choice([0.0, rng.uniform(-1.0, 1.0)])
    motor.force, motor.position_gain = rng.choice([None, 0.0, 5.0]), rng.choice([0.1, 0.2])
    motor.velocity_gain, motor.max_velocity = rng.choice([0.5, 1.0]), rng.choice([0.0, 2.0])


def test_kept_messages_equal_new_ones() -> None:
    rng = random.Random(5)
    bodies = {number: arm(number) for number in range(2)}
    kept = StepTargets()
    waiting: list[Key] = []
    for _ in range(2000):
        if rng.random() < 0.3:
            every = [(number, index) for number in bodies for index in range(JOINTS)]
            waiting = rng.sample(every, rng.randrange(len(every)))
        for number, index in waiting:
            if rng.random() < 0.5:
                change(bodies[number], index, rng)
        # Only one number has changed, as in loops.
        for number, index in waiting:
            bodies[number].joints[index].motor.position += 0.01
        time_step = rng.choice([TIME_STEP, TIME_STEP, TIME_STEP, 0.002])
        parts, with_torques = rng.choice([0, 1, 1, 4]), rng.random() < 0.8
        anew = StepTargets()
        frictions = [each.put(waiting, bodies, time_step, parts, with_torques) for each in (kept, anew)]
        assert frictions[0] == frictions[1]
        assert request_of(kept) == request_of(anew)
        assert kept.targets().robots == anew.targets().robots


def test_a_step_before_which_no_motor_changed_sets_none_and_the_next_one_sets_them_again() -> None:
    bodies, keys = {0: arm(0)}, [(0, 0), (0, 1)]
    kept = StepTargets()
    kept.put(keys, bodies, TIME_STEP)
    first = request_of(kept)
    kept.put([], bodies, TIME_STEP)
    assert not request_of(kept).robots
    kept.put(keys, bodies, TIME_STEP)
    assert request_of(kept) == first and len(first.robots[0].joints) == 2


def test_a_robot_that_was_loaded_again_has_its_new_joints() -> None:
    bodies = {0: arm(0)}
    kept = StepTargets()
    kept.put([(0, 0)], bodies, TIME_STEP)
    bodies[0] = arm(0)
    bodies[0].joints[0].name = "other"
    kept.put([(0, 0)], bodies, TIME_STEP)
    assert request_of(kept).robots[0].joints[0].joint == "other"


def test_torques_are_known_and_left_out_where_there_is_no_step_for_them() -> None:
    bodies, keys = {0: arm(0)}, [(0, 0), (0, JOINTS - 1)]
    kept, anew = StepTargets(), StepTargets()
    motor, ball = bodies[0].joints[0].motor, bodies[0].joints[-1].ball
    assert ball is not None
    kept.put(keys, bodies, TIME_STEP)
    assert not kept.has_torques
    without = request_of(kept)
    motor.torque, ball.torque = 1.0, (1.0, 2.0, 3.0)
    kept.put(keys, bodies, TIME_STEP)
    assert kept.has_torques and request_of(kept) != without
    kept.put(keys, bodies, TIME_STEP, with_torques=False)
    assert kept.has_torques and request_of(kept) == without
    anew.put(keys, bodies, TIME_STEP, with_torques=False)
    assert request_of(anew) == without
    assert (motor.torque, ball.torque) == (1.0, (1.0, 2.0, 3.0))


def test_other_substeps_are_other_gains() -> None:
    bodies, keys = {0: arm(0)}, [(0, 0)]
    bodies[0].joints[0].motor.force = 5.0
    kept = StepTargets()
    kept.put(keys, bodies, TIME_STEP)
    once = request_of(kept).robots[0].joints[0].velocity
    kept.put(keys, bodies, TIME_STEP, 4)
    assert request_of(kept).robots[0].joints[0].velocity.max_effort == 4 * once.max_effort == 20.0
    kept.put(keys, bodies, TIME_STEP)
    assert request_of(kept).robots[0].joints[0].velocity == once


class Kept:
    """A request as a world keeps it, which writes numbers like `KeptStep` of the extension."""

    def __init__(self, request: bytes) -> None:
        self.request = StepSimulationRequest.FromString(request)

    def run(self, numbers: list[float], time_limit: float = 0.0) -> tuple[int, float, list[RobotNumbers]]:
        joints = [joint for robot in self.request.robots for joint in robot.joints]
        for joint, number in zip(joints, numbers, strict=True):
            kind = joint.WhichOneof("target")
            if kind in ("position", "servo"):
                getattr(joint, kind).position = number
            elif kind == "velocity":
                joint.velocity.velocity = number
            elif kind == "effort":
                joint.effort.effort = number
        return 0, 0.0, []


def test_numbers_alone_say_what_the_request_says() -> None:
    rng = random.Random(6)
    keys, used = [(0, 0), (0, 1), (0, 2)], 0
    bodies, kept = {0: arm(0)}, StepTargets()
    for _ in range(2000):
        for index in range(3):
            if rng.random() < 0.05:
                change(bodies[0], index, rng)
            motor = bodies[0].joints[index].motor
            motor.position = rng.uniform(-1.0, 1.0)
            if motor.mode == constants.VELOCITY_CONTROL and motor.velocity_gain == 1.0:
                motor.velocity = rng.uniform(-1.0, 1.0)
            # A motor that is on has no number for its torque.
            if motor.force != 0.0:
                motor.torque = None
        waiting = rng.choice([keys, keys, keys, []])
        kept.put(waiting, bodies, TIME_STEP)
        found = kept.kept(Kept, 1)
        if found is not None:
            step, numbers = found
            assert isinstance(step, Kept)
            step.run(numbers)
            used += bool(waiting)
            assert step.request == request_of(kept)
    assert used > 300
