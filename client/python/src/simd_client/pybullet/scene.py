"""Shapes of robots from the daemon: visuals, collision shapes, and their bounding boxes."""

from __future__ import annotations

from typing import Any

from simd_client.proto import (
    BoxGeometry,
    FindOverlapsRequest,
    GetLinkBoundsRequest,
    GetSceneRequest,
    QueryShape,
    Shape,
    Vector3,
    methods,
)
from simd_client.proto import Pose as WirePose

from . import constants
from .arguments import Pose, Vector, vector
from .bodies import Body
from .connections import connected
from .errors import error
from .kinematics import link_pose
from .rotations import compose, inverse
from .world import World

_WHITE = (1.0, 1.0, 1.0, 1.0)
# PyBullet's box around a plane.
_ENDLESS = 1e30
# Minimum size of a queried box, metres.
_THINNEST = 1e-9
# Bullet's number for a shape without one.
_UNKNOWN = 10
# With this flag a shape also has the number of its texture.
_TEXTURES = constants.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS


def getVisualShapeData(objectUniqueId: int, flags: int = 0, physicsClientId: int = 0) -> tuple[tuple[Any, ...], ...]:
    """Returns the visuals of a body: body, link, kind, sizes, file, position and rotation in the link's
    frame, colour."""
    world = connected(physicsClientId)
    body = world.bodies.get(objectUniqueId)
    if body is None:
        return ()
    rows: list[tuple[Any, ...]] = []
    texture = (-1,) if flags & _TEXTURES else ()
    numbers = _numbers(body)
    for shape in sorted(_scene(world, body).visuals, key=lambda shape: numbers[shape.link]):
        kind, size, file = _geometry(body, shape, drawn=True)
        c, link = shape.color, numbers[shape.link]
        color = (c.red, c.green, c.blue, c.alpha) if shape.HasField("color") else _WHITE
        color = body.colors.get(link, color)
        rows.append((objectUniqueId, link, kind, size, file, *_pose(shape), color, *texture))
    return tuple(rows)


def getCollisionShapeData(
    objectUniqueId: int, linkIndex: int, physicsClientId: int = 0
) -> tuple[tuple[Any, ...], ...]:
    """Returns the collision shapes of a link: body, link, kind, sizes, file, position and rotation in the
    frame of the link's inertia."""
    world = connected(physicsClientId)
    refusal = "Error receiving collision shape info"
    body = world.body(objectUniqueId, refusal)
    name = body.link_name(linkIndex)
    if name is None:
        raise error(refusal)
    center = inverse(body.frame(name))
    rows: list[tuple[Any, ...]] = []
    for shape in _shapes(world, body, name):
        kind, size, file = _geometry(body, shape, drawn=False)
        rows.append((objectUniqueId, linkIndex, kind, size, file, *compose(center, _pose(shape))))
    return tuple(rows)


def getAABB(bodyUniqueId: int, linkIndex: int = -1, physicsClientId: int = 0) -> tuple[Vector, Vector]:
    """Returns the corners of the box along the world's axes around a link's collision shapes."""
    world = connected(physicsClientId)
    refusal = "getAABB failed."
    body = world.body(bodyUniqueId, refusal)
    name = body.link_name(linkIndex)
    if name is None:
        raise error(refusal)
    for each in world.wire.call(methods.GetLinkBounds, GetLinkBoundsRequest(robots=[body.robot])).links:
        if each.link == name:
            least, most = each.lower, each.upper
            return (least.x, least.y, least.z), (most.x, most.y, most.z)
    if any(shape.WhichOneof("geometry") == "plane" for shape in _shapes(world, body, name)):
        return (-_ENDLESS, -_ENDLESS, -_ENDLESS), (_ENDLESS, _ENDLESS, _ENDLESS)
    # As in PyBullet, a point, also for a missing mesh file.
    place, _ = compose(link_pose(body, world.link_poses(body), name), body.frame(name))
    return place, place


def getOverlappingObjects(
    aabbMin: Any, aabbMax: Any, physicsClientId: int = 0
) -> tuple[tuple[int, int], ...] | None:
    """Returns body and link of all whose boxes meet a box; `None` for none."""
    world = connected(physicsClientId)
    lower = vector(aabbMin, "aabbMin needs 3 numbers")
    upper = vector(aabbMax, "aabbMax needs 3 numbers")
    if any(b < a for a, b in zip(lower, upper, strict=True)):
        return None
    middle = [(a + b) / 2.0 for a, b in zip(lower, upper, strict=True)]
    # The daemon refuses a box without a volume.
    size = [max(b - a, _THINNEST) for a, b in zip(lower, upper, strict=True)]
    request = FindOverlapsRequest(
        shape=QueryShape(box=BoxGeometry(size=Vector3(x=size[0], y=size[1], z=size[2]))),
        pose=WirePose(position=Vector3(x=middle[0], y=middle[1], z=middle[2])),
        bounds_only=True,
    )
    numbers = world.numbers()
    named = ((link.robot, link.link) for link in world.wire.call(methods.FindOverlaps, request).links)
    return tuple(sorted(numbers[name] for name in named if name in numbers)) or None


def _scene(world: World, body: Body) -> Any:
    """Returns the scene of a robot, which changes only with its layout."""
    kept = world.scenes.get(body.robot)
    if kept is None or kept.layout_version != body.layout_version:
        answer = world.wire.call(methods.GetScene, GetSceneRequest(robots=[body.robot]))
        if not answer.robots:
            raise error(f"the robot {body.robot} is gone")
        kept = world.scenes[body.robot] = answer.robots[0]
    return kept


def _numbers(body: Body) -> dict[int, int]:
    """Returns PyBullet's link number by the daemon's index of the link."""
    numbers = {body.link_indices[body.base_link]: -1} if body.base_link else {}
    return {**numbers, **{body.link_indices[joint.link]: number for number, joint in enumerate(body.joints)}}


def _shapes(world: World, body: Body, link: str) -> list[Shape]:
    index = body.link_indices[link]
    return [shape for shape in _scene(world, body).collisions if shape.link == index]


def _pose(shape: Shape) -> Pose:
    at, turn = shape.pose.position, shape.pose.orientation
    return (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)


def _geometry(body: Body, shape: Shape, drawn: bool) -> tuple[int, Vector, bytes]:
    """Returns kind, sizes and file in PyBullet's form."""
    kind = shape.WhichOneof("geometry")
    if kind == "box":
        size = shape.box.size
        return constants.GEOM_BOX, (size.x, size.y, size.z), b""
    if kind == "sphere":
        radius = shape.sphere.radius
        return constants.GEOM_SPHERE, (radius, 0.0, 0.0) if drawn else (radius, radius, radius), b""
    if kind in ("cylinder", "capsule"):
        round_one = shape.cylinder if kind == "cylinder" else shape.capsule
        number = constants.GEOM_CYLINDER if kind == "cylinder" else constants.GEOM_CAPSULE
        return number, (round_one.length, round_one.radius, 0.0), b""
    if kind == "cone":
        return _UNKNOWN, (shape.cone.length, shape.cone.radius, 0.0), b""
    if kind == "plane":
        n = shape.plane.normal
        return constants.GEOM_PLANE, (0.0, 0.0, 0.0) if drawn else (n.x, n.y, n.z), b""
    scale = shape.mesh.scale
    file = body.paths.get(shape.mesh.uri, shape.mesh.uri)
    return constants.GEOM_MESH, (scale.x, scale.y, scale.z), file.encode()


__all__ = ["getAABB", "getCollisionShapeData", "getOverlappingObjects", "getVisualShapeData"]
