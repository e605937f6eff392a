"""Bodies of shapes: createCollisionShape, createVisualShape, createMultiBody."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from simd_client.proto import DescriptionSource

from . import constants, descriptions, filters, load_flags, meshes, spawning, terrain
from .arguments import ORIGIN, UPRIGHT, Color, Pose, indices, quaternion_or, rgba, vector_or
from .connections import connected
from .errors import error, unsupported
from .loading import default_surfaces, found, settled
from .meshes import Mesh
from .primitives import Part, Primitive, plane, urdf
from .rotations import compose
from .spawning import Spawn
from .world import World

_KINDS = {
    constants.GEOM_SPHERE,
    constants.GEOM_BOX,
    constants.GEOM_CYLINDER,
    constants.GEOM_CAPSULE,
    constants.GEOM_PLANE,
    constants.GEOM_MESH,
}


def createCollisionShape(
    shapeType: int,
    radius: float = 0.5,
    halfExtents: Any = (1.0, 1.0, 1.0),
    height: float = 1.0,
    fileName: str = "",
    meshScale: Any = None,
    planeNormal: Any = (0.0, 0.0, 1.0),
    flags: int = 0,
    collisionFramePosition: Any = None,
    collisionFrameOrientation: Any = None,
    vertices: Any = None,
    indices: Any = None,
    heightfieldTextureScaling: float = 1.0,
    heightfieldData: Any = None,
    numHeightfieldRows: int = 0,
    numHeightfieldColumns: int = 0,
    replaceHeightfieldIndex: int = -1,
    physicsClientId: int = 0,
) -> int:
    """Returns the number of a box, sphere, cylinder, capsule, plane, mesh or height field, for
    createMultiBody. A mesh becomes its convex hull. With indices or GEOM_FORCE_CONCAVE_TRIMESH, it keeps its
    triangles on a fixed body and becomes convex parts on others. With replaceHeightfieldIndex that height
    field gets other heights, and so do the bodies that were made of it."""
    function, world = "createCollisionShape", connected(physicsClientId)
    frame = pose(collisionFramePosition, collisionFrameOrientation)
    if shapeType == constants.GEOM_MESH:
        is_concave = bool(flags & constants.GEOM_FORCE_CONCAVE_TRIMESH)
        mesh = _mesh(world, function, fileName, vertices, indices, is_concave)
        return world.collision_shapes.add([_scaled(mesh, meshScale, frame, None)])
    if shapeType == constants.GEOM_HEIGHTFIELD:
        if numHeightfieldRows > 0 and numHeightfieldColumns > 0:
            heights, rows, columns = heightfieldData, int(numHeightfieldRows), int(numHeightfieldColumns)
        elif fileName:
            heights, rows, columns = terrain.read(function, found(world, fileName, f"{function}: could not load the heights."))
        else:
            raise error(f"{function}: a height field needs heightfieldData with its rows and columns, or fileName")
        if replaceHeightfieldIndex >= 0:
            return terrain.replace(world, function, int(replaceHeightfieldIndex), heights, rows, columns)
        mesh = meshes.of_heights(function, heights, rows, columns)
        x, y, z = vector_or((1.0, 1.0, 1.0), meshScale, "meshScale")
        size = (x * (rows - 1), y * (columns - 1), z)
        return world.collision_shapes.add([_scaled(mesh, size, frame, None)])
    made = _primitive(function, shapeType, radius, halfExtents, height, planeNormal, frame, None)
    return world.collision_shapes.add([made])


def createVisualShape(
    shapeType: int,
    radius: float = 0.5,
    halfExtents: Any = (1.0, 1.0, 1.0),
    length: float = 1.0,
    fileName: str = "",
    meshScale: Any = None,
    planeNormal: Any = (0.0, 0.0, 1.0),
    flags: int = 0,
    rgbaColor: Any = None,
    specularColor: Any = None,
    visualFramePosition: Any = None,
    visualFrameOrientation: Any = None,
    vertices: Any = None,
    indices: Any = None,
    normals: Any = None,
    uvs: Any = None,
    physicsClientId: int = 0,
) -> int:
    """Like createCollisionShape, for visuals."""
    function, world = "createVisualShape", connected(physicsClientId)
    frame = pose(visualFramePosition, visualFrameOrientation)
    if shapeType == constants.GEOM_MESH:
        try:
            mesh = _mesh(world, function, fileName, vertices, indices, False)
        except error as missing:
            if not fileName:
                raise
            # PyBullet accepts it, and draws nothing.
            print(f"simd: {missing}", file=sys.stderr)
            return world.visual_shapes.add([])
        return world.visual_shapes.add([_scaled(mesh, meshScale, frame, _color(rgbaColor))])
    made = _primitive(function, shapeType, radius, halfExtents, length, planeNormal, frame, rgbaColor)
    return world.visual_shapes.add([made])


def createCollisionShapeArray(
    shapeTypes: Any,
    radii: Any = None,
    halfExtents: Any = None,
    lengths: Any = None,
    fileNames: Any = None,
    meshScales: Any = None,
    planeNormals: Any = None,
    flags: Any = None,
    collisionFramePositions: Any = None,
    collisionFrameOrientations: Any = None,
    physicsClientId: int = 0,
) -> int:
    """Returns one shape of several."""
    made = _several(
        connected(physicsClientId),
        "createCollisionShapeArray",
        shapeTypes,
        fileNames,
        meshScales,
        radii,
        halfExtents,
        lengths,
        planeNormals,
        collisionFramePositions,
        collisionFrameOrientations,
        None,
    )
    return connected(physicsClientId).collision_shapes.add(made)


def createVisualShapeArray(
    shapeTypes: Any,
    radii: Any = None,
    halfExtents: Any = None,
    lengths: Any = None,
    fileNames: Any = None,
    meshScales: Any = None,
    planeNormals: Any = None,
    flags: Any = None,
    rgbaColors: Any = None,
    visualFramePositions: Any = None,
    visualFrameOrientations: Any = None,
    physicsClientId: int = 0,
) -> int:
    """Returns one shape of several, for visuals."""
    made = _several(
        connected(physicsClientId),
        "createVisualShapeArray",
        shapeTypes,
        fileNames,
        meshScales,
        radii,
        halfExtents,
        lengths,
        planeNormals,
        visualFramePositions,
        visualFrameOrientations,
        rgbaColors,
    )
    return connected(physicsClientId).visual_shapes.add(made)


def removeCollisionShape(collisionShapeId: int, physicsClientId: int = 0) -> None:
    """Removes a shape; bodies that were made of it stay."""
    connected(physicsClientId).collision_shapes.made.pop(collisionShapeId, None)


def _several(
    world: World,
    function: str,
    types: Any,
    files: Any,
    scales: Any,
    radii: Any,
    extents: Any,
    lengths: Any,
    normals: Any,
    positions: Any,
    orientations: Any,
    colors: Any,
) -> list[Primitive]:
    def at(values: Any, index: int, default: Any) -> Any:
        return default if values is None or index >= len(values) else values[index]

    made: list[Primitive] = []
    for index, kind in enumerate(indices(types, "expected a sequence of shape types")):
        frame = pose(at(positions, index, None), at(orientations, index, None))
        color = at(colors, index, None)
        if kind == constants.GEOM_MESH:
            mesh = _mesh(world, function, at(files, index, ""), None, None, False)
            made.append(_scaled(mesh, at(scales, index, None), frame, _color(color)))
            continue
        made.append(
            _primitive(
                function,
                kind,
                at(radii, index, 0.5),
                at(extents, index, (1.0, 1.0, 1.0)),
                at(lengths, index, 1.0),
                at(normals, index, (0.0, 0.0, 1.0)),
                frame,
                color,
            )
        )
    return made


def _mesh(world: World, function: str, file: str, vertices: Any, indices: Any, is_concave: bool) -> Mesh:
    if file:
        return meshes.read(function, found(world, file, f"{function}: could not load the mesh."), is_concave)
    if vertices is None or not len(vertices):
        raise error(f"{function}: a mesh needs fileName or vertices")
    return meshes.of_arrays(function, vertices, indices)


def _scaled(mesh: Mesh, scale: Any, frame: Pose, color: Color | None) -> Primitive:
    factors = vector_or((1.0, 1.0, 1.0), scale, "meshScale")
    return Primitive(constants.GEOM_MESH, factors, frame, color, mesh)


def _color(given: Any) -> Color | None:
    return None if given is None else rgba(given, "rgbaColor must be numbers")


def _primitive(
    function: str, kind: int, radius: float, half: Any, length: float, normal: Any, frame: Pose, color: Any
) -> Primitive:
    if kind not in _KINDS:
        raise unsupported(
            function, "boxes, spheres, cylinders, capsules, planes and meshes only, and height fields for collision"
        )
    shade = _color(color)
    if kind == constants.GEOM_PLANE:
        flat = plane(vector_or((0.0, 0.0, 1.0), normal, "planeNormal"))
        return Primitive(flat.kind, flat.size, compose(frame, flat.pose), shade)
    if kind == constants.GEOM_BOX:
        x, y, z = vector_or((1.0, 1.0, 1.0), half, "halfExtents")
        size: tuple[float, ...] = (2.0 * x, 2.0 * y, 2.0 * z)
    elif kind == constants.GEOM_SPHERE:
        size = (float(radius),)
    else:
        size = (float(radius), float(length))
    if min(size) <= 0.0:
        raise error(f"{function}: lengths must be above 0")
    return Primitive(kind, size, frame, shade)


def pose(position: Any, orientation: Any) -> Pose:
    """Returns a script's frame; the origin if it is left out."""
    return vector_or(ORIGIN, position, "a frame's position"), quaternion_or(UPRIGHT, orientation, "a frame's orientation")


