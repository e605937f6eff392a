"""loadSDF: converts the models of an SDF file to URDF, as far as Bullet reads them.

A joint's frame is its child link's frame, as in Bullet: the joint's own pose is ignored. Lights, plugins,
nested models, and settings of Gazebo's physics are ignored too.
"""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

from simd_client.proto import DescriptionSource

from . import descriptions, load_flags, shape_inertia, spawning
from .arguments import ORIGIN, UPRIGHT, Pose, Vector, vector
from .connections import connected, search_paths
from .errors import error, unsupported
from .loading import found, settled
from .origins import set_pose
from .primitives import plane
from .rotations import compose, from_euler, inverse
from .spawning import Spawn
from .world import World

_JOINTS = ("revolute", "prismatic", "fixed", "continuous", "spherical")
_ENDLESS = 1e15


@dataclass
class Model:
    """One model as URDF."""

    urdf: bytes
    # world_from_root.
    pose: Pose
    fixed: bool
    # Factor of its lengths.
    scale: float
    # Files on the script's disk, by the name in the URDF.
    files: dict[str, Path] = field(default_factory=dict[str, Path])


def loadSDF(
    sdfFileName: str, useMaximalCoordinates: int = 0, globalScaling: float = 1.0, physicsClientId: int = 0
) -> tuple[int, ...]:
    """Loads the models of an SDF file. Returns their numbers."""
    world = connected(physicsClientId)
    refusal = "Cannot load SDF file."
    path = found(world, sdfFileName, refusal)
    try:
        document = descriptions.parse(path.read_bytes())
    except OSError as problem:
        raise error(f"{refusal} {problem}") from None
    if document is None or document.tag != "sdf":
        raise error(f"{refusal} {path} has no element sdf")
    scale = float(globalScaling)
    if not 0.0 < scale < float("inf"):
        raise error(f"{refusal} globalScaling must be above 0, and not {scale:g}")
    models = [_model(world, path, each, scale) for each in document.iter("model")]
    if not models:
        raise error(f"{refusal} {path} has no model")
    return tuple(_spawned(world, model, useMaximalCoordinates) for model in models)


def _spawned(world: World, model: Model, has_maximal_coordinates: int) -> int:
    scale = model.scale
    sent: dict[str, bytes] = {}
    files: dict[str, str] = {}
    for uri, path in model.files.items():
        data = path.read_bytes()
        files[uri] = hashlib.sha256(data).hexdigest()
        sent[files[uri]] = data
    spawning.send(world.wire, model.urdf, files, sent)
    position: Vector = (model.pose[0][0] * scale, model.pose[0][1] * scale, model.pose[0][2] * scale)
    description = descriptions.read(model.urdf, scale)
    damped = load_flags.is_damped(world, "loadSDF", has_maximal_coordinates, len(description.links))
    spawn = Spawn(position, model.pose[1], fixed=model.fixed, scale=scale, damped=damped)
    try:
        entity = spawning.spawn(world.wire, DescriptionSource(urdf=model.urdf, assets=files), spawn)
    except error as refusal:
        raise error(f"Cannot load SDF file. {refusal}", refusal.reason) from None
    number = settled(world, entity, description, model.urdf, files, scale)
    body = world.bodies[number]
    body.paths, body.shape_margin = {uri: str(path) for uri, path in model.files.items()}, shape_inertia.MARGIN
    return number


def _model(world: World, path: Path, model: ElementTree.Element, scale: float) -> Model:
    links = {link.get("name", ""): link for link in model.iterfind("link")}
    joints = [joint for joint in model.iterfind("joint") if joint.findtext("child", "").strip() in links]
    children = {joint.findtext("child", "").strip() for joint in joints if joint.findtext("parent", "").strip() in links}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise unsupported("loadSDF", f"model {model.get('name')} has {len(roots)} links without a parent, and not one")
    root = links[roots[0]]
    mass = float(root.findtext("inertial/mass", "1"))
    is_static = model.findtext("static", "0").strip() in ("1", "true")
    is_held = any(joint.findtext("parent", "").strip() not in links for joint in joints)
    urdf = ElementTree.Element("robot", name=model.get("name", "model"))
    made = Model(b"", compose(_pose(model), _pose(root)), is_static or is_held or mass == 0.0, scale)
    for link in links.values():
        _link(world, path, made, urdf, link)
    for joint in joints:
        parent = joint.findtext("parent", "").strip()
        if parent in links:
            child = joint.findtext("child", "").strip()
            at = compose(inverse(_pose(links[parent])), _pose(links[child]))
            _joint(urdf, joint, parent, child, at, scale)
    load_flags.show_collisions(urdf)
    made.urdf = shape_inertia.as_in_pybullet(ElementTree.tostring(urdf), made.files.get, scale)
    return made


