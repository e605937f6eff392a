"""Prints MuJoCo's results for the scenes to which `tests/physics/contacts.rs` and `scenes.rs` hold simd.

The bounds of those tests are near or below these figures: run it after a change of MuJoCo's version.
"""

import math

import mujoco

WORLD = '<mujoco><option timestep="0.001"{option}/><worldbody>{bodies}</worldbody></mujoco>'
GROUND = '<geom type="plane" size="5 5 1"{more}/>'


def body(position, shape, more=""):
    """A free body of one shape."""
    return f'<body pos="{position}"{more}><freejoint/><geom {shape}/></body>'


def run(bodies, seconds, option=""):
    """Returns the model and its state after this many seconds."""
    model = mujoco.MjModel.from_xml_string(WORLD.format(bodies=bodies, option=option))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return model, data


def stack():
    """Ten boxes of 0.2 m and 1 kg, a minute."""
    boxes = (body(f"0 0 {0.1 + 0.2 * i}", 'type="box" size=".1 .1 .1" mass="1"') for i in range(10))
    _, data = run(GROUND.format(more="") + "".join(boxes), 60)
    top = data.qpos[-7:-4]
    print(f"stack: the top sinks by {1.9 - top[2]:.2e} m, drifts by {math.hypot(top[0], top[1]):.1e} m")


def slope():
    """A block of 0.5 x 0.5 x 0.2 m on a slope of 0.3 rad with friction 0.4: how far it creeps in ten seconds."""
    angle = 0.3
    gravity = f' gravity="{9.81 * math.sin(angle)} 0 {-9.81 * math.cos(angle)}"'
    shape = 'type="box" size=".25 .25 .1" mass="2" friction="0.4 0 0"'
    bodies = GROUND.format(more=' friction="0.4 0 0"') + body("0 0 .1", shape)
    _, start = run(bodies, 0.1, gravity)
    _, end = run(bodies, 10.1, gravity)
    print(f"slope: the block creeps by {end.qpos[0] - start.qpos[0]:.1e} m in 10 s")


if __name__ == "__main__":
    stack()
    slope()
