"""Daemons for the tests of `simd_client.pybullet`: each is separate, on free ports of this machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from daemon import IS_WIDE

import simd_client.pybullet as pybullet
from simd_client import embedded_link
from simd_client.pybullet import daemon_process, renderer
from simd_client.pybullet.daemon_process import DaemonProcess

REPOSITORY = Path(__file__).resolve().parents[4]
BENCH_ARM = REPOSITORY / "tests/assets/Bench_Arm-1.2 rev B/urdf/Bench_Arm-1.2 rev B.urdf"
SEVEN_ARM = REPOSITORY / "tests/assets/seven_arm/urdf/seven_arm.urdf"


# Properties of one hold for both.
WAYS = [
    pytest.param("--new", id="daemon"),
    pytest.param(
        "--embedded",
        id="embedded",
        marks=pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed"),
    ),
]


@pytest.fixture(scope="session", autouse=True)
def binary() -> str:
    """The daemon that the repository builds, unless SIMD_BINARY names another."""
    built = REPOSITORY / "target/debug/simd"
    found = os.environ.setdefault("SIMD_BINARY", str(built))
    if not Path(found).is_file():
        pytest.fail(f"{found} is not there: build it with `make build`, or name one with SIMD_BINARY")
    return found


@pytest.fixture(autouse=True)
def nothing_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No test connects to an unrelated running daemon, or starts a renderer that it does not name."""
    monkeypatch.delenv("SIMD_ENDPOINT", raising=False)
    monkeypatch.setenv(renderer.VARIABLE, str(tmp_path / "no renderer"))


# In these, others join the script's world: pages, renderers, clients.
WITH_OTHERS = {"test_debug_items", "test_pictures"}


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test of a script runs on a daemon, and on a world in this process."""
    if "script" in metafunc.fixturenames:
        ways = WAYS[:1] if metafunc.definition.path.stem in WITH_OTHERS else WAYS
        metafunc.parametrize("script", ways, indirect=True)


# These check numbers of motions and of files. The calls of a file's first test show that they reach a daemon; steps
# over a connection take ten times as long.
OF_NUMBERS = {
    "test_ball_joints",
    "test_bodies",
    "test_bullet_mjcf",
    "test_bullets_laws",
    "test_constraints",
    "test_contacts",
    "test_convex_parts",
    "test_dynamics",
    "test_filters",
    "test_inertias",
    "test_inverse_kinematics",
    "test_joint_info",
    "test_link_damping",
    "test_matrices",
    "test_mesh_places",
    "test_mjcf",
    "test_position_targets",
    "test_reactions",
    "test_scene",
    "test_sdf",
    "test_terrain_files",
    "test_torques",
    "test_valleys",
}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Only the first case of a test also runs on a daemon, and only the first test of a file of numbers: the others say
    nothing about the connection. `make wide` runs all."""
    if IS_WIDE or not embedded_link.is_installed():
        return
    seen: set[tuple[Path, str]] = set()
    kept: list[pytest.Item] = []
    more: list[pytest.Item] = []
    for item in items:
        way = item.callspec.params.get("script") if isinstance(item, pytest.Function) and hasattr(item, "callspec") else None
        of_what = "" if item.path.stem in OF_NUMBERS else getattr(item, "originalname", item.name)
        test = (item.path, of_what)
        is_twice = item.path.parent == Path(__file__).parent and item.path.stem not in WITH_OTHERS
        is_more = is_twice and way == "--new" and test in seen
        (more if is_more else kept).append(item)
        if way == "--new":
            seen.add(test)
    items[:] = kept
    config.hook.pytest_deselected(items=more)


@pytest.fixture
def script(request: pytest.FixtureRequest) -> Iterator[ModuleType]:
    """The module, connected as number 0 to a separate daemon, and to a world in this process."""
    assert pybullet.connect(pybullet.DIRECT, options=request.param) == 0
    yield pybullet
    for number in range(8):
        if pybullet.isConnected(number):
            pybullet.disconnect(number)


@pytest.fixture
def bullet() -> Iterator[Any]:
    """PyBullet itself, connected as its number 0 to a separate world."""
    real: Any = pytest.importorskip("pybullet", exc_type=ImportError)
    assert real.connect(real.DIRECT) == 0
    yield real
    if real.isConnected():
        real.disconnect()


@pytest.fixture
def daemon() -> Iterator[DaemonProcess]:
    """A daemon that runs before any script starts."""
    running = daemon_process.start()
    yield running
    for number in range(8):
        if pybullet.isConnected(number):
            pybullet.disconnect(number)
    running.end()
