"""What the guide and the README show is run."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from daemon import REPOSITORY, Daemon

from simd_client import embedded_link

GUIDE = REPOSITORY / "docs" / "python.md"
EMBEDDED = REPOSITORY / "docs" / "embedded.md"
ROLLOUTS = REPOSITORY / "docs" / "rollouts.md"
README = Path(__file__).parents[1] / "README.md"


def blocks(page: Path) -> list[str]:
    """Its blocks of Python, each behind blank lines, so that an error has the line of the page."""
    text = page.read_text()
    found = re.finditer(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return ["\n" * text[: each.start(1)].count("\n") + each.group(1) for each in found]


def test_the_blocks_of_the_guide_run_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(REPOSITORY)
    said = blocks(GUIDE)
    assert len(said) >= 12
    with Daemon(name="guide") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        names: dict[str, object] = {"__name__": "guide"}
        # On a thread of its own: `asyncio.run` takes away the loop that pytest-asyncio keeps for this one.
        with ThreadPoolExecutor(1) as thread:
            for block in said:
                for file in ("kept.simdstate", "arm.png"):
                    block = block.replace(f'"{file}"', f'r"{tmp_path / file}"')
                thread.submit(exec, compile(block, str(GUIDE), "exec"), names).result()


def test_the_blocks_on_rollouts_run(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(REPOSITORY)
    with Daemon(name="one") as daemon, Daemon(name="two") as second:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        names: dict[str, object] = {"__name__": "rollouts"}
        for block in blocks(ROLLOUTS):
            for each in (daemon, second):
                block = block.replace(f'"tcp/127.0.0.1:7447", "{each.name}"', f'"{each.endpoint}", "{each.name}"')
            exec(compile(block, str(ROLLOUTS), "exec"), names)


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_the_block_on_worlds_in_the_process_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    (block,) = blocks(EMBEDDED)
    exec(compile(block, str(EMBEDDED), "exec"), {"__name__": "embedded"})


def test_the_block_of_the_readme_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    (block,) = blocks(README)
    block = block.replace("path/to/arm.urdf", "tests/assets/Two Link.v2").replace('"elbow"', '"elbow joint"')
    with Daemon(name="readme") as daemon:
        monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)
        exec(compile(block, str(README), "exec"), {"__name__": "readme"})
