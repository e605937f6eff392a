"""Joints beyond their limits.

PyBullet's limits keep a joint from going further out, and leave one there that a script has put there, or that starts there. The daemon's
push it back, at once and with speed. So such a joint has limits that include where it is, until it has come back by itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .bodies import Body, JointBounds
    from .world import World

# Radians or metres that a joint may be beyond its limits as they are.
_NEAR = 1e-9


def put(world: World, body: Body, positions: Iterable[tuple[int, float]]) -> None:
    """Joints of one axis get these positions, by their numbers."""
    for index, position in positions:
        joint = body.joints[index]
        key = body.unique_id, index
        lower, upper = joint.limits[:2]
        is_beyond = not _is_within(joint.limits, position)
        if not is_beyond and key not in world.beyond:
            continue
        if is_beyond:
            lower = lower if lower is None else min(lower, position)
            upper = upper if upper is None else max(upper, position)
            world.beyond[key] = None
        else:
            del world.beyond[key]
        world.bound(body, joint, (lower, upper, *joint.limits[2:]))


def settle(world: World) -> None:
    """After a step: those that have come back have their limits again."""
    for key in list(world.beyond):
        number, index = key
        body = world.bodies.get(number)
        if body is None or index >= len(body.joints):
            del world.beyond[key]
            continue
        joint = body.joints[index]
        if _is_within(joint.limits, world.joint_states(body).position[joint.position_index]):
            del world.beyond[key]
            world.bound(body, joint, joint.limits)


def send(world: World, body: Body, index: int) -> None:
    """Gives a joint the limits that it has here, and where it is if it is beyond them."""
    joint = body.joints[index]
    lower, upper = joint.limits[:2]
    if (body.unique_id, index) in world.beyond:
        position = world.joint_states(body).position[joint.position_index]
        lower = lower if lower is None else min(lower, position)
        upper = upper if upper is None else max(upper, position)
    world.bound(body, joint, (lower, upper, *joint.limits[2:]))


def came_back(world: World, body: Body, index: int, limits: JointBounds) -> None:
    """The daemon has a joint as it was once, with the limits of then."""
    joint = body.joints[index]
    world.beyond.pop((body.unique_id, index), None)
    if limits == joint.limits:
        return
    position = world.joint_states(body).position[joint.position_index]
    if not _is_within(joint.limits, position):
        world.beyond[body.unique_id, index] = None
        if limits[2:] == joint.limits[2:] and _is_within(limits, position):
            # It was beyond them then.
            return
    send(world, body, index)


def _is_within(limits: JointBounds, position: float) -> bool:
    lower, upper = limits[:2]
    return (lower is None or position >= lower - _NEAR) and (upper is None or position <= upper + _NEAR)
