"""A case in MuJoCo, by default with its Euler integrator; other settings as by default."""

import mujoco
import numpy as np

import robots

mujoco.set_mju_user_warning(lambda text: None)
"""Instability shows in the error. By default MuJoCo writes a log file into the current folder."""


def model(case):
    text = robots.plain(case.urdf, case.limits)
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.fusestatic = True
    if case.free:
        spec.worldbody.first_body().add_freejoint()
    for follower, (leader, multiplier, offset) in case.mimic.items():
        equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
        equality.name1, equality.name2 = follower, leader
        equality.data[:5] = [offset, multiplier, 0, 0, 0]
    drive = case.drive
    if drive:
        for name, *_ in robots.axes(case.urdf):
            actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            match drive["kind"]:
                case "position":
                    # The damper is joint damping, which Euler integrates implicitly: as kv it is not stable.
                    actuator.set_to_position(kp=drive["stiffness"], kv=0)
                case "velocity":
                    actuator.set_to_velocity(kv=drive["damping"])
                case "effort":
                    actuator.set_to_motor()
            if case.effort is not None:
                actuator.forcelimited, actuator.forcerange = True, [-case.effort, case.effort]
    compiled = spec.compile()
    compiled.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    if not case.limits:
        compiled.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    free = 6 if case.free else 0
    compiled.dof_damping[free:] = case.damping + (drive["damping"] if drive.get("kind") == "position" else 0.0)
    compiled.dof_armature[free:] = case.armature
    compiled.dof_frictionloss[free:] = case.friction
    return compiled


def joints(compiled, case):
    """Returns addresses of the case's axes. MuJoCo makes a planar joint three joints with derived names."""
    found = []
    free = 1 if case.free else 0
    by_name = {compiled.joint(i).name: i for i in range(free, compiled.njnt)}
    for index, (name, *_) in enumerate(robots.axes(case.urdf)):
        found.append(by_name.get(name, index + free))
    assert sorted(found) == list(range(free, compiled.njnt)), (found, by_name)
    return found


def begin(case, time_step, integrator):
    """Returns model and data of a case in its initial state, and the addresses of its axes' positions."""
    compiled = model(case)
    compiled.opt.timestep, compiled.opt.integrator = time_step, integrator
    data = mujoco.MjData(compiled)
    names = [name for name, *_ in robots.axes(case.urdf)]
    places = joints(compiled, case)
    at_q, at_v = compiled.jnt_qposadr[places], compiled.jnt_dofadr[places]
    data.qpos[at_q] = [case.positions.get(name, 0.0) for name in names]
    data.qvel[at_v] = [case.velocities.get(name, 0.0) for name in names]
    if case.free:
        data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
        data.qvel[:6] = case.root_velocity
    if case.drive:
        data.ctrl[:] = [case.drive["targets"].get(name, 0.0) for name in names]
    return compiled, data, at_q


def run(case, time_step, instants, integrator=mujoco.mjtIntegrator.mjINT_EULER):
    compiled, data, at_q = begin(case, time_step, integrator)
    seen, done = [], 0
    for instant in instants:
        steps = round(instant / time_step)
        if steps > done:
            mujoco.mj_step(compiled, data, nstep=steps - done)
        done = steps
        root = data.qpos[[0, 1, 2, 4, 5, 6, 3]].copy() if case.free else None
        seen.append((data.qpos[at_q].copy() if len(at_q) else np.zeros(0), root))
    return seen


def energy_change(case, time_step, integrator, look=0.1):
    """Returns the largest change of energy, as a part of the energy above the lowest point of the case; None
    if it diverges.

    The energy is read each `look` seconds."""
    compiled, data, _ = begin(case, time_step, integrator)
    compiled.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_forward(compiled, data)
    start, lowest, worst = float(data.energy.sum()), float(data.energy[0]), 0.0
    for _ in range(round(case.seconds / look)):
        mujoco.mj_step(compiled, data, nstep=round(look / time_step))
        # After a step the energy is still the energy of its start.
        mujoco.mj_forward(compiled, data)
        worst = max(worst, abs(float(data.energy.sum()) - start))
        lowest = min(lowest, float(data.energy[0]))
    return None if any(warning.number for warning in data.warning) else worst / (start - lowest)
