"""A scene with contact in MuJoCo: `mj_step` with `nstep`, its solver's defaults."""

import time
from dataclasses import replace

import mujoco
import numpy as np
from mujoco.rollout import Rollout

import in_mujoco
from scenes import FRICTION

ROBOT, REST = (1, 2), (2, 3)
"""contype and conaffinity: a robot's links touch everything but each other, as in simd and PyBullet."""


def model(scene):
    root = mujoco.MjSpec()
    ground = root.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 1])
    touch(ground, REST)
    for copy in range(scene.copies if scene.urdf else 0):
        robot = mujoco.MjSpec.from_file(str(scene.shaped))
        robot.worldbody.first_body().add_freejoint()
        for geom in robot.geoms:
            touch(geom, ROBOT)
        place = [3.0 * (copy % 10), 3.0 * (copy // 10), scene.height]
        root.attach(robot, prefix=f"{copy}/", frame=root.worldbody.add_frame(pos=place))
    for name, joint in driven(scene):
        actuator = root.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=joint["gains"][0], kv=0)
        if joint["effort"]:
            actuator.forcelimited, actuator.forcerange = True, [-joint["effort"], joint["effort"]]
    for thing in scene.things:
        body = root.worldbody.add_body(pos=thing.at)
        if thing.mass:
            body.add_freejoint()
        sphere = thing.shape == "sphere"
        geom = body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE if sphere else mujoco.mjtGeom.mjGEOM_BOX,
            size=[thing.size[0], 0, 0] if sphere else [edge / 2 for edge in thing.size], mass=thing.mass)
        touch(geom, REST)
    root.compiler.fusestatic = True
    compiled = root.compile()
    compiled.opt.timestep = in_mujoco.TIME_STEP
    compiled.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    if scene.heap:
        compiled.opt.solver = mujoco.mjtSolver.mjSOL_CG
    for name, joint in driven(scene):
        compiled.dof_damping[compiled.joint(name).dofadr[0]] += joint["gains"][1]
    return compiled


def driven(scene):
    """Returns the joints of all copies, by their names."""
    return [(f"{copy}/{joint['name']}", joint) for copy in range(scene.copies) for joint in scene.joints]


def touch(geom, kinds):
    geom.contype, geom.conaffinity = kinds
    geom.friction[0] = FRICTION


def engine(scene, sleep=False):
    """Returns a function from a number of steps to seconds and the distance of a body from its place."""
    compiled = model(scene)
    if sleep:
        compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    data, settled = mujoco.MjData(compiled), mujoco.MjData(compiled)
    for name, joint in driven(scene):
        data.qpos[compiled.joint(name).qposadr[0]] = joint["position"]
        data.ctrl[compiled.actuator(name).id] = joint["position"]
    mujoco.mj_forward(compiled, data)
    start = data.xpos.copy()
    mujoco.mj_step(compiled, data, nstep=round(scene.settle / in_mujoco.TIME_STEP))
    mujoco.mj_copyData(settled, compiled, data)
    expected = data.xpos.copy() if scene.heap else start

    def batch(steps):
        mujoco.mj_copyData(data, compiled, settled)
        mujoco.mj_step(compiled, data, nstep=max(1, steps // 10))
        began = time.perf_counter()
        mujoco.mj_step(compiled, data, nstep=steps)
        seconds = time.perf_counter() - began
        if any(warning.number for warning in data.warning):
            raise RuntimeError(f"{scene.name}: MuJoCo warns of its state")
        return seconds, float(abs(data.xpos - expected).max())

    return batch


def rollout(scene, threads):
    """Like `batch`, with each copy in a separate world, on this many threads: `mujoco.rollout`."""
    alone = replace(scene, copies=1)
    compiled = model(alone)
    data = mujoco.MjData(compiled)
    for name, joint in driven(alone):
        data.qpos[compiled.joint(name).qposadr[0]] = joint["position"]
        data.ctrl[compiled.actuator(name).id] = joint["position"]
    mujoco.mj_forward(compiled, data)
    start = data.xpos.copy()
    mujoco.mj_step(compiled, data, nstep=round(scene.settle / in_mujoco.TIME_STEP))
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(compiled, kind))
    mujoco.mj_getState(compiled, data, state, kind)
    states, control = np.tile(state, (scene.copies, 1)), data.ctrl[np.newaxis, np.newaxis, :]
    datas = [mujoco.MjData(compiled) for _ in range(threads)]
    pool = Rollout(nthread=threads)

    def batch(steps):
        went = np.empty((scene.copies, steps, len(state)))
        began = time.perf_counter()
        pool.rollout(compiled, datas, states, control, nstep=steps, state=went)
        seconds = time.perf_counter() - began
        mujoco.mj_setState(compiled, data, went[-1, -1], kind)
        mujoco.mj_forward(compiled, data)
        return seconds, float(abs(data.xpos - start).max())

    return batch
