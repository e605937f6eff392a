#!/usr/bin/env python3
"""Makes mujoco.json: trajectories of MuJoCo's Euler integrator for our test robots.

Needs requirements.txt; run from anywhere. Each case has a robot, its initial state, its steps, and
MuJoCo's state after some seconds. The suite tests/physics holds simd to these figures. MuJoCo reads the
URDF, so that the import is compared too.
"""

import re
from pathlib import Path

import mujoco
import numpy as np
import pybullet_data

import json_lines

HERE = Path(__file__).resolve().parent
ASSETS = HERE.parent / "assets"
# Third-party robots, from the PyPI package `pybullet`.
OTHERS = "pybullet_data/"


def model(urdf: str, free: bool, damping: float, armature: float, time_step: float):
    if urdf.startswith(OTHERS):
        text = (Path(pybullet_data.getDataPath()) / urdf.removeprefix(OTHERS)).read_text()
    else:
        text = (ASSETS / urdf).read_text()
    # Shapes have no effect here, and MuJoCo would need the mesh files.
    text = re.sub(r"<(visual|collision)\b.*?</\1>", "", text, flags=re.S)
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.fusestatic = True
    if free:
        spec.worldbody.first_body().add_freejoint()
    compiled = spec.compile()
    compiled.opt.timestep = time_step
    compiled.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    disable = mujoco.mjtDisableBit
    compiled.opt.disableflags |= disable.mjDSBL_CONTACT | disable.mjDSBL_LIMIT | disable.mjDSBL_EQUALITY
    offset = 6 if free else 0
    compiled.dof_damping[offset:] = damping
    compiled.dof_armature[offset:] = armature
    compiled.dof_frictionloss[:] = 0
    return compiled


def swing(name, urdf, *, free=False, damping=0.0, armature=0.0, time_step=1e-3, seconds=1.0, start=None, velocities=None):
    compiled = model(urdf, free, damping, armature, time_step)
    data = mujoco.MjData(compiled)
    joints = compiled.nq - (7 if free else 0)
    q0 = np.zeros(joints) if start is None else np.array(start, float)
    v0 = np.zeros(joints) if velocities is None else np.array(velocities, float)
    root_velocity = [0.1, -0.2, 0.3, 0.5, -0.4, 0.6]
    if free:
        data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
        data.qpos[7:] = q0
        data.qvel[:6] = root_velocity
        data.qvel[6:] = v0
    else:
        data.qpos[:] = q0
        data.qvel[:] = v0
    for _ in range(round(seconds / time_step)):
        mujoco.mj_step(compiled, data)
    offset = 7 if free else 0
    case = {
        "name": name,
        "urdf": urdf,
        "free": free,
        "damping": damping,
        "armature": armature,
        "time_step": time_step,
        "seconds": seconds,
        "start": q0.tolist(),
        "start_velocities": v0.tolist(),
        "positions": data.qpos[offset:].tolist(),
        "velocities": data.qvel[offset - (1 if free else 0):].tolist(),
    }
    if free:
        w, x, y, z = data.qpos[3:7]
        case["root_velocity"] = root_velocity
        case["root"] = [*data.qpos[:3].tolist(), x, y, z, w]
    return case


def main():
    arm = "seven_arm/urdf/seven_arm.urdf"
    bent = [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4]
    moving = [0.5, -0.3, 0.8, 0.2, -1.0, 0.6, 1.5]
    cases = []
    for time_step in (1e-4, 2.5e-4, 1e-3, 4e-3):
        ms = f"{time_step * 1e3:g} ms"
        cases += [
            swing(f"seven_arm from rest at zero, {ms}", arm, time_step=time_step),
            swing(f"seven_arm bent and moving, {ms}", arm, time_step=time_step, start=bent, velocities=moving),
            swing(f"seven_arm with damping, {ms}", arm, time_step=time_step, start=bent, damping=0.5),
            swing(f"seven_arm with armature, {ms}", arm, time_step=time_step, start=bent, armature=0.1),
            swing(f"seven_arm free in flight, {ms}", arm, time_step=time_step, free=True, start=bent, velocities=moving),
        ]
    tree = "branching/urdf/branching.urdf"
    pose = [0.4, 0.1, -0.6, 0.8, -0.3]
    velocities = [1.0, 0.2, -2.0, 1.5, 3.0]
    planar = "planar/urdf/planar.urdf"
    for time_step in (1e-4, 2.5e-4, 1e-3, 4e-3):
        ms = f"{time_step * 1e3:g} ms"
        for free in (False, True):
            base = "free" if free else "fixed"
            cases += [
                swing(f"branching, {base}, {ms}", tree, time_step=time_step, free=free, start=pose, velocities=velocities),
                swing(f"branching, {base}, damping and armature, {ms}", tree, time_step=time_step, free=free,
                      start=pose, velocities=velocities, damping=0.3, armature=0.02),
            ]
        cases.append(swing(f"planar, {ms}", planar, time_step=time_step, start=[0.1, -0.2, 0.5, 0.7],
                           velocities=[0.3, 0.2, -1.0, 2.0]))
    others = {
        "kuka_iiwa/model.urdf": 7,
        "franka_panda/panda.urdf": 9,
        "a1/a1.urdf": 12,
    }
    for urdf, joints in others.items():
        start = [0.3 * (-1) ** i * (i % 3 + 1) / 3 for i in range(joints)]
        velocities = [0.5 * (-1) ** (i // 2) for i in range(joints)]
        for time_step in (1e-4, 2.5e-4, 1e-3, 4e-3):
            ms = f"{time_step * 1e3:g} ms"
            for free in (False, True) if joints == 12 else (False,):
                base = "free" if free else "fixed"
                cases += [
                    swing(f"{urdf}, {base}, {ms}", OTHERS + urdf, time_step=time_step, free=free, start=start, velocities=velocities),
                    swing(f"{urdf}, {base}, damping and armature, {ms}", OTHERS + urdf, time_step=time_step, free=free,
                          start=start, velocities=velocities, damping=0.1, armature=0.01),
                ]
    out = {"made_by": f"make_reference.py with MuJoCo {mujoco.__version__}", "cases": cases}
    (HERE / "mujoco.json").write_text(json_lines.text(out))
    print(f"{len(cases)} cases")


main()
