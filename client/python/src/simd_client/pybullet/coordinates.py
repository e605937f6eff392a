"""Conversion of positions and velocities of all joints between PyBullet's layouts and the daemon's.

PyBullet has three layouts. In the short one each joint has as many positions as velocities: three angles for
a spherical joint; a base is at the origin. The placed one, of inverse dynamics, puts a free base's seven
positions or six velocities before the short layout. DeepMimic's controllers use the long one: a base has
seven positions and a spherical joint four, with a quaternion in the last four. It has as many velocities,
with a meaningless number in the fourth column.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from simd_client.proto import Configuration

from .arguments import UPRIGHT, Pose, Vector
from .ball_motors import to_simd, unit
from .bodies import Body, BodyJoint
from .errors import error
from .kinematics import put_pose
from .rotations import compose, cross, from_euler, inverse, matrix, rotate

Array = NDArray[np.float64]

# Numbers of a base, in the long layout.
_BASE = 7
# Numbers of a free base, in the daemon's layout.
_ROOT = 6


def short(body: Body, positions: Sequence[float], velocities: Sequence[float] | None = None) -> Configuration:
    """Returns the daemon's configuration from PyBullet's short layout.

    Raises:
        error: for another number of positions.
    """
    wanted = sum(joint.width for joint in body.joints)
    if len(positions) != wanted or any(joint.width == 6 for joint in body.joints):
        raise error(f"{len(positions)} joint positions for {wanted} degrees of freedom of {body.robot}")
    placed = [0.0] * sum(joint.count for joint in body.joints)
    for joint, at in _joint_columns(body, wide=False):
        values = positions[at : at + joint.width]
        if joint.ball is not None:
            # Bullet rotates about x, then y, then z of the child's axes.
            x, y, z = values
            values = to_simd(_about(x, y, z), body.frame(joint.link)[1])
        placed[joint.position_index : joint.position_index + joint.count] = values
    configuration = Configuration(positions=placed)
    if velocities is not None:
        if len(velocities) != wanted:
            raise error(f"{len(velocities)} joint velocities for {wanted} degrees of freedom of {body.robot}")
        base = 0 if body.fixed else _ROOT
        moving = from_short(body) @ np.array([*([0.0] * base), *velocities])
        configuration.velocities.extend(moving[base:].tolist())
    if not body.fixed:
        put_pose(configuration.root, inverse(body.frame(body.base_link)))
    return configuration


def from_short(body: Body) -> Array:
    """Returns the daemon's velocities from Bullet's short ones. For a free base the daemon has the linear
    velocity of the root's origin, then the angular one. Bullet has the angular one, then the linear velocity
    of the centre of mass, in the base's axes."""
    base = 0 if body.fixed else _ROOT
    wide = base + sum(joint.width for joint in body.joints)
    change: Array = np.zeros((wide, wide))
    if base:
        offset = inverse(body.frame(body.base_link))[0]
        change[0:3, 3:6] = change[3:6, 0:3] = np.eye(3)
        change[0:3, 0:3] = _moved_by_turning(offset)
    _put_joints(change, body, base, wide=False)
    return change


def placed_widths(body: Body) -> tuple[int, int]:
    """Returns the numbers of positions and velocities in PyBullet's placed layout."""
    joints = sum(joint.width for joint in body.joints)
    return _BASE + joints, _ROOT + joints


def placed(body: Body, positions: Sequence[float], velocities: Sequence[float]) -> Configuration:
    """Returns the daemon's configuration of a robot with a free base, from PyBullet's placed layout."""
    configuration = short(body, positions[_BASE:])
    put_pose(configuration.root, compose(base_of(positions), inverse(body.frame(body.base_link))))
    moving = (from_placed(body, positions) @ np.array(velocities)).tolist()
    _put_velocities(configuration, moving)
    return configuration


def placed_accelerations(
    body: Body, positions: Sequence[float], velocities: Sequence[float], accelerations: Sequence[float]
) -> list[float]:
    """Returns the daemon's accelerations from PyBullet's placed ones. Those belong to the centre of mass in
    the world, along the base's axes; the root's origin also moves around it."""
    found: Array = from_placed(body, positions) @ np.array(accelerations)
    x, y, z = velocities[:3]
    spin = rotate(base_of(positions)[1], (x, y, z))
    found[:3] += cross(spin, cross(spin, _root_from_center(body, positions)))
    return found.tolist()


