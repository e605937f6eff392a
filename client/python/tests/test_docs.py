"""The code of the guide and the README runs."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from daemon import BINARY, REPOSITORY, Daemon

import simd_client
from simd_client import Unauthenticated, Unavailable, embedded_link

GUIDE = REPOSITORY / "docs" / "python.md"
EMBEDDED = REPOSITORY / "docs" / "embedded.md"
ROLLOUTS = REPOSITORY / "docs" / "rollouts.md"
TUTORIAL = REPOSITORY / "docs" / "tutorial.md"
FAST_LOOP = REPOSITORY / "docs" / "fast-loop.md"
CI = REPOSITORY / "docs" / "ci.md"
DEMO = ("--config", str(REPOSITORY / "tests" / "assets" / "demo.toml"))
README = Path(__file__).parents[1] / "README.md"

SECURED = "tls/127.0.0.1:7447"
"""Address of the daemon in the guide's block on certificates and tokens."""

FAR = "tls/lab.example:7447"
"""Address of the daemon for clients of other machines."""


def blocks(page: Path) -> list[str]:
    """Returns the page's blocks of Python, each after blank lines, so that an error has the line of the
    page."""
    text = page.read_text()
    found = re.finditer(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return ["\n" * text[: each.start(1)].count("\n") + each.group(1) for each in found]


def test_the_blocks_of_the_guide_run_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(REPOSITORY)
    said = [block for block in blocks(GUIDE) if SECURED not in block and FAR not in block]
    assert len(said) >= 12
    with Daemon(name="guide") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        names: dict[str, object] = {"__name__": "guide"}
        # On a separate thread: `asyncio.run` removes the loop that pytest-asyncio keeps for this one.
        with ThreadPoolExecutor(1) as thread:
            for block in said:
                for file in ("kept.simdstate", "arm.png"):
                    block = block.replace(f'"{file}"', f'r"{tmp_path / file}"')
                thread.submit(exec, compile(block, str(GUIDE), "exec"), names).result()


def said(line: str) -> str:
    return subprocess.run(line, shell=True, check=True, capture_output=True, text=True, timeout=60).stdout


def secured(title: str, locator: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> tuple[str, list[str], str]:
    """Executes the lines of a section before the daemon's start. Returns the token, the daemon's flags and
    the block of Python."""
    section = GUIDE.read_text().split(f"## {title}\n")[1].split("\n## ")[0]
    (shell,) = re.findall(r"^```sh\n(.*?)^```$", section, flags=re.MULTILINE | re.DOTALL)
    (python,) = [block for block in blocks(GUIDE) if locator in block]
    monkeypatch.setenv("PATH", os.pathsep.join([str(BINARY.resolve().parent), os.environ["PATH"]]))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    monkeypatch.delenv("SIMD_TOKEN", raising=False)
    monkeypatch.chdir(folder)
    *made, start = shell.splitlines()
    token = [said(line) for line in made][-1].strip()
    assert token.startswith("simd_")
    program, *flags = shlex.split(start)
    assert program == "simd"
    return token, flags, python


def run(block: str) -> None:
    exec(compile(block, str(GUIDE), "exec"), {"__name__": "secured"})


def test_the_lines_on_certificates_and_tokens_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    token, (flag, locator, *flags), python = secured("Certificates and tokens", SECURED, monkeypatch, tmp_path)
    assert (flag, locator) == ("--zenoh", SECURED)
    with Daemon(*flags, name="secured", locator="tls/127.0.0.1:0") as daemon:
        python = python.replace(SECURED, daemon.endpoint)
        run(python.replace("simd_...", token))
        assert capsys.readouterr().out == "secured []\n"
        without = python.replace(', token="simd_..."', "")
        assert without != python
        with pytest.raises(Unauthenticated, match="asks for a token: set SIMD_TOKEN"):
            run(without)
        with pytest.raises(Unauthenticated, match="unknown, or was revoked"):
            run(python.replace("simd_...", "simd_" + 64 * "0"))
        monkeypatch.setenv("SIMD_TOKEN", token)
        run(without)
        assert capsys.readouterr().out == "secured []\n"
        said("simd tls init other")
        with pytest.raises(Unavailable, match="is not signed by the authority in other/ca.pem"):
            run(without.replace("tls/ca.pem", "other/ca.pem"))


def run_when_known(python: str) -> None:
    """Runs a block. On a busy machine a new session of Zenoh may ask before it knows the daemon."""
    for _ in range(2):
        try:
            return run(python)
        except Unavailable:
            pass
    run(python)


def test_the_lines_for_another_machine_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    token, (flag, locator, *flags), python = secured("From another machine", FAR, monkeypatch, tmp_path)
    assert (flag, locator) == ("--zenoh", "tls/0.0.0.0:7447")
    # The line's permissions apply, and the test's daemon is on loopback.
    said(shlex.join(["simd", "config", "show", flag, locator, *flags]))
    with Daemon(*flags, name="far", locator="tls/127.0.0.1:0") as daemon:
        python = python.replace(FAR, daemon.endpoint).replace("simd_...", token)
        run_when_known(python)
        assert capsys.readouterr().out == "far []\n"
        unsigned = python.replace(', "tls/alice.pem", "tls/alice.key"', "")
        assert unsigned != python
        with pytest.raises(Unavailable, match="certificate"):
            run(unsigned)


def test_the_blocks_on_rollouts_run(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(REPOSITORY)
    with Daemon(name="rollouts") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        names: dict[str, object] = {"__name__": "rollouts"}
        for block in blocks(ROLLOUTS):
            exec(compile(block, str(ROLLOUTS), "exec"), names)


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
@pytest.mark.parametrize("page", [EMBEDDED, CI], ids=["embedded", "ci"])
def test_the_block_on_worlds_in_the_process_runs(monkeypatch: pytest.MonkeyPatch, page: Path) -> None:
    monkeypatch.chdir(REPOSITORY)
    names: dict[str, Any] = {"__name__": "embedded"}
    for block in blocks(page):
        # The port of the page may be taken.
        exec(compile(block.replace(":7400", ":0"), str(page), "exec"), names)
        if "serve=" in block:
            names["sim"].close()


@pytest.mark.parametrize("page", [TUTORIAL, FAST_LOOP], ids=["tutorial", "fast loop"])
def test_the_scripts_of_a_page_run_in_the_demo(monkeypatch: pytest.MonkeyPatch, page: Path) -> None:
    monkeypatch.chdir(REPOSITORY)
    with Daemon(*DEMO, name="demo") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        with simd_client.connect() as sim:
            sim.load("tests/assets/Two Link.v2", position=(1, 0, 0), fixed=True)
        names: dict[str, object] = {"__name__": "page"}
        for block in blocks(page):
            # A tenth of a second of a loop at 1 kHz shows as much.
            block = block.replace("range(1000)", "range(100)").replace("range(500)", "range(50)")
            exec(compile(block, str(page), "exec"), names)


def test_the_script_of_the_front_page_runs_in_the_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = blocks(REPOSITORY / "README.md")
    with Daemon(*DEMO, name="demo") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        exec(compile(block, "README.md", "exec"), {"__name__": "readme"})


def test_the_block_of_the_readme_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    (block,) = blocks(README)
    block = block.replace("path/to/arm.urdf", "tests/assets/Two Link.v2").replace('"elbow"', '"elbow joint"')
    with Daemon(name="readme") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        exec(compile(block, str(README), "exec"), {"__name__": "readme"})
