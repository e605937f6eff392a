#!/usr/bin/env python3
"""Pictures of robots by PyBullet's TinyRenderer and MuJoCo's renderer, to be compared with the page.

    make pairs

It writes for each robot a picture of the peer into target/pairs, and pairs.json: each file with its
viewpoint. Then client/web/e2e/page.pairs.ts draws the same in the page, and puts both side by side: the
page on the left.

A flag makes PyBullet use the colours of a mesh's materials, as simd always does. MuJoCo draws with EGL.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from dataclasses import asdict, dataclass, field
from math import cos, radians, sin
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import numpy as np
import pybullet
import pybullet_data

REPOSITORY = Path(__file__).resolve().parents[2]
OUT = REPOSITORY / "target" / "pairs"
ASSETS = REPOSITORY / "tests" / "assets"
PYBULLET = Path(pybullet_data.getDataPath())
ROBOTS = Path(pybullet.__file__).resolve().parent / "cmeel.prefix/share/example-robot-data/robots"
"""Robots of the package example-robot-data."""
WIDTH, HEIGHT = 640, 480
FIELD = 38.0
"""Vertical field of view in degrees, as in the page."""
SUN = [1.2, 0.5, 2.4]
"""Direction towards the page's light."""


@dataclass
class Pair:
    """A robot and its viewpoint: angles in degrees, metres."""

    name: str
    peer: str
    path: Path
    target: list[float]
    distance: float
    around: float = 50.0
    above: float = 22.0
    root: Path = PYBULLET
    """Folder that the daemon may read."""
    joints: dict[str, float] = field(default_factory=dict)

    def position(self) -> list[float]:
        """Returns the camera's position, m."""
        around, above = radians(self.around), radians(self.above)
        way = [cos(above) * cos(around), cos(above) * sin(around), sin(above)]
        return [at + self.distance * part for at, part in zip(self.target, way, strict=True)]


def pairs() -> list[Pair]:
    """All pairs."""

    def bullet(name: str, path: str, target: list[float], distance: float, **more: object) -> Pair:
        return Pair(name, "pybullet", PYBULLET / path, target, distance, **more)

    def own(name: str, path: str, target: list[float], distance: float, peer: str = "pybullet", **more: object) -> Pair:
        return Pair(name, peer, ASSETS / path, target, distance, root=ASSETS, **more)

    anymal = ROBOTS / "anymal_c_simple_description/urdf/anymal.urdf"
    return [
        bullet("racecar", "racecar/racecar.urdf", [0.15, 0.0, 0.08], 1.0),
        bullet("soccerball", "soccerball.urdf", [0.0, 0.0, 0.0], 2.6),
        bullet("table", "table/table.urdf", [0.0, 0.0, 0.4], 3.2),
        bullet("laikago", "laikago/laikago_toes_zup.urdf", [0.0, 0.0, -0.15], 1.7),
        bullet("a1", "a1/a1.urdf", [0.0, 0.0, -0.1], 1.5, joints={f"{leg}_{part}": angle for leg in ("FR", "FL", "RR", "RL") for part, angle in (("upper_joint", 0.8), ("lower_joint", -1.6))}),
        bullet("panda", "franka_panda/panda.urdf", [0.1, 0.0, 0.45], 2.0, joints={"panda_joint2": -0.4, "panda_joint4": -2.0, "panda_joint6": 1.8}),
        bullet("iiwa", "kuka_iiwa/model.urdf", [0.0, 0.0, 0.6], 2.2, joints={"lbr_iiwa_joint_2": 0.5, "lbr_iiwa_joint_4": -1.2}),
        bullet("husky", "husky/husky.urdf", [0.0, 0.0, 0.2], 2.2),
        bullet("r2d2", "r2d2.urdf", [0.0, 0.0, 0.0], 2.0),
        bullet("duck", "duck_vhacd.urdf", [0.0, 0.0, 0.0], 0.4),
        own("scene", "textured/models/scene.xml", [0.1, 0.0, 0.25], 2.0, peer="mujoco"),
        own("humanoid", "humanoid/urdf/humanoid.urdf", [0.0, 0.0, 0.0], 3.4),
        own("textured", "textured/models/shape.xml", [0.0, 0.0, 0.0], 0.7, peer="mujoco"),
        Pair("anymal", "pybullet", anymal, [0.0, 0.0, -0.1], 2.2, root=ROBOTS.parents[1]),
    ]


def in_pybullet(pair: Pair) -> np.ndarray:
    """Rows of pixels, red, green and blue."""
    pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(str(PYBULLET))
    flags = pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL
    body = pybullet.loadURDF(str(pair.path), useFixedBase=True, flags=flags)
    for joint in range(pybullet.getNumJoints(body)):
        name = pybullet.getJointInfo(body, joint)[1].decode()
        if name in pair.joints:
            pybullet.resetJointState(body, joint, pair.joints[name])
    view = pybullet.computeViewMatrix(pair.position(), pair.target, [0, 0, 1])
    projection = pybullet.computeProjectionMatrixFOV(FIELD, WIDTH / HEIGHT, 0.05, 50)
    light = {"shadow": 1, "lightDirection": SUN, "lightDistance": 20, "renderer": pybullet.ER_TINY_RENDERER}
    image = pybullet.getCameraImage(WIDTH, HEIGHT, view, projection, **light)
    pybullet.disconnect()
    return np.reshape(image[2], (HEIGHT, WIDTH, 4))[:, :, :3].astype(np.uint8)


def in_mujoco(pair: Pair) -> np.ndarray:
    """Draws the picture with MuJoCo."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(pair.path))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    spec.visual.global_.fovy = FIELD
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = pair.target
    camera.distance = pair.distance
    # MuJoCo's azimuth is the camera's direction of view.
    camera.azimuth, camera.elevation = pair.around + 180.0, -pair.above
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render()


def written(path: Path, pixels: np.ndarray) -> None:
    """Returns a PNG."""
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    height, width, _ = pixels.shape

    def part(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", header) + part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b""))


def main() -> None:
    """Draws all pictures."""
    OUT.mkdir(parents=True, exist_ok=True)
    described = []
    for pair in pairs():
        pixels = in_pybullet(pair) if pair.peer == "pybullet" else in_mujoco(pair)
        written(OUT / f"{pair.name}-{pair.peer}.png", pixels)
        entry = {**asdict(pair), "path": str(pair.path), "root": str(pair.root), "position": pair.position()}
        described.append(entry)
        print(f"{pair.name}: {pair.peer}")
    (OUT / "pairs.json").write_text(json.dumps({"width": WIDTH, "height": HEIGHT, "pairs": described}, indent=1))


if __name__ == "__main__":
    main()
