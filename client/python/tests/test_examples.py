"""Each example runs, prints the expected output, and leaves the world unchanged."""

from __future__ import annotations

import os
import re
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from daemon import IS_WIDE, Daemon, within

from simd_client import Simulation, SimulationState

EXAMPLES = Path(__file__).parents[1] / "examples"
SECONDS = 240.0

SAID = {
    "tutorial": ["the elbow is at 0.30 rad", "the elbow is at 0.60 rad"],
    # Computed torque with the daemon's own dynamics has no error left at the end.
    "lockstep": ["largest error 0.0000 rad after 3.00 s"],
    "real_time": ["turns in 2.0 simulated seconds"],
    "several_clients": [
        "joints_claimed calibration",
        'is claimed by "calibration"',
        "the display saw the target: True",
        "joints_released calibration",
        "the operator's turn: 0.0",
    ],
    # The crate is lifted by 0.24 m, and its centre is 0.03 m above the ground before and after.
    "grasping": ["points of the crate touch fingers", "the crate hangs at 0.27 m", "and lies at 0.03 m"],
    # While a foot is on the ground, 0.375 s, the body moves 2 * 0.15 rad * 0.2 m: 0.8 m in five seconds.
    "walking": ["walked 0.8"],
    "saved_states": ["ends at the same bits: True", "back from start.simdstate: ['saved_arm']"],
    "cart_pole": ["after 4 s the pole is upright"],
    "plots": ["the elbow is 0.00", "wrote plots.png"],
    "two_robots_asyncio": ["left_arm is at +0.0 rad", "right_arm is at +0.0 rad", "saw states of the left arm: True"],
}


# Examples that learn, the same each time, with a shorter form and what it reaches at least. Learning over a connection
# takes minutes in `make wide` only; the interrupted one shows that it begins.
LEARNERS: dict[str, tuple[list[str], int]] = {"ppo": (["--iterations", "8"], 150), **({"learning": ([], 64)} if IS_WIDE else {})}

Example = Callable[..., str]


