"""The plugin of pytest, from a folder with one file of tests. Sessions run in this process, except those that end
early: a process of pytest imports for a second."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
import xml.etree.ElementTree as xml
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from daemon import ASSETS, BINARY, within

from simd_client import embedded_link

SECONDS = 120.0

pytest_plugins = ["pytester"]
pytestmark = pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")

# The arm of these tests lies in a folder of theirs.
ARM = "arm/urdf/Two Link.v2.urdf"
FAILING = f"""
import pytest
from simd_client.testing import assert_positions, until

@pytest.mark.simd_robot("{ARM}", fixed=True, name="arm")
def test_the_elbow_bends(simd, simd_robot):
    print("said by the test")
    applied = simd_robot.set_positions({{"elbow joint": 0.5}})
    simd.step(500)
    assert_positions(simd_robot, {{"elbow joint": "90deg"}}, within=0.01, after=applied)

def test_nothing_is_there(simd):
    assert not simd.robots and simd.stamp.step == 0
"""


Run = Callable[..., tuple[int, str]]


def is_of_others(name: str) -> bool:
    """Whether a variable would tell a session of these tests about another one."""
    # With bytecode written, as by default: pytest would compile the plugin's package in each process.
    return name.startswith(("PYTEST_", "SIMD_", "PYTHONDONTWRITEBYTECODE"))


def environment() -> dict[str, str]:
    """Returns the variables of a user who has the daemon of the tests."""
    kept = {name: value for name, value in os.environ.items() if not is_of_others(name)}
    return {**kept, "SIMD_BINARY": str(BINARY.resolve())}


@pytest.fixture
def folder(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with an arm and nothing else."""
    shutil.copytree(ASSETS / "Two Link.v2", pytester.path / "arm")
    (described,) = (pytester.path / "arm").rglob("*.urdf")
    if described != pytester.path / ARM:
        (pytester.path / ARM).parent.mkdir(parents=True, exist_ok=True)
        described.rename(pytester.path / ARM)
    for name in filter(is_of_others, list(os.environ)):
        monkeypatch.delenv(name)
    monkeypatch.setenv("SIMD_BINARY", str(BINARY.resolve()))
    return pytester.path


