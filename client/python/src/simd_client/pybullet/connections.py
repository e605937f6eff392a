"""Connections by number: connect, disconnect, and their state."""

from __future__ import annotations

import atexit
import os
import shlex
import sys
import threading
from typing import Any

from simd_client import embedded_link, tls
from simd_client.endpoint import DEFAULT_ENDPOINT, ENVIRONMENT

from . import constants, daemon_process, page
from .daemon_process import DaemonProcess
from .errors import error
from .renderer import Renderer
from .sliders import Sliders
from .wire import NoDaemon, Wire
from .world import World

_METHODS = {
    constants.GUI,
    constants.DIRECT,
    constants.SHARED_MEMORY,
    constants.UDP,
    constants.TCP,
    constants.GUI_SERVER,
    constants.GUI_MAIN_THREAD,
    constants.SHARED_MEMORY_SERVER,
    constants.SHARED_MEMORY_GUI,
}
_WITH_WINDOW = {
    constants.GUI,
    constants.GUI_SERVER,
    constants.GUI_MAIN_THREAD,
    constants.SHARED_MEMORY_GUI,
}
# Modes that search for a daemon.
_BY_ADDRESS = {constants.UDP, constants.TCP}
# Address of the page of a world in this process, if the port is free.
_PAGE = "127.0.0.1:7400"
# Options of the connection, and the renderer's for the same.
_RENDERER_FLAGS = {"--tls-ca": "--tls-ca", "--tls-cert": "--tls-client-cert", "--tls-key": "--tls-client-key"}
# PyBullet's number: client and server of different numbers are incompatible.
_API_VERSION = 202010061

# Options of the runner. Processes that the script starts inherit them with the environment.
OPTIONS = "SIMD_PYBULLET_OPTIONS"

_worlds: dict[int, World] = {}
_children: dict[int, DaemonProcess] = {}
# Numbers of connections that threads of the script are opening.
_taken: set[int] = set()
_numbers = threading.Lock()
# Connections of the parent of this forked process, kept because their threads cannot end here.
_inherited: list[object] = []


def connected(physicsClientId: int) -> World:
    """Returns the world of a connection.

    Raises:
        error: if there is none of that number.
    """
    world = _worlds.get(physicsClientId)
    if world is None:
        if _inherited:
            raise error("Not connected to physics server: the connection is the process's that this one was forked from; connect here")
        raise error("Not connected to physics server.")
    return world


def _forked() -> None:
    """Called in a forked process: worlds belong to the parent, and their numbers are free here."""
    global _numbers
    _inherited.extend((*_worlds.values(), *_children.values()))
    for child in (*_children.values(), *(world.renderer for world in _worlds.values())):
        child.forked()
    _worlds.clear()
    _children.clear()
    _taken.clear()
    _numbers = threading.Lock()


os.register_at_fork(after_in_child=_forked)


def search_paths(world: World) -> list[str]:
    """Returns the search paths for files, the newest first: this connection's, then the others'. In PyBullet
    they belong to the process."""
    others = [path for other in list(_worlds.values()) if other is not world for path in reversed(other.search_paths)]
    return [*reversed(world.search_paths), *others]


def connect(
    method: int = constants.GUI,
    key: Any = None,
    port: Any = None,
    options: Any = None,
    *,
    hostName: str | None = None,
    endpoint: str | None = None,
) -> int:
    """Opens a world in this process, connects to a running daemon, or starts one. Returns the number of the connection.

    The endpoint is `endpoint`, else `--endpoint=LOCATOR` in `options`, else the host and port of TCP and UDP,
    else $SIMD_ENDPOINT; that daemon must answer. Without an endpoint it opens a world in this process if the
    wheel `simd-embedded` is installed, except for TCP and UDP. Otherwise it uses the daemon at the default
    locator. If none answers there, it starts a new daemon, which ends with the connection. With DIRECT it
    also does so if another connection of this script uses that daemon already. Options: `--new` always starts
    a daemon, `--embedded` always opens a world in this process. `--remove-robots` removes the script's robots
    at the end of the connection, also from a daemon that was running. With `--limits` the file's limits of
    effort and velocity bound motors, and with `--mimic` the file's mimic joints follow others.
    `--tls-ca=FILE`, `--tls-cert=FILE` and `--tls-key=FILE` are for an endpoint tls/HOST:PORT: the authority
    that signed the daemon's certificate, and a certificate of the script.
    """
    if method not in _METHODS:
        raise error("connectPhysicsServer unexpected argument")
    # connect(method, key, options) or connect(method, hostName, port, options).
    host = key if isinstance(key, str) else hostName
    if isinstance(port, str) and options is None:
        options, port = port, None
    # The script's own options come last, and take precedence.
    words = [*_words(os.environ.get(OPTIONS, "")), *_words(str(options or ""))]
    given = {word.partition("=")[0]: word.partition("=")[2] for word in words}
    named = endpoint or given.get("--endpoint")
    own = tls.authority(given.get("--tls-ca"), given.get("--tls-cert"), given.get("--tls-key"))
    if named is None and host is not None and method in (constants.TCP, constants.UDP):
        named = host if "/" in host else f"tcp/{host}:{port if port is not None else 7447}"
    with _numbers:
        used = _worlds.keys() | _taken
        number = next(free for free in range(len(used) + 1) if free not in used)
        _taken.add(number)
    try:
        _open(number, method, given, named, own)
    finally:
        _taken.discard(number)
    return number


