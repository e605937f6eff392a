//! Names and messages of robots.

use simd_core::simulation::published_state::PublishedState;
use simd_core::{PhysicsSettings, Simulation, simulation::WorldLimits};
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::tf2_msgs::TFMessage;

use super::names::{Named, Names};
use super::robots::{Robot, robots};
use crate::config::{PlainNames, Ros2};
use simd_api::convert::test_world;
use simd_world::recording::stamp;

fn world(names: &[&str]) -> (PublishedState, Vec<Robot>) {
    let mut simulation = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    for name in names {
        simulation.apply(&test_world::spawn(name, &[("shoulder", 0.25), ("slide", 0.5)])).unwrap();
    }
    let mut state = PublishedState::default();
    simulation.observe(&mut state);
    let shown = robots(&state.world, &mut Names::new(&Ros2::default()));
    (state, shown)
}

fn frames(message: &TFMessage) -> Vec<(String, String)> {
    let names = message.transforms.iter();
    names.map(|of| (of.header.frame_id.clone(), of.child_frame_id.clone())).collect()
}

#[test]
fn the_first_robot_has_topics_and_frames_without_its_name() {
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
    // Translated by half a metre up, and rotated about z by a quarter of a radian.
    let shoulder = &moving.transforms[0].transform;
    assert!((shoulder.translation.z - 0.5).abs() < 1e-12);
    assert!((shoulder.rotation.z - 0.125_f64.sin()).abs() < 1e-12);
    assert!((shoulder.rotation.w - 0.125_f64.cos()).abs() < 1e-12);
}

#[test]
fn further_robots_have_their_names_before_topics_and_frames() {
    let (state, shown) = world(&["first", "left-arm", "left_arm", "2"]);
    let topics: Vec<_> = shown.iter().map(|robot| robot.topics.clone().unwrap()).collect();
    assert_eq!(topics, ["", "left_arm/", "left_arm_2/", "_2/"], "words of ROS, no two alike");
    let mut fixed = TFMessage::default();
    shown[2].fixed_frames(&state, &mut fixed);
    assert_eq!(frames(&fixed)[0], ("world".to_owned(), "left_arm_2/link_0".to_owned()));
}

fn jointed(robot: &str) -> Named<'_> {
    Named { robot, is_jointed: true }
}

