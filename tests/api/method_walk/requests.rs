//! A request of each method.

use prost::Message;
use simd_client::{Target, joint_target, robot_targets, slide};
use simd_proto::v1;

/// A free robot with two joints.
const ROBOT: &str = "<robot name='two'>\
    <link name='base_link'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\
    <link name='upper'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\
    <link name='lower'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\
    <joint name='shoulder' type='continuous'><parent link='base_link'/><child link='upper'/><axis xyz='0 1 0'/></joint>\
    <joint name='elbow' type='continuous'><parent link='upper'/><child link='lower'/><axis xyz='0 1 0'/></joint></robot>";

fn urdf() -> v1::DescriptionSource {
    let source = Some(v1::description_source::Source::Urdf(ROBOT.into()));
    v1::DescriptionSource { source, ..Default::default() }
}

/// Returns a request for such a robot.
pub(super) fn spawn(name: &str) -> v1::SpawnEntityRequest {
    let base = v1::Base::Free.into();
    v1::SpawnEntityRequest { name: name.into(), source: Some(urdf()), base, ..Default::default() }
}

/// Returns a sensor of the robot "other".
pub(super) fn sensor(name: &str) -> v1::Sensor {
    let kind = Some(v1::sensor::Kind::Imu(v1::ImuSensor::default()));
    v1::Sensor {
        robot: "other".into(),
        name: name.into(),
        kind,
        link: "base_link".into(),
        ..Default::default()
    }
}

pub(super) fn binding() -> v1::JointBinding {
    v1::JointBinding { robot: "other".into(), joint: "shoulder".into(), ..Default::default() }
}

/// Returns a trajectory of the joint "shoulder".
pub(super) fn trajectory() -> v1::FollowTrajectoryRequest {
    let point = v1::TrajectoryPoint { time: 1.0, positions: vec![0.1], ..Default::default() };
    let (robot, joints, points) = ("other".into(), vec!["shoulder".into()], vec![point]);
    v1::FollowTrajectoryRequest { robot, joints, points, ..Default::default() }
}

/// Returns a weld of the robot "other" to the world.
pub(super) fn weld() -> v1::CreateConstraintRequest {
    v1::CreateConstraintRequest {
        name: "held".into(),
        kind: v1::ConstraintKind::Weld.into(),
        parent: Some(v1::ConstraintEnd { robot: "other".into(), ..Default::default() }),
        child: Some(v1::ConstraintEnd::default()),
        ..Default::default()
    }
}

