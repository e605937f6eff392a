"""`simctl mcp` with the MCP project's own client."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest
from daemon import ASSETS, BINARY, Daemon
from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client

Work = Callable[[ClientSession], Awaitable[None]]


@pytest.fixture(scope="module")
def daemon() -> Iterator[Daemon]:
    with Daemon("--paused", name="mcp") as running:
        yield running


def with_agent(daemon: Daemon, work: Work, *flags: str) -> None:
    """Runs an agent's work beside a `simctl mcp`."""

    async def agent() -> None:
        server = StdioServerParameters(command=str(BINARY.parent / "simctl"), args=["mcp", "--endpoint", daemon.page, *flags])
        async with stdio_client(server) as (received, sent), ClientSession(received, sent) as session:
            await session.initialize()
            await work(session)

    asyncio.run(agent())


async def call(session: ClientSession, tool: str, **arguments: Any) -> str:
    """Returns the text of an answer; raises it if it is an error."""
    result = await session.call_tool(tool, arguments)
    text = "".join(getattr(content, "text", "") for content in result.content)
    if getattr(result, "isError", getattr(result, "is_error", False)):
        raise RuntimeError(text)
    return text


def test_an_agent_loads_a_robot_moves_it_and_waits(daemon: Daemon) -> None:
    async def work(session: ClientSession) -> None:
        names = [tool.name for tool in (await session.list_tools()).tools]
        assert {"world_status", "load_robot", "set_joint_targets", "camera_picture", "step"} <= set(names)
        loaded = await call(session, "load_robot", path=str(ASSETS / "Two Link.v2"), name="arm", fixed=True)
        assert "loaded arm: 3 links" in loaded and "warning: joint" in loaded
        assert "rad" in await call(session, "list_joints", robot="arm")
        with pytest.raises(RuntimeError, match="the world is paused"):
            await call(session, "set_joint_targets", robot="arm", targets={"shoulder joint": 0.3}, wait=5)
        assert "playing" in await call(session, "play")
        reached = await call(session, "set_joint_targets", robot="arm", targets={"shoulder joint": "20deg"}, wait=5)
        assert "shoulder" in reached and "0.349" in reached
        await call(session, "pause")
        before = await call(session, "world_status")
        await call(session, "step", steps=10)
        assert before != await call(session, "world_status")
        await call(session, "delete_robot", robot="arm")

    with_agent(daemon, work)


def test_a_refusal_has_its_sentence_and_its_remedy(daemon: Daemon) -> None:
    async def work(session: ClientSession) -> None:
        with pytest.raises(RuntimeError, match=r"(?s)absent.*`simctl robot list` lists the robots"):
            await call(session, "joint_states", robot="absent")
        with pytest.raises(RuntimeError, match="set_joint_targets needs the parameter targets"):
            await call(session, "set_joint_targets", robot="arm")
        with pytest.raises(RuntimeError, match="there is no tool"):
            await call(session, "format_disk")

    with_agent(daemon, work)


def test_an_agent_that_may_only_read_changes_nothing(daemon: Daemon) -> None:
    async def work(session: ClientSession) -> None:
        tools = (await session.list_tools()).tools
        assert all(tool.annotations is not None and tool.annotations.model_dump(by_alias=True)["readOnlyHint"] for tool in tools)
        assert "paused" in await call(session, "world_status")
        with pytest.raises(RuntimeError, match='there is no tool "play" here'):
            await call(session, "play")

    with_agent(daemon, work, "--read-only")
