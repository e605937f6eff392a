"""Debug lines, points and texts, keys, mouse and the camera. A connection plays the page and sends its
reports."""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest

import simd_client
from simd_client import Simulation, proto
from simd_client.proto import methods
from simd_client.pybullet import connections, input_queue, window
from simd_client.pybullet.daemon_process import DaemonProcess

from .conftest import SEVEN_ARM


@pytest.fixture
def page(script: ModuleType) -> Iterator[Simulation]:
    """A connection to the script's daemon."""
    with simd_client.connect(connections.connected(0).wire.endpoint) as connected:
        yield connected


@pytest.fixture(autouse=True)
def no_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call asks the daemon."""
    monkeypatch.setattr(input_queue, "_INTERVAL", 0.0)
    monkeypatch.setattr(window, "_INTERVAL", 0.0)


def report(page: Simulation, *events: proto.InputEvent, camera: proto.ViewCamera | None = None, followed: int = 0) -> None:
    page.call(methods.ReportView, proto.ReportViewRequest(input=events, camera=camera, followed_version=followed))


def drawn(page: Simulation, script_number: int = 0) -> tuple[Any, ...]:
    """Returns the markers, once the script's drawings have all arrived."""
    connections.connected(script_number).drawings.flush()
    return page.view.markers()


def key(name: str, code: str, is_down: bool) -> proto.InputEvent:
    return proto.InputEvent(key=proto.KeyInput(key=name, code=code, is_down=is_down))


def test_drawings_are_markers_with_numbers_of_their_own(script: ModuleType, page: Simulation) -> None:
    line = script.addUserDebugLine([0, 0, 0], [1, 1, 1], [1, 0, 0], 3, 50)
    slider = script.addUserDebugParameter("gain", 0, 1, 0.5)
    points = script.addUserDebugPoints([[0, 0, 1], [0, 0, 2]], [[1, 0, 0], [0, 1, 0]], 5)
    text = script.addUserDebugText("here\n", [0, 0, 3], textSize=2, textOrientation=[0, 0, 0, 1])
    assert len({line, slider, text, points}) == 4
    first, second, third = drawn(page)
    assert (first.kind, first.points.tolist(), first.color, first.size) == ("lines", [[[0, 0, 0], [1, 1, 1]]], (1, 0, 0), 3)
    assert first.life_time is not None and first.life_time <= 50
    assert (second.points.tolist(), second.colors.tolist(), second.size) == ([[0, 0, 1], [0, 0, 2]], [[1, 0, 0], [0, 1, 0]], 5)
    assert (third.text, third.points.tolist(), third.size, third.life_time) == ("here ", [[0, 0, 3]], 0.2, None)

    assert script.addUserDebugLine([0, 0, 0], [2, 0, 0], replaceItemUniqueId=line) == line
    # A replacing drawing keeps the daemon's id.
    assert [(each.id, each.kind) for each in drawn(page)] == [(1, "lines"), (2, "points"), (3, "text")]
    assert page.view.markers()[0].points.tolist() == [[[0, 0, 0], [2, 0, 0]]]
    script.removeUserDebugItem(points)
    script.removeUserDebugItem(points)
    assert [each.kind for each in page.view.markers()] == ["lines", "text"]
    script.removeAllUserDebugItems()
    assert page.view.markers() == ()
    # As in PyBullet, sliders stay.
    assert script.readUserDebugParameter(slider) == 0.5
    script.removeUserDebugItem(slider)
    with pytest.raises(script.error):
        script.readUserDebugParameter(slider)


