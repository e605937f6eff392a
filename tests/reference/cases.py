"""Cases of the truth table: the robot, its initial state, and the loads on its joints.

A case contains everything that a simulator receives. Limits, damping, friction and mimic of the file are
left out and given here instead, so that all simulators compute the same.
"""

from dataclasses import asdict, dataclass, field

import robots

TIME_STEPS = [1e-4, 2.5e-4, 1e-3, 4e-3]
"""Seconds. Every instant of a view is a multiple of all of them."""

ROOT_VELOCITY = [0.1, -0.2, 0.3, 0.5, -0.4, 0.6]
"""Initial velocity of a free root: linear in world axes, angular in the root's axes, which start as the
world's."""


@dataclass
class Case:
    name: str
    subject: str
    """smooth: passive and smooth, where Euler's error is held to MuJoCo's; kinked: MuJoCo's model softens it
    by design; driven: by actuators."""
    urdf: str
    positions: dict
    velocities: dict
    seconds: float = 0.48
    root_velocity: list = field(default_factory=list)
    """Empty for a fixed root."""
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    effort: float | None = None
    limits: dict = field(default_factory=dict)
    """Lower and upper limit by joint."""
    mimic: dict = field(default_factory=dict)
    """Leader, multiplier and offset by follower."""
    drive: dict = field(default_factory=dict)
    """kind: position, velocity or effort; targets by joint; stiffness; damping."""

    @property
    def free(self):
        return bool(self.root_velocity)

    def request(self):
        """Returns the case in the form that tests/support/truth.rs reads."""
        names = robots.axes(self.urdf)
        out = asdict(self)
        out["joints"] = [{"joint": joint, "axis": axis, "position": self.positions.get(name, 0.0),
                          "velocity": self.velocities.get(name, 0.0)} for name, joint, axis in names]
        out["limits"] = [{"joint": j, "lower": low, "upper": high} for j, (low, high) in self.limits.items()]
        out["mimic"] = [{"joint": j, "leader": leader, "multiplier": m, "offset": o}
                        for j, (leader, m, o) in self.mimic.items()]
        if self.drive:
            drive = dict(self.drive)
            drive["targets"] = [drive["targets"].get(name, 0.0) for name, *_ in names]
            out["drive"] = drive
        else:
            out["drive"] = None
        del out["positions"], out["velocities"]
        return out


