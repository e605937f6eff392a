"""What a call does, without saying how it waits: the same for blocking and for asyncio code.

A plan is a generator. It yields what it needs, is sent what came of it, and returns its result.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeVar

from google.protobuf.message import DecodeError

from simd_client.errors import AnswerError
from simd_client.method import Method, Reply, Request

Result = TypeVar("Result")


@dataclass(frozen=True)
class Ask:
    """A request to the daemon. What is sent back is the reply's bytes."""

    method: str
    """`SERVICE/METHOD`."""
    payload: bytes
    message: str
    """The request's name in the schema."""
    wait: float
    """Seconds that the daemon itself may wait, on top of the time for an answer."""


@dataclass(frozen=True)
class Work:
    """Slow work on this machine's disk. What is sent back is its result."""

    do: Callable[[], object]


Plan = Generator[Ask | Work, Any, Result]
"""What is yielded, what is sent back, what is returned."""


def ask(method: Method[Request, Reply], request: Request, wait: float = 0.0) -> Plan[Reply]:
    """Sends one request and reads the answer."""
    payload = yield Ask(method.key, request.SerializeToString(), method.request.__name__, wait)
    return read(method.reply, payload)


def read(message: type[Reply], payload: bytes) -> Reply:
    """A message from its bytes."""
    answer = message()
    try:
        answer.ParseFromString(payload)
    except DecodeError as error:
        name = message.__name__
        raise AnswerError(f"the daemon's answer cannot be understood: it is no {name} ({error})") from error
    return answer


def work(do: Callable[[], Result]) -> Plan[Result]:
    """Does slow work where it does not stop others."""
    result = yield Work(do)
    return result
