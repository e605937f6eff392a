"""Which session is the daemon of which name: the client's half of `client/rust/src/zenoh/daemons.rs`."""

from __future__ import annotations

import threading

import zenoh

from simd_client import keys
from simd_client.zenoh_callbacks import callback

KEPT = 4096
"""Tokens that are remembered; more are not read."""


class Daemons:
    """What tokens said so far. May be used from several threads. It has no session: Zenoh's callbacks have it, and a
    session that they lead back to would stay open when its program drops it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._here: set[tuple[str, str]] = set()
        self._chosen: dict[str, str] = {}

    def look(self, session: zenoh.Session, timeout: float) -> None:
        """Takes in the tokens that are there now."""
        ended = threading.Event()

        def arrived(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._hear(reply.ok)

        session.liveliness().get(keys.ALL_DAEMONS, callback(arrived, ended.set), timeout=timeout)
        # Zenoh's own time limit does not always end it.
        ended.wait(timeout)

    def follow(self, session: zenoh.Session, name: str) -> None:
        """Takes in the tokens of one name that come and go from now on, until the session ends."""
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
        """Of the daemons that are there, sorted."""
        with self._lock:
            return sorted({name for name, _ in self._here})

    def sessions(self, name: str) -> list[str]:
        """Ids of the sessions that say that they are the daemon of this name, sorted."""
        with self._lock:
            return sorted(zid for there, zid in self._here if there == name)

    def choose(self, name: str) -> str | None:
        """The session that calls are meant for: the one that was meant before, for as long as it is there, else the
        only one that has the name. `None` where there is none or where there are several."""
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
    """Why none of several is taken."""
    return (
        f"several sessions say that they are the daemon `{name}`: {' and '.join(sessions)}; end all but one, or start "
        "it with another --name"
    )
