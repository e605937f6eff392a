"""Walks: a crawl on four legs, as a pattern of targets in lockstep. The robot is a xacro file, with an argument.

Needs ROS's own package for xacro: `pip install 'xacro>=2.1,<3'`.
"""

import math
from contextlib import ExitStack
from pathlib import Path

import simd_client

WALKER = Path(__file__).parent / "robots" / "walker.urdf.xacro"
LEG = 0.2  # metres
PERIOD = 0.5  # seconds of a stride
REACH = 0.15  # radians that a leg swings to either side
# Metres that a foot is lifted. With 0.05, targets every 10 ms jerk the legs so much that the body may, by
# chance, begin to rock from side to side. It then gets half as far.
LIFT = 0.035
STANCE = 0.75  # Fraction of a stride with a foot on the ground: one foot is in the air at a time
PHASES = {"front_left": 0.0, "back_right": 0.25, "front_right": 0.5, "back_left": 0.75}


def pattern(time: float) -> dict[str, float]:
    """Returns joint positions: a foot on the ground moves back, a foot in the air moves forward."""
    targets: dict[str, float] = {}
    for leg, phase in PHASES.items():
        part = (time / PERIOD + phase) % 1.0
        if part < STANCE:
            swing, lift = 2.0 * part / STANCE - 1.0, 0.0
        else:
            angle = math.pi * (part - STANCE) / (1.0 - STANCE)
            swing, lift = math.cos(angle), math.sin(angle)
        # The hip turns about y: at a positive angle the foot is behind it.
        targets[f"{leg}_hip"] = REACH * swing
        targets[f"{leg}_leg"] = LIFT * lift
    return targets


def main() -> None:
    """Walks for five seconds, and prints the distance."""
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.001)
        # The robot stands next to everything that is in the world already.
        y = 10 + max((robot.pose.position[1] for robot in sim.robots.values()), default=0.0)
        ground = sim.add_plane(friction=1.0)
        cleanup.callback(ground.delete)
        walker = sim.load(
            WALKER,
            "walker",
            allow_renaming=True,
            position=(0, y, LEG + 0.025),
            xacro_arguments={"leg": LEG},
        )
        cleanup.callback(walker.delete)
        sim.step(200)
        begin = walker.pose.position
        for turn in range(500):
            sim.step(10, {walker: pattern(0.01 * turn)})
        moved = walker.pose.position - begin
        print(f"walked {moved[0]:.2f} m along x and {moved[1]:.2f} m aside; the body is {moved[2]:+.3f} m higher")


if __name__ == "__main__":
    main()
