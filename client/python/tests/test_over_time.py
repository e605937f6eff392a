"""Published items are the newest, however slow their reader."""

from __future__ import annotations

import itertools
import time

import pytest
from daemon import ASSETS, Daemon, within

import simd_client
from simd_client import DeadlineExceeded, Robot, Simulation


def test_a_watch_begins_with_what_there_is_also_of_a_paused_world(arm: Robot) -> None:
    arm.reset_joints([0.1, 0.2])
    with arm.watch() as states:
        first = next(states)
        assert first.position.tolist() == [0.1, 0.2]
        arm.reset_joints([0.3, 0.4])
        assert next(states).position.tolist() == [0.3, 0.4]
        with pytest.raises(DeadlineExceeded):
            states.wait(0.05)


def test_a_reader_that_stalled_gets_the_newest_state_and_no_old_one(sim: Simulation, arm: Robot) -> None:
    with arm.watch() as states:
        next(states)
        sim.play()
        before = next(states).stamp.sequence
        # The reader stalls until the world has made many publications.
        stop = within()
        while sim.stamp.step < 1000 and time.monotonic() < stop:
            pass
        sim.pause()
        last = sim.states()[arm]
        newest = list(itertools.takewhile(lambda s: s.stamp.sequence < last.stamp.sequence, states))
    assert last.stamp.sequence - before > 500
    # At most one publication waited, although many were made meanwhile.
    assert len(newest) <= 3, [state.stamp.sequence for state in newest]


def test_a_watch_waits_for_publications_and_not_for_a_time(
    sim: Simulation, arm: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reader that polls misses states between two polls: at 1 kHz an eighth of the states, with a poll each
    millisecond."""
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        if seconds > 0.0:
            slept.append(seconds)

    for module in ("simd_client.blocking.runtime.sleep", "simd_client.blocking.watch.sleep", "time.sleep"):
        monkeypatch.setattr(module, sleep)
    with arm.watch() as states:
        steps = [next(states).stamp.step]
        for _ in range(20):
            sim.step(1)
            steps.append(states.wait(20).stamp.step)
    assert steps == list(range(steps[0], steps[0] + 21))
    assert slept == []


def test_a_watch_has_no_more_states_than_its_rate(sim: Simulation, arm: Robot) -> None:
    sim.play()
    with arm.watch(rate=20) as states:
        next(states)
        begin = time.monotonic()
        stamps = [state.stamp.sequence for state in itertools.islice(states, 10)]
        assert time.monotonic() - begin > 8 / 20
    assert stamps == sorted(set(stamps))
    with pytest.raises(ValueError, match="a rate is above 0"):
        arm.watch(rate=0)


def test_the_newest_state_is_had_without_waiting(sim: Simulation, arm: Robot) -> None:
    with arm.watch() as states:
        assert states.newest() is states.newest()
        arm.reset_joints([0.5, 0.5])
        stop = within()
        while states.newest().position[0] != 0.5 and time.monotonic() < stop:
            pass
        assert states.newest().position[0] == 0.5


def test_a_watch_of_a_robot_that_goes_ends_with_a_sentence(arm: Robot) -> None:
    with arm.watch() as states:
        next(states)
        arm.delete()
        with pytest.raises(simd_client.RobotNotFound):
            states.wait(20)


def test_a_watch_of_a_daemon_that_dies_ends_with_a_sentence() -> None:
    with Daemon(name="doomed") as doomed, simd_client.connect(doomed.endpoint, timeout=5) as sim:
        arm = sim.load(ASSETS / "Two Link.v2", fixed=True)
        with arm.watch() as states:
            next(states)
            doomed.kill()
            with pytest.raises(simd_client.Unavailable):
                for _ in states:
                    pass


def test_a_world_is_watched_with_all_its_robots_of_one_moment(sim: Simulation, arm: Robot) -> None:
    sim.load(ASSETS / "Two Link.v2", "other", fixed=True)
    sim.play()
    for states in itertools.islice(sim.watch(rate=100), 5):
        assert set(states) == {"arm", "other"} and states["arm"].stamp == states["other"].stamp
    with sim.watch() as watch:
        assert set(next(watch)) == {"arm", "other"}
    assert list(watch) == []
    sim.pause()
    now = sim.next_states(0)
    assert sim.next_states(now.stamp, 0.05).stamp == now.stamp


def test_streamed_targets_take_effect_without_an_answer(sim: Simulation, arm: Robot) -> None:
    arm.stream_targets([0.1, 0.2])
    stop = within()
    while arm.target.tolist() != [0.1, 0.2] and time.monotonic() < stop:
        pass
    assert arm.target.tolist() == [0.1, 0.2]
    sim.stream_targets({"arm": {"elbow joint": 0.5}})
    while arm.target[1] != 0.5 and time.monotonic() < stop:
        pass
    assert arm.target.tolist() == [0.1, 0.5]


def test_targets_are_exchanged_for_the_first_state_that_was_stepped_with_them(
    sim: Simulation, arm: Robot
) -> None:
    sim.play()
    before = sim.stamp
    states = [sim.exchange({arm: {"elbow joint": 0.01 * turn}}, states=arm)[arm] for turn in range(1, 11)]
    for turn, state in enumerate(states, 1):
        assert state.target[1] == 0.01 * turn
    sequences = [before.sequence, *(state.stamp.sequence for state in states)]
    assert sequences == sorted(set(sequences))
    sim.pause()
    assert sim.exchange({}, wait=0.0).stamp == sim.stamp
    assert sim.exchange({arm: [0.0, 9.0]}, wait=0.0).clamped[0].applied == 2.4
    with pytest.raises(simd_client.TargetBeyondLimit):
        sim.exchange({arm: [0.0, 9.0]}, wait=0.0, beyond_limit="refuse")
    with pytest.raises(simd_client.RobotNotFound) as refused:
        sim.exchange({"leg": {"knee": 0.0}}, wait=0.0)
    assert refused.value.metadata["robot"] == "leg" and refused.value.code == "NOT_FOUND"


def test_statistics_come_ten_times_a_second(sim: Simulation) -> None:
    assert sim.statistics.robots == 0
    sim.play()
    with sim.watch_statistics() as statistics:
        first, second = itertools.islice(statistics, 2)
    assert second.iterations > first.iterations and second.target_real_time_factor == 1.0


def test_events_are_reported_in_order(sim: Simulation) -> None:
    events = sim.events()
    arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
    arm.delete()
    spawned, deleted = events.wait(20), events.wait(20)
    assert (spawned.kind, spawned.detail.robot) == ("entity_spawned", "arm")
    assert (deleted.kind, deleted.sequence) == ("entity_deleted", spawned.sequence + 1)
    assert "entity_deleted" in repr(deleted)
    again = next(sim.events(after=spawned.sequence))
    assert again == deleted
    with pytest.raises(DeadlineExceeded):
        events.wait(0.05)
