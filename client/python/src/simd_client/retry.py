"""Ids of requests, by which the daemon knows a request that it has done already."""

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
"""A call for fewer steps is one of a loop, in which an id would cost a tenth of the round trip."""


@dataclass(frozen=True)
class Sent:
    """A request as it was sent, for `Simulation.ask_again`."""

    method: Method[Any, Any]
    payload: bytes
    request_id: str


class RequestIds:
    """Gives each request that changes something an id of its own. May be used from several threads."""

    def __init__(self) -> None:
        # All programs of one name share their ids, so that those of two processes must differ.
        self._prefix = os.urandom(8).hex()
        self._count = itertools.count(1)

    def identified(self, method: Method[Any, Any], request: Any) -> Sent | None:
        """The request with an id: its own, or a new one. `None` where its message has no room for one, and for the calls
        of loops: targets may be set twice, and of few steps the stamp tells whether they were done."""
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
        # A field that follows the others is read as if it stood among them, and the caller's message stays as it is.
        # Numbers of fields below 16 have a tag of one byte, lengths below 128 one byte.
        return Sent(method, payload + bytes((field.number << 3 | 2, len(name))) + name.encode(), name)


def _is_of_loop(request: Any) -> bool:
    """Whether a call is one of a loop."""
    if isinstance(request, proto.StepSimulationRequest):
        return request.steps < LOOP_STEPS
    return isinstance(request, proto.SetJointTargetsRequest)
