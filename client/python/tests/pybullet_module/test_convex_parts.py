"""Meshes that are divided into convex parts, compared with PyBullet."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]


def beam(folder: Path) -> Path:
    """An L of two boxes: 1 by 0.2 by 0.2 m, and 0.2 by 0.2 by 0.8 m upon its end. Its volume is 0.072 m^3."""
    outline = [(0, 0), (1, 0), (1, 0.2), (0.2, 0.2), (0.2, 1), (0, 1)]
    front = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    lines = [f"v {x} 0 {z}" for x, z in outline] + [f"v {x} 0.2 {z}" for x, z in outline]
    faces = [(a, b, c) for a, b, c in front] + [(c + 6, b + 6, a + 6) for a, b, c in front]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, i + 6, j), (j, i + 6, j + 6)]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (folder / "beam.obj").write_text("\n".join(lines) + "\n")
    return folder / "beam.obj"


def parts(file: Path) -> list[tuple[Array, list[tuple[int, int, int]]]]:
    """Vertices and triangles of each object of an OBJ file."""
    found: list[tuple[list[list[float]], list[tuple[int, int, int]]]] = []
    count = 0
    for line in file.read_text().splitlines():
        kind, *rest = line.split()
        if kind == "o":
            count += len(found[-1][0]) if found else 0
            found.append(([], []))
        elif kind == "v":
            found[-1][0].append([float(each) for each in rest])
        elif kind == "f":
            a, b, c = (int(each) - 1 - count for each in rest)
            found[-1][1].append((a, b, c))
    return [(np.array(vertices), triangles) for vertices, triangles in found]


def volume(vertices: Array, triangles: list[tuple[int, int, int]]) -> float:
    return abs(sum(float(np.dot(vertices[a], np.cross(vertices[b], vertices[c]))) for a, b, c in triangles)) / 6.0


def test_a_mesh_is_written_as_convex_parts_as_pybullet_writes_it(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    mesh = beam(tmp_path)
    for p in (bullet, script):
        out, log = tmp_path / f"{p.__name__}.obj", tmp_path / f"{p.__name__}.txt"
        assert p.vhacd(str(mesh), str(out), str(log)) is None
        assert log.read_text() != "" and out.read_text().startswith("o convex_0\nv ")
        found = parts(out)
        assert 2 <= len(found) <= 32
        corners = np.concatenate([vertices for vertices, _ in found])
        assert corners.min(axis=0) == pytest.approx([0, 0, 0], abs=0.04)
        assert corners.max(axis=0) == pytest.approx([1, 0.2, 1], abs=0.04)
        # The hull of all has 0.136 m^3.
        assert sum(volume(*part) for part in found) == pytest.approx(0.072, rel=0.15)
        for vertices, triangles in found:
            middle = vertices.mean(axis=0)
            for a, b, c in triangles:
                normal = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
                size = float(np.linalg.norm(normal))
                if size < 1e-9:
                    continue
                normal *= -1.0 if np.dot(normal, middle - vertices[a]) > 0 else 1.0
                # No corner of a convex part is outside of one of its faces. Six digits are written.
                assert float(((vertices - vertices[a]) @ (normal / size)).max()) < 2e-5
    # Each can load its own file, and the world is unchanged.
    assert script.getNumBodies() == 0
    shape = script.createCollisionShape(script.GEOM_MESH, fileName=str(tmp_path / f"{script.__name__}.obj"))
    assert script.createMultiBody(1, shape) == 0


def test_dividing_a_mesh_leaves_the_world_as_it_was(
    script: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script.setGravity(0, 0, -10)
    ball = script.createMultiBody(1, script.createCollisionShape(script.GEOM_SPHERE, radius=0.1), -1, [0.5, 0.1, 0.5])
    script.stepSimulation()
    before = script.getBasePositionAndOrientation(ball), script.getBaseVelocity(ball)
    script.vhacd(str(beam(tmp_path)), str(tmp_path / "out.obj"), str(tmp_path / "log.txt"), resolution=10_000)
    assert (script.getBasePositionAndOrientation(ball), script.getBaseVelocity(ball)) == before
    assert script.getContactPoints() == () and script.getNumBodies() == 1
    assert "resolution do nothing" in capsys.readouterr().err


def test_unusable_meshes_and_paths_are_refused(script: ModuleType, tmp_path: Path) -> None:
    mesh, out, log = str(beam(tmp_path)), str(tmp_path / "out.obj"), str(tmp_path / "log.txt")
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "none.obj").write_text("f 1 2 3\n")
    for arguments in (
        (str(tmp_path / "lost.obj"), out, log),
        (str(tmp_path / "none.obj"), out, log),
        (mesh, str(tmp_path / "no" / "out.obj"), log),
    ):
        with pytest.raises(script.error):
            script.vhacd(*arguments)
    assert script.getNumBodies() == 0
