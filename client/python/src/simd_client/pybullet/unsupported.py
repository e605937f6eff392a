"""PyBullet's functions that are not supported (yet): each raises, with its name and the reason."""

from __future__ import annotations

from typing import Any, NoReturn

from .errors import unsupported

_IMAGES = "it is the old form of getCameraImage"
_SOFT = "simd has rigid bodies only"
_SHAPES = "shapes of a robot are not changed once it is there"


def _raises(function: str, why: str) -> Any:
    def refuse(*_arguments: Any, **_named: Any) -> NoReturn:
        raise unsupported(function, why)

    refuse.__name__ = refuse.__qualname__ = function
    refuse.__doc__ = f"Raises NotImplementedError: {why}."
    return refuse


calculateInverseKinematics2 = _raises(
    "calculateInverseKinematics2", "the daemon solves for one link at a time"
)
createSoftBodyAnchor = _raises("createSoftBodyAnchor", _SOFT)
getMeshData = _raises("getMeshData", _SOFT)
getTetraMeshData = _raises("getTetraMeshData", _SOFT)
loadSoftBody = _raises("loadSoftBody", _SOFT)
renderImage = _raises("renderImage", _IMAGES)
resetMeshData = _raises("resetMeshData", _SOFT)
unsupportedChangeScaling = _raises("unsupportedChangeScaling", _SHAPES)
vhacd = _raises("vhacd", "the daemon divides meshes itself: GEOM_FORCE_CONCAVE_TRIMESH of createCollisionShape")

__all__ = [
    "calculateInverseKinematics2",
    "createSoftBodyAnchor",
    "getMeshData",
    "getTetraMeshData",
    "loadSoftBody",
    "renderImage",
    "resetMeshData",
    "unsupportedChangeScaling",
    "vhacd",
]
