"""Joints beyond their limits.

PyBullet's limits keep a joint from moving further out. They leave a joint outside if a script put it far
beyond them, or if it starts there. In a world with Bullet's laws, limits do that. In the world of another
client they push the joint back immediately and fast. There such a joint gets limits that include its
position, until it has returned within its own limits.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from simd_client.proto import JointReset

if TYPE_CHECKING:
    from .bodies import Body, JointBounds
    from .world import World

# Tolerance in radians or metres of a joint beyond its unchanged limits.
_NEAR = 1e-9


def put(world: World, body: Body, positions: Iterable[tuple[int, float]]) -> None:
    """Records new positions of joints of one axis, by their numbers."""
    if world.has_bullets_laws:
        return
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


def begin_at_zero(world: World, body: Body) -> None:
    """Puts the joints of a new body to 0 that the daemon has put to the nearest limit."""
    outside = [
        (index, joint) for index, joint in enumerate(body.joints) if joint.has_motor and joint.width == 1 and not _is_within(joint.limits, 0.0)
    ]
    if outside:
        put(world, body, ((index, 0.0) for index, _ in outside))
        world.put_joints(body, {(joint.name, 0): JointReset(joint=joint.name, position=0.0, velocity=0.0) for _, joint in outside})


def settle(world: World) -> None:
    """Restores the limits of returned joints after a step."""
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
    """Gives a joint its own limits, extended to its position if it is beyond them."""
    joint = body.joints[index]
    lower, upper = joint.limits[:2]
    if (body.unique_id, index) in world.beyond:
        position = world.joint_states(body).position[joint.position_index]
        lower = lower if lower is None else min(lower, position)
        upper = upper if upper is None else max(upper, position)
    world.bound(body, joint, (lower, upper, *joint.limits[2:]))


def came_back(world: World, body: Body, index: int, limits: JointBounds) -> None:
    """Handles a restored joint, which has the limits of an earlier moment."""
    joint = body.joints[index]
    world.beyond.pop((body.unique_id, index), None)
    if limits == joint.limits:
        return
    position = world.joint_states(body).position[joint.position_index]
    if not (world.has_bullets_laws or _is_within(joint.limits, position)):
        world.beyond[body.unique_id, index] = None
        if limits[2:] == joint.limits[2:] and _is_within(limits, position):
            # It was beyond them then.
            return
    send(world, body, index)


def _is_within(limits: JointBounds, position: float) -> bool:
    lower, upper = limits[:2]
    return (lower is None or position >= lower - _NEAR) and (upper is None or position <= upper + _NEAR)
