"""Exceptions of calls, one for each reason. All are a `SimdError`."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from simd_client.retry import Sent

ERROR_DOMAIN = "simd"
"""The `domain` of every `google.rpc.ErrorInfo` of simd."""


class SimdError(Exception):
    """A call failed. `str()` of it is one sentence: the daemon's, if it answered."""

    code: str = "UNKNOWN"
    """The canonical gRPC code, for instance `NOT_FOUND`."""
    reason: str = ""
    """A constant for programs, for instance `ROBOT_NOT_FOUND`; empty unless the daemon refused the call."""
    metadata: Mapping[str, str] = MappingProxyType({})
    """Context of the reason, by the keys that the schema gives: `robot`, `joint`, ..."""
    fields: Mapping[str, str] = MappingProxyType({})
    """Fields of the request that are at fault, each with its description."""
    sent: Sent | None = None
    """The request, if it may have changed something without an answer: for `Simulation.ask_again`."""


class Unavailable(SimdError):
    """No daemon answers, or the connection broke."""

    code = "UNAVAILABLE"


class DeadlineExceeded(SimdError, TimeoutError):
    """The daemon did not answer in time. The call may or may not have taken effect: `Simulation.ask_again`."""

    code = "DEADLINE_EXCEEDED"


class EndpointError(SimdError, ValueError):
    """The text is not the address of a daemon, or there are several daemons at the address."""

    code = "INVALID_ARGUMENT"


class NoUrdf(SimdError):
    """No URDF exists at a path on this disk."""

    code = "NOT_FOUND"


class XacroError(NoUrdf):
    """A xacro file cannot be expanded, or the package `xacro` is not installed."""

    code = "INVALID_ARGUMENT"


class AnswerError(SimdError):
    """The daemon's answer violates its schema."""

    code = "INTERNAL"


class NoReading(SimdError):
    """A sensor has no reading yet, or it is a camera."""

    code = "FAILED_PRECONDITION"


class Refused(SimdError):
    """The daemon refused the call. The class itself is used for a reason that this client does not know."""


class NotFound(Refused, KeyError):
    """Something that the call refers to does not exist, in the daemon or in what was fetched from it."""

    code = "NOT_FOUND"
    # The sentence: a `KeyError` would show it in quotes.
    __str__ = Exception.__str__


class RobotNotFound(NotFound):
    """No robot of that name. Metadata: `robot`."""


class JointNotFound(NotFound):
    """The robot has no such joint. Metadata: `robot`, `joint`."""


class LinkNotFound(NotFound):
    """The robot has no such link. Metadata: `robot`, `link`."""


class RobotExists(Refused):
    """A robot of that name exists. Metadata: `robot`."""


class InvalidValue(Refused, ValueError):
    """A number is NaN, infinite or out of its range, or a required field is missing."""


class JointNotActuated(Refused):
    """The joint does not support the request, for instance a target for a fixed joint."""


class TargetBeyondLimit(Refused):
    """A target is beyond a limit, and the call asked to refuse it. Metadata: `joint`, `lower`, `upper`."""


class InvalidDescription(Refused):
    """The robot description cannot be understood. The message names the element and the line."""


class DescriptionNotUploaded(Refused):
    """The description was never uploaded, or is no longer kept."""


class AssetNotUploaded(Refused):
    """An asset was named by a hash that the daemon lacks. Metadata: `sha256`, `uri`."""


class UploadMismatch(Refused):
    """The bytes of an upload do not have the announced hash: the file has changed."""


class MailboxFull(Refused):
    """The daemon is overloaded; try again."""


class LimitExceeded(Refused):
    """One of the daemon's limits is exceeded; the message names it."""


class WrongState(Refused):
    """The simulation is in another state, for instance playing although the call needs it paused."""


class VersionMismatch(Refused):
    """Client and daemon speak different versions. Metadata: `client`, `daemon`."""


class JointClaimed(Refused):
    """Another client holds a claim on the joint. Metadata: `joint`, `holder`."""


class RobotClaimed(Refused):
    """Another client holds a claim on the robot. Metadata: `robot`, `holder`."""


class WorldClaimed(Refused):
    """Another client holds a claim on the world. Metadata: `holder`."""


class WorldNotClaimed(Refused):
    """Changes that affect everybody need a claim on the world while another client holds a claim. Metadata:
    `holder`."""


class ClaimNotFound(NotFound):
    """The claim does not exist: it was released, it expired, or another client took over."""


class LockstepMemberNotFound(NotFound):
    """The lockstep member does not exist: it left, or did not ask for its next step in time."""


class RobotNotAllowed(Refused):
    """The token is for other robots. Metadata: `robot`, empty for the whole world."""


class InLockstep(Refused):
    """Clients step the world together: only they step it, and it does not play. Metadata: `members`."""


class SavedStateNotFound(NotFound):
    """No saved state of that name. Metadata: `saved_state`."""


class ConstraintNotFound(NotFound):
    """No constraint of that name. Metadata: `constraint`."""


class ConstraintExists(Refused):
    """A constraint of that name is in the world. Metadata: `constraint`."""


class SensorNotFound(NotFound):
    """The robot has no such sensor. Metadata: `robot`, `sensor`."""


class SensorExists(Refused):
    """The robot has a sensor of that name. Metadata: `robot`, `sensor`."""


