"""startStateLogging: states after each step, in files with PyBullet's format."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from math import asin, atan2, copysign, pi
from pathlib import Path
from time import perf_counter
from typing import Any, BinaryIO, TextIO

from simd_client.proto import (
    DeleteRecordingRequest,
    ReadRecordingRequest,
    StartRecordingRequest,
    StopRecordingRequest,
    methods,
)

from . import constants
from .arguments import indices
from .bodies import Body
from .connections import connected
from .contacts import getContactPoints
from .errors import error, unsupported
from .kinematics import getBasePositionAndOrientation, getBaseVelocity
from .rotations import matrix
from .world import World

# PyBullet's format: two lines of text (names, a letter for the type of each column), then records, each with
# these two bytes first.
_RECORD = b"\xaa\xbb"
_MAX_JOINTS = 12
# Maximum wall seconds until the daemon completes a recording.
_SECONDS = 60.0
_MINITAUR = [
    f"motor_{leg}_joint"
    for leg in ("front_leftR", "front_leftL", "back_leftR", "back_leftL")
    + ("front_rightL", "front_rightR", "back_rightL", "back_rightR")
]


class StateLog:
    """A file in progress, written by one connection: one or several records after each step."""

    def __init__(self, client: int, path: Path, names: list[str], kinds: str) -> None:
        self._client = client
        self._step = 0
        self._packing = struct.Struct("<" + kinds)
        try:
            self._file: BinaryIO = path.open("wb")
        except OSError as problem:
            raise error(f"startStateLogging: {problem}") from None
        self._file.write((",".join(names) + "\n" + kinds + "\n").encode())

    def __call__(self, world: World) -> None:
        """Writes the records of a step."""
        for row in self._rows(world):
            self._file.write(_RECORD + self._packing.pack(*row))
        self._step += 1

    def _rows(self, world: World) -> Iterable[list[Any]]:
        raise NotImplementedError

    def close(self) -> None:
        """Closes the file."""
        self._file.close()


class RobotLog(StateLog):
    """Log of robots' bases and joints: positions and velocities of all joints, then their efforts if
    requested."""

    def __init__(self, client: int, path: Path, bodies: list[int], most: int, efforts: bool) -> None:
        self._bodies = bodies
        self._most = most
        self._efforts = efforts
        names = ["stepCount", "timeStamp", "objectId"]
        names += ["posX", "posY", "posZ", "oriX", "oriY", "oriZ", "oriW"]
        names += ["velX", "velY", "velZ", "omegaX", "omegaY", "omegaZ", "qNum"]
        columns = [f"q{joint}" for joint in range(most)] + [f"u{joint}" for joint in range(most)]
        columns += [f"t{joint}" for joint in range(most)] if efforts else []
        super().__init__(client, path, names + columns, "Ifi" + "f" * 13 + "I" + "f" * len(columns))

    def _rows(self, world: World) -> Iterable[list[Any]]:
        found = [world.bodies.get(number) for number in self._bodies or sorted(world.bodies)]
        return [self._row(world, body) for body in found if body is not None]

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


class MinitaurLog(StateLog):
    """Log of a robot with the eight motors of a Minitaur: roll, pitch and yaw, their positions and efforts,
    forward speed."""

    def __init__(self, client: int, path: Path, body: Body) -> None:
        self._body = body.unique_id
        if any(name not in body.by_joint for name in _MINITAUR):
            raise error("startStateLogging: a Minitaur has the joints motor_front_leftR_joint and so on")
        names = ["t", "r", "p", "y", *(f"q{i}" for i in range(8)), *(f"u{i}" for i in range(8)), "dx", "mo"]
        super().__init__(client, path, names, "I" + "f" * 20 + "B")

    def _rows(self, world: World) -> Iterable[list[Any]]:
        body = world.bodies.get(self._body)
        if body is None:
            return []
        states = world.joint_states(body)
        motors = [body.joints[body.by_joint[name]] for name in _MINITAUR]
        m = matrix(getBasePositionAndOrientation(self._body, self._client)[1])
        return [
            [
                self._step,
                *_roll_pitch_yaw(m),
                *(states.position[motor.position_index] for motor in motors),
                *(states.effort[motor.velocity_index] for motor in motors),
                getBaseVelocity(self._body, self._client)[0][0],
                # Bullet's mode of its motors, a constant.
                6,
            ]
        ]


class ContactLog(StateLog):
    """Log of the contact points of bodies and links."""

    def __init__(self, client: int, path: Path, bodies: tuple[int, int], links: tuple[int, int]) -> None:
        self._asked = [body for body in bodies if body >= 0]
        self._links = links
        points = [f"position{side}{axis}" for side in ("OnA", "OnB") for axis in "XYZ"]
        names = ["stepCount", "timeStamp", "contactFlag", "bodyUniqueIdA", "bodyUniqueIdB", "linkIndexA", "linkIndexB"]
        names += [*points, *(f"contactNormalOnB{axis}" for axis in "XYZ"), "contactDistance", "normalForce"]
        super().__init__(client, path, names, "IfIiiii" + "f" * 11)

    def _rows(self, world: World) -> Iterable[list[Any]]:
        for flag, a, b, link_a, link_b, on_a, on_b, normal, depth, force, *_ in getContactPoints(
            physicsClientId=self._client
        ):
            is_asked = all(body in (a, b) for body in self._asked)
            sides = zip((link_a, link_b), self._links, strict=True)
            if is_asked and all(wanted < -1 or link == wanted for link, wanted in sides):
                time = self._step * world.time_step
                yield [self._step, time, flag, a, b, link_a, link_b, *on_a, *on_b, *normal, depth, force]


class VrLog(StateLog):
    """Log of virtual reality controllers, which do not exist here: only the head of the file."""

    def __init__(self, client: int, path: Path) -> None:
        names = ["stepCount", "timeStamp", "controllerId", "numMoveEvents", "m_numButtonEvents"]
        names += ["posX", "posY", "posZ", "oriX", "oriY", "oriZ", "oriW", "analogAxis"]
        names += [*(f"buttons{index}" for index in range(7)), "deviceType"]
        super().__init__(client, path, names, "IfIII" + "f" * 8 + "I" * 8)

    def _rows(self, world: World) -> Iterable[list[Any]]:
        return ()


class NoLog:
    """A log that only Bullet's own process can write."""

    def __call__(self, world: World) -> None:
        """Writes nothing."""

    def close(self) -> None:
        """Closes nothing."""


