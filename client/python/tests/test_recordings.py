"""Independent tools read recordings, with the values of the daemon."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon import ASSETS, BINARY, Daemon
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoderFactory
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import simd_client
from simd_client import Robot, Simulation, Target, aio


@pytest.fixture
def recorded(tmp_path: Path) -> Iterator[tuple[Simulation, Robot]]:
    """A daemon that keeps recordings in `tmp_path`, with an arm."""
    with (
        Daemon("--paused", "--recordings", str(tmp_path), name="recorder") as daemon,
        simd_client.connect(daemon.endpoint) as sim,
    ):
        yield sim, sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)


def record(sim: Simulation, arm: Robot) -> list[tuple[float, Any]]:
    """Records 200 steps, with a state at every tenth; returns the daemon's states."""
    seen: list[tuple[float, Any]] = []
    with sim.record("run", rate=100) as recording:
        assert recording.info.state == "recording"
        arm.joints["elbow joint"].set_target(Target.position(0.8))
        for _ in range(200):
            states = sim.step(1, states=True)
            seen.append((states.stamp.sim_time, states["arm"]))
    assert recording.info.state == "complete" and list(recording.info.files) == ["run.mcap"]
    assert [each.name for each in sim.recordings()] == ["run"]
    return seen


def check(message: Any, seen: list[tuple[float, Any]]) -> None:
    """A JointState equals one of the daemon's states, to the bit."""
    time = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
    state = next(state for at, state in seen if abs(at - time) < 1e-9)
    assert len(message.name) == 2
    for name, position, velocity, effort in zip(
        message.name, message.position, message.velocity, message.effort, strict=True
    ):
        joint = state[name]
        found = [position, velocity, effort]
        np.testing.assert_array_equal(found, [joint.positions[0], joint.velocities[0], joint.efforts[0]])


def test_mcap_reads_the_joint_states_that_the_daemon_had(
    recorded: tuple[Simulation, Robot], tmp_path: Path
) -> None:
    seen = record(*recorded)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        names = {channel.topic for channel in summary.channels.values()}
        assert {"/arm/joint_states", "/arm/robot_description", "/tf", "/clock", "/simd/commands"} <= names
        states = [it.decoded_message for it in reader.iter_decoded_messages(topics=["/arm/joint_states"])]
        assert len(states) == 20
        for state in states:
            check(state, seen)
        (described,) = reader.iter_decoded_messages(topics=["/arm/robot_description"])
        assert described.decoded_message.data == next((ASSETS / "Two Link.v2").rglob("*.urdf")).read_bytes().decode()
        frames = [it.decoded_message for it in reader.iter_decoded_messages(topics=["/tf"])]
        assert len(frames) == 20
        parents = {each.child_frame_id: each.header.frame_id for each in frames[0].transforms}
        assert "world" in parents.values() and all(child.startswith("arm/") for child in parents)


def test_commands_have_their_descriptors_in_the_file(
    recorded: tuple[Simulation, Robot], tmp_path: Path
) -> None:
    record(*recorded)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoderFactory()])
        commands = [it.decoded_message for it in reader.iter_decoded_messages(topics=["/simd/commands"])]
        assert [command.kind for command in commands] == ["SetTargets"]
        assert '"elbow joint"' in commands[0].json and "0.8" in commands[0].json
        (steps, *_) = [it.decoded_message for it in reader.iter_decoded_messages(topics=["/simd/steps"])]
        assert len(steps.fingerprints) > 0


def test_rosbags_reads_what_is_exported(recorded: tuple[Simulation, Robot], tmp_path: Path) -> None:
    seen = record(*recorded)
    simctl = BINARY.parent / "simctl"
    bag = tmp_path / "run: a bag #1"
    table = tmp_path / "states.csv"
    command = [str(simctl), "record", "export", str(tmp_path / "run.mcap"), "--ros2", str(bag), "--csv", str(table)]
    subprocess.run(command, check=True)
    with AnyReader([bag]) as reader:
        connections = [it for it in reader.connections if it.topic == "/arm/joint_states"]
        states: list[Any] = [reader.deserialize(raw, it.msgtype) for it, _, raw in reader.messages(connections)]
    assert len(states) == 20
    for state in states:
        check(state, seen)
    rows = table.read_text().splitlines()
    assert rows[0] == "time,robot,joint,position,velocity,effort"
    assert len(rows) == 1 + 20 * len(states[0].name)
    time, robot, joint, position, _, _ = rows[-1].split(",")
    assert (robot, joint) == ("arm", states[-1].name[-1])
    assert float(position) == states[-1].position[-1] and float(time) == pytest.approx(seen[-1][0], abs=0.01)


def test_a_recording_is_replayed(recorded: tuple[Simulation, Robot], tmp_path: Path) -> None:
    record(*recorded)
    said = subprocess.run(
        [str(BINARY), "replay", str(tmp_path / "run.mcap")], check=True, capture_output=True, text=True
    )
    assert said.stdout.endswith("200 steps, 1 commands, 2 worlds from 0 s on: equal\n"), said.stdout


def test_refusals_have_their_exceptions(recorded: tuple[Simulation, Robot], sim: Simulation) -> None:
    recorder, _ = recorded
    with sim.record("in_the_default_folder"):
        pass
    assert "in_the_default_folder" in [each.name for each in sim.recordings()]
    with pytest.raises(simd_client.RecordingNotFound):
        recorder.delete_recording("nothing")
    with recorder.record("a"), pytest.raises(simd_client.RecordingNotPossible):
        recorder.record("b")
    with pytest.raises(simd_client.RecordingExists):
        recorder.record("a")
    recorder.delete_recording("a")
    assert recorder.recordings() == ()


@pytest.mark.asyncio
async def test_recordings_of_asyncio(recorded: tuple[Simulation, Robot]) -> None:
    sim, _ = recorded
    async with aio.connect(sim.endpoint.locator) as other:
        async with await other.record("here", rate=0, keep_last=60.0) as recording:
            await other.step(10)
        assert recording.info.state == "complete"
        assert list(recording.info.files) == ["here.000001.mcap"]


def test_contacts_and_load_reports_are_those_of_the_daemon(
    recorded: tuple[Simulation, Robot], tmp_path: Path
) -> None:
    sim, _ = recorded
    sim.add_plane()
    with sim.record("run", rate=1000):
        sim.add_sphere(0.05, position=(1, 0, 0.05))
        sim.load(ASSETS / "Two Link.v2", "late", fixed=True)
        sim.step(100)
        contacts = sim.contacts()
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[ProtobufDecoderFactory()])
        recorded_contacts = [it.decoded_message for it in reader.iter_decoded_messages(topics=["/simd/contacts"])]
        assert len(recorded_contacts) == 100 and recorded_contacts[-1].stamp.step == 100
        forces = [contact.normal_force for contact in recorded_contacts[-1].contacts]
        assert forces and forces == [contact.normal_force for contact in contacts]
        (report,) = reader.iter_decoded_messages(topics=["/late/load_report"])
        assert "2 moving joints" in report.decoded_message.summary
