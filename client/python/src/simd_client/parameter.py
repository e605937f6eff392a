"""Sliders and buttons, and the list of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from simd_client import proto
from simd_client.errors import ParameterNotFound, listed, not_found
from simd_client.table import Table

IfTaken = Literal["refuse", "replace", "rename"]
"""Behaviour for a taken name. `ParameterExists` is raised, the old parameter is replaced (`OwnedByAnother` if
it is another client's), or `_1`, `_2`, ... is added to the name."""

_POLICIES = {
    "refuse": proto.NameTakenPolicy.NAME_TAKEN_POLICY_REFUSE,
    "replace": proto.NameTakenPolicy.NAME_TAKEN_POLICY_REPLACE,
    "rename": proto.NameTakenPolicy.NAME_TAKEN_POLICY_RENAME,
}


BoundMode = Literal["position", "velocity", "effort"]
"""Quantity of a joint that a slider sets: rad or m, rad/s or m/s, N m or N."""

_MODES: dict[BoundMode, proto.JointMode] = {
    "position": proto.JointMode.JOINT_MODE_POSITION,
    "velocity": proto.JointMode.JOINT_MODE_VELOCITY,
    "effort": proto.JointMode.JOINT_MODE_EFFORT,
}


@dataclass(frozen=True)
class JointBinding:
    """A joint with a target that a slider sets each time it is moved. The daemon does that without any
    running program."""

    robot: str
    joint: str
    mode: BoundMode = "position"
    axis: int = 0
    """Axis of a planar joint: 0 x, 1 y, 2 angle."""


@dataclass(frozen=True)
class Slider:
    """A number with a range."""

    name: str
    minimum: float
    maximum: float
    value: float
    version: int = 0
    """Version of the list at its last change."""
    owner: str = ""
    """Creator, for people: the name of a token, or of the client and its origin."""
    joint: JointBinding | None = None
    """Joint with the target that it sets."""


@dataclass(frozen=True)
class Button:
    """A button that counts how often it was pressed."""

    name: str
    presses: int
    """Number of presses."""
    version: int = 0
    """Version of the list at its last change."""
    owner: str = ""
    """Creator, for people: the name of a token, or of the client and its origin."""

    @property
    def value(self) -> float:
        """Number of presses."""
        return float(self.presses)


Parameter = Slider | Button


@dataclass(frozen=True, eq=False)
class ParameterList(Mapping[str, float]):
    """Values of parameters by name, in the order in which they were added: a slider's value, or a button's
    number of presses."""

    version: int
    """Version of the list; grows with each change, also when a parameter is removed."""
    by_name: Mapping[str, Parameter] = field(default_factory=dict[str, Parameter])
    """The sliders and buttons themselves."""

    def __getitem__(self, name: str) -> float:
        if name not in self.by_name:
            message = f"there is no parameter `{name}`; there are {listed(self.by_name, name)}"
            raise not_found(ParameterNotFound, message, parameter=name)
        return self.by_name[name].value

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_name)

    def __len__(self) -> int:
        return len(self.by_name)

    def table(self) -> Table:
        """One row per parameter."""
        rows = [
            (each.name, f"{each.value:g}", f"{each.minimum:g} to {each.maximum:g}{_bound(each.joint)}")
            if isinstance(each, Slider)
            else (each.name, f"{each.presses}", "button")
            for each in self.by_name.values()
        ]
        return Table(("parameter", "value", "range"), rows)

    def __repr__(self) -> str:
        return f"<ParameterList, version {self.version}>\n{self.table().text()}"

    def _repr_html_(self) -> str:
        return self.table().html("Parameters")


def _bound(joint: JointBinding | None) -> str:
    return "" if joint is None else f", {joint.mode} of {joint.robot}/{joint.joint}"


def parameter_from_proto(message: proto.Parameter) -> Parameter:
    """Converts a parameter from its message."""
    if message.HasField("button"):
        return Button(message.name, message.button.presses, message.version, message.owner)
    slider = message.slider
    joint = _binding_from_proto(message.joint) if message.HasField("joint") else None
    return Slider(message.name, slider.minimum, slider.maximum, slider.value, message.version, message.owner, joint)


def _binding_from_proto(message: proto.JointBinding) -> JointBinding:
    found: dict[proto.JointMode, BoundMode] = {number: mode for mode, number in _MODES.items()}
    mode = found.get(message.mode, "position")
    return JointBinding(message.robot, message.joint, mode, message.axis)


def binding_to_proto(binding: JointBinding) -> proto.JointBinding:
    """Converts to a message. Raises `ValueError` for another `mode`."""
    if binding.mode not in _MODES:
        raise ValueError(f"mode is 'position', 'velocity' or 'effort', not {binding.mode!r}")
    return proto.JointBinding(robot=binding.robot, joint=binding.joint, mode=_MODES[binding.mode], axis=binding.axis)


def list_from_proto(message: proto.ParameterList) -> ParameterList:
    """Converts all of them from their message."""
    return ParameterList(
        message.version, {each.name: parameter_from_proto(each) for each in message.parameters}
    )


def add_request(parameter: Parameter, if_taken: IfTaken, take_over: bool) -> proto.AddParameterRequest:
    """Builds the request that adds a slider or a button. Raises `ValueError` for another `if_taken`."""
    if if_taken not in _POLICIES:
        raise ValueError(f"if_taken is 'refuse', 'replace' or 'rename', not {if_taken!r}")
    message = proto.Parameter(name=parameter.name)
    if isinstance(parameter, Slider):
        slider = proto.Slider(minimum=parameter.minimum, maximum=parameter.maximum, value=parameter.value)
        message.slider.CopyFrom(slider)
        if parameter.joint is not None:
            message.joint.CopyFrom(binding_to_proto(parameter.joint))
    else:
        message.button.CopyFrom(proto.Button(presses=parameter.presses))
    return proto.AddParameterRequest(parameter=message, name_taken=_POLICIES[if_taken], take_over=take_over)
