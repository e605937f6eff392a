"""Robots that a script brings into its world: their files, their descriptions, and the options of their spawns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from simd_client.assets import Locator
from simd_client.blocking.upload import fetch_file, upload_files
from simd_client.description_files import PART_BYTES, DescriptionFiles
from simd_client.errors import SimdError
from simd_client.proto import (
    AssetState,
    Base,
    DescriptionSource,
    EntityInfo,
    MeshShapes,
    PrepareDescriptionRequest,
    ReloadEntityRequest,
    SpawnEntityRequest,
    SpawnEntityResponse,
    UploadAssetRequest,
    methods,
)
from simd_client.surface import Surface, surfaces_to_proto

from .arguments import ORIGIN, UPRIGHT, Quaternion, Vector
from .errors import error

if TYPE_CHECKING:
    from .wire import Wire

# Additional wall seconds for reading a description: meshes become hulls then.
_READING = 120.0
# Robots spawned in one round trip: the daemon lets 32 descriptions of one client wait.
_AT_ONCE = 16
# Damping of the links of PyBullet's bodies until `changeDynamics`, 1/s.
_DAMPED = Surface(linear_damping=0.04, angular_damping=0.04)


@dataclass(frozen=True)
class Spawn:
    """Options of a robot at its spawn."""

    position: Vector = ORIGIN
    orientation: Quaternion = UPRIGHT
    # `None`: fixed if the root link is called `world`.
    fixed: bool | None = None
    scale: float = 1.0
    # Empty: the description's name.
    name: str = ""
    # rad or m by joint; the others start at zero.
    joints: dict[str, float] = field(default_factory=dict[str, float])
    self_collision: bool = False
    # Whether its collision meshes become convex parts, and not their hulls.
    divided: bool = False
    # Surfaces of links, instead of the description's.
    surfaces: dict[str, Surface] = field(default_factory=dict[str, Surface])
    # Whether its links are damped, as Bullet's articulated bodies are.
    damped: bool = True


def load(
    wire: Wire, path: Path, options: Spawn, locator: Locator, urdf: bytes | None = None
) -> tuple[EntityInfo, dict[str, str], dict[str, str]]:
    """Spawns a robot from this disk, with the file's description or other text in its place. Returns it
    with the hashes of its files, and with their paths, by URI."""
    entities, hashes, paths = load_all(wire, path, options, locator, urdf)
    return entities[0], hashes, paths


def load_all(
    wire: Wire, path: Path, options: Spawn, locator: Locator, urdf: bytes | None = None
) -> tuple[list[EntityInfo], dict[str, str], dict[str, str]]:
    """Like `spawn_file`, for a file that may describe several robots."""
    try:
        files = DescriptionFiles(path, None, locator=locator)
        if urdf is not None:
            files.urdf = urdf
        source = upload_files(wire.connection, files)
    except (SimdError, OSError) as problem:
        raise error(str(problem), getattr(problem, "reason", "")) from None
    paths = {uri: str(files.paths[sha256]) for uri, sha256 in files.hashes.items()}
    answer = _spawn(wire, source, options)
    return [answer.entity, *answer.others], dict(source.assets), paths


def send(wire: Wire, urdf: bytes, hashes: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Sends the files of a description that the daemon lacks, with their hashes by URI and their bytes by
    hash."""
    if not hashes:
        return
    request = PrepareDescriptionRequest(urdf=urdf, assets=hashes)
    assets = wire.call(methods.PrepareDescription, request).assets
    lacking = {hashes[asset.uri] for asset in assets if asset.state == AssetState.ASSET_STATE_LACKING}
    for sha256 in sorted(lacking):
        data = files[sha256]
        for offset in range(0, len(data), PART_BYTES):
            part = data[offset : offset + PART_BYTES]
            wire.call(
                methods.UploadAsset,
                UploadAssetRequest(sha256=sha256, total_bytes=len(data), offset=offset, data=part),
            )


def file(wire: Wire, sha256: str) -> bytes:
    """Returns a file of the daemon."""
    try:
        return fetch_file(wire.connection, sha256)
    except SimdError as problem:
        raise error(str(problem), problem.reason) from None


def spawn(wire: Wire, source: DescriptionSource, options: Spawn) -> EntityInfo:
    """Spawns a robot."""
    return _spawn(wire, source, options).entity


def spawn_all(wire: Wire, source: DescriptionSource, several: Iterable[Spawn]) -> list[EntityInfo]:
    """Spawns several robots of one description, many at a time. Returns them in the order of `several`.

    Raises:
        error: where one is refused; others of them may be there.
    """
    wire.before()
    requests = iter([_request(source, options) for options in several])
    entities: list[EntityInfo] = []
    while part := list(islice(requests, _AT_ONCE)):
        if len(part) == 1:
            entities.append(wire.call(methods.SpawnEntity, part[0], wait=_READING).entity)
            continue
        try:
            answers = wire.connection.call_all(*((methods.SpawnEntity, request) for request in part))
        except SimdError as problem:
            raise error(str(problem), problem.reason) from None
        entities.extend(answer.entity for answer in answers)
    return entities


def _spawn(wire: Wire, source: DescriptionSource, options: Spawn) -> SpawnEntityResponse:
    return wire.call(methods.SpawnEntity, _request(source, options), wait=_READING)


def reload(wire: Wire, robot: str, urdf: bytes, files: dict[str, str]) -> EntityInfo:
    """Replaces the description of a robot; the daemon has its files."""
    source = DescriptionSource(urdf=urdf, assets=files)
    return wire.call(methods.ReloadEntity, ReloadEntityRequest(robot=robot, source=source), wait=_READING).entity


def _mesh_shapes(spawn: Spawn) -> MeshShapes:
    # Movable links use convex parts; fixed links use their triangles.
    is_divided = spawn.divided and spawn.fixed is not True
    return MeshShapes.MESH_SHAPES_DECOMPOSITION if is_divided else MeshShapes.MESH_SHAPES_MESH


def _request(source: DescriptionSource, spawn: Spawn) -> SpawnEntityRequest:
    bases = {None: Base.BASE_UNSPECIFIED, True: Base.BASE_FIXED, False: Base.BASE_FREE}
    request = SpawnEntityRequest(
        source=source,
        name=spawn.name,
        allow_renaming=True,
        base=bases[spawn.fixed],
        scale=spawn.scale,
        joint_positions=spawn.joints,
        self_collision=spawn.self_collision,
        mesh_shapes=_mesh_shapes(spawn),
        link_properties=surfaces_to_proto({**({"": _DAMPED} if spawn.damped else {}), **spawn.surfaces}),
    )
    at, turn = request.pose.position, request.pose.orientation
    at.x, at.y, at.z = spawn.position
    turn.x, turn.y, turn.z, turn.w = spawn.orientation
    return request
