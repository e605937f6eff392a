"""Ten thousand rays in one call, from one point into all directions, into a scene in its initial state.
MuJoCo's `mj_multiRay` accepts only one starting point."""

import time

import contacts_mujoco
import mujoco
import numpy as np
from in_pybullet import pybullet
from scenes import ContactScene, heap

COUNT = 10_000
REACH = 100.0
"""Maximum range of each ray, metres."""


def scenes():
    return [ContactScene("10000 rays, 1000 spheres in a box", 0.0, 1.0, things=heap(10, 0.05))]


def point(scene):
    """Above the middle of the scene."""
    return np.array([0.0, 0.0, 2.0 * max(thing.at[2] for thing in scene.things)])


def directions():
    """A Fibonacci lattice on the sphere."""
    index = np.arange(COUNT)
    z = 1.0 - (2.0 * index + 1.0) / COUNT
    turn = np.pi * (3.0 - 5.0**0.5) * index
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


def timed(call, distances):
    """Returns a function from a number of calls to seconds; `distances` checks that all simulators measure
    the same, metres."""
    call()
    known = distances()

    def batch(calls):
        began = time.perf_counter()
        for _ in range(calls):
            call()
        return time.perf_counter() - began, 0.0

    return batch, known


def in_mujoco(scene):
    model = contacts_mujoco.model(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start, ways = point(scene), directions().ravel()
    geoms, found, normals = np.zeros(COUNT, np.int32), np.zeros(COUNT), np.zeros(3 * COUNT)

    def call():
        mujoco.mj_multiRay(model, data, start, ways, None, 1, -1, geoms, found, normals, COUNT, REACH)

    return timed(call, lambda: np.where(found < 0, REACH, found))


def in_pybullet(scene):
    client = pybullet.connect(pybullet.DIRECT)
    on = {"physicsClientId": client}
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, **on)
    pybullet.createMultiBody(0, plane, **on)
    shapes = {}
    for thing in scene.things:
        key = (thing.shape, *thing.size)
        if key not in shapes:
            half = [edge / 2 for edge in thing.size]
            kind = {"radius": thing.size[0]} if thing.shape == "sphere" else {"halfExtents": half}
            shape = pybullet.GEOM_SPHERE if thing.shape == "sphere" else pybullet.GEOM_BOX
            shapes[key] = pybullet.createCollisionShape(shape, **kind, **on)
        pybullet.createMultiBody(thing.mass, shapes[key], basePosition=thing.at, **on)
    pybullet.performCollisionDetection(**on)
    start = point(scene)
    starts = [start.tolist()] * COUNT
    ends = (start + REACH * directions()).tolist()
    found = []

    def call():
        found[:] = pybullet.rayTestBatch(starts, ends, numThreads=1, **on)

    return timed(call, lambda: np.array([REACH * ray[2] for ray in found]))


def in_simd(worker, index, scene):
    start = " ".join(str(x) for x in point(scene))

    def ask(calls):
        return worker.ask(f"rays {index} {calls} {start} {REACH} {COUNT}")

    def batch(calls):
        return ask(calls)["seconds"], 0.0

    return batch, np.array(ask(1)["distances"])
