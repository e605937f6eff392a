"""Calls of `SimulationService` and `EventService`: time, settings, snapshots, events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy.typing as npt

from simd_client import proto
from simd_client.errors import AnswerError
from simd_client.event import Event, event_from_proto
from simd_client.geometry import vector_to_proto
from simd_client.link_states import link_states_from_proto
from simd_client.memory import Memory
from simd_client.plan import Plan, ask, read
from simd_client.plans import joints
from simd_client.plans.joints import Selection
from simd_client.proto import methods
from simd_client.state import States, clamped_from_proto
from simd_client.target import BeyondLimit, Targets, beyond_limit_to_proto
from simd_client.world import (
    Pace,
    Physics,
    SimulationState,
    SimulatorInfo,
    Snapshot,
    Stamp,
    WorldStatistics,
    info_from_proto,
    pace_to_proto,
    physics_from_proto,
    snapshot_from_proto,
    stamp_from_proto,
    state_from_proto,
    state_to_proto,
    statistics_from_proto,
)


def info() -> Plan[SimulatorInfo]:
    """Who answers."""
    return info_from_proto((yield from ask(methods.GetSimulatorInfo, proto.GetSimulatorInfoRequest())))


def state() -> Plan[tuple[SimulationState, Stamp]]:
    """Whether the world runs, and since when that is known."""
    answer = yield from ask(methods.GetSimulationState, proto.GetSimulationStateRequest())
    return state_from_proto(answer.state), stamp_from_proto(answer.stamp)


def set_state(wanted: SimulationState) -> Plan[Stamp]:
    """Plays, pauses or stops."""
    request = proto.SetSimulationStateRequest(state=state_to_proto(wanted))
    return stamp_from_proto((yield from ask(methods.SetSimulationState, request)).stamp)


def step(
    memory: Memory,
    steps: int,
    targets: Targets | None,
    with_states: bool | Selection,
    beyond_limit: BeyondLimit,
    wait: float,
    with_links: bool = False,
) -> Plan[States]:
    """Steps, with targets before and states after, in one round trip."""
    sent = yield from joints.wire(memory, targets or {})
    wanted = with_links or (with_states is not False and with_states is not None)
    selected = [] if isinstance(with_states, bool) else joints.selections(with_states)
    request = proto.StepSimulationRequest(
        steps=steps,
        robots=sent.robots,
        limit_policy=beyond_limit_to_proto(beyond_limit),
        claim=sent.claim,
        return_states=wanted,
        selections=selected,
        return_link_states=with_links,
    )
    with joints.forgetting_layouts(memory):
        answer = yield from ask(methods.StepSimulation, request, wait)
    clamped = clamped_from_proto(answer.clamped)
    if not wanted:
        return States(stamp_from_proto(answer.stamp), {}, clamped)
    if not answer.HasField("states"):
        raise AnswerError("the daemon's answer cannot be understood: it did the steps and lacks `states`")
    states = yield from joints.states_from(memory, answer.states, selected, clamped)
    links = {each.robot: link_states_from_proto(each, states.stamp) for each in answer.link_states}
    return replace(states, links=links) if links else states


def reset(time: bool, state: bool, spawned: bool) -> Plan[tuple[Stamp, Sequence[str]]]:
    """Puts the world back, by scope."""
    request = proto.ResetSimulationRequest(time=time, state=state, spawned=spawned)
    answer = yield from ask(methods.ResetSimulation, request)
    return stamp_from_proto(answer.stamp), tuple(answer.deleted)


def physics() -> Plan[Physics]:
    """The settings."""
    return physics_from_proto((yield from ask(methods.GetPhysics, proto.GetPhysicsRequest())).physics)


def set_physics(
    gravity: npt.ArrayLike | None,
    time_step: float | None,
    substeps: int | None,
    real_time_factor: float | None,
    pace: Pace | str | None,
) -> Plan[Physics]:
    """Changes what is given and leaves the rest."""
    request = proto.SetPhysicsRequest(
        gravity=None if gravity is None else vector_to_proto(gravity, "gravity"),
        time_step=time_step,
        substeps=substeps,
        real_time_factor=real_time_factor,
        pace=None if pace is None else pace_to_proto(pace),
    )
    return physics_from_proto((yield from ask(methods.SetPhysics, request)).physics)


def statistics() -> Plan[WorldStatistics]:
    """How well the world keeps time."""
    answer = yield from ask(methods.GetWorldStatistics, proto.GetWorldStatisticsRequest())
    return statistics_from_proto(answer.statistics)


def published_statistics(payload: bytes) -> Plan[WorldStatistics | None]:
    """The same as they are published."""
    yield from ()
    return statistics_from_proto(read(proto.WorldStatistics, payload))


def save_snapshot(name: str) -> Plan[Snapshot]:
    """Keeps the state of the world."""
    answer = yield from ask(methods.SaveSnapshot, proto.SaveSnapshotRequest(name=name))
    return snapshot_from_proto(answer.snapshot)


def restore_snapshot(name: str) -> Plan[Stamp]:
    """Puts the world back to a kept state."""
    answer = yield from ask(methods.RestoreSnapshot, proto.RestoreSnapshotRequest(name=name))
    return stamp_from_proto(answer.stamp)


def snapshots() -> Plan[list[Snapshot]]:
    """Those that are kept, oldest first."""
    answer = yield from ask(methods.ListSnapshots, proto.ListSnapshotsRequest())
    return [snapshot_from_proto(each) for each in answer.snapshots]


def delete_snapshot(name: str) -> Plan[None]:
    """Forgets a kept state."""
    yield from ask(methods.DeleteSnapshot, proto.DeleteSnapshotRequest(name=name))


def events(after: int, wait: float) -> Plan[tuple[list[Event], int]]:
    """Events after that sequence, waiting for the first; and the newest sequence there is."""
    request = proto.NextEventsRequest(after_sequence=after, timeout=wait)
    answer = yield from ask(methods.NextEvents, request, wait)
    missed = [answer.missed] + [0] * len(answer.events)
    found = [event_from_proto(event, gone) for event, gone in zip(answer.events, missed)]
    return found, answer.last_sequence
