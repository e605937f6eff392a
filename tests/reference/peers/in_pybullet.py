"""A scene in PyBullet, DIRECT: one `stepSimulation` a step, called from Python, as its users call it."""

import time

from quiet import pybullet, silence

TIME_STEP = 1e-3


def engine(scene, joints):
    """Returns a function from a number of steps to seconds and the largest error of a joint."""
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    pybullet.setTimeStep(TIME_STEP, physicsClientId=client)
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MERGE_FIXED_LINKS
    held = {joint["name"]: joint for joint in joints}
    robots = []
    for copy in range(scene.copies):
        place = (3.0 * (copy % 10), 3.0 * (copy // 10), 0.0)
        with silence():
            body = pybullet.loadURDF(
                str(scene.bare), place, useFixedBase=not scene.free, flags=flags, physicsClientId=client)
        names = {}
        for index in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            pybullet.changeDynamics(body, index, linearDamping=0, angularDamping=0, physicsClientId=client)
            if index >= 0:
                name = pybullet.getJointInfo(body, index, physicsClientId=client)[1].decode()
                if name in held:
                    names[index] = held[name]
        if len(names) != len(joints):
            raise RuntimeError(f"{scene.name}: PyBullet has {len(names)} of {len(joints)} joints")
        for index, joint in names.items():
            # Its motors are constraints: the gain is the part of an error that remains after a step, not a
            # stiffness.
            pybullet.setJointMotorControl2(
                body, index, pybullet.POSITION_CONTROL, targetPosition=joint["position"], targetVelocity=0,
                positionGain=0.3, velocityGain=1.0, force=joint["effort"] or 1e5, physicsClientId=client)
        pose = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        robots.append((body, names, pose))

    def put_back():
        for body, names, (place, turn) in robots:
            pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=client)
            pybullet.resetBaseVelocity(body, (0, 0, 0), (0, 0, 0), physicsClientId=client)
            for index, joint in names.items():
                pybullet.resetJointState(body, index, joint["position"], 0, physicsClientId=client)

    def error():
        largest = 0.0
        for body, names, _ in robots:
            states = pybullet.getJointStates(body, list(names), physicsClientId=client)
            errors = (abs(state[0] - joint["position"]) for state, joint in zip(states, names.values()))
            largest = max(largest, *errors)
        return largest

    def batch(steps):
        put_back()
        step = pybullet.stepSimulation
        for _ in range(steps // 10):
            step(physicsClientId=client)
        start = time.perf_counter()
        for _ in range(steps):
            step(physicsClientId=client)
        return time.perf_counter() - start, error()

    return batch
