"""Choice of the intended daemon, and messages if none is found."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from daemon import ASSETS, Daemon, within
from pretender import Pretender

import simd_client
import simd_client.aio
from simd_client import DeadlineExceeded, EndpointError, SimdError, Unavailable, proto, ways
from simd_client.endpoint import Endpoint, read_endpoint
from simd_client.link import program
from simd_client.proto import methods


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


def test_an_endpoint_is_said_by_the_program_else_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SIMD_ENDPOINT", raising=False)
    assert read_endpoint(None) == Endpoint("tcp/127.0.0.1:7447")
    monkeypatch.setenv("SIMD_ENDPOINT", "tcp/10.0.0.5:7447#lab2")
    assert read_endpoint(None) == Endpoint("tcp/10.0.0.5:7447", "lab2")
    assert read_endpoint(None, "lab3").name == "lab3"
    assert read_endpoint("tls/[::1]:1") == Endpoint("tls/[::1]:1")


@pytest.mark.parametrize(
    "text", ["simd://", "simd://lab/a b", "http://lab:7400/x", "lab:0", "ftp://lab", "tcp/", "tcp/a b", "tcp/lab:1#no name"]
)
def test_invalid_endpoints_are_refused_with_one_sentence(text: str) -> None:
    with pytest.raises(EndpointError):
        simd_client.connect(text)


@pytest.mark.parametrize(
    ("text", "meant"),
    [("tcp/lab", "tcp/lab:7447"), ("tls/[::1]", "tls/[::1]:7447"), ("udp/10.0.0.5:#a", "udp/10.0.0.5:7447")],
)
def test_an_address_without_a_port_has_the_default_one(text: str, meant: str) -> None:
    with pytest.raises(EndpointError, match="has no port") as refused:
        read_endpoint(text)
    assert str(refused.value).endswith(f" is {meant}")
    assert read_endpoint(meant) == Endpoint(meant)
    assert read_endpoint("tcp/lab:1?prio=6-7") == Endpoint("tcp/lab:1?prio=6-7")


@pytest.mark.parametrize(
    ("text", "locator", "name"),
    [
        ("simd://lab", "http://lab:7400", None),
        ("simd://[::1]:9000/lab-2", "http://[::1]:9000", "lab-2"),
        ("http://lab:7400/?view=1#arm", "http://lab:7400", None),
        ("https://lab/", "https://lab:7400", None),
        ("127.0.0.1:7400", "http://127.0.0.1:7400", None),
        ("lab", "http://lab:7400", None),
    ],
)
def test_one_endpoint_serves_all_clients(text: str, locator: str, name: str | None) -> None:
    assert read_endpoint(text) == Endpoint(locator, name)


def test_the_port_of_the_page_says_where_zenoh_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with Daemon("--paused", name="one") as one, Daemon("--paused", name="two") as two:
        for daemon in (one, two):
            for endpoint in (daemon.page, daemon.page.replace("http", "simd") + f"/{daemon.name}"):
                monkeypatch.setenv("SIMD_ENDPOINT", endpoint)
                with simd_client.connect() as sim:
                    assert (sim.name, sim.endpoint.locator) == (daemon.name, daemon.endpoint)
        with pytest.raises(Unavailable, match="no daemon named `two` answers at .*: it is called `one`"):
            simd_client.connect(one.page, "two")


def test_a_port_that_does_not_say_where_zenoh_is_is_named_with_what_to_do(daemon: Daemon) -> None:
    with pytest.raises(Unavailable, match=r"no daemon answers at http://127\.0\.0\.1:\d+ .*start one with `simd`"):
        simd_client.connect(f"simd://127.0.0.1:{free_port()}", connect_timeout=1)
    # The port of Zenoh speaks no HTTP.
    with pytest.raises(Unavailable, match="answers HTTP within 1 s; name the port of the daemon's page"):
        simd_client.connect("simd://" + daemon.endpoint.partition("/")[2], connect_timeout=1)


@pytest.mark.parametrize(
    ("host", "listens", "routers", "locator"),
    [
        ("127.0.0.1", ["tcp/127.0.0.1:7448"], [], "tcp/127.0.0.1:7448"),
        ("localhost", ["tcp/10.0.0.5:7448"], [], "tcp/10.0.0.5:7448"),
        ("lab", ["tcp/127.0.0.1:7448"], [], None),
        ("lab", ["tcp/127.0.0.1:7448", "tcp/10.0.0.5:7450"], [], "tcp/lab:7450"),
        ("2001:db8::1", ["tcp/[::]:7447"], [], "tcp/[2001:db8::1]:7447"),
        ("lab", ["udp/10.0.0.5:1", "tcp/10.0.0.5:2"], [], "tcp/lab:2"),
        ("lab", [], ["tcp/router:7447"], "tcp/router:7447"),
        ("lab", [], [], None),
    ],
)
def test_a_locator_is_one_that_the_client_reaches(
    host: str, listens: list[str], routers: list[str], locator: str | None
) -> None:
    assert ways.choose(listens, routers, host, is_tls=False) == locator


def test_a_connection_says_what_it_is_connected_to(daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint, daemon.name) as sim:
        assert repr(sim) == f"<Simulation 'pytest' at {daemon.endpoint}>"
        info = sim.info()
        assert (info.simulator, info.name, info.api_version[0]) == ("simd", "pytest", 1)
        assert info.limits.max_steps > 0


def test_any_setting_of_zenoh_can_be_given_by_name_or_in_a_file(daemon: Daemon, tmp_path: Path) -> None:
    settings = {"transport.link.tx.keep_alive": 2, "transport/link/tx/lease": 4000}
    with simd_client.connect(daemon.endpoint, config=settings) as sim:
        assert sim.stamp.step >= 0
    file = tmp_path / "zenoh.json5"
    file.write_text("{ scouting: { multicast: { enabled: false } } }")
    with simd_client.connect(daemon.endpoint, config=file) as sim:
        assert sim.name == daemon.name
    with pytest.raises(EndpointError, match="Zenoh does not take `transport/nonsense` = 1"):
        simd_client.connect(daemon.endpoint, config={"transport/nonsense": 1})


def test_without_a_listener_the_sentence_says_where_and_what_to_do() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(Unavailable, match=f"no daemon answers at {endpoint}; start one with `simd`"):
        simd_client.connect(endpoint, connect_timeout=0.3)


def test_a_daemon_of_another_name_is_not_taken_for_it(daemon: Daemon) -> None:
    with pytest.raises(Unavailable, match="no daemon named `other` answers at .*; there are `pytest`"):
        simd_client.connect(f"{daemon.endpoint}#other")


def test_several_daemons_are_listed_for_one_to_be_chosen() -> None:
    with Pretender("lab1", "lab2") as network:
        with pytest.raises(EndpointError, match="choose one of `lab1`, `lab2`"):
            simd_client.connect(network.endpoint)
        with simd_client.connect(f"{network.endpoint}#lab2") as sim:
            assert sim.name == "lab2"
    with Pretender("lab1", "simd") as network, simd_client.connect(network.endpoint) as sim:
        assert sim.name == "simd"


def test_a_daemon_that_never_answers_is_a_deadline_and_not_a_hang() -> None:
    with Pretender("slow") as network:
        with simd_client.connect(network.endpoint) as sim:
            network.answers = False
            with pytest.raises(DeadlineExceeded, match="the daemon `slow` at .* did not answer within 0.2 s"):
                sim.with_timeout(0.2).stamp
        assert issubclass(DeadlineExceeded, TimeoutError)


def test_a_daemon_that_works_for_long_is_waited_for_while_it_answers_at_all() -> None:
    request = proto.ValidateDescriptionRequest()
    with Pretender("busy") as network, simd_client.connect(network.endpoint) as sim:
        network.answers, network.still_answers, network.releases_at = False, "GetSimulatorInfo", 4
        assert sim.with_timeout(0.2).call_until_silent(methods.ValidateDescription, request).report.findings == []
        assert network.asked == 4
        network.still_answers = ""
        with pytest.raises(DeadlineExceeded, match="the daemon `busy` said nothing for 0.2 s"):
            sim.with_timeout(0.2).call_until_silent(methods.ValidateDescription, request)


def test_tasks_wait_for_a_daemon_that_works_for_long_too() -> None:
    async def wait(endpoint: str) -> None:
        async with simd_client.aio.connect(endpoint) as sim:
            network.answers, network.still_answers, network.releases_at = False, "GetSimulatorInfo", 4
            short = sim.with_timeout(0.2)
            answer = await short.call_until_silent(methods.ValidateDescription, proto.ValidateDescriptionRequest())
            assert list(answer.report.findings) == [] and network.asked == 4
            network.still_answers = ""
            with pytest.raises(DeadlineExceeded, match="said nothing for 0.2 s"):
                await short.call_until_silent(methods.ValidateDescription, proto.ValidateDescriptionRequest())

    with Pretender("busy") as network:
        asyncio.run(wait(network.endpoint))


def test_an_answer_that_is_no_message_is_said_to_be_none() -> None:
    with Pretender("odd") as network, simd_client.connect(network.endpoint) as sim:
        network.payload = b"\xff\xff\xff"
        with pytest.raises(simd_client.AnswerError, match="it is not a GetSimulationStateResponse"):
            sim.stamp
        network.error = b"not a status", "text/plain"
        with pytest.raises(SimdError, match="an error in text/plain: not a status"):
            sim.stamp


def test_a_client_of_another_major_version_learns_which_side_is_older(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    def attachment(_token: str | None) -> str:
        return "simd-api-version: 2.0"

    monkeypatch.setattr("simd_client.zenoh_link._attachment", attachment)
    with pytest.raises(simd_client.VersionMismatch) as refused:
        simd_client.connect(daemon.endpoint)
    assert refused.value.metadata == {"client": "2.0", "daemon": "1.0"}
    assert "older" in str(refused.value) or "newer" in str(refused.value)


def test_a_closed_connection_says_that_it_is_closed(daemon: Daemon) -> None:
    sim = simd_client.connect(daemon.endpoint)
    sim.close()
    with pytest.raises(Unavailable, match="is closed"):
        sim.stamp


def test_a_daemon_that_is_killed_is_unavailable() -> None:
    with Daemon("--paused", name="doomed") as doomed, simd_client.connect(doomed.endpoint, timeout=5) as sim:
        assert sim.stamp.step == 0
        doomed.kill()
        with pytest.raises(Unavailable, match="no daemon named `doomed` answers"):
            # The operating system may take a moment to report that it has ended.
            for _ in range(100):
                sim.stamp


def test_calls_work_again_once_the_daemon_is_back() -> None:
    with Daemon("--paused", name="phoenix") as first:
        sim = simd_client.connect(first.endpoint, timeout=5)
        first.kill()
    with sim, Daemon("--paused", name="phoenix", locator=first.endpoint):
        stop = within()
        while True:
            try:
                assert sim.stamp.step == 0
                break
            except Unavailable:
                assert time.monotonic() < stop


def test_several_threads_share_a_connection(daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as sim:
        arm = sim.load(ASSETS / "Two Link.v2", "threads", fixed=True)

        def work(number: int) -> int:
            done = 0
            for _ in range(20):
                arm.joints[number % 2].set_position(0.01 * number)
                done += arm.read().position.shape == (2,)
            return done

        with ThreadPoolExecutor(8) as pool:
            assert list(pool.map(work, range(8))) == [20] * 8


def test_ctrl_c_ends_a_call_that_waits() -> None:
    with Pretender("slow") as network:
        script = (
            "import os, signal, sys, threading, simd_client\n"
            f"sim = simd_client.connect({network.endpoint!r}, timeout=30)\n"
            "print('ready', flush=True)\n"
            "sys.stdin.readline()\n"
            "threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
            "try:\n    sim.stamp\nexcept KeyboardInterrupt:\n    os._exit(7)\n"
        )
        with subprocess.Popen(
            [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None and process.stdin is not None
            assert process.stdout.readline() == "ready\n"
            network.answers = False
            process.stdin.write("go\n")
            process.stdin.flush()
            assert process.wait(timeout=20) == 7


@pytest.mark.parametrize(
    ("argument", "name"),
    [("/home/me/grasp.py", "grasp.py"), ("-", "python"), ("-c", "python"), ("", "python"), ("gr\nüff.py", "grff.py")],
)
def test_a_program_is_known_by_its_scripts_name(monkeypatch: pytest.MonkeyPatch, argument: str, name: str) -> None:
    monkeypatch.setattr(sys, "argv", [argument])
    assert program() == name


def test_a_server_that_sends_byte_by_byte_keeps_no_client_waiting() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def drip() -> None:
            connection, _ = server.accept()
            with connection, contextlib.suppress(OSError):
                while True:
                    connection.sendall(b"H")
                    time.sleep(0.01)

        threading.Thread(target=drip, daemon=True).start()
        with pytest.raises(Unavailable, match="answers HTTP within 0.3 s"):
            simd_client.connect(f"simd://127.0.0.1:{server.getsockname()[1]}", connect_timeout=0.3)
