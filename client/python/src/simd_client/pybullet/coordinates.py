"""Positions and velocities of all joints as PyBullet counts them, and as the daemon does.

PyBullet has three ways. In the short one each joint has as many positions as velocities: three angles of a spherical joint,
and a base is at the origin. In the placed one, of inverse dynamics, a free base's seven positions or six velocities come before
those of the short one. In the long one, which DeepMimic's controllers use, a base has seven positions and a spherical joint
four, of which the last four are a quaternion; velocities are as many, with a number in the fourth column that means nothing.
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

# Of a base, in the long way.
_BASE = 7
# Of a free base, as the daemon counts.
_ROOT = 6


def short(body: Body, positions: Sequence[float], velocities: Sequence[float] | None = None) -> Configuration:
    """The daemon's configuration from PyBullet's short way.

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
            # Bullet turns about x, then y, then z of the child's axes.
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
    """The daemon's velocities from Bullet's short ones. Of a free base the daemon has the linear velocity of the root's origin,
    then the angular one; Bullet the angular one, then the linear velocity of the centre of mass, in the base's axes."""
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
    """How many positions and velocities PyBullet's placed way has."""
    joints = sum(joint.width for joint in body.joints)
    return _BASE + joints, _ROOT + joints


def placed(body: Body, positions: Sequence[float], velocities: Sequence[float]) -> Configuration:
    """The daemon's configuration of a robot with a free base, from PyBullet's placed way."""
    configuration = short(body, positions[_BASE:])
    put_pose(configuration.root, compose(base_of(positions), inverse(body.frame(body.base_link))))
    moving = (from_placed(body, positions) @ np.array(velocities)).tolist()
    _put_velocities(configuration, moving)
    return configuration


def placed_accelerations(
    body: Body, positions: Sequence[float], velocities: Sequence[float], accelerations: Sequence[float]
) -> list[float]:
    """The daemon's accelerations from PyBullet's placed ones, which are those of the centre of mass in the world, along the
    base's axes: the root's origin also goes around it."""
    found: Array = from_placed(body, positions) @ np.array(accelerations)
    x, y, z = velocities[:3]
    spin = rotate(base_of(positions)[1], (x, y, z))
    found[:3] += cross(spin, cross(spin, _root_from_center(body, positions)))
    return found.tolist()


def from_placed(body: Body, positions: Sequence[float]) -> Array:
    """The daemon's velocities from PyBullet's placed ones: of the base's centre of mass the angular one, then the linear one, both
    in the base's axes (Bullet's `MultiBodyTree`, a joint of the kind `FLOATING`)."""
    wide = placed_widths(body)[1]
    change: Array = np.zeros((wide, wide))
    turn: Array = np.array(matrix(base_of(positions)[1]), np.float64).reshape(3, 3)
    change[0:3, 0:3] = _moved_by_turning(_root_from_center(body, positions)) @ turn
    change[0:3, 3:6] = change[3:6, 0:3] = turn
    _put_joints(change, body, _ROOT, wide=False)
    return change


def _root_from_center(body: Body, positions: Sequence[float]) -> Vector:
    """From the base's centre of mass to the origin of the root link, world axes."""
    return rotate(base_of(positions)[1], inverse(body.frame(body.base_link))[0])


def _put_velocities(configuration: Configuration, moving: Sequence[float]) -> None:
    """The daemon's velocities, those of a free root first."""
    line, turn = configuration.root_twist.linear, configuration.root_twist.angular
    line.x, line.y, line.z, turn.x, turn.y, turn.z = moving[:_ROOT]
    configuration.velocities.extend(moving[_ROOT:])


def long_width(body: Body) -> int:
    """How many numbers PyBullet's long way has."""
    return _BASE + sum(joint.count for joint in body.joints)


def long(body: Body, positions: Sequence[float], velocities: Sequence[float] | None = None) -> Configuration:
    """The daemon's configuration of a robot with a free base, from PyBullet's long way."""
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
    """world_from_inertia of the base, in PyBullet's long way."""
    x, y, z, *turn = positions[:_BASE]
    return (x, y, z), unit(turn)


def from_long(body: Body, positions: Sequence[float]) -> Array:
    """The daemon's velocities from PyBullet's long ones: of the base's centre of mass the linear one, then the angular one,
    both in world axes."""
    change: Array = np.zeros((_ROOT + sum(joint.width for joint in body.joints), long_width(body)))
    change[0:3, 0:3] = change[3:6, 3:6] = np.eye(3)
    change[0:3, 3:6] = _moved_by_turning(_root_from_center(body, positions))
    _put_joints(change, body, _ROOT, wide=True)
    return change


def unused_columns(body: Body) -> list[int]:
    """Where PyBullet's long velocities mean nothing."""
    balls = [_BASE + at + 3 for joint, at in _joint_columns(body, wide=True) if joint.ball is not None]
    return [_BASE - 1, *balls]


def _joint_columns(body: Body, wide: bool) -> Iterator[tuple[BodyJoint, int]]:
    """Each joint, and where its first value is behind the base's."""
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
            # Bullet's are about the axes of the link's inertia.
            block = np.array(matrix(body.frame(joint.link)[1]), np.float64).reshape(3, 3)
        change[row : row + joint.width, column : column + joint.width] = block


def _moved_by_turning(offset: tuple[float, float, float]) -> Array:
    """The velocity of a point at an offset, by axis of the angular velocity."""
    rows = [cross(axis, offset) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.array(rows, np.float64).T


def _about(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    turns = [from_euler(x, 0.0, 0.0), from_euler(0.0, y, 0.0), from_euler(0.0, 0.0, z)]
    turn = UPRIGHT
    for each in turns:
        turn = compose(((0.0, 0.0, 0.0), turn), ((0.0, 0.0, 0.0), each))[1]
    return turn
