"""Several calls in one round trip."""

from __future__ import annotations

from typing import Any

import pytest
from daemon import Daemon

import simd_client
from simd_client import Simulation, aio, proto
from simd_client.proto import methods


def test_answers_come_in_the_order_of_the_calls(sim: Simulation) -> None:
    calls: list[tuple[Any, Any]] = [
        (methods.SetPhysics, proto.SetPhysicsRequest(time_step=0.002)),
        (methods.ListClients, proto.ListClientsRequest()),
        *[(methods.GetSimulationState, proto.GetSimulationStateRequest())] * 100,
    ]
    physics, clients, *states = sim.call_all(*calls)
    assert physics.physics.time_step == 0.002
    assert len(clients.clients) >= 1 and len(states) == 100
    assert {type(state) for state in states} == {proto.GetSimulationStateResponse}
    assert sim.call_all() == []


def test_one_that_is_refused_is_raised_after_the_others_are_done(sim: Simulation) -> None:
    with pytest.raises(simd_client.RobotNotFound):
        sim.call_all(
            (methods.DeleteEntity, proto.DeleteEntityRequest(robot="moon")),
            (methods.SaveState, proto.SaveStateRequest(name="kept")),
        )
    assert [state.name for state in sim.saved_states()] == ["kept"]


def waiting(version: int) -> list[tuple[Any, Any]]:
    """Calls that each wait for a change of the parameters, and one more that changes them: executed in
    sequence, they would time out."""
    wait = proto.NextParametersRequest(after_version=version, timeout=60.0)
    added = proto.AddParameterRequest(parameter=proto.Parameter(name="go", button=proto.Button()))
    return [*[(methods.NextParameters, wait)] * 20, (methods.AddParameter, added)]


def test_all_are_sent_before_the_first_is_answered(sim: Simulation) -> None:
    version = sim.parameters.all().version
    *seen, _ = sim.call_all(*waiting(version))
    assert {each.list.version for each in seen} == {version + 1}


async def test_the_same_holds_with_asyncio(sim: Simulation, daemon: Daemon) -> None:
    version = sim.parameters.all().version
    async with aio.connect(daemon.endpoint) as connected:
        *seen, _ = await connected.call_all(*waiting(version))
    assert {each.list.version for each in seen} == {version + 1}
