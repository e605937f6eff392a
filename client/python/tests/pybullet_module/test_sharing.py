"""Scripts on a shared daemon: their changes, and the state that they leave."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

import simd_client
import simd_client.pybullet as p
from simd_client import embedded_link, endpoint
from simd_client.pybullet import connections, daemon_process, wire
from simd_client.pybullet.connections import connected
from simd_client.pybullet.daemon_process import DaemonProcess

from .conftest import BENCH_ARM, SEVEN_ARM


def test_in_a_world_without_robots_a_script_gets_pybullets_world(daemon: DaemonProcess) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        other.play()
        p.connect(p.DIRECT, endpoint=daemon.endpoint)
        physics = other.physics
        assert list(physics.gravity) == [0.0, 0.0, 0.0]
        assert physics.time_step == 1.0 / 240.0
        assert other.state is simd_client.SimulationState.PAUSED


def test_a_guest_leaves_the_world_as_it_is(daemon: DaemonProcess) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        other.load(SEVEN_ARM, name="theirs", fixed=True)
        before = other.physics
        p.connect(p.DIRECT, endpoint=daemon.endpoint)
        assert p.getNumBodies() == 1
        p.loadURDF(str(BENCH_ARM), useFixedBase=1)
        p.resetSimulation()
        assert list(other.robots) == ["theirs"]
        after = other.physics
        assert list(after.gravity) == list(before.gravity)
        assert after.time_step == before.time_step


def test_robots_stay_in_a_daemon_that_was_running_and_sliders_go(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    p.addUserDebugParameter("speed", 0, 1, 0.5)
    with simd_client.connect(daemon.endpoint) as other:
        assert list(other.parameters.all()) == ["speed"]
        p.disconnect()
        assert list(other.robots) == ["bench_arm"]
        assert list(other.parameters.all()) == []


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_direct_is_a_world_in_this_process_unless_a_daemon_is_named(daemon: DaemonProcess) -> None:
    number = p.connect(p.DIRECT)
    assert connected(number).wire.is_embedded
    assert p.isConnected(number) == 1
    other = p.connect(p.DIRECT, endpoint=daemon.endpoint)
    assert not connected(other).wire.is_embedded
    p.disconnect(number)
    assert p.isConnected(number) == 0


def test_each_world_of_direct_is_one_of_its_own(
    daemon: DaemonProcess, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Also if a daemon runs at the default address, and no world can be in this process."""
    for module in (endpoint, wire, connections):
        monkeypatch.setattr(module, "DEFAULT_ENDPOINT", daemon.endpoint.partition("#")[0])
    monkeypatch.setattr(embedded_link, "is_installed", lambda: False)
    first = p.connect(p.DIRECT)
    assert connected(first).wire.endpoint == daemon.endpoint
    p.loadURDF(str(BENCH_ARM), physicsClientId=first)
    second, third = p.connect(p.DIRECT), p.connect(p.DIRECT)
    assert len({connected(number).wire.endpoint for number in (first, second, third)}) == 3
    assert (p.getNumBodies(first), p.getNumBodies(second)) == (1, 0)
    said = capsys.readouterr().err
    assert said.count("another connection of this script has the daemon that runs; started ") == 2
    # A script shares the daemon if it names it, or asks for no separate world.
    shared = [p.connect(p.DIRECT, endpoint=daemon.endpoint), p.connect(p.SHARED_MEMORY)]
    assert [p.getNumBodies(number) for number in shared] == [1, 1]
    # If no daemon can be started, a message says so.
    monkeypatch.setenv("SIMD_BINARY", str(tmp_path / "lost"))
    last = p.connect(p.DIRECT)
    assert p.getNumBodies(last) == 1
    assert "this connection shares the world of another one of this script: SIMD_BINARY names" in capsys.readouterr().err


def test_a_daemon_that_was_started_ends_with_its_script() -> None:
    number = p.connect(p.DIRECT, options="--new")
    endpoint = connected(number).wire.endpoint
    p.disconnect(number)
    with pytest.raises(simd_client.Unavailable):
        simd_client.connect(endpoint, connect_timeout=1.0)


