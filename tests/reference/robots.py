"""Robots of the cases as plain URDF, without shapes or settings of joints; the case has those."""

import functools
import xml.etree.ElementTree as xml
from pathlib import Path

import pybullet_data

ASSETS = Path(__file__).resolve().parent.parent / "assets"
OTHERS = "pybullet_data/"
"""Folder of third-party robots, from the PyPI package `pybullet`."""

FAR = "1e5"
"""A limit of slides that is never reached, m."""


def read(urdf):
    if urdf.startswith(OTHERS):
        path = Path(pybullet_data.getDataPath()) / urdf.removeprefix(OTHERS)
    else:
        path = ASSETS / urdf
    return xml.parse(path).getroot()


@functools.cache
def axes(urdf):
    """Returns (name, joint, axis) of each moving joint axis, in the order of the file."""
    out = []
    for joint in read(urdf).findall("joint"):
        name = joint.get("name")
        match joint.get("type"):
            case "fixed":
                pass
            case "planar":
                out += [(f"{name}.{axis}", name, axis) for axis in range(3)]
            case _:
                out.append((name, name, 0))
    return out


def slides(urdf):
    """Whether a joint of the robot slides."""
    return any(joint.get("type") in ("prismatic", "planar") for joint in read(urdf).findall("joint"))


def plain(urdf, limits, planar_as_chain=False, bounded=False):
    """Returns the text of a robot whose joints have only these limits.

    Turning joints without limits are continuous, or with `bounded`, revolute with far limits: Pinocchio
    has two coordinates for a continuous joint. MuJoCo reads a planar joint; the others get a chain.
    """
    root = read(urdf)
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
        inertial = link.find("inertial")
        if inertial is not None and float(inertial.find("mass").get("value")) == 0:
            # Some files give an inertia without mass. Pinocchio accepts it, simd and MuJoCo do not.
            link.remove(inertial)
    for other in [child for child in root if child.tag not in ("link", "joint")]:
        root.remove(other)
    for joint in root.findall("joint"):
        kind = joint.get("type")
        for tag in ("limit", "dynamics", "mimic", "safety_controller", "calibration"):
            for child in joint.findall(tag):
                joint.remove(child)
        if kind == "planar" and planar_as_chain:
            split(root, joint, bounded)
        elif kind in ("revolute", "continuous", "prismatic"):
            one_axis(joint, limits.get(joint.get("name")), bounded)
    return xml.tostring(root, encoding="unicode")


def one_axis(joint, limits, bounded):
    slides = joint.get("type") == "prismatic"
    if not slides:
        joint.set("type", "revolute" if limits or bounded else "continuous")
    if slides or limits or bounded:
        lower, upper = limits or (f"-{FAR}", FAR)
        attributes = {"lower": str(lower), "upper": str(upper), "effort": "1e9", "velocity": "1e9"}
        xml.SubElement(joint, "limit", attributes)


def split(root, joint, bounded):
    """Replaces a planar joint whose normal is z by two slides and a turn through links without mass."""
    assert joint.find("axis").get("xyz") == "0 0 1"
    name, child = joint.get("name"), joint.find("child").get("link")
    parent, origin = joint.find("parent").get("link"), joint.find("origin")
    root.remove(joint)
    links = [parent, f"{name}.after_0", f"{name}.after_1", child]
    for axis, (kind, direction) in enumerate([("prismatic", "1 0 0"), ("prismatic", "0 1 0"), ("revolute", "0 0 1")]):
        if axis < 2:
            xml.SubElement(root, "link", {"name": links[axis + 1]})
        part = xml.SubElement(root, "joint", {"name": f"{name}.{axis}", "type": kind})
        xml.SubElement(part, "parent", {"link": links[axis]})
        xml.SubElement(part, "child", {"link": links[axis + 1]})
        xml.SubElement(part, "axis", {"xyz": direction})
        if axis == 0 and origin is not None:
            part.append(origin)
        one_axis(part, None, bounded)
