"""PyBullet's pictures: colours, depth buffer and segmentation, in the form of its TinyRenderer. A renderer
draws them. The first picture starts `simd-camera` if there is none. Without one they are empty."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from simd_client import picture
from simd_client.proto import PicturePlanes, TakePictureRequest, TakePictureResponse, methods

from .arguments import vector
from .connections import connected
from .constants import ER_NO_SEGMENTATION_MASK, ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX
from .errors import error
from .window import shown_matrices
from .world import World

# Maximum size of a picture's side.
_MAX_PIXELS = 4096
# Direction towards PyBullet's default light.
_LIGHT = (-50.0, 30.0, 100.0)
# Maximum wall seconds for a picture.
_TIMEOUT = 60.0
# Maximum number of tries: a renderer may go between its start and the picture.
_TRIES = 3

_Picture = tuple[int, int, Any, Any, Any]


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
) -> _Picture:
    """Returns width, height, colours (rows, columns, 4), the depth buffer from 0 to 1, and for each pixel the
    number of the body, or -1. Without matrices it uses the camera of the page. The requested renderer and
    projected textures have no effect."""
    del lightDistance, renderer, projectiveTextureView, projectiveTextureProj
    world = connected(physicsClientId)
    columns, rows = int(width), int(height)
    if not (1 <= columns <= _MAX_PIXELS and 1 <= rows <= _MAX_PIXELS):
        raise error(f"getCameraImage: width and height must be above 0, and at most {_MAX_PIXELS}")
    view, projection = shown_matrices(world, columns / rows)
    light = picture.PictureLight(
        direction=_LIGHT if lightDirection is None else vector(lightDirection, "lightDirection needs 3 numbers"),
        color=(1.0, 1.0, 1.0) if lightColor is None else vector(lightColor, "lightColor needs 3 numbers"),
        ambient=_part(lightAmbientCoeff, 0.6),
        diffuse=_part(lightDiffuseCoeff, 0.35),
        specular=_part(lightSpecularCoeff, 0.05),
        shadow=shadow > 0,
    )
    asked = max(int(flags), 0)
    segmented = not asked & ER_NO_SEGMENTATION_MASK
    request = TakePictureRequest(
        view=_matrix(viewMatrix, view, "viewMatrix"),
        projection=_matrix(projectionMatrix, projection, "projectionMatrix"),
        width=columns,
        height=rows,
        planes=PicturePlanes(color=True, depth=True, segmentation=segmented),
        light=picture.light_to_proto(light),
        timeout=_TIMEOUT,
    )
    answer = _taken(world, request)
    if answer is None:
        return _empty(columns, rows)
    seen = picture.picture_from_proto(answer.picture)
    if seen.color is None or seen.depth is None:
        raise error("getCameraImage: the picture lacks colours or depths")
    colours = np.full((rows, columns, 4), 255, dtype=np.uint8)
    colours[:, :, :3] = seen.color
    bodies = _bodies(world, seen, bool(asked & ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX))
    return columns, rows, colours, depth_buffer(seen.depth, seen.projection), bodies


def _taken(world: World, request: TakePictureRequest) -> TakePictureResponse | None:
    """Returns the picture, or `None` without a renderer that can be started, and for matrices of no camera,
    which PyBullet accepts."""
    reason: str | None = ""
    for _ in range(_TRIES):
        try:
            return world.wire.call(methods.TakePicture, request)
        except error as refusal:
            if refusal.reason == "INVALID_VALUE":
                world.say_once(f"getCameraImage: a picture is empty: {refusal}")
                return None
            if refusal.reason != "NO_RENDERER":
                raise
        reason = world.renderer.start()
        if reason is not None:
            break
    world.say_once(f"getCameraImage: pictures are empty: {reason or 'renderers come and go'}")
    return None


def renderImage(width: int, height: int, *camera: Any) -> _Picture:
    """Old form of getCameraImage."""
    del camera
    return getCameraImage(width, height)


def depth_buffer(metres: npt.NDArray[np.float32], projection: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Returns OpenGL's depth buffer for depths along the optical axis: 0 at the near plane, 1 at the far one
    and without a hit."""
    with np.errstate(invalid="ignore", divide="ignore"):
        along = -metres.astype(np.float64)
        clip = projection[2, 2] * along + projection[2, 3]
        weight = projection[3, 2] * along + projection[3, 3]
        buffer = 0.5 * clip / weight + 0.5
    return np.where(np.isfinite(metres), np.clip(buffer, 0.0, 1.0), 1.0).astype(np.float32)


def _bodies(world: World, seen: picture.CameraPicture, with_links: bool) -> npt.NDArray[np.int32]:
    """Returns PyBullet's number of the body in each pixel; with links it adds 2^24 times the link's number
    plus one."""
    if seen.segmentation is None:
        return np.full((seen.height, seen.width), -1, dtype=np.int32)
    count = max((robot.first_link + robot.links for robot in seen.robots), default=1)
    # PyBullet's numbers by the daemon's number of a link.
    table = np.full(count, -1, dtype=np.int32)
    bodies = {body.robot: body for body in world.bodies.values()}
    numbers = world.numbers()
    for robot in seen.robots:
        body = bodies.get(robot.robot)
        if body is None:
            # Another client spawned it since: syncBodyInfo adds it.
            continue
        for link, link_index in body.link_indices.items():
            found = numbers.get((robot.robot, link))
            if found is not None and link_index < robot.links:
                unique_id, index = found
                table[robot.first_link + link_index] = unique_id + ((index + 1) << 24 if with_links else 0)
    # A number of no link means nothing.
    known = np.where(seen.segmentation < count, seen.segmentation, 0)
    return table[known]


def _empty(columns: int, rows: int) -> _Picture:
    colours = np.full((rows, columns, 4), 255, dtype=np.uint8)
    depths = np.ones((rows, columns), dtype=np.float32)
    return columns, rows, colours, depths, np.full((rows, columns), -1, dtype=np.int32)


def _matrix(given: Any, usual: Any, name: str) -> list[float]:
    """Returns sixteen numbers, column by column; like PyBullet it ignores an invalid matrix."""
    numbers = usual if given is None or len(given) == 0 else given
    if len(numbers) != 16:
        raise error(f"getCameraImage: {name} needs 16 numbers")
    return [float(number) for number in numbers]


def _part(given: float, usual: float) -> float:
    return min(float(given), 1.0) if given >= 0.0 else usual


__all__ = ["getCameraImage", "renderImage"]
