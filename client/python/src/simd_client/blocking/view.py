# Generated from simd_client/aio/view.py by tools/make_blocking.py; do not edit.
"""Drawings in pages and input from people: markers, cameras, keys and mouse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy.typing as npt

from simd_client import proto
from simd_client.blocking.connection import Connection
from simd_client.attributes import FixedAttributes
from simd_client.geometry import vector, vector_to_proto
from simd_client.proto import methods
from simd_client.state import Named, name_of
from simd_client.view import (
    Input,
    Marker,
    ViewCamera,
    camera_from_proto,
    camera_to_proto,
    color_to_proto,
    drawn,
    input_from_proto,
    marker_from_proto,
    marker_to_proto,
)


class View(FixedAttributes):
    """Drawings and input of pages. They are not part of the world: resets and saved states do not change
    them.

    Markers are deleted with the connection that drew them unless `keep` is true, or after `life_time` wall
    seconds. With `robot`, and its `link`, they move with the link, and positions are in its frame. `replace`
    is the id of the marker that the new one replaces. Colours are red, green and blue from 0 to 1. Raises
    `RobotNotFound`, `LinkNotFound`, `LimitExceeded`.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def add_lines(
        self,
        points: npt.ArrayLike,
        *,
        color: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
        width: float = 1.0,
        robot: str | Named | None = None,
        link: str = "",
        life_time: float | None = None,
        replace: int | None = None,
        keep: bool = False,
    ) -> int:
        """Draws lines, their width in CSS pixels, and returns the marker's id. `points` has both ends of
        each, (N, 2, 3) in metres; `colors` one for each, (N, 3)."""
        marker = marker_to_proto(color=color, robot=robot, link=link, life_time=life_time, replace=replace)
        lines = proto.MarkerLines(points=drawn(points, (2, 3), "what lines go through"), width=width)
        if colors is not None:
            lines.colors.extend(drawn(colors, (3,), "what has the lines' colours"))
        marker.lines.CopyFrom(lines)
        return self.add([marker], keep=keep)[0]

    def add_points(
        self,
        points: npt.ArrayLike,
        *,
        color: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
        size: float = 6.0,
        robot: str | Named | None = None,
        link: str = "",
        life_time: float | None = None,
        replace: int | None = None,
        keep: bool = False,
    ) -> int:
        """Draws dots, their size in CSS pixels, and returns the marker's id. `points` is (N, 3) in metres,
        `colors` (N, 3)."""
        marker = marker_to_proto(color=color, robot=robot, link=link, life_time=life_time, replace=replace)
        dots = proto.MarkerPoints(points=drawn(points, (3,), "what has the points"), size=size)
        if colors is not None:
            dots.colors.extend(drawn(colors, (3,), "what has the points' colours"))
        marker.points.CopyFrom(dots)
        return self.add([marker], keep=keep)[0]

    def add_text(
        self,
        text: str,
        position: npt.ArrayLike = (0, 0, 0),
        *,
        orientation: npt.ArrayLike | None = None,
        size: float = 0.1,
        color: npt.ArrayLike | None = None,
        robot: str | Named | None = None,
        link: str = "",
        life_time: float | None = None,
        replace: int | None = None,
        keep: bool = False,
    ) -> int:
        """Draws a text that begins at a position, `size` metres high, and returns the marker's id. It faces the camera, or is
        written along x of an `orientation` (a quaternion x y z w) with y up."""
        marker = marker_to_proto(color=color, robot=robot, link=link, life_time=life_time, replace=replace)
        at = vector_to_proto(position, "a position")
        marker.text.CopyFrom(proto.MarkerText(text=text, position=at, size=size))
        if orientation is not None:
            x, y, z, w = vector(orientation, 4, "an orientation (x y z w)").tolist()
            marker.text.orientation.CopyFrom(proto.Quaternion(x=x, y=y, z=z, w=w))
        return self.add([marker], keep=keep)[0]

    def add(self, markers: Sequence[proto.Marker], *, keep: bool = False) -> list[int]:
        """Draws markers that are messages of the schema, all or none, in one round trip. Returns their ids."""
        request = proto.AddMarkersRequest(markers=markers, until_disconnect=not keep)
        return list(self._connection.call(methods.AddMarkers, request).ids)

    def delete(self, *ids: int, take_over: bool = False) -> tuple[int, ...]:
        """Deletes these markers, or all except other clients'. Returns the ids of the deleted markers. Raises
        `OwnedByAnother`, unless `take_over`: if the daemon requires tokens, that needs an admin's token."""
        request = proto.DeleteMarkersRequest(ids=ids, take_over=take_over)
        return tuple(self._connection.call(methods.DeleteMarkers, request).deleted)

    def markers(self) -> tuple[Marker, ...]:
        """All markers, in the order in which they were added."""
        answer = self._connection.call(methods.ListMarkers, proto.ListMarkersRequest())
        return tuple(marker_from_proto(each) for each in answer.markers)

    def set_link_colors(
        self, robot: str | Named, colors: Mapping[str, Sequence[float] | None]
    ) -> None:
        """Colours links of a robot in pages, by their names: red, green, blue and perhaps alpha, from 0 to 1.
        `None` restores the colour of the description. A reload of the robot deletes the colours; they are not
        part of the world."""
        links = [color_to_proto(name_of(robot), link, color) for link, color in colors.items()]
        if links:
            self._connection.call(methods.SetLinkColors, proto.SetLinkColorsRequest(colors=links))

    def set_camera(
        self, position: npt.ArrayLike, target: npt.ArrayLike = (0, 0, 0), *, field_of_view: float | None = None
    ) -> int:
        """Moves the cameras of all pages, also of pages opened later: to a position, looking at a target,
        metres. The vertical field of view, radians, stays if it is left out. Returns a number that grows each
        time."""
        request = camera_to_proto(position, target, field_of_view)
        return self._connection.call(methods.SetCamera, request).version

    def cameras(self) -> tuple[ViewCamera, ...]:
        """Returns the cameras of the open pages, the last moved first."""
        answer = self._connection.call(methods.GetCameras, proto.GetCamerasRequest())
        return tuple(camera_from_proto(each) for each in answer.cameras)

    def next_input(self, after: int | None = None, wait: float = 1.0) -> Input:
        """Returns keys and mouse in pages after a sequence, as soon as there are some, or none after `wait`
        seconds (at most 60). Without `after` it immediately returns none, and the sequence to continue from.
        Pages report until five seconds after the last such call; meanwhile the page's own keys do nothing."""
        request = proto.NextInputRequest(after_sequence=after, timeout=wait)
        answer = self._connection.call(methods.NextInput, request, wait=wait or 1.0)
        return input_from_proto(answer)
