"""A scene with contact in MuJoCo: `mj_step` with `nstep`, its solver's defaults."""

import time

import mujoco

import in_mujoco
from scenes import FRICTION

PREFIX = "robot/"
ROBOT, REST = (1, 2), (2, 3)
"""contype and conaffinity: a robot's links touch anything but each other, as in simd and PyBullet."""


def model(scene):
    root = mujoco.MjSpec()
    ground = root.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 1])
    touch(ground, REST)
    if scene.urdf:
        robot = mujoco.MjSpec.from_file(str(scene.shaped))
        robot.worldbody.first_body().add_freejoint()
        for geom in robot.geoms:
            touch(geom, ROBOT)
        root.attach(robot, prefix=PREFIX, frame=root.worldbody.add_frame(pos=[0, 0, scene.height]))
        for joint in scene.joints:
            actuator = root.add_actuator(
                name=PREFIX + joint["name"], target=PREFIX + joint["name"], trntype=mujoco.mjtTrn.mjTRN_JOINT)
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
    for joint in scene.joints:
        compiled.dof_damping[compiled.joint(PREFIX + joint["name"]).dofadr[0]] += joint["gains"][1]
    return compiled


def touch(geom, kinds):
    geom.contype, geom.conaffinity = kinds
    geom.friction[0] = FRICTION


def engine(scene, sleep=False):
    """From a number of steps to seconds and how far a body is from its place."""
    compiled = model(scene)
    if sleep:
        compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    data, settled = mujoco.MjData(compiled), mujoco.MjData(compiled)
    for joint in scene.joints:
        data.qpos[compiled.joint(PREFIX + joint["name"]).qposadr[0]] = joint["position"]
        data.ctrl[compiled.actuator(PREFIX + joint["name"]).id] = joint["position"]
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
