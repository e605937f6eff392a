"""Short runs of the rollout benches. They check that benches run and draw, not speed or quality."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from daemon import IS_WIDE

pytestmark = pytest.mark.skipif(not IS_WIDE, reason="the examples show as much: `make wide` runs benches")

BENCHES = Path(__file__).parents[1] / "benches"
SECONDS = 240.0


def run(name: str, *arguments: str) -> str:
    """Returns the output of a bench, which starts a separate daemon."""
    command = [sys.executable, str(BENCHES / name), *arguments]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def is_png(path: Path) -> bool:
    """Whether a picture was written."""
    return path.read_bytes().startswith(b"\x89PNG")


def test_a_remote_process_controls_worlds(tmp_path: Path) -> None:
    said = run("control.py", "--starts", "1", "--lockstep", "--out", str(tmp_path / "control.png"))
    assert re.search(r"^pole on a cart +1 of 1 ", said, re.M) is not None, said
    assert re.search(r"^arm past a post +1 of 1 ", said, re.M) is not None, said
    assert is_png(tmp_path / "control.png")


def test_a_remote_process_controls_worlds_that_play(tmp_path: Path) -> None:
    said = run("control.py", "--starts", "1", "--out", str(tmp_path / "control.png"))
    rows = re.findall(r"^(?:pole on a cart|arm past a post) +(\d) of 1 .* (\S+)% +\d+$", said, re.M)
    # A controller may miss if more than one call in twenty is late.
    assert len(rows) == 2 and all(reached == "1" or float(late) > 5.0 for reached, late in rows), said
    assert is_png(tmp_path / "control.png")


def test_learners_learn_and_draw_their_curves(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    pytest.importorskip("pybullet_data")
    picture = tmp_path / "learners.png"
    said = run("learners.py", "--pole", "1", "--walk", "1", "--seeds", "1", "--out", str(picture))
    assert "episodes" in said and "robot-steps a second" in said, said
    # A copy walks like the world.
    assert "as its copy, to the bit: True" in said, said
    assert is_png(picture)
