"""A scene in MuJoCo: `mj_step` with `nstep`, so that the loop over steps runs in C."""

import time
from enum import Enum

import mujoco

TIME_STEP = 1e-3
SOFTER = 6
"""Divisor of the gains' bandwidth if the damper is explicit: simd's gains would not be stable."""


class Settings(Enum):
    """Integrator of the actuators' dampers."""

    EULER = "joint damping, which Euler integrates implicitly"
    EXPLICIT = "Euler, explicit damper, softer gains"
    IMPLICIT = "implicitfast"


def engine(scene, joints, settings=Settings.EULER):
    """Returns a function from a number of steps to seconds and the largest error of a joint."""
    root = mujoco.MjSpec()
    for copy in range(scene.copies):
        robot = mujoco.MjSpec.from_file(str(scene.bare))
        if scene.free:
            robot.worldbody.first_body().add_freejoint()
        frame = root.worldbody.add_frame(pos=[3.0 * (copy % 10), 3.0 * (copy // 10), 0.0])
        root.attach(robot, prefix=f"{copy}/", frame=frame)
    named = [(f"{copy}/{joint['name']}", joint) for copy in range(scene.copies) for joint in joints]
    driven = [(name, joint) for name, joint in named if joint["gains"]]
    for name, joint in driven:
        stiffness, damping = joint["gains"]
        if settings is Settings.EXPLICIT:
            stiffness, damping = stiffness / SOFTER**2, damping / SOFTER
        explicit = 0.0 if settings is Settings.EULER else damping
        actuator = root.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=stiffness, kv=explicit)
    root.compiler.fusestatic = True
    model = root.compile()
    model.opt.timestep = TIME_STEP
    implicit = settings is Settings.IMPLICIT
    kinds = mujoco.mjtIntegrator
    model.opt.integrator = kinds.mjINT_IMPLICITFAST if implicit else kinds.mjINT_EULER
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    if settings is Settings.EULER:
        for name, joint in driven:
            model.dof_damping[model.joint(name).dofadr[0]] += joint["gains"][1]

    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name, _ in named]
    held = [joint["position"] for _, joint in named]
    targets = [joint["position"] for _, joint in driven]

    def batch(steps):
        mujoco.mj_resetData(model, data)
        data.qpos[places] = held
        data.ctrl[:] = targets
        mujoco.mj_step(model, data, nstep=steps // 10)
        start = time.perf_counter()
        mujoco.mj_step(model, data, nstep=steps)
        seconds = time.perf_counter() - start
        if any(warning.number for warning in data.warning):
            raise RuntimeError(f"{scene.name}: MuJoCo warns of its state ({settings.value})")
        return seconds, float(abs(data.qpos[places] - held).max())

    return batch