def createMultiBody(
    baseMass: float = 0.0,
    baseCollisionShapeIndex: int = -1,
    baseVisualShapeIndex: int = -1,
    basePosition: Any = (0.0, 0.0, 0.0),
    baseOrientation: Any = (0.0, 0.0, 0.0, 1.0),
    baseInertialFramePosition: Any = None,
    baseInertialFrameOrientation: Any = None,
    linkMasses: Any = (),
    linkCollisionShapeIndices: Any = (),
    linkVisualShapeIndices: Any = (),
    linkPositions: Any = (),
    linkOrientations: Any = (),
    linkInertialFramePositions: Any = (),
    linkInertialFrameOrientations: Any = (),
    linkParentIndices: Any = (),
    linkJointTypes: Any = (),
    linkJointAxis: Any = (),
    useMaximalCoordinates: int = 0,
    flags: int = 0,
    batchPositions: Any = None,
    physicsClientId: int = 0,
) -> int | tuple[int, ...]:
    """Makes a body of shapes, fixed to the world if its base has no mass. Only flags of self-collision have
    an effect. Returns its number, or one number for each of batchPositions."""
    world = connected(physicsClientId)
    base = _part(
        world,
        "link0",
        float(baseMass),
        baseCollisionShapeIndex,
        baseVisualShapeIndex,
        pose(baseInertialFramePosition, baseInertialFrameOrientation),
    )
    columns = (
        linkCollisionShapeIndices,
        linkVisualShapeIndices,
        linkPositions,
        linkOrientations,
        linkInertialFramePositions,
        linkInertialFrameOrientations,
        linkParentIndices,
        linkJointTypes,
        linkJointAxis,
    )
    if any(len(column) != len(linkMasses) for column in columns):
        raise error("All link arrays need to be same size.")
    parts = [base]
    for index, row in enumerate(zip(linkMasses, *columns, strict=True), start=1):
        parts.append(_linked(world, index, len(linkMasses), row))
    text = urdf("body", parts)
    drawn = {shape.mesh.uri: shape.mesh for part in parts for shape in part.visuals if shape.mesh}
    touched = {shape.mesh.uri: shape.mesh for part in parts for shape in part.collisions if shape.mesh}
    used = {**drawn, **touched}
    files = {uri: mesh.sha256 for uri, mesh in used.items()}
    spawning.send(world.wire, text, files, {mesh.sha256: mesh.data for mesh in used.values()})
    orientation = quaternion_or(UPRIGHT, baseOrientation, "baseOrientation")
    surfaces = default_surfaces([part.name for part in parts], base.name if baseMass == 0.0 else None)
    description = descriptions.read(text, 1.0)
    is_batch = batchPositions is not None and len(batchPositions) > 0
    numbers: list[int] = []
    positions: Any = batchPositions if is_batch else (basePosition,)
    is_divided = any(mesh.is_concave for mesh in touched.values())
    self_collision = bool(flags & constants.URDF_USE_SELF_COLLISION)
    damped = load_flags.is_damped(world, "createMultiBody", useMaximalCoordinates, len(parts))
    spawns = [
        Spawn(
            position=vector_or(ORIGIN, position, "basePosition"),
            orientation=orientation,
            fixed=baseMass == 0.0,
            self_collision=self_collision,
            divided=is_divided,
            surfaces=surfaces,
            damped=damped,
        )
        for position in positions
    ]
    for entity in spawning.spawn_all(world.wire, DescriptionSource(urdf=text, assets=files), spawns):
        number = settled(world, entity, description, text, files, 1.0, surfaces)
        body = world.bodies[number]
        body.paths, body.divided = {uri: mesh.file for uri, mesh in used.items()}, is_divided
        body.made_of, body.self_collision = frozenset(used), self_collision
        body.shape_margin, body.has_round_cylinders = 0.0, True
        filters.set_parents(world, body, flags)
        numbers.append(number)
    return tuple(numbers) if is_batch else numbers[0]


