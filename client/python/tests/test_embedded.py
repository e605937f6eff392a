"""A world in this process: properties that only such a world has."""

from __future__ import annotations

import asyncio
import os
import re
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from daemon import ASSETS

import simd_client
from simd_client import aio, embedded_link, proto
from simd_client.proto import methods

pytestmark = pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")


def test_a_world_is_there_with_its_configuration_and_ends_with_its_connection() -> None:
    config = {"paused": True, "name": "bench", "physics.time_step": 0.002, "service.robots": 1}
    with simd_client.connect("embedded", config=config) as sim:
        assert sim.name == "bench"
        assert sim.physics.time_step == 0.002
        arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        with pytest.raises(simd_client.SimdError) as refused:
            sim.load(ASSETS / "Two Link.v2", "other", fixed=True)
        assert refused.value.reason == "LIMIT_EXCEEDED"
        before = sim.stamp
        assert sim.step(10).stamp.step == before.step + 10
    with pytest.raises(simd_client.Unavailable, match="closed"):
        print(arm.position)


def test_two_worlds_have_nothing_to_do_with_each_other() -> None:
    with (
        simd_client.connect("embedded", config={"paused": True}) as one,
        simd_client.connect("embedded#two", config={"paused": True}) as two,
    ):
        one.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        one.step(5)
        assert (two.name, list(two.robots), two.stamp.step) == ("two", [], 0)


def test_a_mistake_in_the_configuration_is_said_in_a_sentence() -> None:
    with pytest.raises(simd_client.EndpointError, match="physics.time_step"):
        simd_client.connect("embedded", config={"physics.time_step": "soon"})
    with pytest.raises(simd_client.EndpointError, match="no_such_key"):
        simd_client.connect("embedded", config={"no_such_key": 1})


