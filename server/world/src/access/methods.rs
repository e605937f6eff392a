//! One table of all methods: the role that each requires, the objects that it concerns, and the claims of
//! others that refuse it.
//!
//! A method of the schema without a row does not compile. Tests walk all methods with tokens for other robots
//! and under claims of others, and compare what they find with the table.

mod schema;

use std::fmt;

use simd_proto::access::Role;
use simd_proto::v1::FILE_DESCRIPTOR_SET;

use self::schema::has_row_for_each_method;

/// Objects that a method changes, or reveals about people: a token for some robots only allows methods on
/// those.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Concern {
    /// It reads the world, or changes only the caller's own objects.
    Nothing,
    /// The robots that it names. The handle checks them.
    Robots,
    /// The robot whose camera is drawn. The handle checks it.
    Camera,
    /// The pages of all people.
    Pages,
    /// The whole world, and everything that clients share.
    World,
}

impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nothing => "nothing",
            Self::Robots => "the robots that it names",
            Self::Camera => "the robot of the camera",
            Self::Pages => "all pages",
            Self::World => "the world",
        })
    }
}

/// Claims of other clients that refuse a method. The world judges them, since it knows what is claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Claims {
    /// None.
    None,
    /// Claims on the joints that it names, and on their robots.
    Joints,
    /// Claims on the robots that it names, and on their joints.
    Robots,
    /// Claims on the world.
    World,
    /// Claims on the world, and any other claim if the caller has not claimed the world.
    All,
}

impl fmt::Display for Claims {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Joints => "of its joints",
            Self::Robots => "of its robots",
            Self::World => "of the world",
            Self::All => "all",
        })
    }
}

