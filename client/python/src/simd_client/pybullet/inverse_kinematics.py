"""Joint positions at which a link of a robot is at a pose, which the daemon finds, or several are at places."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simd_client.proto import ComputeInverseKinematicsRequest, methods

from . import beyond, constants
from .arguments import ORIGIN, UPRIGHT, Pose, Vector, floats, formerly, indices, quaternion, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .rotations import compose, cross, rotate
from .world import World

Array = NDArray[np.float64]

_MOST_ITERATIONS = 1000
# Levenberg and Marquardt's damping: where it starts, how it changes after a step that was good or bad, and where it is given up.
_DAMPING, _BETTER, _WORSE, _MOST_DAMPING = 1e-3, 0.3, 4.0, 1e6


@formerly("bodyIndex", "bodyUniqueId")
def calculateInverseKinematics(
    bodyUniqueId: int,
    endEffectorLinkIndex: int,
    targetPosition: Any,
    targetOrientation: Any = None,
    lowerLimits: Any = None,
    upperLimits: Any = None,
    jointRanges: Any = None,
    restPoses: Any = None,
    jointDamping: Any = None,
    solver: int = 0,
    currentPositions: Any = None,
    maxNumIterations: int = 100,
    residualThreshold: float = 1e-4,
    physicsClientId: int = 0,
) -> tuple[float, ...]:
    """Joint positions, one per degree of freedom, at which a link's frame is at a world pose. The
    robot's own limits bound them, and those that are given, if there are as many; rest poses are where the search starts, if there are
    as many."""
    del solver, jointRanges, jointDamping
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateInverseKinematics failed.")
    link = body.link_name(endEffectorLinkIndex)
    if link is None:
        raise error("Error: endEffectorLinkIndex out-of-range.")
    text = "calculateInverseKinematics: positions must be sequences of numbers"
    request = ComputeInverseKinematicsRequest(robot=body.robot, link=link)
    at = request.target.position
    at.x, at.y, at.z = vector(targetPosition, text)
    if targetOrientation is not None and len(targetOrientation):
        turn = request.target.orientation
        turn.x, turn.y, turn.z, turn.w = quaternion(targetOrientation, text)
    request.max_iterations = _iterations(maxNumIterations)
    request.tolerance = float(residualThreshold)
    start = _start(currentPositions, restPoses, sum(joint.count for joint in body.joints), text)
    if start:
        # An empty guess is one of no joints.
        request.guess.positions.extend(_as_the_daemon_counts(body, start))
    found = world.wire.call(methods.ComputeInverseKinematics, request).positions
    narrow = _narrower(body, lowerLimits, upperLimits)
    if any(not low <= found[body.joints[index].position_index] <= high for index, (low, high) in narrow.items()):
        try:
            for index, (low, high) in narrow.items():
                joint = body.joints[index]
                world.bound(body, joint, (low, high, *joint.limits[2:]))
            found = world.wire.call(methods.ComputeInverseKinematics, request).positions
        finally:
            for index in narrow:
                beyond.send(world, body, index)
    return tuple(q for joint in body.joints for q in found[joint.position_index : joint.position_index + joint.count])


@formerly("bodyIndex", "bodyUniqueId")
def calculateInverseKinematics2(
    bodyUniqueId: int,
    endEffectorLinkIndices: Any,
    targetPositions: Any,
    lowerLimits: Any = None,
    upperLimits: Any = None,
    jointRanges: Any = None,
    restPoses: Any = None,
    jointDamping: Any = None,
    solver: int = 0,
    currentPositions: Any = None,
    maxNumIterations: int = 100,
    residualThreshold: float = 1e-4,
    physicsClientId: int = 0,
) -> tuple[float, ...]:
    """Joint positions, one per degree of freedom, at which the origins of these links' frames are at these world places, or as
    near to them as can be: damped least squares within the robot's own limits. Rest poses are where the search starts, if there
    are as many."""
    del solver, jointRanges, jointDamping, lowerLimits, upperLimits
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateInverseKinematics failed.")
    links = indices(endEffectorLinkIndices, "calculateInverseKinematics2: endEffectorLinkIndices must be numbers of links")
    goals = [vector(each, "calculateInverseKinematics2: a target position has 3 numbers") for each in targetPositions]
    if not links or len(links) != len(goals):
        raise error(f"calculateInverseKinematics2: {len(goals)} target positions for {len(links)} links")
    if any(not 0 <= link < len(body.joints) for link in links):
        raise error("Error: endEffectorLinkIndex out-of-range.")
    if any(joint.width > 1 for joint in body.joints):
        raise unsupported("calculateInverseKinematics2", "joints must turn about one axis or slide along one")
    states = world.joint_states(body)
    moving = [index for index, joint in enumerate(body.joints) if joint.width == 1]
    q = np.array([states.position[body.joints[index].position_index] for index in moving])
    text = "calculateInverseKinematics2: positions must be sequences of numbers"
    given = _start(currentPositions, restPoses, len(moving), text)
    if given:
        if len(given) != len(moving):
            raise error(f"calculateInverseKinematics2: {len(given)} joint positions for {len(moving)} degrees of freedom")
        # What follows another joint stays where it is.
        q = np.where([body.joints[index].driven for index in moving], given, q)
    chains = _Chains(world, body, moving, links)
    found = _solve(chains, q, np.array(goals), _iterations(maxNumIterations), float(residualThreshold))
    return tuple(found.tolist())


def _as_the_daemon_counts(body: Body, given: list[float]) -> list[float]:
    """Joint positions that follow the order of the script's joints."""
    if len(given) != sum(joint.count for joint in body.joints):
        # The daemon says how many there should be.
        return given
    placed, at = [0.0] * len(given), 0
    for joint in body.joints:
        placed[joint.position_index : joint.position_index + joint.count] = given[at : at + joint.count]
        at += joint.count
    return placed


