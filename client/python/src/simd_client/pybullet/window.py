"""Camera of PyBullet's window, which is the camera of the daemon's page if one is open."""

from __future__ import annotations

import math
import time
from typing import Any

from simd_client.proto import GetCamerasRequest, SetCameraRequest, ViewCamera, methods

from .arguments import ORIGIN, Vector, vector_or
from .cameras import ViewMatrix, computeViewMatrixFromYawPitchRoll
from .connections import connected
from .script_state import Camera
from .rotations import cross, from_euler, rotate
from .world import World

# PyBullet's window: the distances of its frustum, metres, and its vertical field of view, radians.
_NEAR, _FAR = 0.01, 1000.0
_FIELD = math.pi / 2
# Wall seconds between two requests: a loop without pauses asks no more often than a page draws.
_INTERVAL = 0.004
# Length of the rays through the window's edges.
_REACH = 10000.0


def resetDebugVisualizerCamera(
    cameraDistance: float,
    cameraYaw: float,
    cameraPitch: float,
    cameraTargetPosition: Any,
    physicsClientId: int = 0,
) -> None:
    """Moves the camera of the daemon's page, and sets PyBullet's field of view. Without a page it only sets
    the result of getDebugVisualizerCamera."""
    target = vector_or(ORIGIN, cameraTargetPosition, "cameraTargetPosition")
    kept = Camera(float(cameraDistance), float(cameraYaw), float(cameraPitch), target)
    world = connected(physicsClientId)
    position = _eye(kept)
    # A camera at its target sees nothing.
    if position != target:
        request = SetCameraRequest(field_of_view=_FIELD)
        request.position.x, request.position.y, request.position.z = position
        request.target.x, request.target.y, request.target.z = target
        world.camera_version = world.wire.call(methods.SetCamera, request).version
    world.camera = kept
    world.page_camera = None


def getDebugVisualizerCamera(physicsClientId: int = 0) -> tuple[Any, ...]:
    """Returns width and height, view and projection matrix, up and forward, the rays along the window's
    sides, yaw, pitch, distance and target. They belong to the page with the last moved camera. Without a
    page, and until it has followed, they belong to resetDebugVisualizerCamera, or to PyBullet's initial
    window."""
    camera = _shown(connected(physicsClientId))
    forward = _forward(camera)
    side = _unit(cross(forward, (0.0, 0.0, 1.0)))
    up = _unit(cross(side, forward))
    aspect, tangent = camera.width / camera.height, camera.tangent
    view, projection = _matrices(camera, aspect)
    return (
        camera.width,
        camera.height,
        view,
        projection,
        (0.0, 0.0, 1.0),
        forward,
        _times(side, 2.0 * _REACH * aspect * tangent),
        _times(up, 2.0 * _REACH * tangent),
        camera.yaw,
        camera.pitch,
        camera.distance,
        camera.target,
    )


def shown_matrices(world: World, aspect: float) -> tuple[ViewMatrix, ViewMatrix]:
    """Returns view and projection matrix of the camera, for a picture of this width by height."""
    return _matrices(_shown(world), aspect)


def _matrices(camera: Camera, aspect: float) -> tuple[ViewMatrix, ViewMatrix]:
    depth, tangent = _FAR - _NEAR, camera.tangent
    projection = (
        *(1.0 / (aspect * tangent), 0.0, 0.0, 0.0),
        *(0.0, 1.0 / tangent, 0.0, 0.0),
        *(0.0, 0.0, -(_FAR + _NEAR) / depth, -1.0),
        *(0.0, 0.0, -2.0 * _FAR * _NEAR / depth, 0.0),
    )
    view = computeViewMatrixFromYawPitchRoll(camera.target, camera.distance, camera.yaw, camera.pitch, 0.0, 2)
    return view, projection


def _shown(world: World) -> Camera:
    """Returns the camera of the page that has followed the script and moved last, else the stored one."""
    asked, now = world.page_camera, time.monotonic()
    if asked is None or now - asked[0] >= _INTERVAL:
        asked = world.page_camera = (now, _ask(world))
    return asked[1] or world.camera


def _ask(world: World) -> Camera | None:
    for page in world.wire.call(methods.GetCameras, GetCamerasRequest()).cameras:
        if page.followed_version >= world.camera_version:
            return _of_page(page.camera)
    return None


def _of_page(camera: ViewCamera) -> Camera:
    """Describes a camera like PyBullet: by angles and a distance from its target."""
    target = (camera.target.x, camera.target.y, camera.target.z)
    away = (target[0] - camera.position.x, target[1] - camera.position.y, target[2] - camera.position.z)
    distance = math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
    rise = max(-1.0, min(1.0, away[2] / distance)) if distance > 0.0 else 0.0
    return Camera(
        distance=distance,
        yaw=math.degrees(math.atan2(-away[0], away[1])),
        pitch=math.degrees(math.asin(rise)),
        target=target,
        width=camera.width,
        height=camera.height,
        tangent=math.tan(camera.field_of_view / 2),
    )


def _forward(camera: Camera) -> Vector:
    turn = from_euler(math.radians(camera.pitch), 0.0, math.radians(camera.yaw))
    return rotate(turn, (0.0, 1.0, 0.0))


def _eye(camera: Camera) -> Vector:
    back = _times(_forward(camera), -camera.distance)
    x, y, z = camera.target
    return (x + back[0], y + back[1], z + back[2])


def _unit(v: Vector) -> Vector:
    length = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    return (1.0, 0.0, 0.0) if length == 0.0 else _times(v, 1.0 / length)


def _times(v: Vector, factor: float) -> Vector:
    return (v[0] * factor, v[1] * factor, v[2] * factor)


__all__ = ["getDebugVisualizerCamera", "resetDebugVisualizerCamera"]