@pytest.fixture
def example(
    daemon: Daemon, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Example:
    """Runs an example in this process and returns its output. A process of its own would first import for half a
    second; those of interrupted examples show that they end."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SIMD_ENDPOINT", daemon.endpoint)

    def run(name: str, *arguments: str) -> str:
        path = str(EXAMPLES / f"{name}.py")
        monkeypatch.setattr(sys, "argv", [path, *arguments])
        # On a separate thread: `asyncio.run` removes the loop that pytest-asyncio keeps for this one.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(runpy.run_path, path, run_name="__main__").result(SECONDS)
        return capsys.readouterr().out

    return run


@pytest.mark.parametrize("name", SAID)
def test_an_example_runs(name: str, sim: Simulation, example: Example) -> None:
    said = example(name)
    for each in SAID[name]:
        assert each in said, said
    assert list(sim.robots) == [] and list(sim.parameters.all()) == [] and sim.saved_states() == []


@pytest.mark.parametrize("name", LEARNERS)
def test_an_example_learns(name: str, sim: Simulation, example: Example) -> None:
    shorter, least = LEARNERS[name]
    said = example(name, *([] if IS_WIDE else shorter))
    learned = re.search(r"(?:the return is|upright in) (\d+) of (\d+)", said)
    assert learned is not None and int(learned[1]) >= (int(learned[2]) if IS_WIDE else least), said
    assert list(sim.robots) == []


def test_an_arm_reaches_past_a_post(sim: Simulation, example: Example) -> None:
    said = example("reaching", "--starts", "1", "--lockstep")
    assert "reached from 1 of 1 starts" in said and "; 0 touched something" in said, said
    assert list(sim.robots) == []


def test_an_arm_reaches_past_a_post_in_a_world_that_plays(sim: Simulation, example: Example) -> None:
    said = example("reaching", "--starts", "1")
    reached = re.search(r"reached from (\d) of 1 starts", said)
    late = re.search(r"one in twenty more than (\S+) ms", said)
    # A controller with calls longer than its turns of 20 ms is late, and may miss.
    assert reached is not None and late is not None and (int(reached[1]) > 0 or float(late[1]) > 20.0), said
    assert list(sim.robots) == []


def test_an_example_runs_beside_what_is_there_already(sim: Simulation, example: Example) -> None:
    there = sim.add_box((0.1, 0.1, 0.1), name="mine", position=(0, 0, 5), fixed=True)
    first = sim.load(EXAMPLES / "robots" / "gripper.urdf", "gripper", fixed=True, position=(0, -5, 1))
    assert "the crate hangs at 0.27 m" in example("grasping")
    assert list(sim.robots) == [there.name, first.name]


# Examples that run long enough to be interrupted.
@pytest.mark.parametrize(
    "name",
    ["tutorial", "learning", "reaching", "two_robots_asyncio", *(["lockstep", "walking", "cart_pole"] if IS_WIDE else [])],
)
def test_an_example_that_is_interrupted_leaves_the_world_as_it_was(
    name: str, sim: Simulation, daemon: Daemon, tmp_path: Path
) -> None:
    before = sim.physics.time_step
    environment = {**os.environ, "SIMD_ENDPOINT": daemon.endpoint}
    command = [sys.executable, str(EXAMPLES / f"{name}.py")]
    running = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    until = within(SECONDS)
    # Copies of a world step without it.
    while not (sim.robots and (name == "learning" or sim.stamp.step > 0)) and running.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    if name == "learning":
        assert running.stdout is not None and b"generation" in running.stdout.readline()
    running.send_signal(signal.SIGINT)
    said, _ = running.communicate(timeout=SECONDS)
    assert running.returncode != 0 and b"KeyboardInterrupt" in said, said.decode()
    assert list(sim.robots) == [] and list(sim.parameters.all()) == [] and sim.physics.time_step == before
    assert sim.state is SimulationState.PAUSED


@pytest.mark.parametrize(
    "name",
    ["grasping", "saved_states", "several_clients", "two_robots_asyncio", *(["walking", "lockstep"] if IS_WIDE else [])],
)
def test_an_example_runs_beside_what_a_killed_one_has_left(name: str, sim: Simulation, example: Example) -> None:
    sim.set_physics(time_step=0.004)
    for left in ("grasp_ground", "walking_ground"):
        sim.add_plane(name=left)
    sim.add_box((0.06, 0.06, 0.06), name="crate", position=(10, 0, 0.03))
    sim.load(EXAMPLES / "robots" / "gripper.urdf", "gripper", fixed=True, position=(10, 0, 0.5))
    for at, left in enumerate(("left_arm", "right_arm", "saved_arm", "shared_arm", "lockstep_arm")):
        sim.load(EXAMPLES.parents[2] / "tests" / "assets" / "Two Link.v2", left, fixed=True, position=(0, 2 * at, 0))
    sim.save_state("start")
    there = list(sim.robots)
    said = example(name)
    for each in SAID[name]:
        wanted = re.sub(r"(left|right)_arm is", r"\1_arm_1 is", each) if name == "two_robots_asyncio" else each
        assert wanted.partition("['")[0] in said.replace("_arm_2 is", "_arm_1 is"), said
    assert list(sim.robots) == there and [each.name for each in sim.saved_states()] == ["start"]
    assert sim.physics.time_step == 0.004


def test_the_notebook_is_executed(sim: Simulation, daemon: Daemon, tmp_path: Path) -> None:
    target = tmp_path / "executed.ipynb"
    command = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--output", str(target)]
    ran = subprocess.run(
        [*command, str(EXAMPLES / "notebook.ipynb")],
        cwd=EXAMPLES,
        env={**os.environ, "SIMD_ENDPOINT": daemon.endpoint},
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    executed = target.read_text()
    # Two figures, and the table of the robot.
    assert executed.count('"image/png"') == 2
    assert "<th>joint</th>" in executed


def test_every_example_is_tested() -> None:
    # Examples outside the list have separate tests.
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {*SAID, "foxglove_live", "learning", "ppo", "ray_worlds", "reaching"}
