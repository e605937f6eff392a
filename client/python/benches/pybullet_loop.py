"""One turn of a PyBullet script's loop: simd compared with PyBullet DIRECT and PyBullet's shared memory.

    python benches/pybullet_loop.py [--turns 3000] [--robot robot.urdf]

simd runs as a daemon, and in this process with and without a served page. A turn sets the motors of all joints, steps and reads the joints'
states, like a controller's loop. A second run adds a box on a floor and reads the contact points. Each does
the same number of turns, in alternating blocks, so that other load on the machine affects all of them. Needs
PyBullet installed, perhaps the wheel `simd-embedded`, and a daemon to start: $SIMD_BINARY, or `simd` on the
PATH.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import simd_client.pybullet as simd
from simd_client import embedded_link

# It has no types.
bullet: Any = importlib.import_module("pybullet")

BLOCKS = 10
ROBOT = Path(__file__).resolve().parents[3] / "tests/assets/seven_arm/urdf/seven_arm.urdf"

# A server in a separate process, as scripts start one.
SERVER = """
import sys, time, pybullet
pybullet.connect(pybullet.SHARED_MEMORY_SERVER)
print("ready", flush=True)
while pybullet.isConnected():
    time.sleep(1.0)
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--turns", type=int, default=3000, help="turns of each kind")
    parser.add_argument("--robot", default=str(ROBOT), help="URDF with a joint that moves")
    asked = parser.parse_args()
    server = subprocess.Popen([sys.executable, "-c", SERVER], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        while "ready" not in server.stdout.readline():
            if server.poll() is not None:
                raise SystemExit("PyBullet's shared-memory server did not start")
        kinds: list[tuple[str, Any, int]] = [
            ("simd, a daemon of its own", simd, simd.connect(simd.DIRECT, options="--new")),
            ("PyBullet DIRECT", bullet, bullet.connect(bullet.DIRECT)),
            ("PyBullet SHARED_MEMORY", bullet, bullet.connect(bullet.SHARED_MEMORY)),
        ]
        if embedded_link.is_installed():
            # A script with a window serves its page and API.
            kinds.insert(1, ("the same, served", simd, simd.connect(simd.GUI, options="--embedded")))
            kinds.insert(1, ("simd, in this process", simd, simd.connect(simd.DIRECT, options="--embedded")))
        for with_contacts in (False, True):
            turns = [prepared(module, client, asked.robot, with_contacts) for _, module, client in kinds]
            times: list[list[float]] = [[] for _ in kinds]
            for _ in range(BLOCKS):
                for turn, taken in zip(turns, times, strict=True):
                    for _ in range(asked.turns // BLOCKS):
                        begin = time.perf_counter()
                        turn()
                        taken.append(time.perf_counter() - begin)
            what = "with contacts, microseconds" if with_contacts else "microseconds a turn"
            print(f"{what:28}{'p50':>10}{'p99':>10}{'worst':>10}")
            for (name, _, _), taken in zip(kinds, times, strict=True):
                cuts = statistics.quantiles(taken, n=100)
                print(f"{name:28}{cuts[49] * 1e6:10.0f}{cuts[98] * 1e6:10.0f}{max(taken) * 1e6:10.0f}")
        for _, module, client in kinds:
            module.disconnect(physicsClientId=client)
    finally:
        server.kill()
        server.wait()


def prepared(module: Any, client: int, robot: str, with_contacts: bool) -> Callable[[], None]:
    """Builds a robot on a fixed base, perhaps a box on a floor beside it, and its turn."""
    module.resetSimulation(physicsClientId=client)
    module.setGravity(0, 0, -9.81, physicsClientId=client)
    module.setTimeStep(0.0001, physicsClientId=client)
    arm = module.loadURDF(robot, [0, 0, 0], useFixedBase=1, physicsClientId=client)
    fixed = module.JOINT_FIXED
    count = module.getNumJoints(arm, physicsClientId=client)
    joints = [j for j in range(count) if module.getJointInfo(arm, j, physicsClientId=client)[2] != fixed]
    if with_contacts:
        floor = module.createCollisionShape(module.GEOM_PLANE, physicsClientId=client)
        module.createMultiBody(0, floor, -1, [0, 0, -1], physicsClientId=client)
        box = module.createCollisionShape(module.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1], physicsClientId=client)
        module.createMultiBody(1, box, -1, [3, 0, -0.9], physicsClientId=client)
    position, targets = module.POSITION_CONTROL, [0.3] * len(joints)

    def turn() -> None:
        module.setJointMotorControlArray(
            arm, joints, position, targetPositions=targets, physicsClientId=client
        )
        module.stepSimulation(physicsClientId=client)
        module.getJointStates(arm, joints, physicsClientId=client)
        if with_contacts:
            module.getContactPoints(physicsClientId=client)

    return turn


if __name__ == "__main__":
    main()
