"""State that a script keeps in its own process, and worlds in files, compared with PyBullet."""

from __future__ import annotations

import json
import struct
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from daemon import Daemon

from .conftest import BENCH_ARM, SEVEN_ARM


def test_user_data_is_kept_as_pybullet_keeps_it(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        assert p.addUserData(arm, "colour", "red") == 0
        assert p.addUserData(arm, "colour", "blue", linkIndex=2, visualShapeIndex=0) == 1
        assert p.getUserData(0) == b"red" and p.getUserData(7) is None
        assert (p.getUserDataId(arm, "colour"), p.getUserDataId(arm, "colour", 2, 0)) == (0, 1)
        assert (p.getUserDataId(arm, "size"), p.getNumUserData(arm)) == (-1, 2)
        assert p.getUserDataInfo(arm, 1) == (1, b"colour", arm, 2, 0)
        assert p.addUserData(arm, "colour", "green") == 0 and p.getUserData(0) == b"green"
        p.removeUserData(1)
        p.syncUserData()
        assert p.getNumUserData(arm) == 1
        for call in (
            lambda: p.getUserDataInfo(arm, 5),
            lambda: p.removeUserData(77),
            lambda: p.addUserData(99, "a", "b"),
        ):
            with pytest.raises(p.error):
                call()
        p.removeBody(arm)
        assert p.getUserData(0) is None


def test_a_picture_has_the_form_of_pybullets_of_an_empty_world(
    bullet: Any, script: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    view = script.computeViewMatrix([1, 1, 1], [0, 0, 0], [0, 0, 1])
    for arguments in ((4, 3), (2, 2, view, script.computeProjectionMatrixFOV(60, 1, 0.1, 10))):
        theirs, ours = bullet.getCameraImage(*arguments), script.getCameraImage(*arguments)
        assert ours[:2] == theirs[:2]
        for a, b in zip(theirs[2:], ours[2:], strict=True):
            assert (a.dtype, a.shape) == (b.dtype, b.shape)
            np.testing.assert_array_equal(a, b)
    for a, b in zip(bullet.renderImage(4, 3), script.renderImage(4, 3), strict=True):
        np.testing.assert_array_equal(a, b)
    assert capsys.readouterr().err.count("pictures are empty") == 1
    with pytest.raises(script.error):
        script.getCameraImage(0, 3)


def test_the_camera_is_where_it_was_put(bullet: Any, script: ModuleType) -> None:
    """PyBullet has no camera without a window: the test compares with its matrix for the same angles. No page
    is open."""
    script.resetDebugVisualizerCamera(3.0, 40.0, -20.0, [1, 2, 3])
    width, height, view, projection, up, forward, side, top, *rest = script.getDebugVisualizerCamera()
    assert (width, height, up, rest) == (1024, 768, (0.0, 0.0, 1.0), [40.0, -20.0, 3.0, (1.0, 2.0, 3.0)])
    theirs = bullet.computeViewMatrixFromYawPitchRoll([1, 2, 3], 3.0, 40.0, -20.0, 0, 2)
    assert view == pytest.approx(theirs, abs=1e-5)
    theirs = bullet.computeProjectionMatrixFOV(90.0, 1024 / 768, 0.01, 1000.0)
    assert projection == pytest.approx(theirs, abs=1e-5)
    # Rows of the view matrix are the camera's right, up and back.
    assert forward == pytest.approx([-view[2], -view[6], -view[10]], abs=1e-9)
    assert np.array(side) / (20000 * 4 / 3) == pytest.approx([view[0], view[4], view[8]], abs=1e-9)
    assert np.array(top) / 20000 == pytest.approx([view[1], view[5], view[9]], abs=1e-9)


def test_plugins_are_answered_as_where_they_are_not_found(bullet: Any, script: ModuleType) -> None:
    for p in (bullet, script):
        assert p.loadPlugin("lost") == -1
        assert p.executePluginCommand(-1, "x", [1], [2.0]) == -1
        assert p.unloadPlugin(-1) is None
        assert p.setInternalSimFlags(0) is None


def test_a_saved_world_is_a_script_that_makes_it_again(
    bullet: Any, script: ModuleType, tmp_path: Path
) -> None:
    files = [tmp_path / name for name in ("theirs.py", "ours.py")]
    for p, file in zip((bullet, script), files, strict=True):
        p.setGravity(0, 0, -3)
        arm = p.loadURDF(str(SEVEN_ARM), [1, 2, 3], [0, 0, 0.6, 0.8], useFixedBase=1)
        p.resetJointState(arm, 3, 0.25)
        p.loadURDF(str(BENCH_ARM), [4, 5, 6])
        at = p.getBasePositionAndOrientation(1)[0]
        p.createConstraint(1, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], at)
        p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
        p.saveWorld(str(file))
    theirs, ours = (file.read_text().splitlines() for file in files)
    # The lines equal PyBullet's, and loading lines also have the arguments that it leaves out.
    assert len(ours) == len(theirs)
    numbers = str.maketrans("", "", "' ")
    for a, b in zip(theirs, ours, strict=True):
        if "loadURDF" in a:
            assert b.replace(", useFixedBase=1", "").translate(numbers).replace('"', "") == a.translate(numbers).replace('"', "")
        elif "createConstraint" in a:
            assert b.split("(")[0] == a.split("(")[0] and b.split(",[")[1:] == a.split(",[")[1:]
        else:
            assert b == a
    before = [script.getBasePositionAndOrientation(body) for body in (0, 1)]
    script.resetSimulation()
    # It connects again and disconnects at its end; here it continues in this world.
    lines = [line for line in files[1].read_text().splitlines() if "connect(" not in line]
    exec("\n".join(lines).replace("import pybullet as p", "cin = 0").replace("if (cin < 0):", ""), {"p": script})
    assert script.getNumBodies() == 2
    places = [script.getBasePositionAndOrientation(body) for body in (0, 1)]
    for (a, b), (c, d) in zip(before, places, strict=True):
        assert (*c, *d) == pytest.approx((*a, *b), abs=1e-5)
    assert script.getJointState(0, 3)[0] == pytest.approx(0.25, abs=1e-3)
    script.saveWorld(str(files[1]))
    with pytest.raises(script.error):
        script.saveWorld(str(tmp_path / "no" / "folder.py"))


def test_a_world_in_a_file_goes_on_from_there(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    for p in (bullet, script):
        p.setGravity(0, 0, -9.81)
        ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 5])
        for _ in range(10):
            p.stepSimulation()
        kept = p.getBasePositionAndOrientation(ball), p.getBaseVelocity(ball)
        file = str(tmp_path / "world.bullet")
        p.saveBullet(file)
        rows: list[Any] = []
        for _ in range(2):
            for _ in range(20):
                p.stepSimulation()
            rows.append(p.getBasePositionAndOrientation(ball))
            p.restoreState(fileName=file)
            assert (p.getBasePositionAndOrientation(ball), p.getBaseVelocity(ball)) == kept
        assert rows[0] == rows[1]
        for call in (lambda: p.restoreState(fileName=str(tmp_path / "lost")), lambda: p.restoreState(77)):
            with pytest.raises(p.error):
                call()
    with pytest.raises(script.error, match="Couldn't restore state"):
        (tmp_path / "not").write_text("a state")
        script.restoreState(fileName=str(tmp_path / "not"))


