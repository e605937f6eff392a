"""Converts MJCF to URDF like Bullet: bodies of geoms.

Bullet reads a part of MJCF, and files like those of `pybullet_envs` are made for that part. A body without a
joint is free, and each geom of the world is a body. Each joint has a separate massless link, and the body is
attached to the last of them by a joint `jointfix_...`. Masses assume water, regardless of the file's
densities. Damping, armature and actuators are left out. Scripts know such joints by their names. Files with
further elements are for the daemon's reader.
"""

from __future__ import annotations

import itertools
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from . import constants, shape_inertia
from .arguments import ORIGIN, UPRIGHT, Pose, Quaternion, Vector
from .origins import set_pose, text_of
from .primitives import Primitive, plane
from .rotations import compose, inverse, rotate
from .shape_inertia import Shape

Find = Callable[[str], Path | None]
"""Maps the name of a mesh's file to the file."""

_DENSITY = 1000.0
_GEOMS = ("plane", "box", "sphere", "capsule", "cylinder", "mesh")
# Elements that Bullet does not read, and that would change the world.
_ELEMENTS = {"include", "equality", "frame", "replicate", "attach", "composite", "flexcomp", "freejoint", "hfield", "extension"}
_GEOM_TEXTS = {"mass", "euler", "xyaxes", "zaxis"}
_BODY_TEXTS = {"euler", "xyaxes", "zaxis"}
# Bullet counts its joints over all files.
_count = itertools.count()


@dataclass(frozen=True)
class _Defaults:
    """Attributes of geoms."""

    group: int = 1
    mask: int = 1
    rgba: str = ""
    condim: int = 3
    friction: tuple[float, ...] = (0.5, 0.0, 0.0)


@dataclass
class Model:
    """One body of the world."""

    robot: ElementTree.Element
    # Number in the file, from 0.
    index: int
    # Name in the file.
    name: str
    # Number of links, which names them.
    links: int = 0
    names: set[str] = field(default_factory=set[str])
    # world_from_root.
    pose: Pose = (ORIGIN, UPRIGHT)
    # Group and mask by link.
    groups: dict[str, tuple[int, int]] = field(default_factory=dict[str, tuple[int, int]])
    # Joints without limits; Bullet reports 1 and 0 for them.
    endless: set[str] = field(default_factory=set[str])
    # Meshes by the name in the URDF.
    files: dict[str, Path] = field(default_factory=dict[str, Path])

    @property
    def root(self) -> ElementTree.Element:
        """Returns the link without a parent."""
        children = {child.get("link") for child in self.robot.iterfind("joint/child")}
        return next(link for link in self.robot.iterfind("link") if link.get("name") not in children)

    @property
    def is_fixed(self) -> bool:
        """As in Bullet, a body with a massless root is part of the world."""
        return self.root.find("inertial") is None


_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


@dataclass
class _Link:
    """A link under construction."""

    element: ElementTree.Element
    shapes: list[Shape] = field(default_factory=list[Shape])
    volume: float = 0.0
    # Middle of its last geom, if that geom has `fromto`.
    center: Vector = ORIGIN


def is_bullets(document: ElementTree.Element) -> bool:
    """Whether Bullet reads all of a file's bodies, joints and shapes."""
    worlds = document.findall("worldbody")
    geoms = [geom for world in worlds for geom in world.iter("geom")]
    joints = [joint for world in worlds for joint in world.iter("joint")]
    bodies = [body for world in worlds for body in world.iter("body")]
    return (
        document.tag == "mujoco"
        and not any(element.tag in _ELEMENTS for element in document.iter())
        and all(geom.get("type") in _GEOMS and not _GEOM_TEXTS.intersection(geom.keys()) for geom in geoms)
        and all(joint.get("type") in ("hinge", "slide", "free", "fixed") for joint in joints)
        and not any(_BODY_TEXTS.intersection(body.keys()) for body in bodies)
    )


def has_global_coordinates(document: ElementTree.Element) -> bool:
    """Whether poses are MuJoCo's before 2.3.3. The daemon refuses those, and Bullet takes them for local
    ones."""
    return any(each.get("coordinate") == "global" for each in document.iterfind("compiler"))


def models(document: ElementTree.Element, find: Find, has_colors: bool) -> list[Model]:
    """Returns the bodies of a file, in its order.

    Raises:
        ValueError: for text that is not a number, and a name that two bodies have.
    """
    return _Reader(document, find, has_colors).models


