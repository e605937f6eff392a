"""Finds a daemon and connects to it."""

from __future__ import annotations

from simd_client.endpoint import read_endpoint
from simd_client.link import ZenohConfig, open_link
from simd_client.plans import simulation as plans
from simd_client.simulation import Simulation

TIMEOUT = 10.0
"""Seconds that calls wait for their answer."""

CONNECT_TIMEOUT = 3.0
"""Seconds that connecting may take."""


def connect(
    endpoint: str | None = None,
    name: str | None = None,
    *,
    timeout: float = TIMEOUT,
    connect_timeout: float = CONNECT_TIMEOUT,
    config: ZenohConfig | None = None,
) -> Simulation:
    """Connects to the daemon at `endpoint`: `tcp/HOST:PORT`, with `#NAME` or `name` where several are reached
    through it; `$SIMD_ENDPOINT`, else `tcp/127.0.0.1:7447` where it is left out.

    `timeout` is how long each call waits for its answer, in seconds. `config` has settings for Zenoh itself, such as
    certificates: values by name, or the path of a JSON5 file.

    Raises `Unavailable` where nobody answers, `EndpointError` where the text is no endpoint or several daemons
    could be meant, `VersionMismatch` where the daemon does not serve this client.
    """
    where = read_endpoint(endpoint, name)
    link = open_link(where, connect_timeout, config)
    simulation = Simulation(link, timeout)
    try:
        # Any call but the one for who answers is refused where the versions differ: better now than later.
        simulation.run(plans.state())
    except BaseException:
        link.close()
        raise
    return simulation
