"""A rollout that two daemons behind a router share, beside the same of one of them. Each daemon has one processor.

    python benches/shared_rollouts.py [--copies 2048] [--steps 200]

Prints the median milliseconds of calls that take their places by turns. SIMD_BINARY says which daemon.
"""

from __future__ import annotations

import argparse
import os
import socket
import statistics
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

import simd_client
from simd_client import Control, Cost, Simulation

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from daemon import ASSETS, Daemon

CALLS = 9


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--copies", type=int, default=2048)
    parser.add_argument("--steps", type=int, default=200)
    asked = parser.parse_args()
    processors = sorted(os.sched_getaffinity(0))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        router = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    settings: Any = zenoh.Config()
    settings.insert_json5("mode", '"router"')
    settings.insert_json5("listen/endpoints", f'["{router}"]')
    settings.insert_json5("scouting/multicast/enabled", "false")
    opened: Any = zenoh.open(settings)
    with opened, on(processors[:1], router, "one") as first, on(processors[1:2], router, "two") as second:
        os.sched_setaffinity(0, processors)
        assert first.process.pid != second.process.pid
        one, two = simd_client.connect(router, "one"), simd_client.connect(router, "two")
        arm = one.load(ASSETS / "seven_arm", "arm", fixed=True)
        one.save_state("begin")
        one.share_state("begin", [two])
        tried = np.random.default_rng(1).normal(0.0, 0.3, (asked.copies, asked.steps // 20 + 1, 7))
        control = Control(arm, tried, knot_steps=20)
        kinds: dict[str, list[Simulation]] = {"one daemon": [], "two daemons": [two]}
        took: dict[str, list[float]] = {name: [] for name in kinds}
        costs: dict[str, Any] = {}
        for _ in range(CALLS):
            for name, daemons in kinds.items():
                begin = time.perf_counter()
                found = one.rollout(
                    asked.steps, [control], costs=[Cost.joint_efforts(arm)], saved_state="begin", daemons=daemons
                )
                took[name].append(time.perf_counter() - begin)
                costs[name] = found.costs
        one.close()
        two.close()
    same = np.array_equal(*costs.values())
    print(f"{asked.copies} copies of seven_arm, {asked.steps} steps; equal to the bit: {same}")
    for name, of in took.items():
        print(f"{name:12} {1e3 * statistics.median(of):8.1f} ms, fastest {1e3 * min(of):.1f} ms")


def on(processors: Iterable[int], router: str, name: str) -> Daemon:
    """A daemon on these processors, which its threads inherit from this process."""
    os.sched_setaffinity(0, processors)
    return Daemon("--paused", "--zenoh-connect", router, name=name)


if __name__ == "__main__":
    main()
