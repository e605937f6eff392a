"""Standing robots, and the load on each of their feet: a table of `make scenes`."""

from dataclasses import dataclass

import robots
from scenes import GROUND, Robot, Scene, a1, stance


@dataclass
class Standing:
    scene: Scene
    feet: dict
    """Links of a foot by name. If two links are fixed to each other, simulators differ in the link that they
    report as touching."""

    def forces(self, view):
        """Returns the load on each foot, N."""
        each = iter(view.forces)
        return [sum(next(each) for _ in links) for links in self.feet.values()]


def standing(name, seconds, robot, feet):
    watch = [[robot.name, link] for links in feet.values() for link in links]
    return Standing(Scene(name, seconds, [seconds / 2, seconds], [GROUND], [robot], watch=watch), feet)


def shown():
    """Time until springs of joints that sway have come to rest."""
    legs = {"front right": "FR", "front left": "FL", "rear right": "RR", "rear left": "RL"}
    moving = [joint.get("name") for joint in robots.read("humanoid/urdf/humanoid.urdf").findall("joint")
              if joint.get("type") != "fixed"]
    humanoid = Robot("humanoid", "humanoid/urdf/humanoid.urdf", [0.0, 0.0, 1.01], False, friction=0.8,
                     joints=dict.fromkeys(moving, 0.0), gains=dict.fromkeys(moving, [5000.0, 400.0]))
    return [
        standing("an A1 stands", 12.0, a1([100.0, 4.0], stance(), 0.8),
                 {name: [f"{leg}_toe", f"{leg}_lower"] for name, leg in legs.items()}),
        standing("a humanoid stands", 24.0, humanoid, {"left": ["left_foot"], "right": ["right_foot"]}),
    ]