def _linked(world: World, index: int, count: int, row: Sequence[Any]) -> Part:
    mass, collision, visual, position, orientation, at, turn, parent, kind, axis = row
    if kind not in (constants.JOINT_REVOLUTE, constants.JOINT_PRISMATIC, constants.JOINT_FIXED):
        raise unsupported("createMultiBody", "revolute, prismatic and fixed joints only")
    if not 0 <= int(parent) <= count or int(parent) == index:
        raise error("createMultiBody: a link's parent is 0 for the base, or the number of a link from 1")
    part = _part(world, f"link{index}", float(mass), collision, visual, pose(at, turn))
    return Part(
        name=part.name,
        mass=part.mass,
        collisions=part.collisions,
        visuals=part.visuals,
        inertia=part.inertia,
        joint=f"joint{index}",
        parent=f"link{int(parent)}",
        pose=pose(position, orientation),
        type=int(kind),
        axis=vector_or(ORIGIN, axis, "linkJointAxis"),
    )


def _part(world: World, name: str, mass: float, collision: int, visual: int, inertia: Pose) -> Part:
    collisions = world.collision_shapes.get(int(collision))
    # As in PyBullet, a link without visuals shows its collision shapes.
    visuals = world.visual_shapes.get(int(visual)) or collisions
    return Part(name=name, mass=mass, collisions=collisions, visuals=visuals, inertia=inertia)


__all__ = [
    "createCollisionShape",
    "createCollisionShapeArray",
    "createMultiBody",
    "createVisualShape",
    "createVisualShapeArray",
    "removeCollisionShape",
]