class NoRenderer(Refused):
    """A picture was requested, and no renderer draws this world: start `simd-camera`."""


class PictureTimeout(Refused):
    """No renderer drew the picture within the requested time."""


class PictureFailed(Refused):
    """Renderers could not draw the picture; the message has the reason."""


class InvalidSavedState(Refused):
    """A file is not a saved state, is damaged, has a newer format, or this daemon reads its robots differently."""


class RecordingNotPossible(Refused):
    """No recording can be made or deleted now. The folder is missing or unusable, another recording is in
    progress, or none is."""


class RecordingNotFound(NotFound):
    """No recording of that name. Metadata: `recording`."""


class RecordingExists(Refused):
    """A recording of that name exists. Metadata: `recording`."""


class OwnedByAnother(Refused):
    """Another client made the saved state or the parameter, and its claim or its token holds. Metadata: `owner`."""


class PathNotAllowed(Refused):
    """A path on the daemon's disk that is not below one of its asset roots."""


class FileNotFound(NotFound):
    """No file at a path on the daemon's disk."""


class ShuttingDown(Refused, Unavailable):
    """The daemon is shutting down."""


class Superseded(Refused):
    """A reset, a pause or a play ended the call before it was done."""


class LayoutChanged(Refused):
    """The robot was reloaded or respawned: arrays of its joints have another layout now."""


class NotSupported(Refused):
    """This daemon does not support the method or option."""


class Internal(Refused):
    """An internal error of the daemon."""


class ParameterNotFound(NotFound):
    """No parameter of that name. Metadata: `parameter`."""


class ParameterExists(Refused):
    """A parameter of that name exists. Metadata: `parameter`."""


class RequestIdReused(Refused):
    """The request's id belongs to another request. Metadata: `request_id`."""


class Unauthenticated(Refused):
    """The daemon requires a token (`SIMD_TOKEN`). It is missing, unknown, revoked or expired."""


class RoleTooLow(Refused):
    """The token has a lower role than the call needs."""


Missing = TypeVar("Missing", bound=NotFound)
Refusal = TypeVar("Refusal", bound=Refused)


def not_found(kind: type[Missing], message: str, **metadata: str) -> Missing:
    """Returns the error for a name that was not fetched: equal to the daemon's error."""
    error = kind(message)
    error.reason, error.metadata = _reason_of(kind), metadata
    return error


def refused_here(kind: type[Refusal], code: str, message: str) -> Refusal:
    """Returns the error for a local refusal: equal to the daemon's error."""
    error = kind(message)
    error.code, error.reason = code, _reason_of(kind)
    return error


def listed(names: Iterable[str], wanted: str | None = None) -> str:
    """Formats names for a sentence: `a`, `b`; with a `wanted` name it adds the most similar one."""
    names = list(names)
    there = ", ".join(f"`{name}`" for name in names) or "none"
    meant = difflib.get_close_matches(wanted, names, 1, 0.6) if wanted else []
    return f"{there}; did you mean `{meant[0]}`?" if meant else there


_AS_TYPED = [
    (re.compile(r"\brobots\[\d+\]\.joints\[\d+\]\.(?:(?:position|velocity|effort)\.)?(?=\w)"), ""),
    (re.compile(r"\brobots\[\d+\]\.whole\.(?=values\[)"), ""),
    (re.compile(r"^joints\[\d+\]\.(?=\S+ \(joint )"), ""),
    (re.compile(r"^pose\.(?=(?:position|orientation)\b)"), ""),
]


def as_typed(message: str) -> str:
    """Returns the daemon's sentence with argument names in place of the schema's field names."""
    for path, name in _AS_TYPED:
        message = path.sub(name, message)
    return message


def _reason_of(refused: type[Refused]) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", refused.__name__).upper()


def _reasons() -> dict[str, type[Refused]]:
    found: dict[str, type[Refused]] = {}
    pending = [Refused]
    while pending:
        for below in pending.pop().__subclasses__():
            pending.append(below)
            if below is not NotFound:
                found[_reason_of(below)] = below
    return found


REASONS: Mapping[str, type[Refused]] = MappingProxyType(_reasons())
"""Exception of each reason, by its name on the wire: `ROBOT_NOT_FOUND` is `RobotNotFound`."""

_CODES = (
    "OK CANCELLED UNKNOWN INVALID_ARGUMENT DEADLINE_EXCEEDED NOT_FOUND ALREADY_EXISTS PERMISSION_DENIED "
    "RESOURCE_EXHAUSTED FAILED_PRECONDITION ABORTED OUT_OF_RANGE UNIMPLEMENTED INTERNAL UNAVAILABLE "
    "DATA_LOSS UNAUTHENTICATED"
).split()


def refusal(
    code: int,
    message: str,
    reason: str,
    metadata: Mapping[str, str],
    fields: Mapping[str, str] | None = None,
) -> Refused:
    """Returns the exception for a refusal of the daemon.

    `code` is the number of the canonical gRPC code; `reason` has no prefix.
    """
    name = _CODES[code] if 0 <= code < len(_CODES) else "UNKNOWN"
    error = REASONS.get(reason, Refused)(as_typed(message) or f"the daemon refused the call: {name}")
    error.code = name
    error.reason = reason
    error.metadata = dict(metadata)
    error.fields = dict(fields or {})
    return error
