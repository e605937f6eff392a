"""Finds the Zenoh locator of a daemon by asking its HTTP port, so that one endpoint serves all clients."""

from __future__ import annotations

import contextlib
import http.client
import ipaddress
import json
import os
import socket
import ssl
import threading
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlsplit

from simd_client.endpoint import Endpoint
from simd_client.errors import EndpointError, Unavailable

_DOCUMENT = "/.well-known/simd.json"
_MAX_BYTES = 65536


def find(endpoint: Endpoint, timeout: float, ca: str | None) -> Endpoint:
    """Returns the locator of the daemon at an HTTP address, and its name. `ca` is the authority of its
    certificate."""
    document = _ask(endpoint, timeout, ca)
    name = str(document.get("name", ""))
    if endpoint.name is not None and endpoint.name != name:
        raise Unavailable(f"no daemon named `{endpoint.name}` answers at {endpoint.locator}: it is called `{name}`")
    parts = urlsplit(endpoint.locator)
    locator = choose(
        _texts(document.get("zenoh")), _texts(document.get("routers")), parts.hostname or "", parts.scheme == "https"
    )
    if locator is not None:
        return Endpoint(locator, name)
    if document.get("zenoh"):
        raise EndpointError(
            f"the daemon at {endpoint.locator} serves Zenoh only to its own machine: start it with "
            "`--zenoh tcp/0.0.0.0:7447`"
        )
    raise EndpointError(
        f"the daemon at {endpoint.locator} does not serve Zenoh, which this client needs: start it without `--zenoh off`"
    )


def choose(listens: Sequence[str], routers: Sequence[str], host: str, is_tls: bool) -> str | None:
    """Returns the locator for a client that reaches the daemon's machine as `host`."""
    preferred = "tls/" if is_tls else "tcp/"
    near = _is_loopback(host)
    for locator in sorted(listens, key=lambda locator: not locator.startswith(preferred)):
        protocol, _, address = locator.partition("/")
        listening, _, port = address.rpartition(":")
        if near and listening not in ("0.0.0.0", "[::]"):
            return locator
        if near or not _is_loopback(listening):
            # This client reaches the machine as `host`, and may not know its other addresses.
            return f"{protocol}/[{host}]:{port}" if ":" in host else f"{protocol}/{host}:{port}"
    return next(iter(routers), None)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def _ask(endpoint: Endpoint, timeout: float, ca: str | None) -> dict[str, Any]:
    parts = urlsplit(endpoint.locator)
    host, port = parts.hostname or "", parts.port
    if parts.scheme == "https":
        connection = http.client.HTTPSConnection(host, port, timeout=timeout, context=_context(ca))
    else:
        connection = http.client.HTTPConnection(host, port, timeout=timeout)
    # The timeout of a socket is for each read, and a server may send byte by byte.
    late = threading.Event()

    def end() -> None:
        late.set()
        with contextlib.suppress(OSError):
            if connection.sock is not None:
                connection.sock.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(timeout, end)
    timer.start()
    document: object = None
    failure: Exception | None = None
    try:
        # No browser asks, so the server's name need not match the certificate.
        connection.request("GET", _DOCUMENT, headers={"Host": "localhost"})
        answer = connection.getresponse()
        if answer.status == 200:
            document = json.loads(answer.read(_MAX_BYTES))
    except ssl.SSLCertVerificationError as error:
        raise Unavailable(
            f"the certificate of the daemon at {endpoint.locator} is not accepted ({error.verify_message}): name the file of "
            "the authority that signed it, as `config=simd_client.tls.authority(ca)` or in SIMD_TLS_CA"
        ) from None
    except (http.client.HTTPException, ValueError, OSError) as error:
        failure = error
    finally:
        timer.cancel()
        connection.close()
    # The timer and the socket's own timeout end at the same moment: either may be first.
    if document is None and (late.is_set() or isinstance(failure, TimeoutError)):
        raise Unavailable(
            f"nothing at {endpoint.locator} answers HTTP within {timeout:g} s; name the port of the daemon's page, or its "
            f"locator of Zenoh, as tcp/{host}:7447"
        )
    if isinstance(failure, OSError) and not isinstance(failure, http.client.HTTPException):
        raise Unavailable(
            f"no daemon answers at {endpoint.locator} ({failure}); start one with `simd`, or name the endpoint of another"
        )
    if not isinstance(document, dict):
        raise EndpointError(
            f"what answers at {endpoint.locator} does not say where Zenoh is; name the locator, as tcp/{host}:7447"
        )
    return document  # pyright: ignore[reportUnknownVariableType]


def _context(ca: str | None) -> ssl.SSLContext:
    try:
        context = ssl.create_default_context(cafile=ca)
        certificate = os.environ.get("SIMD_TLS_CLIENT_CERT")
        if certificate:
            context.load_cert_chain(certificate, os.environ.get("SIMD_TLS_CLIENT_KEY") or None)
    except OSError as error:
        raise EndpointError(f"the certificates for the daemon cannot be used: {error}") from None
    return context


def _texts(value: object) -> list[str]:
    return [text for text in value if isinstance(text, str)] if isinstance(value, list) else []  # pyright: ignore[reportUnknownVariableType]
