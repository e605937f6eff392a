"""Address of a daemon's page. The schema does not report it, so the server on the default port is asked for
its name."""

from __future__ import annotations

import urllib.error
import urllib.request

from google.protobuf.message import DecodeError

from simd_client.proto import GetSimulatorInfoResponse

# The daemon's default port for HTTP.
_PORT = 7400
# Maximum wall seconds for the answer of a local page.
_TIMEOUT = 1.0
_MAX_BYTES = 1 << 20


def of(host: str, name: str) -> str | None:
    """Returns the address of the page at the default port of a host, if the daemon there has that name."""
    address = f"http://{host}:{_PORT}"
    return address if _name(address) == name else None


def is_there(address: str) -> bool:
    """Whether a page exists at the address."""
    try:
        with urllib.request.urlopen(address + "/", timeout=_TIMEOUT) as answer:
            return "html" in answer.headers.get("content-type", "")
    except (urllib.error.URLError, OSError, ValueError):
        return False


def _name(address: str) -> str | None:
    """Returns the name of the daemon there, by gRPC-Web: a flag, four bytes of length, a message."""
    request = urllib.request.Request(
        f"{address}/simd.v1.SimulationService/GetSimulatorInfo",
        data=bytes(5),
        headers={"content-type": "application/grpc-web+proto", "x-grpc-web": "1"},
    )
    try:
        with urllib.request.urlopen(request, timeout=_TIMEOUT) as answer:
            framed: bytes = answer.read(_MAX_BYTES)
        length = int.from_bytes(framed[1:5], "big")
        return GetSimulatorInfoResponse.FromString(framed[5 : 5 + length]).name
    except (urllib.error.URLError, OSError, ValueError, DecodeError):
        return None
