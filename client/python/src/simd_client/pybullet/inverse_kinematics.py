"""Joint positions that bring a link of a robot to a pose, as PyBullet finds them, or several links to
positions."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simd_client.proto import ComputeInverseKinematicsRequest, methods

from . import constants, damped_steps
from .arguments import ORIGIN, UPRIGHT, Pose, Vector, floats, formerly, indices, numbers, quaternion, vector
from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .rotations import compose, cross, inverse, rotate
from .world import World

Array = NDArray[np.float64]

_MAX_ITERATIONS = 1000
_LEAST_DAMPING = 1e-9
# Minimum iterations of the daemon, whose search ends when it converges.
_DAEMON_ITERATIONS = 100
# Levenberg and Marquardt's damping: initial value, factors after good and bad steps, and the value that ends
# the search.
_DAMPING, _BETTER, _WORSE, _MAX_DAMPING = 1e-3, 0.3, 4.0, 1e6


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
    maxNumIterations: int = damped_steps.ITERATIONS,
    residualThreshold: float = damped_steps.THRESHOLD,
    physicsClientId: int = 0,
) -> tuple[float, ...]:
    """Returns joint positions, one per degree of freedom, that bring a link's frame to a world pose, or
    towards it. They result from PyBullet's steps from the current positions. Limits, ranges and rest poses
    count if each has one number per degree of freedom. If the steps leave the given limits, other steps end
    at the limits. Robots with ball joints, and the solver `IK_SDLS`, use the daemon's search."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "calculateInverseKinematics failed.")
    link = body.link_name(endEffectorLinkIndex)
    if link is None:
        raise error("Error: endEffectorLinkIndex out-of-range.")
    text = "calculateInverseKinematics: positions must be sequences of numbers"
    place = vector(targetPosition, text)
    # As in PyBullet, another number of them is not an orientation.
    turn = quaternion(targetOrientation, text) if targetOrientation is not None and len(targetOrientation) == 4 else None
    most = _iterations(maxNumIterations) if maxNumIterations > 0 else damped_steps.ITERATIONS
    if solver == 0 and all(joint.width <= 1 for joint in body.joints):
        search = _search(world, body, endEffectorLinkIndex, currentPositions, jointDamping)
        goal = (place, turn, _null_space(body, text, lowerLimits, upperLimits, jointRanges, restPoses))
        found = search(*goal, None, most, float(residualThreshold))
        limits = _limits(lowerLimits, upperLimits, len(found))
        if limits is not None and not ((limits[0] <= found) & (found <= limits[1])).all():
            found = search(*goal, limits, most, float(residualThreshold))
        return tuple(found.tolist())
    request = ComputeInverseKinematicsRequest(robot=body.robot, link=link)
    at = request.target.position
    at.x, at.y, at.z = place
    if turn is not None:
        to = request.target.orientation
        to.x, to.y, to.z, to.w = turn
    request.max_iterations = max(most, _DAEMON_ITERATIONS)
    request.tolerance = float(residualThreshold)
    start = _start(currentPositions, restPoses, sum(joint.count for joint in body.joints), text)
    if start:
        # An empty guess means no joints.
        request.guess.positions.extend(_as_the_daemon_counts(body, start))
    found = world.wire.call(methods.ComputeInverseKinematics, request).positions
    return tuple(q for joint in body.joints for q in found[joint.position_index : joint.position_index + joint.count])


def _search(world: World, body: Body, link: int, current: Any, damping: Any) -> Callable[..., Array]:
    """Runs PyBullet's search for a pose of a link, from the current or the given positions."""
    numbers = damped_steps.turning(body)
    weights = np.full(len(numbers), damped_steps.DAMPING)
    if damping is not None and len(damping) >= len(numbers):
        text = "calculateInverseKinematics: joint damping must be numbers"
        # Without any damping a single step is undefined.
        weights = np.maximum(floats(damping, text)[: len(numbers)], _LEAST_DAMPING)
    if current is not None and len(current):
        start = floats(current, "calculateInverseKinematics: positions must be sequences of numbers")
        if len(start) != len(numbers):
            raise error(
                "calculateInverseKinematics the size of input current positions needs to be equal to the number of degrees of freedom."
            )
        # As in PyBullet, the pose is then in the frame of the base.
        root = inverse(body.frame(body.base_link))
    else:
        positions = world.joint_states(body).position
        start = [positions[body.joints[index].position_index] for index in numbers]
        root = world.root(body)[0]
    chain = body.chains.get(link)
    if chain is None:
        chain = body.chains[link] = damped_steps.Chain(body, link)
    return partial(damped_steps.search, chain, root, start, weights)


