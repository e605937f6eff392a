"""The world of a script: steps, settings, saved states."""

from __future__ import annotations

from typing import Any

from simd_client.proto import (
    DeleteSavedStateRequest,
    RestoreStateRequest,
    SaveStateRequest,
    SetPhysicsRequest,
    methods,
)

from .connections import connected
from .errors import error
from .files import read_state

# Parameters of setPhysicsEngineParameter without effect in simd.
_SOLVER = (
    "numSolverIterations",
    "useSplitImpulse",
    "splitImpulsePenetrationThreshold",
    "collisionFilterMode",
    "contactBreakingThreshold",
    "restitutionVelocityThreshold",
    "erp",
    "contactERP",
    "frictionERP",
    "enableConeFriction",
    "allowedCcdPenetration",
    "jointFeedbackMode",
    "solverResidualThreshold",
    "contactSlop",
    "enableSAT",
    "constraintSolverType",
    "globalCFM",
    "minimumSolverIslandSize",
    "warmStartingFactor",
    "sparseSdfVoxelSize",
    "numNonContactInnerIterations",
)


def stepSimulation(physicsClientId: int = 0) -> tuple[()]:
    """One time step; on a world that plays, the wait for its next state. PyBullet's solver
    statistics, which it returns only on request, are not available."""
    connected(physicsClientId).step()
    return ()


def resetSimulation(flags: int = 0, physicsClientId: int = 0) -> None:
    """Resets to an empty world without gravity; if other clients have robots, only the script's own are removed."""
    del flags
    connected(physicsClientId).reset()


def setGravity(gravX: float, gravY: float, gravZ: float, physicsClientId: int = 0) -> None:
    """Sets gravity, world axes, m/s^2, for the whole world: also for robots of other clients."""
    world, gravity = connected(physicsClientId), (float(gravX), float(gravY), float(gravZ))
    if not world.has_gravity(gravity):
        request = SetPhysicsRequest()
        request.gravity.x, request.gravity.y, request.gravity.z = gravity
        world.set_physics(request)


def setTimeStep(timeStep: float, physicsClientId: int = 0) -> None:
    """Sets the time step, 1e-6 to 0.1 s."""
    _set_time_step(physicsClientId, timeStep)


def _set_time_step(client: int, seconds: float) -> None:
    world = connected(client)
    world.set_physics(SetPhysicsRequest(time_step=float(seconds)))
    world.retune()


def setRealTimeSimulation(enableRealTimeSimulation: int, physicsClientId: int = 0) -> None:
    """Sets whether the world plays in real time."""
    connected(physicsClientId).play(bool(enableRealTimeSimulation))


def setPhysicsEngineParameter(
    fixedTimeStep: float | None = None,
    numSubSteps: int | None = None,
    physicsClientId: int = 0,
    **others: Any,
) -> None:
    """Sets time step and substeps. The other settings are those of Bullet's solver, kept for
    getPhysicsEngineParameters only."""
    world = connected(physicsClientId)
    unknown = [name for name in others if name not in _SOLVER and name not in _SILENT]
    if unknown:
        raise TypeError(f"setPhysicsEngineParameter() got an unexpected keyword argument '{unknown[0]}'")
    if fixedTimeStep is not None:
        _set_time_step(physicsClientId, fixedTimeStep)
    if numSubSteps is not None:
        world.substeps = int(numSubSteps)
        world.set_physics(SetPhysicsRequest(substeps=max(int(numSubSteps), 1)))
        world.retune()
    ignored = [name for name in others if name in _SOLVER]
    if ignored:
        world.say_once(
            f"setPhysicsEngineParameter: {', '.join(ignored)} belong to Bullet's solver and do nothing"
        )


_SILENT = ("maxNumCmdPer1ms", "enableFileCaching", "deterministicOverlappingPairs", "reportSolverAnalytics")


def getPhysicsEngineParameters(physicsClientId: int = 0) -> dict[str, float]:
    """Time step, substeps, gravity, whether the world plays."""
    world = connected(physicsClientId)
    world.read_state()
    x, y, z = world.gravity
    return {
        "fixedTimeStep": world.time_step,
        "numSubSteps": world.substeps,
        "numSolverIterations": 50,
        "useRealTimeSimulation": int(world.playing),
        "gravityAccelerationX": x,
        "gravityAccelerationY": y,
        "gravityAccelerationZ": z,
        "numNonContactInnerIterations": 1,
    }


def saveState(physicsClientId: int = 0) -> int:
    """Saves the whole state of the world in the daemon's memory. Returns its number."""
    world = connected(physicsClientId)
    world.flush()
    number = world.saved_state_number()
    world.wire.call(methods.SaveState, SaveStateRequest(name=world.saved_state_name(number)))
    return number


def restoreState(stateId: int = -1, fileName: str = "", physicsClientId: int = 0) -> None:
    """Restores a saved state: of that number, or of a file of saveBullet's."""
    world = connected(physicsClientId)
    if stateId < 0 and not fileName:
        raise error("Couldn't restore state.")
    name = world.saved_state_name(stateId) if stateId >= 0 else read_state(world, fileName)
    try:
        world.wire.call(methods.RestoreState, RestoreStateRequest(name=name))
    except error as refusal:
        raise error(f"Couldn't restore state. {refusal}", refusal.reason) from None
    finally:
        if stateId < 0:
            world.wire.call(methods.DeleteSavedState, DeleteSavedStateRequest(name=name))
    world.restored()


def removeState(stateUniqueId: int, physicsClientId: int = 0) -> None:
    """Deletes a saved state."""
    world = connected(physicsClientId)
    try:
        world.wire.call(
            methods.DeleteSavedState, DeleteSavedStateRequest(name=world.saved_state_name(stateUniqueId))
        )
    except error as refusal:
        # PyBullet ignores a state that does not exist.
        if refusal.reason != "SAVED_STATE_NOT_FOUND":
            raise


def setTimeOut(timeOutInSeconds: float, physicsClientId: int = 0) -> None:
    """Sets how long calls wait for the daemon, seconds."""
    connected(physicsClientId).wire.set_timeout(float(timeOutInSeconds))


def addUserDebugParameter(
    paramName: str,
    rangeMin: float = 0.0,
    rangeMax: float = 1.0,
    startValue: float = 0.0,
    physicsClientId: int = 0,
) -> int:
    """Adds a slider, which every client can move, or a button if rangeMin is above rangeMax."""
    return connected(physicsClientId).sliders.add(
        str(paramName), float(rangeMin), float(rangeMax), float(startValue)
    )


def readUserDebugParameter(itemUniqueId: int, physicsClientId: int = 0) -> float:
    """The value of a slider, or how often a button was pressed, from the published copy."""
    return connected(physicsClientId).sliders.read(itemUniqueId)


def removeAllUserParameters(physicsClientId: int = 0) -> None:
    """Removes the script's sliders and buttons."""
    connected(physicsClientId).sliders.remove_own()


__all__ = [
    "addUserDebugParameter",
    "getPhysicsEngineParameters",
    "readUserDebugParameter",
    "removeAllUserParameters",
    "removeState",
    "resetSimulation",
    "restoreState",
    "saveState",
    "setGravity",
    "setPhysicsEngineParameter",
    "setRealTimeSimulation",
    "setTimeOut",
    "setTimeStep",
    "stepSimulation",
]
