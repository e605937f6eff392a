"""Makes `docs/demo.gif`, the moving picture of the README: an arm that knocks over a tower of boxes, drawn by `simd-camera`.

Needs a paused, empty daemon with a renderer: `simd --paused`, and `simd-camera`; `SIMD_ENDPOINT` says where it is. Needs pillow.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import simd_client
from simd_client import PictureLight, projection_matrix, view_matrix

REPOSITORY = Path(__file__).parents[3]
WIDTH, HEIGHT = 560, 350
FRAMES, FRAMES_A_SECOND = 75, 15
STEPS = 1000 // FRAMES_A_SECOND
COLORS = [(0.25, 0.45, 0.75), (0.85, 0.3, 0.25), (0.95, 0.8, 0.35)]


def main() -> None:
    """Loads the scene, sweeps the arm through the tower, and writes a frame every 67 steps of 1 ms."""
    view = view_matrix((1.55, -0.75, 0.95), (0.2, 0.2, 0.33))
    projection = projection_matrix(0.75, WIDTH / HEIGHT, 0.05, 20.0)
    frames: list[Image.Image] = []
    with simd_client.connect() as sim:
        sim.add_plane()
        arm = sim.load(REPOSITORY / "tests" / "assets" / "seven_arm", name="arm", fixed=True)
        for row in range(6):
            for column in range(2):
                place = (0.55, 0.25 + 0.101 * column, 0.05 + 0.1 * row)
                sim.add_box((0.1, 0.1, 0.1), mass=0.3, position=place, color=COLORS[(row + column) % 3])
        arm.set_positions([-0.7, 1.25, 0.0, -0.5, 0.0, 0.3, 0.0])
        sim.step(1500)
        for frame in range(FRAMES):
            if frame == 5:
                arm.set_positions([1.5, 1.25, 0.0, -0.5, 0.0, 0.3, 0.0])
            if frame == 45:
                arm.set_positions([-0.7, 0.4, 0.0, -1.2, 0.0, 0.3, 0.0])
            sim.step(STEPS)
            picture = sim.cameras.take(view, projection, WIDTH, HEIGHT, light=PictureLight(shadow=True))
            assert picture.color is not None
            frames.append(Image.fromarray(np.asarray(picture.color, dtype=np.uint8)))
    palette = frames[FRAMES // 3].quantize(colors=128)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    path = REPOSITORY / "docs" / "demo.gif"
    small[0].save(path, save_all=True, append_images=small[1:], duration=1000 // FRAMES_A_SECOND, loop=0, optimize=True)
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
