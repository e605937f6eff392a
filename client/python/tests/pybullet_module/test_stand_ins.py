"""What stands in for PyBullet's other modules, and for what old scripts call otherwise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import simd_client.pybullet as pybullet
from simd_client.pybullet.bullet_client import BulletClient

from .conftest import BENCH_ARM, SEVEN_ARM


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


def test_a_script_that_imports_pybullets_helpers_gets_ours(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import sys, pybullet, pybullet_data\n"
        "from pybullet_utils import bullet_client\n"
        "import pybullet_utils.bullet_client as again\n"
        "client = bullet_client.BulletClient(connection_mode=pybullet.DIRECT)\n"
        f"arm = client.loadURDF({str(BENCH_ARM)!r}, useFixedBase=1)\n"
        "print(pybullet.__name__, again is bullet_client, client.getNumJoints(arm), sys.argv, __name__)\n"
    )
    ran = subprocess.run(
        [sys.executable, "-m", "simd_client.pybullet", "--new", str(script), "--fast", "7"],
        capture_output=True,
        text=True,
        timeout=60,
        env=dict(os.environ),
    )
    assert ran.stdout == f"simd_client.pybullet True 1 {[str(script), '--fast', '7']} __main__\n", ran.stderr


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
