"""Spawns single shapes: the ground, a box to push."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy.typing as npt

from simd_client import proto
from simd_client.aio.loading import Loading
from simd_client.aio.robot import Robot
from simd_client.aio.runtime import in_thread
from simd_client.aio.upload import send_bytes
from simd_client.description import Severity, report_from_proto
from simd_client.errors import InvalidDescription, refused_here
from simd_client.geometry import vector, vector_to_proto
from simd_client.mesh import AnyMesh, mesh_file
from simd_client.proto import methods
from simd_client.query import PlacedShape, Shape, part_to_proto
from simd_client.spawn import UPRIGHT, height_field_file, shape_options, shape_source


class Primitives(Loading):
    """The part of a connection that spawns single shapes: robots with one link, `link`. Lengths are in
    metres, masses in kilograms.

    The default mass corresponds to water, 1,000 kg/m^3; the inertia assumes a solid of even density.
    `position` and `orientation` (x y z w) refer to the shape's centre. `fixed` fixes the shape to the world.
    The default name is the shape's, with `_1`, `_2`, ... if it is taken.
    """

    async def add_box(
        self,
        size: npt.ArrayLike,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a box with sides of the full lengths `size`. `color` is red, green, blue and optionally
        alpha, 0 to 1."""
        shape = proto.Primitive(box=proto.BoxGeometry(size=vector_to_proto(size, "a box's size")))
        options = shape_options("box", name, position, orientation, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_sphere(
        self,
        radius: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a sphere."""
        shape = proto.Primitive(sphere=proto.SphereGeometry(radius=radius))
        options = shape_options("sphere", name, position, UPRIGHT, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_cylinder(
        self,
        radius: float,
        length: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a cylinder about its z axis."""
        shape = proto.Primitive(cylinder=proto.CylinderGeometry(radius=radius, length=length))
        options = shape_options("cylinder", name, position, orientation, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_capsule(
        self,
        radius: float,
        length: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a capsule about its z axis; `length` is without the caps."""
        shape = proto.Primitive(capsule=proto.CapsuleGeometry(radius=radius, length=length))
        options = shape_options("capsule", name, position, orientation, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_cone(
        self,
        radius: float,
        length: float,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a cone about its z axis: the base at `-length / 2`, the apex at `length / 2`."""
        shape = proto.Primitive(cone=proto.ConeGeometry(radius=radius, length=length))
        options = shape_options("cone", name, position, orientation, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_compound(
        self,
        parts: Sequence[Shape | PlacedShape],
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns one body of several shapes, at most 1,000, each placed in the body's frame by its pose.
        Overlapping volumes count twice in the mass."""
        shape = proto.Primitive(compound=proto.CompoundGeometry(parts=[part_to_proto(part) for part in parts]))
        options = shape_options("compound", name, position, orientation, fixed, friction, restitution)
        return await self._spawn(shape_source(shape, mass, color), options)

    async def add_mesh(
        self,
        mesh: AnyMesh,
        mass: float | None = None,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        scale: npt.ArrayLike = (1, 1, 1),
        convex_parts: bool = False,
        fixed: bool = False,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns a mesh. It is a pair of arrays `(vertices, triangles)`: metres, and three indices of
        vertices a row. It may also be an object with `vertices` and `faces`, as in trimesh, or the path of an
        STL, OBJ or COLLADA file.

        It collides with its convex hull. With `convex_parts` it collides with at most 32 parts, which takes
        seconds for a large mesh. The default mass is the mass of the hull filled with water. The origin is
        the mesh's own. `scale` is a factor for each axis. Raises `InvalidDescription` for a file that the
        daemon does not read.
        """
        file = await in_thread(lambda: mesh_file(mesh))
        sha256 = await send_bytes(self, file.data)
        x, y, z = vector(scale, 3, "a scale").tolist()
        if 0.0 in (x, y, z):
            raise ValueError("a scale of 0 leaves nothing of a mesh")
        geometry = proto.MeshGeometry(uri=file.name, scale=proto.Vector3(x=x, y=y, z=z))
        source = shape_source(proto.Primitive(mesh=geometry), mass, color)
        source.assets[file.name] = sha256
        options = shape_options("mesh", name, position, orientation, fixed, friction, restitution)
        # An unreadable mesh would leave a robot without a shape and without a mass.
        request = proto.ValidateDescriptionRequest(source=source)
        answer = await self.call_until_silent(methods.ValidateDescription, request)
        report = report_from_proto(answer.report)
        for finding in report.findings:
            if finding.file and finding.severity is not Severity.INFO:
                raise refused_here(InvalidDescription, "INVALID_ARGUMENT", finding.message)
        return await self._spawn(source, replace(options, collision="parts" if convex_parts else "mesh"))

    async def add_plane(
        self,
        normal: npt.ArrayLike = (0, 0, 1),
        position: npt.ArrayLike = (0, 0, 0),
        *,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns an infinite plane, fixed to the world. `normal` points out of it."""
        shape = proto.Primitive(plane=proto.PlaneGeometry(normal=vector_to_proto(normal, "a normal")))
        options = shape_options("plane", name, position, UPRIGHT, True, friction, restitution)
        return await self._spawn(shape_source(shape, None, color), options)

    async def add_height_field(
        self,
        heights: npt.ArrayLike,
        size: npt.ArrayLike,
        position: npt.ArrayLike = (0, 0, 0),
        orientation: npt.ArrayLike = UPRIGHT,
        *,
        name: str = "",
        friction: float | None = None,
        restitution: float | None = None,
        color: Sequence[float] | None = None,
    ) -> Robot:
        """Spawns ground from a two-dimensional array of heights, metres, fixed to the world. `heights[i, j]`
        is the height of the i-th row along y and the j-th column along x, both from the least coordinate up.
        `size` is its extent along x and y, with its middle at `position`. Everything below the surface is
        inside. Raises `ValueError` for an array of another shape."""
        file, scale = height_field_file(heights, size)
        sha256 = await send_bytes(self, file)
        uri = f"{sha256}.csv"
        shape = proto.Primitive(mesh=proto.MeshGeometry(uri=uri, scale=vector_to_proto(scale, "a size")))
        source = shape_source(shape, None, color)
        source.assets[uri] = sha256
        options = shape_options("height-field", name, position, orientation, True, friction, restitution)
        return await self._spawn(source, options)
