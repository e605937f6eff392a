"""Facts that PyBullet reads from a URDF and the daemon does not report."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field

from .arguments import ORIGIN, UPRIGHT, Pose
from .origins import number_of, pose_of

# Characters allowed around a document.
_BLANK = b" \t\r\n\0"
_COMMENT = re.compile(b"<!--.*?-->", re.DOTALL)
# Attributes with one number each, by element.
_SCALARS = {
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
# Attributes with several numbers, and how many.
_VECTORS = {"origin": ("xyz", "rpy"), "axis": ("xyz",), "box": ("size",)}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_WORDS = re.compile(rb"\A(\s*<\?xml[^>]*\?>)[^<]+")
# An attribute's value without a blank before the next attribute.
_JOINED = re.compile(rb"""(=\s*(?:"[^"<]*"|'[^'<]*'))(?=[A-Za-z_])""")


@dataclass
class Description:
    """Empty for a text that cannot be parsed."""

    # `link_from_inertia` of each link, metres. PyBullet's base positions, link states and joint frames refer
    # to the inertias; the daemon reports centres of mass, and no axes.
    frames: dict[str, Pose] = field(default_factory=dict[str, Pose])
    # Whether the root link's mass is written as 0: PyBullet treats it as a part of the world.
    massless_root: bool = False
    # Links with friction; the others have PyBullet's default.
    rough: frozenset[str] = frozenset()
    # Names of the links, in the file's order.
    links: tuple[str, ...] = ()
    # Links with nothing in them. In a description that the daemon made of an MJCF they are its sites.
    empty: frozenset[str] = frozenset()


def read(urdf: bytes, scale: float) -> Description:
    """Reads a URDF's bytes, with its lengths multiplied by `scale`."""
    robot = parse(urdf)
    if robot is None:
        return Description()
    frames = {name: _frame(link, scale) for link in robot.iter("link") if (name := link.get("name"))}
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    roots = [link for link in robot.iterfind("link") if link.get("name") not in children]
    masses = [mass.get("value", "") for root in roots[:1] for mass in root.iterfind("inertial/mass")]
    rough = {
        link.get("name", "")
        for link in robot.iter("link")
        if link.find("contact/lateral_friction") is not None
    }
    empty = {link.get("name", "") for link in robot.iter("link") if len(link) == 0}
    massless_root = any(_is_zero(mass) for mass in masses)
    return Description(frames, massless_root, frozenset(rough), tuple(frames), frozenset(empty))


def separated(xml: bytes) -> bytes:
    """Inserts blanks between attributes, which Bullet's reader does not require. Removes words between the
    declaration and the document, which Bullet ignores."""
    return _JOINED.sub(rb"\1 ", _WORDS.sub(rb"\1\n", xml))


def with_numbers(urdf: bytes) -> tuple[bytes, list[str]]:
    """Replaces numbers by Bullet's reading: their beginning (`1kg` is 1), and 0 for other text. Returns the
    description and a sentence for each such value."""
    robot, read_as = parse(urdf), list[str]()
    for element in () if robot is None else robot.iter():
        for name in _SCALARS.get(element.tag, ()):
            text = element.get(name)
            if text is None or _is_number(text):
                continue
            element.set(name, _beginning(text))
            read_as.append(f'{element.tag} {name}="{text}" is read as {element.get(name)}')
        for name in _VECTORS.get(element.tag, ()):
            words = element.get(name, "").split()
            if all(map(_is_number, words)):
                continue
            element.set(name, " ".join(map(_beginning, words[:3])))
            read_as.append(f'{element.tag} {name}="{" ".join(words)}" is read as {element.get(name)}')
    return (urdf if robot is None or not read_as else ElementTree.tostring(robot)), read_as


def without_swapped_limits(robot: ElementTree.Element) -> None:
    """Removes limits of position whose lower one is above the upper one: in PyBullet they are none. The daemon would swap them."""
    for limit in robot.iterfind("joint/limit"):
        lower, upper = (number_of(limit, name) or 0.0 for name in ("lower", "upper"))
        if lower > upper:
            # PyBullet's own way to say so.
            limit.set("lower", "0")
            limit.set("upper", "-1")


def _beginning(text: str) -> str:
    """Returns the number that a text begins with, or 0."""
    found = _NUMBER.match(text)
    return found[1] if found else "0"


def parse(urdf: bytes) -> ElementTree.Element | None:
    """Returns the document, or `None` if it cannot or must not be parsed."""
    # No document type: an entity could expand to gigabytes.
    if b"<!DOCTYPE" in urdf or b"<!ENTITY" in urdf:
        return None
    try:
        # Some files begin with blank lines, which are an error before an XML declaration, or end with a zero
        # byte.
        return ElementTree.fromstring(urdf.strip(_BLANK))
    except ElementTree.ParseError:
        pass
    try:
        # Bullet's reader accepts comments with `--` in them.
        return ElementTree.fromstring(separated(_COMMENT.sub(b"", urdf)).strip(_BLANK))
    except ElementTree.ParseError:
        return None


def _frame(link: ElementTree.Element, scale: float) -> Pose:
    inertial = link.find("inertial")
    if inertial is None:
        return ORIGIN, UPRIGHT
    (x, y, z), turn = pose_of(inertial)
    return (x * scale, y * scale, z * scale), turn


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:
        return False
