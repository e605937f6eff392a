"""Sliders and buttons that programs put up and people move, for asyncio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from simd_client.aio.runner import Answer, run
from simd_client.aio.watch import Watch
from simd_client.link import Link
from simd_client.parameters import parameter_source
from simd_client.plans import parameters as plans
from simd_client.plans.parameters import Button, IfTaken, Parameter, ParameterList, Slider


class Parameters:
    """See `simd_client.Parameters`; `await` each call."""

    def __init__(self, link: Link, timeout: float) -> None:
        self._link = link
        self._timeout = timeout

    async def add_slider(
        self, name: str, minimum: float, maximum: float, value: float, *, if_taken: IfTaken = "refuse"
    ) -> Slider:
        """Puts up a slider. A value outside the range is moved to the nearest end."""
        added = await run(
            self._link, plans.add(Slider(name, minimum, maximum, value), if_taken), self._timeout
        )
        return cast(Slider, added)

    async def add_button(self, name: str, *, if_taken: IfTaken = "refuse") -> Button:
        """Puts up a button."""
        return cast(Button, await run(self._link, plans.add(Button(name, 0), if_taken), self._timeout))

    async def get(self, name: str) -> Parameter:
        """One of them. Raises `ParameterNotFound`."""
        return plans.only(await run(self._link, plans.get([name]), self._timeout), name)

    def set(self, values: Mapping[str, float]) -> Answer[list[Parameter]]:
        """Moves sliders, all or none. Raises `ParameterNotFound`, `InvalidValue`."""
        return run(self._link, plans.set_values(values, {}), self._timeout)

    async def press(self, name: str, times: int = 1) -> Parameter:
        """Presses a button."""
        return (await run(self._link, plans.set_values({}, {name: times}), self._timeout))[0]

    def all(self) -> Answer[ParameterList]:
        """All of them, in the order in which they were added."""
        return run(self._link, plans.get(), self._timeout)

    def next(self, after_version: int, wait: float = 1.0) -> Answer[ParameterList]:
        """All of them once anything is newer, or as they are after `wait` seconds, at most 60."""
        return run(self._link, plans.following(after_version, wait), self._timeout)

    def watch(self, rate: float | None = None) -> Watch[ParameterList]:
        """All of them now, and each time something changed."""
        return Watch(self._link, parameter_source(self._link.name), rate, self._timeout)

    def remove(self, *names: str) -> Answer[tuple[str, ...]]:
        """Takes parameters down, all of them where none is named; returns those that are gone."""
        return run(self._link, plans.remove(names), self._timeout)
