"""Replacements of PyBullet's other modules, and old names of functions."""

from __future__ import annotations

import gc
import inspect
import os
import site
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import simd_client.pybullet as pybullet
from simd_client.pybullet import connections, daemon_process, data, page
from simd_client.pybullet.bullet_client import BulletClient

from .conftest import BENCH_ARM, SEVEN_ARM

OTHERS = """
from pybullet_utils import bullet_client
import pybullet_utils.bullet_client as again
client = bullet_client.BulletClient(pybullet.DIRECT, options="--new")
client.setAdditionalSearchPath(pybullet_data.getDataPath())
bodies = [client.loadURDF(name) for name in ("plane.urdf", "cube.urdf", "sphere2.urdf")]
arm = client.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
print(pybullet.__name__, again is bullet_client, bodies, client.getNumJoints(arm))
try:
    client.loadURDF("r2d2.urdf")
except pybullet.error as refusal:
    print("pip install pybullet" in str(refusal))
client.disconnect()
"""


def test_each_bullet_client_has_a_world_of_its_own() -> None:
    first = BulletClient(pybullet.DIRECT, options="--new")
    second = BulletClient(pybullet.DIRECT, options="--new")
    arm = first.loadURDF(str(BENCH_ARM), useFixedBase=1)
    assert second.loadURDF(str(SEVEN_ARM), useFixedBase=1) == arm
    assert (first.getNumJoints(arm), second.getNumJoints(arm)) == (1, 7)
    assert first.POSITION_CONTROL == pybullet.POSITION_CONTROL
    first.disconnect()
    assert second.isConnected()
    second.disconnect()


def test_a_bullet_client_that_is_dropped_disconnects_and_not_in_a_process_that_was_forked() -> None:
    assert list(inspect.signature(BulletClient).parameters) == ["connection_mode", "hostName", "options"]
    client = BulletClient(pybullet.DIRECT, options="--new")
    number = client._client  # pyright: ignore[reportPrivateUsage]
    # This includes a function that needs no connection.
    assert client.isNumpyEnabled() == 1 and client.getAPIVersion() == pybullet.getAPIVersion()
    del client
    gc.collect()
    assert not pybullet.isConnected(number)
    forked = BulletClient(pybullet.DIRECT, options="--new")
    number = forked._client  # pyright: ignore[reportPrivateUsage]
    forked._pid += 1  # pyright: ignore[reportPrivateUsage]
    del forked
    gc.collect()
    assert pybullet.isConnected(number)
    # A number that belongs to another connection by now stays open.
    late = BulletClient(pybullet.DIRECT, options="--new")
    pybullet.disconnect(late._client)  # pyright: ignore[reportPrivateUsage]
    other = pybullet.connect(pybullet.DIRECT, options="--new")
    assert other == late._client  # pyright: ignore[reportPrivateUsage]
    del late
    gc.collect()
    assert pybullet.isConnected(other)
    for each in (number, other):
        pybullet.disconnect(each)
    with pytest.raises(pybullet.error):
        BulletClient(99)
    with pytest.raises(pybullet.error, match="no daemon"):
        BulletClient(pybullet.TCP, "tcp/127.0.0.1:1#missing")
    gc.collect()


def test_a_script_that_imports_pybullets_helpers_gets_ours(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import sys, pybullet, pybullet_data\n"
        "from pybullet_utils import bullet_client\n"
        "import pybullet_utils.bullet_client as again\n"
        "client = bullet_client.BulletClient(connection_mode=pybullet.DIRECT)\n"
        f"arm = client.loadURDF({str(BENCH_ARM)!r}, useFixedBase=1)\n"
        "print(pybullet.__name__, again is bullet_client, client.getNumJoints(arm), sys.argv, __name__)\n"
        "import runpy\n"
        "print('BulletClient' in runpy.run_module('pybullet_utils.bullet_client'))\n"
    )
    ran = subprocess.run(
        [sys.executable, "-m", "simd_client.pybullet", "--new", str(script), "--fast", "7"],
        capture_output=True,
        text=True,
        timeout=60,
        env=dict(os.environ),
    )
    assert ran.stdout == f"simd_client.pybullet True 1 {[str(script), '--fast', '7']} __main__\nTrue\n", ran.stderr


