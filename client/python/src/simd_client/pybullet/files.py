"""Worlds in files: saveWorld writes a script, saveBullet a state."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn

from simd_client.blocking.upload import send_saved_state, write_file
from simd_client.errors import SimdError
from simd_client.proto import (
    DeleteSavedStateRequest,
    ExportSavedStateRequest,
    ImportSavedStateRequest,
    SaveStateRequest,
    methods,
)

from .bodies import Body
from .connections import connected
from .errors import error, unsupported
from .world import World

# Wall seconds that the daemon may take for a file.
_SECONDS = 60.0


def saveWorld(worldFileName: str, clientServerMode: int = 0, physicsClientId: int = 0) -> None:
    """Writes a script that loads this world's robots again, at their poses and joint positions. Bodies that
    were not loaded from a file are left out, as in PyBullet."""
    del clientServerMode
    world = connected(physicsClientId)
    world.read_state()
    lines = [
        "import pybullet as p",
        "cin = p.connect(p.SHARED_MEMORY)",
        "if (cin < 0):",
        "    cin = p.connect(p.GUI)",
    ]
    for _, body in sorted(world.bodies.items()):
        if body.file:
            lines += _loading(world, body)
    for number, made in enumerate(world.constraints.values()):
        ends = (made.parent_frame[0], made.child_frame[0], made.parent_frame[1], made.child_frame[1])
        arguments = (made.body, made.parent_link, made.child, made.child_link, made.kind)
        text = ",".join(f"[{_numbers(each)}]" for each in (made.axis, *ends))
        lines.append(f"cid{number} = p.createConstraint({','.join(map(str, arguments))},{text})")
        lines.append(f"p.changeConstraint(cid{number},maxForce={made.force:f})")
    lines += [f"p.setGravity({_numbers(world.gravity)})", "p.stepSimulation()", "p.disconnect()", ""]
    try:
        Path(worldFileName).write_text("\n".join(lines))
    except OSError as problem:
        raise error(f"saveWorld: {problem}") from None


def _loading(world: World, body: Body) -> list[str]:
    (position, orientation), _ = world.root(body)
    # PyBullet leaves out the options of the load.
    more = ", useFixedBase=1" if body.fixed else ""
    more += f", globalScaling={body.scale!r}" if body.scale != 1.0 else ""
    lines = [f"objects = [p.loadURDF({body.file!r}, {_numbers((*position, *orientation))}{more})]"]
    if body.joints:
        states = world.joint_states(body)
        values = [states.position[joint.position_index] if joint.width == 1 else 0.0 for joint in body.joints]
        lines += [
            "ob = objects[0]",
            f"jointPositions=[ {', '.join(f'{value:f}' for value in values)} ]",
            "for jointIndex in range (p.getNumJoints(ob)):",
            "\tp.resetJointState(ob,jointIndex,jointPositions[jointIndex])",
            "",
        ]
    return lines


def _numbers(values: Iterable[float]) -> str:
    return ",".join(f"{value:f}" for value in values)


def saveBullet(bulletFileName: str, physicsClientId: int = 0) -> None:
    """Writes the whole state of the world, with all its robots, into a file for restoreState(fileName=...).
    It is one of simd's saved states, and not Bullet's format."""
    world = connected(physicsClientId)
    world.flush()
    name = world.saved_state_name(world.saved_state_number())
    world.wire.call(methods.SaveState, SaveStateRequest(name=name))
    try:
        exported = world.wire.call(methods.ExportSavedState, ExportSavedStateRequest(name=name), wait=_SECONDS)
        write_file(world.wire.connection, exported.sha256, Path(bulletFileName))
    except (SimdError, OSError) as problem:
        raise error(f"Couldn't save the world: {problem}") from None
    finally:
        world.wire.call(methods.DeleteSavedState, DeleteSavedStateRequest(name=name))


def read_state(world: World, file: str) -> str:
    """Uploads a file of saveBullet to the daemon. Returns the name of the state."""
    name = world.saved_state_name(world.saved_state_number())
    try:
        sha256 = send_saved_state(world.wire.connection, Path(file))
        request = ImportSavedStateRequest(sha256=sha256, name=name)
        world.wire.call(methods.ImportSavedState, request, wait=_SECONDS)
    except (SimdError, OSError, error) as problem:
        raise error(f"Couldn't restore state. {problem}") from None
    return name


def loadBullet(bulletFileName: str, physicsClientId: int = 0) -> NoReturn:
    """Raises an error: Bullet's own format is not read."""
    del bulletFileName
    connected(physicsClientId)
    raise unsupported("loadBullet", "files of Bullet's own format are not read; restoreState(fileName=) reads saveBullet's")


__all__ = ["loadBullet", "saveBullet", "saveWorld"]
