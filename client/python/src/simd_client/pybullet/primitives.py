"""Boxes, spheres, cylinders, capsules and meshes, as URDF text: the shapes of createMultiBody."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, field

from . import constants
from .arguments import ORIGIN, UPRIGHT, Pose, Quaternion, Vector
from .meshes import Mesh
from .origins import set_pose, text_of
from .rotations import compose, inverse, matrix

# Size of a plane's sides, metres; a plane of PyBullet has no end.
_PLANE = 1000.0
_PLANE_DEPTH = 10.0


@dataclass(frozen=True)
class Primitive:
    """One shape. `size` is a box's full sides, radius and length, or the scale of a mesh."""

    kind: int
    size: tuple[float, ...]
    pose: Pose = (ORIGIN, UPRIGHT)
    color: tuple[float, ...] | None = None
    mesh: Mesh | None = None

    def inertia(self, mass: float) -> Vector:
        """Returns the diagonal of the inertia about the solid shape's centre, kg m^2."""
        if self.kind == constants.GEOM_SPHERE:
            i = 0.4 * mass * self.size[0] ** 2
            return (i, i, i)
        if self.kind == constants.GEOM_CYLINDER:
            radius, length = self.size
            across = mass * (3.0 * radius**2 + length**2) / 12.0
            return (across, across, mass * radius**2 / 2.0)
        # As in Bullet, a capsule or a mesh has the inertia of the box around it.
        return of_box(mass, *(2.0 * side for side in self.box()[1]))

    def box(self) -> tuple[Vector, Vector]:
        """Returns centre and half sides of the box around the shape, in its own axes."""
        if self.mesh is not None:
            corners = list(zip(self.size, self.mesh.lower, self.mesh.upper, strict=True))
            x, y, z = (scale * (low + high) / 2.0 for scale, low, high in corners)
            a, b, c = (abs(scale) * (high - low) / 2.0 for scale, low, high in corners)
            return (x, y, z), (a, b, c)
        if self.kind == constants.GEOM_SPHERE:
            return ORIGIN, (self.size[0], self.size[0], self.size[0])
        if self.kind == constants.GEOM_BOX:
            x, y, z = self.size
            return ORIGIN, (x / 2.0, y / 2.0, z / 2.0)
        radius, length = self.size
        ends = radius if self.kind == constants.GEOM_CAPSULE else 0.0
        return ORIGIN, (radius, radius, length / 2.0 + ends)


@dataclass(frozen=True)
class Part:
    """A link of a body: mass, shapes, and the joint to its parent."""

    name: str
    mass: float
    collisions: Sequence[Primitive] = ()
    visuals: Sequence[Primitive] = ()
    # link_from_inertia.
    inertia: Pose = (ORIGIN, UPRIGHT)
    # Empty for the base.
    joint: str = ""
    parent: str = ""
    # parent_from_joint.
    pose: Pose = (ORIGIN, UPRIGHT)
    type: int = constants.JOINT_FIXED
    axis: Vector = (0.0, 0.0, 1.0)


@dataclass
class Shapes:
    """Shapes that a script made, by number."""

    made: dict[int, tuple[Primitive, ...]] = field(default_factory=dict[int, tuple[Primitive, ...]])
    next: int = 0

    def add(self, shape: Sequence[Primitive]) -> int:
        """Returns the number of a shape of several parts."""
        self.made[self.next] = tuple(shape)
        self.next += 1
        return self.next - 1

    def get(self, number: int) -> tuple[Primitive, ...]:
        """Returns the parts of a shape; empty for an unknown shape."""
        return self.made.get(number, ())


def plane(normal: Vector) -> Primitive:
    """Returns a plane through the origin: the top of a large box."""
    x, y, z = normal
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    x, y, z = x / length, y / length, z / length
    # Shortest rotation from z to the normal.
    if z < -1.0 + 1e-12:
        rotation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    else:
        w = math.sqrt((1.0 + z) / 2.0)
        rotation = (-y / (2.0 * w), x / (2.0 * w), 0.0, w)
    depth = _PLANE_DEPTH / 2.0
    return Primitive(
        constants.GEOM_BOX,
        (_PLANE, _PLANE, _PLANE_DEPTH),
        ((-x * depth, -y * depth, -z * depth), rotation),
    )


def urdf(name: str, parts: Sequence[Part]) -> bytes:
    """Returns a robot of these parts, the base first."""
    robot = ElementTree.Element("robot", name=name)
    for part in parts:
        _link(robot, part)
    for part in parts[1:]:
        _joint(robot, part)
    return ElementTree.tostring(robot)


