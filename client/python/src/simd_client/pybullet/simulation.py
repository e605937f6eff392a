"""World of a script: steps, settings, saved states."""

from __future__ import annotations

from simd_client.proto import (
    DeleteSavedStateRequest,
    SaveStateRequest,
    SetPhysicsRequest,
    methods,
)

from . import restoring
from .connections import connected
from .errors import error
from .files import read_state

# Parameters of contacts, and the daemon's names.
_CONTACTS = {
    "contactERP": "error_reduction",
    "contactSlop": "slop",
    "restitutionVelocityThreshold": "bounce_speed",
}
# Parameters of setPhysicsEngineParameter that have an effect, or that belong to no solver and cause no
# warning.
_NOT_THE_SOLVERS = {
    "fixedTimeStep",
    "numSubSteps",
    "contactERP",
    "contactSlop",
    "restitutionVelocityThreshold",
    "maxNumCmdPer1ms",
    "enableFileCaching",
    "deterministicOverlappingPairs",
    "reportSolverAnalytics",
    "physicsClientId",
}


def stepSimulation(physicsClientId: int = 0) -> tuple[()]:
    """Makes one time step; in a playing world, waits for its next state. PyBullet's solver statistics, which
    it returns only on request, are not available."""
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
    """Sets the time step, seconds; a longer one than the daemon's 0.1 s is several of its steps, and one of 0 changes nothing."""
    _set_time_step(physicsClientId, timeStep)


def _set_time_step(client: int, seconds: float) -> None:
    world = connected(client)
    world.set_time_step(float(seconds))
    world.retune()


def setRealTimeSimulation(enableRealTimeSimulation: int, physicsClientId: int = 0) -> None:
    """Sets whether the world plays in real time."""
    connected(physicsClientId).play(bool(enableRealTimeSimulation))


def setPhysicsEngineParameter(
    fixedTimeStep: float = -1.0,
    numSolverIterations: int = -1,
    useSplitImpulse: int = -1,
    splitImpulsePenetrationThreshold: float = -1.0,
    numSubSteps: int = -1,
    collisionFilterMode: int = -1,
    contactBreakingThreshold: float = -1.0,
    maxNumCmdPer1ms: int = -2,
    enableFileCaching: int = -1,
    restitutionVelocityThreshold: float = -1.0,
    erp: float = -1.0,
    contactERP: float = -1.0,
    frictionERP: float = -1.0,
    enableConeFriction: int = -1,
    deterministicOverlappingPairs: int = -1,
    allowedCcdPenetration: float = -1.0,
    jointFeedbackMode: int = -1,
    solverResidualThreshold: float = -1.0,
    contactSlop: float = -1.0,
    enableSAT: int = -1,
    constraintSolverType: int = -1,
    globalCFM: float = -1.0,
    minimumSolverIslandSize: int = -1,
    reportSolverAnalytics: int = -1,
    warmStartingFactor: float = -1.0,
    sparseSdfVoxelSize: float = -1.0,
    numNonContactInnerIterations: int = -1,
    physicsClientId: int = 0,
) -> None:
    """Sets the time step, 1e-6 to 0.1 s, its substeps, and ERP, slop and restitution threshold of contacts. The
    other settings belong to Bullet's solver and have no effect; getPhysicsEngineParameters returns its
    iterations. As in PyBullet, negative values are ignored."""
    arguments = dict(locals())
    given = [name for name, value in arguments.items() if value >= 0]
    world = connected(physicsClientId)
    if "fixedTimeStep" in given:
        _set_time_step(physicsClientId, fixedTimeStep)
    if "numSubSteps" in given:
        world.substeps = int(numSubSteps)
        world.set_physics(SetPhysicsRequest(substeps=max(int(numSubSteps), 1)))
        world.retune()
    if "numSolverIterations" in given:
        world.solver_iterations = int(numSolverIterations)
    if numNonContactInnerIterations >= 1:
        world.inner_iterations = int(numNonContactInnerIterations)
    contacts = {field: float(arguments[name]) for name, field in _CONTACTS.items() if name in given}
    if contacts and not world.set_contacts(**contacts):
        world.say_once("setPhysicsEngineParameter: the world of another client has its own contacts")
    ignored = [name for name in given if name not in _NOT_THE_SOLVERS]
    if ignored:
        world.say_once(
            f"setPhysicsEngineParameter: {', '.join(ignored)} belong to Bullet's solver and do nothing"
        )


def getPhysicsEngineParameters(physicsClientId: int = 0) -> dict[str, float]:
    """Returns time step (s), substeps, gravity (world axes, m/s^2), whether the world plays, and the script's
    iterations of Bullet's solver."""
    world = connected(physicsClientId)
    world.read_state()
    x, y, z = world.gravity
    return {
        "fixedTimeStep": world.time_step,
        "numSubSteps": world.substeps,
        "numSolverIterations": world.solver_iterations,
        "useRealTimeSimulation": int(world.playing),
        "gravityAccelerationX": x,
        "gravityAccelerationY": y,
        "gravityAccelerationZ": z,
        "numNonContactInnerIterations": world.inner_iterations,
    }


def saveState(physicsClientId: int = 0) -> int:
    """Saves the whole state of the world in the daemon's memory. Returns its number."""
    world = connected(physicsClientId)
    world.flush()
    number = world.saved_state_number()
    name = world.saved_state_name(number)
    world.wire.call(methods.SaveState, SaveStateRequest(name=name))
    world.saved[name] = restoring.remember(world)
    return number


def restoreState(stateId: int = -1, fileName: str = "", physicsClientId: int = 0) -> None:
    """Restores a saved state, with that number or from a file of saveBullet: poses, positions, velocities and
    contacts. Motors, settings, masses, surfaces and constraints of the script stay."""
    world = connected(physicsClientId)
    if stateId < 0 and not fileName:
        raise error("Couldn't restore state.")
    name = world.saved_state_name(stateId) if stateId >= 0 else read_state(world, fileName)
    try:
        restoring.restore(world, name)
    except error as refusal:
        raise error(f"Couldn't restore state. {refusal}", refusal.reason) from None
    finally:
        if stateId < 0:
            world.wire.call(methods.DeleteSavedState, DeleteSavedStateRequest(name=name))


def removeState(stateUniqueId: int, physicsClientId: int = 0) -> None:
    """Deletes a saved state."""
    world = connected(physicsClientId)
    name = world.saved_state_name(stateUniqueId)
    world.saved.pop(name, None)
    try:
        world.wire.call(methods.DeleteSavedState, DeleteSavedStateRequest(name=name))
    except error as refusal:
        # PyBullet ignores an unknown state.
        if refusal.reason != "SAVED_STATE_NOT_FOUND":
            raise


def setTimeOut(timeOutInSeconds: float, physicsClientId: int = 0) -> None:
    """Sets the time, in seconds, that calls wait for the daemon."""
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
    """Returns the value of a slider, or a button's number of presses, from the published copy."""
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
