"""Swings a pole up that hangs from a cart, by path integral control (Williams et al., "Information theoretic MPC", 2017).

Fifty times a simulated second copies of the world try changes of the plan, and the plan becomes their mean, weighted by what they cost.
"""

from pathlib import Path

import numpy as np

import simd_client
from simd_client import Control, Cost, Target

ROBOT = Path(__file__).parent / "robots" / "cart_pole.urdf"
COPIES, KNOTS, STEPS = 96, 50, 4  # of a plan, one knot a turn; a turn is 4 steps of 5 ms
FORCE, DEVIATION = 20.0, 10.0  # newtons


def main() -> None:
    """The pole is to be upright, the cart in the middle."""
    random = np.random.default_rng(1)
    with simd_client.connect() as sim:
        sim.pause()
        before = sim.physics.time_step
        sim.set_physics(time_step=0.005)
        hangs = {"pole": np.pi}
        cart = sim.load(ROBOT, "cart_pole", fixed=True, passive=True, joint_positions=hangs, allow_renaming=True)
        costs = [
            Cost.joint_positions(cart, ["pole"], wrapped=True),
            Cost.joint_positions(cart, ["slide"], weight=0.5),
            Cost.joint_velocities(cart, ["slide", "pole"], weight=0.02),
        ]
        plan = np.zeros((KNOTS, 1))
        state = sim.states(cart)[cart]
        for _ in range(200):
            # Forces that last for five turns reach further than ones that change each turn.
            noise = np.repeat(random.normal(0.0, DEVIATION, (COPIES, KNOTS // 5, 1)), 5, axis=1)
            tried = np.clip(plan + noise, -FORCE, FORCE)
            control = Control(cart, tried, ["slide"], "effort", knot_steps=STEPS)
            found = sim.rollout(KNOTS * STEPS, [control], costs=costs)
            weights = np.exp((found.costs.min() - found.costs) / (0.1 * found.costs.std() + 1e-9))
            plan = (weights[:, None, None] * tried).sum(axis=0) / weights.sum()
            force = Target.effort(float(plan[0, 0]))
            state = sim.step(STEPS, {cart: {"slide": force}}, states=cart)[cart]
            plan = np.vstack([plan[1:], plan[-1:]])
        slide, pole = state.position
        lean = np.abs((pole + np.pi) % (2 * np.pi) - np.pi)
        found = "upright" if lean < 0.3 else "not upright"
        print(f"after 4 s the pole is {found}: {lean:.2f} rad, {slide:.2f} m aside")
        cart.delete()
        sim.set_physics(time_step=before)


if __name__ == "__main__":
    main()
