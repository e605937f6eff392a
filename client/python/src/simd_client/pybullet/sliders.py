"""PyBullet's debug parameters: the daemon's sliders and buttons, which any client can use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from simd_client.proto import (
    AddParameterRequest,
    NameTakenPolicy,
    Parameter,
    ParameterList,
    RemoveParametersRequest,
    methods,
)

from .errors import error

if TYPE_CHECKING:
    from .wire import Wire


@dataclass
class _Item:
    name: str
    # Value of an unpressed button.
    start: float
    button: bool


class Sliders:
    """The sliders and buttons of one script, by PyBullet's item number."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._items: dict[int, _Item] = {}
        self._next = 0

    def add(self, name: str, low: float, high: float, start: float) -> int:
        """Adds a slider, or a button if `low` is above `high`. It replaces another program's item of the same
        name; a second one of this script gets a number."""
        own = any(item.name == name for item in self._items.values())
        policy = (
            NameTakenPolicy.NAME_TAKEN_POLICY_RENAME if own else NameTakenPolicy.NAME_TAKEN_POLICY_REPLACE
        )
        wanted = Parameter(name=name or "parameter")
        button = low > high
        if button:
            wanted.button.SetInParent()
        else:
            # PyBullet accepts a range of one value.
            wanted.slider.minimum, wanted.slider.value = low, start
            wanted.slider.maximum = high if high > low else math.nextafter(low, math.inf)
        added = self._wire.call(
            methods.AddParameter, AddParameterRequest(parameter=wanted, name_taken=policy)
        ).parameter
        self._wire.watch_parameters()
        number = self.number()
        self._items[number] = _Item(added.name, start, button)
        return number

    def number(self) -> int:
        """Returns the number of the next item: slider, button or drawing."""
        self._next += 1
        return self._next - 1

    def read(self, number: int) -> float:
        """Returns the current value: a slider's, or a button's number of presses, plus its start."""
        item = self._items.get(number)
        if item is None:
            raise error("Failed to read parameter.")
        parameter = find(self._wire.parameters(), item.name)
        if parameter is None:
            raise error(f"Failed to read parameter. `{item.name}` was removed.")
        return item.start + parameter.button.presses if item.button else parameter.slider.value

    def remove(self, number: int) -> bool:
        """Removes an item. Returns whether it was one of these."""
        item = self._items.pop(number, None)
        if item is not None:
            self._take_down([item.name])
        return item is not None

    def remove_own(self) -> None:
        """Removes the items of this script."""
        names = [item.name for item in self._items.values()]
        self._items.clear()
        if names:
            self._take_down(names)

    def _take_down(self, names: list[str]) -> None:
        try:
            self._wire.call(methods.RemoveParameters, RemoveParametersRequest(names=names))
        except error as refusal:
            # Another program was faster.
            if refusal.reason != "PARAMETER_NOT_FOUND":
                raise


def find(parameters: ParameterList, name: str) -> Parameter | None:
    """Returns the parameter with that name."""
    for parameter in parameters.parameters:
        if parameter.name == name:
            return parameter
    return None
