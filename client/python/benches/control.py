"""Predictive control by rollouts from another process, fifty times a second, in a real-time world.

    python benches/control.py [--starts 20] [--seed 1] [--lockstep] [--out target/rollouts/control.png]

A pole is swung up on a cart, and an arm reaches past a post, each from several starts. Prints the number of
successes, and the duration of a call over Zenoh and back; draws both. With --lockstep the worlds wait for
each turn, so that any machine is fast enough. SIMD_BINARY selects the daemon.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from plotting import TARGET, save, subplots

import simd_client
from simd_client import Simulation, Target
from simd_client.geometry import FloatArray

sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in ("tests", "examples")]
import cart_pole
import reaching
from daemon import Daemon

TURN = 0.02  # seconds
UPRIGHT, HELD = 0.3, 2.0  # rad, and for how long: seconds
SECONDS = 10.0  # within this simulated time
SPREAD = 0.2  # of starts: rad, m, rad/s and m/s


@dataclass(frozen=True)
class Swing:
    """Result of one start of the pole."""

    reached: bool
    seconds: float
    """Simulated seconds until the pole was upright and stayed so."""
    calls: list[float]
    """Wall seconds of each rollout."""
    times: list[float]
    leans: list[float]
    """rad from upright, of each turn."""


def main() -> None:
    """Prints a table, and draws."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--lockstep", action="store_true")
    parser.add_argument("--out", type=Path, default=TARGET / "control.png")
    asked = parser.parse_args()
    print(f"{'':22}{'reached':>10}{'median':>9}{'calls':>8}{'p50':>9}{'p99':>9}{'largest':>9}{'late':>8}{'behind':>8}")
    print(f"{'':22}{'':>10}{'s':>9}{'':>8}{'ms':>9}{'ms':>9}{'ms':>9}{'turns':>8}{'times':>8}")
    swings: list[Swing] = table("pole on a cart", swing_up, asked)
    reaches: list[reaching.Trial] = table("arm past a post", reaching.trials, asked)
    touched = sum(each.touched for each in reaches)
    print(f"the arm touched something in {touched} of {asked.starts}; a turn is late if its call takes more than 20 ms, and")
    print("behind is how often the world itself fell so far behind real time that it gave up the lag")
    draw(swings, reaches, asked.seed, asked.out)


def table(
    name: str, trials: Callable[[Simulation, int, int, bool], Iterator[Any]], asked: argparse.Namespace
) -> list[Any]:
    """Runs them with a separate daemon, and prints a line."""
    with Daemon("--paused") as daemon, simd_client.connect(daemon.endpoint) as sim:
        done = list(trials(sim, asked.starts, asked.seed, asked.lockstep))
        behind = sim.statistics.overruns
    calls = np.array([call for each in done for call in each.calls])
    reached = [each.seconds for each in done if each.reached]
    median = f"{np.median(reached):.1f}" if reached else "-"
    p50, p99 = np.percentile(1e3 * calls, [50, 99])
    late = f"{np.mean(calls > TURN):.1%}"
    print(
        f"{name:22}{f'{len(reached)} of {asked.starts}':>10}{median:>9}{len(calls):8}{p50:9.1f}{p99:9.1f}"
        f"{1e3 * calls.max():9.1f}{late:>8}{behind:8}",
        flush=True,
    )
    return done


