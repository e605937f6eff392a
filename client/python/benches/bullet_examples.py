"""Runs PyBullet's own example scripts on PyBullet and on simd, without a window, and prints a table.

    python bullet_examples.py FOLDER [SCRIPT ...]

FOLDER has the scripts: `examples/pybullet/examples` of Bullet's repository, or with --all and `examples/pybullet/gym` those of the
folders below it, which need the package `gym`. Each runs in a process of its own in a copy of its folder, with a clock that `sleep` and
steps move on, until its end or its 240th step. What needs a window has the answers of one that is left alone. The last
lines are a table for docs/pybullet.md.
"""

# PyBullet has no types.
# pyright: basic, reportAttributeAccessIssue=false

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

STEPS = 240
CALLS = 20_000
SECONDS = 90.0
# What getDebugVisualizerCamera returns in a window that was just opened.
UNIT = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
CAMERA = (1024, 768, UNIT, UNIT, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 50.0, -35.0, 5.0, (0.0, 0.0, 0.0))


class Watched:
    """One script on one of the two, in this process."""

    def __init__(self, module: Any, name: str, result: Path) -> None:
        self.module = module
        self.is_real = name == "pybullet"
        self.result = result
        self.steps = 0
        self.calls = 0
        self.clock = 1.7e9
        self.sliders: dict[int, float] = {}
        self.plays = False
        self.original = {
            key: getattr(module, key) for key in dir(module) if callable(getattr(module, key)) and key[0].islower()
        }
        self.used: set[str] = set()
        self.real_sleep: Any = None

    def install(self) -> None:
        """Wraps each function of the module."""
        import builtins
        import time

        for name, function in self.original.items():
            if name != "error":
                setattr(self.module, name, self.wrapped(name, getattr(self, name, function)))
        self.real_sleep, time.sleep = time.sleep, self.sleep
        time.time = lambda: self.clock
        builtins.input = lambda *_: ""

    def wrapped(self, name: str, function: Any) -> Any:
        def call(*arguments: Any, **named: Any) -> Any:
            self.used.add(name)
            # Pictures take Bullet a long time each.
            self.calls += 400 if name == "getCameraImage" else 1
            self.clock += 1e-4
            answer = function(*arguments, **named)
            if self.calls >= CALLS:
                self.end("cap")
            return answer

        return call

    # What differs from the module itself.

    def connect(self, mode: int, *arguments: Any, **named: Any) -> int:
        windows = {self.module.GUI, self.module.SHARED_MEMORY, self.module.GUI_SERVER, self.module.DIRECT}
        if mode not in windows:
            return self.original["connect"](mode, *arguments, **named)
        return self.original["connect"](self.module.DIRECT, **({} if self.is_real else {"options": "--new"}))

    def disconnect(self, *arguments: Any, **named: Any) -> None:
        import time

        if not self.result.exists():
            self.write("end", "")
        # A script that waits for the end of a daemon sleeps in earnest.
        time.sleep = self.real_sleep
        self.original["disconnect"](*arguments, **named)

    def stepSimulation(self, *arguments: Any, **named: Any) -> Any:
        answer = self.original["stepSimulation"](*arguments, **named)
        self.steps += 1
        self.clock += 1 / 240
        if self.steps >= STEPS:
            self.end("cap")
        return answer

    def setRealTimeSimulation(self, enableRealTimeSimulation: int, physicsClientId: int = 0) -> None:
        """The clock is not the wall's: `sleep` does the steps."""
        self.plays = bool(enableRealTimeSimulation)

    def sleep(self, seconds: float) -> None:
        self.calls += 1
        self.clock += seconds
        if self.plays:
            for _ in range(min(max(1, round(seconds * 240)), STEPS)):
                self.stepSimulation()
        if self.calls >= CALLS:
            self.end("cap")

    def addUserDebugParameter(self, paramName: str, rangeMin: float = 0, rangeMax: float = 1, startValue: float = 0, physicsClientId: int = 0) -> int:
        number = self.original["addUserDebugParameter"](paramName, rangeMin, rangeMax, startValue, physicsClientId=physicsClientId)
        if self.is_real:
            number = len(self.sliders)
            self.sliders[number] = startValue
        return number

    def readUserDebugParameter(self, itemUniqueId: int, physicsClientId: int = 0) -> float:
        return self.sliders[itemUniqueId] if self.is_real else self.original["readUserDebugParameter"](itemUniqueId, physicsClientId)

    def getDebugVisualizerCamera(self, *arguments: Any, **named: Any) -> Any:
        return CAMERA if self.is_real else self.original["getDebugVisualizerCamera"](*arguments, **named)

    # The end.

    def end(self, how: str, why: str = "") -> None:
        self.write(how, why)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)

    def write(self, how: str, why: str) -> None:
        try:
            state = self.state()
        except Exception as problem:
            state, why = None, why or f"end state: {problem}"
        found = {"end": how, "why": why, "steps": self.steps, "calls": self.calls, "used": sorted(self.used), "state": state}
        self.result.write_text(json.dumps(found))

    def state(self) -> list[Any]:
        """Base pose and joint positions of each body."""
        p = self.original
        bodies: list[Any] = []
        for index in range(p["getNumBodies"]()):
            body = p["getBodyUniqueId"](index)
            position, orientation = p["getBasePositionAndOrientation"](body)
            joints = [
                p["getJointState"](body, joint)[0]
                for joint in range(p["getNumJoints"](body))
                if p["getJointInfo"](body, joint)[2] in (0, 1)
            ]
            bodies.append([list(position), list(orientation), joints])
        return bodies


