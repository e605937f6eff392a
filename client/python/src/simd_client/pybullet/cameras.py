"""PyBullet's pure functions that make view and projection matrices.

Sixteen numbers, column by column, as OpenGL takes them. They use the formulas of OpenGL's gluLookAt,
glFrustum and gluPerspective, in double precision; PyBullet uses single.
"""

from __future__ import annotations

import math
from typing import Any

from .arguments import Vector, vector
from .errors import error
from .rotations import cross, from_euler, rotate

ViewMatrix = tuple[float, ...]


def computeViewMatrix(
    cameraEyePosition: Any, cameraTargetPosition: Any, cameraUpVector: Any, physicsClientId: int = 0
) -> ViewMatrix:
    """Returns the view matrix of a camera at one position that looks at another."""
    del physicsClientId
    text = "Error in computeViewMatrix."
    eye, target = vector(cameraEyePosition, text), vector(cameraTargetPosition, text)
    return _look_at(eye, target, vector(cameraUpVector, text))


def computeViewMatrixFromYawPitchRoll(
    cameraTargetPosition: Any,
    distance: float,
    yaw: float,
    pitch: float,
    roll: float,
    upAxisIndex: int,
    physicsClientId: int = 0,
) -> ViewMatrix:
    """Returns the view matrix of a camera at a distance from its target; angles in degrees."""
    del physicsClientId
    target = vector(cameraTargetPosition, "Error in computeViewMatrixFromYawPitchRoll.")
    yaw, pitch, roll = math.radians(yaw), math.radians(pitch), math.radians(roll)
    if upAxisIndex == 1:
        turn, back, up = from_euler(-pitch, yaw, roll), (0.0, 0.0, -distance), (0.0, 1.0, 0.0)
    elif upAxisIndex == 2:
        turn, back, up = from_euler(pitch, roll, yaw), (0.0, -distance, 0.0), (0.0, 0.0, 1.0)
    else:
        raise error("upAxisIndex must be 1 (y is up) or 2 (z is up).")
    x, y, z = rotate(turn, back)
    eye = (x + target[0], y + target[1], z + target[2])
    return _look_at(eye, target, rotate(turn, up))


def computeProjectionMatrix(
    left: float,
    right: float,
    bottom: float,
    top: float,
    nearVal: float,
    farVal: float,
    physicsClientId: int = 0,
) -> ViewMatrix:
    """Returns the projection matrix of a frustum given by its sides at the near plane."""
    del physicsClientId
    width, height, depth = right - left, top - bottom, farVal - nearVal
    return (
        *(2.0 * nearVal / width, 0.0, 0.0, 0.0),
        *(0.0, 2.0 * nearVal / height, 0.0, 0.0),
        *((right + left) / width, (top + bottom) / height, -(farVal + nearVal) / depth, -1.0),
        *(0.0, 0.0, -2.0 * farVal * nearVal / depth, 0.0),
    )


def computeProjectionMatrixFOV(
    fov: float, aspect: float, nearVal: float, farVal: float, physicsClientId: int = 0
) -> ViewMatrix:
    """Returns the projection matrix for a vertical field of view in degrees."""
    del physicsClientId
    scale, depth = 1.0 / math.tan(math.radians(fov) / 2), nearVal - farVal
    return (
        *(scale / aspect, 0.0, 0.0, 0.0),
        *(0.0, scale, 0.0, 0.0),
        *(0.0, 0.0, (nearVal + farVal) / depth, -1.0),
        *(0.0, 0.0, 2.0 * farVal * nearVal / depth, 0.0),
    )


def _look_at(eye: Vector, target: Vector, up: Vector) -> ViewMatrix:
    f = _unit((target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]))
    s = _unit(cross(f, _unit(up)))
    u = cross(s, f)
    columns = [(s[i], u[i], -f[i], 0.0) for i in range(3)]
    return (*columns[0], *columns[1], *columns[2], -_dot(s, eye), -_dot(u, eye), _dot(f, eye), 1.0)


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _unit(v: Vector) -> Vector:
    length = math.sqrt(_dot(v, v))
    if length == 0.0:
        raise error("A camera needs an eye that is not at its target, and an up vector across its view.")
    return (v[0] / length, v[1] / length, v[2] / length)


__all__ = [
    "computeProjectionMatrix",
    "computeProjectionMatrixFOV",
    "computeViewMatrix",
    "computeViewMatrixFromYawPitchRoll",
]