class _Reader:
    def __init__(self, document: ElementTree.Element, find: Find, has_colors: bool) -> None:
        self._name = document.get("model", "")
        self._find = find
        self._has_colors = has_colors
        self._is_limited = False
        self._classes: dict[str, _Defaults] = {}
        self.models: list[Model] = []
        defaults = _Defaults()
        for element in document.findall("default"):
            defaults = self._read_defaults(defaults, element)
        compiler = document.find("compiler")
        attributes = {} if compiler is None else compiler.attrib
        self._are_degrees = attributes.get("angle", "degree") == "degree"
        meshes = {mesh.get("name", ""): mesh.get("file", "") for mesh in document.iterfind("asset/mesh")}
        self._meshes = {name: attributes.get("meshdir", "") + file for name, file in meshes.items() if name and file}
        for element in (each for world in document.findall("worldbody") for each in world):
            if element.tag not in ("body", "geom"):
                continue
            model = Model(ElementTree.Element("robot", name=self._name or "body"), len(self.models), self._name)
            self.models.append(model)
            if element.tag == "body":
                model.pose = self._body(model, element, None, -1, defaults)
            else:
                link = _Link(ElementTree.SubElement(model.robot, "link", name=element.get("name", "anonymous")))
                # Without mass it is a part of the world.
                self._geom(model, link, element, defaults)

    def _read_defaults(self, defaults: _Defaults, element: ElementTree.Element) -> _Defaults:
        for child in element:
            if child.tag == "default" and child.get("class"):
                name = child.get("class", "")
                self._classes[name] = self._read_defaults(self._classes.get(name, _Defaults()), child)
            elif child.tag == "joint" and child.get("limited") and element.get("class") is None:
                # Bullet reads only the default for all.
                self._is_limited = child.get("limited") == "true"
            elif child.tag == "geom":
                friction = _numbers(child.get("friction", ""))
                defaults = replace(
                    defaults,
                    group=int(child.get("contype", defaults.group)),
                    mask=int(child.get("conaffinity", defaults.mask)),
                    rgba=child.get("rgba", defaults.rgba),
                    condim=int(child.get("condim", defaults.condim)),
                    friction=(*friction, *defaults.friction[len(friction) :])[:3],
                )
        return defaults

    def _body(
        self, model: Model, body: ElementTree.Element, parent: str | None, parent_number: int, defaults: _Defaults
    ) -> Pose:
        """Adds a body, its joints, and its children. Returns the pose of the root for a body without a
        parent."""
        defaults = self._classes.get(body.get("childclass", ""), defaults)
        link = _Link(_link(model, body.get("name")))
        name = link.element.get("name", "")
        at, above, above_number, number = _pose(body), parent, parent_number, model.links - 1
        first: Pose | None = None
        inertial: ElementTree.Element | None = None
        for child in body:
            if child.tag == "inertial":
                inertial = child
            elif child.tag == "joint" and (above is not None or child.get("type") != "free"):
                if above is None:
                    above = _link(model, None).get("name", "")
                below = _link(model, None).get("name", "")
                above_number = model.links - 1
                own = _pose(child)
                # As in Bullet: further joints are relative to the first one.
                self._joint(model, child, above, below, compose(at if first is None else inverse(first), own))
                if first is None:
                    first, at = own, inverse(own)
                above = below
            elif child.tag == "geom":
                self._geom(model, link, child, defaults)
            elif child.tag == "body":
                self._body(model, child, name, number, defaults)
        if above is not None:
            _join(model, f"jointfix_{next(_count)}_{above_number}", "fixed", above, name, at)
        weighed = _weigh(link, inertial)
        if above is not None:
            # A root that was made for a joint is at the world's origin.
            return ORIGIN, UPRIGHT
        # Bullet puts the centre of mass there.
        return compose(at, inverse(weighed)) if weighed is not None else at

    def _joint(self, model: Model, joint: ElementTree.Element, parent: str, child: str, at: Pose) -> None:
        if joint.get("type") == "fixed":
            name = joint.get("name") or f"joint{next(_count)}"
            model.endless.add(name)
            _join(model, name, "fixed", parent, child, at)
            return
        is_limited = joint.get("limited", "true" if self._is_limited else "false") == "true"
        limits = _numbers(joint.get("range", "")) if is_limited else []
        slides = joint.get("type") == "slide"
        name = joint.get("name") or f"joint{next(_count)}_{model.links - 1}_{len(model.robot.findall('joint'))}"
        if len(limits) != 2:
            model.endless.add(name)
            made = _join(model, name, "prismatic" if slides else "continuous", parent, child, at)
            if slides:
                # A limit of zeros means no limit.
                ElementTree.SubElement(made, "limit", lower="0", upper="0", effort="0", velocity="0")
        else:
            lower, upper = (math.radians(limit) if self._are_degrees and not slides else limit for limit in limits)
            made = _join(model, name, "prismatic" if slides else "revolute", parent, child, at)
            ElementTree.SubElement(made, "limit", lower=repr(lower), upper=repr(upper))
        ElementTree.SubElement(made, "axis", xyz=joint.get("axis", "1 0 0"))

    def _geom(self, model: Model, link: _Link, geom: ElementTree.Element, defaults: _Defaults) -> None:
        element, size, pose = link.element, _numbers(geom.get("size", "")), _pose(geom)
        condim, friction = int(geom.get("condim", defaults.condim)), _numbers(geom.get("friction", ""))
        contact = element.find("contact")
        if contact is not None:
            element.remove(contact)
        contact = ElementTree.SubElement(element, "contact")
        # For spinning and rolling friction Bullet uses the default.
        values = {"lateral_friction": (friction or defaults.friction)[0]}
        if condim > 3:
            values["spinning_friction"] = defaults.friction[1]
        if condim > 4:
            values["rolling_friction"] = defaults.friction[2]
        for what, value in values.items():
            ElementTree.SubElement(contact, what, value=repr(value))
        model.groups[element.get("name", "")] = (
            int(geom.get("contype", defaults.group)),
            int(geom.get("conaffinity", defaults.mask)),
        )
        made = self._shape(model, link, geom, size, pose)
        if made is None:
            return
        shape, pose = made
        rgba = geom.get("rgba", defaults.rgba)
        for what in ("visual", "collision"):
            own = ElementTree.SubElement(element, what)
            set_pose(own, pose)
            ElementTree.SubElement(own, "geometry").append(shape)
            if what == "visual" and rgba and self._has_colors:
                ElementTree.SubElement(ElementTree.SubElement(own, "material", name=rgba), "color", rgba=rgba)

    def _shape(
        self, model: Model, link: _Link, geom: ElementTree.Element, size: list[float], pose: Pose
    ) -> tuple[ElementTree.Element, Pose] | None:
        """Returns the shape as URDF, with its pose in its link. Adds its mass to the link."""
        kind = geom.get("type")
        link.center = ORIGIN
        if kind == "plane":
            flat = plane((0.0, 0.0, 1.0))
            return ElementTree.Element("box", size=text_of(flat.size)), compose(pose, flat.pose)
        if kind == "box":
            x, y, z = (2.0 * side for side in (size if len(size) == 3 else (1.0, 1.0, 1.0)))
            link.volume += x * y * z
            link.shapes.append(Shape(Primitive(constants.GEOM_BOX, (x, y, z), pose)))
            return ElementTree.Element("box", size=text_of((x, y, z))), pose
        if kind == "sphere" and size:
            link.volume += 4.0 / 3.0 * math.pi * size[0] ** 3
            link.shapes.append(Shape(Primitive(constants.GEOM_SPHERE, (size[0],), pose)))
            return ElementTree.Element("sphere", radius=repr(size[0])), pose
        if kind == "mesh":
            path = self._find(self._meshes.get(geom.get("mesh", ""), ""))
            bounds = None if path is None else shape_inertia.bounds_of(path)
            if path is None:
                return None
            model.files[path.name] = path
            if bounds is not None:
                link.shapes.append(shape_inertia.hull(*bounds, pose, 3.0 if path.suffix.lower() == ".obj" else 2.0))
            return ElementTree.Element("mesh", filename=path.name), pose
        if kind not in ("capsule", "cylinder") or not size:
            return None
        return self._round_one(link, geom, kind, size, pose)

    def _round_one(
        self, link: _Link, geom: ElementTree.Element, kind: str, size: list[float], pose: Pose
    ) -> tuple[ElementTree.Element, Pose] | None:
        radius, ends = size[0], _numbers(geom.get("fromto", ""))
        if len(ends) == 6:
            a, b = (ends[0], ends[1], ends[2]), (ends[3], ends[4], ends[5])
            length = math.dist(a, b)
            link.center = ((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (a[2] + b[2]) / 2.0)
            pose = compose(pose, (link.center, _along(a, b)))
        elif len(size) > 1:
            length = 2.0 * size[1]
        else:
            return None
        link.volume += math.pi * radius**2 * length + (4.0 / 3.0 * math.pi * radius**3 if kind == "capsule" else 0.0)
        number = constants.GEOM_CAPSULE if kind == "capsule" else constants.GEOM_CYLINDER
        if kind == "capsule" and len(ends) == 6:
            # A shape of two spheres in Bullet, with a box along the axes of the link.
            half = (0.0, 0.0, length / 2.0)
            tips = [compose(pose, (tip, UPRIGHT))[0] for tip in (half, rotate((1.0, 0.0, 0.0, 0.0), half))]
            lower = (min(tip[0] for tip in tips) - radius, min(tip[1] for tip in tips) - radius, min(tip[2] for tip in tips) - radius)
            upper = (max(tip[0] for tip in tips) + radius, max(tip[1] for tip in tips) + radius, max(tip[2] for tip in tips) + radius)
            link.shapes.append(shape_inertia.hull(lower, upper, (ORIGIN, UPRIGHT), _TWO_SPHERES, 0.0))
        elif kind == "cylinder" and len(ends) == 6:
            # One shape in another, with the mass of a box.
            link.shapes.append(Shape(Primitive(constants.GEOM_BOX, (2.0 * radius, 2.0 * radius, length), pose)))
        else:
            link.shapes.append(Shape(Primitive(number, (radius, length), pose)))
        return ElementTree.Element(kind, radius=repr(radius), length=repr(length)), pose


# Bullet's default margin of shapes from files.
_TWO_SPHERES = 40.0


def _link(model: Model, name: str | None) -> ElementTree.Element:
    name = name or f"link{model.index}_{model.links}"
    model.links += 1
    if name in model.names:
        raise ValueError(f"two bodies have the name {name}")
    model.names.add(name)
    return ElementTree.SubElement(model.robot, "link", name=name)


def _join(model: Model, name: str, kind: str, parent: str, child: str, at: Pose) -> ElementTree.Element:
    joint = ElementTree.SubElement(model.robot, "joint", name=name, type=kind)
    set_pose(joint, at)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    return joint


def _weigh(link: _Link, inertial: ElementTree.Element | None) -> Pose | None:
    """Gives a link its mass, and the inertia of its shapes. Returns its centre of mass; `None` for a massless
    link."""
    frame: Pose = (link.center, UPRIGHT) if inertial is None else _pose(inertial)
    mass = _DENSITY * link.volume if inertial is None else _numbers(inertial.get("mass", "0"))[0]
    if mass <= 0.0:
        return None
    x, y, z = shape_inertia.inertia_of(mass, frame, link.shapes, shape_inertia.MARGIN, 0.0)
    made = ElementTree.SubElement(link.element, "inertial")
    set_pose(made, frame)
    ElementTree.SubElement(made, "mass", value=repr(mass))
    ElementTree.SubElement(made, "inertia", ixx=repr(x), iyy=repr(y), izz=repr(z), ixy="0", ixz="0", iyz="0")
    return frame


def _pose(element: ElementTree.Element) -> Pose:
    position, turn = _numbers(element.get("pos", "")), _numbers(element.get("quat", ""))
    at = (position[0], position[1], position[2]) if len(position) == 3 else ORIGIN
    about = _numbers(element.get("axisangle", ""))
    # Bullet reads it only from geoms.
    if element.tag == "geom" and len(about) == 4:
        # Radians, regardless of the compiler's setting.
        half = about[3] / 2.0
        x, y, z, _ = _unit((about[0], about[1], about[2], 0.0))
        return at, (x * math.sin(half), y * math.sin(half), z * math.sin(half), math.cos(half))
    return at, _unit((turn[1], turn[2], turn[3], turn[0])) if len(turn) == 4 else UPRIGHT


def _unit(turn: Quaternion) -> Quaternion:
    length = math.sqrt(sum(each * each for each in turn))
    return (turn[0] / length, turn[1] / length, turn[2] / length, turn[3] / length) if length > 0.0 else UPRIGHT


def _along(a: Vector, b: Vector) -> Quaternion:
    """Returns the shortest rotation of z to the direction from one point to another."""
    way = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    length = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
    if length <= 0.0:
        return UPRIGHT
    x, y, z = way[0] / length, way[1] / length, way[2] / length
    return (1.0, 0.0, 0.0, 0.0) if z < -1.0 + 1e-12 else _unit((-y, x, 0.0, 1.0 + z))


def _numbers(text: str) -> list[float]:
    """Parses numbers like Bullet: only the beginning of a text such as `0.13/2`."""
    found = (_NUMBER.match(each) for each in text.split())
    return [float(each[0]) if each else 0.0 for each in found]
