"""PyBullet's search for joint positions of a pose: damped steps from the current positions, which may end
before the pose.

S. R. Buss, "Introduction to inverse kinematics with Jacobian transpose, pseudoinverse and damped least squares methods", 2004.

The extension module has the same search, twenty times as fast; it is used where it is installed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simd_client import embedded_link

from . import constants
from .arguments import ORIGIN, UPRIGHT, Pose, Quaternion, Vector
from .bodies import Body
from .rotations import compose, conjugate, cross, product, rotate

Array = NDArray[np.float64]

ITERATIONS, THRESHOLD, DAMPING = 20, 1e-4, 0.5
_NULL_SPACE_DAMPING = 0.6**2
# Rad, slightly reduced: Bullet's angle has single precision, in which pi is more than pi.
_HALF_TURN = 3.14159262
# Maximum of one step, rad or m.
_LARGEST = math.pi / 4
# Rate at which joints approach their rest poses, and return within their limits.
_TO_REST, _TO_LIMITS = 0.001, 10.0
# Fraction of the largest singular value: smaller ones are ignored in the null space.
_SINGULAR = 0.01


@dataclass(frozen=True, slots=True)
class NullSpace:
    """Motion of joints within the freedom that the pose leaves."""

    lower: Array
    upper: Array
    ranges: Array
    rest: Array

    def lists(self) -> list[list[float]]:
        """Returns its numbers."""
        return [each.tolist() for each in (self.lower, self.upper, self.ranges, self.rest)]

    def wish(self, q: Array) -> Array:
        """Returns the preferred step of the joints."""
        beyond = np.minimum(self.upper - q, 0.0) + np.maximum(self.lower - q, 0.0)
        off = beyond != 0.0
        wish = _TO_REST * (self.rest - q)
        wish[off] += _TO_LIMITS * beyond[off] / self.ranges[off]
        return wish


class Chain:
    """The joints between a robot's base and one of its links."""

    def __init__(self, body: Body, link: int) -> None:
        numbers = {index: column for column, index in enumerate(turning(body))}
        above: list[int] = []
        at = link
        while at >= 0:
            above.append(at)
            at = body.joints[at].info[16]
        # For each movable joint: the fixed transform to it, whether it slides, its axis and its column.
        self._steps: list[tuple[Pose, bool, Vector, int]] = []
        way: Pose = (ORIGIN, UPRIGHT)
        for index in reversed(above):
            joint = body.joints[index]
            way = compose(way, joint.parent_from_joint)
            if index in numbers:
                self._steps.append((way, joint.kind == constants.JOINT_PRISMATIC, joint.axis, numbers[index]))
                way = (ORIGIN, UPRIGHT)
        # Orientations of inertial frames.
        name = body.link_name(link) or ""
        self._end = compose(way, (ORIGIN, body.frame(name)[1]))
        self.compiled = embedded_link.chain([((*way[0], *way[1]), *rest) for way, *rest in self._steps], (*self._end[0], *self._end[1]))

    def at(self, root: Pose, q: Sequence[float]) -> tuple[Pose, list[int], list[list[float]]]:
        """Returns the end's pose, and columns of its Jacobian with their numbers: three linear rows and three
        angular ones."""
        pose = root
        axes: list[tuple[bool, Vector, Vector, int]] = []
        for way, slides, axis, column in self._steps:
            (x, y, z), turn = compose(pose, way)
            a, b, c = along = rotate(turn, axis)
            axes.append((slides, along, (x, y, z), column))
            value = q[column]
            if slides:
                pose = (x + a * value, y + b * value, z + c * value), turn
            else:
                sine = math.sin(value / 2.0)
                by = (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(value / 2.0))
                pose = (x, y, z), product(turn, by)
        (x, y, z), turn = compose(pose, self._end)
        columns: list[list[float]] = []
        for slides, along, (u, v, w), _ in axes:
            columns.append([*along, 0.0, 0.0, 0.0] if slides else [*cross(along, (x - u, y - v, z - w)), *along])
        return ((x, y, z), turn), [column for _, _, _, column in axes], columns


def turning(body: Body) -> list[int]:
    """Numbers of the joints that rotate about one axis or slide along one: PyBullet's degrees of freedom."""
    return [index for index, joint in enumerate(body.joints) if joint.width == 1]


def search(
    chain: Chain,
    root: Pose,
    start: Sequence[float],
    damping: Array,
    place: Vector,
    turn: Quaternion | None,
    null_space: NullSpace | None,
    bounds: tuple[Array, Array] | None,
    most: int,
    threshold: float,
) -> Array:
    """Returns joint positions after at most `most` steps, or after the first within `threshold` metres of the
    target. With bounds each step ends at them."""
    if chain.compiled is not None:
        freedom = None if null_space is None else null_space.lists()
        limits = None if bounds is None else [each.tolist() for each in bounds]
        joints = [*start], damping.tolist()
        found = chain.compiled.search((*root[0], *root[1]), joints, (place, turn), (freedom, limits), (most, threshold))
        if found is not None:
            return np.array(found)
    q = np.array(start, dtype=np.float64)
    rows = 3 if turn is None else 6
    jacobian = np.zeros((rows, len(q)))
    for _ in range(most):
        (at, turned), numbers, columns = chain.at(root, q.tolist())
        off = [place[0] - at[0], place[1] - at[1], place[2] - at[2]]
        left = math.hypot(*off)
        if turn is not None:
            off += _rotation(product(_signed(turn), conjugate(_signed(turned))))
        if numbers:
            jacobian[:, numbers] = np.array(columns).T[:rows]
        if null_space is None:
            matrix = jacobian.T @ jacobian
            matrix[np.diag_indices_from(matrix)] += damping
            step = np.linalg.solve(matrix, jacobian.T @ off)
        else:
            matrix = jacobian @ jacobian.T
            matrix[np.diag_indices_from(matrix)] += _NULL_SPACE_DAMPING
            wish = null_space.wish(q)
            held = jacobian @ wish
            if _SINGULAR * matrix.trace() < _NULL_SPACE_DAMPING:
                step = wish + jacobian.T @ np.linalg.solve(matrix, off - held)
            else:
                free = np.linalg.pinv(matrix, _SINGULAR, hermitian=True) @ held
                step = wish + jacobian.T @ (np.linalg.solve(matrix, off) - free)
        largest = float(np.abs(step).max(initial=0.0))
        q += step * (_LARGEST / largest) if largest > _LARGEST else step
        if bounds is not None:
            q = np.clip(q, *bounds)
        if not left > threshold:
            break
    return q


def _rotation(q: Quaternion) -> list[float]:
    """Returns axis times angle, the shorter way."""
    x, y, z, w = q
    sine = math.sqrt(x * x + y * y + z * z)
    angle = 2.0 * math.atan2(sine, w)
    if angle > _HALF_TURN:
        angle -= 2.0 * math.pi
    by = angle / sine if sine > 0.0 else 2.0
    return [x * by, y * by, z * by]


def _signed(q: Quaternion) -> Quaternion:
    """Returns a quaternion with Bullet's sign for a matrix. The sign decides the direction of half a turn."""
    leading = q[3] if abs(q[3]) > 0.5 else max(q[:3], key=abs)
    return q if leading >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
