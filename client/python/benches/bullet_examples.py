"""Runs PyBullet's own example scripts on PyBullet and on simd, without a window, and prints tables for docs/pybullet.md.

    pip install -r bullet_requirements.txt
    python bullet_examples.py FOLDER [SCRIPT ...] [--json FILE]

FOLDER has the scripts: `examples/pybullet/examples` of Bullet's repository. With --all and
`examples/pybullet/gym` it takes the scripts of the folders below, which run as modules of their packages.
Each runs in a separate process in a copy of its folder (bullet_script.py). With --json the results are kept,
and an interrupted run continues; with --seconds it ends after that time.
"""

# pyright: basic

from __future__ import annotations

import argparse
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock
from typing import Any

SIDES = ("pybullet", "simd")


def module_of(root: Path, script: str) -> str | None:
    """The name of a script that is part of a package below a folder."""
    parts = list(Path(script).with_suffix("").parts)
    # `envs-v2` is not a name.
    inside = len(parts) > 1 and all(part.isidentifier() for part in parts)
    return ".".join(parts) if inside and (root / parts[0] / "__init__.py").exists() else None


def run(root: Path, data: Path | None, script: str, name: str, most: float) -> dict[str, Any]:
    """Returns the result of a script in a separate process, with a time limit. The script may be in a folder
    below."""
    with tempfile.TemporaryDirectory() as scratch:
        shutil.copytree((root / script).parent, scratch, dirs_exist_ok=True)
        if data:
            # Symbolic links do not work, since a robot's files may not leave their folder by them.
            shutil.copytree(data, scratch, copy_function=_linked, dirs_exist_ok=True)
        # Scripts write into the folder of their data.
        result = Path(scratch) / "result.json"
        child = Path(__file__).with_name("bullet_script.py")
        command = [sys.executable, "-W", "ignore", str(child), name, str(root.resolve())]
        command += [module_of(root, script) or Path(script).name, str(result)]
        # Bullet's own messages were generated for an older protobuf.
        environment = {**os.environ, "MPLBACKEND": "Agg", "PROTOCOL_BUFFERS_PYTHON_IMPLEMENTATION": "python"}
        with subprocess.Popen(
            command, cwd=scratch, env=environment, text=True, errors="replace", stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
        ) as process:
            try:
                _, said = process.communicate(timeout=most)
            except subprocess.TimeoutExpired:
                # This includes the processes that those started.
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
                return {"end": "timeout", "why": f"no end after {most:g} s", "state": None, "steps": 0, "used": []}
        if not result.exists():
            last = (said.strip().splitlines() or [""])[-1]
            return {"end": "died", "why": f"exit code {process.returncode}: {last[:150]}", "state": None, "steps": 0, "used": []}
        found = json.loads(result.read_text())
        found["said"] = [line for line in said.splitlines() if line.startswith("simd: ")]
        return found


def _linked(source: str, target: str) -> None:
    """Links the same file into another folder that lacks its name."""
    if not os.path.lexists(target):
        try:
            os.link(source, target)
        except OSError:
            shutil.copyfile(source, target)


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


class Results:
    """Results, by script and side, in a file after each."""

    def __init__(self, file: Path | None) -> None:
        self.file = file
        self.lock = Lock()
        self.found: dict[str, dict[str, Any]] = json.loads(file.read_text()) if file and file.exists() else {}

    def add(self, script: str, side: str, found: dict[str, Any]) -> None:
        """Adds one, and prints a line."""
        with self.lock:
            self.found.setdefault(script, {})[side] = found
            self.write()
        both = self.found[script]
        differ = compared(both["simd"].get("state"), both["pybullet"].get("state")) if len(both) == 2 else ""
        print(script, side, found["end"], found["steps"], found["why"], "|", differ, flush=True)

    def write(self) -> None:
        """Writes the complete file."""
        if self.file:
            beside = self.file.with_suffix(".part")
            beside.write_text(json.dumps(self.found))
            beside.replace(self.file)


def is_reached(both: dict[str, Any]) -> bool:
    """Whether a script reaches its end on PyBullet."""
    return both["pybullet"]["end"] in ("cap", "end")


def is_same(both: dict[str, Any]) -> bool:
    """Whether it reaches the same end on simd."""
    return is_reached(both) and both["simd"]["end"] == both["pybullet"]["end"]


def print_scripts(found: dict[str, dict[str, Any]], whole: bool) -> None:
    """Prints the table of scripts; unless whole, without imported modules."""
    rows = {script: both for script, both in sorted(found.items()) if len(both) == 2}
    reached = [script for script, both in rows.items() if is_reached(both)]
    same = [script for script in reached if is_same(rows[script])]
    print(f"\n{len(rows)} scripts; {len(reached)} reach their end on PyBullet, {len(same)} of them on simd")
    if not whole:
        for script, both in list(rows.items()):
            if not both["pybullet"]["used"] and (is_same(both) or both["simd"]["why"] == both["pybullet"]["why"]):
                del rows[script]
        print(f"{len(found) - len(rows)} of them call nothing of PyBullet's, and end as there")
    print("\n| script | reaches its end on simd | PyBullet | simd | end states differ by |\n|---|---|---|---|---|")
    for script, both in rows.items():
        reaches = "yes" if script in same else "no" if script in reached else ""
        differ = compared(both["simd"]["state"], both["pybullet"]["state"]) if script in same else ""
        print(f"| {script.removesuffix('.py')} | {reaches} | {_shown(both['pybullet'])} | {_shown(both['simd'])} | {differ} |")


