"""Saved states are exported to files and imported into another process of the daemon."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
from daemon import Daemon

import simd_client
from simd_client import Robot, Simulation, Target, aio


def test_a_world_runs_on_in_another_process_to_the_same_bits(
    sim: Simulation, arm: Robot, tmp_path: Path
) -> None:
    sim.step(40, {arm: {"elbow joint": Target.position(0.8)}})
    kept = sim.save_state("mark")
    file = sim.export_saved_state(kept, tmp_path / "mark.simdstate")
    assert file == tmp_path / "mark.simdstate" and file.stat().st_size > 1000
    with Daemon(name="other") as another, simd_client.connect(another.endpoint) as other:
        other.pause()
        imported = other.import_saved_state(file)
        assert (imported.name, imported.robots, imported.stamp.step) == ("mark", 1, 40)
        assert other.robots == {}
        assert other.import_saved_state(file, "again").name == "again"
        other.restore_state("again")
        before, after = sim.step(200, states=True), other.step(200, states=True)
        np.testing.assert_array_equal(before["arm"].position, after["arm"].position)
        np.testing.assert_array_equal(before["arm"].effort, after["arm"].effort)
        for world in (sim, other):
            world.save_state("later")
            world.export_saved_state("later", tmp_path / world.name)
        assert (tmp_path / sim.name).read_bytes() == (tmp_path / other.name).read_bytes()


def test_other_files_than_saved_states_are_refused(sim: Simulation, arm: Robot, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"solid ascii")
    with pytest.raises(simd_client.InvalidSavedState, match="not a saved state of simd"):
        sim.import_saved_state(file)
    sim.export_saved_state(sim.save_state("mark"), file)
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(simd_client.InvalidSavedState, match="damaged"):
        sim.import_saved_state(file, "other")
    with pytest.raises(simd_client.SavedStateNotFound):
        sim.export_saved_state("never", file)
    with pytest.raises(FileNotFoundError):
        sim.import_saved_state(tmp_path / "none")


async def test_it_is_the_same_for_asyncio(daemon: Daemon, sim: Simulation, arm: Robot, tmp_path: Path) -> None:
    async with aio.connect(daemon.endpoint) as awaited:
        kept = await awaited.save_state("mark")
        file = await awaited.export_saved_state(kept, tmp_path / "mark")
        assert (await awaited.import_saved_state(file, "again")).name == "again"
        await awaited.restore_state("again")
        assert list(await awaited.robots) == ["arm"]


def test_an_export_that_fails_leaves_the_file_before(
    sim: Simulation, arm: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mark.simdstate"
    file.write_bytes(b"the one before")
    file.chmod(0o640)
    sim.save_state("mark")

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            sim.export_saved_state("mark", file)
    assert file.read_bytes() == b"the one before"
    assert list(tmp_path.iterdir()) == [file]
    sim.export_saved_state("mark", file)
    assert file.stat().st_size > 1000 and file.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [file]
