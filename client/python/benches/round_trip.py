"""Times round trips of the Python client and of a raw TCP echo in the same run: p50 and p99.

    SIMD_BINARY=target/debug/simd python client/python/benches/round_trip.py [--calls 5000]

The request has 110 bytes and the reply 306, as many as a state of six joints; one is pending at a time. Rows
alternate, so that other load on the machine affects all of them.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zenoh

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from daemon import ASSETS, Daemon

import simd_client
from simd_client import aio, proto
from simd_client.proto import methods

REQUEST_BYTES, REPLY_BYTES = 110, 306
ROUNDS = 10


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--calls", type=int, default=5000, help="calls of each kind")
    calls = max(1, parser.parse_args().calls // ROUNDS)
    # Made first: a process with threads must not fork.
    tcp = echo()
    with Daemon("--paused", name="bench") as daemon, simd_client.connect(daemon.endpoint) as sim:
        arm = sim.load(ASSETS / "seven_arm", "arm", fixed=True)
        request = proto.GetJointStatesRequest(selections=[proto.JointSelection(robot="arm")])
        targets = {arm: np.full(arm.layout.velocity_count, 0.1)}
        rows: dict[str, Callable[[], object]] = {
            "raw TCP echo": tcp,
            "Zenoh get of the same, bare": zenoh_get(daemon, request.SerializeToString()),
            "GetJointStates, bare": lambda: sim.call(methods.GetJointStates, request),
            "robot.position": lambda: arm.position,
            "robot.set_positions": lambda: arm.set_positions(targets[arm]),
            "exchange(targets, states)": lambda: sim.exchange(targets, states=arm, wait=0),
            "step(1, targets, states)": lambda: sim.step(1, targets, states=arm),
        }
        within = simd_client.connect("embedded", config={"paused": True})
        inner = within.load(ASSETS / "seven_arm", "arm", fixed=True)
        rows |= {
            "embedded: GetJointStates": lambda: within.call(methods.GetJointStates, request),
            "embedded: set_positions": lambda: inner.set_positions(targets[arm]),
            "embedded: step(1, ...)": lambda: within.step(1, {inner: targets[arm]}, states=inner),
        }
        times: dict[str, list[float]] = {name: [] for name in rows}
        for _ in range(ROUNDS):
            for name, call in rows.items():
                call()
                times[name].extend(timed(call) for _ in range(calls))
        times["aio: robot.position"] = asyncio.run(awaited(daemon.endpoint, calls * ROUNDS))
        within.close()
    floor = np.median(times["raw TCP echo"])
    print(f"{'':28}{'p50 us':>9}{'p99 us':>9}{'p50 / TCP':>11}")
    for name, values in times.items():
        median, late = np.percentile(values, (50, 99)) * 1e6
        print(f"{name:28}{median:9.0f}{late:9.0f}{median / (floor * 1e6):11.1f}")


def zenoh_get(daemon: Daemon, payload: bytes) -> Callable[[], object]:
    """Returns a call with the same request by a minimal session that reads no message."""
    settings = {"mode": "client", "connect": {"endpoints": [daemon.endpoint]}, "scouting": {"multicast": {"enabled": False}}}
    session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))  # pyright: ignore[reportUnknownMemberType, reportUnknownArgumentType]
    key = f"simd/{daemon.name}/rpc/JointService/GetJointStates"

    def call() -> object:
        replies = session.get(key, payload=payload, consolidation=zenoh.ConsolidationMode.NONE, express=True)
        return bytes(replies.recv().ok.payload)  # pyright: ignore[reportOptionalMemberAccess]

    return call


def timed(call: Callable[[], object]) -> float:
    """Returns wall seconds of one call."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


async def awaited(endpoint: str, calls: int) -> list[float]:
    """Returns the same times for asyncio."""
    times: list[float] = []
    async with aio.connect(endpoint) as sim:
        arm = await sim.robot("arm")
        for _ in range(calls):
            begin = time.perf_counter()
            await arm.position
            times.append(time.perf_counter() - begin)
    return times


def echo() -> Callable[[], object]:
    """Times a round trip to another process that only answers with bytes: the lower bound."""
    server = socket.create_server(("127.0.0.1", 0))
    multiprocessing.Process(target=_answer, args=(server,), daemon=True).start()
    client = socket.create_connection(server.getsockname())
    server.close()
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    request = bytes(REQUEST_BYTES)

    def call() -> object:
        client.sendall(request)
        return _read(client, REPLY_BYTES)

    return call


def _answer(server: socket.socket) -> None:
    connection, _ = server.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    reply = bytes(REPLY_BYTES)
    while _read(connection, REQUEST_BYTES):
        connection.sendall(reply)


def _read(connection: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        part = connection.recv(count - len(data))
        if not part:
            return b""
        data += part
    return data


if __name__ == "__main__":
    main()