def _limits(lower: Any, upper: Any, count: int) -> tuple[Array, Array] | None:
    """Returns limits of a call, if each has one number per degree of freedom; lower limits that are not below
    the upper ones are ignored."""
    if lower is None or upper is None or not len(lower) == len(upper) == count:
        return None
    text = "calculateInverseKinematics: limits must be sequences of numbers"
    low, high = np.array(numbers(lower, text)), np.array(numbers(upper, text))
    return np.where(low < high, low, -np.inf), np.where(low < high, high, np.inf)


def _null_space(body: Body, text: str, *given: Any) -> damped_steps.NullSpace | None:
    """Returns lower and upper limits, ranges and rest poses, if each has one number per degree of freedom."""
    count = len(damped_steps.turning(body))
    if not count or any(each is None or len(each) != count for each in given):
        return None
    lower, upper, ranges, rest = (np.array(numbers(each, text)) for each in given)
    return damped_steps.NullSpace(lower, upper, np.where(ranges == 0.0, np.inf, ranges), rest)


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
    """Returns joint positions, one per degree of freedom, that bring the origins of these links' frames to
    these world positions, or as near as possible. The method is damped least squares within the robot's own
    limits. The search starts from rest poses, if each degree of freedom has one."""
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
        # Joints that follow another joint stay at their positions.
        q = np.where([body.joints[index].driven for index in moving], given, q)
    chains = _Chains(world, body, moving, links)
    found = _solve(chains, q, np.array(goals), _iterations(maxNumIterations), float(residualThreshold))
    return tuple(found.tolist())


def _as_the_daemon_counts(body: Body, given: list[float]) -> list[float]:
    """Returns joint positions in the order of the script's joints."""
    if len(given) != sum(joint.count for joint in body.joints):
        # The daemon reports the expected number.
        return given
    placed, at = [0.0] * len(given), 0
    for joint in body.joints:
        placed[joint.position_index : joint.position_index + joint.count] = given[at : at + joint.count]
        at += joint.count
    return placed


def _start(current: Any, rest: Any, count: int, text: str) -> list[float]:
    """Returns the start of the search for this many positions; empty for the current positions. As in
    PyBullet, rest poses of another number are ignored."""
    if current is not None and len(current):
        return floats(current, text)
    return floats(rest, text) if rest is not None and len(rest) == count else []


def _iterations(given: int) -> int:
    return max(1, min(int(given), _MAX_ITERATIONS))


class _Chains:
    """Positions of the origins of some links, and their derivatives by the joints."""

    def __init__(self, world: World, body: Body, moving: list[int], links: list[int]) -> None:
        self._body = body
        self._moving = moving
        self._links = links
        self._root = world.root(body)[0]
        limits = [body.joints[index].limits for index in moving]
        self.lower = np.array([-np.inf if low is None else low for low, _, _, _ in limits])
        self.upper = np.array([np.inf if high is None else high for _, high, _, _ in limits])

    def at(self, q: Array) -> tuple[Array, Array]:
        """Returns positions, a row each, and three rows of the Jacobian for each."""
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
    """Returns joint_from_child at a position."""
    if kind == constants.JOINT_PRISMATIC:
        return (axis[0] * value, axis[1] * value, axis[2] * value), UPRIGHT
    if kind != constants.JOINT_REVOLUTE:
        return ORIGIN, UPRIGHT
    sine = math.sin(value / 2.0)
    return ORIGIN, (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(value / 2.0))


def _solve(chains: _Chains, q: Array, goals: Array, most: int, threshold: float) -> Array:
    """Runs Levenberg and Marquardt's method, with each step clamped at the limits."""
    q = np.clip(q, chains.lower, chains.upper)
    positions, rows = chains.at(q)
    off = (goals - positions).reshape(-1)
    damping = _DAMPING
    for _ in range(most):
        if np.linalg.norm(off.reshape(-1, 3), axis=1).max() <= threshold or damping > _MAX_DAMPING:
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