def records(file: Path) -> tuple[bytes, bytes, list[tuple[Any, ...]]]:
    """Names, kinds and rows of a log."""
    names, kinds, rest = file.read_bytes().split(b"\n", 2)
    packing = struct.Struct("<" + kinds.decode())
    length = packing.size + 2
    assert len(rest) % length == 0 and all(rest[at : at + 2] == b"\xaa\xbb" for at in range(0, len(rest), length))
    return names, kinds, [packing.unpack(rest[at + 2 : at + length]) for at in range(0, len(rest), length)]


MINITAUR = [f"motor_{a}_{b}{c}_joint" for a in ("front", "back") for b in ("left", "right") for c in "RL"]


def minitaur(folder: Path) -> Path:
    """A base with eight motors that have a Minitaur's names."""
    inertia = "<inertia ixx='0.01' iyy='0.02' izz='0.03' ixy='0' ixz='0' iyz='0'/>"
    inertial = f"<inertial><mass value='1'/>{inertia}</inertial>"
    text = f"<robot name='eight'><link name='base'>{inertial}</link>"
    for index, name in enumerate(MINITAUR):
        text += f"<link name='l{index}'>{inertial}</link><joint name='{name}' type='continuous'><parent link='base'/>"
        text += f"<child link='l{index}'/><origin xyz='{index} 0 0'/><axis xyz='0 1 0'/></joint>"
    (folder / "eight.urdf").write_text(text + "</robot>")
    return folder / "eight.urdf"


