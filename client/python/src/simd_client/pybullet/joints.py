"""Joints: their properties, states and resets."""

from __future__ import annotations

import math
from operator import itemgetter
from typing import Any

from simd_client.proto import JointReset

from . import outside_limits
from .arguments import ORIGIN, Vector, floats, indices
from .ball_motors import spherical_reset, to_bullet, unit
from .bodies import Body, JointInfoTuple
from .connections import connected
from .errors import error, unsupported
from .motors import MAX
from .reactions import NOTHING, reaction
from .readings import AnyJointStates
from .rotations import conjugate, rotate
from .world import World

JointState = tuple[float, float, tuple[float, ...], float]

# Maximum number of cached joint selections of one robot.
_MAX_READERS = 64


def getNumJoints(bodyUniqueId: int, physicsClientId: int = 0) -> int:
    """Returns the number of joints of a robot, fixed ones included; 0 for an unknown robot."""
    body = connected(physicsClientId).bodies.get(bodyUniqueId)
    return len(body.joints) if body else 0


def getJointInfo(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> JointInfoTuple:
    """Returns the 17 values of PyBullet: see docs/pybullet.md."""
    body = connected(physicsClientId).body(bodyUniqueId, "GetJointInfo failed.")
    if not 0 <= jointIndex < len(body.joints):
        raise error("GetJointInfo failed.")
    return body.joints[jointIndex].info


def getJointState(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> JointState:
    """Returns position, velocity, reaction (force and torque), and the effort that the motor applied over the
    last step, N m or N. The effort excludes the script's TORQUE_CONTROL; with substeps it is divided by their
    number, as in PyBullet."""
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
    reader = body.readers.get(tuple(wanted))
    if reader is not None:
        return reader(*world.joint_values(body))
    _in_range(body, wanted)
    states = world.joint_states(body)
    answer = tuple(_state(world, body, states, index) for index in wanted)
    _keep_reader(body, wanted)
    return answer


def _in_range(body: Body, wanted: list[int]) -> None:
    if any(not 0 <= index < len(body.joints) for index in wanted):
        raise error("Joint index out-of-range.")


def _keep_reader(body: Body, wanted: list[int]) -> None:
    """Caches how these states are read, since a loop requests the same ones at each step. Joints with a
    sensor and spherical ones are excluded; a sensor that is turned on later clears the cache."""
    joints = [body.joints[index] for index in wanted]
    if len(joints) < 2 or any(joint.ball is not None or joint.sensor for joint in joints):
        return
    # Joints without one value use the entry after those of all joints.
    q = itemgetter(*(joint.position_index if joint.width == 1 else -1 for joint in joints))
    u = itemgetter(*(joint.velocity_index if joint.width == 1 else -1 for joint in joints))
    carried = (NOTHING,) * len(joints)

    def read(positions: list[float], velocities: list[float], efforts: list[float]) -> tuple[JointState, ...]:
        return tuple(zip(q(positions), u(velocities), carried, u(efforts), strict=True))

    if len(body.readers) >= _MAX_READERS:
        body.readers.clear()
    body.readers[tuple(wanted)] = read


def _state(world: World, body: Body, states: AnyJointStates, index: int) -> JointState:
    joint = body.joints[index]
    carried = reaction(world, body, states, index)
    if joint.ball is not None:
        # PyBullet returns the first of each.
        orientation, spin, _, _ = _ball_state(world, body, states, index)
        return (orientation[0], spin[0], carried, 0.0)
    if joint.width != 1:
        return (0.0, 0.0, carried, 0.0)
    positions, velocities, efforts = world.joint_values(body)
    at = joint.velocity_index
    return (positions[joint.position_index], velocities[at], carried, efforts[at])


def getJointStateMultiDof(bodyUniqueId: int, jointIndex: int, physicsClientId: int = 0) -> tuple[Any, ...]:
    """Like `getJointState`, with a sequence of values for each. A fixed joint has none, a planar one three, a
    spherical one a quaternion and three velocities."""
    return getJointStatesMultiDof(bodyUniqueId, [jointIndex], physicsClientId)[0]


def getJointStatesMultiDof(bodyUniqueId: int, jointIndices: Any, physicsClientId: int = 0) -> tuple[Any, ...]:
    """`getJointStateMultiDof` for several joints of a robot."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getJointState failed.")
    wanted = indices(jointIndices, "expected a sequence of joint indices")
    _in_range(body, wanted)
    states, efforts = world.joint_states(body), world.joint_values(body)[2]
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
                tuple(efforts[u]),
            )
        )
    return tuple(answers)


def _ball_state(world: World, body: Body, states: AnyJointStates, index: int) -> tuple[Any, ...]:
    joint = body.joints[index]
    turn = body.frame(joint.link)[1]
    x, y, z, w = states.position[joint.position_index : joint.position_index + 4]
    back = conjugate(turn)
    of_axes: list[Vector] = []
    for values in (states.velocity, states.effort):
        a, b, c = values[joint.velocity_index : joint.velocity_index + 3]
        of_axes.append(rotate(back, (a, b, c)))
    (x1, y1, z1), (x2, y2, z2) = of_axes[1], ORIGIN if joint.ball is None else joint.ball.torque_sent
    parts = max(world.substeps, 1)
    motor: Vector = ((x1 - x2) / parts, (y1 - y2) / parts, (z1 - z2) / parts)
    return (to_bullet((x, y, z, w), turn), of_axes[0], reaction(world, body, states, index), motor)


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
    velocities = [[0.0] * len(value) for value in values]
    # An array has no truth value.
    if targetVelocities is not None and len(targetVelocities) > 0:
        velocities = [floats(value, text) for value in targetVelocities]
    if len(values) != len(wanted) or len(velocities) != len(wanted):
        raise error(text)
    _reset(world, body, wanted, values, velocities)


def _bounded(value: float) -> float:
    """Clamps to the daemon's maximum."""
    return max(-MAX, min(float(value), MAX))


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
            # PyBullet ignores a spherical joint that gets one number.
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
            reset = JointReset(joint=joint.name, axis=axis, position=_bounded(value[axis]), velocity=_bounded(speed))
            joints[joint.name, axis] = reset
    if joints:
        single = ((index, value) for index, value in zip(wanted, values, strict=True) if body.joints[index].width == 1)
        outside_limits.put(world, body, ((index, float(value[0])) for index, value in single if value))
        world.put_joints(body, joints)


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
]