def _link(world: World, path: Path, model: Model, urdf: ElementTree.Element, link: ElementTree.Element) -> None:
    made = ElementTree.SubElement(urdf, "link", name=link.get("name", ""))
    inertial = link.find("inertial")
    if inertial is not None:
        own = ElementTree.SubElement(made, "inertial")
        set_pose(own, _pose(inertial))
        ElementTree.SubElement(own, "mass", value=inertial.findtext("mass", "1").strip())
        moments = {name: inertial.findtext(f"inertia/{name}", "0").strip() for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        ElementTree.SubElement(own, "inertia", moments)
    # Bullet reads this element of URDF's in SDF too.
    made.extend(link.iterfind("contact"))
    for what in ("visual", "collision"):
        for shape in link.iterfind(what):
            made_of = _geometry(world, path, model, shape.find("geometry"))
            if made_of is None:
                continue
            geometry, pose = made_of
            own = ElementTree.SubElement(made, what)
            set_pose(own, compose(_pose(shape), pose))
            own.append(geometry)
            color = shape.findtext("material/diffuse")
            if what == "visual" and color is not None:
                material = ElementTree.SubElement(own, "material", name="")
                ElementTree.SubElement(material, "color", rgba=color.strip())


def _geometry(
    world: World, path: Path, model: Model, geometry: ElementTree.Element | None
) -> tuple[ElementTree.Element, Pose] | None:
    """Returns the shape as URDF, and its pose in its frame."""
    shape = next(iter(geometry), None) if geometry is not None else None
    if shape is None:
        return None
    made = ElementTree.Element("geometry")

    def text(name: str, default: str) -> str:
        return " ".join(shape.findtext(name, default).split())

    if shape.tag == "box":
        ElementTree.SubElement(made, "box", size=text("size", "1 1 1"))
    elif shape.tag == "sphere":
        # The daemon scales it; in an SDF Bullet leaves a sphere's radius unchanged.
        ElementTree.SubElement(made, "sphere", radius=repr(float(text("radius", "1")) / model.scale))
    elif shape.tag in ("cylinder", "capsule"):
        ElementTree.SubElement(made, shape.tag, radius=text("radius", "1"), length=text("length", "1"))
    elif shape.tag == "mesh":
        uri = text("uri", "")
        mesh = _file(world, path, uri)
        if mesh is None:
            world.say_once(f"loadSDF: the mesh {uri} is not found")
        else:
            model.files[uri] = mesh
        ElementTree.SubElement(made, "mesh", filename=uri, scale=text("scale", "1 1 1"))
    elif shape.tag == "plane":
        flat = plane(vector(text("normal", "0 0 1").split(), "Cannot load SDF file. A normal has 3 numbers"))
        ElementTree.SubElement(made, "box", size=" ".join(map(repr, flat.size)))
        return made, flat.pose
    else:
        world.say_once(f"loadSDF: shapes of the kind {shape.tag} are left out")
        return None
    return made, (ORIGIN, UPRIGHT)


def _file(world: World, path: Path, uri: str) -> Path | None:
    """Returns a file in the folder of the SDF, in a folder above it, or in a search path."""
    name = uri.partition("://")[2] if "://" in uri else uri.lstrip("/")
    folders = [path.parent, path.parent.parent, *map(Path, search_paths(world)), Path()]
    return next((folder / name for folder in folders if (folder / name).is_file()), None)


def _joint(
    urdf: ElementTree.Element, joint: ElementTree.Element, parent: str, child: str, at: Pose, scale: float
) -> None:
    kind = joint.get("type", "")
    if kind not in _JOINTS:
        raise unsupported("loadSDF", f"joint {joint.get('name')} is {kind}, and none of {', '.join(_JOINTS)}")
    lower, upper, effort, velocity = (
        float(joint.findtext(f"axis/limit/{name}", default))
        for name, default in (("lower", "-1e16"), ("upper", "1e16"), ("effort", "0"), ("velocity", "0"))
    )
    if kind == "revolute" and (lower < -_ENDLESS or upper > _ENDLESS or lower > upper):
        kind = "continuous"
    if kind == "prismatic":
        # The daemon scales lengths; in an SDF Bullet leaves these unchanged.
        lower, upper, velocity = lower / scale, upper / scale, velocity / scale
    made = ElementTree.SubElement(urdf, "joint", name=joint.get("name", ""), type=kind)
    set_pose(made, at)
    ElementTree.SubElement(made, "parent", link=parent)
    ElementTree.SubElement(made, "child", link=child)
    if kind in ("fixed", "spherical"):
        return
    ElementTree.SubElement(made, "axis", xyz=" ".join(joint.findtext("axis/xyz", "1 0 0").split()))
    limit = {"effort": repr(effort), "velocity": repr(velocity)}
    if kind != "continuous":
        limit |= {"lower": repr(lower), "upper": repr(upper)}
    ElementTree.SubElement(made, "limit", limit)
    dynamics = {name: joint.findtext(f"axis/dynamics/{name}", "0").strip() for name in ("damping", "friction")}
    ElementTree.SubElement(made, "dynamics", dynamics)


def _pose(element: ElementTree.Element) -> Pose:
    text = element.findtext("pose")
    if text is None:
        return ORIGIN, UPRIGHT
    try:
        x, y, z, roll, pitch, yaw = (float(each) for each in text.split())
    except ValueError:
        raise error(f"Cannot load SDF file. A pose has 6 numbers, and not `{text.strip()}`") from None
    return (x, y, z), from_euler(roll, pitch, yaw)


__all__ = ["loadSDF"]