def test_a_minitaurs_log_is_pybullets(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    robot = str(minitaur(tmp_path))
    logs: list[Any] = []
    for p in (bullet, script):
        body = p.loadURDF(robot, [0, 0, 1], p.getQuaternionFromEuler([0.3, -0.2, 0.1]), flags=p.URDF_USE_INERTIA_FROM_FILE)
        p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
        for joint in range(8):
            p.resetJointState(body, joint, 0.1 * joint)
            p.setJointMotorControl2(body, joint, p.TORQUE_CONTROL, force=0)
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
        p.resetBaseVelocity(body, [0.5, 0, 0], [0, 0, 0])
        file = tmp_path / f"{p.__name__}.bin"
        number = p.startStateLogging(p.STATE_LOGGING_MINITAUR, str(file), [body])
        for _ in range(3):
            p.stepSimulation()
        p.stopStateLogging(number)
        p.stepSimulation()
        logs.append(records(file))
    (names, kinds, theirs), ours = logs
    assert ours[:2] == (names, kinds) and len(ours[2]) == len(theirs) == 3
    for a, b in zip(theirs, ours[2], strict=True):
        assert b == pytest.approx(a, abs=1e-3)
    with pytest.raises(script.error, match="a Minitaur has the joints"):
        arm = script.loadURDF(str(BENCH_ARM))
        script.startStateLogging(script.STATE_LOGGING_MINITAUR, str(tmp_path / "no"), [arm])


def test_a_log_of_contacts_is_pybullets(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    logs: list[Any] = []
    for p in (bullet, script):
        p.setGravity(0, 0, -9.81)
        ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[9, 9, 1]), -1, [0, 0, -1])
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        first, second = (p.createMultiBody(2, ball, -1, [x, 0, 0.1]) for x in (0, 3))
        for body in (ground, first, second):
            p.changeDynamics(body, -1, lateralFriction=0.5)
        files = [tmp_path / f"{p.__name__}{index}.bin" for index in range(3)]
        kind = p.STATE_LOGGING_CONTACT_POINTS
        numbers = [
            p.startStateLogging(kind, str(files[0])),
            p.startStateLogging(kind, str(files[1]), bodyUniqueIdA=second),
            p.startStateLogging(kind, str(files[2]), bodyUniqueIdA=first, bodyUniqueIdB=second),
        ]
        assert numbers == [0, 1, 2]
        for _ in range(120):
            p.stepSimulation()
        for number in numbers:
            p.stopStateLogging(number)
        logs.append([records(file) for file in files])
    for theirs, ours in zip(*logs, strict=True):
        assert ours[:2] == theirs[:2]
        assert {row[0] for row in ours[2]} == {row[0] for row in theirs[2]}
    # The last step: position, direction, and force, on either of the two sides.
    for index in (0, 1):
        theirs, ours = ([row for row in log[index][2] if row[0] == 119] for log in logs)
        assert len(theirs) == len(ours) == 2 - index
        for a, b in zip(sorted(theirs, key=lambda r: r[7]), sorted(ours, key=lambda r: r[7]), strict=True):
            assert b[1:3] == pytest.approx(a[1:3], abs=1e-5)
            swapped = b[3:5] != a[3:5]
            assert (b[3:5], b[5:7]) == ((a[4], a[3]) if swapped else a[3:5], (-1, -1))
            assert abs(b[15]) == pytest.approx(abs(a[15]), abs=1e-3)
            assert b[7:9] == pytest.approx(a[7:9], abs=1e-3)
            assert (b[16], b[17]) == pytest.approx((a[16], a[17]), abs=0.02)


