"""An environment of a learner: A1 on the ground at 240 Hz, simd in this process compared with PyBullet DIRECT.

    python benches/environment.py [--steps 4000]

A step sets twelve motors, steps, and reads the joints, the base and the contacts. Prints environment-steps a
second of each, in alternating blocks. Needs PyBullet, pybullet_data and the wheel `simd-embedded`.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import time
from collections.abc import Callable
from math import sin
from typing import Any

import simd_client.pybullet as simd

# They have no types.
bullet: Any = importlib.import_module("pybullet")
data: Any = importlib.import_module("pybullet_data")

BLOCKS = 10
# Hip, thigh and calf of each leg, rad: A1 stands.
STAND = (0.0, 0.9, -1.8) * 4


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--steps", type=int, default=4000, help="steps of each simulator")
    steps = max(1, parser.parse_args().steps // BLOCKS)
    kinds: list[tuple[str, Any, int]] = [
        ("simd, in this process", simd, simd.connect(simd.DIRECT, options="--embedded")),
        ("PyBullet DIRECT", bullet, bullet.connect(bullet.DIRECT)),
    ]
    environments = [environment(module, client) for _, module, client in kinds]
    rates: list[list[float]] = [[] for _ in kinds]
    for _ in range(BLOCKS):
        for step, of in zip(environments, rates, strict=True):
            begin = time.perf_counter()
            for number in range(steps):
                step(number)
            of.append(steps / (time.perf_counter() - begin))
    print(f"{'environment-steps a second':28}{'median':>10}{'lowest':>10}")
    for (name, module, client), of in zip(kinds, rates, strict=True):
        print(f"{name:28}{statistics.median(of):10.0f}{min(of):10.0f}")
        module.disconnect(physicsClientId=client)


def environment(module: Any, client: int) -> Callable[[int], None]:
    """A1 on a plane, and a step of it."""
    module.setAdditionalSearchPath(data.getDataPath(), physicsClientId=client)
    module.setGravity(0, 0, -9.81, physicsClientId=client)
    module.setTimeStep(1 / 240, physicsClientId=client)
    module.loadURDF("plane.urdf", physicsClientId=client)
    robot = module.loadURDF("a1/a1.urdf", [0, 0, 0.32], physicsClientId=client)
    count = module.getNumJoints(robot, physicsClientId=client)
    infos = [module.getJointInfo(robot, joint, physicsClientId=client) for joint in range(count)]
    joints = [info[0] for info in infos if info[2] == module.JOINT_REVOLUTE]
    if len(joints) != len(STAND):
        raise SystemExit(f"a1.urdf has {len(joints)} joints, and not {len(STAND)}")
    for joint, angle in zip(joints, STAND, strict=True):
        module.resetJointState(robot, joint, angle, physicsClientId=client)

    def step(number: int) -> None:
        wave = 0.1 * sin(0.1 * number)
        module.setJointMotorControlArray(
            robot,
            joints,
            module.POSITION_CONTROL,
            targetPositions=[angle + wave for angle in STAND],
            forces=[30.0] * len(joints),
            physicsClientId=client,
        )
        module.stepSimulation(physicsClientId=client)
        module.getJointStates(robot, joints, physicsClientId=client)
        module.getBasePositionAndOrientation(robot, physicsClientId=client)
        module.getContactPoints(bodyA=robot, physicsClientId=client)

    return step


if __name__ == "__main__":
    main()
