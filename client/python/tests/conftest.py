"""What tests share: one daemon, and a clean world in it for each test."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from daemon import ASSETS, Daemon

import simd_client
from simd_client import Robot, Simulation


# A child of a shell's background job is born with SIGINT ignored, and so would be all that the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def daemon() -> Iterator[Daemon]:
    """One for all tests that do not end it."""
    with Daemon("--paused") as running:
        yield running
        assert running.stop() == 0


@pytest.fixture
def sim(daemon: Daemon) -> Iterator[Simulation]:
    """A connection to a world that is empty, paused and at its defaults."""
    with simd_client.connect(daemon.endpoint) as connected:
        cleaned(connected)
        yield connected


def cleaned(sim: Simulation) -> None:
    """Empties a world and puts it back to its defaults."""
    sim.pause()
    sim.reset(time=True, state=True, spawned=True)
    for saved_state in sim.saved_states():
        sim.delete_saved_state(saved_state)
    sim.parameters.remove()
    sim.view.delete()
    sim.set_physics(
        gravity=(0, 0, -9.81),
        time_step=0.001,
        substeps=1,
        real_time_factor=1.0,
        pace="real_time",
        integrator="leapfrog",
    )


@pytest.fixture
def arm(sim: Simulation) -> Robot:
    """Two joints, `shoulder joint` and `elbow joint`, on a fixed base."""
    return sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
