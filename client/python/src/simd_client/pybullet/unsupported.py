"""PyBullet's functions that are not supported (yet): each raises an error with its name and the reason."""

from __future__ import annotations

from typing import Any, NoReturn

from .errors import unsupported

_SOFT = "simd has rigid bodies only"
_SHAPES = "shapes of a robot are not changed once it is there"


def _raises(function: str, why: str) -> Any:
    def refuse(*_arguments: Any, **_named: Any) -> NoReturn:
        raise unsupported(function, why)

    refuse.__name__ = refuse.__qualname__ = function
    refuse.__doc__ = f"Raises NotImplementedError: {why}."
    return refuse


createSoftBodyAnchor = _raises("createSoftBodyAnchor", _SOFT)
getMeshData = _raises("getMeshData", _SOFT)
getTetraMeshData = _raises("getTetraMeshData", _SOFT)
loadSoftBody = _raises("loadSoftBody", _SOFT)
resetMeshData = _raises("resetMeshData", _SOFT)
unsupportedChangeScaling = _raises("unsupportedChangeScaling", _SHAPES)

__all__ = [
    "createSoftBodyAnchor",
    "getMeshData",
    "getTetraMeshData",
    "loadSoftBody",
    "resetMeshData",
    "unsupportedChangeScaling",
]