def spread(urdf):
    """Returns a bent pose and velocities for a robot of any number of joints."""
    names = [name for name, *_ in robots.axes(urdf)]
    return ({name: 0.3 * (-1) ** i * (i % 3 + 1) / 3 for i, name in enumerate(names)},
            {name: 0.5 * (-1) ** (i // 2) for i, name in enumerate(names)})


def named(urdf, values):
    return dict(zip((name for name, *_ in robots.axes(urdf)), values, strict=True))


def cases():
    own = "../reference/robots/"
    arm, tree, planar = (f"{name}/urdf/{name}.urdf" for name in ("seven_arm", "branching", "planar"))
    bent = named(arm, [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4])
    moving = named(arm, [0.5, -0.3, 0.8, 0.2, -1.0, 0.6, 1.5])
    pose = dict(hip=0.4, knee=0.1, turn=-0.6, slide=0.8, bend=-0.3)
    velocities = dict(hip=1.0, knee=0.2, turn=-2.0, slide=1.5, bend=3.0)
    still = dict.fromkeys(bent, 0.0)
    flight = {"root_velocity": ROOT_VELOCITY}
    out = [
        Case("pendulum from 170 deg", "smooth", own + "pendulum.urdf", {"hinge": 2.96705972839}, {}, 2.0),
        Case("rotor, damping h / I = 10 at 1 ms", "smooth", own + "rotor.urdf", {}, {"axle": 50.0}, damping=100.0),
        Case("heavy top, nutating", "smooth", own + "heavy_top.urdf", {"nutation": 0.6},
             {"precession": 1.0, "spin": 60.0}),
        Case("box about its middle axis", "smooth", own + "box.urdf", {}, {}, 2.0,
             root_velocity=[0.0, 0.0, 2.0, 0.02, 5.0, 0.03]),
        Case("seven_arm", "smooth", arm, bent, moving),
        Case("seven_arm, damping", "smooth", arm, bent, moving, damping=0.2),
        Case("seven_arm, armature", "smooth", arm, bent, moving, armature=0.1),
        Case("branching", "smooth", tree, pose, velocities),
        Case("branching, damping, armature", "smooth", tree, pose, velocities, damping=0.3, armature=0.02),
        Case("branching in flight", "smooth", tree, pose, velocities, **flight),
        Case("planar", "smooth", planar, {"plane.0": 0.1, "plane.1": -0.2, "plane.2": 0.5, "swing": 0.7},
             {"plane.0": 0.3, "plane.1": 0.2, "plane.2": -1.0, "swing": 2.0}),
    ]
    humanoid = "humanoid/urdf/humanoid.urdf"
    out.append(Case("humanoid in flight", "smooth", humanoid, *spread(humanoid), 0.24, **flight))
    for name, file, extra in [
        ("cartpole", "cartpole.urdf", {}), ("iiwa", "kuka_iiwa/model.urdf", {}),
        ("panda", "franka_panda/panda.urdf", {"damping": 0.1}), ("pendulum5", "pendulum5.urdf", {}),
        ("A1", "a1/a1.urdf", {}), ("A1 in flight", "a1/a1.urdf", {"armature": 0.01, **flight}),
        ("laikago in flight", "laikago/laikago_toes_zup.urdf", flight),
    ]:
        urdf = robots.OTHERS + file
        out.append(Case(name, "smooth", urdf, *spread(urdf), 0.24, **extra))
    iiwa, panda = robots.OTHERS + "kuka_iiwa/model.urdf", robots.OTHERS + "franka_panda/panda.urdf"
    dampers = {"kind": "velocity", "targets": named(arm, [2.0, 3.0, -2.0, 1.5, -3.0, 2.0, 1.0])}
    out += [
        Case("rotor, dry friction", "kinked", own + "rotor.urdf", {}, {"axle": 5.0}, friction=0.2),
        Case("held on a slope by friction", "kinked", own + "slope.urdf", {}, {}, 2.0, friction=7.5),
        Case("seven_arm, dry friction", "kinked", arm, bent, moving, friction=4.0),
        Case("pendulum on a stop", "kinked", own + "pendulum.urdf", {"hinge": 1.2}, {}, 0.96,
             limits={"hinge": (-0.3, 1.5)}),
        Case("branching, limits", "kinked", tree, pose, velocities,
             limits={"slide": (-0.5, 1.0), "knee": (-0.2, 0.3), "hip": (-0.4, 0.8)}),
        Case("panda, mimic", "kinked", panda, {**spread(panda)[0], "panda_finger_joint1": 0.1,
             "panda_finger_joint2": 0.1}, {**spread(panda)[1], "panda_finger_joint1": 0.5,
             "panda_finger_joint2": 0.5}, 0.24, mimic={"panda_finger_joint2": ("panda_finger_joint1", 1.0, 0.0)}),
        Case("branching, mimic", "kinked", tree, {**pose, "knee": -0.1}, {**velocities, "knee": -0.5},
             mimic={"knee": ("hip", -0.5, 0.1)}),
        Case("iiwa on springs", "driven", iiwa, spread(iiwa)[0], {}, 0.48,
             drive={"kind": "position", "targets": {}, "stiffness": 100.0, "damping": 5.0}),
        Case("seven_arm, saturated", "driven", arm, bent, still, 0.24, effort=1.5,
             drive=dampers | {"damping": 0.8}),
        Case("seven_arm, saturated, stiff", "driven", arm, bent, still, effort=12.0,
             drive=dampers | {"damping": 8.0}),
        Case("branching, efforts", "driven", tree, pose, velocities, damping=0.1,
             drive={"kind": "effort", "targets": dict(hip=4.0, knee=-0.5, turn=2.0, slide=6.0, bend=0.3)}),
    ]
    return out


def swings():
    """Starts from rest for a minute, to compare energies: tests/physics/energy.rs has the same."""
    arm, pendulum = "seven_arm/urdf/seven_arm.urdf", "../reference/robots/double_pendulum.urdf"
    return [
        Case("double pendulum", "smooth", pendulum, named(pendulum, [0.0, 0.5]), {}, 60.0),
        Case("seven_arm", "smooth", arm, named(arm, [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4]), {}, 60.0),
    ]
