#!/usr/bin/env python3
"""Pictures of `simd-camera` beside PyBullet's TinyRenderer: robots of pybullet_data, with the same matrices.

    target/python-venv/bin/python tests/reference/camera.py [--programs target/debug]

For each robot it prints the differences of depths away from edges, and how many pixels show another link.
It also prints pictures a second and processor time a picture; the processor draws both. Times are of
simd-camera alone, and of daemon, renderer and script together. Writes camera.md into target/camera, and
for each robot a picture with simd's on the left and PyBullet's on the right.

Both receive the same calls, `getCameraImage` of PyBullet and of `simd_client.pybullet`. TinyRenderer
samples a pixel at its lower left corner, and a GPU at its middle. simd's projection is moved by half a
pixel, so that both look along the same rays. A flag makes PyBullet use the colours of meshes, as simd
always does. r2d2 consists of primitives, which TinyRenderer draws with few corners: depths of its round
parts differ by that.
"""

from __future__ import annotations

import argparse
import os
import struct
import subprocess
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pybullet_data
import simd_client.pybullet as simd

REPOSITORY = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 640, 480
NEAR, FAR = 0.2, 6.0
"""Depths of the near and the far plane, metres."""
ROBOTS = {
    "kuka": ("kuka_iiwa/model.urdf", [0.0, 0.0, 0.6], 1.4),
    "panda": ("franka_panda/panda.urdf", [0.0, 0.0, 0.5], 1.3),
    "laikago": ("laikago/laikago_toes_zup.urdf", [0.0, 0.0, -0.1], 1.0),
    "husky": ("husky/husky.urdf", [0.0, 0.0, 0.2], 1.4),
    "racecar": ("racecar/racecar.urdf", [0.1, 0.0, 0.05], 0.6),
    "r2d2": ("r2d2.urdf", [0.0, 0.0, 0.0], 1.5),
}
"""The file, the camera's target, and its distance, metres."""
STEP = 0.02
"""Minimum difference of depth, metres, at which an edge lies between neighbours."""
BEND = 0.002
"""Minimum distance, metres, between a pixel's depth and the mean of two opposite neighbours, at which a
surface ends or bends."""
FRAMES = 40
"""Number of timed pictures."""


def main() -> None:
    """Compares all robots, and prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--programs", type=Path, default=REPOSITORY / "target" / "debug")
    parser.add_argument("--out", type=Path, default=REPOSITORY / "target" / "camera")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    lines = [
        "| robot | pixels of it | away from edges | worst depth mm | 99.9 % mm | depth off by 1 mm | other link | simd fps | TinyRenderer fps "
        "| simd-camera CPU ms | with daemon and script | TinyRenderer CPU ms |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    with Daemon(arguments.programs) as daemon:
        pybullet.connect(pybullet.DIRECT)
        simd.connect(simd.DIRECT, options=f"--endpoint={daemon.locator}")
        for name, (file, target, distance) in ROBOTS.items():
            lines.append(compare(daemon, name, file, target, distance, arguments.out))
            print(lines[-1], flush=True)
        simd.disconnect()
    text = "\n".join(lines) + "\n"
    (arguments.out / "camera.md").write_text(text)
    print(text)


class Daemon:
    """A separate daemon and renderer, which end with the script."""

    def __init__(self, programs: Path) -> None:
        flags = ["--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0", "--paused", "--until-stdin-closes"]
        self._daemon = subprocess.Popen([programs / "simd", *flags], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._daemon.stdout is not None
        _, _, places = self._daemon.stdout.readline().partition(" is listening on ")
        self.address, self.locator = places.strip().split(" and ")
        self._renderer = subprocess.Popen([programs / "simd-camera", "--endpoint", self.address])

    def __enter__(self) -> Daemon:
        return self

    def cost(self, draw: Callable[[], object]) -> Cost:
        """Returns the cost of a picture."""
        draw()
        processes = [self._renderer.pid, self._daemon.pid, os.getpid()]
        before = [processor_time(process) for process in processes]
        began = time.perf_counter()
        for _ in range(FRAMES):
            draw()
        seconds = time.perf_counter() - began
        used = [(processor_time(process) - start) / FRAMES * 1e3 for process, start in zip(processes, before, strict=True)]
        return Cost(FRAMES / seconds, used[0], used[2], sum(used))

    def __exit__(self, *_: object) -> None:
        for process in (self._renderer, self._daemon):
            process.terminate()
            process.wait()


def compare(daemon: Daemon, name: str, file: str, target: list[float], distance: float, out: Path) -> str:
    """Returns the table's line for a robot. It is alone in both worlds, in the pose in which it is loaded."""
    path = str(Path(pybullet_data.getDataPath()) / file)
    theirs = pybullet.loadURDF(path, useFixedBase=True, flags=pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL)
    ours = simd.loadURDF(path, useFixedBase=True)
    # Joints whose limits exclude 0 begin elsewhere in simd.
    for joint in range(pybullet.getNumJoints(theirs)):
        pybullet.resetJointState(theirs, joint, simd.getJointState(ours, joint)[0])
    view = pybullet.computeViewMatrixFromYawPitchRoll(target, distance, 50.0, -25.0, 0.0, 2)
    projection = pybullet.computeProjectionMatrixFOV(60.0, WIDTH / HEIGHT, NEAR, FAR)
    moved = list(projection)
    moved[8] -= 1.0 / WIDTH
    moved[9] -= 1.0 / HEIGHT
    flags = pybullet.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX
    first = Picture(pybullet.getCameraImage(WIDTH, HEIGHT, view, projection, flags=flags, renderer=pybullet.ER_TINY_RENDERER, shadow=0))
    second = Picture(asked(view, moved, flags))
    assert theirs == ours, "the two number their bodies alike"

    away = ~(first.edges() | second.edges())
    both = away & (first.bodies >= 0) & (second.bodies >= 0)
    errors = np.abs(first.depth - second.depth)[both] * 1e3
    other = int(np.count_nonzero(away & (first.bodies != second.bodies)))
    write_png(out / f"{name}.png", np.concatenate([second.colors, first.colors], axis=1))
    ours_cost = daemon.cost(lambda: simd.getCameraImage(WIDTH, HEIGHT, view, projection))
    tiny = pybullet.ER_TINY_RENDERER
    theirs_cost = daemon.cost(lambda: pybullet.getCameraImage(WIDTH, HEIGHT, view, projection, renderer=tiny, shadow=0))
    pybullet.resetSimulation()
    simd.resetSimulation()
    seen = int(np.count_nonzero(first.bodies >= 0))
    part = float(np.quantile(errors, 0.999)) if errors.size else 0.0
    worst = float(errors.max()) if errors.size else 0.0
    far = int(np.count_nonzero(errors > 1.0))
    depths = f"{worst:.3f} | {part:.3f} | {far}"
    rates = f"{ours_cost.rate:.1f} | {theirs_cost.rate:.1f} | {ours_cost.renderer:.1f} | {ours_cost.all:.1f} | {theirs_cost.script:.1f}"
    return f"| {name} | {seen} | {int(np.count_nonzero(both))} | {depths} | {other} | {rates} |"


