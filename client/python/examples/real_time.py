"""A controller in real time: the world plays, and the loop follows it at 100 Hz.

States arrive as they are published, and targets are sent without waiting for an answer. A late reader skips
states and never sees old ones.
"""

import math
from contextlib import ExitStack
from pathlib import Path

import simd_client

ROBOT = Path(__file__).parents[3] / "tests" / "assets" / "Two Link.v2"
RATE = 100.0  # turns per simulated second
SECONDS = 2.0


def main() -> None:
    """Swings both joints, and prints how well it kept time."""
    with simd_client.connect() as sim, ExitStack() as cleanup:
        arm = sim.load(ROBOT, "swinging_arm", fixed=True, allow_renaming=True)
        cleanup.callback(arm.delete)
        cleanup.callback(sim.pause)
        sim.play()
        begin = sim.stamp.sim_time
        due, turns, worst = begin, 0, 0.0
        with arm.watch(rate=RATE) as states:
            for state in states:
                now = state.stamp.sim_time
                if now - begin >= SECONDS:
                    break
                worst = max(worst, now - due)
                due = now + 1.0 / RATE
                angle = 0.4 * math.sin(2.0 * math.pi * 0.5 * (now - begin))
                arm.stream_targets([angle, -angle])
                turns += 1
        print(f"real-time factor {sim.statistics.real_time_factor:.2f}")
        print(f"{turns} turns in {SECONDS} simulated seconds, the latest {1000.0 * worst:.1f} ms late")


if __name__ == "__main__":
    main()
