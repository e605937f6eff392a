"""The renderer that a script's first picture starts."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from simd_client.pybullet import renderer
from simd_client.pybullet.connections import connected

from .conftest import REPOSITORY

SIZE = (64, 48)


def can_draw() -> bool:
    """Whether `simd-camera` was built and this machine has a Vulkan driver, as `make vulkan` installs one."""
    drivers = [*Path("/usr/share/vulkan/icd.d").glob("*.json"), *filter(None, [os.environ.get("VK_DRIVER_FILES")])]
    return bool(drivers) and built().is_file()


def built() -> Path:
    return Path(os.environ.get("SIMD_BINARY", REPOSITORY / "target/debug/simd")).with_name("simd-camera")


def picture(p: Any, eye: list[float]) -> tuple[Any, Any, Any]:
    """Returns colours, depths and bodies, as seen from there towards the origin."""
    view = p.computeViewMatrix(eye, [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(60, SIZE[0] / SIZE[1], 0.1, 10.0)
    width, height, colors, depths, bodies = p.getCameraImage(*SIZE, view, projection)
    assert (width, height) == SIZE
    return colors, depths, bodies


def red_box(p: Any) -> int:
    half = [0.2, 0.2, 0.2]
    visual = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=[1, 0, 0, 1])
    return p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=half), visual)


def is_blank(seen: tuple[Any, Any, Any]) -> bool:
    colors, depths, bodies = seen
    return bool((colors == 255).all() and (depths == 1.0).all() and (bodies == -1).all())


@pytest.mark.skipif(not can_draw(), reason="simd-camera or a Vulkan driver is missing (make camera, make vulkan)")
def test_a_picture_is_drawn_by_a_renderer_that_ends_with_the_connection(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(renderer.VARIABLE, str(built()))
    box = red_box(script)
    colors, depths, bodies = picture(script, [2, 0, 0])
    red, green, blue, alpha = colors[SIZE[1] // 2, SIZE[0] // 2].tolist()
    assert red > 100 and green < 50 and blue < 50 and alpha == 255
    assert bodies[SIZE[1] // 2, SIZE[0] // 2] == box and bodies[0, 0] == -1
    # The near side is 1.8 m away.
    far, near = 10.0, 0.1
    metres = far * near / (far - (far - near) * float(depths[SIZE[1] // 2, SIZE[0] // 2]))
    assert metres == pytest.approx(1.8, abs=1e-3)
    script.resetBasePositionAndOrientation(box, [0, 5, 0], [0, 0, 0, 1])
    assert (picture(script, [2, 0, 0])[2] == -1).all()
    said = capfd.readouterr().err
    assert said.count("started simd-camera") == 1 and "empty" not in said, said
    process = connected(0).renderer.process
    assert process is not None and process.running()
    script.disconnect()
    assert not process.running()


@pytest.mark.skipif(not can_draw(), reason="simd-camera or a Vulkan driver is missing (make camera, make vulkan)")
def test_two_connections_have_a_renderer_each(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(renderer.VARIABLE, str(built()))
    other = script.connect(script.DIRECT, options="--new")
    box = script.createVisualShape(script.GEOM_BOX, halfExtents=[0.2] * 3, physicsClientId=other)
    script.createMultiBody(0.0, -1, box, physicsClientId=other)
    assert (picture(script, [2, 0, 0])[2] == -1).all()
    seen = script.getCameraImage(*SIZE, *matrices(script), physicsClientId=other)
    assert seen[4][SIZE[1] // 2, SIZE[0] // 2] == 0


def matrices(p: Any) -> tuple[Any, Any]:
    return p.computeViewMatrix([2, 0, 0], [0, 0, 0], [0, 0, 1]), p.computeProjectionMatrixFOV(60, SIZE[0] / SIZE[1], 0.1, 10.0)


def test_a_renderer_that_cannot_draw_is_started_once_and_its_reason_is_one_line(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    program = tmp_path / "simd-camera"
    program.write_text(f"#!/bin/sh\necho started >> {tmp_path}/starts\necho 'simd-camera: no Vulkan device is here' >&2\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv(renderer.VARIABLE, str(program))
    red_box(script)
    for _ in range(3):
        assert is_blank(picture(script, [2, 0, 0]))
    assert (tmp_path / "starts").read_text() == "started\n"
    said = capfd.readouterr().err
    assert said.count("no Vulkan device is here") == 1, said
    assert "simd: getCameraImage: pictures are empty: simd-camera: no Vulkan device is here" in said


def test_without_a_renderer_one_line_says_what_to_install(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.delenv(renderer.VARIABLE)
    monkeypatch.setenv("SIMD_BINARY", str(tmp_path / "simd"))
    monkeypatch.setenv("PATH", str(tmp_path))
    for _ in range(2):
        assert is_blank(picture(script, [2, 0, 0]))
    said = capfd.readouterr().err
    assert said.count("pictures are empty") == 1 and "simd_daemon-*.whl" in said, said


def test_the_renderer_beside_the_daemon_comes_before_the_one_on_the_path(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "path").mkdir()
    beside, on_path = tmp_path / "simd-camera", tmp_path / "path" / "simd-camera"
    for program in (beside, on_path):
        program.touch(mode=0o755)
    monkeypatch.delenv(renderer.VARIABLE)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.delenv("SIMD_BINARY")
    assert renderer.program() == on_path
    monkeypatch.setenv("SIMD_BINARY", str(tmp_path / "simd"))
    assert renderer.program() == beside
    monkeypatch.setenv(renderer.VARIABLE, str(on_path))
    assert renderer.program() == on_path


def test_pictures_of_pybullet_look_alike(bullet: Any, script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies and depths, except for pixels at edges."""
    if not can_draw():
        pytest.skip("simd-camera or a Vulkan driver is missing (make camera, make vulkan)")
    monkeypatch.setenv(renderer.VARIABLE, str(built()))
    seen: list[tuple[Any, Any, Any]] = []
    for p in (bullet, script):
        red_box(p)
        seen.append(picture(p, [1.5, 0.7, 0.9]))
    (_, theirs, their_bodies), (_, ours, our_bodies) = seen
    same = their_bodies == our_bodies
    assert same.mean() > 0.98
    np.testing.assert_allclose(ours[same], theirs[same], atol=2e-3)
