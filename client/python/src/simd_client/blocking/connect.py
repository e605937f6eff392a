"""Connects to a daemon."""

from __future__ import annotations

from simd_client.blocking.simulation import Simulation
from simd_client.endpoint import CONNECT_TIMEOUT, TIMEOUT, read_endpoint
from simd_client.open_link import ZenohConfig, open_link


def connect(
    endpoint: str | None = None,
    name: str | None = None,
    *,
    timeout: float = TIMEOUT,
    connect_timeout: float = CONNECT_TIMEOUT,
    config: ZenohConfig | None = None,
    token: str | None = None,
    serve: str | None = None,
) -> Simulation:
    """Connects to the daemon at `endpoint`: `simd://HOST[:PORT][/NAME]`, the address of its page, or a
    locator of Zenoh (`tcp/HOST:PORT`). `#NAME` or `name` selects one of several daemons behind the locator.
    The default is `$SIMD_ENDPOINT`, else `tcp/127.0.0.1:7447`.

    `embedded` opens a world in this process, with the wheel `simd-embedded`. `config` is its configuration then, as for a
    daemon: values by dotted names, or its file. `serve` is an address, such as `127.0.0.1:7400`, where that world's page
    and API (gRPC, HTTP) are served until it ends. If the port is taken, a free one is used, and a line on stderr says which.

    `timeout` is the time, in seconds, that each call waits for its answer. `config` has settings for Zenoh,
    such as certificates: values by name, or the path of a JSON5 file. `token` is for a daemon that requires
    one; the default is `$SIMD_TOKEN`.

    Raises `Unavailable` if no daemon answers, and `EndpointError` if the text is not an endpoint or does not
    select one of several daemons. Raises `VersionMismatch` if the daemon does not support this client's
    version, and `Unauthenticated` if it does not accept the token.
    """
    where = read_endpoint(endpoint, name)
    link = open_link(where, connect_timeout, config, token, serve)
    simulation = Simulation(link, timeout)
    try:
        # The daemon refuses any call but `GetSimulatorInfo` if the versions do not match: better now than
        # later.
        simulation.stamp  # pyright: ignore[reportUnusedExpression]
    except BaseException:
        link.close()
        raise
    return simulation