def child(name: str, script: str, result: Path) -> None:
    """Runs one script on `pybullet` or `simd`."""
    import runpy
    import traceback

    if name == "simd":
        import simd_client.pybullet as module
        from simd_client.pybullet import __main__ as runner

        stand_in = getattr(runner, "stand_in")
        stand_in() if callable(stand_in) else stand_in.replace(module)
    else:
        import pybullet as module
    watched = Watched(module, name, result)
    watched.install()
    sys.argv = [script]
    sys.path[0] = os.getcwd()
    try:
        runpy.run_path(script, run_name="__main__")
        how, why = "end", ""
    except SystemExit:
        how, why = "end", ""
    except BaseException as problem:
        traceback.print_exc()
        how, why = "error", f"{type(problem).__name__}: {problem}".splitlines()[0][:200]
    if how == "error" or not result.exists():
        watched.end(how, why)
    os._exit(0)


def run(folder: Path, script: str, name: str) -> dict[str, Any]:
    """The result of a script in a process of its own. It may be in a folder below."""
    folder, script = (folder / script).parent, Path(script).name
    with tempfile.TemporaryDirectory() as scratch:
        for entry in folder.iterdir():
            os.symlink(entry.resolve(), Path(scratch) / entry.name)
        # Scripts write beside their data.
        result = Path(scratch) / "result.json"
        command = [sys.executable, "-W", "ignore", __file__, "--child", name, script, str(result)]
        environment = {**os.environ, "MPLBACKEND": "Agg"}
        try:
            ran = subprocess.run(
                command, cwd=scratch, env=environment, capture_output=True, text=True, errors="replace",
                stdin=subprocess.DEVNULL, timeout=SECONDS,
            )
        except subprocess.TimeoutExpired:
            return {"end": "timeout", "why": f"no end after {SECONDS:g} s", "state": None, "steps": 0, "used": []}
        if not result.exists():
            last = (ran.stderr.strip().splitlines() or [""])[-1]
            return {"end": "died", "why": f"exit code {ran.returncode}: {last[:150]}", "state": None, "steps": 0, "used": []}
        found = json.loads(result.read_text())
        found["said"] = [line for line in ran.stderr.splitlines() if line.startswith("simd: ")]
        return found


