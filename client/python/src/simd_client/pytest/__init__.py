"""A plugin of pytest: worlds for tests of robots, and what is kept of a test that fails.

Pytest finds it where this package is installed. A test takes a fixture:

    def test_the_arm_reaches(simd):
        arm = simd.load("arm.urdf", fixed=True)
        arm.move_to([0.3, 0.4], steps=10)

The world is paused, so time advances only by steps. If the test fails, its recording, a plot of its last states
and a log are kept in the folder `simd-results`.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import pytest

from simd_client import embedded_link, testing
from simd_client.blocking.robot import Robot
from simd_client.blocking.simulation import Simulation
from simd_client.errors import Unavailable
from simd_client.programs import DAEMON, find

from .graph import Graph, Router
from .results import Results
from .run import Run
from .worlds import World

__all__ = ["Graph", "simd", "simd_config", "simd_robot", "simd_ros2"]

_RESULTS = pytest.StashKey[Results]()
_RUN = pytest.StashKey[Run]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """The plugin's options."""
    group = parser.getgroup("simd", "worlds of simd for tests of robots")
    group.addoption(
        "--simd-world",
        choices=("embedded", "daemon"),
        help="world of the fixture `simd`: in the test's process, or a daemon that is started on free ports "
        "(default: embedded if the package simd-embedded is installed)",
    )
    group.addoption(
        "--simd-scope",
        choices=("test", "session"),
        default="test",
        help="a new world for each test, or one for all of them, which each test gets empty (default: test)",
    )
    group.addoption(
        "--simd-keep",
        choices=("failed", "all", "none"),
        default="failed",
        help="tests whose recording, plot and log are kept; none: no test is recorded (default: failed)",
    )
    group.addoption(
        "--simd-folder",
        metavar="FOLDER",
        help="where they are kept (default: simd-results beside the file of --junit-xml, else in the working folder)",
    )
    group.addoption(
        "--simd-replay",
        metavar="FILE",
        action="append",
        help="run no tests, but a kept recording again, and check that each step is equal to the bit; repeatable",
    )


def pytest_configure(config: pytest.Config) -> None:
    """The plugin's markers, and the folder."""
    config.addinivalue_line(
        "markers",
        "simd_robot(path, **arguments): description for the fixture `simd_robot`, relative to the test's file, "
        "with arguments of `Simulation.load`",
    )
    config.addinivalue_line("markers", "simd_unrecorded: the test is not recorded, for instance because it records")
    config.stash[_RESULTS] = Results(_folder(config))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Removes all files that are not kept."""
    # There is none if another plugin could not be configured.
    if _RESULTS in config.stash:
        config.stash[_RESULTS].close()


def pytest_cmdline_main(config: pytest.Config) -> int | None:
    """Runs recordings again in place of tests. Exit codes are those of `simd replay`."""
    files: list[str] | None = config.getoption("simd_replay")
    if not files:
        return None
    try:
        program = find("simd", DAEMON)
    except Unavailable as error:
        raise pytest.UsageError(f"--simd-replay: {error}") from None
    return subprocess.run([str(program), "replay", *files], check=False).returncode


def pytest_sessionstart(session: pytest.Session) -> None:
    """Removes the folders of killed sessions. A worker of xdist does not: another one of its session may have
    crashed."""
    if not _is_worker(session.config):
        session.config.stash[_RESULTS].remove_left()


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Names recordings of tests that ended with their process."""
    left = [] if _is_worker(config) else config.stash[_RESULTS].left()
    if left:
        terminalreporter.section("simd")
        for file in left:
            terminalreporter.write_line(f"a process ended during a test and has left {file}")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, None]:
    """Keeps the files of a test as soon as it has failed."""
    outcome = yield
    run = item.stash.get(_RUN, None)
    if run is not None and outcome.excinfo is None:
        run.judge(outcome.get_result())


@pytest.fixture(scope="session")
def simd_config() -> Mapping[str, object]:
    """Configuration of worlds, by dotted keys: `{"physics.time_step": 0.002}`. Override it in `conftest.py`."""
    return {}


def _scope(fixture_name: str, config: pytest.Config) -> Any:
    return "session" if config.getoption("simd_scope") == "session" else "function"


@pytest.fixture(scope=_scope)
def _simd_world(pytestconfig: pytest.Config, simd_config: Mapping[str, object]) -> Iterator[World]:  # pyright: ignore[reportUnusedFunction]
    kind = pytestconfig.getoption("simd_world")
    is_embedded = embedded_link.is_installed() if kind is None else kind == "embedded"
    world = World(pytestconfig.stash[_RESULTS].scratch, simd_config, is_embedded=is_embedded)
    yield world
    world.close()


@pytest.fixture
def _simd_graph(pytestconfig: pytest.Config, simd_config: Mapping[str, object]) -> Iterator[tuple[World, Router]]:  # pyright: ignore[reportUnusedFunction]
    router = Router()
    settings = {**simd_config, **router.settings}
    world = World(pytestconfig.stash[_RESULTS].scratch, settings, is_embedded=False)
    yield world, router
    world.close()
    router.close()


@pytest.fixture
def simd(request: pytest.FixtureRequest) -> Iterator[Simulation]:
    """An empty, paused world."""
    if "simd_ros2" in request.fixturenames:
        world: World = request.getfixturevalue("_simd_graph")[0]
    else:
        world = request.getfixturevalue("_simd_world")
    test = _test(request)
    keep = test.config.getoption("simd_keep")
    is_recorded = keep != "none" and test.get_closest_marker("simd_unrecorded") is None
    sim = world.begin()
    run = Run(test.config.stash[_RESULTS], world, test, is_recorded=is_recorded, keeps_all=keep == "all")
    test.stash[_RUN] = run
    testing.use(sim)
    yield sim
    testing.use(None)
    run.end()
    world.end()


@pytest.fixture
def simd_robot(request: pytest.FixtureRequest, simd: Simulation) -> Robot:
    """The robot of the marker `simd_robot`, in the world of `simd`."""
    test = _test(request)
    marker = test.get_closest_marker("simd_robot")
    if marker is None or not marker.args:
        pytest.fail(
            "simd_robot has no description to load: mark the test or its module with "
            '`pytest.mark.simd_robot("arm.urdf", fixed=True)`',
            pytrace=False,
        )
    path, *others = marker.args
    return simd.load(test.path.parent / path, *others, **marker.kwargs)


@pytest.fixture
def simd_ros2(simd: Simulation, _simd_graph: tuple[World, Router]) -> Graph:
    """A graph of ROS 2 with the daemon of `simd` as a node, and its router. Nodes of a test are started with its
    `environment`."""
    return _simd_graph[1].graph


def _test(request: pytest.FixtureRequest) -> pytest.Item:
    return cast(pytest.Item, request.node)  # pyright: ignore[reportUnknownMemberType]


def _folder(config: pytest.Config) -> Path:
    chosen: str | None = config.getoption("simd_folder")
    if chosen:
        return Path(chosen).absolute()
    junit: str | None = getattr(config.option, "xmlpath", None)
    beside = Path(os.path.expanduser(os.path.expandvars(junit))).parent if junit else Path()
    return (beside / "simd-results").absolute()


def _is_worker(config: pytest.Config) -> bool:
    """Whether it is a process of pytest-xdist that another one started."""
    return hasattr(config, "workerinput")