def swing_up(sim: Simulation, starts: int, seed: int, lockstep: bool) -> Iterator[Swing]:
    """Swings the pole up from several starts, around its hanging position, one after the other."""
    random = np.random.default_rng(seed)
    sim.set_physics(time_step=TURN / cart_pole.STEPS)
    cart = sim.load(cart_pole.ROBOT, "cart_pole", fixed=True, passive=True, joint_positions={"pole": np.pi})
    costs = cart_pole.costs_of(cart)
    for _ in range(starts):
        sim.pause()
        slide, pole, *velocities = random.normal(0.0, SPREAD, 4).tolist()
        cart.reset_joints({"slide": slide, "pole": np.pi + pole}, dict(zip(("slide", "pole"), velocities)))
        cart.set_targets({"slide": Target.effort(0.0)})
        plan: FloatArray = np.zeros((cart_pole.KNOTS, 1))
        calls, times, leans = list[float](), list[float](), list[float]()
        if not lockstep:
            sim.play()
        begin, at = sim.stamp.sim_time, 0.0
        since: float | None = None
        turn = time.monotonic()
        while at < SECONDS and (since is None or at - since < HELD):
            # While the copies are computed the world continues with the first knot, which was sent before.
            asked_at = time.monotonic()
            plan, found = cart_pole.improved(sim, cart, costs, plan, random, settled=1)
            calls.append(time.monotonic() - asked_at)
            if lockstep:
                sim.step(cart_pole.STEPS)
                over = 1
            else:
                time.sleep(max(0.0, turn + TURN - time.monotonic()))
                # One knot is over, or more if the call was late.
                over = round((time.monotonic() - turn) / TURN)
            turn = time.monotonic()
            last = np.repeat(plan[-1:], min(over, len(plan)), axis=0)
            plan = np.vstack([plan[over:], last])
            cart.stream_targets({"slide": Target.effort(float(plan[0, 0]))})
            at = found.start.sim_time - begin
            lean = float(found.observations[0][0, 0, 1])
            lean = (lean + np.pi) % (2 * np.pi) - np.pi
            times.append(at)
            leans.append(lean)
            since = (at if since is None else since) if abs(lean) < UPRIGHT else None
        reached = since is not None and at - since >= HELD
        yield Swing(reached, at if since is None else since, calls, times, leans)
    sim.pause()
    cart.delete()


def draw(swings: list[Swing], reaches: list[reaching.Trial], seed: int, path: Path) -> None:
    """Draws leans over time, paths of the hand from above, and durations of calls."""
    figure, (poles, hands, calls) = subplots(
        3, f"rollouts from a remote process at 50 Hz, the world in real time: {len(swings)} starts each, seed {seed}"
    )
    for each in swings:
        poles.plot(each.times, np.abs(each.leans), lw=0.9, color="C0" if each.reached else "C3")
    poles.axhline(UPRIGHT, color="0.5", lw=0.8, ls="--")
    poles.set(xlabel="simulated seconds", ylabel="rad from upright", title=f"pole: {count(swings)} (red: not)")
    for trial in reaches:
        hands.plot(trial.path[:, 0], trial.path[:, 1], lw=0.9, color="C0" if trial.reached else "C3")
        hands.plot(*trial.path[0, :2], ".", color="0.4", ms=4)
    if reaches:
        hands.plot(*reaches[0].goal[:2], "*", color="C2", ms=12)
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    x, y = reaching.POST
    hands.fill(x + reaching.RADIUS * np.cos(angles), y + reaching.RADIUS * np.sin(angles), color="0.3")
    hands.set(xlabel="x, m", ylabel="y, m", title=f"hand and post from above: {count(reaches)} (red: not)")
    hands.set_aspect("equal", adjustable="datalim")
    for name, trials in (("pole on a cart", swings), ("arm past a post", reaches)):
        took = np.sort([1e3 * call for each in trials for call in each.calls])
        calls.plot(took, np.arange(1, len(took) + 1) / len(took), label=name)
    calls.axvline(1e3 * TURN, color="0.5", lw=0.8, ls="--")
    calls.set_xscale("log")
    calls.set(xlabel="ms a call", ylabel="part of the calls", title="time a call (dashed: a turn)")
    calls.legend()
    save(figure, path)


def count(trials: list[Swing] | list[reaching.Trial]) -> str:
    """Returns the number of successes."""
    return f"{sum(each.reached for each in trials)} of {len(trials)}"


if __name__ == "__main__":
    main()
