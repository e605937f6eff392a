"""loadMJCF: the bodies of an MJCF file, as the daemon reads it."""

from __future__ import annotations

from simd_client.proto import Base, EntityInfo, SetCollisionFilterRequest, methods

from . import constants, descriptions
from .connections import connected
from .errors import error
from .loading import found, settled
from .wire import Spawn


def loadMJCF(mjcfFileName: str, flags: int = 0, physicsClientId: int = 0) -> tuple[int, ...]:
    """Loads the bodies of an MJCF file, which includes others as MuJoCo does. Returns their numbers: first that of
    all that stands still, as PyBullet has a floor before what walks on it, then those that move in the file's order."""
    world = connected(physicsClientId)
    path = found(world, mjcfFileName, "Cannot load MJCF file.")
    self_collision = bool(flags & constants.URDF_USE_SELF_COLLISION)
    try:
        entities, files, paths = world.wire.load_all(path, Spawn())
    except error as refusal:
        raise error(f"Cannot load MJCF file. {refusal}", refusal.reason) from None
    numbers: list[int] = []
    for entity in sorted(entities, key=_moves):
        urdf = world.wire.file(entity.description)
        description = descriptions.read(urdf, 1.0)
        if not self_collision and len(entity.links) > 1:
            # MuJoCo's bodies touch those of the same tree; PyBullet's do where a flag says so.
            change = SetCollisionFilterRequest(robot=entity.name, self_collision=False)
            world.wire.call(methods.SetCollisionFilter, change)
        number = settled(world, entity, description, urdf, files, 1.0)
        body = world.bodies[number]
        body.self_collision, body.paths = self_collision, paths
        numbers.append(number)
    return tuple(numbers)


def _moves(entity: EntityInfo) -> bool:
    return entity.base != Base.BASE_FIXED or entity.moving_joints > 0


__all__ = ["loadMJCF"]
