"""Swings up a pole that hangs from a cart, by path integral control (Williams et al., "Information theoretic
MPC", 2017).

Fifty times a simulated second copies of the world try changes of the plan. The plan becomes their mean,
weighted by their costs.
"""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np

import simd_client
from simd_client import Control, Cost, Observation, Robot, Rollout, Simulation, Target
from simd_client.geometry import FloatArray

ROBOT = Path(__file__).parent / "robots" / "cart_pole.urdf"
COPIES, KNOTS, STEPS = 96, 50, 4  # Knots of a plan, one per turn; a turn is 4 steps of 5 ms
FORCE, DEVIATION = 20.0, 10.0  # newtons


def costs_of(cart: Robot) -> list[Cost]:
    """Costs: the pole should be upright, the cart in the middle, and both at rest."""
    return [
        Cost.joint_positions(cart, ["pole"], wrapped=True),
        Cost.joint_positions(cart, ["slide"], weight=0.5),
        Cost.joint_velocities(cart, ["slide", "pole"], weight=0.02),
    ]


def improved(
    sim: Simulation, cart: Robot, costs: list[Cost], plan: FloatArray, random: np.random.Generator, settled: int = 0
) -> tuple[FloatArray, Rollout]:
    """Returns a better plan, with its copies; its first `settled` knots stay unchanged."""
    # Forces that last for five turns reach further than forces that change each turn.
    noise = np.repeat(random.normal(0.0, DEVIATION, (COPIES, KNOTS // 5, 1)), 5, axis=1)
    noise[:, :settled] = 0.0
    tried = np.clip(plan + noise, -FORCE, FORCE)
    control = Control(cart, tried, ["slide"], "effort", knot_steps=STEPS)
    seen = [Observation("joint_positions", cart, ["slide", "pole"])]
    found = sim.rollout(KNOTS * STEPS, [control], costs=costs, observe=seen, record_start=True)
    # A copy that ended early has infinite costs.
    spread = found.costs[np.isfinite(found.costs)].std()
    weights = np.exp((found.costs.min() - found.costs) / (0.1 * spread + 1e-9))
    return (weights[:, None, None] * tried).sum(axis=0) / weights.sum(), found


def main() -> None:
    """Swings the pole up in a world that waits for each turn."""
    random = np.random.default_rng(1)
    with simd_client.connect() as sim, ExitStack() as cleanup:
        sim.pause()
        cleanup.callback(sim.set_physics, time_step=sim.physics.time_step)
        sim.set_physics(time_step=0.005)
        hangs = {"pole": np.pi}
        cart = sim.load(ROBOT, "cart_pole", fixed=True, passive=True, joint_positions=hangs, allow_renaming=True)
        cleanup.callback(cart.delete)
        costs = costs_of(cart)
        plan: FloatArray = np.zeros((KNOTS, 1))
        state = sim.states(cart)[cart]
        for _ in range(200):
            plan, _ = improved(sim, cart, costs, plan, random)
            force = Target.effort(float(plan[0, 0]))
            state = sim.step(STEPS, {cart: {"slide": force}}, states=cart)[cart]
            plan = np.vstack([plan[1:], plan[-1:]])
        slide, pole = state.position
        lean = np.abs((pole + np.pi) % (2 * np.pi) - np.pi)
        found = "upright" if lean < 0.3 else "not upright"
        print(f"after 4 s the pole is {found}: {lean:.2f} rad, {slide:.2f} m aside")


if __name__ == "__main__":
    main()
