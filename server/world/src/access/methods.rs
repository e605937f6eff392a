//! One table of all methods: the role that each requires, and the objects that it concerns.
//!
//! A method of the schema without a row does not compile.

use std::fmt;

use simd_proto::access::Role;
use simd_proto::v1::FILE_DESCRIPTOR_SET;

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

/// Methods of a service with the same role and concern.
type Row = (&'static str, Role, Concern, &'static [&'static str]);

const ROWS: &[Row] = &[
    ("CameraService", Role::Viewer, Concern::Nothing, &["ListCameras", "GetPicture", "GetMesh"]),
    // Taking pictures uses the renderers' time, and renderers determine what controllers see.
    ("CameraService", Role::Operator, Concern::Nothing, &["TakePicture"]),
    ("CameraService", Role::Operator, Concern::Camera, &["NextPicture", "PutPicture"]),
    ("ClientService", Role::Viewer, Concern::Nothing, &["ListClients"]),
    ("ConstraintService", Role::Viewer, Concern::Nothing, &["ListConstraints"]),
    ("ConstraintService", Role::Operator, Concern::Robots, &["CreateConstraint"]),
    // Their names do not identify the robots.
    ("ConstraintService", Role::Operator, Concern::World, &["ChangeConstraint", "DeleteConstraint"]),
    (
        "ContactService",
        Role::Viewer,
        Concern::Nothing,
        &["GetContacts", "CastRays", "GetClosestPoints", "FindOverlaps", "CastShape", "GetLinkBounds"],
    ),
    (
        "EntityService",
        Role::Viewer,
        Concern::Nothing,
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
    ("EntityService", Role::Operator, Concern::Robots, &["ApplyLinkWrench", "PullLink", "SetEntityState"]),
    (
        "EntityService",
        Role::Admin,
        Concern::Nothing,
        &["PrepareDescription", "ExpandXacro", "UploadAsset", "ValidateDescription"],
    ),
    (
        "EntityService",
        Role::Admin,
        Concern::Robots,
        &[
            "SpawnEntity",
            "SpawnEntityWithProgress",
            "ReloadEntity",
            "DeleteEntity",
            "SetLinkProperties",
            "SetCollisionFilter",
        ],
    ),
    ("EventService", Role::Viewer, Concern::Nothing, &["WatchEvents", "NextEvents"]),
    (
        "JointService",
        Role::Viewer,
        Concern::Nothing,
        &["GetJointLayout", "GetJointStates", "NextJointStates", "WatchJointStates", "ListTrajectories"],
    ),
    (
        "JointService",
        Role::Operator,
        Concern::Robots,
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
    ("JointService", Role::Operator, Concern::Nothing, &["ReleaseJoints"]),
    (
        "KinematicsService",
        Role::Viewer,
        Concern::Nothing,
        &[
            "GetLinkStates",
            "GetJointReactions",
            "GetJacobian",
            "GetMassMatrix",
            "ComputeInverseDynamics",
            "ComputeInverseKinematics",
        ],
    ),
    (
        "ParameterService",
        Role::Viewer,
        Concern::Nothing,
        &["GetParameters", "NextParameters", "WatchParameters"],
    ),
    // They concern the robots that they are bound to.
    ("ParameterService", Role::Operator, Concern::Robots, &["AddParameter", "SetParameters"]),
    ("ParameterService", Role::Operator, Concern::Nothing, &["RemoveParameters"]),
    (
        "RecordingService",
        Role::Viewer,
        Concern::Nothing,
        &["ListRecordings", "GetRecording", "ReadRecording"],
    ),
    ("RecordingService", Role::Operator, Concern::World, &["StartRecording", "StopRecording"]),
    ("RecordingService", Role::Admin, Concern::World, &["DeleteRecording"]),
    // It changes nothing, but uses the machine's time.
    ("RolloutService", Role::Operator, Concern::Nothing, &["Rollout"]),
    (
        "SensorService",
        Role::Viewer,
        Concern::Nothing,
        &["ListSensors", "GetSensorReadings", "NextSensorReadings", "WatchSensorReadings"],
    ),
    ("SensorService", Role::Operator, Concern::Robots, &["CreateSensor", "DeleteSensor"]),
    (
        "SimulationService",
        Role::Viewer,
        Concern::Nothing,
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
        Concern::World,
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
    ("ViewService", Role::Viewer, Concern::Nothing, &["ListMarkers", "NextView", "GetCameras"]),
    // A marker without a robot belongs to the world.
    ("ViewService", Role::Operator, Concern::Robots, &["AddMarkers", "SetLinkColors"]),
    ("ViewService", Role::Operator, Concern::Nothing, &["DeleteMarkers", "ReportView"]),
    // Asking for keys makes pages report them.
    ("ViewService", Role::Operator, Concern::Pages, &["SetCamera", "NextInput"]),
];

const _: () = assert!(has_row_for_each_method(FILE_DESCRIPTOR_SET), "a method of the schema has no row here");

fn row_of(service: &str, method: &str) -> Option<&'static Row> {
    ROWS.iter().find(|(of, _, _, methods)| *of == service && methods.contains(&method))
}

/// Returns the role that a method requires. A method outside of the table requires the highest.
pub fn role_of(service: &str, method: &str) -> Role {
    row_of(service, method).map_or(Role::Admin, |(_, role, _, _)| *role)
}

/// Returns the objects that a method concerns. A method outside of the table concerns the world.
pub fn concern_of(service: &str, method: &str) -> Concern {
    row_of(service, method).map_or(Concern::World, |(_, _, concern, _)| *concern)
}

/// Returns whether each method of a compiled schema has a row. It reads the fields of a `FileDescriptorSet`
/// that name methods. Their numbers are 1 for files, 6 for a file's services, 2 for a service's methods, and
/// 1 for names.
const fn has_row_for_each_method(schema: &[u8]) -> bool {
    let mut set = Fields::of(schema);
    while let Some((number, file)) = set.next() {
        if number != 1 {
            continue;
        }
        let mut file = Fields::of(file);
        while let Some((number, service)) = file.next() {
            if number == 6 && !has_row_for_each_method_of(service) {
                return false;
            }
        }
    }
    true
}

const fn has_row_for_each_method_of(service: &[u8]) -> bool {
    let (mut fields, name) = (Fields::of(service), name_of(service));
    while let Some((number, method)) = fields.next() {
        if number == 2 && !has_row(name, name_of(method)) {
            return false;
        }
    }
    true
}

const fn name_of(message: &[u8]) -> &[u8] {
    let mut fields = Fields::of(message);
    while let Some((number, name)) = fields.next() {
        if number == 1 {
            return name;
        }
    }
    &[]
}

const fn has_row(service: &[u8], method: &[u8]) -> bool {
    let mut row = 0;
    while row < ROWS.len() {
        let (of, _, _, methods) = &ROWS[row];
        let mut index = 0;
        while index < methods.len() {
            if is_equal(of.as_bytes(), service) && is_equal(methods[index].as_bytes(), method) {
                return true;
            }
            index += 1;
        }
        row += 1;
    }
    false
}

const fn is_equal(mut a: &[u8], mut b: &[u8]) -> bool {
    while let ([first, rest @ ..], [other, others @ ..]) = (a, b) {
        if *first != *other {
            return false;
        }
        (a, b) = (rest, others);
    }
    a.is_empty() && b.is_empty()
}

/// Fields of a message that are texts or messages.
struct Fields<'m>(&'m [u8]);

impl<'m> Fields<'m> {
    const fn of(message: &'m [u8]) -> Self {
        Self(message)
    }

    /// Returns the number of the next field, and its bytes; `None` for a numeric field.
    const fn next(&mut self) -> Option<(u64, &'m [u8])> {
        if self.0.is_empty() {
            return None;
        }
        let key = self.varint();
        let length = match key & 7 {
            0 => {
                self.varint();
                0
            }
            1 => 8,
            5 => 4,
            _ => self.varint() as usize,
        };
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        Some((key >> 3, if key & 7 == 2 { bytes } else { &[] }))
    }

    const fn varint(&mut self) -> u64 {
        let (mut value, mut shift) = (0, 0);
        while let [byte, rest @ ..] = self.0 {
            self.0 = rest;
            value |= ((*byte & 0x7f) as u64) << shift;
            if *byte < 0x80 {
                break;
            }
            shift += 7;
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use simd_proto::methods;

    use super::*;

    #[test]
    fn every_method_of_the_schema_has_one_row() {
        for (service, method, _) in methods::all() {
            let rows = ROWS.iter().filter(|(of, _, _, names)| *of == service && names.contains(&method));
            assert_eq!(rows.count(), 1, "{service}/{method}");
        }
        let named: usize = ROWS.iter().map(|(_, _, _, names)| names.len()).sum();
        assert_eq!(named, methods::all().count(), "the table has no method that the schema lacks");
    }

    #[test]
    fn a_method_without_a_row_is_found() {
        // A file with the service "S", which has a method "M".
        let method = [0x12, 3, 0x0a, 1, b'M'];
        let service = [&[0x0a, 1, b'S'][..], &method].concat();
        let file = [&[0x32, service.len() as u8][..], &service].concat();
        let schema = [&[0x0a, file.len() as u8][..], &file].concat();
        assert!(!has_row_for_each_method(&schema));
        assert!(has_row_for_each_method(&[]));
    }
}
