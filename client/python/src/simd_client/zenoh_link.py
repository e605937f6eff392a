"""The Zenoh session to one daemon: a link that sends queries."""

from __future__ import annotations

import ctypes
import os
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any, TypeVar, cast

import zenoh

from simd_client import keys
from simd_client.daemons import Daemons, several
from simd_client.endpoint import Endpoint
from simd_client.errors import DeadlineExceeded, EndpointError, SimdError, Unavailable
from simd_client.link import STATUS, Answer, AnyMethod, Link, Subscription, program, refused
from simd_client.proof import Counter, sealed
from simd_client.proto import SetJointTargetsRequest, methods
from simd_client.version import API_VERSION
from simd_client.zenoh_callbacks import callback, close_anywhere

Result = TypeVar("Result")

MAX_ANSWER_BYTES = 64 * 1024 * 1024
"""Larger messages are refused, so that a faulty daemon cannot fill the client's memory."""

TOKEN_ENVIRONMENT = "SIMD_TOKEN"
"""The environment variable with the token, unless the program gives one."""


def _attachment(token: str | None) -> str:
    """Attachment of each message: the version, the client's name, and the optional token."""
    lines = [f"simd-api-version: {API_VERSION[0]}.{API_VERSION[1]}", f"simd-client: {program()}"]
    token = token or os.environ.get(TOKEN_ENVIRONMENT)
    if token:
        if not (token.isascii() and token.isprintable()):
            raise ValueError("the token has characters that no token has")
        lines.append(f"authorization: Bearer {token}")
    return "\n".join(lines)


