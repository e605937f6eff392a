"""The world as a whole: time, state, settings of the step, statistics."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone
from enum import Enum

from simd_client import proto
from simd_client.geometry import FloatArray, vector_from_proto


@dataclass(frozen=True)
class Stamp:
    """Stamp of a state. Within one epoch `step` and `sim_time` never decrease."""

    epoch: int
    """Counts resets of time and restored saved states."""
    step: int
    """Steps since the epoch began."""
    sim_time: float
    """Simulated seconds since the epoch began."""
    sequence: int
    """Counts published states: a newer state has a larger one, also in a paused world."""
    wall_time: datetime | None
    """When the daemon published the state, by its own clock, UTC; `None` if it was not published."""


class SimulationState(Enum):
    """Whether the world plays."""

    STOPPED = "stopped"
    PLAYING = "playing"
    PAUSED = "paused"
    UNKNOWN = "unknown"


class Pace(Enum):
    """Pacing of steps against the wall clock while playing."""

    REAL_TIME = "real_time"
    AS_FAST_AS_POSSIBLE = "as_fast_as_possible"
    UNKNOWN = "unknown"


class Integrator(Enum):
    """Integration method of a step."""

    LEAPFROG = "leapfrog"
    """Second order while motion is smooth; free bodies keep their energy at any spin."""
    EULER = "euler"
    """Semi-implicit Euler with implicit damping, which equals MuJoCo's."""
    BULLET = "bullet"
    """Euler with Bullet's laws of contacts, position limits, speeds and link damping."""
    UNKNOWN = "unknown"


class SurfaceCombination(Enum):
    """Rule that combines the coefficients of two touching surfaces."""

    MIN = "min"
    """Minimum friction, as in Gazebo; maximum restitution, rolling friction and spinning friction."""
    MULTIPLY = "multiply"
    """Products of frictions and of restitutions, as in Bullet."""
    MAX = "max"
    """Maximum of each, as in MuJoCo."""
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Physics:
    """Settings of the step."""

    gravity: FloatArray
    """Metres per second squared, world axes."""
    time_step: float
    """Seconds that one step advances."""
    substeps: int
    """Number of equal parts of a step."""
    real_time_factor: float
    """Simulated seconds per wall second."""
    pace: Pace
    """Pacing of steps against the wall clock while playing."""
    integrator: Integrator
    """Integration method of a step."""
    surface_combination: SurfaceCombination
    """Combination of touching surfaces."""
    sleeping: bool
    """Whether free bodies at rest sleep: steps skip them until something acts on them."""


@dataclass(frozen=True)
class WorldStatistics:
    """Real-time statistics of the world."""

    stamp: Stamp
    state: SimulationState
    target_real_time_factor: float
    """Requested factor; infinity for as fast as possible."""
    real_time_factor: float
    """Factor reached over about the last second of playing; 0 when not playing."""
    overruns: int
    """Number of times that the world dropped its lag."""
    dropped_lag: float
    """Total wall seconds of dropped lag."""
    iterations: int
    """Steps done since the daemon started."""
    robots: int
    joints: int
    """Number of movable joints of all robots."""
    step_duration: float
    """Wall seconds of computation per step, mean over about the last second."""
    mailbox_refusals: int
    """Requests refused because the daemon was overloaded."""


@dataclass(frozen=True)
class SimulatorInfo:
    """The daemon's versions, limits and features."""

    simulator: str
    version: str
    """The daemon's release."""
    api_version: tuple[int, int]
    """The version of its schema."""
    name: str
    """Name that the operator gave it."""
    features: tuple[str, ...]
    limits: proto.RequestLimits
    """Limits; requests beyond one of them are refused with `LimitExceeded`."""


@dataclass(frozen=True)
class SavedState:
    """A saved state of the world, in the daemon's memory."""

    name: str
    stamp: Stamp
    """Stamp of the saved state."""
    robots: int
    owner: str = ""
    """Creator, for people: the name of a token, or of the client and its origin."""


