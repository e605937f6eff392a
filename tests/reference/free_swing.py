"""Models of MJCF that swing freely for half a second in simd and in MuJoCo, both by Euler at 1 ms.

    SIMD_BINARY=target/debug/simd target/reference-venv/bin/python tests/reference/free_swing.py FOLDER...

It prints masses, and the largest differences of a joint, and of a site at the start. It needs `mujoco` and the requirements of the
Python client. Each `.xml` below the folders is a model, unless MuJoCo cannot load it. Features that simd
does not read are switched off in MuJoCo: contacts, limits, dry friction, equalities, actuators, tendons,
fluids, gravcomp. In simd contacts, limits, dry friction and constraints are switched off. Both begin in
simd's initial state. Springs are implicit in both.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(REPOSITORY / "client/python/src"), str(REPOSITORY / "client/python/tests")]

import mujoco
import numpy as np
from daemon import Daemon

import simd_client

STEPS = 500
TIME_STEP = 1e-3
HINGE, SLIDE, BALL, FREE = (
    mujoco.mjtJoint.mjJNT_HINGE,
    mujoco.mjtJoint.mjJNT_SLIDE,
    mujoco.mjtJoint.mjJNT_BALL,
    mujoco.mjtJoint.mjJNT_FREE,
)

# Degrees of freedom that may have springs.
WIDTHS = {int(HINGE): 1, int(SLIDE): 1, int(BALL): 3}


def free(model: Any) -> None:
    """Does not change the tree of bodies."""
    off = mujoco.mjtDisableBit
    for bit in (off.mjDSBL_CONTACT, off.mjDSBL_LIMIT, off.mjDSBL_FRICTIONLOSS, off.mjDSBL_EQUALITY, off.mjDSBL_ACTUATION):
        model.opt.disableflags |= int(bit)
    model.opt.disableflags &= ~int(off.mjDSBL_GRAVITY)
    # Sleeping bodies would stay in the air.
    model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    model.opt.timestep, model.opt.integrator = TIME_STEP, int(mujoco.mjtIntegrator.mjINT_EULER)
    model.opt.density = model.opt.viscosity = 0.0
    model.opt.gravity[:] = (0, 0, -9.81)
    model.body_gravcomp[:] = 0.0
    # simd's springs are implicit: by Euler k (rest - q - h v'). In MuJoCo's terms this is an additional
    # damper of h k.
    for joint in range(model.njnt):
        first = int(model.jnt_dofadr[joint])
        if model.jnt_type[joint] != FREE:
            model.dof_damping[first : first + WIDTHS[int(model.jnt_type[joint])]] += TIME_STEP * model.jnt_stiffness[joint]
    if model.ntendon:
        model.tendon_stiffness[:] = model.tendon_damping[:] = 0.0
        model.tendon_armature[:] = 0.0


def joint_names(model: Any) -> list[str]:
    """simd's names for bodies that the file does not name."""
    names: list[str] = []
    for index in range(model.njnt):
        body = int(model.jnt_bodyid[index])
        own = model.body(body).name or f"body_{body}"
        axis = index - int(model.body_jntadr[body])
        names.append(model.joint(index).name or (f"{own}_joint" if axis == 0 else f"{own}_joint_{axis + 1}"))
    return names


def swing(path: Path, simulation: Any) -> str:
    """A row of the table."""
    model = mujoco.MjModel.from_xml_path(str(path))
    free(model)
    data = mujoco.MjData(model)
    simulation.load(path, passive=True)
    robots = dict(simulation.robots)
    for robot in robots.values():
        robot.set_collision_groups(0, 0)
        for joint in robot.layout.moving:
            if joint.dof == 1:
                robot.joints[joint.name].set_properties(friction=0.0, limits=simd_client.JointLimits())
            elif joint.dof == 3:
                robot.joints[joint.name].set_properties(friction=0.0)
    for constraint in simulation.constraints.list():
        simulation.constraints.delete(constraint.name)
    masses = mass_difference(model, robots)
    follows = begin(model, data, robots)
    sites, apart = site_difference(model, data, robots)
    simulation.step(STEPS)
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    worst, where = 0.0, ""
    for name, difference in differences(model, data, robots, follows):
        if not difference <= worst:
            worst, where = difference, name
    return f"| {path.name} | {model.nbody - 1} | {model.nv} | {masses:.1e} | {sites} | {apart:.1e} | {worst:.1e} | {where} |"


def places(robots: dict[str, Any]) -> dict[str, tuple[Any, slice]]:
    """Returns robot and range of positions by joint name."""
    found: dict[str, tuple[Any, slice]] = {}
    for robot in robots.values():
        for joint in robot.layout.moving:
            found[joint.name] = (robot, joint.positions)
    return found