def test_old_names_of_arguments_are_taken(script: ModuleType) -> None:
    arm = script.loadURDF(str(BENCH_ARM), 0, 0, 2)
    assert script.getLinkState(arm, 0)[4][2] > 2.0
    script.setJointMotorControl2(
        bodyIndex=arm, jointIndex=0, controlMode=script.VELOCITY_CONTROL, targetVelocity=1
    )
    script.stepSimulation()
    script.setJointMotorControl(arm, 0, script.POSITION_CONTROL, 0.25)
    for _ in range(200):
        script.stepSimulation()
    assert abs(script.getJointState(arm, 0)[0] - 0.25) < 1e-3


def test_star_imports_bring_pybullets_names_only() -> None:
    names: dict[str, object] = {}
    exec("from simd_client.pybullet import *", names)
    assert "loadURDF" in names and "GUI" in names and "error" in names
    assert "joints" not in names and "world" not in names


@pytest.fixture
def fresh(tmp_path: Path) -> dict[str, str]:
    """The environment of a Python that has this client, and none of PyBullet's packages."""
    packages = tmp_path / "packages"
    packages.mkdir()
    paths = [*os.environ.get("PYTHONPATH", "").split(os.pathsep), *site.getsitepackages()]
    for folder in (Path(path) for path in paths if path and Path(path).is_dir()):
        for entry in folder.iterdir():
            if not entry.name.startswith(("pybullet", "__pycache__")) and not (packages / entry.name).exists():
                (packages / entry.name).symlink_to(entry)
    environment = {name: value for name, value in os.environ.items() if name != "PYBULLET_DATA"}
    return {**environment, "PYTHONPATH": str(packages)}


@pytest.mark.parametrize("way", ["import", "runner"])
def test_without_pybullet_its_modules_exist_with_robots_of_simd(
    fresh: dict[str, str], tmp_path: Path, way: str
) -> None:
    first = "import simd_client.pybullet as pybullet" if way == "import" else "import pybullet"
    script = tmp_path / "script.py"
    script.write_text(f"{first}\nimport pybullet_data\n{OTHERS}")
    runner = ["-m", "simd_client.pybullet"] if way == "runner" else []
    # -S: without the packages of this environment, which may have PyBullet.
    ran = subprocess.run(
        [sys.executable, "-S", *runner, str(script)], capture_output=True, text=True, timeout=60, env=fresh
    )
    assert ran.stdout == "simd_client.pybullet True [0, 1, 2] 7\nTrue\n", ran.stderr


def test_the_installed_data_is_taken_before_ours(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("PYBULLET_DATA", raising=False)
    folder = tmp_path / "pybullet_data"
    folder.mkdir()
    (folder / "plane.urdf").write_text("<robot name='plane'><link name='plane'/></robot>")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert data.getDataPath() == str(folder)
    monkeypatch.setenv("PYBULLET_DATA", str(tmp_path))
    assert data.getDataPath() == str(tmp_path)
    monkeypatch.setenv("PYBULLET_DATA", str(tmp_path / "lost"))
    with pytest.raises(FileNotFoundError, match="is not a folder"):
        data.getDataPath()


def test_the_robots_of_ours_are_whole(script: ModuleType) -> None:
    script.setAdditionalSearchPath(str(data.OWN))
    for file in sorted(data.OWN.rglob("*.urdf")):
        body = script.loadURDF(str(file.relative_to(data.OWN)))
        fixed = "plane" in file.name
        assert (script.getDynamicsInfo(body, -1)[0] == 0.0) == fixed, file
        script.removeBody(body)


def test_a_page_is_shown_only_if_it_is_the_daemons_own(
    daemon: daemon_process.DaemonProcess, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert daemon.viewer is not None
    address, _, port = daemon.viewer.rpartition(":")
    # The port of the daemon is any free one, instead of the default.
    monkeypatch.setattr(page, "_PORT", int(port))
    name = daemon.endpoint.partition("#")[2]
    assert page.of("127.0.0.1", name) == f"{address}:{port}"
    assert page.of("127.0.0.1", "another") is None

    def is_there(address: str) -> bool:
        return bool(address)

    monkeypatch.setattr(page, "is_there", is_there)
    pybullet.disconnect(pybullet.connect(pybullet.GUI, endpoint=daemon.endpoint))
    assert f"look at the world at {daemon.viewer}/" in capsys.readouterr().err
    # Another daemon has the default port.
    number = pybullet.connect(pybullet.DIRECT, options="--new")
    other = connections.connected(number).wire.endpoint
    pybullet.disconnect(pybullet.connect(pybullet.GUI, endpoint=other))
    said = capsys.readouterr().err
    assert "look at the world" not in said and f"simctl --endpoint {other}" in said
    pybullet.disconnect(number)
