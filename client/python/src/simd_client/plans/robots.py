"""Calls of `EntityService`: robots in and out of the world, where they are."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy.typing as npt

from simd_client import proto
from simd_client.assets import Locator, Missing, find_urdf
from simd_client.description import LoadReport, RobotInfo, report_from_proto, robot_info_from_proto
from simd_client.geometry import (
    FloatArray,
    Pose,
    Twist,
    pose_from_proto,
    pose_to_proto,
    rows,
    twist_from_proto,
    twist_to_proto,
    vector_to_proto,
)
from simd_client.layout import Layout
from simd_client.memory import Memory
from simd_client.plan import Plan, ask, work
from simd_client.plans import joints
from simd_client.proto import methods
from simd_client.surface import Surface, Surfaces, surface_from_proto, surfaces_to_proto
from simd_client.world import Stamp, stamp_from_proto

PART_BYTES = 1024 * 1024
"""Of one message: far below the daemon's limit, and large enough that round trips do not matter."""

AnyPath = str | os.PathLike[str]
Packages = Mapping[str, AnyPath]
"""Folders by the names of the ROS packages that they are."""


@dataclass(frozen=True)
class Options:
    """How a robot comes into the world."""

    name: str = ""
    allow_renaming: bool = False
    pose: Pose = field(default_factory=Pose)
    fixed: bool | None = None
    passive: bool = False
    joint_positions: Mapping[str, float] | None = None
    scale: float | None = None
    strict: bool = False
    surfaces: Surfaces | None = None
    self_collision: bool = False


@dataclass(frozen=True)
class Loaded:
    """A robot that is in the world."""

    info: RobotInfo
    layout: Layout
    report: LoadReport
    stamp: Stamp


@dataclass
class _Files:
    """What was found for a robot's URIs."""

    urdf: bytes
    locator: Locator
    hashes: dict[str, str] = field(default_factory=dict[str, str])
    """By URI."""
    paths: dict[str, Path] = field(default_factory=dict[str, Path])
    """By hash."""
    missing: dict[str, proto.AssetSearch] = field(default_factory=dict[str, proto.AssetSearch])
    """By URI."""

    def find(self, uris: list[str]) -> None:
        """Finds and hashes the files; a visual and its collision shape often share one."""
        known: dict[Path, str] = {}
        for uri in uris:
            try:
                path = self.locator.find(uri)
            except Missing as missing:
                self.missing[uri] = proto.AssetSearch(places=missing.places_for_report())
                continue
            if path not in known:
                known[path] = hash_of(path)
            self.hashes[uri] = known[path]
            self.paths[known[path]] = path


def upload(path: AnyPath, packages: Packages | None) -> Plan[proto.DescriptionSource]:
    """Sends a URDF and those of its files that the daemon lacks."""

    def opened() -> _Files:
        urdf = find_urdf(path)
        return _Files(urdf.read_bytes(), Locator(urdf, packages))

    files = yield from work(opened)
    request = proto.PrepareDescriptionRequest(urdf=files.urdf)
    prepared = yield from ask(methods.PrepareDescription, request)
    uris = [asset.uri for asset in prepared.assets]
    yield from work(lambda: files.find(uris))
    if files.hashes:
        request = proto.PrepareDescriptionRequest(urdf=files.urdf, assets=files.hashes)
        prepared = yield from ask(methods.PrepareDescription, request)
        lacking = proto.AssetState.ASSET_STATE_LACKING
        for sha256 in sorted({files.hashes[a.uri] for a in prepared.assets if a.state == lacking}):
            yield from send(files.paths[sha256], sha256)
    return proto.DescriptionSource(
        description=prepared.description, assets=files.hashes, missing=files.missing
    )


def send(path: Path, sha256: str) -> Plan[None]:
    """Sends one file in parts."""
    total = yield from work(lambda: path.stat().st_size)
    offset = 0
    while True:
        data = yield from work(lambda: _part(path, offset))
        request = proto.UploadAssetRequest(sha256=sha256, total_bytes=total, offset=offset, data=data)
        yield from ask(methods.UploadAsset, request)
        offset += len(data)
        # A file that shrank meanwhile ends early, and the daemon finds out by its hash.
        if not data or offset >= total:
            return


