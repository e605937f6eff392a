"""The example for Foxglove, read like Foxglove's app does: over its WebSocket protocol."""

# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false
from __future__ import annotations

import base64
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from daemon import Daemon
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from simd_client import Simulation

EXAMPLE = Path(__file__).parents[1] / "examples" / "foxglove_live.py"
ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


def look(address: str) -> dict[str, Any]:
    """Returns the messages to an app that connects and subscribes to everything."""
    with connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None) as app:
        return read(app, {"/joint_states", "/tf", "/scene"})


def read(app: ClientConnection, wanted: set[str]) -> dict[str, Any]:
    """One message of each topic."""
    channels: dict[str, Any] = {}
    read: dict[str, Any] = {}
    while read.keys() < wanted:
        frame = app.recv(timeout=30)
        if isinstance(frame, str):
            said = json.loads(frame)
            if said["op"] == "advertise":
                channels |= {channel["topic"]: channel for channel in said["channels"]}
                subscriptions = [
                    {"id": channel["id"], "channelId": channel["id"]} for channel in said["channels"]
                ]
                app.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        elif frame[0] == 1:
            number = int.from_bytes(frame[1:5], "little")
            channel = next(channel for channel in channels.values() if channel["id"] == number)
            read[channel["topic"]] = decoded(channel, frame[13:])
    return read


def decoded(channel: Any, data: bytes) -> Any:
    """Parses a message by the schema of its channel."""
    assert (channel["encoding"], channel["schemaEncoding"]) == ("protobuf", "protobuf")
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
    return kind.FromString(data)


def test_foxglove_sees_the_robots(sim: Simulation, daemon: Daemon) -> None:
    sim.pause()
    robot = sim.load(ROBOT, "two link", fixed=True, allow_renaming=True)
    robot.reset_joints({"elbow joint": 0.25})
    environment = {**os.environ, "SIMD_ENDPOINT": daemon.endpoint}
    command = [sys.executable, str(EXAMPLE), "--port", "0", "--seconds", "60"]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as example:
        assert example.stdout is not None
        address = example.stdout.readline().split()[-1]
        try:
            # A later app sees the same.
            first, seen = look(address), look(address)
        finally:
            example.terminate()
    assert first.keys() == seen.keys()
    elbow = next(joint for joint in seen["/joint_states"].joints if joint.name.endswith("/elbow joint"))
    assert elbow.position == pytest.approx(0.25)
    frames = {frame.child_frame_id: frame for frame in seen["/tf"].transforms}
    for link, pose in robot.link_poses().items():
        at = frames[f"{robot.name}/{link}"].translation
        assert [at.x, at.y, at.z] == pytest.approx(list(pose.position))
    assert {entity.frame_id for entity in seen["/scene"].entities} <= frames.keys()
    assert any(entity.models for entity in seen["/scene"].entities)
