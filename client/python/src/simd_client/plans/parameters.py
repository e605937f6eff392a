"""Calls of `ParameterService`: sliders and buttons."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from simd_client import proto
from simd_client.errors import AnswerError
from simd_client.plan import Plan, ask, read
from simd_client.proto import methods
from simd_client.table import Table

IfTaken = Literal["refuse", "replace", "rename"]
"""What adding does where the name is taken: refuse with `ParameterExists`, take the old one's place with
the new range and value, or add `_1`, `_2`, ... to the name."""

_POLICIES = {
    "refuse": proto.NameTakenPolicy.NAME_TAKEN_POLICY_REFUSE,
    "replace": proto.NameTakenPolicy.NAME_TAKEN_POLICY_REPLACE,
    "rename": proto.NameTakenPolicy.NAME_TAKEN_POLICY_RENAME,
}


@dataclass(frozen=True)
class Slider:
    """A number between two others."""

    name: str
    minimum: float
    maximum: float
    value: float
    version: int = 0
    """The list's version when it last changed."""


@dataclass(frozen=True)
class Button:
    """Something to press."""

    name: str
    presses: int
    """How often it was pressed."""
    version: int = 0
    """The list's version when it last changed."""

    @property
    def value(self) -> float:
        """How often it was pressed."""
        return float(self.presses)


Parameter = Slider | Button


@dataclass(frozen=True, eq=False)
class ParameterList(Mapping[str, Parameter]):
    """Parameters by name, in the order in which they were added."""

    version: int
    """Grows with every change, also with one that takes a parameter down."""
    by_name: Mapping[str, Parameter] = field(default_factory=dict[str, Parameter])

    def __getitem__(self, name: str) -> Parameter:
        return self.by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_name)

    def __len__(self) -> int:
        return len(self.by_name)

    def table(self) -> Table:
        """One row a parameter, for people."""
        rows = [
            (each.name, f"{each.value:g}", f"{each.minimum:g} to {each.maximum:g}")
            if isinstance(each, Slider)
            else (each.name, f"{each.presses}", "button")
            for each in self.by_name.values()
        ]
        return Table(("parameter", "value", "range"), rows)

    def __repr__(self) -> str:
        return f"<ParameterList, version {self.version}>\n{self.table().text()}"

    def _repr_html_(self) -> str:
        return self.table().html("Parameters")


def parameter_from_proto(message: proto.Parameter) -> Parameter:
    """A parameter from its message."""
    if message.HasField("button"):
        return Button(message.name, message.button.presses, message.version)
    slider = message.slider
    return Slider(message.name, slider.minimum, slider.maximum, slider.value, message.version)


def list_from_proto(message: proto.ParameterList) -> ParameterList:
    """All of them from their message."""
    return ParameterList(
        message.version, {each.name: parameter_from_proto(each) for each in message.parameters}
    )


def add(parameter: Parameter, if_taken: IfTaken) -> Plan[Parameter]:
    """Puts up a slider or a button."""
    if if_taken not in _POLICIES:
        raise ValueError(f"if_taken is 'refuse', 'replace' or 'rename', not {if_taken!r}")
    message = proto.Parameter(name=parameter.name)
    if isinstance(parameter, Slider):
        slider = proto.Slider(minimum=parameter.minimum, maximum=parameter.maximum, value=parameter.value)
        message.slider.CopyFrom(slider)
    else:
        message.button.CopyFrom(proto.Button(presses=parameter.presses))
    request = proto.AddParameterRequest(parameter=message, name_taken=_POLICIES[if_taken])
    return parameter_from_proto((yield from ask(methods.AddParameter, request)).parameter)


def set_values(values: Mapping[str, float], presses: Mapping[str, int]) -> Plan[list[Parameter]]:
    """Moves sliders, presses buttons; all or nothing."""
    changes = [proto.ParameterChange(name=name, value=float(value)) for name, value in values.items()]
    changes += [proto.ParameterChange(name=name, presses=times) for name, times in presses.items()]
    answer = yield from ask(methods.SetParameters, proto.SetParametersRequest(changes=changes))
    return [parameter_from_proto(each) for each in answer.parameters]


def get(names: Sequence[str] = ()) -> Plan[ParameterList]:
    """Those of these names, or all."""
    answer = yield from ask(methods.GetParameters, proto.GetParametersRequest(names=names))
    return list_from_proto(answer.list)


def only(found: ParameterList, name: str) -> Parameter:
    """The one that was asked for."""
    if name not in found:
        raise AnswerError(f"the daemon's answer cannot be understood: it lacks parameter `{name}`")
    return found[name]


def following(after_version: int, wait: float) -> Plan[ParameterList]:
    """All of them once anything is newer, or as they are after `wait` seconds."""
    request = proto.NextParametersRequest(after_version=after_version, timeout=wait)
    answer = yield from ask(methods.NextParameters, request, wait or 1.0)
    return list_from_proto(answer.list)


def published(payload: bytes) -> Plan[ParameterList | None]:
    """All of them as they are published."""
    yield from ()
    return list_from_proto(read(proto.ParameterList, payload))


def remove(names: Sequence[str]) -> Plan[tuple[str, ...]]:
    """Takes parameters down; all of them where none is named."""
    answer = yield from ask(methods.RemoveParameters, proto.RemoveParametersRequest(names=names))
    return tuple(answer.removed)
