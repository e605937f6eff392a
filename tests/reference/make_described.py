#!/usr/bin/env python3
"""Makes described.json: motions of robots whose MJCF describes their actuators, in MuJoCo.

Needs requirements.txt; run from anywhere. Each case has a file, controls, and the positions of its joints after some
times. The suite tests/physics holds simd to these figures. MuJoCo takes steps of 10 us, so that its figures are the
motion of the described law, whatever the integrator.
"""

import random
from pathlib import Path

import mujoco

import json_lines

HERE = Path(__file__).resolve().parent
STEP = 1e-5
TIMES = [0.05, 0.1, 0.15, 0.2, 0.3, 0.5]

HEAD = '<compiler angle="radian" autolimits="true"/>'
ARM = '<inertial pos="0.2 0 0" mass="1" diaginertia="0.001 0.001 0.001"/>'


def arm(name: str, place: float, limits: str = "") -> str:
    joint = f'<joint name="{name}" axis="0 0 1" armature="0.1" {limits}/>'
    return f'<body name="{name}_body" pos="0 {place} 0">{joint}{ARM}</body>'


SERVO = f"""<mujoco model="servo">{HEAD}<worldbody>
{arm("kv", 0, 'range="-1.5 1.5"')}{arm("dr", 2, 'range="-1.5 1.5"')}{arm("gen", 4, 'range="-1.5 1.5"')}{arm("vel", 6)}{arm("gear", 8)}
</worldbody><actuator>
<position name="kv" joint="kv" kp="10" kv="2" forcerange="-3 3"/>
<position name="dr" joint="dr" kp="10" dampratio="1"/>
<general name="gen" joint="gen" biastype="affine" gainprm="10" biasprm="0 -10 -2"/>
<velocity name="vel" joint="vel" kv="2"/>
<position name="gear" joint="gear" kp="10" kv="2" gear="3"/>
</actuator></mujoco>"""

# A stiff arm whose motor is weak, which saturates for most of the way.
WEAK = f"""<mujoco model="weak">{HEAD}<worldbody>{arm("weak", 0)}</worldbody><actuator>
<position name="weak" joint="weak" kp="200" kv="10" forcerange="-2 2"/></actuator></mujoco>"""


def hand(sections: str, follow: str, first: str = "", second: str = "") -> str:
    def finger(name: str, axis: str, words: str) -> str:
        joint = f'<joint name="{name}" type="slide" axis="{axis}" armature="0.1" {words}/>'
        return f'<body name="{name}_body">{joint}<inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/></body>'

    hard = 'solref="0.0001 1" solimp="0.9999 0.99999 0.001"'
    return f"""<mujoco model="hand">{HEAD}<worldbody><body name="palm"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
{finger("l", "0 1 0", first)}{finger("r", "0 -1 0", second)}</body></worldbody>
<equality><joint joint1="r" joint2="l" polycoef="{follow}" {hard}/></equality>{sections}</mujoco>"""


TENDON = '<tendon><fixed name="split" {}><joint joint="l" coef="0.5"/><joint joint="r" coef="0.5"/></fixed></tendon>'
GRIPPER = hand(
    TENDON.format("")
    + '<actuator><general name="grip" tendon="split" forcerange="-5 5" gainprm="0.4 0 0" biastype="affine" biasprm="0 -100 -10"/></actuator>',
    "0 1 0 0 0",
)
# Without an armature of the tendon: MuJoCo leaves out its terms between two branches of a tree.
UNEVEN = hand(
    TENDON.format('stiffness="30" springlength="0.02" damping="3"')
    + '<actuator><motor name="pull" tendon="split" gear="2"/></actuator>',
    "0.01 -3 0 0 0",
    'stiffness="5" springref="0.01" damping="0.2"',
    'stiffness="2" damping="0.1"',
)
FOLLOWER = hand(
    '<actuator><position name="far" joint="r" kp="40" kv="4" forcerange="-1 1"/></actuator>', "0 2 0 0 0"
)


