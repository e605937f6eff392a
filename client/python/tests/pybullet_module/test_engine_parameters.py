"""setPhysicsEngineParameter, and motors in substeps, compared with PyBullet."""

from __future__ import annotations

import inspect
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from .test_restoring import arm


def parameters(p: Any) -> dict[str, float]:
    return dict(p.getPhysicsEngineParameters())


def test_parameters_have_pybullets_order_and_are_read_back(bullet: Any, script: ModuleType) -> None:
    seen: list[list[dict[str, float]]] = []
    for p in (bullet, script):
        p.setGravity(1, 2, -3)
        rows = [parameters(p)]
        p.setPhysicsEngineParameter(1 / 120, 30, 1, 0.02, 4)
        rows.append(parameters(p))
        # Negative values are ignored.
        p.setPhysicsEngineParameter(-1, -1, -1, -1, -1, numNonContactInnerIterations=0, erp=-1)
        rows.append(parameters(p))
        p.setPhysicsEngineParameter(numSubSteps=0, numSolverIterations=0, numNonContactInnerIterations=3)
        rows.append(parameters(p))
        p.resetSimulation()
        rows.append({name: parameters(p)[name] for name in ("numSolverIterations", "numNonContactInnerIterations")})
        for wrong in ({"unknown": 1}, {"fixedTimeStep": None}):
            with pytest.raises(TypeError):
                p.setPhysicsEngineParameter(**wrong)
        seen.append(rows)
    for ours, theirs in zip(seen[1], seen[0], strict=True):
        assert ours == pytest.approx(theirs)
    assert len(inspect.signature(script.setPhysicsEngineParameter).parameters) == 28


def test_motors_move_in_substeps_as_pybullets(bullet: Any, script: ModuleType, tmp_path: Path) -> None:
    """Gains are per substep, and so is the impulse that bounds them: of force times the whole step, and the first one."""
    found: list[list[float]] = []
    for p in (bullet, script):
        found.append([])
        towards, bounded, braked = (arm(p, tmp_path) for _ in range(3))
        p.setJointMotorControl2(towards, 0, p.POSITION_CONTROL, 0.5)
        p.setJointMotorControl2(bounded, 0, p.VELOCITY_CONTROL, targetVelocity=10, force=6)
        p.setPhysicsEngineParameter(numSubSteps=4)
        p.resetJointState(braked, 0, 0, 9)
        for _ in range(10):
            p.stepSimulation()
            found[-1] += [p.getJointState(towards, 0)[0], p.getJointState(bounded, 0)[1], p.getJointState(braked, 0)[1]]
        # PyBullet divides the impulse of a substep by the whole step.
        found[-1] += [p.getJointState(bounded, 0)[3], p.getJointStates(bounded, [0, 0])[1][3]]
        found[-1].append(p.getJointStateMultiDof(bounded, 0)[3][0])
        p.setPhysicsEngineParameter(numSubSteps=1)
        for _ in range(10):
            p.stepSimulation()
            found[-1] += [p.getJointState(towards, 0)[0], p.getJointState(bounded, 0)[1]]
    assert found[1] == pytest.approx(found[0], abs=2e-3)
    # v = n F t / I
    assert found[1][28] == pytest.approx(4 * 6 * 10 / 240, abs=1e-9)