class TimingsLog:
    """Log of step times, for chrome://tracing: the time that this process waited."""

    _written = 0

    def __init__(self, prefix: str) -> None:
        # Bullet numbers its files, too.
        path = Path(f"{prefix}_{TimingsLog._written}.json")
        TimingsLog._written += 1
        self._begun = perf_counter()
        self._separator = ""
        try:
            self._file: TextIO = path.open("w")
        except OSError as problem:
            raise error(f"startStateLogging: {problem}") from None
        self._file.write('{"traceEvents":[\n')

    def __call__(self, world: World) -> None:
        """Writes an event of a step, in microseconds."""
        begun, ended = 1e6 * (world.step_began - self._begun), 1e6 * (perf_counter() - self._begun)
        times = f'"ts":{begun:.3f},"dur":{ended - begun:.3f}'
        event = f'{{"cat":"timing","pid":1,"tid":1,{times},"ph":"X","name":"stepSimulation","args":{{}}}}'
        self._file.write(self._separator + event)
        self._separator = ",\n"

    def close(self) -> None:
        """Completes the file."""
        with self._file:
            self._file.write('\n],\n"displayTimeUnit": "ns"}')


class CommandLog:
    """Log of all commands to the daemon, as the daemon's recording, which `simd replay` runs again."""

    def __init__(self, world: World, path: Path) -> None:
        self._world = world
        try:
            self._file: BinaryIO = path.open("wb")
        except OSError as problem:
            raise error(f"startStateLogging: {problem}") from None
        request = StartRecordingRequest(name=world.recording_name(), state_rate=0.0)
        try:
            self._name = world.wire.call(methods.StartRecording, request).recording.name
        except error:
            self._file.close()
            raise

    def __call__(self, world: World) -> None:
        """Does nothing: the daemon writes."""

    def close(self) -> None:
        """Ends the recording, and moves it from the daemon into the file."""
        call = self._world.wire.call
        with self._file:
            stopped = call(methods.StopRecording, StopRecordingRequest(name=self._name), wait=_SECONDS).recording
            for file in stopped.files:
                at = 0
                while True:
                    part = call(methods.ReadRecording, ReadRecordingRequest(name=self._name, file=file.name, offset=at))
                    self._file.write(part.data)
                    at += len(part.data)
                    if not part.data or at >= part.total_bytes:
                        break
        call(methods.DeleteRecording, DeleteRecordingRequest(name=self._name))