/// Returns a request of a method, which names the robot "other" or its joint "shoulder" if it can. All have
/// what their methods need, so that nothing but a token or a claim refuses them. Methods that only read are
/// asked with an empty request.
pub(super) fn request(method: &str) -> Vec<u8> {
    let other = || "other".to_owned();
    let shoulder = || "shoulder".to_owned();
    // The name of a new robot is not of the token either.
    let new = || v1::SpawnEntityRequest { allow_renaming: true, ..spawn("new") };
    let x = || v1::Vector3 { x: 0.1, y: 0.0, z: 0.0 };
    match method {
        "CreateConstraint" => v1::CreateConstraintRequest { name: "weld".into(), ..weld() }.encode_to_vec(),
        "ApplyLinkWrench" => {
            let wrench = v1::Wrench { force: Some(x()), ..Default::default() };
            let (robot, link) = (other(), "base_link".into());
            v1::ApplyLinkWrenchRequest { robot, link, wrench: Some(wrench), ..Default::default() }
                .encode_to_vec()
        }
        "PullLink" => {
            let (robot, link, target) = (other(), "base_link".into(), Some(x()));
            v1::PullLinkRequest { robot, link, target, ..Default::default() }.encode_to_vec()
        }
        "SetEntityState" => {
            let twist = Some(v1::Twist { linear: Some(x()), angular: Some(x()) });
            v1::SetEntityStateRequest { robot: other(), twist, ..Default::default() }.encode_to_vec()
        }
        "SpawnEntity" => new().encode_to_vec(),
        "SpawnEntityWithProgress" => {
            v1::SpawnEntityWithProgressRequest { spawn: Some(new()) }.encode_to_vec()
        }
        "ReloadEntity" => {
            let (robot, source) = (other(), Some(urdf()));
            v1::ReloadEntityRequest { robot, source, ..Default::default() }.encode_to_vec()
        }
        "DeleteEntity" => v1::DeleteEntityRequest { robot: other(), ..Default::default() }.encode_to_vec(),
        "SetLinkProperties" => {
            let links = vec![v1::LinkProperties {
                link: "base_link".into(),
                friction: Some(1.0),
                ..Default::default()
            }];
            v1::SetLinkPropertiesRequest { robot: other(), links, ..Default::default() }.encode_to_vec()
        }
        "SetCollisionFilter" => {
            let (robot, self_collision) = (other(), Some(true));
            v1::SetCollisionFilterRequest { robot, self_collision, ..Default::default() }.encode_to_vec()
        }
        "SetJointTargets" | "Control" => {
            let robots = vec![robot_targets("other", [joint_target("shoulder", Target::position(0.1))])];
            match method {
                "Control" => v1::ControlRequest { robots, ..Default::default() }.encode_to_vec(),
                _ => v1::SetJointTargetsRequest { robots, ..Default::default() }.encode_to_vec(),
            }
        }
        "FollowTrajectory" => trajectory().encode_to_vec(),
        "CancelTrajectory" => {
            v1::CancelTrajectoryRequest { robot: other(), ..Default::default() }.encode_to_vec()
        }
        "ResetJoints" => {
            let joints = vec![v1::JointReset { joint: shoulder(), ..Default::default() }];
            let robots = vec![v1::RobotReset { robot: other(), joints }];
            v1::ResetJointsRequest { robots, ..Default::default() }.encode_to_vec()
        }
        "SetJointProperties" => {
            let damped = v1::JointProperties { joint: shoulder(), damping: Some(1.0), ..Default::default() };
            let (robot, joints) = (other(), vec![damped]);
            v1::SetJointPropertiesRequest { robot, joints, ..Default::default() }.encode_to_vec()
        }
        "ClaimJoints" => {
            let selections = vec![v1::JointSelection { robot: other(), joints: vec![shoulder()] }];
            v1::ClaimJointsRequest { selections, holder: "me".into(), lease: 1.0, ..Default::default() }
                .encode_to_vec()
        }
        "AddParameter" => {
            let slider = v1::Slider { minimum: 0.0, maximum: 1.0, value: 0.0 };
            let parameter = v1::Parameter {
                name: "mine".into(),
                joint: Some(binding()),
                kind: Some(v1::parameter::Kind::Slider(slider)),
                ..Default::default()
            };
            v1::AddParameterRequest { parameter: Some(parameter), ..Default::default() }.encode_to_vec()
        }
        "SetParameters" => {
            let changes = vec![slide("of other", 0.5)];
            v1::SetParametersRequest { changes, ..Default::default() }.encode_to_vec()
        }
        "CreateSensor" => {
            v1::CreateSensorRequest { sensor: Some(sensor("imu")), ..Default::default() }.encode_to_vec()
        }
        "DeleteSensor" => {
            let (robot, name) = (other(), "held".into());
            v1::DeleteSensorRequest { robot, name, ..Default::default() }.encode_to_vec()
        }
        "AddMarkers" => {
            let text = v1::MarkerText { text: "STOP".into(), size: 0.1, ..Default::default() };
            let shape = Some(v1::marker::Shape::Text(text));
            let markers = vec![v1::Marker { shape, robot: other(), ..Default::default() }];
            v1::AddMarkersRequest { markers, ..Default::default() }.encode_to_vec()
        }
        "SetLinkColors" => {
            let colors =
                vec![v1::LinkColor { robot: other(), link: "base_link".into(), ..Default::default() }];
            v1::SetLinkColorsRequest { colors, ..Default::default() }.encode_to_vec()
        }
        "ChangeConstraint" => {
            let (name, max_force) = ("held".into(), Some(1e6));
            v1::ChangeConstraintRequest { name, max_force, ..Default::default() }.encode_to_vec()
        }
        "DeleteConstraint" => {
            v1::DeleteConstraintRequest { name: "held".into(), ..Default::default() }.encode_to_vec()
        }
        "SetSimulationState" => {
            let state = v1::SimulationState::Paused.into();
            v1::SetSimulationStateRequest { state, ..Default::default() }.encode_to_vec()
        }
        "StepSimulation" => v1::StepSimulationRequest { steps: 1, ..Default::default() }.encode_to_vec(),
        "JoinLockstep" => v1::JoinLockstepRequest { timeout: 0.01, ..Default::default() }.encode_to_vec(),
        "ResetSimulation" => v1::ResetSimulationRequest { time: true, ..Default::default() }.encode_to_vec(),
        "SetPhysics" => v1::SetPhysicsRequest { substeps: Some(1), ..Default::default() }.encode_to_vec(),
        "RestoreState" => {
            v1::RestoreStateRequest { name: "here".into(), ..Default::default() }.encode_to_vec()
        }
        _ => Vec::new(),
    }
}
