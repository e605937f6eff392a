"""Functions are called with states, events and parameters, on a thread or on a task."""

from __future__ import annotations

import asyncio
import threading
from queue import Queue

import pytest
from daemon import Daemon

import simd_client
from simd_client import Event, Robot, RobotState, Simulation, States, aio

SECONDS = 20.0


def test_a_function_is_called_with_the_current_state_and_with_newer_ones(sim: Simulation, arm: Robot) -> None:
    seen: Queue[RobotState] = Queue()
    with arm.on_state(seen.put) as callbacks:
        first = seen.get(timeout=SECONDS)
        sim.step(10)
        while seen.get(timeout=SECONDS).stamp.step < first.stamp.step + 10:
            pass
        assert callbacks.is_open and callbacks.error is None
    assert not callbacks.is_open and callbacks.wait(SECONDS)


def test_the_function_is_not_called_once_it_was_closed(sim: Simulation) -> None:
    calls: list[States] = []
    begun, go_on = threading.Event(), threading.Event()

    def slow(states: States) -> None:
        begun.set()
        go_on.wait(SECONDS)
        calls.append(states)

    callbacks = sim.on_states(slow)
    assert begun.wait(SECONDS)
    closing = threading.Thread(target=callbacks.close)
    closing.start()
    go_on.set()
    closing.join(SECONDS)
    assert len(calls) == 1
    sim.step(5)
    assert callbacks.wait(SECONDS) and len(calls) == 1


def test_a_function_may_close_its_own_callbacks(sim: Simulation) -> None:
    calls: list[Event] = []
    ready: Queue[simd_client.Callbacks[Event]] = Queue()

    def once(event: Event) -> None:
        calls.append(event)
        ready.get(timeout=SECONDS).close()

    callbacks = sim.on_event(once, "entity_spawned")
    ready.put(callbacks)
    sim.set_physics(gravity=(0, 0, -5))
    sim.add_box((1, 1, 1), name="one")
    sim.add_box((1, 1, 1), name="two")
    assert callbacks.wait(SECONDS)
    assert [event.detail.robot for event in calls] == ["one"]


def test_every_event_of_the_kinds_is_given_in_order(sim: Simulation) -> None:
    seen: Queue[Event] = Queue()
    with sim.on_event(seen.put, "entity_spawned", "entity_deleted"):
        box = sim.add_box((1, 1, 1), name="box")
        sim.reset(time=True)
        box.delete()
        found = [seen.get(timeout=SECONDS) for _ in range(2)]
    assert [event.kind for event in found] == ["entity_spawned", "entity_deleted"]


def test_a_kind_of_event_that_there_is_not_is_refused(sim: Simulation) -> None:
    with pytest.raises(ValueError, match="no kind of event `robot_spawned`; there are entity_spawned"):
        sim.on_event(print, "robot_spawned")


def test_values_that_are_not_callable_are_refused_at_once(arm: Robot) -> None:
    with pytest.raises(TypeError, match="None is none"):
        arm.on_state(None)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="a rate is above 0"):
        arm.on_state(print, rate=0.0)


def test_a_hundred_callbacks_are_closed_twice(sim: Simulation) -> None:
    many = [sim.on_states(lambda _: None) for _ in range(100)]
    sim.step(3)
    for callbacks in many * 2:
        callbacks.close()
    assert all(callbacks.wait(SECONDS) and callbacks.error is None for callbacks in many)


def test_parameters_are_given_as_they_change(sim: Simulation) -> None:
    sim.parameters.add_slider("gain", 0.0, 1.0, 0.25)
    values: Queue[float] = Queue()
    with sim.parameters.on_change(lambda each: values.put(each["gain"])):
        assert values.get(timeout=SECONDS) == 0.25
        sim.parameters["gain"] = 0.75
        assert values.get(timeout=SECONDS) == 0.75


def test_an_exception_of_the_function_ends_the_calls_and_is_reported(
    sim: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    reported: Queue[BaseException | None] = Queue()

    def report(arguments: threading.ExceptHookArgs) -> None:
        reported.put(arguments.exc_value)

    monkeypatch.setattr(threading, "excepthook", report)

    def fails(states: States) -> None:
        raise ZeroDivisionError(states.stamp.step)

    callbacks = sim.on_states(fails)
    assert callbacks.wait(SECONDS) and not callbacks.is_open
    assert isinstance(callbacks.error, ZeroDivisionError)
    assert reported.get(timeout=SECONDS) is callbacks.error


def test_a_robot_that_is_deleted_ends_its_callbacks(
    sim: Simulation, arm: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ignore(_: threading.ExceptHookArgs) -> None:
        pass

    monkeypatch.setattr(threading, "excepthook", ignore)
    seen: Queue[RobotState] = Queue()
    callbacks = arm.on_state(seen.put)
    seen.get(timeout=SECONDS)
    arm.delete()
    assert callbacks.wait(SECONDS) and isinstance(callbacks.error, simd_client.RobotNotFound)


def test_callbacks_end_silently_with_their_connection(daemon: Daemon) -> None:
    seen: Queue[States] = Queue()
    # An exception on a thread fails a test here.
    with simd_client.connect(daemon.endpoint) as connected:
        callbacks = connected.on_states(seen.put)
        seen.get(timeout=SECONDS)
    assert callbacks.wait(SECONDS) and callbacks.error is None


async def test_functions_and_coroutine_functions_are_called_on_the_loop(sim: Simulation, daemon: Daemon) -> None:
    thread = threading.get_ident()
    async with aio.connect(daemon.endpoint) as connected:
        plain: asyncio.Queue[int] = asyncio.Queue()
        awaited: asyncio.Queue[str] = asyncio.Queue()

        def on_states(states: States) -> None:
            assert threading.get_ident() == thread
            plain.put_nowait(states.stamp.step)

        async def on_event(event: Event) -> None:
            await connected.stamp
            await awaited.put(event.kind)

        async with connected.on_states(on_states), await connected.on_event(on_event) as events:
            assert await asyncio.wait_for(plain.get(), SECONDS) == 0
            await connected.step(3)
            while await asyncio.wait_for(plain.get(), SECONDS) != 3:
                pass
            await connected.reset(time=True)
            assert await asyncio.wait_for(awaited.get(), SECONDS) == "simulation_reset"
        assert not events.is_open and await events.wait(SECONDS)


async def test_an_exception_is_reported_to_the_loop(sim: Simulation, daemon: Daemon) -> None:
    loop = asyncio.get_running_loop()
    reported: asyncio.Queue[object] = asyncio.Queue()
    loop.set_exception_handler(lambda _, what: reported.put_nowait(what.get("exception")))

    async def fails(_: States) -> None:
        raise ZeroDivisionError

    async with aio.connect(daemon.endpoint) as connected:
        callbacks = connected.on_states(fails)
        assert await callbacks.wait(SECONDS)
        assert await asyncio.wait_for(reported.get(), SECONDS) is callbacks.error
    loop.set_exception_handler(None)