def _command_log(world: World, path: Path) -> CommandLog | NoLog:
    try:
        return CommandLog(world, path)
    except error as refusal:
        if refusal.reason != "RECORDING_NOT_POSSIBLE":
            raise
        path.unlink(missing_ok=True)
        world.say_once(f"startStateLogging: commands are not written: {refusal}")
        return NoLog()


_ACCEPTED = {
    constants.STATE_LOGGING_VIDEO_MP4: "no video is written: there is no window",
    constants.STATE_LOGGING_CUSTOM_TIMER: "no timings are written: those are of Bullet's own functions",
    constants.STATE_REPLAY_ALL_COMMANDS: "commands are not done again in this world: `simd replay FILE` runs a log in one of its own",
}


def startStateLogging(
    loggingType: int,
    fileName: str,
    objectUniqueIds: Any = None,
    maxLogDof: int = _MAX_JOINTS,
    bodyUniqueIdA: int = -1,
    bodyUniqueIdB: int = -1,
    linkIndexA: int = -2,
    linkIndexB: int = -2,
    deviceTypeFilter: int = 0,
    logFlags: int = 0,
    physicsClientId: int = 0,
) -> int:
    """Starts a log of robots, of a Minitaur or of contact points after each step of this script. Returns its
    number. A log of commands is one of the daemon's recordings, if the daemon keeps recordings. Virtual
    reality has no events to log. Timings are stepSimulation's, in FILENAME_0.json, FILENAME_1.json and so on
    for chrome://tracing. Videos and replays are accepted, and nothing is written or done."""
    del deviceTypeFilter
    world = connected(physicsClientId)
    path = Path(fileName)
    wanted = [] if objectUniqueIds is None else indices(objectUniqueIds, "objectUniqueIds must be numbers")
    if loggingType == constants.STATE_LOGGING_GENERIC_ROBOT:
        return world.start_log(RobotLog(physicsClientId, path, wanted, int(maxLogDof), bool(logFlags)))
    if loggingType == constants.STATE_LOGGING_MINITAUR:
        body = world.body(wanted[0] if wanted else -1, "startStateLogging: a Minitaur is one of objectUniqueIds")
        return world.start_log(MinitaurLog(physicsClientId, path, body))
    if loggingType == constants.STATE_LOGGING_CONTACT_POINTS:
        bodies, links = (bodyUniqueIdA, bodyUniqueIdB), (linkIndexA, linkIndexB)
        return world.start_log(ContactLog(physicsClientId, path, bodies, links))
    if loggingType == constants.STATE_LOGGING_VR_CONTROLLERS:
        return world.start_log(VrLog(physicsClientId, path))
    if loggingType == constants.STATE_LOGGING_PROFILE_TIMINGS:
        return world.start_log(TimingsLog(fileName))
    if loggingType in _ACCEPTED:
        world.say_once(f"startStateLogging: {_ACCEPTED[loggingType]}")
        return world.start_log(NoLog())
    if loggingType == constants.STATE_LOGGING_ALL_COMMANDS:
        return world.start_log(_command_log(world, path))
    raise unsupported("startStateLogging", "robots, Minitaurs, contact points and commands only")


def stopStateLogging(loggingId: int, physicsClientId: int = 0) -> None:
    """Ends a log."""
    connected(physicsClientId).stop_log(loggingId)


def _roll_pitch_yaw(m: Any) -> tuple[float, float, float]:
    """Returns Bullet's getEulerZYX."""
    if abs(m[2][0]) >= 1.0:
        return atan2(m[2][1], m[2][2]), copysign(pi / 2, -m[2][0]), 0.0
    return atan2(m[2][1], m[2][2]), -asin(m[2][0]), atan2(m[1][0], m[0][0])


__all__ = ["startStateLogging", "stopStateLogging"]
