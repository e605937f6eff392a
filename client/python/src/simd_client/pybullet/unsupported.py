"""PyBullet's functions that are not supported (yet): each raises, with its name and the reason."""

from __future__ import annotations

from typing import Any, NoReturn

from .errors import unsupported

_CONTACTS = "the daemon reports contact points only"
_BOXES = "the daemon does not tell bounding boxes"
_DRAWN = "shapes are only drawn by viewers"
_IMAGES = "a daemon draws no images"
_SOFT = "simd has rigid bodies only"
_FILES = "only URDF files are read"
_PLUGINS = "a daemon takes no plugins"
_DATA = "the daemon keeps no data of scripts"
_SHAPES = "shapes of a robot are not changed once it is there"


def _raises(function: str, why: str) -> Any:
    def refuse(*_arguments: Any, **_named: Any) -> NoReturn:
        raise unsupported(function, why)

    refuse.__name__ = refuse.__qualname__ = function
    refuse.__doc__ = f"Raises NotImplementedError: {why}."
    return refuse


addUserData = _raises("addUserData", _DATA)
calculateInverseKinematics2 = _raises(
    "calculateInverseKinematics2", "the daemon solves for one link at a time"
)
createSoftBodyAnchor = _raises("createSoftBodyAnchor", _SOFT)
executePluginCommand = _raises("executePluginCommand", _PLUGINS)
getAABB = _raises("getAABB", _BOXES)
getCameraImage = _raises("getCameraImage", _IMAGES)
getClosestPoints = _raises("getClosestPoints", _CONTACTS)
getCollisionShapeData = _raises("getCollisionShapeData", _DRAWN)
getMeshData = _raises("getMeshData", _SOFT)
getOverlappingObjects = _raises("getOverlappingObjects", _BOXES)
getTetraMeshData = _raises("getTetraMeshData", _SOFT)
getUserData = _raises("getUserData", _DATA)
getUserDataId = _raises("getUserDataId", _DATA)
getUserDataInfo = _raises("getUserDataInfo", _DATA)
getNumUserData = _raises("getNumUserData", _DATA)
getVisualShapeData = _raises("getVisualShapeData", _DRAWN)
loadBullet = _raises("loadBullet", _FILES)
loadMJCF = _raises("loadMJCF", _FILES)
loadPlugin = _raises("loadPlugin", _PLUGINS)
loadSDF = _raises("loadSDF", _FILES)
loadSoftBody = _raises("loadSoftBody", _SOFT)
removeUserData = _raises("removeUserData", _DATA)
renderImage = _raises("renderImage", _IMAGES)
resetMeshData = _raises("resetMeshData", _SOFT)
saveBullet = _raises("saveBullet", "states are kept by the daemon: use saveState")
saveWorld = _raises("saveWorld", "states are kept by the daemon: use saveState")
setCollisionFilterGroupMask = _raises("setCollisionFilterGroupMask", _CONTACTS)
setCollisionFilterPair = _raises("setCollisionFilterPair", _CONTACTS)
setInternalSimFlags = _raises("setInternalSimFlags", "it is for Bullet's own experiments")
syncUserData = _raises("syncUserData", _DATA)
unloadPlugin = _raises("unloadPlugin", _PLUGINS)
unsupportedChangeScaling = _raises("unsupportedChangeScaling", _SHAPES)
vhacd = _raises("vhacd", "the daemon makes convex hulls of meshes by itself")

__all__ = [
    "addUserData",
    "calculateInverseKinematics2",
    "createSoftBodyAnchor",
    "executePluginCommand",
    "getAABB",
    "getCameraImage",
    "getClosestPoints",
    "getCollisionShapeData",
    "getMeshData",
    "getNumUserData",
    "getOverlappingObjects",
    "getTetraMeshData",
    "getUserData",
    "getUserDataId",
    "getUserDataInfo",
    "getVisualShapeData",
    "loadBullet",
    "loadMJCF",
    "loadPlugin",
    "loadSDF",
    "loadSoftBody",
    "removeUserData",
    "renderImage",
    "resetMeshData",
    "saveBullet",
    "saveWorld",
    "setCollisionFilterGroupMask",
    "setCollisionFilterPair",
    "setInternalSimFlags",
    "syncUserData",
    "unloadPlugin",
    "unsupportedChangeScaling",
    "vhacd",
]
