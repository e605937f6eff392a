"""Masses and inertias that PyBullet gives the links of a file, from the boxes around their collision shapes.

PyBullet reads the inertias of a URDF only with `URDF_USE_INERTIA_FROM_FILE`, so many files have placeholders.
A script that balances a pole is made for the inertia of its shape. A link without `<inertial>` gets 1 kg.
"""

from __future__ import annotations

import functools
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import constants, descriptions, meshes
from .arguments import ORIGIN, UPRIGHT, Pose, Vector
from .errors import error
from .meshes import Mesh
from .origins import number_of, numbers_of, pose_of
from .primitives import Primitive, box_at, of_box
from .rotations import compose, inverse

Locate = Callable[[str], Path | None]
"""Maps the URI of a mesh to its file."""

Bounds = tuple[Vector, Vector]
"""Smallest and largest coordinates."""

# Bullet's collision margin of files, metres: around all of a link, and around each shape as in `Shape`.
MARGIN = 0.001


@dataclass(frozen=True)
class Shape:
    """Collision shape of a link, with the number of margins that Bullet adds to its box: among others, and
    alone."""

    primitive: Primitive
    margins: float = 0.0
    margins_alone: float = 3.0

    def box(self, pose: Pose, margin: float) -> tuple[list[float], list[float]]:
        """Returns the box along the axes around it at a pose: around its own box, as in Bullet."""
        if self.primitive.kind == constants.GEOM_SPHERE:
            return box_at(pose, self.primitive)
        center, half = self.primitive.box()
        sides = tuple(2.0 * (side + self.margins * margin) for side in half)
        return box_at(compose(pose, (center, UPRIGHT)), Primitive(constants.GEOM_BOX, sides))


