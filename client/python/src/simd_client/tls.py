"""Reasons for failed TLS connections; Zenoh only reports a timeout."""

from __future__ import annotations

import json
import os
import socket
import ssl
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import zenoh

from simd_client.endpoint import Endpoint
from simd_client.errors import EndpointError

ROOT = "transport/link/tls/"
"""Zenoh's settings for certificates."""

_ARGUMENTS = {
    name: f"`{argument}` of `simd_client.tls.authority`"
    for name, argument in (("root_ca_certificate", "ca"), ("connect_certificate", "certificate"), ("connect_private_key", "key"))
}
_SECONDS = 1.0
# A daemon that requires a certificate says so only after the client's half of the handshake.
_ALERT_SECONDS = 0.5


def authority(ca: str | None = None, certificate: str | None = None, key: str | None = None) -> dict[str, object]:
    """Returns Zenoh's settings for these files: the authority that signed the daemon's certificate, and
    optionally the client's certificate with its private key."""
    names = {"root_ca_certificate": ca, "connect_certificate": certificate, "connect_private_key": key}
    settings: dict[str, object] = {ROOT + name: value for name, value in names.items() if value}
    if certificate or key:
        settings[ROOT + "enable_mtls"] = True
    return settings


def of_environment(endpoint: Endpoint, given: Mapping[str, object]) -> dict[str, object]:
    """Returns the certificates that the environment names, as `simctl` reads them, unless settings name
    some."""
    if not _is_tls(endpoint) or any(name.startswith(ROOT) for name in given):
        return {}
    files = (os.environ.get(name) or None for name in ("SIMD_TLS_CA", "SIMD_TLS_CLIENT_CERT", "SIMD_TLS_CLIENT_KEY"))
    return authority(*files)


def known_authority(config: object) -> str | None:
    """Returns the authority's file from the settings, else from the environment."""
    given: dict[object, object] = dict(config) if isinstance(config, Mapping) else {}  # pyright: ignore[reportUnknownArgumentType]
    named = next((value for name, value in given.items() if str(name).replace(".", "/") == ROOT + "root_ca_certificate"), None)
    return str(named) if named else os.environ.get("SIMD_TLS_CA") or None


def check_files(endpoint: Endpoint, settings: zenoh.Config) -> None:
    """Raises `EndpointError` for a file of the settings that is missing or of the wrong kind."""
    if not _is_tls(endpoint):
        return
    files = _files(settings)
    for name, path in files.items():
        if not Path(path).is_file():
            raise EndpointError(f"there is no file {path}, which {_ARGUMENTS[name]} names")
    ca, certificate, key = _of(files)
    try:
        if ca is not None:
            ssl.create_default_context(cafile=ca)
    except OSError as error:
        raise EndpointError(f"{ca} has no certificate of an authority ({_why(error)})") from None
    if certificate is None and key is None:
        return
    if certificate is None or key is None:
        raise EndpointError("`certificate` and `key` of `simd_client.tls.authority` belong together: give both")
    try:
        ssl.create_default_context().load_cert_chain(certificate, key)
    except OSError as error:
        why = f"{certificate} and {key} are not a certificate and its private key"
        raise EndpointError(f"{why} ({_why(error)})") from None


def why_not(endpoint: Endpoint, settings: zenoh.Config) -> str | None:
    """Returns a sentence on why the server at the endpoint is not connected to; `None` if no server listens
    or nothing is known."""
    address = endpoint.locator.partition("/")[2].partition("?")[0]
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    if endpoint.locator.startswith("tcp/"):
        speaks_tls = _shake(host, port, _careless()) is None
        return f"the server at {address} uses TLS: its endpoint is tls/{address}" if speaks_tls else None
    if not endpoint.locator.startswith("tls/"):
        return None
    ca, certificate, key = _of(_files(settings))
    context = ssl.create_default_context(cafile=ca)
    context.check_hostname = _settings(settings).get("verify_name_on_connect") is not False
    if certificate is not None and key is not None:
        context.load_cert_chain(certificate, key)
    error = _shake(host, port, context)
    where = f"the daemon at {endpoint.locator}"
    if isinstance(error, ssl.SSLCertVerificationError):
        if "mismatch" in error.verify_message:
            return f"the certificate of {where} is not for {host}: {error.verify_message}"
        if ca is None:
            return (
                f"the certificate of {where} is not signed by an authority that is known here: name the file of the "
                "authority that signed it, as `config=simd_client.tls.authority(ca)` or in SIMD_TLS_CA"
            )
        return f"the certificate of {where} is not signed by the authority in {ca}: {error.verify_message}"
    if isinstance(error, ssl.SSLError) and "ALERT" in (error.reason or ""):
        if certificate is None:
            return (
                f"{where} asks for a certificate of this client: name it and its key, as "
                "`config=simd_client.tls.authority(ca, certificate, key)` or in SIMD_TLS_CLIENT_CERT and SIMD_TLS_CLIENT_KEY"
            )
        return f"{where} does not accept the certificate {certificate} ({error.reason})"
    if isinstance(error, (ssl.SSLError, TimeoutError, ConnectionResetError)):
        return f"the server at {address} does not use TLS: without TLS the endpoint is tcp/{address}"
    return None


def _why(error: OSError) -> str:
    return (isinstance(error, ssl.SSLError) and error.reason) or str(error)


def _shake(host: str, port: str, context: ssl.SSLContext) -> OSError | None:
    """Makes a handshake and waits for an alert. Returns `None` without an alert."""
    try:
        with socket.create_connection((host, int(port)), timeout=_SECONDS) as plain:
            with context.wrap_socket(plain, server_hostname=host) as secured:
                secured.settimeout(_ALERT_SECONDS)
                try:
                    secured.recv(1)
                except TimeoutError:
                    pass
                return None
    except (OSError, ValueError) as error:
        return error if isinstance(error, OSError) else OSError(str(error))


def _careless() -> ssl.SSLContext:
    """Finds out whether the server speaks TLS, and sends nothing."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


def _is_tls(endpoint: Endpoint) -> bool:
    return endpoint.locator.startswith(("tls/", "quic/"))


def _settings(settings: zenoh.Config) -> dict[str, Any]:
    return json.loads(settings.get_json(ROOT.rstrip("/")))


def _files(settings: zenoh.Config) -> dict[str, str]:
    names = ("root_ca_certificate", "connect_certificate", "connect_private_key")
    tls = _settings(settings)
    return {name: str(tls[name]) for name in names if tls.get(name)}


def _of(files: dict[str, str]) -> tuple[str | None, str | None, str | None]:
    return files.get("root_ca_certificate"), files.get("connect_certificate"), files.get("connect_private_key")