def mass_difference(model: Any, robots: dict[str, Any]) -> float:
    """Returns the relative difference of the masses of all trees with moving bodies."""
    top = list(range(model.nbody))
    for body in range(1, model.nbody):
        # A body comes after its parent.
        top[body] = body if model.body_parentid[body] == 0 else top[model.body_parentid[body]]
    moves = {top[body] for body in range(model.nbody) if model.body_dofnum[body] > 0}
    theirs = float(sum(model.body_mass[body] for body in range(1, model.nbody) if top[body] in moves))
    moving = [robot for robot in robots.values() if robot.layout.moving or not robot.info().is_fixed]
    return abs(sum(robot.info().mass for robot in moving) - theirs) / max(theirs, 1e-12)


def site_difference(model: Any, data: Any, robots: dict[str, Any]) -> tuple[int, float]:
    """Returns the number of sites with a name, and the largest difference of a position in metres or of an
    axis."""
    mujoco.mj_kinematics(model, data)
    poses = [robot.link_poses() for robot in robots.values()]
    names = [name for index in range(model.nsite) if (name := model.site(index).name)]
    worst = 0.0
    for name in names:
        site = model.site(name).id
        theirs = np.hstack([data.site_xmat[site].reshape(3, 3), data.site_xpos[site][:, None]])
        found = [of[link] for of in poses for link in (name, f"{name}_site") if link in of]
        # Another link may have its name.
        worst = max(worst, min((float(np.abs(pose.matrix()[:3] - theirs).max()) for pose in found), default=math.inf))
    return len(names), worst


def begin(model: Any, data: Any, robots: dict[str, Any]) -> set[str]:
    """Sets MuJoCo to simd's initial state. Returns the joints that follow others, which MuJoCo moves by
    equalities alone."""
    # Away from positions of rest, each joint differently.
    for robot in robots.values():
        turned = [joint for joint in robot.layout.moving if joint.dof == 1 and joint.mimic is None]
        state = robot.read()
        started = {joint.name: float(state.position[joint.positions][0]) + 0.1 * math.sin(1.0 + i) for i, joint in enumerate(turned)}
        if started:
            robot.reset_joints(started)
    found = places(robots)
    states = {name: robot.read() for name, robot in robots.items()}
    for index, name in enumerate(joint_names(model)):
        at = int(model.jnt_qposadr[index])
        if name not in found or model.jnt_type[index] == FREE:
            continue
        robot, where = found[name]
        values = states[robot.name].position[where]
        data.qpos[at : at + len(values)] = values if len(values) == 1 else np.roll(values, 1)
    return {joint.name for robot in robots.values() for joint in robot.layout.joints if joint.mimic is not None}


def differences(model: Any, data: Any, robots: dict[str, Any], follows: set[str]) -> list[tuple[str, float]]:
    found = places(robots)
    states = {name: robot.read() for name, robot in robots.items()}
    rows: list[tuple[str, float]] = []
    for index, name in enumerate(joint_names(model)):
        at = int(model.jnt_qposadr[index])
        kind = model.jnt_type[index]
        if kind == FREE:
            body = model.body(int(model.jnt_bodyid[index])).name or f"body_{int(model.jnt_bodyid[index])}"
            robot = next((robot for robot in robots.values() if robot.links[0] == body), None)
            if robot is not None:
                rows.append((name, float(np.abs(np.asarray(robot.pose.position) - data.qpos[at : at + 3]).max())))
        elif name not in found:
            rows.append((name, math.inf))
        elif name not in follows:
            robot, where = found[name]
            values = states[robot.name].position[where]
            if kind == BALL:
                theirs = np.roll(data.qpos[at : at + 4], -1)
                rows.append((name, float(min(np.abs(values - theirs).max(), np.abs(values + theirs).max()))))
            else:
                rows.append((name, float(abs(values[0] - data.qpos[at]))))
    return rows


def main(folders: list[str]) -> None:
    print("| model | bodies | degrees of freedom | mass | sites | sites apart | after 0.5 s | worst joint |\n|---|---|---|---|---|---|---|---|")
    for path in sorted(path for folder in folders for path in Path(folder).rglob("*.xml")):
        try:
            mujoco.MjModel.from_xml_path(str(path))
        except ValueError as why:
            print(f"| {path.name} | MuJoCo: {str(why).splitlines()[0][:80]} |||||", flush=True)
            continue
        daemon = Daemon(name=f"swing{os.getpid()}")
        try:
            with simd_client.connect(f"{daemon.endpoint}#{daemon.name}") as simulation:
                simulation.pause()
                simulation.set_physics(time_step=TIME_STEP, integrator="euler")
                print(swing(path, simulation), flush=True)
        except (simd_client.SimdError, subprocess.SubprocessError) as why:
            print(f"| {path.name} | simd: {str(why).splitlines()[0][:100]} |||||", flush=True)
        finally:
            daemon.kill()


if __name__ == "__main__":
    main(sys.argv[1:])
