"""A call that timed out is asked about, and executed once."""

from __future__ import annotations

import pickle
from typing import Any, cast

import pytest
from daemon import Daemon
from pretender import Pretender

import simd_client
from simd_client import Simulation, aio, proto
from simd_client.method import Method
from simd_client.proto import methods
from simd_client.retry import FIELD, LOOP_STEPS, RequestIds

STEPS = 20_000


def test_steps_whose_answer_came_too_late_are_done_once(sim: Simulation) -> None:
    with pytest.raises(simd_client.DeadlineExceeded) as late:
        sim.step(STEPS, timeout=0.001)
    for error in (late.value, pickle.loads(pickle.dumps(late.value))):
        assert sim.ask_again(error, wait=60.0).stamp.step == STEPS
    assert sim.stamp.step == STEPS


async def test_asyncio_asks_again_too(sim: Simulation, daemon: Daemon) -> None:
    async with aio.connect(daemon.endpoint) as connected:
        with pytest.raises(simd_client.DeadlineExceeded) as late:
            await connected.step(STEPS, timeout=0.001)
        assert (await connected.ask_again(late.value, wait=60.0)).stamp.step == STEPS
    assert sim.stamp.step == STEPS


def test_a_refusal_is_raised_again() -> None:
    with Pretender("pretender") as pretender, simd_client.connect(pretender.endpoint, timeout=5.0) as sim:
        pretender.answers = False
        with pytest.raises(simd_client.DeadlineExceeded) as late:
            sim.with_timeout(0.01).set_physics(substeps=2)
        with pytest.raises(simd_client.DeadlineExceeded) as later:
            sim.with_timeout(0.01).ask_again(late.value)
        assert later.value.sent == late.value.sent and late.value.sent is not None
        assert late.value.sent.request_id.encode() in late.value.sent.payload
        pretender.answers, pretender.error = True, (b"\x08\x05\x12\x04gone", "application/protobuf;google.rpc.Status")
        with pytest.raises(simd_client.Refused, match="gone"):
            sim.ask_again(later.value)


def test_calls_that_change_nothing_are_called_again_instead(sim: Simulation) -> None:
    with pytest.raises(simd_client.DeadlineExceeded) as late:
        sim.with_timeout(-0.9).next_states(sim.stamp, wait=0.901)
    with pytest.raises(ValueError, match="make it again"):
        sim.ask_again(late.value)
    with pytest.raises(simd_client.RobotNotFound) as refused:
        sim.robot("leg")
    with pytest.raises(ValueError, match="make it again"):
        sim.ask_again(refused.value)


def test_every_request_that_changes_something_has_an_id_of_its_own() -> None:
    ids = RequestIds()
    seen: set[str] = set()
    for method in vars(methods).values():
        if isinstance(method, Method) and FIELD in method.request.DESCRIPTOR.fields_by_name:
            request = method.request(steps=LOOP_STEPS) if method is methods.StepSimulation else method.request()
            same = cast(Any, method.request).FromString(request.SerializeToString())
            sent = ids.identified(method, request)
            assert request == same
            if method is methods.SetJointTargets:
                assert sent is None
                continue
            assert sent is not None
            same.request_id = sent.request_id
            assert method.request.FromString(sent.payload) == same
            seen.add(sent.request_id)
    assert len(seen) >= 15
    assert ids.identified(methods.StepSimulation, proto.StepSimulationRequest(steps=LOOP_STEPS - 1)) is None
    given = ids.identified(methods.DeleteEntity, proto.DeleteEntityRequest(robot="arm", request_id="mine"))
    assert given is not None and given.request_id == "mine"
