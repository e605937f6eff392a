"""Threads and processes of a script: each connection has a separate number and world, and children get the
stand-in."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import urllib.request
from pathlib import Path

import pytest

import simd_client.pybullet as pybullet
from simd_client import embedded_link

from .conftest import WAYS

# Late enough for any busy machine: a script starts up to seven interpreters.
SECONDS = 900.0

CHILDREN = """
import multiprocessing, sys
import pybullet
from pybullet_utils.bullet_client import BulletClient

def child(answers):
    client = BulletClient(connection_mode=pybullet.DIRECT)
    client.setGravity(0, 0, -10)
    client.stepSimulation()
    answers.put((pybullet.__name__, type(client).__module__, client.isConnected()))

if __name__ == "__main__":
    for method in ("fork", "spawn", "forkserver"):
        context = multiprocessing.get_context(method)
        answers = context.Queue()
        process = context.Process(target=child, args=(answers,))
        process.start()
        print(method, *answers.get(timeout=60))
        process.join()
"""

AFTER_CONNECTING = """
import multiprocessing, sys
import pybullet

def child(answers):
    try:
        pybullet.stepSimulation()
    except pybullet.error as refusal:
        answers.put(str(refusal))
    own = pybullet.connect(pybullet.DIRECT)
    pybullet.stepSimulation()
    answers.put(own)

if __name__ == "__main__":
    parent = pybullet.connect(pybullet.DIRECT)
    pybullet.stepSimulation()
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    process = context.Process(target=child, args=(answers,))
    process.start()
    print(answers.get(timeout=60))
    print(answers.get(timeout=60))
    process.join()
    print(process.exitcode, pybullet.isConnected(parent))
"""

# Environments in processes, as training libraries start them (`SubprocVecEnv` of stable-baselines3): each gets a function that
# makes its environment, then answers commands over a pipe.
TRAINING = """
import multiprocessing, random
import pybullet, pybullet_data
from pybullet_utils.bullet_client import BulletClient

COUNT, STEPS = 2, 40

class Reaching:
    def __init__(self, seed):
        self.random = random.Random(seed)
        self.client = BulletClient(connection_mode=pybullet.DIRECT)
        self.client.setAdditionalSearchPath(pybullet_data.getDataPath())
        self.client.setGravity(0, 0, -9.8)
        self.arm = self.client.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
        self.steps = 0

    def reset(self):
        for joint in range(self.client.getNumJoints(self.arm)):
            self.client.resetJointState(self.arm, joint, 0.1)
        return self.observed()

    def observed(self):
        joints = range(self.client.getNumJoints(self.arm))
        return [state[0] for state in self.client.getJointStates(self.arm, joints)]

    def step(self, action):
        joints = list(range(self.client.getNumJoints(self.arm)))
        targets = [action + self.random.uniform(-0.1, 0.1) for _ in joints]
        self.client.setJointMotorControlArray(self.arm, joints, pybullet.POSITION_CONTROL, targetPositions=targets)
        self.client.stepSimulation()
        self.steps += 1
        seen = self.observed()
        return seen, -sum(map(abs, seen)), self.steps % 15 == 0

    def close(self):
        self.client.disconnect()

class Maker:
    def __init__(self, seed):
        self.seed = seed

    def __call__(self):
        return Reaching(self.seed)

def worker(remote, parent, make):
    parent.close()
    environment = make()
    while True:
        command, data = remote.recv()
        if command == "step":
            seen, reward, done = environment.step(data)
            remote.send((environment.reset() if done else seen, reward, done))
        elif command == "reset":
            remote.send(environment.reset())
        else:
            environment.close()
            remote.close()
            return

def trained(method):
    context = multiprocessing.get_context(method)
    remotes, works = zip(*[context.Pipe() for _ in range(COUNT)])
    processes = []
    for seed, (remote, work) in enumerate(zip(remotes, works)):
        process = context.Process(target=worker, args=(work, remote, Maker(seed)), daemon=True)
        process.start()
        processes.append(process)
        work.close()
    def ask(command, data=None):
        for remote in remotes:
            remote.send((command, data))
        return [remote.recv() for remote in remotes]
    seen = [ask("reset")]
    for step in range(STEPS):
        seen.append(ask("step", 0.02 * step))
    for remote in remotes:
        remote.send(("close", None))
    for process in processes:
        process.join(60)
    return seen, [process.exitcode for process in processes]

def alone():
    environments = [Maker(seed)() for seed in range(COUNT)]
    seen = [[environment.reset() for environment in environments]]
    for step in range(STEPS):
        row = [environment.step(0.02 * step) for environment in environments]
        seen.append([(e.reset() if done else now, reward, done) for e, (now, reward, done) in zip(environments, row)])
    return seen

