"""Motors of joints."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat
from typing import Any

from . import constants
from .arguments import UPRIGHT, Vector, floats, formerly, indices, vector
from .ball_motors import unit
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .motors import MAX, NO_LIMIT, MotorLoop
from .world import World

_MODES = {
    constants.VELOCITY_CONTROL,
    constants.TORQUE_CONTROL,
    constants.POSITION_CONTROL,
    constants.PD_CONTROL,
}


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
    body = world.bodies.get(bodyUniqueId)
    if body is not None and 0 <= jointIndex < len(body.joints):
        motor = body.joints[jointIndex].motor
        rest = (force, positionGain, velocityGain, maxVelocity)
        if motor.given == rest and motor.mode == controlMode and abs(targetPosition) <= MAX >= abs(targetVelocity):
            # The call belongs to a loop.
            motor.position, motor.velocity = float(targetPosition), float(targetVelocity)
            world.drive(body, (jointIndex,))
            if world.playing:
                world.flush()
            return
    body = world.body(bodyUniqueId, "Joint index out-of-range.")
    _check(body, (jointIndex,), controlMode)
    setting = (targetPosition, targetVelocity, force, positionGain, velocityGain, maxVelocity)
    _command(world, body, [jointIndex], controlMode, [setting])
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
    """Old form, for the first connection only, with one value for the mode."""
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
    loop = body.loop
    if (
        loop is not None
        and loop.is_like(jointIndices, controlMode, forces, positionGains, velocityGains)
        and loop.set(
            _matching(targetPositions, len(loop.motors), "target positions", 0.0),
            _matching(targetVelocities, len(loop.motors), "target velocities", 0.0),
        )
    ):
        world.drive(body, loop.joints)
        if world.playing:
            world.flush()
        return
    joints = indices(jointIndices, "expected a sequence of joint indices")
    count = len(joints)
    positions = _matching(targetPositions, count, "target positions", 0.0)
    velocities = _matching(targetVelocities, count, "target velocities", 0.0)
    no_force = 0.0 if controlMode == constants.TORQUE_CONTROL else NO_LIMIT
    most = _matching(forces, count, "forces", no_force)
    kp = _matching(positionGains, count, "position gains", 0.1)
    kd = _matching(velocityGains, count, "velocity gains", 1.0)
    _check(body, joints, controlMode)
    settings = [*zip(positions, velocities, most, kp, kd, repeat(-1.0, count), strict=True)]
    _command(world, body, joints, controlMode, settings)
    if controlMode != constants.TORQUE_CONTROL and all(body.joints[index].motor.given is not None for index in joints):
        forces, positionGains, velocityGains = (
            None if values is None else [*values] for values in (forces, positionGains, velocityGains)
        )
        motors = [body.joints[index].motor for index in joints]
        body.loop = MotorLoop(joints, controlMode, forces, positionGains, velocityGains, motors)
    world.sent_if_playing()


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
    """Like `setJointMotorControl2`, with sequences of one value; for a spherical joint a quaternion and
    sequences of three."""
    if controlMode == constants.STABLE_PD_CONTROL:
        # As in PyBullet, only the function for several joints accepts it.
        raise error("Illegal control mode.")
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
    if controlMode == constants.STABLE_PD_CONTROL:
        # PD_CONTROL here has an implicit spring and damper.
        controlMode = constants.PD_CONTROL
    _check(body, wanted, controlMode)
    if any(body.joints[index].width > 1 and body.joints[index].ball is None for index in wanted):
        raise unsupported("setJointMotorControlMultiDof", "planar and floating joints have no motors here")
    no_force = 0.0 if controlMode == constants.TORQUE_CONTROL else NO_LIMIT
    for number, index in enumerate(wanted):
        if body.joints[index].width == 0:
            continue
        if body.joints[index].ball is not None:
            all_given = (targetPositions, targetVelocities, forces, positionGains, velocityGains, maxVelocities)
            given = [None if values is None else values[number] for values in all_given]
            _command_ball(world, body, index, controlMode, *given)
            continue
        setting = (
            _first(targetPositions, number, 0.0),
            _first(targetVelocities, number, 0.0),
            _first(forces, number, no_force),
            _first(positionGains, number, 0.1),
            _first(velocityGains, number, 1.0),
            _first(maxVelocities, number, -1.0),
        )
        _command(world, body, [index], controlMode, [setting])
    world.sent_if_playing()


def _matching(given: Any, count: int, what: str, default: float) -> list[float]:
    if given is None:
        return [default] * count
    refusal = f"number of {what} should match the number of joint indices"
    return floats(given, refusal, count)


def _check(body: Body, joints: Sequence[int], mode: int) -> None:
    if joints and not (min(joints) >= 0 and max(joints) < len(body.joints)):
        raise error("Joint index out-of-range.")
    if mode not in _MODES:
        raise error("Illegal control mode.")


def _command(
    world: World,
    body: Body,
    joints: list[int],
    mode: int,
    settings: Sequence[tuple[float, float, float, float, float, float]],
) -> None:
    """Changes motors of existing joints: position, velocity, force, gains of both, and the maximum velocity
    of each. Ignores joints without a motor."""
    body.loop = None
    driven: list[int] = []
    checked = [tuple(map(_settled, own, _NAMES)) for own in settings]
    for index, own, given in zip(joints, checked, settings, strict=True):
        position, velocity, force, position_gain, velocity_gain, max_velocity = own
        joint = body.joints[index]
        if not joint.driven:
            if joint.width:
                world.say_once(f"{body.robot}: joints that follow others, as {joint.name}, have no motors (--mimic)")
            continue
        driven.append(index)
        most = joint.limits[2]
        if most is not None and world.keeps_limits and force > most and mode != constants.VELOCITY_CONTROL:
            world.say_once(
                f"{body.robot}: the file's limits of effort bound what the script asks for, as {force:g} of {joint.name} to "
                f"{most:g} (--limits)"
            )
        if mode == constants.TORQUE_CONTROL:
            with world.commands:
                joint.add_torque((force,))
            continue
        motor = joint.motor
        motor.mode = mode
        motor.position = position
        motor.velocity = velocity
        motor.position_gain = position_gain
        motor.velocity_gain = velocity_gain
        motor.force = abs(force)
        motor.max_velocity = max_velocity if max_velocity > 0.0 else 0.0
        motor.given = given[2:]
        motor.revision += 1
    world.drive(body, driven)


_NAMES = ("targetPosition", "targetVelocity", "force", "positionGain", "velocityGain", "maxVelocity")


def _settled(value: float, name: str) -> float:
    """Clamps a value to the daemon's maximum.

    Raises:
        error: for what is not a number, which nothing can come back from.
    """
    number = float(value)
    if number != number:
        raise error(f"setJointMotorControl: {name} is NaN; the motor stays as it was")
    return max(-MAX, min(number, MAX))


def _command_ball(
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
    """Changes the motor of a spherical joint. The largest force applies about each axis, and the first gain
    is used."""
    motor = body.joints[index].ball
    if motor is None:
        return
    if mode == constants.TORQUE_CONTROL:
        torque = _three(force, (0.0, 0.0, 0.0))
        with world.commands:
            body.joints[index].add_torque(torque)
        world.drive(body, [index])
        return
    motor.mode = mode
    motor.orientation = UPRIGHT if orientation is None else unit(floats(orientation, "a quaternion", 4))
    motor.velocity = _three(velocity, (0.0, 0.0, 0.0))
    motor.force = max(map(abs, _three(force, (NO_LIMIT, NO_LIMIT, NO_LIMIT))))
    motor.position_gain = _first([position_gain], 0, 0.1) if position_gain is not None else 0.1
    motor.velocity_gain = _first([velocity_gain], 0, 1.0) if velocity_gain is not None else 1.0
    motor.max_velocity = max(_first([max_velocity], 0, -1.0), 0.0) if max_velocity is not None else 0.0
    world.drive(body, [index])


def _three(given: Any, default: Vector) -> Vector:
    """Returns three numbers, or one for all."""
    if given is None:
        return default
    values = floats(given if hasattr(given, "__len__") else [given], "expected a sequence of three numbers")
    if len(values) == 1:
        values *= 3
    x, y, z = vector(values, "expected a sequence of three numbers")
    return (x, y, z)


def _first(given: Any, number: int, default: float) -> float:
    """Returns a value, or the only one of a sequence."""
    if given is None:
        return default
    value = given[number]
    return float(value[0]) if hasattr(value, "__len__") else float(value)


__all__ = [
    "setJointMotorControl",
    "setJointMotorControl2",
    "setJointMotorControlArray",
    "setJointMotorControlMultiDof",
    "setJointMotorControlMultiDofArray",
]