def _part(path: Path, offset: int) -> bytes:
    with path.open("rb") as file:
        file.seek(offset)
        return file.read(PART_BYTES)


def hash_of(path: Path) -> str:
    """The SHA-256 of a file, lower-case hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(PART_BYTES):
            digest.update(part)
    return digest.hexdigest()


def spawn(memory: Memory, source: proto.DescriptionSource, options: Options) -> Plan[Loaded]:
    """Brings a robot into the world, from a source that the daemon has."""
    base = {None: proto.Base.BASE_UNSPECIFIED, True: proto.Base.BASE_FIXED, False: proto.Base.BASE_FREE}
    mode = (
        proto.InitialMode.INITIAL_MODE_PASSIVE if options.passive else proto.InitialMode.INITIAL_MODE_HOLDING
    )
    request = proto.SpawnEntityRequest(
        source=source,
        name=options.name,
        allow_renaming=options.allow_renaming,
        pose=pose_to_proto(options.pose),
        base=base[options.fixed],
        initial_mode=mode,
        joint_positions={name: float(at) for name, at in (options.joint_positions or {}).items()},
        scale=options.scale,
        strict=options.strict,
        link_properties=surfaces_to_proto(options.surfaces),
        self_collision=options.self_collision,
    )
    answer = yield from ask(methods.SpawnEntity, request)
    info = robot_info_from_proto(answer.entity)
    layout = yield from joints.fetch_layout(memory, info.name)
    return Loaded(info, layout, report_from_proto(answer.report), stamp_from_proto(answer.stamp))


def load(memory: Memory, path: AnyPath, packages: Packages | None, options: Options) -> Plan[Loaded]:
    """Sends a robot and brings it into the world."""
    source = yield from upload(path, packages)
    return (yield from spawn(memory, source, options))


def validate(source: proto.DescriptionSource, scale: float | None) -> Plan[LoadReport]:
    """Reads a description as a spawn would, and only reports."""
    request = proto.ValidateDescriptionRequest(source=source, scale=scale)
    return report_from_proto((yield from ask(methods.ValidateDescription, request)).report)


def validate_file(path: AnyPath, packages: Packages | None, scale: float | None) -> Plan[LoadReport]:
    """The same for a robot on this disk."""
    return (yield from validate((yield from upload(path, packages)), scale))


def text_source(urdf: str | bytes) -> proto.DescriptionSource:
    """A URDF without files."""
    return proto.DescriptionSource(urdf=urdf.encode() if isinstance(urdf, str) else urdf)


def listed() -> Plan[list[RobotInfo]]:
    """The robots in the world, in the order in which they came."""
    answer = yield from ask(methods.ListEntities, proto.ListEntitiesRequest())
    return [robot_info_from_proto(entity) for entity in answer.entities]


def info(robot: str) -> Plan[RobotInfo]:
    """One robot."""
    answer = yield from ask(methods.GetEntityInfo, proto.GetEntityInfoRequest(robot=robot))
    return robot_info_from_proto(answer.entity)


def existing(memory: Memory, robot: str) -> Plan[tuple[RobotInfo, Layout]]:
    """A robot that is in the world already."""
    found = yield from info(robot)
    return found, (yield from joints.fetch_layout(memory, found.name))


def all_existing(memory: Memory) -> Plan[list[tuple[RobotInfo, Layout]]]:
    """All robots that are in the world; layouts that are known are not fetched again."""
    found: list[tuple[RobotInfo, Layout]] = []
    for each in (yield from listed()):
        known = memory.fresh_layout(each.name)
        if known is None or known.version != each.layout_version:
            known = yield from joints.fetch_layout(memory, each.name)
        found.append((each, known))
    return found


@dataclass(frozen=True)
class Reloaded:
    """A robot whose description was read again."""

    report: LoadReport
    stamp: Stamp
    """From when it is so."""
    added_joints: tuple[str, ...]
    removed_joints: tuple[str, ...]


def reload(
    memory: Memory, robot: str, source: proto.DescriptionSource | None, strict: bool
) -> Plan[Reloaded]:
    """Reads a description again; from where it came if nothing else is said."""
    request = proto.ReloadEntityRequest(robot=robot, source=source, strict=strict)
    answer = yield from ask(methods.ReloadEntity, request)
    yield from joints.fetch_layout(memory, robot)
    return Reloaded(
        report_from_proto(answer.report),
        stamp_from_proto(answer.stamp),
        tuple(answer.added_joints),
        tuple(answer.removed_joints),
    )


def reload_from(
    memory: Memory, robot: str, path: AnyPath, packages: Packages | None, strict: bool
) -> Plan[Reloaded]:
    """Sends a new export, and reads it."""
    source = yield from upload(path, packages)
    return (yield from reload(memory, robot, source, strict))


def delete(memory: Memory, robot: str) -> Plan[Stamp]:
    """Takes a robot out of the world."""
    answer = yield from ask(methods.DeleteEntity, proto.DeleteEntityRequest(robot=robot))
    memory.doubt_layout(robot)
    return stamp_from_proto(answer.stamp)


def state(robot: str) -> Plan[tuple[Pose, Twist, Stamp]]:
    """Where a root link is, and how it moves."""
    answer = yield from ask(methods.GetEntityState, proto.GetEntityStateRequest(robot=robot))
    return pose_from_proto(answer.pose), twist_from_proto(answer.twist), stamp_from_proto(answer.stamp)


def set_state(robot: str, pose: Pose | None, twist: Twist | None) -> Plan[Stamp]:
    """Puts a root link elsewhere."""
    request = proto.SetEntityStateRequest(
        robot=robot,
        pose=None if pose is None else pose_to_proto(pose),
        twist=None if twist is None else twist_to_proto(twist),
    )
    return stamp_from_proto((yield from ask(methods.SetEntityState, request)).stamp)


def link_poses(robot: str) -> Plan[FloatArray]:
    """World poses of links, seven numbers each."""
    answer = yield from ask(methods.GetLinkPoses, proto.GetLinkPosesRequest(robots=[robot]))
    return rows(answer.robots[0].poses if answer.robots else (), 7)


def scene(robot: str) -> Plan[proto.RobotScene]:
    """What is to be drawn."""
    answer = yield from ask(methods.GetScene, proto.GetSceneRequest(robots=[robot]))
    return answer.robots[0] if answer.robots else proto.RobotScene(robot=robot)


def asset(sha256: str) -> Plan[bytes]:
    """The whole of a file that a scene names."""
    parts: list[bytes] = []
    have = 0
    while True:
        request = proto.GetAssetRequest(sha256=sha256, offset=have)
        part = yield from ask(methods.GetAsset, request)
        parts.append(part.data)
        have += len(part.data)
        if have >= part.total_bytes or not part.data:
            return b"".join(parts)


def surfaces(robot: str) -> Plan[dict[str, Surface]]:
    """How links rub and bounce, by link."""
    answer = yield from ask(methods.GetLinkProperties, proto.GetLinkPropertiesRequest(robot=robot))
    return {each.link: surface_from_proto(each) for each in answer.links}


def set_surfaces(robot: str, wanted: Surfaces) -> Plan[Stamp]:
    """Changes how links rub and bounce."""
    request = proto.SetLinkPropertiesRequest(robot=robot, links=surfaces_to_proto(wanted))
    return stamp_from_proto((yield from ask(methods.SetLinkProperties, request)).stamp)


def apply_wrench(
    robot: str,
    link: str,
    force: npt.ArrayLike,
    torque: npt.ArrayLike,
    frame: str,
    point: npt.ArrayLike | None,
    persistent: bool,
) -> Plan[Stamp]:
    """Pushes a link."""
    frames = {"world": proto.WrenchFrame.WRENCH_FRAME_WORLD, "link": proto.WrenchFrame.WRENCH_FRAME_LINK}
    if frame not in frames:
        raise ValueError(f"frame is 'world' or 'link', not {frame!r}")
    request = proto.ApplyLinkWrenchRequest(
        robot=robot,
        link=link,
        wrench=proto.Wrench(
            force=vector_to_proto(force, "a force"), torque=vector_to_proto(torque, "a torque")
        ),
        frame=frames[frame],
        point=None if point is None else vector_to_proto(point, "a point"),
        persistent=persistent,
    )
    return stamp_from_proto((yield from ask(methods.ApplyLinkWrench, request)).stamp)