def _narrower(body: Body, lower: Any, upper: Any) -> dict[int, tuple[float, float]]:
    """Limits of a call that are narrower than a joint's own, by its index; none where there are not as many as degrees of freedom."""
    moving = [index for index, joint in enumerate(body.joints) if joint.width == 1]
    if lower is None or upper is None or not len(lower) == len(upper) == len(moving):
        return {}
    text, found = "calculateInverseKinematics: limits must be sequences of numbers", dict[int, tuple[float, float]]()
    for index, low, high in zip(moving, floats(lower, text), floats(upper, text), strict=True):
        least, most = body.joints[index].limits[:2]
        low, high = (low if least is None else max(low, least)), (high if most is None else min(high, most))
        if low < high and (low, high) != (least, most):
            found[index] = low, high
    return found


def _start(current: Any, rest: Any, count: int, text: str) -> list[float]:
    """Where the search of so many positions starts; empty for where the robot is. As in PyBullet, rest poses of another number are
    not read."""
    if current is not None and len(current):
        return floats(current, text)
    return floats(rest, text) if rest is not None and len(rest) == count else []


def _iterations(given: int) -> int:
    return max(1, min(int(given), _MOST_ITERATIONS))


class _Chains:
    """Where the origins of some links are, and how they move with the joints."""

    def __init__(self, world: World, body: Body, moving: list[int], links: list[int]) -> None:
        self._body = body
        self._moving = moving
        self._links = links
        self._root = world.root(body)[0]
        limits = [body.joints[index].limits for index in moving]
        self.lower = np.array([-np.inf if low is None else low for low, _, _, _ in limits])
        self.upper = np.array([np.inf if high is None else high for _, high, _, _ in limits])

    def at(self, q: Array) -> tuple[Array, Array]:
        """Positions, a row each, and three rows of the Jacobian for each."""
        body = self._body
        values = dict(zip(self._moving, q.tolist(), strict=True))
        frames: dict[int, Pose] = {}
        for index in body.from_base():
            joint = body.joints[index]
            parent = joint.info[16]
            frame = compose(self._root if parent < 0 else frames[parent], joint.parent_from_joint)
            frames[index] = compose(frame, _moved(joint.kind, joint.axis, values.get(index, 0.0)))
        positions, rows = np.zeros((len(self._links), 3)), np.zeros((3 * len(self._links), len(q)))
        for row, link in enumerate(self._links):
            positions[row] = frames[link][0]
            above = link
            while above >= 0:
                joint = body.joints[above]
                if above in values and joint.driven:
                    (x, y, z), turn = frames[above]
                    axis = rotate(turn, joint.axis)
                    a, b, c = positions[row].tolist()
                    column = self._moving.index(above)
                    slides = joint.kind == constants.JOINT_PRISMATIC
                    rows[3 * row : 3 * row + 3, column] = axis if slides else cross(axis, (a - x, b - y, c - z))
                above = joint.info[16]
        return positions, rows


def _moved(kind: int, axis: Vector, value: float) -> Pose:
    """joint_from_child at a position."""
    if kind == constants.JOINT_PRISMATIC:
        return (axis[0] * value, axis[1] * value, axis[2] * value), UPRIGHT
    if kind != constants.JOINT_REVOLUTE:
        return ORIGIN, UPRIGHT
    sine = math.sin(value / 2.0)
    return ORIGIN, (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(value / 2.0))


def _solve(chains: _Chains, q: Array, goals: Array, most: int, threshold: float) -> Array:
    """Levenberg and Marquardt's method, with each step cut off at the limits."""
    q = np.clip(q, chains.lower, chains.upper)
    positions, rows = chains.at(q)
    off = (goals - positions).reshape(-1)
    damping = _DAMPING
    for _ in range(most):
        if np.linalg.norm(off.reshape(-1, 3), axis=1).max() <= threshold or damping > _MOST_DAMPING:
            break
        step = rows.T @ np.linalg.solve(rows @ rows.T + damping * np.eye(len(off)), off)
        tried = np.clip(q + step, chains.lower, chains.upper)
        positions, next_rows = chains.at(tried)
        left = (goals - positions).reshape(-1)
        if left @ left < off @ off:
            q, rows, off, damping = tried, next_rows, left, max(damping * _BETTER, 1e-9)
        else:
            damping *= _WORSE
    return q


__all__ = ["calculateInverseKinematics", "calculateInverseKinematics2"]