def compared(ours: Any, theirs: Any) -> str:
    """The largest differences of base positions and of joints."""
    if ours is None or theirs is None:
        return ""
    if len(ours) != len(theirs):
        return f"{len(ours)} bodies, {len(theirs)} there"
    if not ours:
        return "no bodies"
    far, joint, odd = 0.0, 0.0, 0
    for a, b in zip(ours, theirs):
        far = max(far, math.dist(a[0], b[0]))
        if len(a[2]) != len(b[2]):
            odd += 1
            continue
        joint = max([joint, *(abs(x - y) for x, y in zip(a[2], b[2]))])
    text = f"{far:.2g} m"
    if any(a[2] for a in ours):
        text += f", {joint:.2g} rad"
    return text + (f", {odd} bodies with other joints" if odd else "")


def main() -> None:
    """Runs all of them, two at a time."""
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], sys.argv[3], Path(sys.argv[4]))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("scripts", nargs="*")
    parser.add_argument("--all", action="store_true", help="those of all folders below, too")
    parser.add_argument("--json", type=Path, help="write the results there; those of PyBullet that are there are not made again")
    parser.add_argument("--table", action="store_true", help="run nothing, and print the table of --json")
    asked = parser.parse_args()
    found = asked.folder.rglob("*.py") if asked.all else asked.folder.glob("*.py")
    scripts = asked.scripts or sorted(str(path.relative_to(asked.folder)) for path in found)
    kept: dict[str, Any] = json.loads(asked.json.read_text()) if asked.json and asked.json.exists() else {}

    def both(script: str) -> tuple[str, dict[str, Any], dict[str, Any]]:
        theirs = kept.get(script, {}).get("pybullet") or run(asked.folder, script, "pybullet")
        ours = run(asked.folder, script, "simd")
        print(script, theirs["end"], theirs["why"], "|", ours["end"], ours["why"], "|", compared(ours["state"], theirs["state"]), flush=True)
        return script, theirs, ours

    if asked.table:
        rows = [(script, kept[script]["pybullet"], kept[script]["simd"]) for script in sorted(kept)]
    else:
        with ThreadPoolExecutor(2) as pool:
            rows = list(pool.map(both, scripts))
    for script, theirs, ours in rows:
        kept[script] = {"pybullet": theirs, "simd": ours}
    if asked.json:
        asked.json.write_text(json.dumps(kept))
    print()
    there = [row for row in rows if row[1]["end"] in ("cap", "end")]
    here = [row for row in there if row[2]["end"] == row[1]["end"]]
    print(f"{len(rows)} scripts; {len(there)} reach their end on PyBullet, {len(here)} of them on simd\n")
    print("| script | reaches its end on simd | PyBullet | simd | end states differ by |\n|---|---|---|---|---|")
    for row in rows:
        script, theirs, ours = row
        reaches = "yes" if row in here else "no" if row in there else ""
        differ = compared(ours["state"], theirs["state"]) if row in here else ""
        print(f"| {script.removesuffix('.py')} | {reaches} | {_shown(theirs)} | {_shown(ours)} | {differ} |")


# What is said of a failure in the table, by a part of its message.
REASONS = {
    "loadSoftBody": "needs soft bodies",
    "loadMJCF": "needs MJCF",
    "spherical": "needs spherical joints",
    "number of robots": "needs more than 1000 bodies",
    "Not found": "a file is not found",
    "Cannot load": "a file is not found",
    "Couldn't load": "a file is not found",
    "No such file": "a file of its own is missing",
    "connectPhysicsServer": "needs Bullet's own graphics server",
    "exit code -11": "crashes",
    "cannot connect to X": "needs a display",
    "no end after": "has no end after 90 s",
}


def _shown(found: dict[str, Any]) -> str:
    if found["end"] == "end":
        return "ends"
    if found["end"] == "cap":
        return f"{found['steps']} steps" if found["steps"] else "runs"
    for part, reason in REASONS.items():
        if part in found["why"]:
            return reason
    return re.sub(r"[|`]", "", found["why"])


if __name__ == "__main__":
    main()
