"""Properties of a robot, and the report on its description."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from simd_client import proto
from simd_client.geometry import FloatArray, vector_from_proto
from simd_client.table import Table
from simd_client.world import Stamp


@dataclass(frozen=True, eq=False)
class LinkInfo:
    """A link of a robot."""

    name: str
    parent: str
    """Name of the parent link; empty for the root."""
    mass: float
    """Kilograms."""
    center_of_mass: FloatArray
    """Centre of mass in the link's frame, metres."""
    inertia: FloatArray
    """Inertia about the centre of mass, in the link's axes, kg m^2: 3 by 3."""


@dataclass(frozen=True, eq=False)
class RobotInfo:
    """A robot in the world."""

    name: str
    """Name in this world."""
    model: str
    """`name` of its `<robot>`."""
    layout_version: int
    """Changes with each reload or respawn under the same name."""
    is_fixed: bool
    """Whether its root link cannot move."""
    mass: float
    """Mass of all links, kilograms."""
    links: tuple[LinkInfo, ...]
    """In depth-first order; the first is the root."""
    joint_count: int
    """Joints of the URDF, fixed ones included."""
    moving_joint_count: int
    description: str
    """Hash of the description."""
    loaded_at_start: bool
    """Whether the daemon loaded it at its start; a reset of scope `spawned` leaves it."""
    disabled_reason: str
    """Set while the robot is disabled because its state was not finite."""


class Severity(Enum):
    """Severity of a finding."""

    INFO = "info"
    """Needs no action."""
    WARNING = "warning"
    """The robot loads, but perhaps not as its author intended."""
    ERROR = "error"
    """The robot is refused."""
    UNKNOWN = "unknown"


class Disposition(Enum):
    """Treatment of an element."""

    USED = "used"
    DEFAULTED = "defaulted"
    REPAIRED = "repaired"
    IGNORED = "ignored"
    REFUSED = "refused"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Finding:
    """An observation about a description."""

    severity: Severity
    disposition: Disposition
    element: str
    """Location, for instance `joint "elbow" limit`."""
    line: int
    """Line in the URDF, from 1; 0 if it does not apply."""
    message: str
    """A sentence: the text read, its treatment, the reason."""
    file: str = ""
    """URI of the mesh file concerned; empty for the description itself."""


@dataclass(frozen=True)
class LoadReport:
    """Report on a description that was read."""

    summary: str = ""
    findings: tuple[Finding, ...] = ()

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Returns the findings that need attention: warnings and errors."""
        return tuple(f for f in self.findings if f.severity in (Severity.WARNING, Severity.ERROR))

    def with_findings(self, more: tuple[Finding, ...]) -> LoadReport:
        """Returns the same report with findings of the client."""
        return LoadReport(self.summary, self.findings + more) if more else self

    def table(self) -> Table:
        """One row per finding."""
        rows = [(f.severity.value, str(f.line or ""), f.element, f.message) for f in self.findings]
        return Table(("severity", "line", "element", "message"), rows)

    def __repr__(self) -> str:
        return f"<LoadReport {self.summary}>" + (f"\n{self.table().text()}" if self.findings else "")

    def _repr_html_(self) -> str:
        return self.table().html(self.summary)


@dataclass(frozen=True)
class Reloaded:
    """Changes by a reload."""

    report: LoadReport
    stamp: Stamp
    """First moment with the new description."""
    added_joints: tuple[str, ...]
    removed_joints: tuple[str, ...]


_SEVERITIES = {
    proto.Severity.SEVERITY_INFO: Severity.INFO,
    proto.Severity.SEVERITY_WARNING: Severity.WARNING,
    proto.Severity.SEVERITY_ERROR: Severity.ERROR,
}
_DISPOSITIONS = {
    proto.Disposition.DISPOSITION_USED: Disposition.USED,
    proto.Disposition.DISPOSITION_DEFAULTED: Disposition.DEFAULTED,
    proto.Disposition.DISPOSITION_REPAIRED: Disposition.REPAIRED,
    proto.Disposition.DISPOSITION_IGNORED: Disposition.IGNORED,
    proto.Disposition.DISPOSITION_REFUSED: Disposition.REFUSED,
}


def report_from_proto(message: proto.LoadReport) -> LoadReport:
    """Converts a report from its message."""
    findings = (
        Finding(
            severity=_SEVERITIES.get(each.severity, Severity.UNKNOWN),
            disposition=_DISPOSITIONS.get(each.disposition, Disposition.UNKNOWN),
            element=each.element,
            line=each.line,
            message=each.message,
            file=each.file,
        )
        for each in message.findings
    )
    return LoadReport(message.summary, tuple(findings))


def robot_info_from_proto(message: proto.EntityInfo) -> RobotInfo:
    """Converts a robot from its message."""
    return RobotInfo(
        name=message.name,
        model=message.model,
        layout_version=message.layout_version,
        is_fixed=message.base == proto.Base.BASE_FIXED,
        mass=message.mass,
        links=tuple(_link(link) for link in message.links),
        joint_count=message.joints,
        moving_joint_count=message.moving_joints,
        description=message.description,
        loaded_at_start=message.loaded_at_start,
        disabled_reason=message.disabled_reason,
    )


def _link(message: proto.LinkInfo) -> LinkInfo:
    inertia = np.zeros((3, 3))
    if len(message.inertia) == 6:
        xx, xy, xz, yy, yz, zz = message.inertia
        inertia[:] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    center = vector_from_proto(message.center_of_mass)
    return LinkInfo(message.name, message.parent, message.mass, center, inertia)