def asked(view: Any, projection: Any, flags: int) -> Any:
    """Returns simd's picture, once the renderer is ready."""
    for _ in range(200):
        answer = simd.getCameraImage(WIDTH, HEIGHT, view, projection, flags=flags, shadow=0)
        if np.any(np.asarray(answer[4]) >= 0):
            return answer
        time.sleep(0.05)
    raise SystemExit("simd-camera draws nothing: see what it says above")


@dataclass(frozen=True)
class Cost:
    """Pictures a second, and processor milliseconds a picture: of the renderer, of this script, of all."""

    rate: float
    renderer: float
    script: float
    all: float


def processor_time(process: int) -> float:
    """Returns the processor seconds that a process has used, as the system counts them: in hundredths."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Picture:
    """Answer of getCameraImage."""

    def __init__(self, answer: Any) -> None:
        _, _, colors, depth, bodies = answer
        self.colors = np.asarray(colors, dtype=np.uint8).reshape(HEIGHT, WIDTH, 4)[:, :, :3]
        buffer = np.asarray(depth, dtype=np.float64).reshape(HEIGHT, WIDTH)
        self.depth = FAR * NEAR / (FAR - (FAR - NEAR) * buffer)
        self.bodies = np.asarray(bodies, dtype=np.int64).reshape(HEIGHT, WIDTH)

    def edges(self) -> Any:
        """Returns the pixels at edges. They have a neighbour of another link or of a depth that a surface
        does not span, or a surface ends or bends there. At such an edge within one link a pixel may belong
        to either side."""
        bends = np.zeros(self.bodies.shape, dtype=bool)
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            before, after = (np.roll(self.depth, (sign * down, sign * right), (0, 1)) for sign in (1, -1))
            bends |= np.abs(0.5 * (before + after) - self.depth) > BEND
        edges = bends.copy()
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                bodies = np.roll(self.bodies, (down, right), (0, 1))
                depth = np.roll(self.depth, (down, right), (0, 1))
                edges |= (bodies != self.bodies) | (np.abs(depth - self.depth) > STEP)
                edges |= np.roll(bends, (down, right), (0, 1))
        return edges


def write_png(path: Path, pixels: Any) -> None:
    """Red, green and blue."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")]
    path.write_bytes(b"".join(data))


if __name__ == "__main__":
    main()
