"""A world in this process: the link to the wheel `simd-embedded`."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

from simd_client import extras
from simd_client.endpoint import Endpoint, is_name
from simd_client.errors import DeadlineExceeded, EndpointError, SimdError, Unavailable
from simd_client.link import Answer, AnyMethod, Link, Subscription, program, refused
from simd_client.version import API_VERSION

MODULE = "simd_embedded"
"""The extension module."""

_DEADLINE_EXCEEDED = "DEADLINE_EXCEEDED"
_TARGETS = "JointService/SetJointTargets"
# Wall seconds that targets without an answer wait for the world.
_TARGETS_SECONDS = 1.0
# Wall seconds between checks by the notice thread that its link still exists.
_LOOK = 1.0


class World(Protocol):
    """Interface of the extension module: see `client/embedded/src/lib.rs`."""

    @property
    def name(self) -> str:
        """Name, as daemons have one."""
        ...

    @property
    def is_closed(self) -> bool:
        """Whether it was closed."""
        ...

    def call(self, method: str, request: bytes, time_limit: float) -> bytes:
        """Makes a call and waits for its answer."""
        ...

    def begin(self, method: str, request: bytes, time_limit: float) -> int:
        """Begins a call; returns its ticket."""
        ...

    def subscribe(self, key: str) -> int:
        """Subscribes to what is published under a key; returns its ticket."""
        ...

    def end(self, ticket: int) -> None:
        """Ends a subscription."""
        ...

    def next_notices(self, time_limit: float) -> list[tuple[int, str, str, bytes]] | None:
        """Waits for notices: ticket, kind, key, payload. `None` once it is closed."""
        ...

    def serve(self, address: str) -> tuple[str, int]:
        """Serves the page and the services at `IP:PORT`. Returns the address, with the descriptor of the
        socket."""
        ...

    def keep_step(self, request: bytes) -> KeptStep:
        """Keeps the request of a step, for loops that change one number of each target."""
        ...

    def close(self) -> None:
        """Ends the world."""
        ...


RobotNumbers = tuple[str, int, list[float], list[float], list[float]]
"""Joint states of a robot: its name, the version of its layout, positions, velocities, efforts."""


class KeptStep(Protocol):
    """A step with a kept request."""

    def run(self, numbers: list[float], time_limit: float) -> tuple[int, float, list[RobotNumbers]]:
        """Makes the step with new numbers for its targets, or with the last ones. Returns the sequence
        number, the simulation time of the state after it, and joint states."""
        ...


class Chain(Protocol):
    """Joints between a robot's base and one of its links: see `client/embedded/src/damped_steps.rs`."""

    def search(
        self,
        root: tuple[float, ...],
        joints: tuple[list[float], list[float]],
        goal: tuple[tuple[float, float, float], tuple[float, float, float, float] | None],
        limits: tuple[list[list[float]] | None, list[list[float]] | None],
        ends: tuple[int, float],
    ) -> list[float] | None:
        """Returns joint positions nearer to the goal; `None` if the module cannot compute them."""
        ...


def chain(steps: Sequence[tuple[Any, ...]], end: tuple[float, ...]) -> Chain | None:
    """Returns a chain of joints of the extension module; `None` if the module is not installed."""
    if not is_installed():
        return None
    module: Any = importlib.import_module(MODULE)
    return cast(Chain, module.Chain(steps, end))


def is_installed() -> bool:
    """Whether this interpreter has the extension module."""
    return importlib.util.find_spec(MODULE) is not None


def open_embedded(
    endpoint: Endpoint, config: str | os.PathLike[str] | Mapping[str, object] | None, serve: str | None = None
) -> EmbeddedLink:
    """Opens a world in this process. `config` is a daemon's configuration: its file, or values by dotted
    names. The page and the API are served at the optional `serve` (`EmbeddedLink.serve`).

    Raises `Unavailable` if the wheel is not installed, and `EndpointError` for errors in the configuration.
    """
    try:
        module: Any = importlib.import_module(MODULE)
    except ImportError as error:
        raise Unavailable(
            f"there is no world in this process ({error}): {extras.EMBEDDED}, or start a daemon with `simd` and connect to that"
        ) from error
    version = f"{API_VERSION[0]}.{API_VERSION[1]}"
    try:
        world = cast(World, module.World(_arguments(endpoint, config), version, program()))
    except (ValueError, OSError) as error:
        raise EndpointError(f"the world in this process cannot be opened: {error}") from error
    link = EmbeddedLink(world, cast("type[Exception]", module.Refused), endpoint)
    if serve is not None:
        try:
            link.serve(serve)
        except BaseException:
            link.close()
            raise
    return link


