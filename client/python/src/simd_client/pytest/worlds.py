"""Worlds for tests: in this process, or of a daemon that is started for them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from simd_client import connect, daemon_process
from simd_client.blocking.simulation import Simulation
from simd_client.daemon_process import DaemonProcess
from simd_client.embedded_link import flags
from simd_client.errors import SimdError
from simd_client.world import Physics

_LOG = "info,zenoh=error"


class World:
    """A world that tests use one after the other. It is opened for the first one, and again if one has ended
    it."""

    def __init__(self, folder: Path, config: Mapping[str, object], *, is_embedded: bool) -> None:
        """`folder` is for recordings and the daemon's log."""
        self._folder = folder
        self._config = {**config, "paused": True, "recording.directory": str(folder)}
        self._is_embedded = is_embedded
        self._daemon: DaemonProcess | None = None
        self._sim: Simulation | None = None
        self._physics: Physics | None = None
        # Bytes of the log before the test.
        self._logged = 0

    @property
    def sim(self) -> Simulation:
        """The connection of the running test."""
        if self._sim is None:
            raise RuntimeError("a test uses the world before it has begun")
        return self._sim

    def begin(self) -> Simulation:
        """Returns the world for the next test: empty, paused and at its defaults."""
        if self._sim is not None and self._sim.link.is_closed:
            self._sim = None
        if self._daemon is not None and not self._daemon.running():
            self.close()
        found = self._emptied() or self._opened()
        self._logged = self._log_bytes()
        return found

    def _emptied(self) -> Simulation | None:
        """Returns the world of the test before, as it was when it began. `None` if there is none, or if it cannot
        be emptied, for instance because a claim is left."""
        if self._physics is None or (self._sim is None and self._daemon is None):
            return None
        try:
            self._sim = self._sim or self._connected()
            empty(self._sim, self._physics)
        except SimdError:
            self.close()
            return None
        return self._sim

    def _opened(self) -> Simulation:
        self._sim = self._connected()
        self._physics = self._sim.physics
        return self._sim

    def end(self) -> None:
        """The test has ended, and its connection too, unless the world ends with it."""
        if self._sim is None or self._is_embedded:
            return
        if self._sim.link.is_closed:
            # The test closed it, and its recording still runs.
            self.close()
        else:
            self._sim.close()
            self._sim = None

    def close(self) -> None:
        """Ends the world."""
        if self._sim is not None:
            self._sim.close()
        if self._daemon is not None:
            self._daemon.end()
        self._sim = self._daemon = self._physics = None

    def log(self) -> str:
        """Returns the daemon's log since the test began; a world in this process has none."""
        try:
            with self._log_file.open("rb") as log:
                log.seek(self._logged)
                return log.read().decode(errors="replace")
        except OSError:
            return ""

    @property
    def _log_file(self) -> Path:
        return self._folder / "simd.log"

    def _log_bytes(self) -> int:
        return self._log_file.stat().st_size if self._log_file.exists() else 0

    def _connected(self) -> Simulation:
        if self._is_embedded:
            return connect("embedded", config=self._config)
        if self._daemon is None:
            program = daemon_process.binary()
            self._daemon = DaemonProcess(program, "pytest", ["--log", _LOG, *flags(self._config)], log=self._log_file)
        return connect(self._daemon.endpoint)


def empty(sim: Simulation, physics: Physics) -> None:
    """Empties a world, pauses it and restores its settings."""
    sim.pause()
    sim.reset(time=True, state=True, spawned=True)
    for saved_state in sim.saved_states():
        sim.delete_saved_state(saved_state)
    sim.parameters.remove()
    sim.view.delete()
    sim.set_physics(
        gravity=physics.gravity,
        time_step=physics.time_step,
        substeps=physics.substeps,
        real_time_factor=physics.real_time_factor,
        pace=physics.pace,
        integrator=physics.integrator,
        surface_combination=physics.surface_combination,
        sleeping=physics.sleeping,
    )