#[test]
fn the_name_of_a_robot_stays_while_random_others_come_and_go() {
    for seed in 0..200 {
        let mut rng = fastrand::Rng::with_seed(seed);
        let rule = match rng.u8(0..3) {
            0 => PlainNames::First,
            1 => PlainNames::Robot("c".into()),
            _ => PlainNames::None,
        };
        let mut names = Names::new(&Ros2 { plain_names: rule.clone(), ..Ros2::default() });
        let mut present: Vec<(&str, bool)> = Vec::new();
        let mut before: std::collections::BTreeMap<&str, String> = std::collections::BTreeMap::new();
        for _ in 0..50 {
            // Two of the names are one word in ROS.
            let robot = ["a", "b", "c", "d-e", "d_e"][rng.usize(0..5)];
            match present.iter().position(|(other, _)| *other == robot) {
                Some(index) => {
                    present.remove(index);
                    before.remove(robot);
                }
                None => present.push((robot, rng.u8(0..4) > 0)),
            }
            let named = |&(robot, is_jointed): &(&'static str, bool)| Named { robot, is_jointed };
            names.follow(&present.iter().map(named).collect::<Vec<_>>());
            let now = present.iter().map(|(robot, _)| (*robot, names.prefix(robot))).collect();
            let kept = |(robot, prefix): (&&str, &String)| names.prefix(robot) == *prefix;
            assert!(before.iter().all(kept), "{seed}: {before:?} {now:?}");
            before = now;
            let mut prefixes: Vec<&String> = before.values().collect();
            prefixes.sort();
            prefixes.dedup();
            assert_eq!(prefixes.len(), before.len(), "{seed}: no two are alike: {before:?}");
            let plain = before.iter().find(|(_, prefix)| prefix.is_empty()).map(|(robot, _)| *robot);
            match rule {
                PlainNames::None => assert_eq!(plain, None),
                PlainNames::Robot(_) => assert!(plain.is_none_or(|robot| robot == "c")),
                PlainNames::First => {}
            }
        }
    }
}

#[test]
fn a_robot_that_comes_back_has_its_plain_names_again_and_no_other_takes_them() {
    let mut names = Names::new(&Ros2::default());
    names.follow(&[jointed("first"), jointed("second")]);
    names.follow(&[jointed("second"), jointed("third")]);
    assert_eq!((names.prefix("second"), names.prefix("third")), ("second/".into(), "third/".into()));
    names.follow(&[jointed("second"), jointed("third"), jointed("first")]);
    assert_eq!((names.prefix("first"), names.prefix("third")), (String::new(), "third/".into()));
    // In an empty world the next robot is the first one.
    names.follow(&[]);
    names.follow(&[jointed("other"), jointed("first")]);
    assert_eq!((names.prefix("other"), names.prefix("first")), (String::new(), "first/".into()));
}

#[test]
fn simulated_time_is_rounded_to_nanoseconds() {
    assert_eq!(stamp(0.001), Time { sec: 0, nanosec: 1_000_000 });
    assert_eq!(stamp(3.0 - 1e-10), Time { sec: 3, nanosec: 0 });
    assert_eq!(stamp(f64::INFINITY).sec, i32::MAX);
}

mod sensors {
    use std::sync::Arc;
    use std::time::SystemTime;

    use glamx::{DPose3, DQuat, DVec3};
    use simd_core::Moment;
    use simd_core::simulation::measure::ImuMeasurement;
    use simd_core::simulation::sensors::{SensorDefinition, WorldSensor};
    use simd_model::sensor::{
        Camera, ChannelNoise, Channels, Noise, Picture, RangeLimits, Scan, SensorKind, SensorMount, Sweep,
        WrenchAxes, WrenchDirection,
    };

    use super::*;
    use crate::ros2::sensors::shape;
    use simd_world::handle::{LoggedReading, Measured};
    use simd_world::recording::sensor_message::{SensorMessage, SensorShape};

    fn sensor(name: &str, kind: SensorKind, on: SensorMount, link: usize) -> WorldSensor {
        let noise = Noise { standard_deviation: 0.5, ..Noise::default() };
        let definition = SensorDefinition {
            name: name.into(),
            on,
            link,
            pose: DPose3::IDENTITY,
            rate: Some(10.0),
            kind,
            noise: vec![ChannelNoise { channels: Channels::AngularVelocity, axis: Some(2), noise }],
            seed: 0,
            is_described: false,
        };
        WorldSensor { id: 1, robot: 0, definition: Arc::new(definition) }
    }

    fn reading(measured: Measured) -> LoggedReading {
        LoggedReading {
            sequence: 1,
            sample: 1,
            at: Moment { epoch: 0, step: 2, sim_time: 1.5 },
            wall_time: SystemTime::UNIX_EPOCH,
            state_sequence: 1,
            measured,
        }
    }

    #[test]
    fn each_sensor_has_a_frame_on_its_link() {
        let (mut state, shown) = world(&["arm", "other"]);
        let sensors = [("eye", 2), ("link_1", 0)];
        let sensors =
            sensors.map(|(name, link)| sensor(name, SensorKind::Imu, SensorMount::Link(link), link));
        state.sensors = Arc::new(sensors.into());
        let mut fixed = TFMessage::default();
        shown[0].sensor_frames(&state, &mut fixed);
        let pair = |parent: &str, child: &str| (parent.to_owned(), child.to_owned());
        // A link has the name of the second one.
        let expected = [pair("link_2", "eye"), pair("link_0", "link_1_sensor")];
        assert_eq!(frames(&fixed), expected);
        let mut others = TFMessage::default();
        shown[1].sensor_frames(&state, &mut others);
        assert!(others.transforms.is_empty());
    }

    #[test]
    fn the_pictures_of_a_camera_have_a_frame_with_z_forwards() {
        let (mut state, shown) = world(&["arm"]);
        let camera = Camera {
            picture: Picture::Color,
            width: 4,
            height: 3,
            horizontal_field_of_view: 1.0,
            near: 0.1,
            far: 10.0,
        };
        state.sensors = Arc::new(vec![sensor("eye", SensorKind::Camera(camera), SensorMount::Link(2), 2)]);
        let mut fixed = TFMessage::default();
        shown[0].sensor_frames(&state, &mut fixed);
        let pair = |parent: &str, child: &str| (parent.to_owned(), child.to_owned());
        assert_eq!(frames(&fixed), [pair("link_2", "eye"), pair("eye", "eye_optical")]);
        let turn = &fixed.transforms[1].transform.rotation;
        let turn = DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w);
        // Forwards, and to the right.
        assert!((turn * DVec3::Z - DVec3::X).length() < 1e-12);
        assert!((turn * DVec3::X + DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn a_wrench_is_in_the_frame_whose_axes_it_is_in() {
        let (_, shown) = world(&["arm"]);
        // The first joint is between the first two links.
        for (axes, frame) in
            [(WrenchAxes::Child, "link_1"), (WrenchAxes::Parent, "link_0"), (WrenchAxes::Sensor, "wrist")]
        {
            let kind = SensorKind::ForceTorque { axes, direction: WrenchDirection::ChildOnParent };
            let shape = shape(&sensor("wrist", kind, SensorMount::Joint(0), 1), &shown[0]);
            assert_eq!(shape.frame, frame);
        }
    }

    #[test]
    fn an_inertial_unit_says_its_noise_as_covariance() {
        let (_, shown) = world(&["arm"]);
        let shape = shape(&sensor("imu", SensorKind::Imu, SensorMount::Link(0), 0), &shown[0]);
        let measured = ImuMeasurement {
            linear_acceleration: DVec3::new(0.0, 0.0, 9.81),
            angular_velocity: DVec3::X,
            orientation: DQuat::IDENTITY,
        };
        let message = shape.message(&reading(Measured::Imu(measured)));
        let Some(SensorMessage::Imu(message)) = message else { panic!("{message:?}") };
        assert_eq!(message.header.stamp, Time { sec: 1, nanosec: 500_000_000 });
        assert_eq!((message.header.frame_id.as_str(), message.linear_acceleration.z), ("imu", 9.81));
        assert_eq!(message.angular_velocity_covariance, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25]);
        assert_eq!(message.linear_acceleration_covariance, [0.0; 9]);
    }

    #[test]
    fn a_scan_of_one_row_is_a_laser_scan_and_one_of_several_a_cloud() {
        let (_, shown) = world(&["arm"]);
        let right = std::f64::consts::FRAC_PI_2;
        let scan = |rows: u32, rolling: bool| Scan {
            horizontal: Sweep { samples: 3, least: -right, most: right },
            vertical: Sweep { samples: rows, least: 0.0, most: f64::from(rows - 1) * right },
            range: RangeLimits { least: 0.1, most: 10.0 },
            rolling,
        };
        let ranges: Arc<[f32]> = [1.0, 2.0, f32::INFINITY, 4.0, 5.0, 6.0].into();
        let of_period = |rows: u32, rolling: bool, period: f64| {
            let eye = sensor("eye", SensorKind::Lidar(scan(rows, rolling)), SensorMount::Link(0), 0);
            let shape: SensorShape = shape(&eye, &shown[0]);
            let ranges = ranges[..3 * rows as usize].into();
            shape.message(&reading(Measured::Lidar { ranges, columns: 3, period })).unwrap()
        };
        let message = |rows: u32, rolling: bool| of_period(rows, rolling, 0.1);
        let SensorMessage::Scan(line) = message(1, false) else { panic!("no laser scan") };
        assert_eq!((line.angle_min, line.angle_increment), (-right as f32, right as f32));
        assert_eq!((line.ranges.as_slice(), line.scan_time), (&ranges[..3], 0.1));
        let SensorMessage::Scan(rolling) = message(1, true) else { panic!("no laser scan") };
        // Three rays in 0.1 s, the last at 1.5 s.
        assert_eq!((line.time_increment, rolling.time_increment), (0.0, (0.1 / 3.0) as f32));
        assert_eq!((line.header.stamp.nanosec, rolling.header.stamp.nanosec / 1_000), (500_000_000, 433_333));
        // A sensor that measures at each step scans once per step, whatever rate was requested.
        let SensorMessage::Scan(fast) = of_period(1, true, 0.003) else { panic!("no laser scan") };
        assert_eq!((fast.time_increment, fast.scan_time), (0.001, 0.003));
        assert_eq!(fast.header.stamp.nanosec, 498_000_000);
        let SensorMessage::Points(rolling) = message(2, true) else { panic!("no cloud") };
        assert_eq!(
            (rolling.point_step, rolling.fields[3].name.as_str(), rolling.data.len()),
            (16, "time", 96)
        );
        assert_eq!(rolling.data[28..32], ((0.1 / 3.0) as f32).to_le_bytes());
        let SensorMessage::Points(cloud) = message(2, false) else { panic!("no cloud") };
        assert_eq!((cloud.width, cloud.height, cloud.data.len(), cloud.is_dense), (3, 2, 72, false));
        let number = |at: usize| f32::from_le_bytes(cloud.data[4 * at..4 * at + 4].try_into().unwrap());
        let point = |at: usize| [number(3 * at), number(3 * at + 1), number(3 * at + 2)];
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        // To the right, ahead, and the row that looks straight up.
        assert!(near(point(0), [0.0, -1.0, 0.0]) && near(point(1), [2.0, 0.0, 0.0]), "{:?}", point(0));
        assert!(point(2).iter().all(|number| number.is_nan()));
        assert!((3..6).all(|at| near(point(at), [0.0, 0.0, ranges[at]])));
    }
}
