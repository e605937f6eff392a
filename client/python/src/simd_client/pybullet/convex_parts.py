"""vhacd: a mesh divided into convex parts, by the daemon."""

from __future__ import annotations

from pathlib import Path

from simd_client.proto import (
    DeleteEntityRequest,
    DescriptionSource,
    GetSceneRequest,
    LinkProperties,
    MeshShapes,
    Shape,
    SpawnEntityRequest,
    methods,
)
from simd_client.proto import Base as WireBase

from . import meshes, spawning
from .arguments import UPRIGHT
from .connections import connected
from .errors import error
from .rotations import compose
from .world import World

# Wall seconds that the daemon may take to divide a mesh.
_SECONDS = 120.0
# PyBullet's default for all of its parameters.
_LEFT_OUT = -1


def vhacd(
    fileNameIn: str,
    fileNameOut: str,
    fileNameLogging: str,
    concavity: float = _LEFT_OUT,
    alpha: float = _LEFT_OUT,
    beta: float = _LEFT_OUT,
    gamma: float = _LEFT_OUT,
    minVolumePerCH: float = _LEFT_OUT,
    resolution: int = _LEFT_OUT,
    maxNumVerticesPerCH: int = _LEFT_OUT,
    depth: int = _LEFT_OUT,
    planeDownsampling: int = _LEFT_OUT,
    convexhullDownsampling: int = _LEFT_OUT,
    pca: int = _LEFT_OUT,
    mode: int = _LEFT_OUT,
    convexhullApproximation: int = _LEFT_OUT,
    physicsClientId: int = 0,
) -> None:
    """Writes a mesh as at most 32 convex parts, each an object of an OBJ file. The daemon divides it, with
    its own settings."""
    given = dict(locals())
    world = connected(physicsClientId)
    settings = [name for name, value in given.items() if name not in _FILES and value != _LEFT_OUT]
    if settings:
        world.say_once(f"vhacd: {', '.join(settings)} do nothing: the daemon divides meshes with settings of its own")
    mesh = meshes.read("vhacd", Path(fileNameIn), True)
    parts = _divided(world, mesh)
    lines: list[str] = []
    first = 1
    for number, (vertices, triangles) in enumerate(parts):
        lines.append(f"o convex_{number}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in triangles]
        first += len(vertices)
    said = [f"{fileNameIn}: {len(parts)} convex parts"]
    said += [f"\tCH[{n:05}] {len(v)} V, {len(t)} T" for n, (v, t) in enumerate(parts)]
    try:
        Path(fileNameOut).write_text("\n".join(lines) + "\n")
        Path(fileNameLogging).write_text("\n".join(said) + "\n")
    except OSError as problem:
        raise error(f"vhacd: {problem}") from None


_FILES = ("fileNameIn", "fileNameOut", "fileNameLogging", "physicsClientId")

_Part = tuple[list[tuple[float, float, float]], list[tuple[int, int, int]]]


def _divided(world: World, mesh: meshes.Mesh) -> list[_Part]:
    """Makes a body of the mesh without contacts, reads its parts, and removes it."""
    shape = f'<geometry><mesh filename="{mesh.uri}"/></geometry>'
    urdf = f'<robot name="vhacd"><link name="mesh"><collision>{shape}</collision></link></robot>'.encode()
    files = {mesh.uri: mesh.sha256}
    spawning.send(world.wire, urdf, files, {mesh.sha256: mesh.data})
    request = SpawnEntityRequest(
        source=DescriptionSource(urdf=urdf, assets=files),
        allow_renaming=True,
        base=WireBase.BASE_FIXED,
        mesh_shapes=MeshShapes.MESH_SHAPES_DECOMPOSITION,
        link_properties=[LinkProperties(collision_group=0, collision_mask=0)],
    )
    robot = world.wire.call(methods.SpawnEntity, request, wait=_SECONDS).entity.name
    try:
        scene = world.wire.call(methods.GetScene, GetSceneRequest(robots=[robot])).robots[0]
        found = [_part(world, collider) for collider in scene.colliders if collider.WhichOneof("geometry") == "convex"]
    finally:
        world.wire.call(methods.DeleteEntity, DeleteEntityRequest(robot=robot))
        world.forget_states()
    if not found:
        raise error("vhacd: the mesh has no convex parts: it may have too many triangles, or none")
    return found


def _part(world: World, collider: Shape) -> _Part:
    lines = [line.split() for line in spawning.file(world.wire, collider.convex.sha256).decode().splitlines()]
    at, turn = collider.pose.position, collider.pose.orientation
    pose = ((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
    vertices = [
        compose(pose, ((float(x), float(y), float(z)), UPRIGHT))[0] for kind, x, y, z in lines if kind == "v"
    ]
    triangles = [(int(a) - 1, int(b) - 1, int(c) - 1) for kind, a, b, c in lines if kind == "f"]
    return vertices, triangles


__all__ = ["vhacd"]
