"""Properties of links and joints: getDynamicsInfo, changeDynamics."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import replace
from math import isfinite, isnan
from pathlib import Path
from typing import Any

from simd_client.proto import (
    LinkInfo,
    SetJointPropertiesRequest,
    methods,
)
from simd_client.surface import Surface

from . import outside_limits, descriptions, shape_inertia, spawning
from .arguments import Vector, vector
from .bodies import Body, put_limits
from .connections import connected
from .constants import (
    ACTIVATION_STATE_DISABLE_SLEEPING,
    ACTIVATION_STATE_DISABLE_WAKEUP,
    ACTIVATION_STATE_ENABLE_SLEEPING,
    ACTIVATION_STATE_SLEEP,
    ACTIVATION_STATE_WAKE_UP,
)
from .errors import error, unsupported
from .respawn import respawn
from .rotations import Matrix, matrix
from .world import World

# PyBullet's values for a link without a collision shape.
_SURFACE = {"lateralFriction": 0.5, "restitution": 0.0, "rollingFriction": 0.0, "spinningFriction": 0.0}
# The daemon's names of them.
_SURFACE_FIELDS = {
    "lateralFriction": "friction",
    "restitution": "restitution",
    "rollingFriction": "rolling_friction",
    "spinningFriction": "spinning_friction",
}
# Damping of the links, and the daemon's names.
_DAMPING_FIELDS = {"linearDamping": "linear_damping", "angularDamping": "angular_damping"}
# PyBullet's default contact parameters.
_CONTACT = {
    "contactDamping": -1.0,
    "contactStiffness": -1.0,
    "collisionMargin": 0.001,
}
# Kept for getDynamicsInfo; only springs of contacts have an effect.
_KEPT = (
    *_CONTACT,
    "frictionAnchor",
    "ccdSweptSphereRadius",
    "contactProcessingThreshold",
    "activationState",
    "anisotropicFriction",
    "sleepThreshold",
)
# The daemon's names of springs of contacts.
_SPRING_RANGE = 1e-3, 1e12
_MAX_DAMPING = 1e6
_SPRING = {"contactStiffness": "contact_stiffness", "contactDamping": "contact_damping"}
_MULTI_BODY = 2


def getDynamicsInfo(bodyUniqueId: int, linkIndex: int, physicsClientId: int = 0) -> tuple[Any, ...]:
    """Returns mass, lateral friction, diagonal inertia, pose of the centre of mass, restitution, and rolling
    and spinning friction. Then follow contact damping and stiffness, kind of body, collision margin."""
    world = connected(physicsClientId)
    body = world.body(bodyUniqueId, "getDynamicsInfo failed; invalid return status")
    name = body.link_name(linkIndex)
    if name is None:
        raise error("invalid linkIndex.")
    link = body.links[body.link_indices[name]]
    kept = {**_CONTACT, **body.kept.get(linkIndex, {}), **_surface(world, body, name)}
    part_of_the_world = linkIndex == -1 and body.fixed
    return (
        0.0 if part_of_the_world else link.mass,
        kept["lateralFriction"],
        (0.0, 0.0, 0.0) if part_of_the_world else _diagonal(body, link),
        *body.frame(name),
        kept["restitution"],
        kept["rollingFriction"],
        kept["spinningFriction"],
        kept["contactDamping"],
        kept["contactStiffness"],
        _MULTI_BODY,
        kept["collisionMargin"],
    )


def _surface(world: World, body: Body, link: str) -> dict[str, float]:
    """Returns the daemon's surface of a link."""
    surface = dict(_SURFACE)
    for properties in world.link_properties(body).links:
        if properties.link == link:
            for name, field in _SURFACE_FIELDS.items():
                if properties.HasField(field):
                    surface[name] = getattr(properties, field)
    return surface


def _diagonal(body: Body, link: LinkInfo) -> Vector:
    """Returns the diagonal of the inertia, in the axes of the description; products are left out, as in
    PyBullet."""
    xx, xy, xz, yy, yz, zz = link.inertia
    inertia: Matrix = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    turn = matrix(body.frame(link.name)[1])
    axes = list(zip(*turn, strict=True))

    def about(axis: tuple[float, ...]) -> float:
        return sum(axis[i] * inertia[i][j] * axis[j] for i in range(3) for j in range(3))

    return about(axes[0]), about(axes[1]), about(axes[2])