def test_without_a_window_pybullet_takes_the_same_calls(bullet: Any, script: ModuleType) -> None:
    """It draws nothing then and returns a number of no drawing; invalid arguments are errors in both."""
    for p in (bullet, script):
        arm = p.loadURDF(str(SEVEN_ARM), useFixedBase=1)
        parent: dict[str, Any] = {"parentObjectUniqueId": arm, "parentLinkIndex": 2, "replaceItemUniqueId": -1, "lifeTime": 1}
        numbers = [
            p.addUserDebugLine(lineFromXYZ=[0, 0, 0], lineToXYZ=(1, 1, 1), lineColorRGB=[1, 0, 0], lineWidth=2, **parent),
            p.addUserDebugText(text="a", textPosition=[0, 0, 0], textColorRGB=[1, 0, 0], textSize=1.5, **parent),
            p.addUserDebugPoints(pointPositions=[[0, 0, 0]], pointColorsRGB=[[1, 0, 0]], pointSize=2, **parent),
        ]
        assert all(isinstance(number, int) for number in numbers)
        # A color of another length is none.
        assert isinstance(p.addUserDebugLine([0, 0, 0], [1, 1, 1], [1, 0, 0, 1]), int)
        with pytest.raises(p.error):
            p.addUserDebugLine([0, 0], [1, 1, 1])
        with pytest.raises(p.error):
            p.addUserDebugText("a", [0, 0])
        with pytest.raises(p.error):
            p.addUserDebugPoints([[0, 0, 0]], [])
        assert p.removeUserDebugItem(77) is None and p.removeAllUserDebugItems() is None
        assert p.getKeyboardEvents() == {} and p.getMouseEvents() == ()
        flags = [getattr(p, name) for name in dir(p) if name.startswith("COV_")]
        assert len(flags) == 16 and all(p.configureDebugVisualizer(flag, 1) is None for flag in flags)
        assert p.configureDebugVisualizer(
            lightPosition=[1, 2, 3], shadowMapResolution=2048, shadowMapWorldSize=5, shadowMapIntensity=0.5, rgbBackground=[1, 1, 1],
            remoteSyncTransformInterval=0.1,
        ) is None


def test_drawings_on_a_link_are_about_its_center_of_mass(script: ModuleType, page: Simulation) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    script.addUserDebugText("tip", [0.1, 0, 0], parentObjectUniqueId=arm, parentLinkIndex=2)
    script.addUserDebugLine([0, 0, 0], [1, 0, 0], parentObjectUniqueId=99)
    on_link, on_none = drawn(page)
    state = script.getLinkState(arm, 2)
    assert (on_link.robot, on_link.link) == ("seven_arm", script.getJointInfo(arm, 2)[12].decode())
    # The same index in PyBullet's terms: of the center of mass, and of the link's frame.
    wanted = script.multiplyTransforms(state[0], state[1], [0.1, 0, 0], [0, 0, 0, 1])[0]
    is_at = script.multiplyTransforms(state[4], state[5], on_link.points[0].tolist(), [0, 0, 0, 1])[0]
    assert is_at == pytest.approx(wanted, abs=1e-6)
    assert (on_none.robot, on_none.points.tolist()) == ("", [[[0, 0, 0], [1, 0, 0]]])
    script.resetSimulation()
    assert page.view.markers() == ()


def test_a_script_that_draws_without_end_loses_its_oldest_lines_and_goes_on(
    script: ModuleType, page: Simulation, capsys: pytest.CaptureFixture[str]
) -> None:
    others = page.view.add(
        [proto.Marker(points=proto.MarkerPoints(points=[0, 0, 0]))] * 2_000, keep=True
    )
    numbers = [script.addUserDebugLine([0, 0, 0], [1, 0, 0]) for _ in range(1_200)]
    assert len(set(numbers)) == 1_200
    lines = [each for each in drawn(page) if each.kind == "lines"]
    assert capsys.readouterr().err.count("its oldest ones go") == 1
    # One client may have 3,072: over Zenoh a client is known by its name.
    assert 500 < len(lines) <= 1_072 and len(page.view.delete(*others)) == 2_000


