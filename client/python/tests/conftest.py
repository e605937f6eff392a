"""Shared fixtures of tests: one daemon, and a clean world in it for each test."""

from __future__ import annotations

import inspect
import signal
from collections.abc import Iterator

import numpy as np
import pytest
from daemon import ASSETS, Daemon

import simd_client
from simd_client import Integrator, Pace, Physics, Robot, Simulation, SurfaceCombination, embedded_link
from simd_client.pytest.worlds import empty


# A child of a shell's background job starts with SIGINT ignored, and so would all processes of the tests.
signal.signal(signal.SIGINT, signal.default_int_handler)


# Tests of these files check a world, however it is reached; the others check the network.
OVER_BOTH = {
    "test_attributes",
    "test_ball_joints",
    "test_batches",
    "test_callbacks",
    "test_claims",
    "test_constraints",
    "test_contacts",
    "test_joints",
    "test_kinematics",
    "test_motion",
    "test_over_time",
    "test_parameters",
    "test_queries",
    "test_robots",
    "test_rollouts",
    "test_sensors",
    "test_testing",
    "test_time",
    "test_trajectories",
    "test_view",
}
WAYS = [
    pytest.param("zenoh", id="zenoh"),
    pytest.param(
        "embedded",
        id="embedded",
        marks=pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed"),
    ),
]

# Settings of a daemon without options.
DEFAULTS = Physics(
    gravity=np.array([0.0, 0.0, -9.81]),
    time_step=0.001,
    substeps=1,
    real_time_factor=1.0,
    pace=Pace.REAL_TIME,
    integrator=Integrator.LEAPFROG,
    surface_combination=SurfaceCombination.MIN,
    sleeping=True,
)


@pytest.fixture(scope="session")
def daemon() -> Iterator[Daemon]:
    """One daemon for all tests that do not end it."""
    with Daemon("--paused") as running:
        yield running
        assert running.stop() == 0


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test of the world that asks for `sim` and not for a daemon runs over Zenoh, and over a world in this
    process."""
    asks = inspect.signature(metafunc.function).parameters
    name = metafunc.definition.path.stem
    if "sim" in metafunc.fixturenames and "daemon" not in asks and name in OVER_BOTH:
        metafunc.parametrize("sim", WAYS, indirect=True)


@pytest.fixture
def sim(request: pytest.FixtureRequest) -> Iterator[Simulation]:
    """A connection to a world that is empty, paused and at its defaults: a daemon's, unless the test runs over both."""
    if getattr(request, "param", "zenoh") == "embedded":
        with simd_client.connect("embedded", config={"paused": True}) as connected:
            yield connected
        return
    daemon: Daemon = request.getfixturevalue("daemon")
    with simd_client.connect(daemon.endpoint) as connected:
        cleaned(connected)
        yield connected


def cleaned(sim: Simulation) -> None:
    """Empties a world and restores its defaults."""
    empty(sim, DEFAULTS)


@pytest.fixture
def arm(sim: Simulation) -> Robot:
    """Two joints, `shoulder joint` and `elbow joint`, on a fixed base."""
    return sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
