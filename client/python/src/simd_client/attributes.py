"""Objects that refuse unknown attributes: `joint.traget = 0.5` raises, and suggests the intended name."""

from __future__ import annotations

import difflib
import inspect
from functools import cache

_GENERAL = ("set_physics", "set_properties", "set_joint_properties")
# Arguments of setters that are not values of the object.
_NOT_VALUES = ("self", "names", "beyond_limit")


class FixedAttributes:
    """Base class of objects that take no new attributes. Names that begin with `_` are free, and so are
    derived classes of other packages. A public name that is annotated in the class is assigned once, by the
    class itself."""

    def __setattr__(self, name: str, value: object) -> None:
        if name[0] != "_" and not _may_assign(type(self), name, name in self.__dict__):
            raise AttributeError(_refusal(type(self), name))
        object.__setattr__(self, name, value)


@cache
def _may_assign(kind: type, name: str, is_assigned: bool) -> bool:
    if not kind.__module__.startswith("simd_client."):
        return True
    found = inspect.getattr_static(kind, name, None)
    if isinstance(found, property):
        return found.fset is not None
    return not is_assigned and any(name in inspect.get_annotations(each) for each in kind.__mro__)


def _refusal(kind: type, name: str) -> str:
    is_there = inspect.getattr_static(kind, name, None) is not None or any(
        name in inspect.get_annotations(each) for each in kind.__mro__
    )
    problem = f"`{kind.__name__}.{name}` cannot be assigned" if is_there else f"`{kind.__name__}` has no attribute `{name}`"
    meant = _meant(kind, name)
    return f"{problem}; did you mean `{meant}`?" if meant else f"{problem}; keep your values in your own objects"


def _meant(kind: type, name: str) -> str | None:
    """Returns the setter of the value with this name, or with the most similar name."""
    setters = _setters(kind)
    if name in setters:
        return setters[name]
    found = difflib.get_close_matches(name, setters, 1, 0.7)
    if found:
        return setters[found[0]]
    names = [each for each in dir(kind) if not each.startswith("_") and each != name]
    return next(iter(difflib.get_close_matches(name, names, 1, 0.7)), None)


@cache
def _setters(kind: type) -> dict[str, str]:
    """Returns the setter of each value, by its name: a property, `set_NAME`, or an argument of another
    `set_...`."""
    found: dict[str, str] = {}
    members = {name: inspect.getattr_static(kind, name) for name in dir(kind) if not name.startswith("_")}
    found.update((name, name) for name, each in members.items() if isinstance(each, property) and each.fset is not None)
    methods = {name: each for name, each in members.items() if name.startswith("set_") and inspect.isfunction(each)}
    for name, method in methods.items():
        found.setdefault(name.removeprefix("set_"), _awaited(method, f"{name}(...)"))
    for name in sorted(methods, key=lambda each: each not in _GENERAL):
        for argument in inspect.signature(methods[name]).parameters:
            if argument not in _NOT_VALUES:
                found.setdefault(argument, _awaited(methods[name], f"{name}({argument}=...)"))
    return found


def _awaited(method: object, call: str) -> str:
    return f"await {call}" if inspect.iscoroutinefunction(method) else call