def as_in_pybullet(
    urdf: bytes,
    locate: Locate,
    scale: float = 1.0,
    from_file: bool = False,
    has_round_cylinders: bool = False,
    keeps_mimic: bool = False,
) -> bytes:
    """Returns the same robot with these masses and inertias; its lengths will be loaded times `scale`. A link
    keeps its own if the size of its collision shapes is unknown; `from_file` keeps all. As in PyBullet no
    joint follows another, unless `keeps_mimic`."""
    robot = descriptions.parse(urdf)
    if robot is None:
        return urdf
    margin = MARGIN / scale
    for joint in () if keeps_mimic else robot.iterfind("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
    for link in robot.iterfind("link"):
        inertial = link.find("inertial")
        if inertial is None:
            if link.get("name") == "world":
                continue
            inertial = ElementTree.SubElement(link, "inertial")
            ElementTree.SubElement(inertial, "mass", value="1")
            ElementTree.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1")
        mass = number_of(inertial.find("mass"), "value")
        if mass is None or mass <= 0.0:
            continue
        scaling = number_of(link.find("contact/inertia_scaling"), "value") or 1.0
        if from_file:
            # The daemon scales inertias with the lengths, and Bullet does not.
            _multiply(inertial, scaling / scale**2)
            continue
        found = of_link(link, mass, locate, margin, has_round_cylinders)
        if found is None:
            continue
        x, y, z = (i * scaling for i in found)
        if not min(x, y, z) > 0.0 or not math.isfinite(x + y + z):
            continue
        for old in inertial.findall("inertia"):
            inertial.remove(old)
        moments = {"ixx": repr(x), "iyy": repr(y), "izz": repr(z), "ixy": "0", "ixz": "0", "iyz": "0"}
        ElementTree.SubElement(inertial, "inertia", moments)
    return ElementTree.tostring(robot)


def of_link(
    link: ElementTree.Element, mass: float, locate: Locate, margin: float, has_round_cylinders: bool
) -> Vector | None:
    """Returns the diagonal of a link of this mass about its centre of mass, in the axes of its inertia.
    Bullet computes it from the collision shapes, with a collision margin. `None` if their size is unknown, or
    is not a number."""
    shapes = [_shape(collision, locate, has_round_cylinders) for collision in link.iterfind("collision")]
    known = [shape for shape in shapes if shape is not None]
    if len(known) < len(shapes):
        return None
    inertial = link.find("inertial")
    center = (ORIGIN, UPRIGHT) if inertial is None else pose_of(inertial)
    try:
        return inertia_of(mass, center, known, margin, margin)
    except ArithmeticError:
        # Numbers that the daemon refuses.
        return None


def _multiply(inertial: ElementTree.Element, factor: float) -> None:
    for inertia in inertial.iterfind("inertia"):
        for name in inertia.keys():
            moment = number_of(inertia, name)
            if moment is not None and factor != 1.0:
                inertia.set(name, repr(moment * factor))


def inertia_of(mass: float, link_from_inertia: Pose, shapes: list[Shape], margin: float, outer: float) -> Vector:
    """Returns the diagonal about the centre of mass. It comes from a single shape at that centre, else from
    the box around all of them, with a separate margin."""
    local = [compose(inverse(link_from_inertia), shape.primitive.pose) for shape in shapes]
    if len(shapes) == 1 and local[0] == (ORIGIN, UPRIGHT):
        only = shapes[0].primitive
        if only.mesh is None:
            return only.inertia(mass)
        return of_box(mass, *(2.0 * (side + shapes[0].margins_alone * margin) for side in only.box()[1]))
    lower, upper = [math.inf] * 3, [-math.inf] * 3
    for pose, shape in zip(local, shapes, strict=True):
        least, most = shape.box(pose, margin)
        lower, upper = list(map(min, lower, least)), list(map(max, upper, most))
    # A link without collision shapes is a point with a margin.
    x, y, z = ((b - a if shapes else 0.0) + 2.0 * outer for a, b in zip(lower, upper, strict=True))
    return of_box(mass, x, y, z)


def hull(lower: Vector, upper: Vector, pose: Pose, margins: float, margins_alone: float = 3.0) -> Shape:
    """Returns a convex hull with these bounds."""
    mesh = Mesh(b"", "", "", "", lower, upper)
    return Shape(Primitive(constants.GEOM_MESH, (1.0, 1.0, 1.0), pose, mesh=mesh), margins, margins_alone)


def _shape(collision: ElementTree.Element, locate: Locate, has_round_cylinders: bool) -> Shape | None:
    """Returns a collision shape; `None` if its size is unknown."""
    geometry = collision.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None:
        return None
    pose = pose_of(collision)
    if shape.tag == "mesh":
        path = locate(shape.get("filename", ""))
        bounds = None if path is None else bounds_of(path)
        scale = numbers_of(shape.get("scale", "1 1 1"))
        if len(scale) == 1:
            scale *= 3
        if path is None or bounds is None or len(scale) != 3:
            return None
        ends = [sorted((factor * a, factor * b)) for factor, a, b in zip(scale, *bounds, strict=True)]
        lower, upper = (ends[0][0], ends[1][0], ends[2][0]), (ends[0][1], ends[1][1], ends[2][1])
        # An OBJ file is a shape of several hulls.
        return hull(lower, upper, pose, 3.0 if path.suffix.lower() == ".obj" else 2.0)
    if shape.tag == "box":
        size = numbers_of(shape.get("size", ""))
        return Shape(Primitive(constants.GEOM_BOX, tuple(size), pose)) if len(size) == 3 else None
    radius, length = number_of(shape, "radius"), number_of(shape, "length")
    if shape.tag == "sphere" and radius is not None:
        return Shape(Primitive(constants.GEOM_SPHERE, (radius,), pose))
    if radius is None or length is None:
        return None
    if shape.tag == "cylinder" and not has_round_cylinders:
        return hull((-radius, -radius, -length / 2.0), (radius, radius, length / 2.0), pose, 2.0)
    kinds = {"cylinder": constants.GEOM_CYLINDER, "capsule": constants.GEOM_CAPSULE}
    return Shape(Primitive(kinds[shape.tag], (radius, length), pose)) if shape.tag in kinds else None


def bounds_of(path: Path) -> Bounds | None:
    """Returns the bounds of a mesh's file; `None` for a format that is not read here."""
    try:
        return _bounds(path, path.stat().st_mtime_ns)
    except OSError:
        return None


@functools.lru_cache(maxsize=512)
def _bounds(path: Path, changed: int) -> Bounds | None:
    """Returns the bounds of a file, cached until the file changes."""
    del changed
    try:
        mesh = meshes.read("loadURDF", path, False)
    except (error, NotImplementedError):
        return None
    return mesh.lower, mesh.upper
