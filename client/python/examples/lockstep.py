"""A custom controller in lockstep: the world waits for each turn of the loop, so that each run is the same.

A turn is two round trips: one for efforts, and one for ten steps with them, with the state in the answer.
"""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

import simd_client
from simd_client import Whole

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "seven_arm"
STIFFNESS, DAMPING = 100.0, 20.0  # 1/s^2 and 1/s: critically damped, a time constant of 0.1 s


def main() -> None:
    """Applies computed torque: the efforts that give each joint the acceleration of a spring and damper at
    its goal."""
    goal = np.array([0.3, 0.4, -0.2, 0.8, 0.1, -0.5, 0.2])
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.001)
        arm = sim.load(ROBOT, "lockstep_arm", fixed=True, passive=True, allow_renaming=True)
        cleanup.callback(arm.delete)
        state = first = sim.states(arm)[arm]
        for _ in range(300):
            wanted = STIFFNESS * (goal - state.position) - DAMPING * state.velocity
            # The daemon knows the robot's dynamics, and takes gravity into account.
            efforts = arm.inverse_dynamics(wanted)
            state = sim.step(10, {arm: Whole.efforts(efforts)}, states=arm)[arm]
        seconds = state.stamp.sim_time - first.stamp.sim_time
        print(f"largest error {np.abs(goal - state.position).max():.4f} rad after {seconds:.2f} s")


if __name__ == "__main__":
    main()
