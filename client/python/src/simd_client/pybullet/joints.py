"""Joints: their properties, motors and states."""

from __future__ import annotations

import math
from typing import Any

from simd_client.proto import JointReset, RobotJointStates

from . import constants
from .arguments import UPRIGHT, Vector, floats, formerly, indices, vector
from .ball_motors import spherical_reset, to_bullet, unit
from .bodies import Body, JointInfoTuple
from .connections import connected
from .errors import error, unsupported
from .motors import NO_LIMIT
from .reactions import reaction
from .rotations import conjugate, rotate
from .world import World

JointState = tuple[float, float, tuple[float, ...], float]

_MODES = {
    constants.VELOCITY_CONTROL,
    constants.TORQUE_CONTROL,
    constants.POSITION_CONTROL,
    constants.PD_CONTROL,
}


def getNumJoints(bodyUniqueId: int, physicsClientId: int = 0) -> int:
    """The number of joints of a robot, fixed ones included; 0 if there is no such robot."""
    body = connected(physicsClientId).bodies.get(bodyUniqueId)
    return len(body.joints) if body else 0


def getJointInfo(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> JointInfoTuple:
    """The 17 values of PyBullet: see docs/pybullet.md."""
    body = connected(physicsClientId).body(bodyUniqueId, "GetJointInfo failed.")
    if not 0 <= jointIndex < len(body.joints):
        raise error("GetJointInfo failed.")
    return body.joints[jointIndex].info


@formerly("bodyIndex", "bodyUniqueId")
def setJointMotorControl2(
    bodyUniqueId: int,
    jointIndex: int,
    controlMode: int,
    targetPosition: float = 0.0,
    targetVelocity: float = 0.0,
    force: float = NO_LIMIT,
    positionGain: float = 0.1,
    velocityGain: float = 1.0,
    maxVelocity: float = -1.0,
    physicsClientId: int = 0,
) -> None:
    """Sets a joint's motor, from the next step on."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    _tell(
        world,
        body,
        jointIndex,
        controlMode,
        targetPosition,
        targetVelocity,
        force,
        positionGain,
        velocityGain,
        maxVelocity,
    )
    world.sent_if_playing()


def setJointMotorControl(
    bodyIndex: int,
    jointIndex: int,
    controlMode: int,
    targetValue: float = 0.0,
    maxForce: float = NO_LIMIT,
    positionGain: float = 0.1,
    velocityGain: float = 1.0,
) -> None:
    """The old form, for the first connection only, with one value for the mode."""
    position = targetValue if controlMode == constants.POSITION_CONTROL else 0.0
    velocity = targetValue if controlMode == constants.VELOCITY_CONTROL else 0.0
    force = targetValue if controlMode == constants.TORQUE_CONTROL else maxForce
    setJointMotorControl2(
        bodyIndex, jointIndex, controlMode, position, velocity, force, positionGain, velocityGain
    )


@formerly("bodyIndex", "bodyUniqueId")
def setJointMotorControlArray(
    bodyUniqueId: int,
    jointIndices: Any,
    controlMode: int,
    targetPositions: Any = None,
    targetVelocities: Any = None,
    forces: Any = None,
    positionGains: Any = None,
    velocityGains: Any = None,
    physicsClientId: int = 0,
) -> None:
    """`setJointMotorControl2` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    joints = indices(jointIndices, "expected a sequence of joint indices")
    values = [
        _matching(given, len(joints), what, default)
        for given, what, default in (
            (targetPositions, "target positions", 0.0),
            (targetVelocities, "target velocities", 0.0),
            (forces, "forces", 0.0 if controlMode == constants.TORQUE_CONTROL else NO_LIMIT),
            (positionGains, "position gains", 0.1),
            (velocityGains, "velocity gains", 1.0),
        )
    ]
    _check(body, joints, controlMode)
    for joint, position, velocity, force, kp, kd in zip(joints, *values, strict=True):
        _tell(world, body, joint, controlMode, position, velocity, force, kp, kd, -1.0)
    world.sent_if_playing()


def _matching(given: Any, count: int, what: str, default: float) -> list[float]:
    if given is None:
        return [default] * count
    refusal = f"number of {what} should match the number of joint indices"
    return floats(given, refusal, count)


def _check(body: Body, joints: list[int], mode: int) -> None:
    if any(not 0 <= joint < len(body.joints) for joint in joints):
        raise error("Joint index out-of-range.")
    if mode == constants.STABLE_PD_CONTROL:
        raise unsupported(
            "setJointMotorControl2", "STABLE_PD_CONTROL is not there; PD_CONTROL is stable here"
        )
    if mode not in _MODES:
        raise error("Illegal control mode.")


def _tell(
    world: World,
    body: Body,
    index: int,
    mode: int,
    position: float,
    velocity: float,
    force: float,
    position_gain: float,
    velocity_gain: float,
    max_velocity: float,
) -> None:
    """Changes a motor; does nothing if the joint has none."""
    _check(body, [index], mode)
    joint = body.joints[index]
    if not joint.driven:
        if joint.width:
            world.say_once(f"{body.robot}/{joint.name} has no motor: another joint or nothing moves it")
        return
    motor = joint.motor
    if mode == constants.TORQUE_CONTROL:
        motor.torque = float(force)
    else:
        motor.mode = mode
        motor.position, motor.velocity = float(position), float(velocity)
        motor.position_gain, motor.velocity_gain = float(position_gain), float(velocity_gain)
        motor.force, motor.max_velocity = abs(float(force)), max(float(max_velocity), 0.0)
    world.drive(body, index)


def getJointState(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> JointState:
    """Position, velocity, reaction (force and torque), and the effort that the motor applied."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getJointState failed.")
    if not 0 <= jointIndex < len(body.joints):
        raise error("getJointState failed (2).")
    return _state(world, body, world.joint_states(body), jointIndex)


def getJointStates(bodyUniqueId: int, jointIndices: Any, physicsClientId: int = 0) -> tuple[JointState, ...]:
    """`getJointState` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getJointState failed.")
    wanted = indices(jointIndices, "expected a sequence of joint indices")
    _in_range(body, wanted)
    states = world.joint_states(body)
    return tuple(_state(world, body, states, index) for index in wanted)


def _in_range(body: Body, wanted: list[int]) -> None:
    if any(not 0 <= index < len(body.joints) for index in wanted):
        raise error("Joint index out-of-range.")


def _state(world: World, body: Body, states: RobotJointStates, index: int) -> JointState:
    joint = body.joints[index]
    carried = reaction(world, body, states, index)
    if joint.ball is not None:
        # PyBullet gives the first of each.
        orientation, spin, _, _ = _ball_state(world, body, states, index)
        return (orientation[0], spin[0], carried, 0.0)
    if joint.width != 1:
        return (0.0, 0.0, carried, 0.0)
    at = joint.velocity_index
    return (states.position[joint.position_index], states.velocity[at], carried, states.effort[at])


def getJointStateMultiDof(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> tuple[Any, ...]:
    """As `getJointState`, with a sequence of values for each: none of a fixed joint, three of a planar one, a quaternion and
    three velocities of a spherical one."""
    return getJointStatesMultiDof(bodyUniqueId, [jointIndex], physicsClientId)[0]


def getJointStatesMultiDof(bodyUniqueId: int, jointIndices: Any, physicsClientId: int = 0) -> tuple[Any, ...]:
    """`getJointStateMultiDof` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getJointState failed.")
    wanted = indices(jointIndices, "expected a sequence of joint indices")
    _in_range(body, wanted)
    states = world.joint_states(body)
    answers: list[Any] = []
    for index in wanted:
        joint = body.joints[index]
        if joint.ball is not None:
            answers.append(_ball_state(world, body, states, index))
            continue
        # A floating joint has seven positions and six velocities.
        count = 7 if joint.width == 6 else joint.width
        q = slice(joint.position_index, joint.position_index + count)
        u = slice(joint.velocity_index, joint.velocity_index + joint.width)
        answers.append(
            (
                tuple(states.position[q]),
                tuple(states.velocity[u]),
                reaction(world, body, states, index),
                tuple(states.effort[u]),
            )
        )
    return tuple(answers)


def _ball_state(world: World, body: Body, states: RobotJointStates, index: int) -> tuple[Any, ...]:
    joint = body.joints[index]
    turn = body.frame(joint.link)[1]
    x, y, z, w = states.position[joint.position_index : joint.position_index + 4]
    back = conjugate(turn)
    of_axes: list[Vector] = []
    for values in (states.velocity, states.effort):
        a, b, c = values[joint.velocity_index : joint.velocity_index + 3]
        of_axes.append(rotate(back, (a, b, c)))
    return (to_bullet((x, y, z, w), turn), of_axes[0], reaction(world, body, states, index), of_axes[1])


def resetJointState(
    bodyUniqueId: int,
    jointIndex: int,
    targetValue: float,
    targetVelocity: float = 0.0,
    physicsClientId: int = 0,
) -> None:
    """Sets the position and velocity of a joint at once. Its motor keeps its target."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    _reset(world, body, [jointIndex], [[targetValue]], [[targetVelocity]])


def resetJointStateMultiDof(
    bodyUniqueId: int,
    jointIndex: int,
    targetValue: Any,
    targetVelocity: Any = None,
    physicsClientId: int = 0,
) -> None:
    """`resetJointState` with a sequence of values."""
    velocities = None if targetVelocity is None else [targetVelocity]
    resetJointStatesMultiDof(bodyUniqueId, [jointIndex], [targetValue], velocities, physicsClientId)


def resetJointStatesMultiDof(
    bodyUniqueId: int,
    jointIndices: Any,
    targetValues: Any,
    targetVelocities: Any = None,
    physicsClientId: int = 0,
) -> None:
    """`resetJointStateMultiDof` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    wanted = indices(jointIndices, "expected a sequence of joint indices")
    text = "number of target values should match the number of joint indices"
    values = [floats(value, text) for value in targetValues]
    velocities = [floats(value, text) for value in targetVelocities or [[0.0] * len(value) for value in values]]
    if len(values) != len(wanted) or len(velocities) != len(wanted):
        raise error(text)
    _reset(world, body, wanted, values, velocities)


def _reset(
    world: World, body: Body, wanted: list[int], values: list[list[float]], velocities: list[list[float]]
) -> None:
    _in_range(body, wanted)
    joints: dict[tuple[str, int], JointReset] = {}
    for index, value, velocity in zip(wanted, values, velocities, strict=True):
        joint = body.joints[index]
        if joint.width == 6:
            raise unsupported("resetJointStateMultiDof", "floating joints cannot be put elsewhere")
        if joint.ball is not None:
            # PyBullet leaves one alone that is given one number.
            if len(value) == 4:
                spin = velocity if len(velocity) == 3 else [0.0, 0.0, 0.0]
                turn = body.frame(joint.link)[1]
                reset = JointReset(joint=joint.name)
                spherical_reset(unit(value), (spin[0], spin[1], spin[2]), turn, reset.spherical)
                joints[joint.name, 0] = reset
            continue
        for axis in range(min(joint.width, len(value))):
            speed = velocity[axis] if axis < len(velocity) else 0.0
            if not (math.isfinite(value[axis]) and math.isfinite(speed)):
                raise error("resetJointState: position and velocity must be numbers")
            reset = JointReset(joint=joint.name, axis=axis, position=float(value[axis]), velocity=float(speed))
            joints[joint.name, axis] = reset
    if joints:
        world.put_joints(body, joints)


def setJointMotorControlMultiDof(
    bodyUniqueId: int,
    jointIndex: int,
    controlMode: int,
    targetPosition: Any = None,
    targetVelocity: Any = None,
    force: Any = None,
    positionGain: Any = None,
    velocityGain: Any = None,
    maxVelocity: Any = None,
    damping: Any = None,
    physicsClientId: int = 0,
) -> None:
    """`setJointMotorControl2` with sequences of one value; of a spherical joint a quaternion and sequences of three."""
    setJointMotorControlMultiDofArray(
        bodyUniqueId,
        [jointIndex],
        controlMode,
        None if targetPosition is None else [targetPosition],
        None if targetVelocity is None else [targetVelocity],
        None if force is None else [force],
        None if positionGain is None else [positionGain],
        None if velocityGain is None else [velocityGain],
        None if maxVelocity is None else [maxVelocity],
        physicsClientId,
    )
    del damping


def setJointMotorControlMultiDofArray(
    bodyUniqueId: int,
    jointIndices: Any,
    controlMode: int,
    targetPositions: Any = None,
    targetVelocities: Any = None,
    forces: Any = None,
    positionGains: Any = None,
    velocityGains: Any = None,
    maxVelocities: Any = None,
    physicsClientId: int = 0,
) -> None:
    """`setJointMotorControlMultiDof` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    wanted = indices(jointIndices, "expected a sequence of joint indices")
    _check(body, wanted, controlMode)
    if any(body.joints[index].width > 1 and body.joints[index].ball is None for index in wanted):
        raise unsupported("setJointMotorControlMultiDof", "planar and floating joints have no motors here")
    no_force = 0.0 if controlMode == constants.TORQUE_CONTROL else NO_LIMIT
    for place, index in enumerate(wanted):
        if body.joints[index].width == 0:
            continue
        if body.joints[index].ball is not None:
            all_given = (targetPositions, targetVelocities, forces, positionGains, velocityGains, maxVelocities)
            given = [None if values is None else values[place] for values in all_given]
            _tell_ball(world, body, index, controlMode, *given)
            continue
        _tell(
            world,
            body,
            index,
            controlMode,
            _first(targetPositions, place, 0.0),
            _first(targetVelocities, place, 0.0),
            _first(forces, place, no_force),
            _first(positionGains, place, 0.1),
            _first(velocityGains, place, 1.0),
            _first(maxVelocities, place, -1.0),
        )
    world.sent_if_playing()


def _tell_ball(
    world: World,
    body: Body,
    index: int,
    mode: int,
    orientation: Any,
    velocity: Any,
    force: Any,
    position_gain: Any,
    velocity_gain: Any,
    max_velocity: Any,
) -> None:
    """Changes the motor of a spherical joint. Of forces the largest holds about each axis, of gains the first."""
    motor = body.joints[index].ball
    if motor is None:
        return
    if mode == constants.TORQUE_CONTROL:
        motor.torque = _three(force, (0.0, 0.0, 0.0))
        world.drive(body, index)
        return
    motor.mode = mode
    motor.orientation = UPRIGHT if orientation is None else unit(floats(orientation, "a quaternion", 4))
    motor.velocity = _three(velocity, (0.0, 0.0, 0.0))
    motor.force = max(map(abs, _three(force, (NO_LIMIT, NO_LIMIT, NO_LIMIT))))
    motor.position_gain = _first([position_gain], 0, 0.1) if position_gain is not None else 0.1
    motor.velocity_gain = _first([velocity_gain], 0, 1.0) if velocity_gain is not None else 1.0
    motor.max_velocity = max(_first([max_velocity], 0, -1.0), 0.0) if max_velocity is not None else 0.0
    world.drive(body, index)


def _three(given: Any, default: Vector) -> Vector:
    """Three numbers, or one for all."""
    if given is None:
        return default
    values = floats(given if hasattr(given, "__len__") else [given], "expected a sequence of three numbers")
    if len(values) == 1:
        values *= 3
    x, y, z = vector(values, "expected a sequence of three numbers")
    return (x, y, z)


def _first(given: Any, place: int, default: float) -> float:
    """A value, or the only one of a sequence."""
    if given is None:
        return default
    value = given[place]
    return float(value[0]) if hasattr(value, "__len__") else float(value)


__all__ = [
    "getJointInfo",
    "getJointState",
    "getJointStateMultiDof",
    "getJointStates",
    "getJointStatesMultiDof",
    "getNumJoints",
    "resetJointState",
    "resetJointStateMultiDof",
    "resetJointStatesMultiDof",
    "setJointMotorControl",
    "setJointMotorControl2",
    "setJointMotorControlArray",
    "setJointMotorControlMultiDof",
    "setJointMotorControlMultiDofArray",
]