_STATES = {
    proto.SimulationState.SIMULATION_STATE_STOPPED: SimulationState.STOPPED,
    proto.SimulationState.SIMULATION_STATE_PLAYING: SimulationState.PLAYING,
    proto.SimulationState.SIMULATION_STATE_PAUSED: SimulationState.PAUSED,
}
_PACES = {
    proto.PaceMode.PACE_MODE_REAL_TIME: Pace.REAL_TIME,
    proto.PaceMode.PACE_MODE_AS_FAST_AS_POSSIBLE: Pace.AS_FAST_AS_POSSIBLE,
}
_INTEGRATORS = {
    proto.Integrator.INTEGRATOR_LEAPFROG: Integrator.LEAPFROG,
    proto.Integrator.INTEGRATOR_EULER: Integrator.EULER,
    proto.Integrator.INTEGRATOR_BULLET: Integrator.BULLET,
}
_SURFACE_COMBINATIONS = {
    proto.SurfaceCombination.SURFACE_COMBINATION_MIN: SurfaceCombination.MIN,
    proto.SurfaceCombination.SURFACE_COMBINATION_MULTIPLY: SurfaceCombination.MULTIPLY,
    proto.SurfaceCombination.SURFACE_COMBINATION_MAX: SurfaceCombination.MAX,
}


def stamp_from_proto(message: proto.Stamp) -> Stamp:
    """Converts a stamp from its message."""
    wall = message.wall_time
    return Stamp(
        epoch=message.epoch,
        step=message.step,
        sim_time=message.sim_time,
        sequence=message.sequence,
        wall_time=datetime.fromtimestamp(wall.seconds + wall.nanos * 1e-9, timezone.utc)
        if message.HasField("wall_time")
        else None,
    )


def state_from_proto(value: int) -> SimulationState:
    """Converts from its number; `UNKNOWN` for a value that only a newer daemon knows."""
    return next((state for number, state in _STATES.items() if number == value), SimulationState.UNKNOWN)


def state_to_proto(state: SimulationState | str) -> proto.SimulationState:
    """Converts from the enum or its value. Raises `ValueError` for another text."""
    wanted = SimulationState(state)
    for number, known in _STATES.items():
        if known is wanted:
            return number
    raise ValueError("a world is stopped, playing or paused")


def pace_to_proto(pace: Pace | str) -> proto.PaceMode:
    """Converts from the enum or its value. Raises `ValueError` for another text."""
    wanted = Pace(pace)
    for number, known in _PACES.items():
        if known is wanted:
            return number
    raise ValueError("a pace is real_time or as_fast_as_possible")


def integrator_to_proto(integrator: Integrator | str) -> proto.Integrator:
    """Converts from the enum or its value. Raises `ValueError` for another text."""
    wanted = Integrator(integrator)
    for number, known in _INTEGRATORS.items():
        if known is wanted:
            return number
    raise ValueError("an integrator is leapfrog, euler or bullet")


def surface_combination_to_proto(combination: SurfaceCombination | str) -> proto.SurfaceCombination:
    """Converts from the enum or its value. Raises `ValueError` for another text."""
    wanted = SurfaceCombination(combination)
    for number, known in _SURFACE_COMBINATIONS.items():
        if known is wanted:
            return number
    raise ValueError("a combination of surfaces is min, multiply or max")


def physics_from_proto(message: proto.Physics) -> Physics:
    """Converts settings from their message."""
    return Physics(
        gravity=vector_from_proto(message.gravity),
        time_step=message.time_step,
        substeps=message.substeps,
        real_time_factor=message.real_time_factor,
        pace=next((pace for number, pace in _PACES.items() if number == message.pace), Pace.UNKNOWN),
        integrator=next(
            (known for number, known in _INTEGRATORS.items() if number == message.integrator), Integrator.UNKNOWN
        ),
        surface_combination=next(
            (known for number, known in _SURFACE_COMBINATIONS.items() if number == message.surface_combination),
            SurfaceCombination.UNKNOWN,
        ),
        sleeping=message.sleeping,
    )


def statistics_from_proto(message: proto.WorldStatistics) -> WorldStatistics:
    """Converts statistics from their message."""
    return WorldStatistics(
        stamp=stamp_from_proto(message.stamp),
        state=state_from_proto(message.state),
        target_real_time_factor=message.target_real_time_factor,
        real_time_factor=message.real_time_factor,
        overruns=message.overruns,
        dropped_lag=message.dropped_lag,
        iterations=message.iterations,
        robots=message.robots,
        joints=message.joints,
        step_duration=message.step_duration,
        mailbox_refusals=message.mailbox_refusals,
    )


def info_from_proto(message: proto.GetSimulatorInfoResponse) -> SimulatorInfo:
    """Converts versions, limits and features from their message."""
    return SimulatorInfo(
        simulator=message.simulator,
        version=message.version,
        api_version=(message.api_major, message.api_minor),
        name=message.name,
        features=tuple(message.features),
        limits=message.limits,
    )


def saved_state_from_proto(message: proto.SavedStateInfo) -> SavedState:
    """Converts a saved state from its message."""
    return SavedState(message.name, stamp_from_proto(message.stamp), message.robots, message.owner)
