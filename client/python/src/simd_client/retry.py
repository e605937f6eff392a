"""Ids of requests, by which the daemon recognises a request that it has done already."""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from typing import Any

from google.protobuf.message import Message

from simd_client import proto
from simd_client.method import Method

FIELD = "request_id"

LOOP_STEPS = 100
"""A call for fewer steps belongs to a loop, in which an id would cost a tenth of the round trip."""


@dataclass(frozen=True)
class Sent:
    """A request as it was sent, for `Simulation.ask_again`."""

    method: Method[Any, Any]
    payload: bytes
    request_id: str


class RequestIds:
    """Gives each changing request a unique id. May be used from several threads."""

    def __init__(self) -> None:
        # All programs of one name share their ids, so two processes must have different ones.
        self._prefix = os.urandom(8).hex()
        self._count = itertools.count(1)

    def identified(self, method: Method[Any, Any], request: Any) -> Sent | None:
        """Returns the request with an id: the caller's, or a new one. `None` if its message has no such
        field, and for calls of loops. Repeated targets are harmless, and after few steps the stamp shows
        whether they were done."""
        if _is_of_loop(request) and not request.request_id:
            return None
        if not isinstance(request, Message):
            return None
        field = request.DESCRIPTOR.fields_by_name.get(FIELD)
        if field is None:
            return None
        given: str = getattr(request, FIELD)
        if given:
            return Sent(method, request.SerializeToString(), given)
        payload = request.SerializeToString()
        name = f"{self._prefix}-{next(self._count)}"
        # A field that follows the others is parsed as if it stood among them, and the caller's message stays
        # unchanged. Field numbers below 16 have a tag of one byte, lengths below 128 one byte.
        return Sent(method, payload + bytes((field.number << 3 | 2, len(name))) + name.encode(), name)


def _is_of_loop(request: Any) -> bool:
    """Whether a call belongs to a loop."""
    if isinstance(request, proto.StepSimulationRequest):
        return request.steps < LOOP_STEPS
    return isinstance(request, proto.SetJointTargetsRequest)
