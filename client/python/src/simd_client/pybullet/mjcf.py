"""loadMJCF: the bodies of an MJCF file. Bullet's reading applies, or the daemon's if the file has elements
that Bullet ignores."""

from __future__ import annotations

import hashlib
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

from simd_client.proto import Base, DescriptionSource, EntityInfo, SetCollisionFilterRequest, methods
from simd_client.surface import Surface

from . import bullet_mjcf, constants, descriptions, filters, finding, spawning
from .connections import connected, search_paths
from .errors import error
from .finding import BulletLocator
from .loading import default_surfaces, found, settled
from .spawning import Spawn
from .world import World

_REFUSAL = "Cannot load MJCF file."


def loadMJCF(
    mjcfFileName: str, flags: int = 0, useMultiBody: int = 1, physicsClientId: int = 0
) -> tuple[int, ...]:
    """Loads the bodies of an MJCF file, in its order, and returns their numbers. If a file has elements that
    Bullet ignores (equalities, masses of geoms, includes), the first number is a body of everything fixed.
    All bodies are multi-bodies."""
    del useMultiBody
    world = connected(physicsClientId)
    path = found(world, mjcfFileName, _REFUSAL)
    try:
        document = descriptions.parse(path.read_bytes())
        made = None
        if document is not None and (bullet_mjcf.is_bullets(document) or bullet_mjcf.has_global_coordinates(document)):
            has_colors = bool(flags & constants.MJCF_COLORS_FROM_FILE)
            made = bullet_mjcf.models(document, lambda name: _beside(path, name), has_colors)
    except (OSError, ValueError, ArithmeticError, RecursionError) as problem:
        raise error(f"{_REFUSAL} {problem}") from None
    if made:
        return tuple(_spawned(world, model, flags) for model in made)
    return _loaded(world, path, flags)


def _beside(mjcf: Path, name: str) -> Path | None:
    """A file within the folder of another."""
    file = mjcf.parent / name
    is_within = name and file.resolve().is_relative_to(mjcf.parent.resolve())
    return file if is_within and file.is_file() else None


def _spawned(world: World, model: bullet_mjcf.Model, flags: int) -> int:
    urdf = ElementTree.tostring(model.robot)
    sent = {uri: path.read_bytes() for uri, path in model.files.items()}
    files = {uri: hashlib.sha256(data).hexdigest() for uri, data in sent.items()}
    spawning.send(world.wire, urdf, files, {files[uri]: data for uri, data in sent.items()})
    description = descriptions.read(urdf, 1.0)
    self_collision = bool(flags & constants.URDF_USE_SELF_COLLISION)
    surfaces = default_surfaces([name for name in description.frames if name not in description.rough], None)
    if model.is_fixed:
        root = model.root.get("name", "")
        surfaces[root] = filters.of_the_world(surfaces.get(root, Surface()))
    for link, (group, mask) in model.groups.items():
        surfaces[link] = replace(surfaces.get(link, Surface()), collision_group=group, collision_mask=mask)
    spawn = Spawn(
        *model.pose,
        fixed=model.is_fixed,
        self_collision=self_collision,
        surfaces=surfaces,
    )
    try:
        entity = spawning.spawn(world.wire, DescriptionSource(urdf=urdf, assets=files), spawn)
    except error as refusal:
        raise error(f"{_REFUSAL} {refusal}", refusal.reason) from None
    number = settled(world, entity, description, urdf, files, 1.0, surfaces)
    body = world.bodies[number]
    body.self_collision, body.paths = self_collision, {uri: str(path) for uri, path in model.files.items()}
    body.model = model.name
    for joint in body.joints:
        if joint.name in model.endless:
            joint.info = (*joint.info[:8], 1.0, 0.0, *joint.info[10:])
    filters.set_parents(world, body, flags)
    return number


def _loaded(world: World, path: Path, flags: int) -> tuple[int, ...]:
    """Loads the file like the daemon: first everything fixed, as PyBullet puts a floor before the walkers."""
    self_collision = bool(flags & constants.URDF_USE_SELF_COLLISION)
    locator = BulletLocator(path, search_paths(world))
    try:
        entities, files, paths = spawning.load_all(world.wire, path, Spawn(), locator)
    except error as refusal:
        raise error(f"{_REFUSAL} {refusal}", refusal.reason) from None
    for uri in locator.missing:
        print(f"simd: {path}: {finding.said(locator, uri)}; the robot is loaded without it", file=sys.stderr)
    numbers: list[int] = []
    for entity in sorted(entities, key=_moves):
        urdf = spawning.file(world.wire, entity.description)
        description = descriptions.read(urdf, 1.0)
        if not self_collision and len(entity.links) > 1:
            # MuJoCo's bodies collide within their tree; PyBullet's need a flag for that.
            change = SetCollisionFilterRequest(robot=entity.name, self_collision=False)
            world.wire.call(methods.SetCollisionFilter, change)
        number = settled(world, entity, description, urdf, files, 1.0, sites=description.empty)
        body = world.bodies[number]
        body.self_collision, body.paths = self_collision, paths
        numbers.append(number)
    return tuple(numbers)


def _moves(entity: EntityInfo) -> bool:
    return entity.base != Base.BASE_FIXED or entity.moving_joints > 0


__all__ = ["loadMJCF"]