def test_a_thousand_lines_are_few_calls(
    script: ModuleType, page: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    wire = connections.connected(0).wire
    called: list[str] = []
    send = wire.call_aside

    def counted(method: Any, request: Any, wait: float = 0.0) -> Any:
        called.append(method.key)
        return send(method, request, wait)

    monkeypatch.setattr(wire, "call_aside", counted)
    lines = [script.addUserDebugLine([0, 0, 0], [number, 0, 0]) for number in range(1_000)]
    for line in lines:
        script.addUserDebugLine([0, 0, 0], [0, 1, 0], replaceItemUniqueId=line)
    markers = drawn(page)
    # The second line replaces the first, whether that was sent or still waited.
    assert len(markers) == 1_000 and all(each.points.tolist() == [[[0, 0, 0], [0, 1, 0]]] for each in markers)
    assert 1 <= len(called) <= 200


def test_drawings_are_visible_without_further_calls(script: ModuleType, page: Simulation) -> None:
    script.addUserDebugLine([0, 0, 0], [1, 0, 0])
    # The answer comes with the change.
    seen: proto.NextViewResponse = page.call(methods.NextView, proto.NextViewRequest(timeout=10.0), wait=10.0)
    while not seen.markers:
        seen = page.call(methods.NextView, proto.NextViewRequest(after_version=seen.version, timeout=10.0), wait=10.0)
    assert list(seen.markers[0].lines.points) == [0, 0, 0, 1, 0, 0]


def test_a_drawing_that_the_daemon_refuses_keeps_no_other_away(
    script: ModuleType, page: Simulation, capsys: pytest.CaptureFixture[str]
) -> None:
    script.addUserDebugText("a", [0, 0, 1])
    # Larger than a number of single precision.
    script.addUserDebugLine([0, 0, 0], [1e300, 0, 0])
    script.addUserDebugText("b", [0, 0, 2])
    assert [each.text for each in drawn(page)] == ["a", "b"]
    assert "a drawing is left out: " in capsys.readouterr().err


def test_drawings_go_with_the_script(daemon: DaemonProcess, script: ModuleType) -> None:
    number = script.connect(script.DIRECT, options=f"--endpoint={daemon.endpoint}")
    script.addUserDebugLine([0, 0, 0], [1, 0, 0], physicsClientId=number)
    with simd_client.connect(daemon.endpoint) as other:
        assert len(drawn(other, number)) == 1
        script.disconnect(number)
        assert other.view.markers() == ()


def test_keys_are_reported_as_pybullets_window_does(script: ModuleType, page: Simulation) -> None:
    assert script.getKeyboardEvents() == {}
    down, triggered, released = script.KEY_IS_DOWN, script.KEY_WAS_TRIGGERED, script.KEY_WAS_RELEASED
    report(page, key("a", "KeyA", True), key("ArrowLeft", "ArrowLeft", True))
    assert script.getKeyboardEvents() == {ord("a"): down | triggered, script.B3G_LEFT_ARROW: down | triggered}
    # As long as it is held, it is down.
    assert script.getKeyboardEvents() == {ord("a"): down, script.B3G_LEFT_ARROW: down}
    report(page, key("A", "KeyA", False))
    assert script.getKeyboardEvents() == {ord("a"): released, script.B3G_LEFT_ARROW: down}
    assert script.getKeyboardEvents() == {script.B3G_LEFT_ARROW: down}
    # Pressed and released between two calls.
    report(page, key("ArrowLeft", "ArrowLeft", False), key("q", "KeyQ", True), key("q", "KeyQ", False))
    assert script.getKeyboardEvents() == {script.B3G_LEFT_ARROW: released, ord("q"): triggered | released}
    assert script.getKeyboardEvents() == {}
    named = {
        " ": script.B3G_SPACE,
        "Enter": script.B3G_RETURN,
        "Shift": script.B3G_SHIFT,
        "Control": script.B3G_CONTROL,
        "Alt": script.B3G_ALT,
        "F1": script.B3G_F1,
        "F12": script.B3G_F12,
        "PageUp": script.B3G_PAGE_UP,
        "Home": script.B3G_HOME,
        "Delete": script.B3G_DELETE,
    }
    report(page, *(key(name, name, True) for name in named), key("!", "Digit1", True), key("Dead", "Quote", True))
    assert script.getKeyboardEvents() == {code: down | triggered for code in [*named.values(), ord("1")]}


def test_the_mouse_is_reported_as_pybullets_window_does(script: ModuleType, page: Simulation) -> None:
    assert script.getMouseEvents() == ()
    left = proto.MouseButton.MOUSE_BUTTON_LEFT
    report(
        page,
        proto.InputEvent(mouse=proto.MouseInput(x=10, y=20)),
        proto.InputEvent(mouse=proto.MouseInput(x=10, y=20, button=left, is_down=True)),
        proto.InputEvent(mouse=proto.MouseInput(x=30, y=40)),
        proto.InputEvent(mouse=proto.MouseInput(x=30, y=40, button=left)),
    )
    # Kind, x, y, button, and its flags.
    assert script.getMouseEvents() == (
        (1, 10.0, 20.0, -1, 0),
        (2, 10.0, 20.0, 0, script.KEY_IS_DOWN | script.KEY_WAS_TRIGGERED),
        (1, 30.0, 40.0, -1, 0),
        (2, 30.0, 40.0, 0, script.KEY_WAS_RELEASED),
    )
    assert script.getMouseEvents() == ()


def test_the_camera_of_the_page_is_moved_and_read(bullet: Any, script: ModuleType, page: Simulation) -> None:
    script.resetDebugVisualizerCamera(3.0, 40.0, -20.0, [1, 2, 3])
    wanted: proto.CameraTarget = page.call(methods.NextView, proto.NextViewRequest()).camera
    eye = [wanted.position.x, wanted.position.y, wanted.position.z]
    assert math.dist(eye, [1, 2, 3]) == pytest.approx(3.0) and wanted.field_of_view == pytest.approx(math.pi / 2)
    # The inverse of the view matrix has the eye in its last column.
    view = bullet.computeViewMatrixFromYawPitchRoll([1, 2, 3], 3.0, 40.0, -20.0, 0, 2)
    back = [-sum(view[4 * row + column] * view[12 + column] for column in range(3)) for row in range(3)]
    assert eye == pytest.approx(back, abs=1e-5)

    camera = proto.ViewCamera(
        position=wanted.position, target=wanted.target, up=proto.Vector3(z=1), field_of_view=1.0, width=600, height=400
    )
    # A page that has not followed yet is elsewhere.
    report(page, camera=proto.ViewCamera(position=proto.Vector3(x=9), target=proto.Vector3(), up=proto.Vector3(z=1), field_of_view=1.0, width=6, height=4))
    assert script.getDebugVisualizerCamera()[0] == 1024
    report(page, camera=camera, followed=wanted.version)
    width, height, view, projection, up, forward, side, top, yaw, pitch, distance, target = script.getDebugVisualizerCamera()
    assert (width, height, up, target) == (600, 400, (0.0, 0.0, 1.0), (1.0, 2.0, 3.0))
    assert (yaw, pitch, distance) == pytest.approx((40.0, -20.0, 3.0))
    theirs = bullet.computeViewMatrixFromYawPitchRoll([1, 2, 3], 3.0, 40.0, -20.0, 0, 2)
    assert view == pytest.approx(theirs, abs=1e-5)
    theirs = bullet.computeProjectionMatrixFOV(math.degrees(1.0), 1.5, 0.01, 1000.0)
    assert projection == pytest.approx(theirs, abs=1e-5)
    assert forward == pytest.approx([-view[2], -view[6], -view[10]], abs=1e-9)
    tangent = math.tan(0.5)
    assert side == pytest.approx([20000 * 1.5 * tangent * view[index] for index in (0, 4, 8)], abs=1e-6)
    assert top == pytest.approx([20000 * tangent * view[index] for index in (1, 5, 9)], abs=1e-6)


def test_colours_of_links_are_shown_in_the_page_and_again_after_a_reload(script: ModuleType, page: Simulation) -> None:
    arm = script.loadURDF(str(SEVEN_ARM), useFixedBase=1)
    name = connections.connected(0).bodies[arm].robot

    def shown(after: int) -> tuple[int, dict[str, tuple[float, ...]]]:
        """Once the view is newer: the colours of each link of the arm."""
        answer = page.call(methods.NextView, proto.NextViewRequest(after_version=after, timeout=10), wait=10)
        of_arm = [each for each in answer.colors.colors if each.robot == name]
        return answer.version, {each.link: (each.color.red, each.color.green, each.color.alpha) for each in of_arm}

    before = page.call(methods.NextView, proto.NextViewRequest()).version
    links = [script.getJointInfo(arm, joint)[12].decode() for joint in (1, 2)]
    script.changeVisualShape(arm, 1, rgbaColor=[1, 0.5, 0, 1])
    script.changeVisualShape(arm, 2, rgbaColor=[0, 3, 0, -1])
    version, colors = shown(before)
    if len(colors) < 2:
        version, colors = shown(version)
    assert colors == {links[0]: (1, 0.5, 1), links[1]: (0, 1, 0)}
    script.changeDynamics(arm, 2, mass=3)
    _, colors = shown(version)
    assert colors == {links[0]: (1, 0.5, 1), links[1]: (0, 1, 0)}
    # Unknown things are not shown.
    script.changeVisualShape(arm, 99, rgbaColor=[1, 0, 0, 1])
    script.changeVisualShape(arm, 1, rgbaColor=[1, 0, 0, 1])
    script.removeBody(arm)
