"""Markers, cameras, keys and mouse. A connection plays the page and sends its reports."""

from __future__ import annotations

import time

import numpy as np
import pytest
from daemon import Daemon, within

import simd_client
from simd_client import KeyEvent, MouseEvent, Robot, Simulation, aio, proto
from simd_client.proto import methods


def key(letter: str, is_down: bool) -> proto.InputEvent:
    """As a page reports it."""
    return proto.InputEvent(key=proto.KeyInput(key=letter, code=f"Key{letter.upper()}", is_down=is_down))


def mouse(x: float, button: proto.MouseButton = proto.MouseButton.MOUSE_BUTTON_UNSPECIFIED) -> proto.InputEvent:
    """As a page reports it."""
    pressed = button != proto.MouseButton.MOUSE_BUTTON_UNSPECIFIED
    return proto.InputEvent(mouse=proto.MouseInput(x=x, y=2.0, button=button, is_down=pressed))


def camera(x: float, width: int = 800) -> proto.ViewCamera:
    """As a page reports it."""
    return proto.ViewCamera(
        position=proto.Vector3(x=x, z=1.0),
        target=proto.Vector3(),
        up=proto.Vector3(z=1.0),
        field_of_view=0.6,
        width=width,
        height=600,
    )


def test_lines_points_and_texts_are_drawn_replaced_and_deleted(sim: Simulation, arm: Robot) -> None:
    view = sim.view
    link = arm.links[1]
    line = view.add_lines([[(0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 1, 0)]], color=(1, 0.5, 0), width=3)
    dots = view.add_points([(0, 0, 1)], colors=[(0, 1, 0)], robot=arm, link=link)
    text = view.add_text("here", (1, 2, 3), orientation=(0, 0, 0.6, 0.8), life_time=100, robot="arm")
    first, second, third = view.markers()
    assert [each.id for each in (first, second, third)] == [line, dots, text]
    assert (first.kind, first.points.shape, first.color, first.size) == ("lines", (2, 2, 3), (1.0, 0.5, 0.0), 3.0)
    assert first.points[1].tolist() == [[0, 0, 0], [0, 1, 0]] and first.life_time is None
    assert (second.kind, second.robot, second.link, second.color) == ("points", "arm", link, None)
    assert second.points.tolist() == [[0, 0, 1]] and second.colors.tolist() == [[0, 1, 0]]
    assert (third.kind, third.text, third.robot, third.link) == ("text", "here", "arm", "")
    assert third.life_time is not None and 90 < third.life_time <= 100
    assert view.add_lines([(0, 0, 0), (0, 0, 1)], replace=line) == line
    assert view.markers()[0].points.tolist() == [[[0, 0, 0], [0, 0, 1]]]
    assert view.delete(dots, 1 << 40) == (dots,)
    assert view.delete() == (line, text) and view.markers() == ()


def test_invalid_drawings_are_refused(sim: Simulation) -> None:
    view = sim.view
    with pytest.raises(ValueError, match=r"\(N, 2, 3\)"):
        view.add_lines([[0, 0, 0]])
    with pytest.raises(ValueError, match="3 numbers"):
        view.add_points([(0, 0, 0)], color=(1, 0))
    with pytest.raises(simd_client.RobotNotFound):
        view.add_points([(0, 0, 0)], robot="moon")
    with pytest.raises(simd_client.InvalidValue, match=r"markers\[0\].points.points"):
        view.add_points([(0, 0, np.nan)])
    with pytest.raises(simd_client.InvalidValue):
        view.add_text("")
    assert view.markers() == ()


def test_markers_go_with_the_connection_that_drew_them_unless_they_are_kept(sim: Simulation, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as other:
        gone = other.view.add_points([(0, 0, 0)])
        kept = other.view.add_points([(0, 0, 0)], keep=True)
        assert [each.id for each in sim.view.markers()] == [gone, kept]
    end = within()
    while len(sim.view.markers()) != 1:
        assert time.monotonic() < end
    assert [each.id for each in sim.view.markers()] == [kept]
    sim.view.delete()


def test_cameras_of_pages_are_read_and_moved(sim: Simulation, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as page:
        page.call(methods.ReportView, proto.ReportViewRequest(camera=camera(2.0)))
        (seen,) = sim.view.cameras()
        assert (seen.position.tolist(), seen.up.tolist(), seen.width) == ([2, 0, 1], [0, 0, 1], 800)
        assert seen.age < 10 and seen.followed_version == 0 and seen.client
        version = sim.view.set_camera((3, 0, 1), (0, 0, 0.5), field_of_view=1.0)
        target: proto.CameraTarget = page.call(methods.NextView, proto.NextViewRequest()).camera
        assert (target.version, target.position.x, target.target.z, target.field_of_view) == (version, 3, 0.5, 1)
        assert sim.view.set_camera((3, 0, 2)) == version + 1
    with pytest.raises(simd_client.InvalidValue):
        sim.view.set_camera((0, 0, 0), (0, 0, 0))


def test_keys_and_mouse_are_read_from_when_they_are_asked_for(sim: Simulation, daemon: Daemon) -> None:
    with simd_client.connect(daemon.endpoint) as page:
        begin = sim.view.next_input()
        assert begin.events == ()
        events = [key("a", True), mouse(1), mouse(2), mouse(3, proto.MouseButton.MOUSE_BUTTON_RIGHT), key("a", False)]
        answer: proto.ReportViewResponse = page.call(methods.ReportView, proto.ReportViewRequest(input=events))
        assert answer.wants_input
        read = sim.view.next_input(begin.sequence)
        down, moved, pressed, up = read.events
        assert isinstance(down, KeyEvent) and (down.key, down.code, down.is_down) == ("a", "KeyA", True)
        assert isinstance(moved, MouseEvent) and (moved.x, moved.y, moved.button) == (2.0, 2.0, None)
        assert isinstance(pressed, MouseEvent) and (pressed.x, pressed.button, pressed.is_down) == (3.0, "right", True)
        assert isinstance(up, KeyEvent) and not up.is_down and not read.missed
        assert sim.view.next_input(read.sequence, wait=0.001).events == ()


async def test_asyncio_draws_too(sim: Simulation, daemon: Daemon) -> None:
    async with aio.connect(daemon.endpoint) as connected:
        number = await connected.view.add_lines([[(0, 0, 0), (1, 0, 0)]])
        assert [each.id for each in await connected.view.markers()] == [number]
        assert await connected.view.delete(number) == (number,)


def test_links_are_given_colours_by_name_and_their_own_again(sim: Simulation, arm: Robot) -> None:
    def shown() -> dict[str, tuple[float, ...]]:
        answer = sim.call(methods.NextView, proto.NextViewRequest())
        assert all(each.robot == "arm" for each in answer.colors.colors)
        return {each.link: (each.color.red, each.color.green, each.color.blue, each.color.alpha) for each in answer.colors.colors}

    first, second = arm.links[:2]
    sim.view.set_link_colors(arm, {first: (1, 0, 0), second: (0, 1, 0, 0.5)})
    assert shown() == {first: (1, 0, 0, 1), second: (0, 1, 0, 0.5)}
    sim.view.set_link_colors("arm", {first: None})
    sim.view.set_link_colors("arm", {})
    assert shown() == {second: (0, 1, 0, 0.5)}
    with pytest.raises(ValueError, match="3 or 4 numbers"):
        sim.view.set_link_colors(arm, {first: (1, 0)})
    with pytest.raises(simd_client.LinkNotFound):
        sim.view.set_link_colors(arm, {"wing": (1, 0, 0)})
