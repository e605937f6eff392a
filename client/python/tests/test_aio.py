"""The asyncio client has the same names, and does the same without a thread for each call."""

from __future__ import annotations

import asyncio
import inspect
import threading
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import pytest
import pytest_asyncio
from conftest import cleaned
from daemon import ASSETS, Daemon

import simd_client
from simd_client import aio

OTHERWISE = {
    # Members that cannot be awaited are called another way.
    "Parameters": {"__getitem__", "__setitem__", "__delitem__"},
}


@pytest_asyncio.fixture
async def sim(daemon: Daemon) -> AsyncIterator[aio.Simulation]:
    with simd_client.connect(daemon.endpoint) as blocking:
        cleaned(blocking)
    async with aio.connect(daemon.endpoint) as connected:
        yield connected


@pytest.mark.parametrize(
    "name",
    ["Simulation", "Robot", "Joint", "Parameters", "Sensor", "Sensors", "Watch", "EventWatch", "ReadingStream", "Claim"],
)
def test_it_has_the_same_names_and_parameters(name: str) -> None:
    def members(kind: type) -> dict[str, Any]:
        return {
            key: [(p.name, p.kind, p.default) for p in inspect.signature(value).parameters.values()]
            if inspect.isfunction(value)
            else "property"
            for base in reversed(kind.__mro__)
            for key, value in vars(base).items()
            if (not key.startswith("_") or key in ("__getitem__",))
            and (inspect.isfunction(value) or isinstance(value, property))
        }

    blocking, awaited = members(getattr(simd_client, name)), members(getattr(aio, name))
    assert {k: v for k, v in blocking.items() if k not in OTHERWISE.get(name, set())} == awaited


async def test_a_robot_is_loaded_driven_and_read(sim: aio.Simulation) -> None:
    arm = await sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    assert arm.joint_names == ("shoulder joint", "elbow joint") and "elbow joint" in repr(arm)
    await arm.joints["elbow joint"].set_position(0.25)
    assert await arm.joints["elbow joint"].target == 0.25
    states = await sim.step(10, {arm: [0.1, 0.2]}, states=True)
    assert states.stamp.step == 10 and states[arm].target.tolist() == [0.1, 0.2]
    assert (await arm.position).dtype == np.float64
    assert (await sim.state) is simd_client.SimulationState.PAUSED
    with pytest.raises(simd_client.JointNotFound):
        await arm.set_positions({"knee": 0.0})
    await arm.delete()
    assert await sim.robots == {}


async def test_many_calls_are_under_way_at_once_without_threads(sim: aio.Simulation) -> None:
    await asyncio.gather(*(sim.info() for _ in range(10)))
    before = threading.active_count()
    infos = await asyncio.gather(*(sim.info() for _ in range(100)))
    assert len(infos) == 100 and threading.active_count() <= before


async def test_a_call_is_cancelled_and_the_connection_goes_on(sim: aio.Simulation) -> None:
    waiting = asyncio.ensure_future(sim.next_states((await sim.stamp), 30.0))
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    assert (await sim.stamp).step == 0


async def test_a_watch_is_newest_wins(sim: aio.Simulation) -> None:
    arm = await sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    async with arm.watch() as states:
        await arm.reset_joints([0.1, 0.2])
        first = await states.__anext__()
        assert first.position.tolist() == [0.1, 0.2]
        for value in range(50):
            await arm.reset_joints([value * 0.01, 0.0])
        last = await arm.read()
        seen = 0
        while (await states.wait(20)).stamp.sequence < last.stamp.sequence:
            seen += 1
        assert seen <= 2
        with pytest.raises(simd_client.DeadlineExceeded):
            await states.wait(0.05)
    with pytest.raises(StopAsyncIteration):
        await states.__anext__()


async def test_the_world_events_claims_and_parameters(sim: aio.Simulation) -> None:
    events = await sim.events()
    arm = await sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    assert (await events.wait(20)).kind == "entity_spawned"
    async with await arm.claim(holder="me"):
        assert (await events.wait(20)).detail.holder == "me"
        await arm.set_positions([0.0, 0.1])
    await sim.parameters.add_slider("gain", 0, 1, 0.5)
    async with sim.parameters.watch() as watch:
        await sim.parameters.set({"gain": 0.25})
        # An earlier publication may arrive first.
        while (await watch.newest())["gain"] != 0.25:
            await watch.wait(20)
    await sim.play()
    stamps: list[int] = []
    async for states in sim.watch(rate=200):
        stamps.append(states.stamp.sequence)
        if len(stamps) == 5:
            break
    assert stamps == sorted(set(stamps))
    async with sim.watch() as states_of_all:
        assert (await states_of_all.__anext__()).stamp.sequence >= stamps[-1]
    assert (await sim.exchange({arm: [0.1, 0.2]}))[arm].target.tolist() == [0.1, 0.2]
    await arm.stream_targets([0.1, 0.1])


async def test_an_address_without_a_daemon_is_unavailable() -> None:
    with pytest.raises(simd_client.Unavailable):
        await aio.connect("tcp/127.0.0.1:1", connect_timeout=0.2)


async def test_contacts_rays_and_surfaces_are_awaited(sim: aio.Simulation) -> None:
    floor = await sim.add_plane(friction=0.7)
    box = await sim.add_box((0.2, 0.2, 0.2), 2.0, (0, 0, 0.1))
    states = await sim.step(300, link_states=True)
    assert states.links[box.name].poses[0, 2] == pytest.approx(0.1, abs=2e-3)
    assert sum(contact.normal_force for contact in await box.contacts()) == pytest.approx(2 * 9.81, rel=0.01)
    assert len(await sim.contacts(floor)) == len(await box.contacts())
    assert (await sim.cast_rays([0, 0, 1], [0, 0, -1])).robots == (box.name,)
    await box.set_surface(friction=0.5)
    assert (await box.surfaces())["link"].friction == 0.5
    assert (await floor.surfaces())["link"].friction == 0.7
    assert len(await box.joint_reactions()) == 0
