"""startStateLogging: the states of robots after each step, in a file as PyBullet writes it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, BinaryIO

from . import constants
from .arguments import indices
from .bodies import Body
from .connections import connected
from .errors import unsupported
from .kinematics import getBasePositionAndOrientation, getBaseVelocity
from .world import World

# PyBullet's format: two lines of text (names, a letter for the type of each column), then records,
# each begun by these two bytes. Positions and velocities of all joints, then their efforts if requested.
_RECORD = b"\xaa\xbb"
_MOST_JOINTS = 12


class StateLog:
    """A log that is being written, by one connection."""

    def __init__(self, client: int, path: Path, bodies: list[int], most: int, efforts: bool) -> None:
        self._client = client
        self._bodies = bodies
        self._most = most
        self._efforts = efforts
        self._step = 0
        self._file: BinaryIO = path.open("wb")
        names = ["stepCount", "timeStamp", "objectId"]
        names += ["posX", "posY", "posZ", "oriX", "oriY", "oriZ", "oriW"]
        names += ["velX", "velY", "velZ", "omegaX", "omegaY", "omegaZ", "qNum"]
        columns = [f"q{joint}" for joint in range(most)] + [f"u{joint}" for joint in range(most)]
        columns += [f"t{joint}" for joint in range(most)] if efforts else []
        kinds = "Ifi" + "f" * 13 + "I" + "f" * len(columns)
        self._file.write((",".join(names + columns) + "\n" + kinds + "\n").encode())
        self._packing = struct.Struct("<" + kinds)

    def __call__(self, world: World) -> None:
        """Writes the states after a step."""
        for number in self._bodies or sorted(world.bodies):
            body = world.bodies.get(number)
            if body is not None:
                self._file.write(_RECORD + self._packing.pack(*self._row(world, body)))
        self._step += 1

    def _row(self, world: World, body: Body) -> list[Any]:
        states = world.joint_states(body)
        moving = [joint for joint in body.joints if joint.width == 1][: self._most]
        padding = [0.0] * (self._most - len(moving))
        position, orientation = getBasePositionAndOrientation(body.unique_id, self._client)
        linear, angular = getBaseVelocity(body.unique_id, self._client)
        row: list[Any] = [
            self._step,
            world.sim_time,
            body.unique_id,
            *position,
            *orientation,
            *linear,
            *angular,
        ]
        row.append(len(moving))
        row += [states.position[joint.position_index] for joint in moving] + padding
        row += [states.velocity[joint.velocity_index] for joint in moving] + padding
        if self._efforts:
            row += [states.effort[joint.velocity_index] for joint in moving] + padding
        return row

    def close(self) -> None:
        """Closes the file."""
        self._file.close()


def startStateLogging(
    loggingType: int,
    fileName: str,
    objectUniqueIds: Any = None,
    maxLogDof: int = _MOST_JOINTS,
    bodyUniqueIdA: int = -1,
    bodyUniqueIdB: int = -1,
    linkIndexA: int = -2,
    linkIndexB: int = -2,
    deviceTypeFilter: int = 0,
    logFlags: int = 0,
    physicsClientId: int = 0,
) -> int:
    """Starts a log of the states of robots after each step of this script. Returns its number.
    STATE_LOGGING_GENERIC_ROBOT is the only kind."""
    world = connected(physicsClientId)
    if loggingType != constants.STATE_LOGGING_GENERIC_ROBOT:
        raise unsupported("startStateLogging", "STATE_LOGGING_GENERIC_ROBOT is the only kind")
    wanted = [] if objectUniqueIds is None else indices(objectUniqueIds, "objectUniqueIds must be numbers")
    log = StateLog(physicsClientId, Path(fileName), wanted, int(maxLogDof), bool(logFlags))
    return world.start_log(log)


def stopStateLogging(loggingId: int, physicsClientId: int = 0) -> None:
    """Ends a log."""
    connected(physicsClientId).stop_log(loggingId)


__all__ = ["startStateLogging", "stopStateLogging"]
