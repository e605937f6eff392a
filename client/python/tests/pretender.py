"""A fake of daemons on Zenoh, for answers that a real one does not give."""

from __future__ import annotations

import json
import socket
from types import TracebackType
from typing import cast

import zenoh

from simd_client import proto


class Pretender:
    """Answers every query with an empty message, or with a given one. Without `answers` it holds them, except
    questions of the method `still_answers`. With the question `releases_at`, counted from 1, it answers what it
    holds."""

    def __init__(self, *names: str) -> None:
        self.answers = True
        self.still_answers = ""
        self.releases_at = 0
        self.asked = 0
        self.payload = proto.GetSimulationStateResponse().SerializeToString()
        self.error: tuple[bytes, str] | None = None
        self._held: list[zenoh.Query] = []
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        settings = {
            "mode": "peer",
            "listen": {"endpoints": [self.endpoint]},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        }
        self._session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        handler = cast(
            "zenoh.handlers.Callback[zenoh.Query]", zenoh.handlers.Callback(self._answer, indirect=False)
        )
        self._tokens = [self._session.liveliness().declare_token(f"@simd/daemons/{name}/{self._session.zid()}") for name in names]
        self._queryables = [self._session.declare_queryable(f"simd/{name}/rpc/**", handler) for name in names]

    def _answer(self, query: zenoh.Query) -> None:
        if self.still_answers and str(query.key_expr).endswith(f"/{self.still_answers}"):
            self.asked += 1
            query.reply(query.key_expr, b"")  # pyright: ignore[reportUnknownMemberType]
            while self.asked == self.releases_at and self._held:
                held = self._held.pop()
                held.reply(held.key_expr, b"")  # pyright: ignore[reportUnknownMemberType]
        elif not self.answers:
            self._held.append(query)
        elif self.error is not None:
            query.reply_err(self.error[0], encoding=self.error[1])  # pyright: ignore[reportUnknownMemberType]
        else:
            query.reply(query.key_expr, self.payload)  # pyright: ignore[reportUnknownMemberType]

    def __enter__(self) -> Pretender:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._held.clear()
        self._session.close()  # pyright: ignore[reportUnknownMemberType]