if __name__ == "__main__":
    expected = alone()
    for method in ("fork", "spawn", "forkserver"):
        seen, codes = trained(method)
        print(method, seen == expected, codes)
"""

OTHER_PROGRAM = """
import subprocess, sys
print(subprocess.run([sys.executable, "-c", "import pybullet; print(pybullet.__name__)"], capture_output=True, text=True).stdout)
"""


def run(folder: Path, text: str, *options: str, module: bool = True) -> subprocess.CompletedProcess[str]:
    """A script, run by the runner or directly."""
    script = folder / "script.py"
    script.write_text(text)
    runner = ["-m", "simd_client.pybullet", *options] if module else []
    environment = {**os.environ, "PYTHONPATH": ""}
    return subprocess.run(
        [sys.executable, *runner, str(script)], cwd=folder, capture_output=True, text=True, timeout=SECONDS, env=environment
    )


@pytest.mark.parametrize("way", WAYS)
def test_threads_that_connect_at_once_have_a_world_each(way: str) -> None:
    count = 8 if way == "--embedded" else 3
    gate, numbers, problems = threading.Barrier(count), list[int](), list[BaseException]()

    def work() -> None:
        try:
            gate.wait(SECONDS)
            number = pybullet.connect(pybullet.DIRECT, options=way)
            pybullet.setGravity(0, 0, -10, physicsClientId=number)
            pybullet.stepSimulation(physicsClientId=number)
            numbers.append(number)
        except BaseException as problem:
            problems.append(problem)

    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(SECONDS)
    assert problems == [] and sorted(numbers) == list(range(count))
    for number in numbers:
        pybullet.disconnect(number)


@pytest.mark.parametrize("way", WAYS)
def test_children_of_all_methods_get_the_stand_in(tmp_path: Path, way: str) -> None:
    ran = run(tmp_path, CHILDREN, *(["--new"] if way == "--new" else []))
    module = "simd_client.pybullet simd_client.pybullet.bullet_client 1"
    assert ran.stdout == f"fork {module}\nspawn {module}\nforkserver {module}\n", ran.stderr


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_environments_in_processes_observe_what_they_observe_alone(tmp_path: Path) -> None:
    """To the bit, whichever method started them, also when the parent has worlds of its own."""
    ran = run(tmp_path, TRAINING)
    assert ran.stdout == "".join(f"{method} True [0, 0]\n" for method in ("fork", "spawn", "forkserver")), ran.stderr


def test_another_program_of_a_script_gets_the_stand_in(tmp_path: Path) -> None:
    assert run(tmp_path, OTHER_PROGRAM).stdout.strip() == "simd_client.pybullet"


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_a_child_that_was_forked_from_one_that_is_connected_connects_for_itself(tmp_path: Path) -> None:
    ran = run(tmp_path, AFTER_CONNECTING)
    said, number, ended = ran.stdout.splitlines()
    assert "is the process's that this one was forked from; connect here" in said
    assert number == "0" and ended == "0 1", ran.stderr


def test_the_bullet_client_beside_an_import_of_ours_is_ours(tmp_path: Path) -> None:
    """Also if PyBullet is installed too."""
    text = (
        "import sys\nimport simd_client.pybullet as p\nfrom pybullet_utils.bullet_client import BulletClient\n"
        "client = BulletClient(connection_mode=p.DIRECT)\nclient.stepSimulation()\n"
        "print(BulletClient.__module__, 'pybullet' in sys.modules, client.isConnected())\n"
    )
    ran = run(tmp_path, text, module=False)
    assert ran.stdout == "simd_client.pybullet.bullet_client False 1\n", ran.stderr


@pytest.mark.skipif(not embedded_link.is_installed(), reason="simd-embedded is not installed")
def test_the_world_of_a_script_with_a_window_is_looked_into(tmp_path: Path) -> None:
    """Its page exists without an option, for as long as the script runs."""
    text = (
        "import re, sys, io, urllib.request\nimport pybullet as p\nsys.stderr = said = io.StringIO()\n"
        "p.connect(p.GUI)\np.stepSimulation()\n"
        "address = re.search(r'look at the world at (http://\\S+)', said.getvalue())[1]\n"
        "print(b'<html' in urllib.request.urlopen(address, timeout=10).read().lower(), address)\n"
    )
    ran = run(tmp_path, text)
    is_there, address = ran.stdout.split()
    assert is_there == "True", ran.stderr
    with pytest.raises(OSError):
        urllib.request.urlopen(address, timeout=10.0)
