# Generated from simd_client/aio/parameters.py by tools/make_blocking.py; do not edit.
"""Sliders and buttons that programs add and people use. They belong to the daemon, not to a client."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

from simd_client import keys, proto
from simd_client.blocking.callbacks import Callbacks
from simd_client.blocking.connection import Connection
from simd_client.blocking.joint import Joint
from simd_client.blocking.watch import Watch
from simd_client.attributes import FixedAttributes
from simd_client.errors import AnswerError
from simd_client.method import decoded
from simd_client.parameter import (
    BoundMode,
    Button,
    IfTaken,
    JointBinding,
    Parameter,
    ParameterList,
    Slider,
    add_request,
    list_from_proto,
    parameter_from_proto,
)
from simd_client.proto import methods


class Parameters(FixedAttributes):
    """The parameters of a world. They control programs, not physics; resets do not change them."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def add_slider(
        self,
        name: str,
        minimum: float,
        maximum: float,
        value: float,
        *,
        joint: Joint | JointBinding | None = None,
        mode: BoundMode = "position",
        if_taken: IfTaken = "refuse",
        take_over: bool = False,
    ) -> Slider:
        """Adds a slider. A value outside the range is moved to the nearest end.

        With `joint`, one of a robot's `joints`, the daemon sets the joint's target each time a client or the
        page moves the slider. `mode` selects a position, velocity or effort. The binding remains when this
        program has ended. Nothing is set when the slider is added. Raises `RobotNotFound`, `JointNotFound`,
        `JointNotActuated`."""
        bound = joint if joint is None or isinstance(joint, JointBinding) else JointBinding(joint.robot_name, joint.name, mode)
        slider = Slider(name, minimum, maximum, value, joint=bound)
        return cast(Slider, self._add(slider, if_taken, take_over))

    def add_button(
        self, name: str, *, if_taken: IfTaken = "refuse", take_over: bool = False
    ) -> Button:
        """Adds a button."""
        return cast(Button, self._add(Button(name, 0), if_taken, take_over))

    def __getitem__(self, name: str) -> float:
        """A slider's value, or how often a button was pressed. One round trip; use `watch` in loops."""
        return self.get(name).value

    def __setitem__(self, name: str, value: float) -> None:
        """Moves a slider. Raises `InvalidValue` outside its range."""
        self.set({name: value})

    def __delitem__(self, name: str) -> None:
        """Removes a parameter."""
        self.remove(name)

    def get(self, name: str) -> Parameter:
        """Returns one parameter. Raises `ParameterNotFound`."""
        answer = self._connection.call(
            methods.GetParameters, proto.GetParametersRequest(names=[name])
        )
        found = list_from_proto(answer.list).by_name
        if name not in found:
            raise AnswerError(f"the daemon's answer cannot be understood: it lacks parameter `{name}`")
        return found[name]

    def set(self, values: Mapping[str, float]) -> list[Parameter]:
        """Moves all of these sliders or none. Raises `ParameterNotFound`, `InvalidValue`. For sliders that
        are bound to joints, it also raises the errors of targets, and then moves none."""
        return self._change(
            [proto.ParameterChange(name=name, value=float(value)) for name, value in values.items()]
        )

    def press(self, name: str, times: int = 1) -> Parameter:
        """Presses a button."""
        return self._change([proto.ParameterChange(name=name, presses=times)])[0]

    def all(self) -> ParameterList:
        """Returns all parameters, in the order in which they were added."""
        answer = self._connection.call(methods.GetParameters, proto.GetParametersRequest())
        return list_from_proto(answer.list)

    def next(self, after_version: int, wait: float = 1.0) -> ParameterList:
        """Returns all parameters once one of them is newer, or the current ones after `wait` seconds (at most
        60)."""
        request = proto.NextParametersRequest(after_version=after_version, timeout=wait)
        answer = self._connection.call(methods.NextParameters, request, wait=wait or 1.0)
        return list_from_proto(answer.list)

    def watch(self, rate: float | None = None) -> Watch[ParameterList]:
        """Iterates over all parameters now, and after each change. Its `newest()` costs no round trip."""
        return _ParameterWatch(self._connection, keys.parameters(self._connection.name), rate)

    def on_change(
        self, function: Callable[[ParameterList], object], rate: float | None = None
    ) -> Callbacks[ParameterList]:
        """Calls a function with all parameters now, and after each change, as `watch` gives them."""
        return Callbacks(self._connection.link, self.watch(rate), function)

    def remove(self, *names: str, take_over: bool = False) -> tuple[str, ...]:
        """Removes these parameters, or all except other clients'. Returns the names of the removed
        parameters. Raises `OwnedByAnother`, unless `take_over`: if the daemon requires tokens, that needs an
        admin's token."""
        request = proto.RemoveParametersRequest(names=names, take_over=take_over)
        return tuple(self._connection.call(methods.RemoveParameters, request).removed)

    def _add(self, parameter: Parameter, if_taken: IfTaken, take_over: bool) -> Parameter:
        request = add_request(parameter, if_taken, take_over)
        return parameter_from_proto(self._connection.call(methods.AddParameter, request).parameter)

    def _change(self, changes: list[proto.ParameterChange]) -> list[Parameter]:
        request = proto.SetParametersRequest(changes=changes)
        answer = self._connection.call(methods.SetParameters, request)
        return [parameter_from_proto(each) for each in answer.parameters]

    def __repr__(self) -> str:
        return repr(self.all())

    def _repr_html_(self) -> str:
        return self.all().table().html("Parameters")


class _ParameterWatch(Watch[ParameterList]):
    def _read(self, payload: bytes) -> ParameterList | None:
        return list_from_proto(decoded(proto.ParameterList, payload))

    def _ask(self) -> ParameterList:
        return Parameters(self._connection).all()

    def _order(self, item: ParameterList) -> int:
        return item.version
