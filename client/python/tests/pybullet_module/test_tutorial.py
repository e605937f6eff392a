"""The tutorial's kind of script, run unchanged, with sliders moved by another client."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import simd_client
from simd_client.pybullet.daemon_process import DaemonProcess

from .conftest import BENCH_ARM

SCRIPT = Path(__file__).with_name("tutorial_script.py")


@pytest.fixture
def data_folder(tmp_path: Path) -> Iterator[str]:
    """A stand-in for pybullet_data, which the script requests and does not use."""
    (tmp_path / "plane.urdf").write_text("<robot name='plane'><link name='plane'/></robot>")
    yield str(tmp_path)


def start(daemon: DaemonProcess, data: str, kind: str, turns: int, ready: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "simd_client.pybullet", "--endpoint", daemon.endpoint, str(SCRIPT)]
    return subprocess.Popen(
        [*command, str(BENCH_ARM), kind, str(turns), str(ready)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYBULLET_DATA": data},
    )


def run(
    daemon: DaemonProcess, data: str, kind: str, slider: str, value: float
) -> tuple[list[str], float, float]:
    """Moves the slider after 20 of 300 turns. Returns the script's output, and position and velocity at
    its end."""
    process = start(daemon, data, kind, 300, 20)
    assert process.stdin is not None and process.stdout is not None
    said: list[str] = []
    with process:
        for line in process.stdout:
            said.append(line.strip())
            if line.strip() == "ready":
                with simd_client.connect(daemon.endpoint) as other:
                    other.parameters.set({slider: value})
                process.stdin.write("go on\n")
                process.stdin.flush()
    assert process.returncode == 0, said
    words = said[-1].split()
    assert words[0] == "at", said
    return said, float(words[1]), float(words[2])


def test_a_position_slider_is_followed_within_a_milliradian(daemon: DaemonProcess, data_folder: str) -> None:
    said, position, velocity = run(daemon, data_folder, "position", "b'shoulder'PC", 0.7)
    assert position == pytest.approx(0.7, abs=1e-3)
    assert velocity == pytest.approx(0.0, abs=1e-3)
    assert said[0] == "joints 1"
    assert said[1].startswith(
        "joint 0 b'shoulder' (0, 7, 6, 1, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, b'arm', (0.0, 1.0, 0.0), "
    )


def test_a_velocity_slider_is_followed_within_a_percent(daemon: DaemonProcess, data_folder: str) -> None:
    _, _, velocity = run(daemon, data_folder, "velocity", "b'shoulder'VC", -3.0)
    assert velocity == pytest.approx(-3.0, rel=0.01)


def test_without_a_daemon_the_runner_starts_one_and_says_so(data_folder: str) -> None:
    command = [sys.executable, "-m", "simd_client.pybullet", "--new", str(SCRIPT)]
    ran = subprocess.run(
        [*command, str(BENCH_ARM), "position", "50", "-1"],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYBULLET_DATA": data_folder},
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.splitlines()[-1].startswith("at ")
    assert "simd: no daemon was running; started " in ran.stderr
    # One line names the place to look.
    assert (
        sum(word in ran.stderr for word in ("look at the world at http://", "watch the world with: simctl"))
        == 1
    )


def test_a_script_that_is_not_there_is_reported(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "simd_client.pybullet", str(tmp_path / "lost.py")]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 2
    assert "there is no file" in ran.stderr