class ZenohLink(Link):
    """A Zenoh session and the name of the daemon."""

    def __init__(
        self,
        session: zenoh.Session,
        endpoint: Endpoint,
        name: str,
        daemons: Daemons,
        token: str | None = None,
    ) -> None:
        super().__init__(endpoint, name)
        self.session = session
        self._attachment = _attachment(token)
        self._daemons = daemons
        self._counter = Counter()
        self._publisher: zenoh.Publisher | None = None
        self._token: zenoh.LivelinessToken | None = None
        self._routes: dict[str, tuple[zenoh.KeyExpr, dict[str, Any]]] = {}
        self._lock = threading.Lock()
        # The end of a program closes it automatically.
        self._finalizer = weakref.finalize(self, close_anywhere, session)
        self._finalizer.atexit = False

    @property
    def is_closed(self) -> bool:
        """Whether the session is closed."""
        return self.session.is_closed()

    def close(self) -> None:
        """Closes the session, and all its declarations."""
        super().close()
        if not self._is_forked:
            self.session.close()  # pyright: ignore[reportUnknownMemberType]

    def mark_forked(self) -> None:
        """Called in a forked process: only the parent process has the connection's threads."""
        super().mark_forked()
        # Zenoh closes a dropped session, and would wait for threads that do not exist here: it is never
        # dropped.
        self._finalizer.detach()
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self.session))

    def query(self, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
        """Sends a request and blocks until its reply. Returns the reply's bytes."""
        # Zenoh may end a query without a reply while it removes another session of this process.
        for pause in (0.05, 0.2, 0.5) if _only_reads(method) else ():
            reply = self._reply(method, payload, timeout)
            if reply is not None or self.session.is_closed():
                break
            time.sleep(pause)
        else:
            reply = self._reply(method, payload, timeout)
        if reply is None:
            raise self.unavailable()
        return self.opened(reply, timeout)

    def _reply(self, method: AnyMethod, payload: bytes, timeout: float) -> zenoh.Reply | None:
        """Sends a request and blocks until its reply. Returns `None` if the query ends without one."""
        daemon = self.daemon()
        try:
            replies = self._send(
                method,
                payload,
                timeout,
                lambda key, options: cast("zenoh.Handler[zenoh.Reply]", self.session.get(key, **options)),
            )
            # Replies of other sessions are ignored.
            reply = replies.recv()
            while not _is_from(daemon, reply):
                reply = replies.recv()
        except zenoh.ZError:
            return None
        return reply

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
        """Sends a request and returns. Zenoh calls `arrived` with the reply, or with all replies of a stream
        that lasts `timeout` seconds, and then `ended`, on its thread."""
        daemon = self.daemon()

        def filtered(reply: zenoh.Reply) -> None:
            if _is_from(daemon, reply):
                arrived(reply)

        handler = callback(filtered, ended)
        # A stream ends with its time, or with the session that it names.
        lasts = f"for={timeout:g}" if is_stream else ""
        try:
            self._send(
                method,
                payload,
                timeout,
                lambda key, options: self.session.get(
                    zenoh.Selector(key, lasts) if lasts else key, handler, **options
                ),
                is_bound=is_stream,
            )
        except zenoh.ZError:
            raise self.unavailable() from None

    def subscribe(self, key: str, take: Callable[[str, bytes], None]) -> Subscription:
        """Calls `take` with each publication of the daemon, on Zenoh's thread. A publication without the
        daemon's session as its source is ignored."""
        # The link itself must not be captured: Zenoh's references would keep it open.
        daemons, name = self._daemons, self.name

        def filtered(sample: zenoh.Sample) -> None:
            source = sample.source_info
            if source is not None and str(source.source_id.zid) == daemons.choose(name):
                take(str(sample.key_expr), sample.payload.to_bytes())

        handler = callback(filtered)
        try:
            self._check_process()
            # Its `undeclare` has no types.
            return cast(Subscription, self.session.declare_subscriber(key, handler))
        except zenoh.ZError:
            raise self.unavailable() from None

    def daemon(self) -> str:
        """Returns the id of the daemon's session, which changes when the daemon is restarted. Raises
        `Unavailable` if no session has its name, and `EndpointError` if several have it."""
        self._check_process()
        daemon = self._daemons.choose(self.name)
        if daemon is not None:
            return daemon
        sessions = self._daemons.sessions(self.name)
        raise EndpointError(several(self.name, sessions)) if len(sessions) > 1 else self.unavailable()

    def _send(
        self,
        method: AnyMethod,
        payload: bytes,
        timeout: float,
        send: Callable[[zenoh.KeyExpr, dict[str, Any]], Result],
        *,
        is_bound: bool = False,
    ) -> Result:
        """Sends a query, with the proof of its claim if it has one. A query that `is_bound` names its session."""
        payload, secret = sealed(method.request, payload)
        key, options = self._request(method, payload, timeout)
        attachment = self._attachment
        if is_bound or method is methods.ClaimJoints or method is methods.AddMarkers:
            attachment = f"{attachment}\nsimd-session: {self._present()}"
            options["attachment"] = attachment
        if not secret:
            return send(key, options)
        return self._counter.prove(
            secret, str(key), payload, lambda proof: send(key, {**options, "attachment": f"{attachment}\n{proof}"})
        )

    def _present(self) -> str:
        """Declares the liveliness token of this client, for streams, claims and markers that end with it.
        Returns the session's id."""
        session = str(self.session.zid())
        with self._lock:
            if self._token is None:
                self._token = self.session.liveliness().declare_token(keys.client(self.name, session))
        return session

    def _request(
        self, method: AnyMethod, payload: bytes, timeout: float
    ) -> tuple[zenoh.KeyExpr, dict[str, Any]]:
        """Returns the key and the options of a query; constant ones are made once."""
        self._check_process()
        route = self._routes.get(method.key)
        if route is None:
            same: dict[str, Any] = {
                "encoding": zenoh.Encoding(f"application/protobuf;simd.v1.{method.request.__name__}"),
                "attachment": zenoh.ZBytes(self._attachment),
                # With the default, Zenoh would query only a session that claims to have all answers.
                "target": zenoh.QueryTarget.ALL,
                "consolidation": zenoh.ConsolidationMode.NONE,
                "express": True,
            }
            route = self._routes[method.key] = zenoh.KeyExpr(keys.rpc(self.name, method.key)), same
        key, same = route
        return key, {**same, "payload": payload, "timeout": timeout}

    def opened(self, answer: Answer, timeout: float) -> bytes:
        """Returns the bytes of a reply. Raises the exception of an error reply."""
        if isinstance(answer, (bytes, SimdError)):
            return super().opened(answer, timeout)
        reply = answer
        sample = reply.ok
        if sample is not None:
            return sample.payload.to_bytes()
        error = reply.err
        if error is None:
            raise self.unavailable()
        encoding, payload = str(error.encoding), error.payload.to_bytes()
        if STATUS in encoding:
            raise refused(payload)
        if b"Timeout" in payload:
            raise DeadlineExceeded(
                f"the daemon `{self.name}` at {self.endpoint.locator} did not answer within {timeout:g} s"
            )
        text = payload.decode(errors="replace")
        raise SimdError(f"the daemon's answer cannot be understood: an error in {encoding}: {text}")

    def unavailable(self) -> Unavailable:
        """Returns the exception for a request that no daemon received."""
        where = self.endpoint.locator
        if self.session.is_closed():
            return Unavailable(f"the connection to the daemon at {where} is closed")
        return Unavailable(
            f"no daemon named `{self.name}` answers at {where}; start one with `simd --name {self.name}`, "
            "or name the endpoint of another"
        )

    def publish_targets(self, payload: bytes) -> None:
        """Sends targets without waiting for an answer."""
        self._check_process()
        payload, secret = sealed(SetJointTargetsRequest, payload)
        key = keys.joint_targets(self.name)
        try:
            with self._lock:
                if self._publisher is None:
                    self._publisher = self.session.declare_publisher(
                        key,
                        encoding="application/protobuf;simd.v1.SetJointTargetsRequest",
                        congestion_control=zenoh.CongestionControl.DROP,
                        express=True,
                    )
            put = cast("Callable[..., None]", self._publisher.put)  # pyright: ignore[reportUnknownMemberType]
            if not secret:
                put(payload, attachment=self._attachment)
                return
            self._counter.prove(
                secret, key, payload, lambda proof: put(payload, attachment=f"{self._attachment}\n{proof}")
            )
        except zenoh.ZError:
            raise self.unavailable() from None


def _only_reads(method: AnyMethod) -> bool:
    """Returns whether a second call changes nothing that the first one did not."""
    return method.key.rpartition("/")[2].startswith(("Get", "List", "Find", "Cast", "Compute", "Check"))


def _is_from(daemon: str, reply: zenoh.Reply) -> bool:
    """Whether a reply is from the daemon, or from Zenoh in this process because of the timeout."""
    replier = reply.replier_id
    if replier is not None:
        return str(replier.zid) == daemon
    error = reply.err
    return error is not None and STATUS not in str(error.encoding) and b"Timeout" in error.payload.to_bytes()