def case(name: str, mjcf: str, targets: dict[str, tuple[str, float, float]], start: dict[str, float] = {}) -> dict:
    """Runs a case. `targets` has a kind, a target of the joint and the actuator's control for it. `start` has the
    positions of followers, which equalities of the file ask for."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    model.opt.timestep = STEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    for joint, position in start.items():
        data.joint(joint).qpos[0] = position
    mujoco.mj_forward(model, data)
    controls = [control for _, _, control in targets.values()]
    assert model.nu == len(controls)
    data.ctrl[:] = controls
    names = [model.joint(index).name for index in range(model.njnt)]
    positions = []
    step = 0
    for time in TIMES:
        while step < round(time / STEP):
            mujoco.mj_step(model, data)
            step += 1
        positions.append([float(data.joint(name).qpos[0]) for name in names])
    asked = [{"joint": joint, "kind": kind, "value": value} for joint, (kind, value, _) in targets.items()]
    return {"name": name, "mjcf": mjcf, "targets": asked, "joints": names, "times": TIMES, "positions": positions}


def pulled(seed: int) -> dict:
    """Returns a case of a random chain whose joints are pulled by tendons, and move independently."""
    of = random.Random(seed)
    count = of.randint(2, 4)
    opened = ""
    for index in range(count):
        axis = " ".join(f"{of.uniform(-1, 1):.3f}" for _ in range(3))
        spring = f'stiffness="{of.uniform(0, 3):.3f}" damping="{of.uniform(0, 0.3):.3f}"'
        moments = " ".join(f"{of.uniform(0.02, 0.03):.4f}" for _ in range(3))
        opened += f"""<body name="b{index}" pos="{0.3 if index else 0} 0 0.1">
<joint name="j{index}" axis="{axis}" armature="0.02" {spring}/>
<inertial pos="{of.uniform(0.1, 0.3):.3f} 0.05 0" mass="{of.uniform(0.3, 1.5):.3f}" diaginertia="{moments}"/>"""
    tendons, actuators, targets = "", "", {}
    for index in range(of.randint(1, 3)):
        joints = of.sample(range(count), of.randint(2, count))
        terms = "".join(
            f'<joint joint="j{joint}" coef="{of.choice([-1, 1]) * of.uniform(0.3, 1.5):.3f}"/>' for joint in joints
        )
        words = f'damping="{of.uniform(0, 0.5):.3f}"'
        if of.random() < 0.5:
            words += f' stiffness="{of.uniform(1, 20):.3f}" springlength="{of.uniform(-0.3, 0.3):.3f}"'
        if of.random() < 0.3:
            words += f' armature="{of.uniform(0, 0.05):.3f}"'
        tendons += f'<fixed name="t{index}" {words}>{terms}</fixed>'
        name, gear = f't{index}" tendon="t{index}', of.choice([1, 1, -2, 0.5])
        match of.choice(["position", "position", "velocity", "motor", "weak"]):
            case "position":
                kp, kv = of.uniform(5, 60), of.uniform(0.5, 4)
                actuators += f'<position name="{name}" gear="{gear}" kp="{kp:.3f}" kv="{kv:.3f}"/>'
                goal = of.uniform(-0.4, 0.4)
                targets[f"t{index}"] = ("position", goal, goal * gear)
            case "weak":
                actuators += f'<position name="{name}" kp="50" kv="4" forcerange="-0.5 0.5"/>'
                targets[f"t{index}"] = ("position", 0.3, 0.3)
            case "velocity":
                actuators += f'<velocity name="{name}" kv="{of.uniform(0.5, 4):.3f}"/>'
                targets[f"t{index}"] = ("velocity", 0.5, 0.5)
            case _:
                actuators += f'<motor name="{name}" gear="{gear}"/>'
                effort = of.uniform(-0.5, 0.5)
                targets[f"t{index}"] = ("effort", effort, effort / gear)
    mjcf = f"""<mujoco model="pulled">{HEAD}<worldbody>{opened}{"</body>" * count}</worldbody>
<tendon>{tendons}</tendon><actuator>{actuators}</actuator></mujoco>"""
    return case(f"a chain pulled by tendons, seed {seed}", mjcf, targets)


CASES = [
    case(
        "actuators of every kind",
        SERVO,
        {
            "kv": ("position", 0.2, 0.2),
            "dr": ("position", 0.2, 0.2),
            "gen": ("position", 0.2, 0.2),
            "vel": ("velocity", 1.5, 1.5),
            "gear": ("position", 0.2, 0.6),
        },
    ),
    case("a motor that saturates", WEAK, {"weak": ("position", 0.4, 0.4)}),
    case("a gripper with one tendon", GRIPPER, {"l": ("position", 0.03, 7.5)}),
    case("a tendon with a spring, on joints of other springs", UNEVEN, {"l": ("effort", 1.5, -0.75)}, {"r": 0.01}),
    case("an actuator of a follower", FOLLOWER, {"l": ("position", 0.05, 0.1)}),
    *(pulled(seed) for seed in range(24)),
]

(HERE / "described.json").write_text(json_lines.text({"mujoco": mujoco.__version__, "cases": CASES}))