def test_a_log_of_virtual_reality_without_any_is_pybullets(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    files = [tmp_path / f"{p.__name__}.bin" for p in (bullet, script)]
    for p, file in zip((bullet, script), files, strict=True):
        number = p.startStateLogging(p.STATE_LOGGING_VR_CONTROLLERS, str(file), deviceTypeFilter=p.VR_DEVICE_HMD)
        p.stepSimulation()
        p.stopStateLogging(number)
    theirs, ours = (file.read_bytes() for file in files)
    assert ours == theirs and ours.count(b"\n") == 2


def test_logs_that_only_bullet_can_write_are_accepted_or_refused(
    script: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def log(kind: int, name: str) -> str:
        number = script.startStateLogging(kind, str(tmp_path / name))
        script.stepSimulation()
        script.stopStateLogging(number)
        return capsys.readouterr().err

    said = log(script.STATE_LOGGING_VIDEO_MP4, "none") + log(script.STATE_REPLAY_ALL_COMMANDS, "none")
    assert not (tmp_path / "none").exists()
    assert "simd replay FILE" in said
    # A world in the process has no folder of recordings by default; a daemon has one.
    said = log(script.STATE_LOGGING_ALL_COMMANDS, "commands")
    assert (tmp_path / "commands").exists() != ("commands are not written" in said)
    with pytest.raises(NotImplementedError, match="robots, Minitaurs, contact points and commands"):
        script.startStateLogging(99, str(tmp_path / "none"))
    with pytest.raises(script.error, match="No such file"):
        script.startStateLogging(script.STATE_LOGGING_GENERIC_ROBOT, str(tmp_path / "no" / "log"))


def test_timings_are_a_trace_of_the_steps(script: ModuleType, tmp_path: Path) -> None:
    """File names are counted, as in Bullet: scripts look for the first."""
    logs = [script.startStateLogging(script.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / name)) for name in "ab"]
    for _ in range(3):
        script.stepSimulation()
    for log in logs:
        script.stopStateLogging(log)
    first, second = sorted(tmp_path.iterdir())
    assert [int(file.stem[2:]) for file in (first, second)] == [int(first.stem[2:]), int(first.stem[2:]) + 1]
    for file in (first, second):
        trace = json.loads(file.read_text())
        assert [event["name"] for event in trace["traceEvents"]] == ["stepSimulation"] * 3
        times = [(event["ts"], event["dur"]) for event in trace["traceEvents"]]
        assert all(dur > 0.0 for _, dur in times) and times == sorted(times)
    with pytest.raises(script.error, match="No such file"):
        script.startStateLogging(script.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "no" / "log"))


def test_a_log_of_commands_is_a_recording_that_replays(script: ModuleType, binary: str, tmp_path: Path) -> None:
    """The daemon's own check: `simd replay` ends with 0 if each step is equal to the bit."""
    (tmp_path / "kept").mkdir()
    with Daemon("--paused", "--recordings", str(tmp_path / "kept"), name="logs") as daemon:
        number = script.connect(script.DIRECT, options=f"--endpoint={daemon.endpoint}")
        file = tmp_path / "commandLog.bin"
        log = script.startStateLogging(script.STATE_LOGGING_ALL_COMMANDS, str(file), physicsClientId=number)
        script.setGravity(0, 0, -10, physicsClientId=number)
        arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1, physicsClientId=number)
        script.setJointMotorControl2(arm, 2, script.POSITION_CONTROL, 0.5, physicsClientId=number)
        for _ in range(20):
            script.stepSimulation(physicsClientId=number)
        script.stopStateLogging(log, physicsClientId=number)
        assert list((tmp_path / "kept").glob("*.mcap")) == []
        # Files outside the log's folder cannot be written.
        with pytest.raises(script.error, match="No such file"):
            script.startStateLogging(
                script.STATE_LOGGING_ALL_COMMANDS, str(tmp_path / "no" / "log"), physicsClientId=number
            )
        script.disconnect(number)
    ran = subprocess.run([binary, "replay", str(file)], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0 and "20" in ran.stdout, ran.stdout + ran.stderr
