"""Changes of a description before it is loaded: by flags of loadURDF links without shapes, and links that fixed
joints hold together as one. Elements for other programs are left out. Links without visuals show their collision
shapes."""

from __future__ import annotations

import copy
import math
import xml.etree.ElementTree as ElementTree
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import constants, descriptions
from .arguments import ORIGIN, UPRIGHT, Pose
from .origins import number_of, pose_of, set_pose
from .rotations import compose

if TYPE_CHECKING:
    from .world import World

# Flags that `applied` carries out.
APPLIED = constants.URDF_IGNORE_VISUAL_SHAPES | constants.URDF_IGNORE_COLLISION_SHAPES | constants.URDF_MERGE_FIXED_LINKS
# Elements of a robot that PyBullet reads, and those of sensors, which move nothing.
_READ = {"link", "joint", "material", "sensor"}
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def applied(urdf: bytes, flags: int, is_fixed: bool) -> bytes:
    """Returns the description after these flags. Text that cannot be parsed is returned as it is."""
    robot = descriptions.parse(urdf)
    if robot is None:
        return urdf
    for flag, tag in ((constants.URDF_IGNORE_VISUAL_SHAPES, "visual"), (constants.URDF_IGNORE_COLLISION_SHAPES, "collision")):
        for link in robot.iterfind("link") if flags & flag else ():
            for shape in link.findall(tag):
                link.remove(shape)
    if flags & constants.URDF_MERGE_FIXED_LINKS:
        _Tree(robot).merge(is_fixed)
    _leave_out_settings(robot)
    descriptions.without_swapped_limits(robot)
    show_collisions(robot)
    return ElementTree.tostring(robot)


def _leave_out_settings(robot: ElementTree.Element) -> None:
    """Removes what Gazebo, ROS 2 control and others would read: self-collision, friction, drives and initial
    positions, which PyBullet does not know."""
    for element in list(robot):
        for setting in list(element) if element.tag == "gazebo" else ():
            if setting.tag != "sensor":
                element.remove(setting)
        if element.tag not in _READ and not (element.tag == "gazebo" and len(element)):
            robot.remove(element)


def show_collisions(robot: ElementTree.Element) -> None:
    """Makes visuals of the collision shapes of links that have none, as PyBullet does."""
    for link in robot.iterfind("link"):
        if link.find("visual") is None:
            for shape in link.findall("collision"):
                visual = copy.deepcopy(shape)
                visual.tag = "visual"
                link.append(visual)


def names(flags: int) -> str:
    """Returns PyBullet's names of these flags, and the number of what has none."""
    known = {name: value for name, value in vars(constants).items() if name.startswith("URDF_") and flags & value}
    rest = flags & ~sum(set(known.values()))
    return ", ".join([*known, *([str(rest)] if rest else [])])


def is_damped(world: World, function: str, has_maximal_coordinates: int, links: int) -> bool:
    """Returns whether a new body's links are damped. A single link in maximal coordinates is a rigid body of Bullet, which is
    not. Other bodies are the same in all coordinates here."""
    if has_maximal_coordinates and links > 1:
        world.say_once(f"{function}: useMaximalCoordinates has no effect on bodies with joints")
    return not has_maximal_coordinates or links > 1


