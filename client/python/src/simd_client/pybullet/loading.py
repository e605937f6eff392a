"""Loads and removes robots: loadURDF and related functions."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any, cast

from simd_client.assets import Missing
from simd_client.expansion import is_xacro
from simd_client.proto import EntityInfo
from simd_client.surface import Surface

from . import constants, data, descriptions, filters, finding, load_flags, outside_limits, shape_inertia, spawning
from .arguments import UPRIGHT, Function, quaternion, vector
from .connections import connected, search_paths
from .descriptions import Description
from .errors import error
from .finding import BulletLocator
from .spawning import Spawn
from .world import World

# Flags without effect, or for simd's normal behaviour.
_GRANTED = (
    constants.URDF_USE_INERTIA_FROM_FILE
    | constants.URDF_USE_IMPLICIT_CYLINDER
    | constants.URDF_ENABLE_CACHED_GRAPHICS_SHAPES
    | constants.URDF_MAINTAIN_LINK_ORDER
    | constants.URDF_GLOBAL_VELOCITIES_MB
    | constants.URDF_USE_MATERIAL_COLORS_FROM_MTL
    | constants.URDF_USE_MATERIAL_TRANSPARANCY_FROM_MTL
    | constants.URDF_GOOGLEY_UNDEFINED_COLORS
    | constants.URDF_PRINT_URDF_INFO
    | constants.URDF_USE_SELF_COLLISION
    | constants.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
    | constants.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS
    | constants.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
    # Bodies at rest sleep, and what is touched wakes.
    | constants.URDF_ENABLE_SLEEPING
    | constants.URDF_ENABLE_WAKEUP
    | load_flags.APPLIED
)
# For links without friction in their description.
_FRICTION = 0.5
# Warnings about values that are read differently from their text.
_MAX_MESSAGES = 8


def _old_forms(function: Function) -> Function:
    """Also accepts position and orientation as three, or as seven numbers, like PyBullet."""

    @functools.wraps(function)
    def loading(*arguments: Any, **named: Any) -> int:
        file, *numbers = arguments if len(arguments) in (4, 8) else (None,)
        if numbers and isinstance(numbers[0], (int, float)):
            return function(file, numbers[:3], numbers[3:] or None, **named)
        return function(*arguments, **named)

    return cast(Function, loading)


@_old_forms
def loadURDF(
    fileName: str,
    basePosition: Any = (0.0, 0.0, 0.0),
    baseOrientation: Any = None,
    useMaximalCoordinates: int = 0,
    useFixedBase: int = 0,
    flags: int = 0,
    globalScaling: float = 1.0,
    physicsClientId: int = 0,
) -> int:
    """Loads a robot from this disk with its root link's frame at a pose. Returns its number."""
    world = connected(physicsClientId)
    path = found(world, fileName, "Cannot load URDF file.")
    ignored = load_flags.names(flags & ~_GRANTED)
    if ignored:
        world.say_once(f"loadURDF: {ignored} {'has' if ', ' not in ignored else 'have'} no effect")
    try:
        urdf = descriptions.separated(path.read_bytes())
    except OSError as problem:
        raise error(f"Cannot load URDF file. {problem}") from None
    if not is_xacro(path):
        urdf, read_as = descriptions.with_numbers(urdf)
        if read_as:
            more = f", and {len(read_as) - _MAX_MESSAGES} more" if len(read_as) > _MAX_MESSAGES else ""
            world.say_once(f"loadURDF: {fileName}: {'; '.join(read_as[:_MAX_MESSAGES])}{more}")
        urdf = load_flags.applied(urdf, flags, bool(useFixedBase))
    description = descriptions.read(urdf, globalScaling)
    spawn = Spawn(
        position=vector(basePosition, "basePosition needs 3 coordinates [x,y,z]."),
        orientation=quaternion(
            UPRIGHT if baseOrientation is None else baseOrientation, "baseOrientation needs to be [x,y,z,w]."
        ),
        fixed=True if useFixedBase or description.massless_root else None,
        scale=globalScaling,
        self_collision=bool(flags & constants.URDF_USE_SELF_COLLISION),
        damped=load_flags.is_damped(world, "loadURDF", useMaximalCoordinates, len(description.links)),
    )
    try:
        urdf, (entity, files, paths) = _loaded(world, path, urdf, spawn, flags)
    except error as refusal:
        raise error(f"Cannot load URDF file. {refusal}", refusal.reason) from None
    order = description.links if flags & constants.URDF_MAINTAIN_LINK_ORDER else ()
    number = settled(world, entity, description, urdf, files, globalScaling, link_order=order)
    body = world.bodies[number]
    body.self_collision, body.paths, body.file = spawn.self_collision, paths, str(fileName)
    body.shape_margin = shape_inertia.MARGIN
    body.has_round_cylinders = bool(flags & constants.URDF_USE_IMPLICIT_CYLINDER)
    filters.set_parents(world, body, flags)
    return number


