"""Rerun's own reader opens a recording as it is, with the values that the daemon had."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from daemon import ASSETS, Daemon
from rerun.chunk import McapReader

import simd_client
from simd_client import Target


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[int, Any]]:
    """A recording, and the states that the daemon had, by the microsecond."""
    folder = tmp_path_factory.mktemp("recordings")
    states: dict[int, Any] = {}
    with (
        Daemon("--paused", "--recordings", str(folder), name="rerun") as daemon,
        simd_client.connect(daemon.endpoint) as sim,
    ):
        arm = sim.load(ASSETS / "Two Link.v2", "arm", fixed=True)
        with sim.record("run", rate=100):
            arm.joints["elbow joint"].set_target(Target.position(0.8))
            for _ in range(200):
                step = sim.step(1, states=True)
                states[round(step.stamp.sim_time * 1e6)] = step["arm"]
    return folder / "run.mcap", states


def rows(path: Path, topic: str, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Some columns of what Rerun has of a topic, in the order of the file."""
    for chunk in McapReader(path).stream().to_chunks():
        if chunk.entity_path != topic or chunk.is_static:
            continue
        batch = chunk.to_record_batch()
        yield from zip(*(batch.column(column) for column in columns), strict=True)


def micros(time: Any) -> int:
    """Simulated time of a stamp, which Arrow has in nanoseconds."""
    return round(time.value / 1000)


@pytest.mark.parametrize("quantity", ["position", "velocity", "effort"])
def test_joint_states_are_those_of_the_daemon(recorded: Any, quantity: str) -> None:
    path, states = recorded
    found = list(rows(path, f"/arm/joint_states/{quantity}", "ros2_timestamp", "SeriesLines:names", "Scalars:scalars"))
    assert len(found) == 20
    for time, names, values in found:
        state = states[micros(time)]
        assert sorted(names.as_py()) == ["elbow joint", "shoulder joint"]
        for name, value in zip(names.as_py(), values.as_py(), strict=True):
            joint = state[name]
            plural = {"position": joint.positions, "velocity": joint.velocities, "effort": joint.efforts}
            assert value == plural[quantity][0]


def test_frames_are_those_of_the_daemon(recorded: Any) -> None:
    path, states = recorded
    columns = [f"Transform3D:{column}" for column in ("child_frame", "parent_frame", "quaternion")]
    found = [tuple(value.as_py()[0] for value in row) for row in rows(path, "/tf", *columns)]
    # Three links in each of twenty states; the root is in the world.
    assert len(found) == 60
    assert {child: parent for child, parent, _ in found} == {
        "arm/base_link": "world",
        "arm/upper arm": "arm/base_link",
        "arm/forearm": "arm/upper arm",
    }
    elbow = [quaternion for child, _, quaternion in found if child == "arm/forearm"]
    times = [micros(time) for (time,) in rows(path, "/arm/joint_states/position", "ros2_timestamp")]
    angles = [states[time]["elbow joint"].positions[0] for time in times]
    assert max(angles) - min(angles) > 0.1
    for angle, quaternion in zip(angles, elbow, strict=True):
        # From the first frame on it has turned about one axis, as far as its joint. Rerun keeps single precision.
        cosine = sum(a * b for a, b in zip(quaternion, elbow[0], strict=True))
        assert abs(cosine) == pytest.approx(abs(math.cos((angle - angles[0]) / 2)), abs=1e-6)


def test_the_robot_is_known_by_its_description(recorded: Any) -> None:
    path, _ = recorded
    entities = {chunk.entity_path for chunk in McapReader(path).stream().to_chunks()}
    assert any("visual_geometries/base_link" in entity for entity in entities)
