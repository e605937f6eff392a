"""Runs one script of PyBullet's on PyBullet or on simd, without a window and up to its 240th step, for bullet_examples.py.

    python bullet_script.py pybullet|simd ROOT MODULE RESULT

MODULE is a file of this folder, or the name of a module below ROOT. RESULT receives the end of the script,
its called functions, and the poses of the bodies. Steps and `sleep` advance its clock, and random numbers
begin equal on both. Functions for a window return the answers of an untouched one.
"""

# PyBullet has no types.
# pyright: basic, reportAttributeAccessIssue=false, reportMissingImports=false

from __future__ import annotations

import importlib
import inspect
import json
import os
import sys
from pathlib import Path
from typing import Any

STEPS = 240
CALLS = 20_000
# Result of getDebugVisualizerCamera in a new window.
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
        # Last used connection: scripts with several have numbers.
        self.client = 0

    def install(self) -> None:
        """Wraps each function of the module."""
        import builtins
        import time

        wrapped: set[Any] = set()
        for name, function in self.original.items():
            if name != "error":
                replacement = self.wrapped(name, getattr(self, name, function))
                wrapped.add(replacement)
                setattr(self.module, name, replacement)
        # `pybullet_utils.bullet_client` gives the number of its connection to functions that are built in.
        is_builtin = inspect.isbuiltin
        inspect.isbuiltin = lambda thing: is_builtin(thing) or (inspect.isfunction(thing) and thing in wrapped)
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

    # Differences from the module itself.

    def connect(self, mode: int, *arguments: Any, **named: Any) -> int:
        windows = {self.module.GUI, self.module.SHARED_MEMORY, self.module.GUI_SERVER, self.module.DIRECT}
        if mode not in windows:
            return self.original["connect"](mode, *arguments, **named)
        self.client = self.original["connect"](self.module.DIRECT, **({} if self.is_real else {"options": "--new"}))
        return self.client

    def disconnect(self, *arguments: Any, **named: Any) -> None:
        import time

        if not self.result.exists():
            self.write("end", "")
        # A script that waits for a daemon's end really sleeps.
        time.sleep = self.real_sleep
        self.original["disconnect"](*arguments, **named)
        time.sleep = self.sleep

    def stepSimulation(self, *arguments: Any, **named: Any) -> Any:
        answer = self.original["stepSimulation"](*arguments, **named)
        self.steps += 1
        self.clock += 1 / 240
        if self.steps >= STEPS:
            self.end("cap")
        return answer

    def setRealTimeSimulation(self, enableRealTimeSimulation: int, physicsClientId: int = 0) -> None:
        """The clock is simulated: `sleep` makes the steps."""
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
        p, client = self.original, {"physicsClientId": self.client}
        bodies: list[Any] = []
        for index in range(p["getNumBodies"](**client)):
            body = p["getBodyUniqueId"](index, **client)
            position, orientation = p["getBasePositionAndOrientation"](body, **client)
            joints = [
                p["getJointState"](body, joint, **client)[0]
                for joint in range(p["getNumJoints"](body, **client))
                if p["getJointInfo"](body, joint, **client)[2] in (0, 1)
            ]
            bodies.append([list(position), list(orientation), joints])
        return bodies


def begin_random() -> None:
    """Makes random numbers begin equal."""
    import random

    import numpy

    random.seed(1)
    numpy.random.seed(1)
    try:
        from gym.utils import seeding
    except ImportError:
        return
    drawn = seeding.create_seed
    seeding.create_seed = lambda a=None, max_bytes=8: drawn(1 if a is None else a, max_bytes)


def main() -> None:
    """Runs the script."""
    import runpy
    import traceback

    name, root, script, result = sys.argv[1:5]
    # Data of PyBullet's package: the repository's lacks files.
    importlib.import_module("pybullet_data")
    if name == "simd":
        import simd_client.pybullet as module
        from simd_client.pybullet import import_hooks

        import_hooks.replace(module)
    else:
        import pybullet as module
    watched = Watched(module, name, Path(result))
    watched.install()
    begin_random()
    sys.argv = [script]
    sys.path[0] = os.getcwd()
    if not script.endswith(".py"):
        sys.path.insert(1, root)
    try:
        if script.endswith(".py"):
            runpy.run_path(script, run_name="__main__")
        else:
            runpy.run_module(script, run_name="__main__", alter_sys=True)
        how, why = "end", ""
    except SystemExit as asked:
        # Also the end after a wrong command line, or of a script that refuses.
        how = "error" if asked.code not in (None, 0) else "end"
        why = f"exit {asked.code}"[:200] if how == "error" else ""
    except BaseException as problem:
        traceback.print_exc()
        how, why = "error", f"{type(problem).__name__}: {problem}".splitlines()[0][:200]
    if how == "error" or not watched.result.exists():
        watched.end(how, why)
    os._exit(0)


if __name__ == "__main__":
    main()
