"""Each possible error of certificates has a separate sentence."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon import Daemon

import simd_client
import simd_client.pybullet as p
from simd_client import EndpointError, Unavailable
from simd_client.tls import authority

EXTENSIONS = "subjectAltName=IP:127.0.0.1\nbasicConstraints=CA:FALSE\nextendedKeyUsage=serverAuth,clientAuth\n"


def openssl(folder: Path, *arguments: str) -> None:
    subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True, timeout=60)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two authorities, and certificates that the first one signed for the daemon and for a client."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificates")
    folder = tmp_path_factory.mktemp("certificates")
    (folder / "extensions").write_text(EXTENSIONS)
    new = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    for name in ("authority", "other"):
        openssl(folder, "req", "-x509", *new, "-keyout", f"{name}.key", "-out", f"{name}.pem", "-subj", f"/CN={name}")
    for name in ("daemon", "client"):
        openssl(folder, "req", *new, "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj", f"/CN={name}")
        signed_by = ("-CA", "authority.pem", "-CAkey", "authority.key", "-CAcreateserial", "-extfile", "extensions")
        openssl(folder, "x509", "-req", "-in", f"{name}.csr", *signed_by, "-out", f"{name}.pem")
    return folder


def served(files: Path, more: str = "") -> Daemon:
    settings = f"{files}/zenoh{len(more)}.json5"
    tls = f'listen_private_key: "{files}/daemon.key", listen_certificate: "{files}/daemon.pem", {more}'
    Path(settings).write_text(f"{{ transport: {{ link: {{ tls: {{ {tls} }} }} }} }}")
    return Daemon("--paused", "--zenoh-config", settings, name="sealed", locator="tls/127.0.0.1:0")


@pytest.fixture(scope="module")
def daemon(files: Path) -> Iterator[Daemon]:
    with served(files) as running:
        yield running


@pytest.fixture(scope="module")
def strict(files: Path) -> Iterator[Daemon]:
    """Requires certificates from its clients."""
    with served(files, f'enable_mtls: true, root_ca_certificate: "{files}/authority.pem"') as running:
        yield running


def refusal(endpoint: str, kind: type[Exception], **files: str) -> str:
    with pytest.raises(kind) as refused:
        simd_client.connect(endpoint, connect_timeout=0.5, config=authority(**files))
    return str(refused.value)


def test_with_the_authority_the_daemon_is_reached(daemon: Daemon, files: Path) -> None:
    with simd_client.connect(daemon.endpoint, config=authority(f"{files}/authority.pem")) as sim:
        assert sim.name == "sealed"
    number = p.connect(p.DIRECT, options=f"--endpoint={daemon.endpoint} '--tls-ca={files}/authority.pem'")
    assert p.isConnected(number)
    p.disconnect(number)


def test_a_missing_authority_is_reported(daemon: Daemon) -> None:
    said = refusal(daemon.endpoint, Unavailable)
    assert "is not signed by an authority that is known here: name the file" in said and "SIMD_TLS_CA" in said


def test_the_authority_of_another_is_reported(daemon: Daemon, files: Path) -> None:
    said = refusal(daemon.endpoint, Unavailable, ca=f"{files}/other.pem")
    assert f"is not signed by the authority in {files}/other.pem" in said


def test_a_file_that_is_not_there_is_reported(daemon: Daemon, files: Path) -> None:
    said = refusal(daemon.endpoint, EndpointError, ca=f"{files}/lost.pem")
    assert said == f"there is no file {files}/lost.pem, which `ca` of `simd_client.tls.authority` names"


def test_a_file_that_is_no_certificate_is_reported(daemon: Daemon, files: Path) -> None:
    assert "has no certificate of an authority" in refusal(daemon.endpoint, EndpointError, ca=f"{files}/extensions")
    key_of_another = {"certificate": f"{files}/client.pem", "key": f"{files}/daemon.key"}
    said = refusal(daemon.endpoint, EndpointError, ca=f"{files}/authority.pem", **key_of_another)
    assert "are not a certificate and its private key" in said
    assert "belong together" in refusal(daemon.endpoint, EndpointError, key=f"{files}/client.key")


def test_a_daemon_that_asks_for_a_certificate_says_so(strict: Daemon, files: Path) -> None:
    ca = f"{files}/authority.pem"
    assert "asks for a certificate of this client" in refusal(strict.endpoint, Unavailable, ca=ca)
    other = {"certificate": f"{files}/other.pem", "key": f"{files}/other.key"}
    assert "does not accept the certificate" in refusal(strict.endpoint, Unavailable, ca=ca, **other)
    own = authority(ca, f"{files}/client.pem", f"{files}/client.key")
    with simd_client.connect(strict.endpoint, config=own) as sim:
        assert sim.name == "sealed"


def test_the_environment_names_the_certificates_as_for_simctl(
    daemon: Daemon, strict: Daemon, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIMD_TLS_CA", f"{files}/authority.pem")
    with simd_client.connect(daemon.endpoint) as sim:
        assert sim.name == "sealed"
    monkeypatch.setenv("SIMD_TLS_CLIENT_CERT", f"{files}/client.pem")
    monkeypatch.setenv("SIMD_TLS_CLIENT_KEY", f"{files}/client.key")
    with simd_client.connect(strict.endpoint) as sim:
        assert sim.name == "sealed"


def test_tls_is_not_taken_for_tcp_nor_tcp_for_tls(daemon: Daemon) -> None:
    plain = daemon.endpoint.replace("tls/", "tcp/")
    assert f"uses TLS: its endpoint is {daemon.endpoint}" in refusal(plain, Unavailable)
    with Daemon("--paused", name="plain") as other:
        said = refusal(other.endpoint.replace("tcp/", "tls/"), Unavailable)
        assert f"does not use TLS: without TLS the endpoint is {other.endpoint}" in said


def test_a_script_says_its_certificates_as_words_of_the_runner(daemon: Daemon, files: Path, tmp_path: Path) -> None:
    import sys

    script = tmp_path / "script.py"
    script.write_text("import pybullet as p\np.connect(p.DIRECT)\nprint('at', p.getNumBodies())\n")
    command = [sys.executable, "-m", "simd_client.pybullet", "--endpoint", daemon.endpoint]
    ran = subprocess.run(
        [*command, "--tls-ca", f"{files}/authority.pem", str(script)], capture_output=True, text=True, timeout=60
    )
    assert ran.stdout == "at 0\n", ran.stderr
    ran = subprocess.run([*command, str(script)], capture_output=True, text=True, timeout=60)
    assert re.search(r"error: the certificate of the daemon at .* is not signed", ran.stderr)
