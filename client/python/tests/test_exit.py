"""A program ends, in every way and with anything open."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest
from daemon import IS_WIDE, Daemon

from simd_client import Simulation

# A random failure must appear in one of these.
AT_ONCE = 4 if IS_WIDE else 1

SLIDER = """
import os
import simd_client.pybullet as p
p.connect(p.DIRECT, options="--endpoint=ENDPOINT --remove-robots")
p.readUserDebugParameter(p.addUserDebugParameter(f"force {os.getpid()}", 0, 1, 0.5))
"""
PLAYING = """
import simd_client.pybullet as p
p.connect(p.DIRECT, options="--endpoint=ENDPOINT")
p.setRealTimeSimulation(1)
p.stepSimulation()
"""
WATCH = """
import simd_client
sim = simd_client.connect("ENDPOINT")
watch = sim.watch_statistics()
next(watch)
"""
CALLBACKS = """
import queue
import simd_client
sim = simd_client.connect("ENDPOINT")
seen = queue.Queue()
kept = [sim.on_states(seen.put), sim.on_event(print), sim.parameters.on_change(print)]
seen.get()
"""
AIO = """
import asyncio
from simd_client import aio
async def main():
    sim = await aio.connect("ENDPOINT")
    async for statistics in sim.watch_statistics():
        ENDING
    await sim.info()
asyncio.run(main())
"""
DROPPED = """
import gc, os
import simd_client
def sockets():
    names = [f"/proc/self/fd/{fd}" for fd in os.listdir("/proc/self/fd")]
    return sum(os.readlink(name).startswith("socket") for name in names if os.path.lexists(name))
before = sockets()
for _ in range(3):
    simd_client.connect("ENDPOINT").info()
    gc.collect()
print(sockets() - before)
"""
# A callback is running while the interpreter ends, which takes a second.
RUNNING = """
import asyncio, sys, time
from simd_client import aio
from simd_client.aio import runtime
class Slow:
    def __del__(self, sleep=time.sleep):
        sleep(1)
sys.kept = Slow()
soon = runtime._soon
def slowly(loop, do):
    soon(loop, do)
    time.sleep(0.3)
runtime._soon = slowly
async def main():
    sim = await aio.connect("ENDPOINT")
    await sim.info()
asyncio.run(main())
"""
FORKED_AND_ENDED = """
import os, sys, simd_client
sim = simd_client.connect("ENDPOINT")
child = os.fork()
if child == 0:
    del sim
    sys.exit(3)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), sim.info().name)
"""
READY = """
import sys, time
sys.stdout.write("\\nready\\n")
sys.stdout.flush()
while True:
    time.sleep(0.01)
"""
FORKED = """
import multiprocessing, simd_client
sim = simd_client.connect("ENDPOINT")
def stamp(_):
    try:
        return sim.stamp.step
    except simd_client.Unavailable as error:
        return str(error)
with multiprocessing.get_context("fork").Pool(1) as pool:
    print(pool.map(stamp, [0])[0])
sim.stamp
"""


@pytest.fixture
def ran(daemon: Daemon) -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that are killed if the test fails."""
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        process.kill()
        process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()


def start(
    ran: list[subprocess.Popen[str]], daemon: Daemon, script: str, ending: str, count: int = AT_ONCE
) -> None:
    if "ENDING" in script:
        code = script.replace("ENDING", ending)
    else:
        code = f"{script}\n{ending}\n"
    command = [sys.executable, "-W", "ignore", "-c", code.replace("ENDPOINT", daemon.endpoint)]
    pipe = subprocess.PIPE
    ran.extend(subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) for _ in range(count))


@pytest.mark.parametrize(
    "script", [SLIDER, PLAYING, WATCH, CALLBACKS, AIO], ids=["slider", "playing", "watch", "callbacks", "aio"]
)
@pytest.mark.parametrize(("ending", "code"), [("break", 0), ("raise ValueError()", 1)], ids=["end", "error"])
def test_a_program_ends_that_left_its_connection_open(
    sim: Simulation, daemon: Daemon, ran: list[subprocess.Popen[str]], script: str, ending: str, code: int
) -> None:
    if ending == "break" and "ENDING" not in script:
        ending = ""
    start(ran, daemon, script, ending)
    assert [process.wait(timeout=20) for process in ran] == [code] * AT_ONCE
    assert list(sim.parameters.all()) == []


@pytest.mark.parametrize(
    "script", [SLIDER, PLAYING, WATCH, CALLBACKS], ids=["slider", "playing", "watch", "callbacks"]
)
def test_ctrl_c_ends_a_program(
    sim: Simulation, daemon: Daemon, ran: list[subprocess.Popen[str]], script: str
) -> None:
    start(ran, daemon, script, READY)
    for process in ran:
        # Callbacks may print before it.
        assert process.stdout is not None and "ready\n" in iter(process.stdout.readline, "")
        process.send_signal(signal.SIGINT)
    assert all(process.wait(timeout=20) != 0 for process in ran)
    assert list(sim.parameters.all()) == []


def test_a_forked_process_cannot_use_the_connection(
    daemon: Daemon, ran: list[subprocess.Popen[str]]
) -> None:
    start(ran, daemon, FORKED, "", 1)
    assert ran[0].stdout is not None
    assert "start processes with the method `spawn`" in ran[0].stdout.readline()
    assert ran[0].wait(timeout=20) == 0


@pytest.mark.skipif(sys.platform != "linux", reason="it counts open files by /proc")
def test_a_connection_that_was_dropped_is_closed(daemon: Daemon, ran: list[subprocess.Popen[str]]) -> None:
    start(ran, daemon, DROPPED, "", 1)
    assert ran[0].communicate(timeout=20)[0] == "0\n"


def test_a_program_waits_for_the_callback_that_is_running_when_it_ends(
    daemon: Daemon, ran: list[subprocess.Popen[str]]
) -> None:
    start(ran, daemon, RUNNING, "")
    assert [process.wait(timeout=20) for process in ran] == [0] * AT_ONCE


def test_a_forked_process_ends_without_its_parents_connection(
    daemon: Daemon, ran: list[subprocess.Popen[str]]
) -> None:
    start(ran, daemon, FORKED_AND_ENDED, "", 1)
    assert ran[0].communicate(timeout=20)[0] == "3 pytest\n"
