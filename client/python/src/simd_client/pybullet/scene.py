"""Shapes of robots as the daemon has them: what is drawn, what touches, and the boxes around it."""

from __future__ import annotations

from typing import Any

import numpy as np

from simd_client.proto import GetSceneRequest, Shape, methods

from . import constants, meshes
from .arguments import Pose, Vector, vector
from .bodies import Body
from .connections import connected
from .errors import error
from .kinematics import link_pose
from .meshes import Vertices
from .rotations import compose, inverse, matrix
from .world import World

_WHITE = (1.0, 1.0, 1.0, 1.0)
# PyBullet's box around a plane.
_ENDLESS = 1e30
# Whose sizes are remembered.
_MOST_MESHES = 4096
# With this flag a shape has the number of its texture too.
_TEXTURES = constants.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS


def getVisualShapeData(objectUniqueId: int, flags: int = 0, physicsClientId: int = 0) -> tuple[tuple[Any, ...], ...]:
    """What is drawn of a body: body, link, kind, sizes, file, place and turn in the link's frame, colour."""
    world = connected(physicsClientId)
    body = world.bodies.get(objectUniqueId)
    if body is None:
        return ()
    rows: list[tuple[Any, ...]] = []
    texture = (-1,) if flags & _TEXTURES else ()
    numbers = _numbers(body)
    for shape in sorted(_scene(world, body).visuals, key=lambda shape: numbers[shape.link]):
        kind, size, file = _geometry(body, shape, drawn=True)
        c = shape.color
        color = (c.red, c.green, c.blue, c.alpha) if shape.HasField("color") else _WHITE
        rows.append((objectUniqueId, numbers[shape.link], kind, size, file, *_pose(shape), color, *texture))
    return tuple(rows)


def getCollisionShapeData(
    objectUniqueId: int, linkIndex: int, physicsClientId: int = 0
) -> tuple[tuple[Any, ...], ...]:
    """What a link touches with: body, link, kind, sizes, file, place and turn in the frame of the link's inertia."""
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
    """The corners of the box along the world's axes around the shapes that a link touches with."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getAABB failed.")
    box = _box(world, body, linkIndex)
    if box is None:
        raise error("getAABB failed.")
    return box


def getOverlappingObjects(
    aabbMin: Any, aabbMax: Any, physicsClientId: int = 0
) -> tuple[tuple[int, int], ...] | None:
    """Body and link of all whose boxes meet a box; `None` for none."""
    world = connected(physicsClientId)
    lower = vector(aabbMin, "aabbMin needs 3 numbers")
    upper = vector(aabbMax, "aabbMax needs 3 numbers")
    found: list[tuple[int, int]] = []
    for number, body in sorted(world.bodies.items()):
        for link in range(-1, len(body.joints)):
            box = _box(world, body, link)
            if box is not None and all(box[0][i] <= upper[i] and lower[i] <= box[1][i] for i in range(3)):
                found.append((number, link))
    return tuple(found) or None


def _scene(world: World, body: Body) -> Any:
    """The scene of a robot, which changes only with its layout."""
    kept = world.scenes.get(body.robot)
    if kept is None or kept.layout_version != body.layout_version:
        answer = world.wire.call(methods.GetScene, GetSceneRequest(robots=[body.robot]))
        if not answer.robots:
            raise error(f"the robot {body.robot} is gone")
        kept = world.scenes[body.robot] = answer.robots[0]
    return kept


def _numbers(body: Body) -> dict[int, int]:
    """PyBullet's link number by the daemon's place of the link."""
    numbers = {body.link_places[body.base_link]: -1} if body.base_link else {}
    return {**numbers, **{body.link_places[joint.link]: number for number, joint in enumerate(body.joints)}}


def _shapes(world: World, body: Body, link: str) -> list[Shape]:
    place = body.link_places[link]
    return [shape for shape in _scene(world, body).collisions if shape.link == place]


def _pose(shape: Shape) -> Pose:
    at, turn = shape.pose.position, shape.pose.orientation
    return (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)


def _geometry(body: Body, shape: Shape, drawn: bool) -> tuple[int, Vector, bytes]:
    """Kind, sizes and file in PyBullet's form."""
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
    if kind == "plane":
        n = shape.plane.normal
        return constants.GEOM_PLANE, (0.0, 0.0, 0.0) if drawn else (n.x, n.y, n.z), b""
    scale = shape.mesh.scale
    file = body.paths.get(shape.mesh.uri, shape.mesh.uri)
    return constants.GEOM_MESH, (scale.x, scale.y, scale.z), file.encode()


