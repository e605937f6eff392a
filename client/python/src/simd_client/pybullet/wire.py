"""Connection of a script to the daemon, with PyBullet's exception instead of the client's."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence

from simd_client import keys
from simd_client.blocking.connection import Connection
from simd_client.embedded_link import EmbeddedLink, KeptStep, RobotNumbers, open_embedded
from simd_client.endpoint import DEFAULT_ENDPOINT, EMBEDDED, ENVIRONMENT, read_endpoint
from simd_client.errors import EndpointError, SimdError, Unavailable
from simd_client.link import Link, Subscription
from simd_client.open_link import open_link
from simd_client.method import Method, Reply, Request
from simd_client.proto import GetParametersRequest, JointStates, ParameterList, methods

from . import page
from .daemon_process import BODIES
from .errors import error

# Wall seconds that `connect` waits for a daemon.
_CONNECT = 3.0
# Default wall seconds that a call waits for its answer.
_TIMEOUT = 10.0
# Wall seconds after which the copy of the parameters is fetched again.
_REFRESH = 0.5


class NoDaemon(Exception):
    """No daemon answers. `named` if an endpoint was given."""

    def __init__(self, message: str, named: bool) -> None:
        super().__init__(message)
        self.named = named


class Wire:
    """A connection to one daemon. The script's thread makes calls; the link's thread updates copies of
    published data."""

    def __init__(self, link: Link) -> None:
        self._link = link
        # A world in this process keeps requests of steps.
        self.keeps_steps = isinstance(link, EmbeddedLink)
        self._timeout = _TIMEOUT
        self._connection = Connection(link, _TIMEOUT)
        self._subscribers: list[Subscription] = []
        self._parameters: ParameterList | None = None
        self._parameters_until = 0.0
        # Called before each call, for commands of the script that were not sent yet.
        self.before: Callable[[], None] = lambda: None
        # Not read yet.
        self._parameters_bytes: bytes | None = None
        self._states_bytes: dict[str, bytes] = {}

    @staticmethod
    def open(endpoint: str | None, certificates: Mapping[str, object] | None = None) -> Wire:
        """Connects to the daemon that was named, else to $SIMD_ENDPOINT, else to the default locator.
        `certificates` are settings of Zenoh, as `simd_client.tls.authority` makes them.

        Raises:
            NoDaemon: if none answers.
            error: if the endpoint is not valid, or there are several daemons.
        """
        named = bool(endpoint or os.environ.get(ENVIRONMENT))
        try:
            where = read_endpoint(endpoint)
            if not named and not _listens(where.locator):
                raise NoDaemon(f"no daemon answers at {where}", named=False)
            return Wire(open_link(where, _CONNECT, certificates))
        except Unavailable as unavailable:
            raise NoDaemon(str(unavailable), named) from None
        except (EndpointError, SimdError) as problem:
            raise error(str(problem)) from None

    @staticmethod
    def embedded() -> Wire:
        """Opens a world in this process, paused.

        Raises:
            error: if the wheel `simd-embedded` is not installed.
        """
        try:
            return Wire(open_embedded(read_endpoint(EMBEDDED), {"paused": True, "service.robots": BODIES}))
        except SimdError as problem:
            raise error(str(problem)) from None

    def serve(self, address: str) -> str:
        """Serves a world in this process at this address, or at a free port if that is taken. Returns the
        address.

        Raises:
            error: if it cannot be served.
        """
        try:
            return self._embedded_link().serve(address, says=False)
        except SimdError as problem:
            raise error(str(problem)) from None

    def keep_step(self, request: bytes) -> KeptStep:
        """Makes a world in this process keep the request of a step.

        Raises:
            error: with the world's sentence and reason.
        """
        try:
            return self._embedded_link().keep_step(request)
        except SimdError as problem:
            raise error(str(problem), problem.reason) from None

    def run_step(self, step: KeptStep, numbers: list[float]) -> tuple[int, float, list[RobotNumbers]]:
        """Makes a kept step, like `call`.

        Raises:
            error: with the world's sentence and reason.
        """
        self.before()
        try:
            return self._embedded_link().run_step(step, numbers, self._timeout)
        except SimdError as problem:
            raise error(str(problem), problem.reason) from None

    def _embedded_link(self) -> EmbeddedLink:
        assert isinstance(self._link, EmbeddedLink)
        return self._link

    def set_timeout(self, timeout: float) -> None:
        """Sets the time, in wall seconds, that calls wait for their answer."""
        self._timeout = timeout
        self._connection = Connection(self._link, timeout)

    @property
    def endpoint(self) -> str:
        """Locator and the daemon's name."""
        return f"{self._link.endpoint.locator}#{self._link.name}"

    @property
    def locator(self) -> str:
        """Address of the daemon, without its name."""
        return self._link.endpoint.locator

    @property
    def is_embedded(self) -> bool:
        """Whether the world is in this process."""
        return self._link.endpoint.is_embedded

    @property
    def page(self) -> str | None:
        """Returns the address of the daemon's page, if the page belongs to this daemon."""
        protocol, _, address = self._link.endpoint.locator.partition("/")
        host = address.rsplit(":", 1)[0]
        return page.of(host, self._link.name) if protocol in ("tcp", "tls") else None

    def alive(self) -> bool:
        """Whether the session is open."""
        return not self._link.is_closed

    def close(self) -> None:
        """Closes the session."""
        self._subscribers.clear()
        self._link.close()

    @property
    def connection(self) -> Connection:
        """Connection for functions of the client."""
        return self._connection

    def call(self, method: Method[Request, Reply], request: Request, wait: float = 0.0) -> Reply:
        """Sends a request. Returns the answer. `wait` is the time, in seconds, that the daemon may take.

        Raises:
            error: with the daemon's sentence and reason.
        """
        self.before()
        return self.call_aside(method, request, wait)

    def call_aside(self, method: Method[Request, Reply], request: Request, wait: float = 0.0) -> Reply:
        """Calls without the script's pending commands: any thread may use it.

        Raises:
            error: with the daemon's sentence and reason.
        """
        try:
            return self._connection.call(method, request, wait=wait or _time_limit(request))
        except SimdError as problem:
            raise error(str(problem), problem.reason) from None

    def call_all(self, method: Method[Request, Reply], requests: Sequence[Request]) -> None:
        """Makes several calls in one round trip, which the daemon may execute in any order.

        Raises:
            error: where one is refused; the others are done.
        """
        try:
            self._connection.call_all(*((method, request) for request in requests))
        except SimdError as problem:
            raise error(str(problem), problem.reason) from None

    # Publications of the daemon.

    def watch_parameters(self) -> None:
        """Begins to keep a copy of the daemon's parameters."""
        if self._parameters is None:
            # The subscription comes first, so that no change after the answer is missed.
            self._subscribe(keys.parameters(self._link.name), self._take_parameters)
        self.ask_parameters()

    def parameters(self) -> ParameterList:
        """Returns the newest copy. A publication may be lost on a congested network, so it is also fetched at
        intervals."""
        if self._parameters is None or time.monotonic() > self._parameters_until:
            self.watch_parameters()
        assert self._parameters is not None
        payload, self._parameters_bytes = self._parameters_bytes, None
        if payload is not None:
            newest = ParameterList.FromString(payload)
            if newest.version > self._parameters.version:
                self._parameters = newest
        return self._parameters

    def ask_parameters(self) -> None:
        """Fetches a copy that includes all earlier changes."""
        self._parameters = self.call(methods.GetParameters, GetParametersRequest()).list
        self._parameters_until = time.monotonic() + _REFRESH

    def watch_states(self) -> None:
        """Begins to keep the newest joint states of each robot, as the daemon publishes them."""
        self._subscribe(keys.joint_states(self._link.name, "*"), self._take_states)

    def published(self, robot: str) -> JointStates | None:
        """Returns the newest published states of a robot's joints, if any arrived since the last read."""
        payload = self._states_bytes.pop(robot, None)
        return None if payload is None else JointStates.FromString(payload)

    def _subscribe(self, key: str, take: Callable[[str, bytes], None]) -> None:
        try:
            self._subscribers.append(self._link.subscribe(key, take))
        except SimdError as problem:
            raise error(str(problem)) from None

    def _take_parameters(self, key: str, payload: bytes) -> None:
        self._parameters_bytes = payload

    def _take_states(self, key: str, payload: bytes) -> None:
        self._states_bytes[key.rsplit("/", 1)[-1]] = payload


def _time_limit(request: object) -> float:
    """Returns wall seconds that the daemon may wait before it answers."""
    return float(getattr(request, "timeout", 0.0))


def _listens(locator: str) -> bool:
    """Whether a server accepts connections there; Zenoh would try for seconds."""
    if locator != DEFAULT_ENDPOINT:
        return True
    host, _, port = locator.partition("/")[2].rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=1.0):
            return True
    except OSError:
        return False
