"""Torques of a script and its motors: in one step, together, and from a thread other than the
stepping one."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from simd_client.proto import methods
from simd_client.pybullet.connections import connected

from .test_restoring import arm

H = 1.0 / 240.0


def test_torques_of_one_step_add_up_as_in_pybullet(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    for p in (bullet, script):
        body = arm(p, tmp_path)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=24)
        p.setJointMotorControlArray(body, [0], p.TORQUE_CONTROL, forces=[12])
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=-6)
        p.stepSimulation()
        # v = h T / I, of 1 kg m^2.
        assert p.getJointState(body, 0)[1] == pytest.approx(30 * H)
        p.stepSimulation()
        assert p.getJointState(body, 0)[1] == pytest.approx(30 * H)


def test_a_state_saved_between_a_torque_and_its_step_keeps_the_torque(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    for p in (bullet, script):
        body = arm(p, tmp_path)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=24)
        p.saveState()
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=24)
        p.saveBullet(str(tmp_path / "world"))
        p.stepSimulation()
        assert p.getJointState(body, 0)[1] == pytest.approx(48 * H)
        p.saveState()
        p.stepSimulation()
        assert p.getJointState(body, 0)[1] == pytest.approx(48 * H)


def test_the_effort_of_a_joint_is_its_motors_as_in_pybullet(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    for p in (bullet, script):
        body = arm(p, tmp_path)
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, 0.0, force=500)
        efforts: list[float] = []
        for torque in (2.0, 3.0, 0.0):
            p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=torque)
            p.stepSimulation()
            efforts.append(p.getJointState(body, 0)[3])
            assert p.getJointStates(body, [0, 0])[1][3] == p.getJointStateMultiDof(body, 0)[3][0] == efforts[-1]
        p.stepSimulation()
        efforts.append(p.getJointState(body, 0)[3])
        # It holds the joint against the torque.
        assert efforts == pytest.approx([-2.0, -3.0, 0.0, 0.0], abs=0.02)


def test_a_torque_beyond_the_joints_own_limit_is_no_effort_of_its_motor(script: ModuleType, tmp_path: Path) -> None:
    # PyBullet ignores it, unless that is requested.
    for keeps_limits, most in ((False, 15.0), (True, 10.0)):
        connected(0).keeps_limits = keeps_limits
        body = arm(script, tmp_path, effort=10.0)
        script.setJointMotorControl2(body, 0, script.VELOCITY_CONTROL, force=0)
        script.setJointMotorControl2(body, 0, script.TORQUE_CONTROL, force=15)
        script.stepSimulation()
        _, velocity, _, effort = script.getJointState(body, 0)
        assert (velocity, effort) == (pytest.approx(most * H), 0.0)


@pytest.fixture
def during_steps(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], None]]:
    """Calls a function while the daemon is asked for a step, one for each step."""
    waiting: list[Callable[[], None]] = []
    wire = connected(0).wire
    call = wire.call

    def meanwhile(method: Any, request: Any, **options: Any) -> Any:
        if method is methods.StepSimulation and waiting:
            waiting.pop(0)()
        return call(method, request, **options)

    monkeypatch.setattr(wire, "call", meanwhile)
    return waiting


def in_another_thread(work: Callable[[], None]) -> Callable[[], None]:
    def run() -> None:
        thread = threading.Thread(target=work)
        thread.start()
        thread.join(10.0)
        assert not thread.is_alive()

    return run


def test_a_motor_that_another_thread_sets_during_a_step_acts_in_the_next(
    script: ModuleType, during_steps: list[Callable[[], None]], tmp_path: Path
) -> None:
    first, second = arm(script, tmp_path), arm(script, tmp_path)

    def command() -> None:
        script.setJointMotorControl2(first, 0, script.VELOCITY_CONTROL, targetVelocity=0.5)
        script.setJointMotorControl2(second, 0, script.VELOCITY_CONTROL, force=0)
        script.setJointMotorControl2(second, 0, script.TORQUE_CONTROL, force=24)

    script.setJointMotorControl2(first, 0, script.VELOCITY_CONTROL, targetVelocity=0.1)
    during_steps.append(in_another_thread(command))
    velocities: list[list[float]] = []
    for _ in range(3):
        script.stepSimulation()
        velocities.append([script.getJointState(body, 0)[1] for body in (first, second)])
    assert velocities[0] == pytest.approx([0.1, 0.0], abs=1e-3)
    assert velocities[1] == pytest.approx([0.5, 24 * H], abs=1e-3)
    assert velocities[2] == pytest.approx([0.5, 24 * H], abs=1e-3)


def test_motors_and_torques_of_a_step_that_was_refused_go_with_the_next(
    script: ModuleType, during_steps: list[Callable[[], None]], tmp_path: Path
) -> None:
    first, second = arm(script, tmp_path), arm(script, tmp_path)

    def refuse() -> None:
        script.setJointMotorControl2(second, 0, script.TORQUE_CONTROL, force=24)
        raise script.error("refused")

    script.setJointMotorControl2(first, 0, script.VELOCITY_CONTROL, targetVelocity=0.5)
    script.setJointMotorControl2(second, 0, script.VELOCITY_CONTROL, force=0)
    script.setJointMotorControl2(second, 0, script.TORQUE_CONTROL, force=24)
    during_steps.append(refuse)
    with pytest.raises(script.error, match="refused"):
        script.stepSimulation()
    script.stepSimulation()
    assert script.getJointState(first, 0)[1] == pytest.approx(0.5, abs=1e-3)
    assert script.getJointState(second, 0)[1] == pytest.approx(48 * H)
