//! Names and messages of robots.

use simd_core::simulation::published_state::PublishedState;
use simd_core::{PhysicsSettings, Simulation, simulation::WorldLimits};
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::tf2_msgs::TFMessage;

use super::robots::{Robot, robots, stamp};
use crate::convert::test_world;

fn world(names: &[&str]) -> (PublishedState, Vec<Robot>) {
    let mut simulation = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    for name in names {
        simulation.apply(&test_world::spawn(name, &[("shoulder", 0.25), ("slide", 0.5)])).unwrap();
    }
    let mut state = PublishedState::default();
    simulation.observe(&mut state);
    let shown = robots(&state.world);
    (state, shown)
}

fn frames(message: &TFMessage) -> Vec<(String, String)> {
    let names = message.transforms.iter();
    names.map(|of| (of.header.frame_id.clone(), of.child_frame_id.clone())).collect()
}

#[test]
fn a_robot_that_is_alone_has_topics_and_frames_without_its_name() {
    let (state, shown) = world(&["arm"]);
    assert_eq!(shown[0].topics.as_deref(), Some(""));
    let message = shown[0].joint_state(&state, &Time { sec: 3, nanosec: 4 });
    assert_eq!(message.header.stamp, Time { sec: 3, nanosec: 4 });
    assert_eq!(message.name, ["shoulder", "slide"], "joints with one position");
    assert_eq!(message.position, [0.25, 0.5]);
    assert_eq!((message.velocity.len(), message.effort.len()), (2, 2));
    let (mut moving, mut fixed) = (TFMessage::default(), TFMessage::default());
    shown[0].moving_frames(&state, &message.header.stamp, &mut moving);
    shown[0].fixed_frames(&state, &mut fixed);
    let pair = |parent: &str, child: &str| (parent.to_owned(), child.to_owned());
    assert_eq!(
        frames(&moving),
        [pair("link_0", "link_1"), pair("link_2", "link_3"), pair("link_3", "link_4")]
    );
    assert_eq!(frames(&fixed), [pair("world", "link_0"), pair("link_1", "link_2")]);
    // By half a metre up, and about z by a quarter of a radian.
    let shoulder = &moving.transforms[0].transform;
    assert!((shoulder.translation.z - 0.5).abs() < 1e-12);
    assert!((shoulder.rotation.z - 0.125_f64.sin()).abs() < 1e-12);
    assert!((shoulder.rotation.w - 0.125_f64.cos()).abs() < 1e-12);
}

#[test]
fn several_robots_have_their_names_before_topics_and_frames() {
    let (state, shown) = world(&["left-arm", "left_arm", "2"]);
    let topics: Vec<_> = shown.iter().map(|robot| robot.topics.clone().unwrap()).collect();
    assert_eq!(topics, ["left_arm/", "left_arm_2/", "_2/"], "words of ROS, no two alike");
    let mut fixed = TFMessage::default();
    shown[1].fixed_frames(&state, &mut fixed);
    assert_eq!(frames(&fixed)[0], ("world".to_owned(), "left_arm_2/link_0".to_owned()));
}

#[test]
fn simulated_time_is_rounded_to_nanoseconds() {
    assert_eq!(stamp(0.001), Time { sec: 0, nanosec: 1_000_000 });
    assert_eq!(stamp(3.0 - 1e-10), Time { sec: 3, nanosec: 0 });
    assert_eq!(stamp(f64::INFINITY).sec, i32::MAX);
}