def test_calls_of_several_threads_are_all_done() -> None:
    with simd_client.connect("embedded", config={"paused": True}) as sim:
        sim.load(ASSETS / "seven_arm", "arm", fixed=True)

        def steps() -> None:
            for _ in range(200):
                sim.step()

        threads = [threading.Thread(target=steps) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sim.stamp.step == 800


def test_a_call_that_takes_too_long_ends_with_its_time_limit() -> None:
    with simd_client.connect("embedded", config={"paused": True}) as sim:
        # No newer state comes while the world is paused, and the daemon would wait for a minute.
        request = proto.NextJointStatesRequest(after_sequence=1 << 40, timeout=60.0)
        with pytest.raises(simd_client.DeadlineExceeded):
            sim.with_timeout(0.3).call(methods.NextJointStates, request)


def test_a_world_that_plays_keeps_to_the_clock_and_is_watched() -> None:
    with simd_client.connect("embedded") as sim:
        sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        with sim.robots["arm"].watch() as states:
            steps = [next(states).stamp.step for _ in range(5)]
        assert steps == sorted(set(steps)), "each state is newer than the one before"


def test_events_come_in_order_and_without_a_hole() -> None:
    with simd_client.connect("embedded", config={"paused": True}) as sim, sim.events() as events:
        for name in ("a", "b"):
            sim.load(ASSETS / "Two Link.v2", name, fixed=True)
        seen = [next(events) for _ in range(2)]
        assert [event.kind for event in seen] == ["entity_spawned"] * 2
        assert seen[1].sequence > seen[0].sequence and seen[1].missed == 0


def test_a_run_is_recorded_into_the_folder_of_the_configuration(tmp_path: Path) -> None:
    config = {"paused": True, "recording.directory": tmp_path}
    with simd_client.connect("embedded", config=config) as sim:
        sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        with sim.record("run"):
            sim.step(100)
    assert [file.name for file in tmp_path.glob("*.mcap")] == ["run.mcap"]


async def test_asyncio_has_the_same_world() -> None:
    async with aio.connect("embedded", config={"paused": True}) as sim:
        await sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        stepped = await asyncio.gather(*(sim.step() for _ in range(8)))
        assert sorted(states.stamp.step for states in stepped) == list(range(1, 9))


def test_a_program_that_closes_nothing_ends_well() -> None:
    code = (
        "import simd_client\n"
        "sim = simd_client.connect('embedded')\n"
        "events = sim.events()\n"
        "print(sim.name)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "simd\n", "")


def test_without_the_wheel_the_error_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(embedded_link, "MODULE", "simd_embedded_that_is_not_there")
    with pytest.raises(simd_client.Unavailable, match="pip install dist/simd_embedded"):
        simd_client.connect("embedded")


def get(address: str, path: str) -> bytes:
    """Returns the content at a path."""
    with urllib.request.urlopen(f"http://{address}{path}", timeout=10.0) as answer:
        return answer.read()


def call(address: str, method: str, request: bytes) -> bytes:
    """Returns the answer of a call over gRPC-Web: a flag, four bytes of length, a message."""
    asked = urllib.request.Request(
        f"http://{address}/simd.v1.{method}",
        data=bytes(1) + len(request).to_bytes(4, "big") + request,
        headers={"content-type": "application/grpc-web+proto", "x-grpc-web": "1"},
    )
    with urllib.request.urlopen(asked, timeout=10.0) as answer:
        framed: bytes = answer.read()
    return framed[5 : 5 + int.from_bytes(framed[1:5], "big")]


def served(capfd: pytest.CaptureFixture[str]) -> str:
    """Returns the address that a line on stderr names."""
    found = re.search(r"is served at http://(\S+)/ and not at", capfd.readouterr().err)
    assert found is not None
    return found[1]


def test_a_served_world_answers_others_while_its_program_steps_it(capfd: pytest.CaptureFixture[str]) -> None:
    with simd_client.connect("embedded", config={"paused": True}, serve="127.0.0.1:0") as sim:
        sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        sim.parameters.add_slider("speed", 0.0, 1.0, 0.0)
        address, stop = served(capfd), threading.Event()

        def steps() -> None:
            while not stop.is_set():
                sim.step()

        stepping = threading.Thread(target=steps)
        stepping.start()
        try:
            assert b"<html" in get(address, "/").lower()
            assert b'"arm"' in get(address, "/robots")
            change = proto.SetParametersRequest(changes=[proto.ParameterChange(name="speed", value=0.75)])
            call(address, "ParameterService/SetParameters", change.SerializeToString())
        finally:
            stop.set()
            stepping.join()
        assert sim.parameters["speed"] == 0.75
    with pytest.raises(urllib.error.URLError):
        get(address, "/")


def test_a_taken_port_is_replaced_and_an_address_for_others_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        asked = f"127.0.0.1:{taken.getsockname()[1]}"
        with simd_client.connect("embedded", serve=asked):
            address = served(capfd)
            assert address != asked and b"<html" in get(address, "/").lower()
    with pytest.raises(simd_client.EndpointError, match="other machines"):
        simd_client.connect("embedded", serve="0.0.0.0:0")
    with pytest.raises(simd_client.EndpointError, match="give IP:PORT"):
        simd_client.connect("embedded", serve="everywhere")
    with pytest.raises(simd_client.EndpointError, match="is for a world in this process"):
        simd_client.connect("tcp/127.0.0.1:1", serve="127.0.0.1:0")


def test_a_forked_process_does_not_serve(capfd: pytest.CaptureFixture[str]) -> None:
    """Its copy of the socket is closed, so that the port is free once the program has ended the world."""
    with simd_client.connect("embedded", config={"paused": True}, serve="127.0.0.1:0"):
        address = served(capfd)
        (ends, end), (ready, say) = os.pipe(), os.pipe()
        child = os.fork()
        if child == 0:
            os.write(say, b"1")
            os.close(end)
            os.read(ends, 1)
            os._exit(0)
        assert os.read(ready, 1) == b"1"
        assert b"<html" in get(address, "/").lower()
    try:
        host, _, port = address.rpartition(":")
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((host, int(port)), timeout=10.0)
    finally:
        os.close(end)
        os.waitpid(child, 0)
        for descriptor in (ends, ready, say):
            os.close(descriptor)
