"""A world in this process: what is only true of one."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
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
    with simd_client.connect("embedded", config={"paused": True}, timeout=0.3) as sim:
        # Nothing newer comes while the world is paused, and the daemon would wait for a minute.
        request = proto.NextJointStatesRequest(after_sequence=1 << 40, timeout=60.0)
        with pytest.raises(simd_client.DeadlineExceeded):
            sim.call(methods.NextJointStates, request)


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
