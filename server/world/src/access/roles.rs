//! The role that each method of the schema asks for.

use simd_proto::access::Role;

/// All methods, by service and role.
const ROLES: &[(&str, Role, &[&str])] = &[
    ("CameraService", Role::Viewer, &["ListCameras", "GetPicture", "GetMesh"]),
    // To take pictures takes the renderers' time, and who draws decides what controllers see.
    ("CameraService", Role::Operator, &["TakePicture", "NextPicture", "PutPicture"]),
    ("ClientService", Role::Viewer, &["ListClients"]),
    ("ConstraintService", Role::Viewer, &["ListConstraints"]),
    ("ConstraintService", Role::Operator, &["CreateConstraint", "ChangeConstraint", "DeleteConstraint"]),
    (
        "ContactService",
        Role::Viewer,
        &["GetContacts", "CastRays", "GetClosestPoints", "FindOverlaps", "CastShape", "GetLinkBounds"],
    ),
    (
        "EntityService",
        Role::Viewer,
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
    ("EntityService", Role::Operator, &["ApplyLinkWrench", "PullLink", "SetEntityState"]),
    (
        "EntityService",
        Role::Admin,
        &[
            "PrepareDescription",
            "ExpandXacro",
            "UploadAsset",
            "ValidateDescription",
            "SpawnEntity",
            "SpawnEntityWithProgress",
            "ReloadEntity",
            "DeleteEntity",
            "SetLinkProperties",
            "SetCollisionFilter",
        ],
    ),
    ("EventService", Role::Viewer, &["WatchEvents", "NextEvents"]),
    (
        "JointService",
        Role::Viewer,
        &["GetJointLayout", "GetJointStates", "NextJointStates", "WatchJointStates", "ListTrajectories"],
    ),
    (
        "JointService",
        Role::Operator,
        &[
            "SetJointTargets",
            "FollowTrajectory",
            "CancelTrajectory",
            "ResetJoints",
            "SetJointProperties",
            "ClaimJoints",
            "ReleaseJoints",
            "Control",
        ],
    ),
    (
        "KinematicsService",
        Role::Viewer,
        &[
            "GetLinkStates",
            "GetJointReactions",
            "GetJacobian",
            "GetMassMatrix",
            "ComputeInverseDynamics",
            "ComputeInverseKinematics",
        ],
    ),
    ("ParameterService", Role::Viewer, &["GetParameters", "NextParameters", "WatchParameters"]),
    ("ParameterService", Role::Operator, &["AddParameter", "SetParameters", "RemoveParameters"]),
    ("RecordingService", Role::Viewer, &["ListRecordings", "GetRecording", "ReadRecording"]),
    ("RecordingService", Role::Operator, &["StartRecording", "StopRecording"]),
    ("RecordingService", Role::Admin, &["DeleteRecording"]),
    // It changes nothing, and takes the machine's time.
    ("RolloutService", Role::Operator, &["Rollout"]),
    (
        "SensorService",
        Role::Viewer,
        &["ListSensors", "GetSensorReadings", "NextSensorReadings", "WatchSensorReadings"],
    ),
    ("SensorService", Role::Operator, &["CreateSensor", "DeleteSensor"]),
    (
        "SimulationService",
        Role::Viewer,
        &[
            "GetSimulatorInfo",
            "GetSimulationState",
            "GetPhysics",
            "GetWorldStatistics",
            "ListSavedStates",
            "ListLockstepMembers",
        ],
    ),
    (
        "SimulationService",
        Role::Admin,
        &[
            "SetSimulationState",
            "StepSimulation",
            "JoinLockstep",
            "LeaveLockstep",
            "ResetSimulation",
            "SetPhysics",
            "SaveState",
            "RestoreState",
            "DeleteSavedState",
            "ExportSavedState",
            "ImportSavedState",
        ],
    ),
    ("ViewService", Role::Viewer, &["ListMarkers", "NextView", "GetCameras"]),
    // To ask for keys makes pages report them.
    (
        "ViewService",
        Role::Operator,
        &["AddMarkers", "DeleteMarkers", "ReportView", "SetCamera", "SetLinkColors", "NextInput"],
    ),
];

/// Which role a method asks for. One that is not in the table asks for the highest.
pub fn role_of(service: &str, method: &str) -> Role {
    let has = |(of, _, methods): &&(&str, Role, &[&str])| *of == service && methods.contains(&method);
    ROLES.iter().find(has).map_or(Role::Admin, |(_, role, _)| *role)
}

#[cfg(test)]
mod tests {
    use simd_proto::methods;

    use super::*;

    #[test]
    fn every_method_of_the_schema_has_one_role() {
        for (service, method, _) in methods::all() {
            let rows = ROLES.iter().filter(|(of, _, names)| *of == service && names.contains(&method));
            assert_eq!(rows.count(), 1, "{service}/{method}");
        }
        let named: usize = ROLES.iter().map(|(_, _, names)| names.len()).sum();
        assert_eq!(named, methods::all().count(), "the table has no method that the schema lacks");
    }
}
