"""Collects states in lockstep and plots them: the response of an arm to a step of its target.

Needs matplotlib: `pip install 'matplotlib>=3.6'`. An argument is the file to write, by default `plots.png`. A
notebook shows the figure automatically.
"""

import sys
from contextlib import ExitStack
from pathlib import Path

import simd_client
from simd_client import RobotState, Target

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"


def main() -> None:
    """Plots a soft and a stiff elbow beside each other."""
    file = Path(sys.argv[1] if len(sys.argv) > 1 else "plots.png")
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.001)
        arm = sim.load(ROBOT, "plotted_arm", fixed=True, allow_renaming=True)
        cleanup.callback(arm.delete)
        states: list[RobotState] = []
        for stiffness in (5.0, 50.0):
            arm.reset_joints()
            arm.set_targets({"elbow joint": Target.position(0.5, stiffness=stiffness)})
            states += [sim.step(10, states=arm)[arm] for _ in range(100)]
            settled = states[-1]["elbow joint"].position
            print(f"with {stiffness:g} N m/rad the elbow is {abs(0.5 - settled):.4f} rad from its target")
        figure = arm.plot(states, what=("position", "target", "effort"), joints=["elbow joint"])
        figure.savefig(file)
        print(f"wrote {file.name}")


if __name__ == "__main__":
    main()