def changeDynamics(
    bodyUniqueId: int,
    linkIndex: int,
    mass: float | None = None,
    lateralFriction: float | None = None,
    spinningFriction: float | None = None,
    rollingFriction: float | None = None,
    restitution: float | None = None,
    linearDamping: float | None = None,
    angularDamping: float | None = None,
    contactStiffness: float | None = None,
    contactDamping: float | None = None,
    frictionAnchor: int | None = None,
    localInertiaDiagonal: Any = None,
    ccdSweptSphereRadius: float | None = None,
    contactProcessingThreshold: float | None = None,
    activationState: int | None = None,
    jointDamping: float | None = None,
    anisotropicFriction: Any = None,
    maxJointVelocity: float | None = None,
    collisionMargin: float | None = None,
    jointLowerLimit: float | None = None,
    jointUpperLimit: float | None = None,
    jointLimitForce: float | None = None,
    sleepThreshold: float | None = None,
    physicsClientId: int = 0,
) -> None:
    """Sets mass, inertia, friction and restitution of a link, damping and limits of the joint to its parent,
    and springs of its contacts. Sets linear and angular damping of all links of the body, 1/s, and the maximum
    velocity of all joints, rad/s or m/s. A mass
    without localInertiaDiagonal sets the inertia of the shape, about the centre of mass. Other settings of
    Bullet's solver are kept for getDynamicsInfo, with one warning."""
    given = dict(locals())
    world = connected(physicsClientId)
    body = world.bodies.get(bodyUniqueId)
    if body is None or body.link_name(linkIndex) is None:
        # PyBullet accepts it, and changes nothing.
        world.say_once(f"changeDynamics: there is no link {linkIndex} of body {bodyUniqueId}; the call does nothing")
        return
    surface = {field: _within(field, float(given[name])) for name, field in _SURFACE_FIELDS.items() if given[name] is not None}
    for name, field in _SPRING.items():
        if given[name] is not None:
            surface[field] = _of_spring(float(given[name]))
    if surface:
        _set_surface(world, body, linkIndex, surface)
    damping = {
        field: min(float(given[name]), _MAX_DAMPING)
        for name, field in _DAMPING_FIELDS.items()
        if given[name] is not None and given[name] >= 0.0
    }
    if damping:
        of_all = {link: replace(body.surfaces.get(link, Surface()), **damping) for link in body.link_indices}
        world.set_surfaces(body, of_all)
    kept = {name: given[name] for name in _KEPT if given[name] is not None}
    if kept:
        body.kept.setdefault(linkIndex, {}).update(kept)
        idle = [name for name in kept if name not in _SPRING and name != "activationState"]
        if idle:
            world.say_once(f"changeDynamics: {', '.join(idle)} are kept, and do nothing")
    if activationState is not None:
        _set_activation(world, body, int(activationState))
    if jointLimitForce is not None:
        world.say_once("changeDynamics: jointLimitForce does nothing: limits keep their maximum of 100 N m s per step")
    if mass is not None or localInertiaDiagonal is not None:
        _set_mass(world, body, linkIndex, mass, localInertiaDiagonal)
        body = world.bodies[bodyUniqueId]
    if 0 <= linkIndex and any(value is not None for value in (jointDamping, jointLowerLimit, jointUpperLimit)):
        _set_joint(world, body, linkIndex, jointDamping, jointLowerLimit, jointUpperLimit)
    if maxJointVelocity is not None and maxJointVelocity >= 0.0:
        _set_speed(world, body, float(maxJointVelocity))


def _set_activation(world: World, body: Body, state: int) -> None:
    """Switches the sleep of a whole body, as PyBullet does, regardless of the link."""
    stays_awake = bool(body.stays_awake)
    if state & ACTIVATION_STATE_ENABLE_SLEEPING:
        stays_awake = False
    if state & ACTIVATION_STATE_DISABLE_SLEEPING:
        stays_awake = True
    if state & (ACTIVATION_STATE_ENABLE_SLEEPING | ACTIVATION_STATE_DISABLE_SLEEPING | ACTIVATION_STATE_WAKE_UP):
        world.set_stays_awake(body, stays_awake)
    if state & ACTIVATION_STATE_SLEEP:
        world.say_once("changeDynamics: ACTIVATION_STATE_SLEEP does nothing: a body sleeps once it has rested for a second")
    if state & ACTIVATION_STATE_DISABLE_WAKEUP:
        world.say_once("changeDynamics: ACTIVATION_STATE_DISABLE_WAKEUP does nothing: what is touched wakes")


def _of_spring(value: float) -> float:
    """Returns a value that the daemon accepts. Bullet's -1 means none, and Bullet's value for rigid becomes
    the maximum stiffness. The daemon refuses NaN."""
    if value <= 0.0:
        return 0.0
    least, most = _SPRING_RANGE
    return value if isnan(value) else min(max(value, least), most)


def _set_surface(world: World, body: Body, index: int, given: Mapping[str, float]) -> None:
    link = body.link_name(index) or ""
    wanted = replace(body.surfaces.get(link, Surface()), **given)
    world.set_surfaces(body, {link: wanted})


def _within(field: str, value: float) -> float:
    """Clamps a value to the daemon's range: PyBullet accepts any."""
    return min(max(value, 0.0), 1.0 if field == "restitution" else 1e6)