def _open(
    number: int, method: int, given: dict[str, str], named: str | None, certificates: dict[str, object]
) -> None:
    """Opens the connection with this number, with the values of options by their names."""
    new = "--new" in given
    child: DaemonProcess | None = None
    wire: Wire | None = None
    is_named = bool(named or os.environ.get(ENVIRONMENT))
    is_free = not new and not is_named
    is_own = is_free and method not in _BY_ADDRESS and embedded_link.is_installed()
    if "--embedded" in given or is_own:
        wire = Wire.embedded()
    elif method == constants.DIRECT and is_free and _has_default():
        child = _another()
    if wire is None and child is None and not new:
        try:
            wire = Wire.open(named, certificates)
        except NoDaemon as missing:
            if missing.named:
                raise error(str(missing)) from None
    if wire is None:
        child = child or daemon_process.start()
        wire = Wire.open(child.endpoint)
    renderer = Renderer(wire, [f"{theirs}={given[own]}" for own, theirs in _RENDERER_FLAGS.items() if own in given])
    world = World(wire, method, Sliders(wire), renderer, child is not None or wire.is_embedded)
    world.number = number
    world.removes_robots = "--remove-robots" in given
    world.keeps_limits, world.keeps_mimic = "--limits" in given, "--mimic" in given
    try:
        world.begin()
    except BaseException:
        wire.close()
        if child is not None:
            child.end()
        raise
    _worlds[number] = world
    if world.guest:
        others = ", ".join(body.robot for body in world.bodies.values())
        print(
            f"simd: {wire.endpoint} has robots of others, which stay as they are: {others}", file=sys.stderr
        )
    if child is not None:
        _children[number] = child
    if method in _WITH_WINDOW:
        _show(wire, child)


def _has_default() -> bool:
    """Whether this script is connected to the default daemon."""
    return any(world.wire.locator == DEFAULT_ENDPOINT for world in _worlds.values())


def _another() -> DaemonProcess | None:
    """Starts a daemon for another world of DIRECT, since each such connection of PyBullet has a separate
    world; `None` if none can be started."""
    try:
        return daemon_process.start("another connection of this script has the daemon that runs")
    except error as problem:
        print(f"simd: this connection shares the world of another one of this script: {problem}", file=sys.stderr)
        return None


def _words(options: str) -> list[str]:
    try:
        # Paths may be in quotes.
        return shlex.split(options)
    except ValueError:
        return options.split()


def _show(wire: Wire, child: DaemonProcess | None) -> None:
    """Prints the address of the page, since a daemon has no window."""
    if wire.is_embedded:
        try:
            print(f"simd: look at the world at http://{wire.serve(_PAGE)}/", file=sys.stderr)
        except error as problem:
            print(f"simd: there is no page of this world: {problem}", file=sys.stderr)
        return
    # A daemon that was started for the script has printed its page's address.
    address = child.viewer if child is not None and child.viewer is not None else wire.page
    if address is not None and page.is_there(address):
        print(f"simd: look at the world at {address}/", file=sys.stderr)
    else:
        print(
            f"simd: watch the world with: simctl --endpoint {wire.endpoint} joint watch ROBOT",
            file=sys.stderr,
        )


def disconnect(physicsClientId: int = 0) -> None:
    """Ends a connection. Robots stay in a daemon that was running before; a daemon that was started for the
    script ends."""
    world = connected(physicsClientId)
    _end(physicsClientId, world)


def _end(number: int, world: World) -> None:
    del _worlds[number]
    try:
        world.close()
    finally:
        child = _children.pop(number, None)
        if child is not None:
            child.end()


def isConnected(physicsClientId: int = 0) -> int:
    """Returns 1 or 0."""
    world = _worlds.get(physicsClientId)
    child = _children.get(physicsClientId)
    gone = world is None or not world.wire.alive() or (child is not None and not child.running())
    return int(not gone)


def getConnectionInfo(physicsClientId: int = 0) -> dict[str, int]:
    """Returns whether the connection is open, and the method given to `connect`."""
    world = _worlds.get(physicsClientId)
    if world is None:
        return {"isConnected": 0, "connectionMethod": 0}
    return {"isConnected": isConnected(physicsClientId), "connectionMethod": world.method}


def getAPIVersion(physicsClientId: int = 0) -> int:
    """Returns the API version of the PyBullet that this module replaces."""
    del physicsClientId
    return _API_VERSION


def isNumpyEnabled(physicsClientId: int = 0) -> int:
    """Returns 1: images and meshes would be arrays."""
    del physicsClientId
    return 1


@atexit.register
def _end_all() -> None:
    """Disconnects at the end of a script that does not call `disconnect`."""
    for number, world in list(_worlds.items()):
        try:
            _end(number, world)
        except Exception as problem:  # The script is over: one line instead of a traceback.
            print(f"simd: the connection {number} did not end well: {problem}", file=sys.stderr)


__all__ = [
    "connect",
    "disconnect",
    "getAPIVersion",
    "getConnectionInfo",
    "isConnected",
    "isNumpyEnabled",
]