def _box(world: World, body: Body, link: int) -> tuple[Vector, Vector] | None:
    name = body.link_name(link)
    if name is None:
        return None
    frame = body.frame(name)
    center = compose(link_pose(body, world.link_poses(body), name), frame)
    shapes = [(compose(inverse(frame), _pose(shape)), shape) for shape in _shapes(world, body, name)]
    if not shapes:
        # As in PyBullet, a point.
        return center[0], center[0]
    if len(shapes) == 1 and _is_nothing(shapes[0][0]):
        points = _around(world, center, shapes[0][1])
    else:
        # Bullet turns the box around all of them, not each.
        corners = [_around(world, local, shape) for local, shape in shapes]
        points = np.concatenate(corners)
        if all(len(each) for each in corners):
            lower, upper = points.min(axis=0), points.max(axis=0)
            points = _corners(center, (lower + upper) / 2.0, (upper - lower) / 2.0)
    if not len(points):
        return None
    lower, upper = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


def _is_nothing(pose: Pose) -> bool:
    return all(abs(each) < 1e-12 for each in (*pose[0], *pose[1][:3]))


def _corners(pose: Pose, center: Vertices, half: Vertices) -> Vertices:
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    return (center + signs * half) @ np.array(matrix(pose[1])).T + np.array(pose[0])


def _around(world: World, pose: Pose, shape: Shape) -> Vertices:
    """World points whose box is that of the shape. As in Bullet, all but a sphere have
    that of the box around them in their own axes."""
    kind = shape.WhichOneof("geometry")
    at = np.array(pose[0])
    if kind == "sphere":
        return at + shape.sphere.radius * np.array([[-1.0] * 3, [1.0] * 3])
    if kind == "plane":
        return np.array([[-_ENDLESS] * 3, [_ENDLESS] * 3])
    if kind == "mesh":
        bounds = _bounds(world, shape.mesh.sha256, shape.mesh.uri)
        if bounds is None:
            return np.zeros((0, 3))
        scale = np.array([shape.mesh.scale.x, shape.mesh.scale.y, shape.mesh.scale.z])
        center, half = bounds.mean(axis=0) * scale, (bounds[1] - bounds[0]) / 2.0 * scale
    elif kind == "box":
        center, half = np.zeros(3), np.array([shape.box.size.x, shape.box.size.y, shape.box.size.z]) / 2.0
    else:
        round_one = shape.cylinder if kind == "cylinder" else shape.capsule
        length = round_one.length / 2.0 + (round_one.radius if kind == "capsule" else 0.0)
        center, half = np.zeros(3), np.array([round_one.radius, round_one.radius, length])
    return _corners(pose, center, half)


def _bounds(world: World, sha256: str, uri: str) -> Vertices | None:
    """The smallest and the largest coordinates of a mesh of the daemon's; `None` if its file is missing or of another
    format."""
    if sha256 not in world.mesh_bounds:
        if len(world.mesh_bounds) >= _MOST_MESHES:
            world.mesh_bounds.clear()
        found = meshes.vertices(world.wire.file(sha256), uri) if sha256 else None
        world.mesh_bounds[sha256] = (
            np.array([found.min(axis=0), found.max(axis=0)]) if found is not None and len(found) else None
        )
    return world.mesh_bounds[sha256]


__all__ = ["getAABB", "getCollisionShapeData", "getOverlappingObjects", "getVisualShapeData"]