def _link(robot: ElementTree.Element, part: Part) -> None:
    link = ElementTree.SubElement(robot, "link", name=part.name)
    inertial = ElementTree.SubElement(link, "inertial")
    set_pose(inertial, part.inertia)
    ElementTree.SubElement(inertial, "mass", value=repr(part.mass))
    x, y, z = _inertia(part)
    ElementTree.SubElement(
        inertial, "inertia", ixx=repr(x), iyy=repr(y), izz=repr(z), ixy="0", ixz="0", iyz="0"
    )
    for what, shapes in (("visual", part.visuals), ("collision", part.collisions)):
        for shape in shapes:
            _shape(ElementTree.SubElement(link, what), shape)


def _inertia(part: Part) -> Vector:
    """Returns the inertia of the collision shapes, as PyBullet computes it."""
    shapes = part.collisions or part.visuals
    if not shapes:
        # A point has no inertia, and no joint could turn it: this is the inertia of a ball of 1 cm.
        i = 0.4 * part.mass * 1e-4
        return (i, i, i)
    local = [compose(inverse(part.inertia), shape.pose) for shape in shapes]
    if len(shapes) == 1 and local[0] == (ORIGIN, UPRIGHT):
        return shapes[0].inertia(part.mass)
    # As in Bullet, the inertia of the box around all of them.
    boxes = [box_at(pose, shape) for pose, shape in zip(local, shapes, strict=True)]
    x, y, z = (max(upper[i] for _, upper in boxes) - min(lower[i] for lower, _ in boxes) for i in range(3))
    return of_box(part.mass, x, y, z)


def of_box(mass: float, x: float, y: float, z: float) -> Vector:
    """Returns the diagonal of a box with these sides."""
    return (mass * (y * y + z * z) / 12.0, mass * (x * x + z * z) / 12.0, mass * (x * x + y * y) / 12.0)


def box_at(pose: Pose, shape: Primitive) -> tuple[list[float], list[float]]:
    """Returns the box along the axes around a shape at a pose."""
    center, half = shape.box()
    at = compose(pose, (center, UPRIGHT))[0]
    if shape.kind == constants.GEOM_SPHERE:
        reach: Sequence[float] = half
    else:
        reach = [sum(abs(row[i]) * half[i] for i in range(3)) for row in matrix(pose[1])]
    return [at[i] - reach[i] for i in range(3)], [at[i] + reach[i] for i in range(3)]


def _shape(parent: ElementTree.Element, shape: Primitive) -> None:
    set_pose(parent, shape.pose)
    geometry = ElementTree.SubElement(parent, "geometry")
    if shape.kind == constants.GEOM_SPHERE:
        ElementTree.SubElement(geometry, "sphere", radius=repr(shape.size[0]))
    elif shape.kind == constants.GEOM_BOX:
        ElementTree.SubElement(geometry, "box", size=text_of(shape.size))
    elif shape.mesh is not None:
        ElementTree.SubElement(geometry, "mesh", filename=shape.mesh.uri, scale=text_of(shape.size))
    else:
        tag = "capsule" if shape.kind == constants.GEOM_CAPSULE else "cylinder"
        ElementTree.SubElement(geometry, tag, radius=repr(shape.size[0]), length=repr(shape.size[1]))
    if shape.color is not None and parent.tag == "visual":
        material = ElementTree.SubElement(parent, "material", name="")
        ElementTree.SubElement(material, "color", rgba=text_of(shape.color))


def _joint(robot: ElementTree.Element, part: Part) -> None:
    types = {
        constants.JOINT_REVOLUTE: "continuous",
        constants.JOINT_PRISMATIC: "prismatic",
        constants.JOINT_FIXED: "fixed",
    }
    joint = ElementTree.SubElement(robot, "joint", name=part.joint, type=types[part.type])
    set_pose(joint, part.pose)
    ElementTree.SubElement(joint, "parent", link=part.parent)
    ElementTree.SubElement(joint, "child", link=part.name)
    if part.type != constants.JOINT_FIXED:
        ElementTree.SubElement(joint, "axis", xyz=text_of(part.axis))
        if part.type == constants.JOINT_PRISMATIC:
            # URDF requires a limit here; all zeros mean none.
            ElementTree.SubElement(joint, "limit", lower="0", upper="0", effort="0", velocity="0")