def _set_joint(
    world: World,
    body: Body,
    index: int,
    damping: float | None,
    lower: float | None,
    upper: float | None,
) -> None:
    joint = body.joints[index]
    if joint.width != 1:
        return
    request = SetJointPropertiesRequest(robot=body.robot)
    properties = request.joints.add(joint=joint.name)
    if damping is not None:
        properties.damping = joint.damping = float(damping)
    # As in PyBullet, a missing lower limit is 1 and a missing upper one -1. Limits in the wrong order change nothing.
    low, high = 1.0 if lower is None else float(lower), -1.0 if upper is None else float(upper)
    new = (low, high, *joint.limits[2:])
    if low <= high and new != joint.limits:
        joint.limits = new
        put_limits(properties.limits, joint.limits)
        world.beyond.pop((body.unique_id, index), None)
    world.wire.call(methods.SetJointProperties, request)
    info = list(joint.info)
    info[6] = joint.damping
    if joint.limits[0] is not None and joint.limits[1] is not None:
        info[8], info[9] = joint.limits[0], joint.limits[1]
    else:
        info[8], info[9] = 0.0, -1.0
    joint.info = tuple(info)  # pyright: ignore[reportAttributeAccessIssue]


def _set_speed(world: World, body: Body, speed: float) -> None:
    """Sets it for all joints of the body, as in PyBullet, regardless of the named link; getJointInfo still
    returns the description's."""
    for index, joint in enumerate(body.joints):
        if joint.width == 1:
            joint.limits = (*joint.limits[:3], speed if isfinite(speed) else None)
            outside_limits.send(world, body, index)


def _set_mass(world: World, body: Body, index: int, mass: float | None, diagonal: Any) -> None:
    """Sets a link's mass. The mass belongs to the description: the robot is loaded again from an edited one,
    in place. As in PyBullet, a base with the mass 0 is fixed to the world, and a base that gets another mass
    becomes free."""
    if mass is not None and mass < 0.0:
        mass = None
    if mass == 0.0 and index == -1:
        if not body.fixed:
            respawn(world, body, "changeDynamics", fixed=True, pose=world.root(body)[0])
        return
    if body.urdf is None:
        raise unsupported("changeDynamics", "masses change only of robots that this script loaded")
    robot = descriptions.parse(body.urdf)
    name = body.link_name(index)
    link = None if robot is None else next((l for l in robot.iter("link") if l.get("name") == name), None)
    if robot is None or link is None:
        raise error(f"changeDynamics: the description of {body.robot} cannot be edited")
    old = body.links[body.link_indices[name or ""]]
    weight = old.mass if mass is None else float(mass)
    # The description's lengths are not scaled yet, and an inertia grows with their square.
    unit = body.scale * body.scale
    if diagonal is not None:
        x, y, z = (i / unit for i in vector(diagonal, "localInertiaDiagonal needs three numbers"))
    else:
        # If the shape is unknown, the inertia is scaled with the mass.
        factor = (weight / old.mass if old.mass else 1.0) / unit
        x, y, z = _of_shape(body, link, weight) or (i * factor for i in _diagonal(body, old))
    _write_inertia(link, weight, (x, y, z), body)
    text = ElementTree.tostring(robot)
    if mass and index == -1 and body.fixed:
        respawn(world, body, "changeDynamics", fixed=False, pose=world.root(body)[0], urdf=text)
        return
    entity = spawning.reload(world.wire, body.robot, text, body.files)
    world.replaced(body, entity, body.frames, text)


def _of_shape(body: Body, link: ElementTree.Element, mass: float) -> Vector | None:
    """Returns PyBullet's diagonal for a link with its mass, in the description's lengths. It comes from the
    collision shape, regardless of the earlier diagonal."""
    if body.shape_margin is None or (body.shape_margin == 0.0 and link.find("collision") is None):
        return None

    def locate(uri: str) -> Path | None:
        return Path(body.paths[uri]) if body.paths.get(uri) else None

    margin = body.shape_margin / body.scale
    return shape_inertia.of_link(link, mass, locate, margin, body.has_round_cylinders)


def _write_inertia(link: ElementTree.Element, mass: float, diagonal: Vector, body: Body) -> None:
    inertial = link.find("inertial")
    if inertial is None:
        inertial = ElementTree.SubElement(link, "inertial")
        x, y, z = (value / body.scale for value in body.frame(link.get("name", ""))[0])
        ElementTree.SubElement(inertial, "origin", xyz=f"{x!r} {y!r} {z!r}")
    for tag in ("mass", "inertia"):
        for old in inertial.findall(tag):
            inertial.remove(old)
    ElementTree.SubElement(inertial, "mass", value=repr(mass))
    x, y, z = diagonal
    ElementTree.SubElement(
        inertial, "inertia", ixx=repr(x), iyy=repr(y), izz=repr(z), ixy="0", ixz="0", iyz="0"
    )


def computeDofCount(bodyUniqueId: int, physicsClientId: int = 0) -> int:
    """Returns degrees of freedom of the joints; PyBullet leaves a free base out too."""
    body = connected(physicsClientId).bodies.get(bodyUniqueId)
    return sum(joint.width for joint in body.joints) if body else 0


def setDefaultContactERP(defaultContactERP: float, physicsClientId: int = 0) -> None:
    """Sets the part of an overlap that the velocity of a step removes."""
    world = connected(physicsClientId)
    if not world.set_contacts(error_reduction=max(float(defaultContactERP), 0.0)):
        world.say_once("setDefaultContactERP: the world of another client has its own contacts")


__all__ = ["changeDynamics", "computeDofCount", "getDynamicsInfo", "setDefaultContactERP"]
