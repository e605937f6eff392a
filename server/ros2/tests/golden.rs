//! Compares bytes, hashes and texts with rosbags'. `tests/reference/make_ros2.py` makes the file.
#![cfg(test)]

use std::collections::BTreeMap;

use serde::Deserialize;
use simd_ros2::messages::{self, *};
use simd_ros2::{Message, Service};

#[derive(Deserialize)]
struct Reference {
    messages: Vec<Type>,
    services: BTreeMap<String, String>,
    gids: BTreeMap<String, String>,
}

#[derive(Deserialize)]
struct Type {
    name: String,
    hash: String,
    definition: Option<String>,
    /// With three elements in each sequence, with one, and with none.
    payloads: Vec<String>,
}

fn reference() -> Reference {
    serde_json::from_str(include_str!("../../../tests/reference/ros2.json")).unwrap()
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

fn payloads(name: &str) -> Vec<Vec<u8>> {
    let reference = reference();
    let found = reference.messages.iter().find(|other| other.name == name);
    found.unwrap_or_else(|| panic!("no {name}")).payloads.iter().map(|hex| bytes(hex)).collect()
}

#[test]
fn every_type_has_the_hash_and_the_text_of_rosbags() {
    let reference = reference();
    let mut compared = 0;
    for (name, hash, definition) in messages::all() {
        if let Some(expected) = reference.services.get(name) {
            assert_eq!(hash, expected, "{name}");
        } else {
            let Some(expected) = reference.messages.iter().find(|other| other.name == name) else {
                panic!("rosbags was not asked for {name}");
            };
            assert_eq!(hash, expected.hash, "{name}");
            if let Some(expected) = &expected.definition {
                assert_eq!(definition, *expected, "{name}");
            }
        }
        compared += 1;
    }
    assert_eq!(compared, reference.messages.len() + reference.services.len(), "rosbags was asked for more");
}

#[test]
fn a_gid_is_xxh3_with_its_low_half_first() {
    let gids = reference().gids;
    assert!(gids.len() > 10);
    for (token, expected) in gids {
        assert_eq!(simd_ros2::wire::gid(&token).as_slice(), bytes(&expected), "of {} letters", token.len());
    }
}

/// Checks that a message is written back as the same bytes, and that truncated or extended bytes are refused.
fn check<M: Message + std::fmt::Debug + PartialEq>() {
    for payload in payloads(M::NAME) {
        let message = M::from_cdr(&payload).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(message.to_cdr(), payload, "{message:?}");
        for end in 0..payload.len() {
            let error = M::from_cdr(&payload[..end]).expect_err("a message without its end");
            assert!(error.to_string().starts_with(M::NAME), "{error}");
        }
        let padded = [payload.as_slice(), &[0; 3]].concat();
        assert_eq!(M::from_cdr(&padded).as_ref(), Ok(&message), "padding");
        assert!(M::from_cdr(&[padded.as_slice(), &[0]].concat()).is_err(), "four bytes more");
    }
    assert_eq!(M::default().to_cdr(), payloads(M::NAME)[2], "the default of {} is nothing", M::NAME);
    // Flipped bytes never panic, and a message that is read can be written again.
    let mut random = fastrand::Rng::with_seed(1);
    for payload in payloads(M::NAME) {
        for _ in 0..500 {
            let mut payload = payload.clone();
            for _ in 0..random.usize(1..4) {
                let at = random.usize(..payload.len());
                payload[at] = random.u8(..);
            }
            if let Ok(message) = M::from_cdr(&payload) {
                let again = message.to_cdr();
                // Not by value: there may be NaNs.
                assert_eq!(M::from_cdr(&again).unwrap().to_cdr(), again);
            }
        }
    }
}

#[test]
fn every_message_is_written_as_rosbags_writes_it() {
    macro_rules! check_all {
        ($($type:ty),* $(,)?) => { $(check::<$type>();)* };
    }
    check_all!(
        action_msgs::CancelGoalRequest,
        action_msgs::CancelGoalResponse,
        action_msgs::GoalStatusArray,
        builtin_interfaces::Duration,
        builtin_interfaces::Time,
        control_msgs::FollowJointTrajectoryFeedbackMessage,
        control_msgs::FollowJointTrajectoryGetResultRequest,
        control_msgs::FollowJointTrajectoryGetResultResponse,
        control_msgs::FollowJointTrajectorySendGoalRequest,
        control_msgs::FollowJointTrajectorySendGoalResponse,
        geometry_msgs::Accel,
        geometry_msgs::PoseStamped,
        geometry_msgs::TransformStamped,
        geometry_msgs::Twist,
        geometry_msgs::WrenchStamped,
        rcl_interfaces::Log,
        rosgraph_msgs::Clock,
        sensor_msgs::CameraInfo,
        sensor_msgs::Image,
        sensor_msgs::Imu,
        sensor_msgs::JointState,
        sensor_msgs::LaserScan,
        sensor_msgs::PointCloud2,
        sensor_msgs::Range,
        service_msgs::ServiceEventInfo,
        simulation_interfaces::DeleteEntityRequest,
        simulation_interfaces::DeleteEntityResponse,
        simulation_interfaces::GetEntitiesRequest,
        simulation_interfaces::GetEntitiesResponse,
        simulation_interfaces::GetEntityStateRequest,
        simulation_interfaces::GetEntityStateResponse,
        simulation_interfaces::GetSimulationStateRequest,
        simulation_interfaces::GetSimulationStateResponse,
        simulation_interfaces::GetSimulatorFeaturesRequest,
        simulation_interfaces::GetSimulatorFeaturesResponse,
        simulation_interfaces::ResetSimulationRequest,
        simulation_interfaces::ResetSimulationResponse,
        simulation_interfaces::SetEntityStateRequest,
        simulation_interfaces::SetEntityStateResponse,
        simulation_interfaces::SetSimulationStateRequest,
        simulation_interfaces::SetSimulationStateResponse,
        simulation_interfaces::SpawnEntityRequest,
        simulation_interfaces::SpawnEntityResponse,
        simulation_interfaces::StepSimulationRequest,
        simulation_interfaces::StepSimulationResponse,
        std_msgs::Float64MultiArray,
        std_msgs::String,
        tf2_msgs::TFMessage,
        trajectory_msgs::JointTrajectory,
    );
}

#[test]
fn fields_are_read_in_their_places() {
    // The rule of make_ros2.py: integers and texts count up, decimal numbers are 1.25 n - 7.
    let state = sensor_msgs::JointState::from_cdr(&payloads("sensor_msgs/msg/JointState")[0]).unwrap();
    assert_eq!(state.header.stamp, builtin_interfaces::Time { sec: 1, nanosec: 2 });
    assert_eq!(state.header.frame_id, "text 3 ä");
    assert_eq!(state.name, ["text 4 ä", "text 5 ä", "text 6 ä"]);
    assert_eq!(state.position, [1.75, 3.0, 4.25]);
    assert_eq!(state.velocity, [5.5, 6.75, 8.0]);
    assert_eq!(state.effort, [9.25, 10.5, 11.75]);

    let name = simulation_interfaces::GetSimulationState::NAME;
    let answer = simulation_interfaces::GetSimulationStateResponse::from_cdr(
        &payloads(&format!("{name}_Response"))[1],
    );
    let answer = answer.unwrap();
    assert_eq!((answer.state.state, answer.result.result), (50, 51));
}

#[test]
fn a_length_that_nothing_backs_takes_no_memory() {
    // The number of names: 2^32 - 1 of them, in 24 bytes.
    let mut payload = sensor_msgs::JointState::default().to_cdr();
    let names = 4 + 8 + 8;
    payload[names..names + 4].copy_from_slice(&[255; 4]);
    let error = sensor_msgs::JointState::from_cdr(&payload).unwrap_err();
    assert!(
        error.to_string().starts_with("sensor_msgs/msg/JointState.name: 4294967295 elements do not fit"),
        "{error}"
    );
}

#[test]
fn errors_name_the_field_and_what_is_wrong_with_it() {
    let message = tf2_msgs::TFMessage {
        transforms: vec![
            geometry_msgs::TransformStamped {
                child_frame_id: "arm".to_owned(),
                ..Default::default()
            };
            2
        ],
    };
    let mut payload = message.to_cdr();
    let at = payload.windows(3).rposition(|window| window == b"arm").unwrap();
    payload[at] = 0xff;
    let refused = |payload: &[u8]| tf2_msgs::TFMessage::from_cdr(payload).unwrap_err().to_string();
    assert_eq!(
        refused(&payload),
        "tf2_msgs/msg/TFMessage.transforms[1].child_frame_id: the text is not UTF-8"
    );
    payload[at] = 0;
    assert!(refused(&payload).ends_with("the text does not end with its one zero"));
    payload[1] = 0;
    assert!(refused(&payload).starts_with("tf2_msgs/msg/TFMessage: the encoding is 0x00 0x00"), "big-endian");
    assert!(refused(&[]).ends_with("0 bytes are not a payload"));
}

#[test]
fn times_beyond_32_bits_stay_at_the_end() {
    use builtin_interfaces::{Duration, Time};
    assert_eq!(Time::from_nanoseconds(1_500_000_000), Time { sec: 1, nanosec: 500_000_000 });
    assert_eq!(Time::from_nanoseconds(u64::MAX), Time { sec: i32::MAX, nanosec: 999_999_999 });
    assert_eq!(Duration { sec: -1, nanosec: 750_000_000 }.seconds(), -0.25);
}
