"""A scene with contact in PyBullet, DIRECT: one `stepSimulation` a step, its solver's defaults."""

import time

import numpy as np
from in_pybullet import TIME_STEP, pybullet, silence
from scenes import FRICTION


def engine(scene):
    """Returns a function from a number of steps to seconds and the distance of a body from its place; for a
    robot, of its root."""
    client = pybullet.connect(pybullet.DIRECT)
    on = {"physicsClientId": client}
    pybullet.setGravity(0, 0, -9.81, **on)
    pybullet.setTimeStep(TIME_STEP, **on)
    # Friction of a pair is the product, so each body has its square root.
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, **on)
    ground = pybullet.createMultiBody(0, plane, **on)
    smooth(ground, -1, FRICTION**0.5, on)
    free = [robot(scene, on)] if scene.urdf else []
    shapes = {}
    for thing in scene.things:
        key = (thing.shape, *thing.size)
        if key not in shapes:
            if thing.shape == "sphere":
                shapes[key] = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=thing.size[0], **on)
            else:
                half = [edge / 2 for edge in thing.size]
                shapes[key] = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, **on)
        body = pybullet.createMultiBody(thing.mass, shapes[key], basePosition=thing.at, **on)
        smooth(body, -1, FRICTION**0.5, on)
        if thing.mass:
            free.append(body)

    def step(count):
        for _ in range(count):
            pybullet.stepSimulation(**on)

    def places():
        return np.array([pybullet.getBasePositionAndOrientation(body, **on)[0] for body in free])

    start = places()
    step(round(scene.settle / TIME_STEP))
    state = pybullet.saveState(**on)
    expected = places() if scene.heap else start

    def batch(steps):
        pybullet.restoreState(state, **on)
        step(max(1, steps // 10))
        one = pybullet.stepSimulation
        began = time.perf_counter()
        for _ in range(steps):
            one(physicsClientId=client)
        return time.perf_counter() - began, float(abs(places() - expected).max())

    return batch


def robot(scene, on):
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MERGE_FIXED_LINKS
    with silence():
        body = pybullet.loadURDF(str(scene.shaped), (0, 0, scene.height), flags=flags, **on)
    held = {joint["name"]: joint for joint in scene.joints}
    for index in range(-1, pybullet.getNumJoints(body, **on)):
        smooth(body, index, FRICTION**0.5, on)
        joint = held.get(pybullet.getJointInfo(body, index, **on)[1].decode()) if index >= 0 else None
        if joint:
            pybullet.resetJointState(body, index, joint["position"], 0, **on)
            pybullet.setJointMotorControl2(
                body, index, pybullet.POSITION_CONTROL, targetPosition=joint["position"], targetVelocity=0,
                positionGain=0.3, velocityGain=1.0, force=joint["effort"] or 1e5, **on)
    return body


def smooth(body, index, friction, on):
    """No damping, no restitution, and only friction against sliding."""
    pybullet.changeDynamics(body, index, lateralFriction=friction, rollingFriction=0, spinningFriction=0,
                            restitution=0, linearDamping=0, angularDamping=0, **on)
