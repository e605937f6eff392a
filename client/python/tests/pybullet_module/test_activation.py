"""ACTIVATION_STATE_*: which bodies may sleep."""

from __future__ import annotations

from types import ModuleType

import pytest

from simd_client import proto
from simd_client.proto import methods
from simd_client.pybullet.connections import connected


def test_a_body_whose_sleep_is_disabled_stays_awake_also_when_it_is_loaded_again(
    script: ModuleType, capfd: pytest.CaptureFixture[str]
) -> None:
    shape = script.createCollisionShape(script.GEOM_BOX, halfExtents=[0.1] * 3)
    cube = script.createMultiBody(1.0, shape, basePosition=[2, 0, 1])

    def awake() -> bool:
        world = connected(0)
        request = proto.GetLinkPropertiesRequest(robot=world.bodies[cube].robot)
        return world.wire.call(methods.GetLinkProperties, request).stays_awake

    assert not awake()
    script.changeDynamics(cube, -1, activationState=script.ACTIVATION_STATE_DISABLE_SLEEPING)
    assert awake()
    script.changeDynamics(cube, -1, activationState=script.ACTIVATION_STATE_WAKE_UP)
    assert awake()
    # Another mass loads it again.
    script.changeDynamics(cube, -1, mass=3)
    assert awake()
    script.changeDynamics(cube, -1, activationState=script.ACTIVATION_STATE_ENABLE_SLEEPING)
    assert not awake()
    script.changeDynamics(cube, -1, activationState=script.ACTIVATION_STATE_SLEEP)
    assert "ACTIVATION_STATE_SLEEP does nothing" in capfd.readouterr().err