def from_placed(body: Body, positions: Sequence[float]) -> Array:
    """Returns the daemon's velocities from PyBullet's placed ones. These have the angular and then the linear
    velocity of the base's centre of mass, both in the base's axes. In Bullet it is a `FLOATING` joint of
    `MultiBodyTree`."""
    wide = placed_widths(body)[1]
    change: Array = np.zeros((wide, wide))
    turn: Array = np.array(matrix(base_of(positions)[1]), np.float64).reshape(3, 3)
    change[0:3, 0:3] = _moved_by_turning(_root_from_center(body, positions)) @ turn
    change[0:3, 3:6] = change[3:6, 0:3] = turn
    _put_joints(change, body, _ROOT, wide=False)
    return change


def _root_from_center(body: Body, positions: Sequence[float]) -> Vector:
    """Vector from the base's centre of mass to the origin of the root link, world axes."""
    return rotate(base_of(positions)[1], inverse(body.frame(body.base_link))[0])


def _put_velocities(configuration: Configuration, moving: Sequence[float]) -> None:
    """Sets the daemon's velocities, a free root's first."""
    line, turn = configuration.root_twist.linear, configuration.root_twist.angular
    line.x, line.y, line.z, turn.x, turn.y, turn.z = moving[:_ROOT]
    configuration.velocities.extend(moving[_ROOT:])


def long_width(body: Body) -> int:
    """Returns the count of numbers in PyBullet's long layout."""
    return _BASE + sum(joint.count for joint in body.joints)


def long(body: Body, positions: Sequence[float], velocities: Sequence[float] | None = None) -> Configuration:
    """Returns the daemon's configuration of a robot with a free base, from PyBullet's long layout."""
    placed = [0.0] * (long_width(body) - _BASE)
    for joint, at in _joint_columns(body, wide=True):
        values: Sequence[float] = positions[_BASE + at : _BASE + at + joint.count]
        if joint.ball is not None:
            values = to_simd(unit(values), body.frame(joint.link)[1])
        placed[joint.position_index : joint.position_index + joint.count] = values
    configuration = Configuration(positions=placed)
    put_pose(configuration.root, compose(base_of(positions), inverse(body.frame(body.base_link))))
    if velocities is not None:
        _put_velocities(configuration, (from_long(body, positions) @ np.array(velocities)).tolist())
    return configuration


def base_of(positions: Sequence[float]) -> Pose:
    """Returns world_from_inertia of the base, in PyBullet's long layout."""
    x, y, z, *turn = positions[:_BASE]
    return (x, y, z), unit(turn)


def from_long(body: Body, positions: Sequence[float]) -> Array:
    """Returns the daemon's velocities from PyBullet's long ones: the linear and then the angular velocity of
    the base's centre of mass, both in world axes."""
    change: Array = np.zeros((_ROOT + sum(joint.width for joint in body.joints), long_width(body)))
    change[0:3, 0:3] = change[3:6, 3:6] = np.eye(3)
    change[0:3, 3:6] = _moved_by_turning(_root_from_center(body, positions))
    _put_joints(change, body, _ROOT, wide=True)
    return change


def unused_columns(body: Body) -> list[int]:
    """Indices of meaningless numbers in PyBullet's long velocities."""
    balls = [_BASE + at + 3 for joint, at in _joint_columns(body, wide=True) if joint.ball is not None]
    return [_BASE - 1, *balls]


def _joint_columns(body: Body, wide: bool) -> Iterator[tuple[BodyJoint, int]]:
    """Each joint, with the index of its first value after the base's."""
    at = 0
    for joint in body.joints:
        yield joint, at
        at += joint.count if wide else joint.width


def _put_joints(change: Array, body: Body, root: int, wide: bool) -> None:
    base = _BASE if wide else root
    for joint, at in _joint_columns(body, wide):
        row, column = root + joint.velocity_index, base + at
        block: Array = np.eye(joint.width)
        if joint.ball is not None:
            # Bullet's axes are those of the link's inertia.
            block = np.array(matrix(body.frame(joint.link)[1]), np.float64).reshape(3, 3)
        change[row : row + joint.width, column : column + joint.width] = block


def _moved_by_turning(offset: tuple[float, float, float]) -> Array:
    """Velocity of a point at an offset, by axis of the angular velocity."""
    rows = [cross(axis, offset) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.array(rows, np.float64).T


def _about(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    turns = [from_euler(x, 0.0, 0.0), from_euler(0.0, y, 0.0), from_euler(0.0, 0.0, z)]
    turn = UPRIGHT
    for each in turns:
        turn = compose(((0.0, 0.0, 0.0), turn), ((0.0, 0.0, 0.0), each))[1]
    return turn
