#!/usr/bin/env python3
"""Makes truth.json: exact positions of the robots of cases.py at a few instants, and MuJoCo's error there.

The reference is Pinocchio's dynamics, integrated until the step no longer matters (exact.py). The suite
tests/physics holds simd's error to these figures; `make truth` makes its plots from the same cases.
"""

import time
from math import isfinite
from pathlib import Path

import mujoco
import pinocchio as pin

import exact
import in_mujoco
import json_lines
from cases import TIME_STEPS, cases

HERE = Path(__file__).resolve().parent
LOOKS = 4
"""Number of instants of a case."""
UNSTABLE = 10.0
"""Error, rad or m, from which a run counts as diverged. MuJoCo resets values that become infinite."""


def main():
    out = []
    for case in cases():
        instants = [round(case.seconds * (k + 1) / LOOKS, 6) for k in range(LOOKS)]
        started = time.time()
        views, changed = exact.reference(case, instants)
        errors = []
        for time_step in TIME_STEPS:
            seen = in_mujoco.run(case, time_step, instants)
            error = max(exact.difference(a, b) for a, b in zip(seen, views))
            errors.append(error if isfinite(error) and error < UNSTABLE else None)
        print(f"{case.name:36} {time.time() - started:5.1f} s, reference to {changed:.0e}; MuJoCo",
              " ".join("unstable" if error is None else f"{error:.1e}" for error in errors), flush=True)
        made = case.request() | {"instants": instants, "accuracy": float(f"{changed:.0e}"),
                                 "positions": [view[0].tolist() for view in views]}
        if case.free:
            made["root"] = [view[1].tolist() for view in views]
        made["mujoco"] = [{"time_step": h, "error": error} for h, error in zip(TIME_STEPS, errors)]
        out.append(made)
    made_by = f"make_truth.py with Pinocchio {pin.__version__} and MuJoCo {mujoco.__version__}"
    (HERE / "truth.json").write_text(json_lines.text({"made_by": made_by, "cases": out}))


if __name__ == "__main__":
    main()