/// Methods of a service with the same role, concern and claims.
#[derive(Debug)]
struct Row(&'static str, Role, Concern, Claims, &'static [&'static str]);

const ROWS: &[Row] = &[
    Row(
        "CameraService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["ListCameras", "GetPicture", "GetMesh"],
    ),
    // Taking pictures uses the renderers' time, and renderers determine what controllers see.
    Row("CameraService", Role::Operator, Concern::Nothing, Claims::None, &["TakePicture"]),
    Row("CameraService", Role::Operator, Concern::Camera, Claims::None, &["NextPicture", "PutPicture"]),
    Row("ClientService", Role::Viewer, Concern::Nothing, Claims::None, &["ListClients"]),
    Row("ConstraintService", Role::Viewer, Concern::Nothing, Claims::None, &["ListConstraints"]),
    Row("ConstraintService", Role::Operator, Concern::Robots, Claims::Robots, &["CreateConstraint"]),
    // Their names do not identify the robots. The world knows these, so that claims are judged.
    Row(
        "ConstraintService",
        Role::Operator,
        Concern::World,
        Claims::Robots,
        &["ChangeConstraint", "DeleteConstraint"],
    ),
    Row(
        "ContactService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["GetContacts", "CastRays", "GetClosestPoints", "FindOverlaps", "CastShape", "GetLinkBounds"],
    ),
    Row(
        "EntityService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &[
            "ListEntities",
            "GetEntityInfo",
            "GetEntityState",
            "GetLinkPoses",
            "GetScene",
            "GetAsset",
            "GetLinkProperties",
            "GetCollisionFilter",
        ],
    ),
    Row(
        "EntityService",
        Role::Operator,
        Concern::Robots,
        Claims::Robots,
        &["ApplyLinkWrench", "PullLink", "SetEntityState"],
    ),
    Row(
        "EntityService",
        Role::Admin,
        Concern::Nothing,
        Claims::None,
        &["PrepareDescription", "ExpandXacro", "UploadAsset", "ValidateDescription"],
    ),
    // A new robot has no claims.
    Row(
        "EntityService",
        Role::Admin,
        Concern::Robots,
        Claims::None,
        &["SpawnEntity", "SpawnEntityWithProgress"],
    ),
    Row(
        "EntityService",
        Role::Admin,
        Concern::Robots,
        Claims::Robots,
        &["ReloadEntity", "DeleteEntity", "SetLinkProperties", "SetCollisionFilter"],
    ),
    Row("EventService", Role::Viewer, Concern::Nothing, Claims::None, &["WatchEvents", "NextEvents"]),
    Row(
        "JointService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["GetJointLayout", "GetJointStates", "NextJointStates", "WatchJointStates", "ListTrajectories"],
    ),
    Row(
        "JointService",
        Role::Operator,
        Concern::Robots,
        Claims::Joints,
        &[
            "SetJointTargets",
            "FollowTrajectory",
            "CancelTrajectory",
            "ResetJoints",
            "SetJointProperties",
            "ClaimJoints",
            "Control",
        ],
    ),
    // Its secret proves who holds the claim.
    Row("JointService", Role::Operator, Concern::Nothing, Claims::None, &["ReleaseJoints"]),
    Row(
        "KinematicsService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &[
            "GetLinkStates",
            "GetJointReactions",
            "GetJacobian",
            "GetMassMatrix",
            "ComputeInverseDynamics",
            "ComputeInverseKinematics",
        ],
    ),
    Row(
        "ParameterService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["GetParameters", "NextParameters", "WatchParameters"],
    ),
    // They concern the robots that they are bound to. A slider without moves sets no target.
    Row("ParameterService", Role::Operator, Concern::Robots, Claims::None, &["AddParameter"]),
    Row("ParameterService", Role::Operator, Concern::Robots, Claims::Joints, &["SetParameters"]),
    Row("ParameterService", Role::Operator, Concern::Nothing, Claims::None, &["RemoveParameters"]),
    Row(
        "RecordingService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["ListRecordings", "GetRecording", "ReadRecording"],
    ),
    Row(
        "RecordingService",
        Role::Operator,
        Concern::World,
        Claims::None,
        &["StartRecording", "StopRecording"],
    ),
    Row("RecordingService", Role::Admin, Concern::World, Claims::None, &["DeleteRecording"]),
    // It changes nothing, but uses the machine's time.
    Row("RolloutService", Role::Operator, Concern::Nothing, Claims::None, &["Rollout"]),
    Row(
        "SensorService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["ListSensors", "GetSensorReadings", "NextSensorReadings", "WatchSensorReadings"],
    ),
    Row("SensorService", Role::Operator, Concern::Robots, Claims::Robots, &["CreateSensor", "DeleteSensor"]),
    Row(
        "SimulationService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &[
            "GetSimulatorInfo",
            "GetSimulationState",
            "GetPhysics",
            "GetWorldStatistics",
            "ListSavedStates",
            "ListLockstepMembers",
        ],
    ),
    // Saved states have owners. A member leaves by its secret.
    Row(
        "SimulationService",
        Role::Admin,
        Concern::World,
        Claims::None,
        &["LeaveLockstep", "SaveState", "DeleteSavedState", "ExportSavedState", "ImportSavedState"],
    ),
    Row("SimulationService", Role::Admin, Concern::World, Claims::World, &["StepSimulation", "JoinLockstep"]),
    Row(
        "SimulationService",
        Role::Admin,
        Concern::World,
        Claims::All,
        &["SetSimulationState", "ResetSimulation", "SetPhysics", "RestoreState"],
    ),
    Row(
        "ViewService",
        Role::Viewer,
        Concern::Nothing,
        Claims::None,
        &["ListMarkers", "NextView", "GetCameras"],
    ),
    // A marker without a robot belongs to the world. Pages draw for people: no claim forbids it.
    Row("ViewService", Role::Operator, Concern::Robots, Claims::None, &["AddMarkers", "SetLinkColors"]),
    Row("ViewService", Role::Operator, Concern::Nothing, Claims::None, &["DeleteMarkers", "ReportView"]),
    // Asking for keys makes pages report them.
    Row("ViewService", Role::Operator, Concern::Pages, Claims::None, &["SetCamera", "NextInput"]),
];

const _: () =
    assert!(has_row_for_each_method(FILE_DESCRIPTOR_SET, ROWS), "a method of the schema has no row here");

fn row_of(service: &str, method: &str) -> Option<&'static Row> {
    ROWS.iter().find(|Row(of, .., methods)| *of == service && methods.contains(&method))
}

/// Returns the role that a method requires. A method outside of the table requires the highest.
pub fn role_of(service: &str, method: &str) -> Role {
    row_of(service, method).map_or(Role::Admin, |Row(_, role, ..)| *role)
}

/// Returns the objects that a method concerns. A method outside of the table concerns the world.
pub fn concern_of(service: &str, method: &str) -> Concern {
    row_of(service, method).map_or(Concern::World, |Row(_, _, concern, ..)| *concern)
}

/// Returns the claims of others that refuse a method. A method outside of the table is refused by all.
pub fn claims_of(service: &str, method: &str) -> Claims {
    row_of(service, method).map_or(Claims::All, |Row(_, _, _, claims, _)| *claims)
}

#[cfg(test)]
mod tests {
    use simd_proto::methods;

    use super::*;

    #[test]
    fn every_method_of_the_schema_has_one_row() {
        for (service, method, _) in methods::all() {
            let rows = ROWS.iter().filter(|Row(of, .., names)| *of == service && names.contains(&method));
            assert_eq!(rows.count(), 1, "{service}/{method}");
        }
        let named: usize = ROWS.iter().map(|Row(.., names)| names.len()).sum();
        assert_eq!(named, methods::all().count(), "the table has no method that the schema lacks");
    }
}
