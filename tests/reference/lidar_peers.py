#!/usr/bin/env python3
"""Scans of a lidar of 16 by 1,024 rays in a room of 100,000 triangles: simd, `mj_multiRay` and PyBullet's
`rayTestBatch` in turns.

    target/reference-venv/bin/python tests/reference/lidar_peers.py [ROUNDS]

It builds the bench binary `peers`, which also makes the room. Each uses one thread, and all rays start at
one point. simd reads a lidar of a published state, including its tree of shapes. MuJoCo computes no
normals. PyBullet gets two calls from Python lists, whose creation is not timed.
"""

import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "peers"))

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
from in_pybullet import pybullet  # noqa: E402
from peers import build_worker  # noqa: E402
from rays import timed  # noqa: E402
from worker import Worker  # noqa: E402

START = (1.0, 0.5, 1.5)
ROWS, COLUMNS, REACH = 16, 1024, 100.0


def directions():
    """Row by row from the least vertical angle on, in the order of simd's lidar."""
    up, about = np.meshgrid(np.linspace(-0.26, 0.26, ROWS), np.linspace(-np.pi, np.pi, COLUMNS), indexing="ij")
    return np.stack([np.cos(up) * np.cos(about), np.cos(up) * np.sin(about), np.sin(up)], axis=-1).reshape(-1, 3)


def in_mujoco(room):
    mesh = f'<mesh name="room" file="{room}" inertia="shell"/>'
    geom = '<geom type="mesh" mesh="room" contype="0" conaffinity="0"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><asset>{mesh}</asset><worldbody>{geom}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    count = ROWS * COLUMNS
    start, ways = np.array(START), directions().ravel()
    geoms, found = np.zeros(count, np.int32), np.zeros(count)

    def call():
        mujoco.mj_multiRay(model, data, start, ways, None, 1, -1, geoms, found, None, count, REACH)

    return timed(call, lambda: np.where(found < 0, REACH, found))


def in_pybullet(room):
    on = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
    # Arrays of this many corners do not fit into its shared memory, so it reads the file.
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_MESH, fileName=str(room), flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH, **on)
    pybullet.createMultiBody(0, shape, **on)
    pybullet.performCollisionDetection(**on)
    starts = [list(START)] * (ROWS * COLUMNS)
    ends = (np.array(START) + REACH * directions()).tolist()
    half = len(starts) // 2
    found = []

    def call():
        # A call takes fewer than 16,384 rays.
        found[:half] = pybullet.rayTestBatch(starts[:half], ends[:half], numThreads=1, **on)
        found[half:] = pybullet.rayTestBatch(starts[half:], ends[half:], numThreads=1, **on)

    return timed(call, lambda: np.array([REACH * ray[2] for ray in found]))


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    with tempfile.TemporaryDirectory() as folder:
        worker = Worker(build_worker(), [], Path(folder))
        question = f"room {folder} 1 {START[0]} {START[1]} {START[2]}"
        ours = np.array(worker.ask(question)["distances"])
        room = Path(folder) / "room.stl"
        sides = {"MuJoCo": in_mujoco(room), "PyBullet": in_pybullet(room)}
        seconds = {"simd": []} | {name: [] for name in sides}
        for _ in range(rounds):
            seconds["simd"].append(worker.ask(question)["seconds"])
            for name, (batch, _) in sides.items():
                seconds[name].append(batch(1)[0])
        worker.close()
    count = ROWS * COLUMNS
    simd = np.array(seconds["simd"])
    print(f"{count} rays, {rounds} rounds; median (5 % to 95 %) of a scan, rays a second, simd's time to it")
    for name, taken in seconds.items():
        low, middle, high = np.percentile(np.array(taken) * 1e3, [5, 50, 95])
        ratio = np.median(simd / np.array(taken))
        print(f"  {name:9} {middle:8.2f} ms ({low:.2f} to {high:.2f})  {count / middle * 1e3:12,.0f}  {ratio:.3f}")
    for name, (_, theirs) in sides.items():
        print(f"  {(abs(theirs - ours) < 1e-3).mean():.2%} of the rays end within 1 mm of where they do in {name}")


if __name__ == "__main__":
    main()