def test_a_killed_script_leaves_no_daemon_behind() -> None:
    code = (
        "import sys, simd_client.pybullet as p; p.connect(p.DIRECT, options='--new');"
        "print(p.connections._children[0].pid, flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as script:
        assert script.stdout is not None
        daemon = int(script.stdout.readline())
        # The holder of this end of the pipe notices the daemon's end: the daemon inherited no other end.
        script.kill()
        script.wait()
    assert ended(daemon)


def ended(process: int) -> bool:
    """Waits for a process that is not a child, for at most ten seconds."""
    try:
        watched = os.pidfd_open(process)
    except ProcessLookupError:
        return True
    import select

    ready, _, _ = select.select([watched], [], [], 10.0)
    os.close(watched)
    return bool(ready)


def test_two_scripts_and_another_client_share_a_world(daemon: DaemonProcess) -> None:
    first = p.connect(p.DIRECT, endpoint=daemon.endpoint)
    arm = p.loadURDF(str(BENCH_ARM), useFixedBase=1, physicsClientId=first)
    second = p.connect(p.DIRECT, endpoint=daemon.endpoint)
    assert p.getNumBodies(second) == 1
    # A separate daemon, out of the first one's reach.
    other = p.loadURDF(str(SEVEN_ARM), [2, 0, 0], useFixedBase=1, physicsClientId=second)
    assert (arm, other) == (0, 1)
    assert p.getNumBodies(first) == 1
    p.syncBodyInfo(first)
    assert p.getNumBodies(first) == 2
    p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, 0.5, physicsClientId=first)
    p.setJointMotorControl2(other, 3, p.POSITION_CONTROL, 0.25, physicsClientId=second)
    for _ in range(600):
        p.stepSimulation(first)
        p.stepSimulation(second)
    assert p.getJointState(arm, 0, second)[0] == pytest.approx(0.5, abs=1e-3)
    assert p.getJointState(other, 3, first)[0] == pytest.approx(0.25, abs=1e-3)
    with simd_client.connect(daemon.endpoint) as client:
        assert client.robot("bench_arm").joints["shoulder"].position == pytest.approx(0.5, abs=1e-3)


def test_on_a_world_that_plays_motors_are_sent_at_once_and_states_arrive(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    arm = p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    p.setGravity(0, 0, -9.81)
    p.setRealTimeSimulation(1)
    p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, targetPosition=0.4)
    for _ in range(10_000):
        if abs(p.getJointState(arm, 0)[0] - 0.4) < 1e-3:
            break
        p.stepSimulation()
    assert p.getJointState(arm, 0)[0] == pytest.approx(0.4, abs=1e-3)
    p.setRealTimeSimulation(0)
    stopped = p.getJointState(arm, 0)
    assert p.getJointState(arm, 0) == stopped


def test_a_script_that_steps_goes_on_when_a_user_presses_play(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    arm = p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    with simd_client.connect(daemon.endpoint) as other:
        p.stepSimulation()
        other.play()
        p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, targetPosition=0.4)
        for _ in range(300):
            p.stepSimulation()
        assert p.getPhysicsEngineParameters()["useRealTimeSimulation"] == 1
        assert p.getJointState(arm, 0)[0] == pytest.approx(0.4, abs=1e-3)
        other.pause()
        p.stepSimulation()
        assert p.getPhysicsEngineParameters()["useRealTimeSimulation"] == 0


def test_a_daemon_that_was_named_and_is_not_there_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIMD_ENDPOINT", "tcp/127.0.0.1:1#missing")
    with pytest.raises(p.error, match="no daemon"):
        p.connect(p.DIRECT)


def test_without_a_program_to_start_the_error_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("SIMD_BINARY")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(p.error, match="SIMD_BINARY"):
        daemon_process.start()


def test_the_program_of_the_wheel_is_found_though_its_folder_is_not_on_the_path(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    # pip's form: paths of RECORD begin at the folder of packages.
    packages = tmp_path / "lib" / "site-packages"
    about = packages / "simd_daemon-0.1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: simd-daemon\nVersion: 0.1.0\n")
    (about / "RECORD").write_text("../../bin/simctl,,\n../../bin/simd,,\n")
    (tmp_path / "bin").mkdir()
    program, other = tmp_path / "bin" / "simd", tmp_path / "simd"
    other.touch(mode=0o755)
    monkeypatch.delenv("SIMD_BINARY")
    monkeypatch.syspath_prepend(packages)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert daemon_process.binary() == other, "what is listed is not there"
    program.touch(mode=0o755)
    assert daemon_process.binary() == program
    monkeypatch.setenv("SIMD_BINARY", str(other))
    assert daemon_process.binary() == other


