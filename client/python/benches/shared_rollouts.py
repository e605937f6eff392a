"""A rollout that two daemons behind a router share, compared with one of them.

    python benches/shared_rollouts.py [--copies 2048] [--steps 200] [--calls 9] [--killed 5]

Each daemon has one processor. In a third variant one of them is killed in the middle. Prints the median
milliseconds of alternating calls. A killed daemon is another one for each call, on the second processor, and
ends once half of the copies are done. SIMD_BINARY selects the daemon.
"""

from __future__ import annotations

import argparse
import os
import socket
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

import simd_client
from simd_client import Control, Cost, Simulation

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from daemon import ASSETS, Daemon

def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--copies", type=int, default=2048)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--calls", type=int, default=9)
    parser.add_argument("--killed", type=int, default=5, help="number of calls in which a daemon is killed")
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
        costs = [Cost.joint_efforts(arm)]

        def call(daemons: list[Simulation], progress: Callable[[int, int], object] | None = None) -> tuple[float, Any]:
            """Returns seconds, and the costs of the copies."""
            begin = time.perf_counter()
            found = one.rollout(
                asked.steps, [control], costs=costs, saved_state="begin", daemons=daemons, progress=progress
            )
            return time.perf_counter() - begin, found.costs

        kinds: dict[str, list[Simulation]] = {"one daemon": [], "two daemons": [two]}
        took: dict[str, list[float]] = {name: [] for name in kinds}
        _, expected = call([])
        are_same = True
        for _ in range(asked.calls):
            for name, daemons in kinds.items():
                seconds, found = call(daemons)
                took[name].append(seconds)
                are_same &= np.array_equal(found, expected)
        two.close()
        done: list[int] = []
        for number in range(asked.killed):
            with on(processors[1:2], router, f"killed-{number}") as other:
                os.sched_setaffinity(0, processors)
                with simd_client.connect(router, other.name) as there:
                    one.share_state("begin", [there])
                    seconds, found = call([there], killer(other, done))
            if len(done) != number + 1:
                raise SystemExit("the rollout was over before a daemon could be killed: ask for more copies")
            took.setdefault("one of two killed", []).append(seconds)
            are_same &= np.array_equal(found, expected)
        one.close()
    print(f"{asked.copies} copies of seven_arm, {asked.steps} steps; equal to the bit: {are_same}")
    for name, of in took.items():
        print(f"{name:18} {1e3 * statistics.median(of):8.1f} ms, {1e3 * min(of):.1f} to {1e3 * max(of):.1f} ms")
    if done:
        parts = ", ".join(f"{count / asked.copies:.0%}" for count in done)
        print(f"killed once {parts} of the copies were done")


def killer(daemon: Daemon, done: list[int]) -> Callable[[int, int], None]:
    """Kills a daemon once half of the copies are done, and records their number."""

    def kill(copies: int, of: int) -> None:
        if daemon.process.poll() is None and 2 * copies >= of > copies:
            done.append(copies)
            daemon.kill()

    return kill


def on(processors: Iterable[int], router: str, name: str) -> Daemon:
    """Starts a daemon on these processors, which its threads inherit from this process."""
    os.sched_setaffinity(0, processors)
    return Daemon("--paused", "--zenoh-connect", router, name=name)


if __name__ == "__main__":
    main()
