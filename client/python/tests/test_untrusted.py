"""A session that receives and answers everything harms no claimed joint and no client."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
import zenoh
from daemon import Daemon

import simd_client
from simd_client import Robot, Simulation, proof, proto


@pytest.fixture
def untrusted(daemon: Daemon) -> Iterator[zenoh.Session]:
    """A session on the same network that knows only keys."""
    settings = {"mode": "client", "connect": {"endpoints": [daemon.endpoint]}}
    settings["scouting"] = {"multicast": {"enabled": False}}  # pyright: ignore[reportArgumentType]
    session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
    yield session
    session.close()  # pyright: ignore[reportUnknownMemberType]


def test_the_proof_is_the_same_as_the_daemons() -> None:
    code = "9ddbd820b1795ba083e20c3f15c7927d31e141eb154402f94cef8a083c664dc0"
    assert proof.line("1.00", 2, "simd/simd/joint_targets", b"abc") == f"simd-claim: 1 2 {code}"
    assert [proof.id_of(text) for text in ("7.ab", "", "unknown", "a.b")] == ["7", "", "unknown", "a.b"]


def test_counters_grow() -> None:
    counter, lines = proof.Counter(), [""] * 3
    for index in range(3):
        lines[index] = counter.prove("1.00", "key", b"", lambda line: line)
    numbers = [int(line.split()[2]) for line in lines]
    assert numbers == sorted(set(numbers))


def test_a_claims_secret_is_not_sent_and_what_is_sent_drives_nothing(
    sim: Simulation, arm: Robot, daemon: Daemon, untrusted: zenoh.Session
) -> None:
    heard: list[tuple[str, bytes, bytes]] = []

    def bytes_of(payload: zenoh.ZBytes | None) -> bytes:
        return b"" if payload is None else payload.to_bytes()

    def hear(message: zenoh.Sample | zenoh.Query) -> None:
        heard.append((str(message.key_expr), bytes_of(message.payload), bytes_of(message.attachment)))

    untrusted.declare_subscriber("simd/**", hear)
    untrusted.declare_queryable("simd/**", hear, complete=True)
    targets = f"simd/{daemon.name}/joint_targets"
    # Until both are known on the network.
    while not any(key.endswith("/GetSimulationState") for key, _, _ in heard):
        sim.stream_targets({arm: [0.0, 0.0]})
        _ = sim.stamp
    heard.clear()
    with arm.claim(holder="me") as claim:
        sim.stream_targets({arm: [0.5, 0.5]})
        arm.set_positions([0.4, 0.4])
        sim.step(1, {arm: [0.2, 0.2]})
        arm.set_positions([0.1, 0.1])
        own = list(heard)
        random = claim.secret.split(".")[1].encode()
        assert not any(random in payload or random in attachment for _, payload, attachment in own)
        proven = [each for each in own if b"simd-claim: " in each[2]]
        assert {key.rsplit("/", 1)[-1] for key, _, _ in proven} >= {"joint_targets", "SetJointTargets", "StepSimulation"}
        for key, payload, attachment in proven:
            if key == targets:
                untrusted.put(key, payload, attachment=attachment)
            else:
                replies = untrusted.get(key, payload=payload, attachment=attachment, target=zenoh.QueryTarget.ALL)
                assert replies.recv().err is not None
            untrusted.put(targets, payload, attachment=attachment)
        assert list(arm.target) == pytest.approx([0.1, 0.1])


def test_answers_and_publications_of_untrusted_sessions_are_not_read(
    sim: Simulation, arm: Robot, daemon: Daemon, untrusted: zenoh.Session
) -> None:
    forged = proto.JointStates(stamp=proto.Stamp(sequence=1 << 60), robots=[proto.RobotJointStates(robot="arm")])

    def answer(query: zenoh.Query) -> None:
        query.reply(query.key_expr, forged.SerializeToString())  # pyright: ignore[reportUnknownMemberType]
        query.reply_err(b"Timeout")  # pyright: ignore[reportUnknownMemberType]

    untrusted.declare_queryable("simd/**", answer, complete=True)
    with arm.watch() as watch:
        next(watch)
        for _ in range(10):
            untrusted.put(f"simd/{daemon.name}/joint_states/arm", forged.SerializeToString())
            assert sim.states().stamp.sequence < 1 << 60
            assert watch.newest().stamp.sequence < 1 << 60


def test_a_token_that_is_none_is_not_read_and_two_of_one_name_are_refused(
    sim: Simulation, daemon: Daemon, untrusted: zenoh.Session
) -> None:
    tokens = untrusted.liveliness()
    with tokens.declare_token("@simd/daemons/other/x"), simd_client.connect(daemon.endpoint) as other:
        other.states()
    forged = str(untrusted.zid())
    with tokens.declare_token(f"@simd/daemons/{daemon.name}/{forged}"):
        with pytest.raises(simd_client.EndpointError, match=forged):
            simd_client.connect(daemon.endpoint)
        # An earlier client continues.
        sim.states()