def test_robots_go_where_the_script_asks_for_it(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint, options="--remove-robots")
    p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    p.disconnect()
    with simd_client.connect(daemon.endpoint) as other:
        assert list(other.robots) == []


def test_after_a_restored_state_a_motor_has_its_friction_again(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    arm = p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    kept = p.saveState()

    def friction() -> float:
        """The daemon's value: a connection caches its own."""
        with simd_client.connect(daemon.endpoint) as other:
            return other.robots["bench_arm"].layout.joints[0].friction

    def brake() -> None:
        """A motor that brakes in addition to a torque is friction."""
        p.setJointMotorControl2(arm, 0, p.VELOCITY_CONTROL, force=3.0)
        p.setJointMotorControl2(arm, 0, p.TORQUE_CONTROL, force=1.0)
        p.stepSimulation()

    own = friction()
    brake()
    assert friction() == own + 3.0
    p.restoreState(kept)
    assert friction() == own
    brake()
    assert friction() == own + 3.0


def test_a_step_is_logged_once_also_where_another_client_paused_the_world(daemon: DaemonProcess, tmp_path: Path) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        number = p.connect(p.DIRECT, endpoint=daemon.endpoint)
        p.loadURDF(str(BENCH_ARM), useFixedBase=1)
        p.setRealTimeSimulation(1)
        log = p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, str(tmp_path / "log"))
        other.pause()
        steps = 0
        while connected(number).playing:
            p.stepSimulation()
            steps += 1
        p.stopStateLogging(log)
        _names, kinds, records = (tmp_path / "log").read_bytes().split(b"\n", 2)
        length = 2 + struct.calcsize("<" + kinds.decode())
        assert len(records) == steps * length


def settings(daemon: DaemonProcess) -> tuple[float, float, simd_client.SimulationState]:
    with simd_client.connect(daemon.endpoint) as other:
        physics = other.physics
        return physics.time_step, float(physics.gravity[2]), other.state


def combination(daemon: DaemonProcess) -> simd_client.SurfaceCombination:
    with simd_client.connect(daemon.endpoint) as other:
        return other.physics.surface_combination


def test_an_owners_settings_go_with_its_robots(daemon: DaemonProcess) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        other.play()
    before = settings(daemon)
    assert before == (0.001, -9.81, simd_client.SimulationState.PLAYING)
    p.connect(p.DIRECT, endpoint=daemon.endpoint, options="--remove-robots")
    p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    p.setGravity(0, 0, -1)
    p.setTimeStep(0.01)
    assert settings(daemon) == (0.01, -1.0, simd_client.SimulationState.PAUSED)
    assert combination(daemon) is simd_client.SurfaceCombination.MULTIPLY
    p.disconnect()
    assert settings(daemon) == before
    assert combination(daemon) is simd_client.SurfaceCombination.MIN


def test_settings_of_other_clients_stay(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    p.setGravity(0, 0, -1)
    with simd_client.connect(daemon.endpoint) as other:
        other.set_physics(gravity=(0, 0, -3.7))
    p.disconnect()
    assert settings(daemon)[:2] == (0.001, -3.7)


def test_settings_that_stay_with_robots_are_said(
    daemon: DaemonProcess, capsys: pytest.CaptureFixture[str]
) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    p.loadURDF(str(BENCH_ARM), useFixedBase=1)
    p.disconnect()
    said = capsys.readouterr().err
    assert "a time step of 0.00416667 s, Bullet's laws, products of frictions and gravity (0, 0, 0); " in said
    assert "before it had a time step of 0.001 s, leapfrog, the smaller of two frictions" in said
    assert settings(daemon)[:2] == (1 / 240, 0.0)
    # The next one is a guest of those robots, and changes nothing at its end.
    p.connect(p.DIRECT, endpoint=daemon.endpoint, options="--remove-robots")
    p.disconnect()
    assert settings(daemon)[:2] == (1 / 240, 0.0)


def test_a_script_whose_daemon_is_gone_disconnects(daemon: DaemonProcess) -> None:
    p.connect(p.DIRECT, endpoint=daemon.endpoint)
    number = p.connect(p.DIRECT, endpoint=daemon.endpoint)
    daemon.end()
    p.disconnect(number)
    p.disconnect()
    assert not p.isConnected()