# Descriptions of failures in the table, by a part of their message.
REASONS = {
    "rigid bodies only": "needs soft bodies",
    "number of robots": "needs more than 1000 bodies",
    "Not found": "a file is not found",
    "Cannot load": "a file is not found",
    "Couldn't load": "a file is not found",
    "No such file": "one of its files is missing",
    "connectPhysicsServer": "needs Bullet's own graphics server",
    "exit code -11": "crashes",
    "cannot connect to X": "needs a display",
}


def _shown(found: dict[str, Any]) -> str:
    if found["end"] == "end":
        return f"ends after {found['steps']} steps" if found["steps"] else "ends"
    if found["end"] == "cap":
        return f"{found['steps']} steps" if found["steps"] else "runs"
    if found["end"] == "timeout":
        return f"has {found['why']}"
    for part, reason in REASONS.items():
        if part in found["why"]:
            return reason
    return re.sub(r"[|`]", "", found["why"])


def print_functions(folders: list[Path]) -> None:
    """Prints PyBullet's functions by the number of scripts with a call, with their state from
    docs/pybullet.md."""
    document = Path(__file__).resolve().parents[3] / "docs/pybullet.md"
    states: dict[str, str] = {}
    for line in document.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 3 and cells[1] in ("works", "accepted", "raises"):
            states.update({name: cells[1] for name in re.findall(r"`(\w+)`", cells[0])})
    # A folder's figure counts scripts that import PyBullet, or receive it as a client.
    counts = {name: [0] * len(folders) for name in states}
    for index, folder in enumerate(folders):
        for script in folder.rglob("*.py"):
            called = set(re.findall(r"\.(\w+)\s*\(", script.read_text(errors="replace")))
            for name in called & counts.keys():
                counts[name][index] += 1
    print("\n| function | " + " | ".join(folder.name for folder in folders) + " | state |\n|---|" + "---|" * len(folders) + "---|")
    for name, numbers in sorted(counts.items(), key=lambda item: (-sum(item[1]), item[0])):
        if any(numbers):
            print(f"| `{name}` | " + " | ".join(map(str, numbers)) + f" | {states[name]} |")


def main() -> None:
    """Runs the remaining scripts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("scripts", nargs="*")
    parser.add_argument("--all", action="store_true", help="also run scripts of all folders below")
    parser.add_argument("--data", type=Path, help="Bullet's folder `data`, which scripts find next to them")
    parser.add_argument("--json", type=Path, help="file of results; existing results are not made again")
    parser.add_argument("--side", choices=SIDES, help="run only on this side")
    parser.add_argument("--again", action="store_true", help="repeat the runs on simd")
    parser.add_argument("--seconds", type=float, default=math.inf, help="seconds after which no script is started; prints how many are left")
    parser.add_argument("--limit", type=float, default=90.0, help="seconds after which a script is ended")
    parser.add_argument("--jobs", type=int, default=2, help="number of scripts at one time")
    parser.add_argument("--table", action="store_true", help="only print the table of --json")
    parser.add_argument("--functions", type=Path, nargs="*", help="only count calls of PyBullet's functions in these folders")
    asked = parser.parse_args()
    if asked.functions is not None:
        print_functions([asked.folder, *asked.functions])
        return
    results = Results(asked.json)
    files = asked.folder.rglob("*.py") if asked.all else asked.folder.glob("*.py")
    # That folder has robots, with modules that are read and not run.
    listed = (str(path.relative_to(asked.folder)) for path in files if "pybullet_data" not in path.parts)
    scripts = asked.scripts or sorted(listed)
    if asked.again:
        for script in scripts:
            results.found.get(script, {}).pop("simd", None)
        results.write()
    sides = [asked.side] if asked.side else SIDES
    wanted = [(script, side) for script in scripts for side in sides if side not in results.found.get(script, {})]
    end = time.monotonic() + asked.seconds
    left: list[str] = []

    def one(what: tuple[str, str]) -> None:
        script, side = what
        if time.monotonic() > end:
            left.append(script)
        else:
            results.add(script, side, run(asked.folder, asked.data, script, side, asked.limit))

    if not asked.table:
        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(one, wanted))
    if left:
        print(f"{len(left)} are left: the same again goes on with {left[0]}")
    else:
        print_scripts({script: results.found[script] for script in scripts if script in results.found}, not asked.all)


if __name__ == "__main__":
    main()
