"""Sessions of daemons by name: the client's half of `client/rust/src/zenoh/daemons.rs`."""

from __future__ import annotations

import threading

import zenoh

from simd_client import keys
from simd_client.zenoh_callbacks import callback

KEPT = 4096
"""Maximum number of remembered tokens; further ones are ignored."""


class Daemons:
    """Contents of the tokens so far. May be used from several threads. It holds no session: Zenoh's callbacks
    hold it, and would keep a session open after its program drops it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._here: set[tuple[str, str]] = set()
        self._chosen: dict[str, str] = {}

    def look(self, session: zenoh.Session, timeout: float) -> None:
        """Reads the current tokens."""
        ended = threading.Event()

        def arrived(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._hear(reply.ok)

        session.liveliness().get(keys.ALL_DAEMONS, callback(arrived, ended.set), timeout=timeout)
        # Zenoh's own time limit does not always end the query.
        ended.wait(timeout)

    def follow(self, session: zenoh.Session, name: str) -> None:
        """Follows tokens of one name from now on, until the session ends."""
        session.liveliness().declare_subscriber(keys.daemons_named(name), callback(self._hear), history=True)

    def _hear(self, sample: zenoh.Sample) -> None:
        found = keys.daemon_of(str(sample.key_expr))
        if found is None:
            return
        with self._lock:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._here.discard(found)
            elif len(self._here) < KEPT:
                self._here.add(found)

    def names(self) -> list[str]:
        """Names of the present daemons, sorted."""
        with self._lock:
            return sorted({name for name, _ in self._here})

    def sessions(self, name: str) -> list[str]:
        """Returns ids of the sessions that claim this daemon name, sorted."""
        with self._lock:
            return sorted(zid for there, zid in self._here if there == name)

    def choose(self, name: str) -> str | None:
        """Returns the session that receives calls: the previous one while it exists, else the only one with
        the name. `None` if no session or several have it."""
        there = self.sessions(name)
        with self._lock:
            chosen = self._chosen.get(name)
            if chosen in there or (chosen is not None and not there):
                return chosen
            if len(there) != 1:
                return None
            self._chosen[name] = there[0]
            return there[0]


def several(name: str, sessions: list[str]) -> str:
    """Returns why none of several sessions is chosen."""
    return (
        f"several sessions say that they are the daemon `{name}`: {' and '.join(sessions)}; end all but one, or start "
        "it with another --name"
    )
