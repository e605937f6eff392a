"""Height fields from pictures and tables, and height fields with new heights, compared with PyBullet."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

# Tolerance of rays onto triangles, metres.
NEAR = 1e-4


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(lines: list[bytes], width: int, depth: int, color: int, step: int, palette: bytes = b"") -> bytes:
    """A picture whose lines have the filters 0 to 4 in turn (PNG's specification, section 9)."""
    packed = bytearray()
    above = bytes(len(lines[0]))
    for y, line in enumerate(lines):
        kind = y % 5
        packed.append(kind)
        for i, value in enumerate(line):
            left = line[i - step] if i >= step else 0
            corner = above[i - step] if i >= step else 0
            up = above[i]
            ahead = left + up - corner
            nearest = min((left, up, corner), key=lambda each: abs(ahead - each))
            packed.append((value - (0, left, up, (left + up) // 2, nearest)[kind]) & 0xFF)
        above = line
    head = struct.pack(">IIBBBBB", width, len(lines), depth, color, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)
    data += chunk(b"PLTE", palette) if palette else b""
    middle = len(packed) // 2
    compressed = zlib.compress(bytes(packed))
    return data + chunk(b"IDAT", compressed[:middle]) + chunk(b"IDAT", compressed[middle:]) + chunk(b"IEND", b"")


def pictures(folder: Path) -> dict[str, Path]:
    """One of each kind of PNG, 7 wide and 6 high."""
    values = (np.arange(42).reshape(6, 7) * 53 % 256).astype(np.uint8)
    rgb = np.stack([values, 255 - values, values // 2], axis=2)
    alpha = np.concatenate([rgb, np.full((6, 7, 1), 200, np.uint8)], axis=2)
    nibbles = np.concatenate([values // 16, np.zeros((6, 1), np.uint8)], axis=1).reshape(6, 4, 2)
    small = nibbles[:, :, 0] * 16 + nibbles[:, :, 1]
    wide = np.stack([values, 255 - values], axis=2)
    # The colour of a number has another red than the number.
    colors = bytes(each for number in range(256) for each in (255 - number, 0, number))

    def lines(array: Any) -> list[bytes]:
        return [row.tobytes() for row in array.reshape(6, -1).astype(np.uint8)]

    made = {
        "grey": png(lines(values), 7, 8, 0, 1),
        "colours": png(lines(rgb), 7, 8, 2, 3),
        "alpha": png(lines(alpha), 7, 8, 6, 4),
        "sixteen_bits": png(lines(wide), 7, 16, 0, 2),
        "palette": png(lines(values), 7, 8, 3, 1, colors),
        "four_bits": png(lines(small), 7, 4, 0, 1),
        "four_bits_in_eight": png(lines(values // 16 * 17), 7, 8, 0, 1),
    }
    found: dict[str, Path] = {}
    for name, data in made.items():
        found[name] = folder / f"{name}.png"
        found[name].write_bytes(data)
    return found


def heights(p: Any, x: list[float], y: list[float]) -> list[float]:
    """Heights of hits of rays from above."""
    ends = [[a, b] for a in x for b in y]
    hits = p.rayTestBatch([[*end, 50.0] for end in ends], [[*end, -50.0] for end in ends])
    assert all(hit[0] >= 0 for hit in hits)
    return [hit[3][2] for hit in hits]


@pytest.mark.parametrize("kind", ["grey", "colours", "alpha", "palette"])
def test_a_picture_is_the_terrain_that_pybullet_makes_of_it(
    bullet: Any, script: ModuleType, tmp_path: Path, kind: str
) -> None:
    file = str(pictures(tmp_path)[kind])
    found: list[Any] = []
    for p in (bullet, script):
        shape = p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName=file, meshScale=[0.5, 0.25, 3.0])
        p.createMultiBody(0, shape)
        # Points of the grid, at which the division of its cells does not matter.
        found.append(heights(p, [-1.0, -0.5, 0.0, 0.5, 1.0], [-0.375, -0.125, 0.125, 0.375]))
    assert found[1] == pytest.approx(found[0], abs=NEAR)
    assert max(found[0]) - min(found[0]) > 1.0


@pytest.mark.parametrize("kinds", [("grey", "sixteen_bits"), ("four_bits_in_eight", "four_bits")])
def test_the_upper_eight_of_sixteen_bits_count_and_four_are_spread(
    script: ModuleType, tmp_path: Path, kinds: tuple[str, str]
) -> None:
    """PyBullet reads only eight bits."""
    found: list[Any] = []
    for kind in kinds:
        file = str(pictures(tmp_path)[kind])
        ground = script.createMultiBody(0, script.createCollisionShape(script.GEOM_HEIGHTFIELD, fileName=file))
        found.append(heights(script, [-1.9, 0.1, 2.1], [-1.3, 0.7]))
        script.removeBody(ground)
    assert found[0] == found[1] and len(set(found[0])) > 3


def test_a_table_is_the_terrain_that_pybullet_makes_of_it(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    square, wide = tmp_path / "square.txt", tmp_path / "wide.TXT"
    square.write_text("\n".join(",".join(f"{0.1 * x * x - 0.3 * y:.3f}" for x in range(5)) + "," for y in range(5)))
    wide.write_text("\n".join(",".join(f"{(x * 7 + y * 3) % 5}" for x in range(6)) + "," for y in range(4)))
    for file, x, y in ((square, [-0.5, 0.0, 0.5], [-1.0, 0.0, 1.0]), (wide, [-0.75, 0.25], [-0.5, 0.5])):
        found: list[Any] = []
        for p in (bullet, script):
            p.resetSimulation()
            shape = p.createCollisionShape(p.GEOM_HEIGHTFIELD, fileName=str(file), meshScale=[0.5, 1.0, 1.0])
            p.createMultiBody(0, shape)
            found.append(heights(p, x, y))
        assert found[1] == pytest.approx(found[0], abs=NEAR)


def test_terrain_gets_other_heights_in_place(bullet: Any, script: ModuleType) -> None:
    """The new heights are around the middle of the first ones, in Bullet too."""
    rows, columns = 5, 4
    first = [0.1 * x for _ in range(columns) for x in range(rows)]
    second = [0.1 * x * y for y in range(columns) for x in range(rows)]
    found: list[Any] = []
    for p in (bullet, script):
        size = {"meshScale": [0.5, 0.5, 1.0], "numHeightfieldRows": rows, "numHeightfieldColumns": columns}
        shape = p.createCollisionShape(p.GEOM_HEIGHTFIELD, heightfieldData=first, **size)
        ground = p.createMultiBody(0, shape)
        p.resetBasePositionAndOrientation(ground, [0.0, 0.0, 1.0], [0, 0, 0, 1])
        before = heights(p, [-0.5, 0.0, 0.5], [-0.25, 0.25])
        again = p.createCollisionShape(
            p.GEOM_HEIGHTFIELD, heightfieldData=second, replaceHeightfieldIndex=shape, **size
        )
        assert again == shape and p.getNumBodies() == 1
        found.append([*before, *heights(p, [-0.5, 0.0, 0.5], [-0.25, 0.25])])
    assert found[1] == pytest.approx(found[0], abs=NEAR)
    ball = script.createCollisionShape(script.GEOM_SPHERE, radius=1)
    for number, data, said in (
        (ball, second, "is not a height field"),
        (77, second, "is not a height field"),
        (shape, second[:8], "has 5 by 4 heights, and not 2 by 4"),
    ):
        count = len(data) // columns
        with pytest.raises(script.error, match=said):
            script.createCollisionShape(
                script.GEOM_HEIGHTFIELD,
                heightfieldData=data,
                numHeightfieldRows=count,
                numHeightfieldColumns=columns,
                replaceHeightfieldIndex=number,
            )


def test_files_that_are_no_terrain_are_refused(script: ModuleType, tmp_path: Path) -> None:
    whole = pictures(tmp_path)["colours"].read_bytes()
    huge = struct.pack(">IIBBBBB", 1 << 20, 1 << 20, 8, 0, 0, 0, 0)
    laced = struct.pack(">IIBBBBB", 7, 6, 8, 2, 0, 0, 1)
    begin = b"\x89PNG\r\n\x1a\n"
    for name, data, said in (
        ("cut.png", whole[:60], "is cut off"),
        ("short.png", begin + chunk(b"IHDR", whole[16:29]) + chunk(b"IDAT", zlib.compress(b"")), "fewer lines"),
        ("broken.png", begin + chunk(b"IHDR", whole[16:29]) + chunk(b"IDAT", b"nonsense"), "cannot be read"),
        ("huge.png", begin + chunk(b"IHDR", huge), "may have 4,000,000"),
        ("laced.png", begin + chunk(b"IHDR", laced), "interlaced"),
        ("empty.png", begin, "no size"),
        ("empty.txt", b"", "at least 2 by 2"),
        ("ragged.txt", b"1,2,3\n1,2\n", "as many numbers as the first"),
        ("words.txt", b"one,two\n", "could not convert"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(script.error, match=said):
            script.createCollisionShape(script.GEOM_HEIGHTFIELD, fileName=str(tmp_path / name))
    (tmp_path / "picture.jpg").write_bytes(b"\xff\xd8")
    with pytest.raises(NotImplementedError, match="from .png and .txt"):
        script.createCollisionShape(script.GEOM_HEIGHTFIELD, fileName=str(tmp_path / "picture.jpg"))
    with pytest.raises(script.error, match="Not found"):
        script.createCollisionShape(script.GEOM_HEIGHTFIELD, fileName="lost.png")
    with pytest.raises(script.error, match="needs heightfieldData"):
        script.createCollisionShape(script.GEOM_HEIGHTFIELD)
