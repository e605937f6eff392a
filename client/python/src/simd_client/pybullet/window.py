"""What PyBullet's window shows, for scripts that run without one: a camera that is kept, and pictures that are empty."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .arguments import Vector, vector
from .cameras import computeViewMatrixFromYawPitchRoll
from .connections import connected
from .errors import error
from .kept import Camera
from .rotations import cross, from_euler, rotate

# Of PyBullet's window: pixels, and the distances of its frustum, metres.
_WIDTH, _HEIGHT = 1024, 768
_NEAR, _FAR = 0.01, 1000.0
# How far the rays through the window's edges reach.
_REACH = 10000.0
_MOST_PIXELS = 1 << 26


def resetDebugVisualizerCamera(
    cameraDistance: float,
    cameraYaw: float,
    cameraPitch: float,
    cameraTargetPosition: Any,
    physicsClientId: int = 0,
) -> None:
    """Sets what getDebugVisualizerCamera returns. The daemon's page has a camera of its own, which stays."""
    target = vector(cameraTargetPosition, "cameraTargetPosition needs 3 numbers")
    kept = Camera(float(cameraDistance), float(cameraYaw), float(cameraPitch), target)
    connected(physicsClientId).camera = kept


def getDebugVisualizerCamera(physicsClientId: int = 0) -> tuple[Any, ...]:
    """Width and height, view and projection matrix, up and forward, the rays along the window's sides, yaw, pitch,
    distance and target: those of a window that was just opened, or of resetDebugVisualizerCamera."""
    camera = connected(physicsClientId).camera
    yaw, pitch = math.radians(camera.yaw), math.radians(camera.pitch)
    forward = rotate(from_euler(pitch, 0.0, yaw), (0.0, 1.0, 0.0))
    side = _unit(cross(forward, (0.0, 0.0, 1.0)))
    up = _unit(cross(side, forward))
    aspect, depth = _WIDTH / _HEIGHT, _FAR - _NEAR
    projection = (
        *(1.0 / aspect, 0.0, 0.0, 0.0),
        *(0.0, 1.0, 0.0, 0.0),
        *(0.0, 0.0, -(_FAR + _NEAR) / depth, -1.0),
        *(0.0, 0.0, -2.0 * _FAR * _NEAR / depth, 0.0),
    )
    return (
        _WIDTH,
        _HEIGHT,
        computeViewMatrixFromYawPitchRoll(camera.target, camera.distance, camera.yaw, camera.pitch, 0.0, 2),
        projection,
        (0.0, 0.0, 1.0),
        forward,
        _times(side, 2.0 * _REACH * aspect),
        _times(up, 2.0 * _REACH),
        camera.yaw,
        camera.pitch,
        camera.distance,
        camera.target,
    )


def getCameraImage(
    width: int,
    height: int,
    viewMatrix: Any = None,
    projectionMatrix: Any = None,
    lightDirection: Any = None,
    lightColor: Any = None,
    lightDistance: float = -1.0,
    shadow: int = -1,
    lightAmbientCoeff: float = -1.0,
    lightDiffuseCoeff: float = -1.0,
    lightSpecularCoeff: float = -1.0,
    renderer: int = -1,
    flags: int = -1,
    projectiveTextureView: Any = None,
    projectiveTextureProj: Any = None,
    physicsClientId: int = 0,
) -> tuple[int, int, Any, Any, Any]:
    """Width, height, colours, depths and numbers of bodies of a picture in which nothing is."""
    connected(physicsClientId).say_once("getCameraImage: pictures are empty: the daemon draws none")
    columns, rows = int(width), int(height)
    if columns < 1 or rows < 1 or columns * rows > _MOST_PIXELS:
        raise error("getCameraImage: width and height must be above 0")
    colours = np.full((rows, columns, 4), 255, dtype=np.uint8)
    depths = np.ones((rows, columns), dtype=np.float32)
    return columns, rows, colours, depths, np.full((rows, columns), -1, dtype=np.int32)


def renderImage(width: int, height: int, *camera: Any) -> tuple[int, int, Any, Any, Any]:
    """The old form of getCameraImage."""
    del camera
    return getCameraImage(width, height)


def _unit(v: Vector) -> Vector:
    length = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    return (1.0, 0.0, 0.0) if length == 0.0 else _times(v, 1.0 / length)


def _times(v: Vector, factor: float) -> Vector:
    return (v[0] * factor, v[1] * factor, v[2] * factor)


__all__ = ["getCameraImage", "getDebugVisualizerCamera", "renderImage", "resetDebugVisualizerCamera"]