@pytest.fixture
def run(folder: Path, pytester: pytest.Pytester, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs a file of tests in this process; returns pytest's exit code and output."""
    # Modules that a session imports first are removed after it.
    for module in ("matplotlib.backends.backend_agg", "mcap.reader", "mcap_ros2.decoder"):
        importlib.import_module(module)

    def ran(code: str, *arguments: str) -> tuple[int, str]:
        if code:
            (folder / "test_it.py").write_text(code)
        with warnings.catch_warnings():
            # A user's session does not have the filters of this one.
            warnings.simplefilter("default")
            options = ["-p", "no:cacheprovider", "-o", "asyncio_default_fixture_loop_scope=function"]
            result = pytester.runpytest_inprocess(*options, *arguments)
        # Programs that the session starts write to the process's own output.
        return int(result.ret), "".join((str(result.stdout), str(result.stderr), *capfd.readouterr()))

    return ran


def begun(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """Starts pytest in the folder, in a separate process."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    return subprocess.Popen(
        command, cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def kept(folder: Path) -> set[str]:
    """Returns the files of tests that are kept, with their folders."""
    results = folder / "simd-results"
    return {file.relative_to(results).as_posix() for file in results.rglob("*") if file.is_file()}


OF_THE_ELBOW = {f"test_it.test_the_elbow_bends/{name}" for name in ("recording.mcap", "arm.png", "log.txt")}


@pytest.mark.parametrize(("world", "scope"), [("embedded", "test"), ("daemon", "session")])
def test_a_failed_test_leaves_its_recording_a_plot_and_a_log(folder: Path, run: Run, world: str, scope: str) -> None:
    code, said = run(FAILING, f"--simd-world={world}", f"--simd-scope={scope}", "--junit-xml=out/junit.xml")
    assert code == 1 and "1 failed, 1 passed" in said, said
    assert re.search(
        r"joint `elbow joint` of `arm` is at 0\.\d+ rad, wanted 1\.571 \(90deg\) within 0\.01, 0\.5 s after the target", said
    ), said
    assert kept(folder / "out") == OF_THE_ELBOW
    results = folder / "out" / "simd-results" / "test_it.test_the_elbow_bends"
    assert (results / "arm.png").read_bytes().startswith(b"\x89PNG")
    log = (results / "log.txt").read_text()
    assert "wanted 1.571 (90deg)" in log and "said by the test" in log and "entity_spawned" in log
    assert ("log of the daemon" in log) == (world == "daemon")
    properties = xml.parse(folder / "out" / "junit.xml").iter("property")
    assert {each.get("name"): each.get("value") for each in properties} == {"simd-results": str(results)}
    assert f"run it again: pytest --simd-replay {results}/recording.mcap" in said
    code, said = run("", "--simd-replay", str(results / "recording.mcap"))
    assert code == 0 and re.search(r"recording\.mcap: 500 steps, \d+ commands, 2 worlds from 0 s on: equal", said), said


def test_a_test_that_passes_leaves_nothing_and_removes_what_it_left_before(folder: Path, run: Run) -> None:
    assert run(FAILING)[0] == 1
    assert kept(folder) == OF_THE_ELBOW
    passing = FAILING.replace("90deg", "0.5").replace("step(500)", "step(3000)")
    code, said = run(passing)
    assert code == 0 and not (folder / "simd-results").exists(), said


def test_files_of_all_tests_or_of_none_are_kept_on_demand(folder: Path, run: Run) -> None:
    assert run(FAILING, "--simd-keep=none")[0] == 1
    assert kept(folder) == {"test_it.test_the_elbow_bends/log.txt"}
    assert run(FAILING, "--simd-keep=all", "--simd-folder=all of them/here")[0] == 1
    passed = {f"test_it.test_nothing_is_there/{name}" for name in ("recording.mcap", "log.txt")}
    (folder / "all of them" / "here").rename(folder / "all of them" / "simd-results")
    assert kept(folder / "all of them") == OF_THE_ELBOW | passed


SESSION = """
import pytest, simd_client

def test_it_changes_all(simd):
    simd.add_box((1, 1, 1), name="box")
    simd.set_physics(gravity=(0, 0, -1), time_step=0.005)
    simd.save_state("mine")
    simd.parameters.add_slider("height", 0.0, 1.0, 0.5)
    simd.claim({"box": ()})
    simd.step(10)
    simd.play()

def test_all_is_as_it_was(simd):
    assert simd.state is simd_client.SimulationState.PAUSED
    assert not simd.robots and not simd.saved_states() and not list(simd.parameters.all())
    assert (simd.stamp.step, simd.physics.gravity[2], simd.physics.time_step) == (0, -9.81, 0.002)
    simd.close()

def test_a_world_that_was_closed_is_opened_again(simd):
    assert simd.step(3).stamp.step == 3
"""


@pytest.mark.parametrize(("world", "scope"), [("embedded", "session"), ("daemon", "session"), ("daemon", "test")])
def test_each_test_has_an_empty_world_with_the_configuration(folder: Path, run: Run, world: str, scope: str) -> None:
    (folder / "conftest.py").write_text(
        "import pytest\n\n@pytest.fixture(scope='session')\ndef simd_config():\n    return {'physics.time_step': 0.002}\n"
    )
    code, said = run(SESSION, f"--simd-world={world}", f"--simd-scope={scope}")
    assert code == 0 and "3 passed" in said, said


def test_a_daemon_that_died_is_replaced_for_the_next_test(folder: Path, run: Run) -> None:
    code, said = run(
        """
import os, signal, subprocess, time

def test_it_dies(simd):
    simd.add_box((1, 1, 1), name="box")
    name = simd.name
    os.kill(int(subprocess.check_output(["pgrep", "-f", name]).split()[0]), signal.SIGKILL)
    simd.with_timeout(2.0).step()

def test_there_is_another(simd):
    assert simd.step().stamp.step == 1
""",
        "--simd-world=daemon",
        "--simd-scope=session",
    )
    assert code == 1 and "1 failed, 1 passed" in said, said
    # Its recording has what was written.
    assert kept(folder) == {f"test_it.test_it_dies/{name}" for name in ("recording.mcap", "log.txt")}


KILLED = """
import os, pathlib, time

def test_it_never_ends(simd):
    simd.add_box((1, 1, 1), name="box", position=(0, 0, 5))
    for _ in range(1000000):
        simd.step(100)
        pathlib.Path("begun").touch()
        time.sleep(0.05)
"""


@contextmanager
def running(folder: Path, code: str, *arguments: str) -> Generator[subprocess.Popen[str]]:
    """Starts pytest, and waits until its test has made the file `begun` and half a second of its recording is
    written."""
    (folder / "test_it.py").write_text(code)
    process = begun(folder, *arguments)
    until = within(SECONDS)
    try:
        while not ((folder / "begun").exists() and any(file.stat().st_size > 4096 for file in recordings(folder))):
            assert process.poll() is None and time.monotonic() < until, process.communicate()
            time.sleep(0.02)
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def recordings(folder: Path) -> list[Path]:
    return list((folder / "simd-results").rglob("*.mcap"))


@pytest.mark.parametrize("world", ["embedded", "daemon"])
def test_a_killed_session_leaves_a_recording_that_is_replayed(folder: Path, run: Run, world: str) -> None:
    with running(folder, KILLED, f"--simd-world={world}") as process:
        process.kill()
        process.wait()
    (left,) = recordings(folder)
    assert left.parent.name.startswith("unfinished-") and left.name == "test_it-py-test_it_never_ends.mcap"
    # The daemon notices the end of its parent, and completes the file.
    until = within()
    while (run_again := run("", "--simd-replay", str(left)))[0] != 0 and time.monotonic() < until:
        pass
    assert "equal" in run_again[1], run_again
    assert run("def test_nothing(): pass", "--simd-scope=test")[0] == 0
    assert recordings(folder) == [], "the next session removes it"


def test_an_interrupted_test_keeps_its_files(folder: Path) -> None:
    with running(folder, KILLED) as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(SECONDS) == 2
    assert kept(folder) == {f"test_it.test_it_never_ends/{name}" for name in ("recording.mcap", "log.txt")}


def test_two_sessions_of_one_folder_disturb_each_other_not(folder: Path, run: Run) -> None:
    with running(folder, KILLED) as first:
        (other,) = recordings(folder)
        (folder / "test_other.py").write_text(FAILING)
        code, said = run("", "test_other.py")
        assert code == 1 and "1 failed, 1 passed" in said, said
        assert other.exists() and first.poll() is None
    assert {file for file in kept(folder) if file.startswith("test_other")} == {
        file.replace("test_it", "test_other") for file in OF_THE_ELBOW
    }


def test_processes_of_xdist_have_a_world_each_and_a_crash_names_its_recording(folder: Path, run: Run) -> None:
    code = """
import os, pytest, time

@pytest.mark.parametrize("number", range(6))
def test_it(simd, number):
    assert simd.step(10).stamp.step == 10
    assert number != 3

def test_crash(simd):
    simd.add_box((1, 1, 1), name="box")
    simd.step(100)
    time.sleep(1.5)
    os._exit(3)
"""
    exit_code, said = run(code, "-n2", "--simd-scope=session", "--junit-xml=junit.xml")
    assert exit_code == 1 and "2 failed, 5 passed" in said, said
    assert "a process ended during a test and has left" in said and "test_it-py-test_crash.mcap" in said, said
    (failed,) = [name for name in kept(folder) if name.endswith("recording.mcap")]
    assert re.fullmatch(r"test_it\.test_it-3--[0-9a-f]{6}/recording\.mcap", failed), failed
    value = next(each.get("value") for each in xml.parse(folder / "junit.xml").iter("property"))
    assert value == str((folder / "simd-results" / failed).parent)


def test_a_test_that_records_says_so(run: Run) -> None:
    code, said = run(
        """
import pytest, simd_client

def test_there_is_a_recording_already(simd):
    with pytest.raises(simd_client.RecordingNotPossible):
        simd.record("mine")

@pytest.mark.simd_unrecorded
def test_of_its_own(simd):
    with simd.record("mine"):
        simd.step(10)
""",
        "--strict-markers",
    )
    assert code == 0, said


def test_mistakes_are_said_in_a_sentence(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    without = "def test_it(simd_robot): pass"
    code, said = run(without)
    assert code == 1 and 'pytest.mark.simd_robot("arm.urdf", fixed=True)' in said, said
    # In a separate process, since pytester takes an exit code of 2 for Ctrl-C.
    replayed = begun(folder, "--simd-replay", "nothing.mcap")
    said, _ = replayed.communicate(timeout=SECONDS)
    assert replayed.returncode == 2 and "nothing.mcap" in said, said
    monkeypatch.setenv("SIMD_BINARY", str(folder / "no simd"))
    code, said = run("def test_it(simd): pass", "--simd-world=daemon")
    assert code == 1 and "SIMD_BINARY names" in said and "which is not there" in said, said
    code, said = run("", "--simd-replay", "nothing.mcap")
    assert code == 4 and "--simd-replay: SIMD_BINARY names" in said, said


def test_an_error_of_another_plugin_is_the_only_one(folder: Path, run: Run) -> None:
    (folder / "conftest.py").write_text(
        "import pytest\n\n@pytest.hookimpl(tryfirst=True)\ndef pytest_configure():\n    raise pytest.UsageError('no robots today')\n"
    )
    code, said = run("def test_it(): pass")
    assert code == 4 and "no robots today" in said and "KeyError" not in said, said


def test_tests_without_a_world_make_no_folder(folder: Path, run: Run) -> None:
    code, said = run("def test_it(): pass", "-v")
    assert code == 0 and not (folder / "simd-results").exists(), said


def test_a_test_of_asyncio_uses_the_world_too(run: Run) -> None:
    code, said = run("async def test_it(simd): assert simd.step(2).stamp.step == 2", "--asyncio-mode=auto")
    assert code == 0 and "1 passed" in said, said