def _loaded(
    world: World, path: Path, urdf: bytes, spawn: Spawn, flags: int
) -> tuple[bytes, tuple[EntityInfo, dict[str, str], dict[str, str]]]:
    """Spawns a robot with PyBullet's masses and inertias, else with the file's. Returns also its
    description."""
    locator = BulletLocator(path, search_paths(world))
    if is_xacro(path) or not spawn.scale > 0.0:
        return urdf, spawning.load(world.wire, path, spawn, locator)
    _check_meshes(urdf, locator)
    from_file = bool(flags & constants.URDF_USE_INERTIA_FROM_FILE)
    are_round = bool(flags & constants.URDF_USE_IMPLICIT_CYLINDER)
    edited = shape_inertia.as_in_pybullet(urdf, _locate(locator), spawn.scale, from_file, are_round, world.keeps_mimic)
    try:
        return edited, spawning.load(world.wire, path, spawn, locator, edited)
    except error as refusal:
        if not refusal.reason:
            raise
    # Errors are reported by the lines of the file.
    return urdf, spawning.load(world.wire, path, spawn, locator)


def _check_meshes(urdf: bytes, locator: BulletLocator) -> None:
    """Refuses a file with a missing mesh, like PyBullet.

    Raises:
        error: that names the link, and where the mesh was looked for.
    """
    robot = descriptions.parse(urdf)
    for link in () if robot is None else robot.iterfind("link"):
        for mesh in (*link.iterfind("visual/geometry/mesh"), *link.iterfind("collision/geometry/mesh")):
            uri = mesh.get("filename", "")
            if uri and _locate(locator)(uri) is None:
                raise error(f"link {link.get('name', '')}: {finding.said(locator, uri)}")


def _locate(locator: BulletLocator) -> shape_inertia.Locate:
    """Returns the files that a description names, with their paths."""

    def locate(uri: str) -> Path | None:
        try:
            return locator.find(uri)
        except Missing:
            return None

    return locate


def settled(
    world: World,
    entity: EntityInfo,
    description: Description,
    urdf: bytes,
    files: dict[str, str],
    scale: float,
    surfaces: dict[str, Surface] | None = None,
    link_order: Sequence[str] = (),
    sites: Collection[str] = (),
) -> int:
    """Adds a spawned robot with these surfaces, or with PyBullet's. Its joints have PyBullet's default
    motors, and are numbered in the order of the named links, if given, without those of sites. As in PyBullet they begin at 0, also
    outside of their limits. Returns its number."""
    body = world.add(entity, description.frames, own=True, urdf=urdf, link_order=link_order, sites=sites)
    body.files, body.scale = files, scale
    if surfaces is None:
        smooth = [link.name for link in entity.links if link.name not in description.rough]
        world.set_surfaces(body, default_surfaces(smooth, body.base_link if body.fixed else None))
    else:
        body.surfaces.update(surfaces)
    outside_limits.begin_at_zero(world, body)
    world.drive(body, (index for index, joint in enumerate(body.joints) if joint.has_motor))
    world.sent_if_playing()
    return body.unique_id


def default_surfaces(links: Iterable[str], fixed: str | None) -> dict[str, Surface]:
    """Returns PyBullet's surfaces, for links without one in the description, and for a fixed base."""
    surfaces = {link: Surface(friction=_FRICTION) for link in links}
    if fixed is not None:
        surfaces[fixed] = filters.of_the_world(surfaces.get(fixed, Surface()))
    return surfaces


def found(world: World, name: str, refusal: str) -> Path:
    """Finds the file of that name like PyBullet."""
    places = finding.places(name, search_paths(world))
    for place in places:
        if place.is_file():
            return place
    looked = ", ".join(str(place) for place in places)
    import_hooks = f". {data.WHAT_TO_DO}" if str(data.OWN) in search_paths(world) else ""
    raise error(f"{refusal} Not found: {looked}{import_hooks}")


def setAdditionalSearchPath(path: str, physicsClientId: int = 0) -> None:
    """Adds a path for files outside the working folder; the newest path is searched first."""
    connected(physicsClientId).search_paths.append(str(path))


def removeBody(bodyUniqueId: int, physicsClientId: int = 0) -> None:
    """Removes a robot from the world."""
    world = connected(physicsClientId)
    body = world.bodies.get(bodyUniqueId)
    # PyBullet only warns about an unknown body.
    if body is not None:
        world.remove(body)


def getNumBodies(physicsClientId: int = 0) -> int:
    """Returns the number of robots, other clients' included."""
    return len(connected(physicsClientId).bodies)


def getBodyUniqueId(serialIndex: int, physicsClientId: int = 0) -> int:
    """Returns the number of the robot at that index; -1 beyond the last."""
    numbers = connected(physicsClientId).serial
    return numbers[serialIndex] if 0 <= serialIndex < len(numbers) else -1


def getBodyInfo(bodyUniqueId: int, physicsClientId: int = 0) -> tuple[bytes, bytes]:
    """Returns the names of the root link and of the robot's description."""
    body = connected(physicsClientId).body(bodyUniqueId, "Couldn't get body info")
    return body.base_link.encode(), body.model.encode()


def syncBodyInfo(physicsClientId: int = 0) -> None:
    """Updates the list of robots with those that other clients spawned and deleted."""
    connected(physicsClientId).sync()


__all__ = [
    "getBodyInfo",
    "getBodyUniqueId",
    "getNumBodies",
    "loadURDF",
    "removeBody",
    "setAdditionalSearchPath",
    "syncBodyInfo",
]