class _Tree:
    """The links of a robot and the joints below each, in the file's order."""

    def __init__(self, robot: ElementTree.Element) -> None:
        self._robot = robot
        self._links = {link.get("name", ""): link for link in robot.iterfind("link")}
        self._joints: dict[str, list[ElementTree.Element]] = {name: [] for name in self._links}
        for joint in robot.iterfind("joint"):
            if _end(joint, "child") in self._links:
                self._joints.get(_end(joint, "parent"), []).append(joint)
        below = {_end(joint, "child") for joints in self._joints.values() for joint in joints}
        self._roots = [name for name in self._links if name not in below]

    def merge(self, is_fixed: bool) -> None:
        """Merges each link with those that fixed joints hold to it, as PyBullet does, and orders links and joints like PyBullet."""
        if len(self._roots) != 1:
            return
        root = self._roots[0]
        waiting, order = [root], [root]
        while waiting:
            name = waiting.pop()
            is_still = name == root and (is_fixed or _mass(self._links[name]) == 0.0)
            self._merge_into(name, is_still)
            children = [_end(joint, "child") for joint in self._joints[name]]
            order.extend(children)
            waiting.extend(reversed(children))
        for element in (*self._links.values(), *self._robot.findall("joint")):
            self._robot.remove(element)
        self._robot.extend([self._links[name] for name in order])
        self._robot.extend([joint for name in order for joint in self._joints[name]])

    def _merge_into(self, name: str, is_still: bool) -> None:
        """Merges the links below fixed joints; a base that stands still keeps its mass."""
        link, joints = self._links[name], self._joints[name]
        own = link.find("inertial")
        if own is not None and any(joint.get("type") == "fixed" for joint in joints):
            # PyBullet forgets where the masses of merged links are.
            set_pose(own, (ORIGIN, UPRIGHT))
        at = 0
        # Joints of merged links come last.
        while at < len(joints):
            joint = joints[at]
            if joint.get("type") != "fixed":
                at += 1
                continue
            del joints[at]
            child = self._links[_end(joint, "child")]
            way = pose_of(joint)
            for shape in (*child.iterfind("visual"), *child.iterfind("collision")):
                set_pose(shape, compose(way, pose_of(shape)))
                link.append(shape)
            if not is_still:
                _add_inertia(link, child, way)
            for below in self._joints[_end(joint, "child")]:
                set_pose(below, compose(way, pose_of(below)))
                below.find("parent").set("link", name)  # pyright: ignore[reportOptionalMemberAccess]
                joints.append(below)


def _add_inertia(link: ElementTree.Element, child: ElementTree.Element, way: Pose) -> None:
    """Adds the mass of a child, which is where its frame is. As in PyBullet, its inertia is added as if its axes were the link's, and
    the sum has no products."""
    own, other = _inertial(link), _inertial(child)
    masses = [_mass(link), _mass(child)]
    total = sum(masses)
    if not (total > 0.0 and math.isfinite(total)):
        return
    places = [pose_of(own)[0], way[0]]
    center = np.average(np.array(places), axis=0, weights=masses)
    tensor = np.zeros((3, 3))
    for inertial, mass, place in zip((own, other), masses, places, strict=True):
        reach = np.array(place) - center
        tensor += _tensor(inertial) + mass * (reach @ reach * np.eye(3) - np.outer(reach, reach))
    moments, axes = np.linalg.eigh(tensor)
    # Each principal moment belongs to the axis that is nearest to its own.
    order = np.argsort(np.abs(axes).argmax(axis=0), kind="stable")
    x, y, z = moments[order].tolist()
    for element in list(own):
        own.remove(element)
    ElementTree.SubElement(own, "mass", value=repr(total))
    ElementTree.SubElement(own, "inertia", ixx=repr(x), iyy=repr(y), izz=repr(z), ixy="0", ixz="0", iyz="0")
    set_pose(own, ((float(center[0]), float(center[1]), float(center[2])), UPRIGHT))


def _inertial(link: ElementTree.Element) -> ElementTree.Element:
    """Returns the masses of a link; without any, PyBullet gives it 1 kg."""
    inertial = link.find("inertial")
    if inertial is None:
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "mass", value="1")
        ElementTree.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1")
    return inertial


def _mass(link: ElementTree.Element) -> float:
    mass = link.find("inertial/mass")
    if mass is None:
        return 0.0 if link.get("name") == "world" and link.find("inertial") is None else 1.0
    return number_of(mass, "value") or 0.0


def _tensor(inertial: ElementTree.Element) -> NDArray[np.float64]:
    inertia = inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (number_of(inertia, name) or 0.0 for name in _MOMENTS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _end(joint: ElementTree.Element, tag: str) -> str:
    found = joint.find(tag)
    return "" if found is None else found.get("link", "")
