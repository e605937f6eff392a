"""Proof of a claim without its secret: the client's half of `proto/src/proof.rs`."""

from __future__ import annotations

import hmac
import re
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from google.protobuf.message import DecodeError, Message

Result = TypeVar("Result")

_SECRET = re.compile(r"([0-9]+)\.", re.ASCII)


def id_of(secret: str) -> str:
    """Public part in the field `claim` of a request: the id. Empty for no claim."""
    found = _SECRET.match(secret)
    return secret if found is None else found[1]


def sealed(message: type[Any], payload: bytes) -> tuple[bytes, str]:
    """Returns the request to send, with the claim's id instead of its secret, and the secret; empty for no
    claim."""
    if not issubclass(message, Message) or "claim" not in message.DESCRIPTOR.fields_by_name:
        return payload, ""
    request: Any = message()
    try:
        request.ParseFromString(payload)
    except DecodeError:
        return payload, ""
    secret: str = request.claim
    request.claim = id_of(secret)
    return (payload, "") if request.claim == secret else (request.SerializeToString(), secret)


def line(secret: str, counter: int, key: str, payload: bytes) -> str:
    """Returns the line of the attachment that proves it, for one key, counter and payload."""
    said = f"simd.v1 claim\n{key}\n{counter}\n".encode() + payload
    code = hmac.new(secret.encode(), said, "sha256").hexdigest()
    return f"simd-claim: {id_of(secret)} {counter} {code}"


class Counter:
    """Numbers the proofs of one session. May be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._last = 0

    def prove(self, secret: str, key: str, payload: bytes, send: Callable[[str], Result]) -> Result:
        """Sends a message with a proof. Messages go one after the other: the daemon takes no number after a
        larger one. Numbers are times in nanoseconds, so that a program that kept its secret can continue
        after a restart."""
        with self._lock:
            self._last = max(self._last + 1, time.time_ns())
            return send(line(secret, self._last, key, payload))