def _arguments(
    endpoint: Endpoint, config: str | os.PathLike[str] | Mapping[str, object] | None
) -> list[str]:
    """Returns the equivalent flags of the program `simd`."""
    arguments: list[str] = []
    if isinstance(config, Mapping):
        arguments += flags(config)
    elif config is not None:
        arguments.append(f"--config={os.fspath(config)}")
    if endpoint.name is not None and is_name(endpoint.name):
        arguments.append(f"--name={endpoint.name}")
    return arguments


def flags(config: Mapping[str, object]) -> list[str]:
    """Returns flags of the program `simd` for a configuration of dotted names."""
    return [f"--set={name}={_value(value)}" for name, value in config.items()]


def _value(value: object) -> str:
    """Returns a value in the form of flags."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, os.PathLike):
        return os.fspath(cast("os.PathLike[str]", value))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(_value(each) for each in cast("Sequence[object]", value))
    return str(value)


@dataclass(frozen=True)
class _Begun:
    """Callbacks for the notices of a ticket."""

    arrived: Callable[[Answer], None]
    ended: Callable[[], None]
    take: Callable[[str, bytes], None] | None = None


class EmbeddedLink(Link):
    """A world in this process. Calls run on the caller's thread. A thread of the link reads notices of
    requests and subscriptions."""

    def __init__(self, world: World, refusal: type[Exception], endpoint: Endpoint) -> None:
        super().__init__(endpoint, world.name)
        self._world = world
        self._refusal = refusal
        # Held while a request begins, so that no notice of it is read before it is registered.
        self._lock = threading.Lock()
        self._begun: dict[int, _Begun] = {}
        self._reader: _NoticeReader | None = None
        # Address where it is served, and the descriptor of the socket.
        self._served: tuple[str, int] | None = None

    @property
    def is_closed(self) -> bool:
        """Whether the world has ended."""
        return self._world.is_closed

    def close(self) -> None:
        """Ends the world."""
        super().close()
        if not self._is_forked:
            self._world.close()

    def serve(self, address: str, says: bool = True) -> str:
        """Serves the page and the API (gRPC, HTTP) at `IP:PORT`, from threads of the world, until it ends.
        Returns the address. If the port is taken, it uses a free one, and a line on stderr `says` so. Forked
        processes do not serve.

        A world is served once; if it is served already, this returns the address. Raises `EndpointError` for
        any other failure, for instance an address that other machines reach.
        """
        self._check_process()
        if self._served is not None:
            return self._served[0]
        try:
            self._served = self._world.serve(address)
        except ValueError as error:
            raise EndpointError(f"the world in this process cannot be served: {error}") from None
        except OSError as error:
            try:
                self._served = self._world.serve(f"{address.rpartition(':')[0]}:0")
            except OSError:
                raise EndpointError(f"the world in this process cannot be served: {error}") from None
        served = self._served[0]
        if served != address and says:
            print(f"simd: the world in this process is served at http://{served}/ and not at {address}", file=sys.stderr)
        return served

    def mark_forked(self) -> None:
        """Closes the socket of the server. This forked process does not serve, and would keep the port after
        the other one ends."""
        super().mark_forked()
        if self._served is not None:
            os.close(self._served[1])
            self._served = None

    def keep_step(self, request: bytes) -> KeptStep:
        """Keeps the request of a step (`World.keep_step`)."""
        self._check_process()
        try:
            return self._world.keep_step(request)
        except self._refusal as error:
            raise _exception(error) from None
        except ValueError:
            raise self.unavailable() from None

    def run_step(self, step: KeptStep, numbers: list[float], timeout: float) -> tuple[int, float, list[RobotNumbers]]:
        """Makes a kept step on this thread (`KeptStep.run`)."""
        if self._is_forked:
            self._check_process()
        try:
            return step.run(numbers, timeout)
        except self._refusal as error:
            raise _exception(error) from None
        except ValueError:
            raise self.unavailable() from None

    def query(self, method: AnyMethod, payload: bytes, timeout: float) -> bytes:
        """Makes a call on this thread."""
        if self._is_forked:
            self._check_process()
        try:
            return self._world.call(method.key, payload, timeout)
        except self._refusal as error:
            raise _exception(error) from None
        except ValueError:
            raise self.unavailable() from None

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
        """Begins a call."""
        self._check_process()
        try:
            self._begin(_Begun(arrived, ended), lambda: self._world.begin(method.key, payload, timeout))
        except self._refusal as error:
            arrived(_exception(error))
            ended()

    def subscribe(self, key: str, take: Callable[[str, bytes], None]) -> Subscription:
        """Calls `take` with each publication."""
        self._check_process()
        begun = _Begun(lambda answer: None, lambda: None, take)
        try:
            return _Subscribed(self, self._begin(begun, lambda: self._world.subscribe(key)))
        except self._refusal as error:
            raise _exception(error) from None

    def _begin(self, begun: _Begun, begin: Callable[[], int]) -> int:
        with self._lock:
            try:
                ticket = begin()
            except ValueError:
                raise self.unavailable() from None
            self._begun[ticket] = begun
            if self._reader is None:
                self._reader = _NoticeReader(self, self._world)
                self.threads.add(self._reader)
                self._reader.start()
        return ticket

    def end(self, ticket: int) -> None:
        """Ends a subscription."""
        with self._lock:
            self._begun.pop(ticket, None)
        if not self._is_forked:
            self._world.end(ticket)

    def take(self, ticket: int, kind: str, key: str, payload: bytes) -> None:
        """Takes a notice, on the thread that reads them."""
        with self._lock:
            begun = self._begun.pop(ticket, None) if kind == "ended" else self._begun.get(ticket)
        if begun is None:
            return
        if kind == "published":
            if begun.take is not None:
                begun.take(key, payload)
        elif kind == "answer":
            begun.arrived(payload)
        elif kind == "refused":
            begun.arrived(_from_status(payload))
        else:
            begun.ended()

    def end_all(self) -> None:
        """Handles the end of notices: all requests and subscriptions have ended."""
        with self._lock:
            begun, self._begun = list(self._begun.values()), {}
        for each in begun:
            each.ended()

    def publish_targets(self, payload: bytes) -> None:
        """Sends targets. A refusal is not reported."""
        self._check_process()
        try:
            self._world.call(_TARGETS, payload, _TARGETS_SECONDS)
        except self._refusal:
            pass
        except ValueError:
            raise self.unavailable() from None

    def unavailable(self) -> Unavailable:
        """Returns the exception for a call to a world that has ended."""
        return Unavailable("the connection to the world in this process is closed")


class _Subscribed:
    """A subscription; it ends when the object is released."""

    def __init__(self, link: EmbeddedLink, ticket: int) -> None:
        self._link = link
        self._ticket: int | None = ticket

    def undeclare(self) -> None:
        """Ends it."""
        ticket, self._ticket = self._ticket, None
        if ticket is not None:
            self._link.end(ticket)

    def __del__(self) -> None:
        self.undeclare()


class _NoticeReader:
    """Thread that reads notices. It does not keep the program from ending, and ends when its link is
    released."""

    def __init__(self, link: EmbeddedLink, world: World) -> None:
        self._link = weakref.ref(link)
        self._world = world
        self._is_ending = False
        self._thread = threading.Thread(target=self._run, name="simd_client link", daemon=True)

    def start(self) -> None:
        """Begins."""
        self._thread.start()

    def end(self) -> None:
        """The thread ends when the world is closed, which comes next."""
        self._is_ending = True

    def wait(self, timeout: float | None) -> bool:
        """Waits until it has ended."""
        if self._thread is not threading.current_thread():
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while not self._is_ending:
            notices = self._world.next_notices(_LOOK)
            link = self._link()
            if link is None:
                return
            if notices is None:
                break
            for ticket, kind, key, payload in notices:
                link.take(ticket, kind, key, payload)
            del link
        link = self._link()
        if link is not None:
            link.end_all()


def _exception(error: Exception) -> SimdError:
    return _from_status(cast(bytes, error.args[0]))


def _from_status(payload: bytes) -> SimdError:
    refusal = refused(payload)
    if refusal.code == _DEADLINE_EXCEEDED and not refusal.reason:
        return DeadlineExceeded(str(refusal))
    return refusal
