"""Worlds of a Ray cluster of two nodes on this machine: the same bits whatever their number, and whatever node ends."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
from daemon import ASSETS
from ray.cluster_utils import Cluster

import simd_client
from simd_client import Control, Cost, Simulation, Variation
from simd_client.geometry import FloatArray
from simd_client.gymnasium import RobotVectorEnv
from simd_client.ray import Worlds

pytestmark = pytest.mark.filterwarnings("ignore")

MEMORY = 80 * 1024 * 1024
"""Bytes of each node's store of objects, about the least that Ray takes."""
EXAMPLE = Path(__file__).parents[1] / "examples" / "ray_worlds.py"
ARM = str(ASSETS / "seven_arm")
PARTS = np.array_split(np.random.default_rng(1).normal(0.0, 0.3, (96, 3, 7)), 12)
# Ray would give them the least share of a busy machine.
os.environ["RAY_worker_niceness"] = "0"
# The nodes' processes do not find this module.
ray.cloudpickle.register_pickle_by_value(sys.modules[__name__])


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Two nodes with two processors each. The program is on the first one."""
    nodes = {"num_cpus": 2, "object_store_memory": MEMORY, "include_dashboard": False}
    running = Cluster(initialize_head=True, head_node_args=nodes)
    try:
        running.add_node(**nodes)
        ray.init(address=running.address, log_to_driver=False)
        yield running
    finally:
        ray.shutdown()
        running.shutdown()


def arm() -> Simulation:
    """An arm above the ground, in a world of the actor's process."""
    sim = simd_client.connect("embedded", config={"paused": True})
    sim.load(ARM, "arm", fixed=True)
    return sim


def tried(sim: Simulation, part: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A rollout of some controls, and a simulation that leaves the world changed."""
    found = sim.rollout(
        50,
        [Control("arm", part, knot_steps=20)],
        variations=[Variation("link_masses", "arm", normal=(1.0, 0.1))],
        costs=[Cost.joint_efforts("arm")],
        seed=5,
    )
    sim.robots["arm"].set_positions(part[0, 0])
    sim.add_box((0.1, 0.1, 0.1), name="box")
    sim.step(20)
    assert sim.stamp.step == 20
    return found.costs, sim.robots["arm"].position


def bits(results: list[tuple[FloatArray, FloatArray]]) -> list[bytes]:
    return [each.tobytes() for pair in results for each in pair]


def alone() -> list[bytes]:
    """Results of a world of this process for each part."""
    found: list[tuple[FloatArray, FloatArray]] = []
    for part in PARTS:
        with arm() as sim:
            found.append(tried(sim, part))
    return bits(found)


def node_of(sim: Simulation, item: object) -> str:
    time.sleep(0.2)
    return ray.get_runtime_context().get_node_id()


def slowly(sim: Simulation, item: tuple[Path, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Says on which node it runs, and takes a moment."""
    folder, part = item
    (folder / ray.get_runtime_context().get_node_id()).touch()
    time.sleep(0.3)
    return tried(sim, part)


def test_any_number_of_worlds_has_the_bits_of_one(cluster: Any) -> None:
    expected = alone()
    for count in (1, 2, 4):
        with Worlds(arm, count) as worlds:
            assert bits(worlds.map(tried, PARTS)) == expected and len(worlds) == count
            # And once more, in the same worlds.
            assert bits(worlds.map(tried, PARTS)) == expected
            assert count == 1 or len(set(worlds.map(node_of, range(8)))) == 2, "both nodes have worlds"


@pytest.mark.parametrize("count", [2, 4])
def test_what_a_killed_node_had_is_done_elsewhere(cluster: Any, tmp_path: Path, count: int) -> None:
    expected = alone()
    (other,) = cluster.worker_nodes
    ended: list[str] = []

    def parts() -> Iterator[tuple[Path, FloatArray]]:
        for part in PARTS:
            yield tmp_path, part

    def kill_once_it_works() -> None:
        while not (tmp_path / other.node_id).exists():
            time.sleep(0.02)
        cluster.remove_node(other, allow_graceful=False)
        ended.append(other.node_id)

    killer = threading.Thread(target=kill_once_it_works)
    with Worlds(arm, count) as worlds:
        killer.start()
        assert bits(worlds.map(slowly, parts())) == expected
        killer.join()
        assert ended and set(worlds.map(node_of, range(4))) == {cluster.head_node.node_id}


def returns(envs: RobotVectorEnv, seed: int) -> FloatArray:
    """The rewards of random actions in some environments."""
    envs.reset(seed=seed)
    random = np.random.default_rng(seed)
    shape = (envs.num_envs, *envs.single_action_space.shape)
    return sum(envs.step(random.uniform(-1.0, 1.0, shape).astype(np.float32))[1] for _ in range(20))


def environments() -> RobotVectorEnv:
    return RobotVectorEnv("simd/Reacher-v0", 8)


def test_environments_are_mapped_over(cluster: Any) -> None:
    envs = environments()
    expected = [returns(envs, seed) for seed in range(6)]
    envs.close()
    for count in (1, 3):
        with Worlds(environments, count) as worlds:
            np.testing.assert_array_equal(worlds.map(returns, range(6)), expected)


def dies(sim: Simulation, item: int) -> int:
    if item == 2:
        os._exit(1)
    return item


def fails(sim: Simulation, item: int) -> int:
    return sim.robots["leg"].position.size


def no_world() -> Simulation:
    raise ValueError("there is no arm")


def test_errors_are_raised(cluster: Any) -> None:
    with Worlds(arm, 2) as worlds:
        with pytest.raises(simd_client.RobotNotFound, match="leg"):
            worlds.map(fails, range(3))
        with pytest.raises(ray.exceptions.RayActorError):
            worlds.map(dies, range(4), tries=2)
        assert worlds.map(node_of, []) == [] and len(worlds.map(node_of, range(2))) == 2
    with Worlds(no_world, 2) as worlds, pytest.raises(ray.exceptions.RayActorError, match="there is no arm"):
        worlds.map(tried, PARTS)
    with pytest.raises(ValueError, match="count=0"):
        Worlds(arm, 0)


def test_the_example_runs_on_it(cluster: Any) -> None:
    ran = subprocess.run(
        [sys.executable, str(EXAMPLE), "--worlds", "2", "--parts", "4"],
        env={**os.environ, "RAY_ADDRESS": cluster.address},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert ran.returncode == 0 and re.search(r"256 tries; the best is number \d+ with a cost of [\d.]+$", ran.stdout), ran
