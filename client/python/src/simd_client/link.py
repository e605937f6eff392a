"""Link to one daemon: sends requests, and turns error replies into exceptions. `ZenohLink` works over Zenoh,
`EmbeddedLink` with a world in this process."""

from __future__ import annotations

import atexit
import os
import sys
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, Union

import zenoh
from google.protobuf.message import DecodeError

from simd_client.endpoint import Endpoint
from simd_client.errors import ERROR_DOMAIN, SimdError, Unavailable, refusal
from simd_client.method import Method
from simd_client.proto.status_pb2 import BadRequest, ErrorInfo, Status
from simd_client.retry import RequestIds
from simd_client.zenoh_callbacks import wait_for_callbacks

AnyMethod = Method[Any, Any]

MAX_REPLIES = 256
"""Maximum number of queued stream replies."""

EXIT_SECONDS = 2.0
"""Seconds that the end of a program waits for a running callback."""


Answer = Union[zenoh.Reply, bytes, SimdError]
"""Result of a call before it is `opened`: bytes of a message, or an error."""


class Subscription(Protocol):
    """A subscription to publications."""

    def undeclare(self) -> None:
        """Ends it."""
        ...


class LinkThread(Protocol):
    """A thread that uses a session."""

    def end(self) -> None:
        """Makes the thread end soon."""
        ...

    def wait(self, timeout: float | None) -> bool:
        """Waits until it has ended."""
        ...


def program() -> str:
    """Returns the name under which others see this client: the script's, in characters that every transport
    takes."""
    name = Path(sys.argv[0]).name if sys.argv else ""
    # Typed in, from stdin, or with -c: there is no script.
    name = "" if name.startswith("-") else name
    return "".join(c for c in name if c.isascii() and c.isprintable()) or "python"


STATUS = "google.rpc.Status"
"""Type of the message of a refusal."""


class Link:
    """A link to a daemon. May be used from several threads."""

    def __init__(self, endpoint: Endpoint, name: str) -> None:
        self.endpoint = endpoint
        self.name = name
        self.request_ids = RequestIds()
        self._is_forked = False
        self.threads: weakref.WeakSet[LinkThread] = weakref.WeakSet()
        """Threads of this client that use the link."""
        _open.add(self)

    @property
    def is_closed(self) -> bool:
        """Whether it is closed."""
        raise NotImplementedError

    def close(self) -> None:
        """Closes it, and everything that depends on it."""
        _open.discard(self)

    def query(self, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
        """Sends a request and blocks until its reply. Returns the reply's bytes."""
        raise NotImplementedError

    def start(
        self,
        method: AnyMethod,
        payload: bytes,
        timeout: float,
        arrived: Callable[[Answer], None],
        ended: Callable[[], None],
        *,
        is_stream: bool = False,
    ) -> None:
        """Sends a request and returns. `arrived` is called with the reply, or with all replies of a stream
        that lasts `timeout` seconds. Then `ended` is called. Both run on a thread of the link."""
        raise NotImplementedError

    def subscribe(self, key: str, take: Callable[[str, bytes], None]) -> Subscription:
        """Calls `take` with the key and the bytes of each publication of the daemon, on a thread of the
        link."""
        raise NotImplementedError

    def publish_targets(self, payload: bytes) -> None:
        """Sends targets without waiting for an answer."""
        raise NotImplementedError

    def opened(self, answer: Answer, timeout: float) -> bytes:
        """Returns the bytes of an answer. Raises the exception of an error answer."""
        if isinstance(answer, SimdError):
            raise answer
        if not isinstance(answer, bytes):
            raise SimdError(f"the daemon's answer cannot be understood: {answer!r}")
        return answer

    def unavailable(self) -> Unavailable:
        """Returns the exception for a request that no daemon received."""
        raise NotImplementedError

    def mark_forked(self) -> None:
        """Called in a forked process: only the parent process has the connection's threads."""
        self._is_forked = True

    def _check_process(self) -> None:
        if self._is_forked:
            raise Unavailable(
                "a connection cannot be used in a forked process: connect to a world within it (`embedded`) there, or start processes "
                "with the method `spawn` and connect in each of them"
            )


_open: weakref.WeakSet[Link] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Closes the sessions that a program left open. Otherwise Zenoh would close them while the interpreter ends, and
    wait for callbacks that can no longer run: the program would hang."""
    links = list(_open)
    threads = [thread for link in links for thread in link.threads]
    for thread in threads:
        thread.end()
    for link in links:
        link.close()
    for thread in threads:
        thread.wait(EXIT_SECONDS)
    # This includes sessions that were closed, or dropped, before.
    wait_for_callbacks(EXIT_SECONDS)


def _forked() -> None:
    for link in list(_open):
        link.mark_forked()
    _open.clear()


os.register_at_fork(after_in_child=_forked)


def refused(payload: bytes) -> SimdError:
    """Returns the exception of a refusal, which is a `google.rpc.Status`."""
    status = Status()
    try:
        status.ParseFromString(payload)
    except DecodeError as error:
        return SimdError(f"the daemon's answer cannot be understood: it is not a {STATUS} ({error})")
    info, bad = ErrorInfo(), BadRequest()
    for detail in status.details:
        kind = detail.type_url.rsplit("/", 1)[-1]
        if kind == "google.rpc.ErrorInfo":
            info.ParseFromString(detail.value)
        elif kind == "google.rpc.BadRequest":
            bad.ParseFromString(detail.value)
    reason = info.reason if info.domain == ERROR_DOMAIN else ""
    fields = {violation.field: violation.description for violation in bad.field_violations}
    return refusal(status.code, status.message, reason, info.metadata, fields)
