"""Force-torque sensors in joints."""

from __future__ import annotations

from . import constants
from .arguments import Vector
from .bodies import Body
from .connections import connected
from .errors import error
from .readings import AnyJointStates
from .rotations import conjugate, cross, rotate
from .world import World

NOTHING = (0.0,) * 6
"""Reading of a joint without a sensor."""


def enableJointForceTorqueSensor(
    bodyUniqueId: int, jointIndex: int, enableSensor: int = 1, physicsClientId: int = 0
) -> None:
    """Turns the force-torque sensor of a joint on or off: its reading is in `getJointState`."""
    body = connected(physicsClientId).body(bodyUniqueId, "Error creating sensor.")
    if not 0 <= jointIndex < len(body.joints):
        raise error("Error creating sensor.")
    body.joints[jointIndex].sensor = bool(enableSensor)
    body.readers.clear()


def reaction(world: World, body: Body, states: AnyJointStates, index: int) -> tuple[float, ...]:
    """Returns the reaction of the parent on the child, as PyBullet reports it. It is in the axes of the
    child's inertia, about its centre of mass, and without the motor's effort along the axis. Zeros if the
    sensor is off."""
    joint = body.joints[index]
    if not joint.sensor:
        return NOTHING
    x, y, z, a, b, c = world.reactions(body).wrenches[6 * index : 6 * index + 6]
    force: Vector = (x, y, z)
    center, turn = body.frame(joint.link)
    # About the centre of mass: T - c x F.
    u, v, w = cross(center, force)
    back = conjugate(turn)
    reaction = [*rotate(back, force), *rotate(back, (a - u, b - v, c - w))]
    if joint.width == 1:
        motor = states.effort[joint.velocity_index] - joint.torque_sent
        first = 0 if joint.kind == constants.JOINT_PRISMATIC else 3
        for column, along in enumerate(joint.info[13], start=first):
            reaction[column] -= motor * along
    return tuple(reaction)


__all__ = ["enableJointForceTorqueSensor"]
