"""An exception for each reason, and the daemon's own sentence in it."""

from __future__ import annotations

import pytest

import simd_client
from simd_client import errors, layout, proto, world


def test_every_reason_of_the_schema_has_its_exception_and_no_other_is_there() -> None:
    prefix = "ERROR_REASON_"
    names = {name.removeprefix(prefix) for name in proto.ErrorReason.keys()} - {"UNSPECIFIED"}
    assert set(errors.REASONS) == names
    for kind in errors.REASONS.values():
        assert getattr(simd_client, kind.__name__) is kind


def test_a_refusal_keeps_sentence_reason_code_metadata_and_fields() -> None:
    refused = errors.refusal(
        5, "no robot is named `x`", "ROBOT_NOT_FOUND", {"robot": "x"}, {"robot": "unknown"}
    )
    assert isinstance(refused, simd_client.RobotNotFound) and isinstance(refused, LookupError)
    assert str(refused) == "no robot is named `x`"
    assert (refused.code, refused.reason) == ("NOT_FOUND", "ROBOT_NOT_FOUND")
    assert refused.metadata == {"robot": "x"} and refused.fields == {"robot": "unknown"}


def test_a_reason_from_a_newer_daemon_is_refused_and_keeps_its_sentence() -> None:
    refused = errors.refusal(3, "too purple", "TOO_PURPLE", {})
    assert type(refused) is simd_client.Refused
    assert (str(refused), refused.reason, refused.code) == ("too purple", "TOO_PURPLE", "INVALID_ARGUMENT")


def test_a_daemon_that_is_shutting_down_is_also_unavailable() -> None:
    with pytest.raises(simd_client.Unavailable):
        raise errors.refusal(14, "", "SHUTTING_DOWN", {})


def test_own_enums_have_the_numbers_of_the_schema() -> None:
    assert {m.name: m.value for m in layout.JointMode if m} == {
        name.removeprefix("JOINT_MODE_"): value for name, value in proto.JointMode.items() if value
    }
    assert {t.name: t.value for t in layout.JointType if t} == {
        name.removeprefix("JOINT_TYPE_"): value for name, value in proto.JointType.items() if value
    }
    assert {f.name: f.value for f in layout.JointFlag} == {
        name.removeprefix("JOINT_FLAG_"): value for name, value in proto.JointFlag.items() if value
    }
    states = {number for number in proto.SimulationState.values() if number}
    assert {world.state_to_proto(world.state_from_proto(number)) for number in states} == states
    assert world.state_from_proto(99) is world.SimulationState.UNKNOWN
