"""The Python client of simd: robots, joints and time of a running daemon, over Zenoh.

    import simd_client

    with simd_client.connect() as sim:
        sim.pause()
        arm = sim.load("arm.urdf", fixed=True)
        arm.joints["elbow"].target = 0.5
        sim.step(1000)
        print(arm.position)

`Simulation` is a connection, `Robot` and `Joint` are in its world, `Target` is what a joint's actuator does,
`SimdError` is the base of all refusals. `simd_client.aio` is the same client for asyncio, `simd_client.proto` has the
messages of the schema.
"""

from simd_client.blocking.callbacks import Callbacks
from simd_client.blocking.claim import Claim
from simd_client.blocking.connect import connect
from simd_client.blocking.constraints import Constraints
from simd_client.blocking.joint import Joint, Joints
from simd_client.blocking.parameters import Parameters
from simd_client.blocking.recording import Recording
from simd_client.blocking.robot import Robot
from simd_client.blocking.simulation import Simulation
from simd_client.blocking.view import View
from simd_client.blocking.watch import EventWatch, Watch
from simd_client.collision_filter import CollisionFilter, CollisionPair
from simd_client.constraint import Constraint, ConstraintEnd, ConstraintKind
from simd_client.contact import Contact, RayHits
from simd_client.description import Disposition, Finding, LinkInfo, LoadReport, Reloaded, RobotInfo, Severity
from simd_client.endpoint import DEFAULT_ENDPOINT, Endpoint
from simd_client.errors import (
    AnswerError,
    AssetNotUploaded,
    ClaimNotFound,
    ConstraintExists,
    ConstraintNotFound,
    DeadlineExceeded,
    DescriptionNotUploaded,
    EndpointError,
    FileNotFound,
    Internal,
    InvalidDescription,
    InLockstep,
    InvalidSavedState,
    InvalidValue,
    JointClaimed,
    JointNotActuated,
    JointNotFound,
    LayoutChanged,
    LimitExceeded,
    LinkNotFound,
    LockstepMemberNotFound,
    MailboxFull,
    NotFound,
    NotSupported,
    NoUrdf,
    OwnedByAnother,
    ParameterExists,
    ParameterNotFound,
    PathNotAllowed,
    Refused,
    RequestIdReused,
    RoleTooLow,
    RecordingExists,
    RecordingNotFound,
    RecordingNotPossible,
    RobotClaimed,
    RobotExists,
    RobotNotAllowed,
    RobotNotFound,
    ShuttingDown,
    SimdError,
    SavedStateNotFound,
    Superseded,
    TargetBeyondLimit,
    Unauthenticated,
    Unavailable,
    UploadMismatch,
    VersionMismatch,
    WorldClaimed,
    WorldNotClaimed,
    WrongState,
    XacroError,
)
from simd_client.event import Event
from simd_client.geometry import Pose, Twist
from simd_client.kinematics import Configuration, InverseKinematics, Jacobian, JointReactions, Wrench
from simd_client.layout import Gains, JointFlag, JointInfo, JointLimits, JointMode, JointType, Layout, Mimic
from simd_client.link_states import LinkStates
from simd_client.parameter import Button, JointBinding, Parameter, ParameterList, Slider
from simd_client.query import ClosestPoints, LinkBounds, Place, PlacedShape, Shape
from simd_client.recording import RecordingInfo
from simd_client.state import Applied, Clamped, JointState, RobotState, States
from simd_client.surface import Surface, Surfaces
from simd_client.target import RobotTargets, Target, Targets, Whole
from simd_client.trajectory import (
    TrajectoryOutcome,
    TrajectoryProgress,
    TrajectoryResult,
    TrajectoryStatus,
)
from simd_client.version import API_VERSION, __version__
from simd_client.view import Input, KeyEvent, Marker, MouseEvent, ViewCamera
from simd_client.world import (
    Integrator,
    Pace,
    Physics,
    SavedState,
    SimulationState,
    SimulatorInfo,
    Stamp,
    WorldStatistics,
)

__all__ = [
    "API_VERSION",
    "AnswerError",
    "Applied",
    "AssetNotUploaded",
    "Button",
    "Callbacks",
    "Claim",
    "ClaimNotFound",
    "Clamped",
    "ClosestPoints",
    "CollisionFilter",
    "CollisionPair",
    "Configuration",
    "Constraint",
    "ConstraintEnd",
    "ConstraintExists",
    "ConstraintKind",
    "ConstraintNotFound",
    "Constraints",
    "Contact",
    "DEFAULT_ENDPOINT",
    "DeadlineExceeded",
    "DescriptionNotUploaded",
    "Disposition",
    "Endpoint",
    "EndpointError",
    "Event",
    "EventWatch",
    "FileNotFound",
    "Finding",
    "Gains",
    "Integrator",
    "Internal",
    "InvalidDescription",
    "InLockstep",
    "Input",
    "InvalidSavedState",
    "InvalidValue",
    "InverseKinematics",
    "Jacobian",
    "Joint",
    "JointBinding",
    "JointClaimed",
    "JointFlag",
    "JointInfo",
    "JointLimits",
    "JointMode",
    "JointNotActuated",
    "JointNotFound",
    "JointReactions",
    "JointState",
    "JointType",
    "Joints",
    "KeyEvent",
    "Layout",
    "LayoutChanged",
    "LimitExceeded",
    "LinkBounds",
    "LinkInfo",
    "LinkNotFound",
    "LockstepMemberNotFound",
    "LinkStates",
    "LoadReport",
    "MailboxFull",
    "Marker",
    "Mimic",
    "MouseEvent",
    "NoUrdf",
    "NotFound",
    "NotSupported",
    "OwnedByAnother",
    "Pace",
    "Parameter",
    "ParameterExists",
    "ParameterList",
    "ParameterNotFound",
    "Parameters",
    "PathNotAllowed",
    "Physics",
    "Place",
    "PlacedShape",
    "Pose",
    "RayHits",
    "Refused",
    "Reloaded",
    "RequestIdReused",
    "RoleTooLow",
    "Recording",
    "RecordingExists",
    "RecordingInfo",
    "RecordingNotFound",
    "RecordingNotPossible",
    "Robot",
    "RobotClaimed",
    "RobotExists",
    "RobotInfo",
    "RobotNotAllowed",
    "RobotNotFound",
    "RobotState",
    "RobotTargets",
    "Severity",
    "Shape",
    "ShuttingDown",
    "SimdError",
    "Simulation",
    "SimulationState",
    "SimulatorInfo",
    "Slider",
    "SavedState",
    "SavedStateNotFound",
    "Stamp",
    "States",
    "Superseded",
    "Surface",
    "Surfaces",
    "Target",
    "TargetBeyondLimit",
    "Targets",
    "Twist",
    "TrajectoryOutcome",
    "TrajectoryProgress",
    "TrajectoryResult",
    "TrajectoryStatus",
    "Unauthenticated",
    "Unavailable",
    "UploadMismatch",
    "VersionMismatch",
    "View",
    "ViewCamera",
    "Watch",
    "Whole",
    "WorldStatistics",
    "Wrench",
    "WorldClaimed",
    "WorldNotClaimed",
    "WrongState",
    "XacroError",
    "__version__",
    "connect",
]
