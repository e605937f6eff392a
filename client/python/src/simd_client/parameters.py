"""Sliders and buttons that programs put up and people move: the daemon's, not a client's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from simd_client import keys
from simd_client.link import Link
from simd_client.plans import parameters as plans
from simd_client.plans.parameters import Button, IfTaken, Parameter, ParameterList, Slider
from simd_client.watch import Source, Watch


def parameter_source(daemon: str) -> Source[ParameterList]:
    """Where parameters are watched."""
    return Source(keys.parameters(daemon), plans.published, plans.get, lambda listed: listed.version)


class Parameters:
    """The parameters of a world. They steer programs, not physics; resets leave them alone."""

    def __init__(self, link: Link, timeout: float) -> None:
        self._link = link
        self._timeout = timeout

    def add_slider(
        self, name: str, minimum: float, maximum: float, value: float, *, if_taken: IfTaken = "refuse"
    ) -> Slider:
        """Puts up a slider. A value outside the range is moved to the nearest end."""
        added = self._link.run(plans.add(Slider(name, minimum, maximum, value), if_taken), self._timeout)
        return cast(Slider, added)

    def add_button(self, name: str, *, if_taken: IfTaken = "refuse") -> Button:
        """Puts up a button."""
        return cast(Button, self._link.run(plans.add(Button(name, 0), if_taken), self._timeout))

    def __getitem__(self, name: str) -> float:
        """A slider's value, or how often a button was pressed. One round trip; see `watch` for loops."""
        return self.get(name).value

    def __setitem__(self, name: str, value: float) -> None:
        """Moves a slider. Raises `InvalidValue` outside its range."""
        self.set({name: value})

    def __delitem__(self, name: str) -> None:
        """Takes one down."""
        self.remove(name)

    def get(self, name: str) -> Parameter:
        """One of them. Raises `ParameterNotFound`."""
        return plans.only(self._link.run(plans.get([name]), self._timeout), name)

    def set(self, values: Mapping[str, float]) -> list[Parameter]:
        """Moves sliders, all or none. Raises `ParameterNotFound`, `InvalidValue`."""
        return self._link.run(plans.set_values(values, {}), self._timeout)

    def press(self, name: str, times: int = 1) -> Parameter:
        """Presses a button."""
        return self._link.run(plans.set_values({}, {name: times}), self._timeout)[0]

    def all(self) -> ParameterList:
        """All of them, in the order in which they were added."""
        return self._link.run(plans.get(), self._timeout)

    def next(self, after_version: int, wait: float = 1.0) -> ParameterList:
        """All of them once anything is newer, or as they are after `wait` seconds, at most 60."""
        return self._link.run(plans.following(after_version, wait), self._timeout)

    def watch(self, rate: float | None = None) -> Watch[ParameterList]:
        """All of them now, and each time something changed. `newest()` of it costs no round trip."""
        return Watch(self._link, parameter_source(self._link.name), rate, self._timeout)

    def remove(self, *names: str) -> tuple[str, ...]:
        """Takes parameters down, all of them where none is named; returns those that are gone."""
        return self._link.run(plans.remove(names), self._timeout)

    def __repr__(self) -> str:
        return repr(self.all())

    def _repr_html_(self) -> str:
        return self.all().table().html("Parameters")
