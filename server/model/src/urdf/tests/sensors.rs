//! Reading of sensors.

use glamx::{DQuat, DVec3};

use super::*;
use crate::sensor::{
    Channels, Noise, Picture, RangeLimits, Sensor, SensorKind, SensorMount, WrenchAxes, WrenchDirection,
};

/// Returns an arm on a base, a hand welded to it, and this content.
fn sensors(content: &str) -> (Vec<Sensor>, LoadReport) {
    let (model, report) = robot(&format!(
        "<robot name='r'><link name='base'/><link name='arm'>{BODY}</link><link name='hand'>{BODY}</link>\
         <joint name='j' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/></joint>\
         <joint name='weld' type='fixed'><parent link='arm'/><child link='hand'/></joint>\n{content}</robot>"
    ));
    (model.setup.sensors, report)
}

fn sensor(reference: &str, attributes: &str, content: &str) -> Sensor {
    let text =
        format!("<gazebo reference='{reference}'><sensor name='s' {attributes}>{content}</sensor></gazebo>");
    let (mut read, report) = sensors(&text);
    assert_eq!(read.len(), 1, "{text}: {:#?}", report.findings);
    read.remove(0)
}

#[test]
fn every_type_of_sensor_is_read() {
    let wrench =
        SensorKind::ForceTorque { axes: WrenchAxes::Child, direction: WrenchDirection::ChildOnParent };
    for (reference, word, on, expected) in [
        ("arm", "imu", SensorMount::Link(1), SensorKind::Imu),
        ("weld", "imu", SensorMount::Link(2), SensorKind::Imu),
        ("arm", "accelerometer", SensorMount::Link(1), SensorKind::Imu),
        ("arm", "gyroscope", SensorMount::Link(1), SensorKind::Imu),
        ("weld", "force_torque", SensorMount::Joint(1), wrench),
        ("hand", "force_torque", SensorMount::Joint(1), wrench),
        ("hand", "contact", SensorMount::Link(2), SensorKind::Contact { threshold: 0.0 }),
        ("base", "ray", SensorMount::Link(0), SensorKind::Range(RangeLimits { least: 0.0, most: 1e4 })),
        ("base", "sonar", SensorMount::Link(0), SensorKind::Range(RangeLimits { least: 0.0, most: 1e4 })),
        ("arm", "link_state", SensorMount::Link(1), SensorKind::LinkState),
        ("arm", "odometry", SensorMount::Link(1), SensorKind::Odometry),
        ("j", "encoder", SensorMount::Joint(0), SensorKind::Encoder { backlash: 0.0 }),
    ] {
        let read = sensor(reference, &format!("type='{word}'"), "");
        assert_eq!((read.on, read.kind, read.rate), (on, expected, None), "{reference} {word}");
    }
}

#[test]
fn poses_rates_and_names_are_read() {
    let read = sensor(
        "arm",
        "type='imu'",
        "<update_rate>250</update_rate><pose>1 2 3 0 0 1.5707963267948966</pose><always_on>1</always_on>",
    );
    assert_eq!((read.rate, read.pose.translation), (Some(250.0), DVec3::new(1.0, 2.0, 3.0)));
    assert!(read.pose.rotation.dot(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) > 1.0 - 1e-12);
    let degrees = sensor("arm", "type='imu'", "<pose degrees='true'>0 0 0 0 0 90</pose>");
    assert!(degrees.pose.rotation.dot(read.pose.rotation) > 1.0 - 1e-12);
    let (read, _) = sensors(
        "<sensor name='a b' type='imu'><parent link='arm'/><origin xyz='1 0 0'/></sensor>\
         <sensor name='a b' type='imu'><parent joint='weld'/></sensor><sensor type='imu' update_rate='9'><parent link='arm'/></sensor>",
    );
    let names: Vec<&str> = read.iter().map(|sensor| sensor.name.as_str()).collect();
    assert_eq!(names, ["a_b", "a_b_2", "imu"]);
    assert_eq!(read[0].pose.translation, DVec3::X);
    assert_eq!((read[1].on, read[2].rate), (SensorMount::Link(2), Some(9.0)));
}

#[test]
fn scans_of_lasers_are_read() {
    let scan = "<ray><scan><horizontal><samples>640</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal>\
                <vertical><samples>16</samples><min_angle>-0.2</min_angle><max_angle>0.3</max_angle></vertical></scan>\
                <range><min>0.1</min><max>inf</max></range>\
                <noise><type>gaussian</type><mean>0.5</mean><stddev>0.01</stddev></noise></ray>";
    for content in [scan.to_owned(), scan.replace("ray>", "lidar>")] {
        let read = sensor("arm", "type='gpu_lidar'", &content);
        let SensorKind::Lidar(lidar) = read.kind else { panic!("{:?}", read.kind) };
        assert_eq!((lidar.horizontal.samples, lidar.vertical.samples), (640, 16));
        assert_eq!((lidar.horizontal.least, lidar.vertical.most), (-1.5, 0.3));
        assert_eq!(lidar.range, RangeLimits { least: 0.1, most: 1e4 });
        assert!(!lidar.rolling);
        let rolling = content.replace("<scan>", "<rolling>true</rolling><scan>");
        let read = sensor("arm", "type='gpu_lidar'", &rolling);
        assert!(matches!(read.kind, SensorKind::Lidar(lidar) if lidar.rolling), "{:?}", read.kind);
        assert_eq!((read.noise[0].channels, read.noise[0].axis), (Channels::Range, None));
        let noise = Noise { standard_deviation: 0.01, bias_mean: 0.5, ..Noise::default() };
        assert_eq!(read.noise[0].noise, noise);
    }
}

#[test]
fn noise_is_read_by_axis_and_as_it_was_written_before() {
    let read = sensor(
        "arm",
        "type='imu'",
        "<imu><angular_velocity><x><noise type='gaussian'><stddev>0.1</stddev></noise></x>\
         <z><noise type='gaussian_quantized'><bias_mean>1</bias_mean><bias_stddev>2</bias_stddev><precision>0.5</precision>\
         <dynamic_bias_stddev>3</dynamic_bias_stddev><dynamic_bias_correlation_time>4</dynamic_bias_correlation_time></noise></z></angular_velocity>\
         <linear_acceleration><y><noise type='none'/></y></linear_acceleration></imu>",
    );
    let of: Vec<_> = read.noise.iter().map(|noise| (noise.channels, noise.axis)).collect();
    assert_eq!(of, [(Channels::AngularVelocity, Some(0)), (Channels::AngularVelocity, Some(2))]);
    assert_eq!(read.noise[0].noise, Noise { standard_deviation: 0.1, ..Noise::default() });
    let expected = Noise {
        bias_mean: 1.0,
        bias_standard_deviation: 2.0,
        random_walk: 3.0,
        correlation_time: Some(4.0),
        quantum: 0.5,
        ..Noise::default()
    };
    assert_eq!(read.noise[1].noise, expected);

    let old = sensor(
        "arm",
        "type='imu'",
        "<imu><noise><type>gaussian</type><rate><mean>0</mean><stddev>0.2</stddev></rate>\
         <accel><mean>0</mean><stddev>0.3</stddev></accel></noise></imu>",
    );
    let of: Vec<_> = old.noise.iter().map(|noise| (noise.channels, noise.noise.standard_deviation)).collect();
    assert_eq!(of, [(Channels::AngularVelocity, 0.2), (Channels::LinearAcceleration, 0.3)]);

    assert_eq!(old.seed, 0);
    for content in ["<seed> 18446744073709551615 </seed>", "<seed></seed>"] {
        let seeded = sensor("arm", "type='imu'", content);
        assert_eq!(seeded.seed, if content.contains('1') { u64::MAX } else { 0 });
    }

    let encoder = sensor("j", "type='encoder'", "<resolution>0.01</resolution>");
    assert_eq!(encoder.noise[0].channels, Channels::JointPosition);
    assert_eq!(encoder.noise[0].noise, Noise { quantum: 0.01, ..Noise::default() });
}

#[test]
fn frames_and_directions_of_force_torque_sensors_are_read() {
    for (frame, axes) in
        [("child", WrenchAxes::Child), ("parent", WrenchAxes::Parent), ("sensor", WrenchAxes::Sensor)]
    {
        for (word, direction) in [
            ("child_to_parent", WrenchDirection::ChildOnParent),
            ("parent_to_child", WrenchDirection::ParentOnChild),
        ] {
            let content = format!(
                "<force_torque><frame>{frame}</frame><measure_direction>{word}</measure_direction></force_torque>"
            );
            let read = sensor("weld", "type='force_torque'", &content);
            assert_eq!(read.kind, SensorKind::ForceTorque { axes, direction });
        }
    }
}

#[test]
fn cameras_are_read_and_the_report_names_the_renderer() {
    let (read, report) = sensors(
        "<gazebo reference='arm'><sensor name='eye' type='depth_camera'><camera><horizontal_fov>1.2</horizontal_fov>\
         <image><width>640</width><height>480</height></image><clip><near>0.2</near><far>8</far></clip></camera></sensor></gazebo>",
    );
    let SensorKind::Camera(camera) = read[0].kind else { panic!("{:?}", read[0].kind) };
    assert_eq!((camera.picture, camera.width, camera.height), (Picture::Depth, 640, 480));
    assert_eq!((camera.horizontal_field_of_view, camera.near, camera.far), (1.2, 0.2, 8.0));
    assert_eq!(find(&report, "simd-camera").disposition, Disposition::Used);
}

/// Sensors of URDF's proposal, with attributes instead of elements.
#[test]
fn sensors_of_urdfs_own_proposal_are_read() {
    let (read, report) = sensors(
        "<sensor name='eye' update_rate='20'><parent link='arm'/><origin xyz='0 0 1' rpy='0 0 0'/>\
         <camera><image width='640' height='480' hfov='1.57' format='RGB8' near='0.01' far='50.0'/></camera></sensor>\
         <sensor name='scan' update_rate='10'><parent link='hand'/>\
         <ray><horizontal samples='100' resolution='1' min_angle='-1.57' max_angle='1.57'/>\
         <vertical samples='2' resolution='1' min_angle='0' max_angle='0.1'/></ray></sensor>",
    );
    assert_eq!(read.len(), 2, "{:#?}", report.findings);
    let SensorKind::Camera(camera) = read[0].kind else { panic!("{:?}", read[0].kind) };
    assert_eq!((camera.picture, camera.width, camera.height), (Picture::Color, 640, 480));
    assert_eq!((camera.horizontal_field_of_view, camera.near, camera.far), (1.57, 0.01, 50.0));
    assert_eq!((read[0].rate, read[0].pose.translation), (Some(20.0), DVec3::Z));
    let SensorKind::Lidar(scan) = read[1].kind else { panic!("{:?}", read[1].kind) };
    assert_eq!((scan.horizontal.samples, scan.horizontal.least, scan.horizontal.most), (100, -1.57, 1.57));
    assert_eq!((scan.vertical.samples, scan.vertical.most), (2, 0.1));
    assert!(
        !report.findings.iter().any(|finding| finding.message.contains("not read")),
        "{:#?}",
        report.findings
    );
}

/// As in URDFs of Unitree's robots: Gazebo merges links that fixed joints connect, so contacts of the foot
/// would be contacts of the shin there.
#[test]
fn a_sensor_of_contact_is_of_the_link_whose_shape_it_names() {
    for (shape, link) in [
        ("arm_fixed_joint_lump__hand_collision_1", 2),
        ("arm_fixed_joint_lump__hand_collision", 2),
        ("arm_fixed_joint_lump__foot_collision", 1),
        ("arm_collision", 1),
        ("hand_collision", 1),
    ] {
        let content = format!("<contact><collision>{shape}</collision></contact>");
        let read = sensor("arm", "type='contact'", &content);
        assert_eq!(read.on, SensorMount::Link(link), "{shape}");
    }
}

#[test]
fn each_camera_of_a_stereo_camera_is_one_where_it_is() {
    let camera = |name: &str, y: f64, width: u32| {
        format!(
            "<camera name='{name}'><pose>0 {y} 0 0 0 0</pose><image><width>{width}</width><height>10</height></image></camera>"
        )
    };
    let stereo = format!(
        "<gazebo reference='arm'><sensor name='eyes' type='multicamera'><pose>1 0 0 0 0 0</pose>{}{}</sensor></gazebo>",
        camera("left", 0.1, 20),
        camera("right", -0.1, 30)
    );
    let (read, report) = sensors(&stereo);
    let seen: Vec<_> = read.iter().map(|sensor| (sensor.name.as_str(), sensor.pose.translation)).collect();
    let expected = [("eyes_left", DVec3::new(1.0, 0.1, 0.0)), ("eyes_right", DVec3::new(1.0, -0.1, 0.0))];
    assert_eq!(seen, expected, "{:#?}", report.findings);
    let widths = read.iter().map(|sensor| match sensor.kind {
        SensorKind::Camera(camera) => camera.width,
        other => panic!("{other:?}"),
    });
    assert_eq!(widths.collect::<Vec<_>>(), [20, 30]);
}

/// Parts that are read are not reported, and parts that are not read are reported with their place.
#[test]
fn unread_parts_of_a_sensor_are_named() {
    let noise = "<noise type='gaussian'><stddev>0.1</stddev></noise>";
    for (reference, attributes, content, unread) in [
        (
            "j",
            "type='encoder'",
            format!("<position>{noise}</position><velocity>{noise}</velocity><backlash>0.2</backlash>"),
            "",
        ),
        ("arm", "type='odometry'", format!("<linear_velocity><x>{noise}</x></linear_velocity>"), ""),
        (
            "arm",
            "type='link_state'",
            format!("<orientation>{noise}</orientation><resolution>1</resolution>"),
            "resolution",
        ),
        (
            "arm",
            "type='imu'",
            "<imu><enable_orientation>0</enable_orientation></imu><threshold>1</threshold>".into(),
            "imu/enable_orientation, threshold",
        ),
        (
            "arm",
            "type='contact'",
            format!("<contact><collision>c</collision></contact><threshold>2</threshold>{noise}"),
            "",
        ),
        ("arm", "type='range'", "<range><min>0.1</min><max>2</max></range>".into(), ""),
        (
            "arm",
            "type='camera'",
            format!("<camera name='c'><horizontal_fov>1</horizontal_fov>{noise}<distortion/></camera>"),
            "camera/distortion, camera/noise",
        ),
    ] {
        let text =
            format!("<gazebo reference='{reference}'><sensor {attributes}>{content}</sensor></gazebo>");
        let (read, report) = sensors(&text);
        assert_eq!(read.len(), 1, "{text}: {:#?}", report.findings);
        let said =
            report.findings.iter().find_map(|finding| finding.message.strip_prefix("not read by simd: "));
        assert_eq!(said.unwrap_or_default(), unread, "{text}");
    }
    let geared = sensor("j", "type='encoder'", "<backlash>0.2</backlash>");
    assert_eq!(geared.kind, SensorKind::Encoder { backlash: 0.2 });
}

#[test]
fn invalid_sensors_are_left_out_with_the_reason() {
    for (text, is_warning, why) in [
        (
            "<gazebo reference='arm'><sensor type='gps'/></gazebo>",
            false,
            "simd has no sensor of the type \"gps\"",
        ),
        ("<gazebo reference='arm'><sensor type='immu'/></gazebo>", true, "did you mean imu?"),
        ("<sensor type='imu'/>", true, "it has no parent"),
        ("<sensor type='imu'><parent link='harm'/></sensor>", true, "did you mean \"arm\"?"),
        ("<sensor type='force_torque'><parent link='base'/></sensor>", true, "hangs on no joint"),
        ("<sensor type='encoder'><parent joint='weld'/></sensor>", true, "about one axis"),
        (
            "<sensor type='encoder'><parent joint='j'/><backlash>-1</backlash></sensor>",
            true,
            "its encoder.backlash is -1",
        ),
        (
            "<sensor type='imu'><parent link='arm'/><update_rate>1e9</update_rate></sensor>",
            true,
            "its rate is 1000000000",
        ),
        ("<sensor type='imu'><parent link='arm'/><pose>1 2</pose></sensor>", true, "its pose is 2 numbers"),
        (
            "<sensor type='imu'><parent link='arm'/><seed>-1</seed></sensor>",
            true,
            "its seed \"-1\" is not a whole number of at least 0",
        ),
        (
            "<sensor type='lidar'><parent link='arm'/><ray><scan><horizontal><samples>9</samples><min_angle>2</min_angle>\
             <max_angle>1</max_angle></horizontal></scan></ray></sensor>",
            true,
            "lidar.horizontal.max is 1",
        ),
        (
            "<sensor type='force_torque'><parent joint='weld'/><force_torque><frame>world</frame></force_torque></sensor>",
            true,
            "not one of child, parent, sensor",
        ),
        (
            "<sensor type='contact'><parent link='arm'/><noise type='gaussian'><stddev>-1</stddev></noise></sensor>",
            true,
            "noise[0].standard_deviation is -1",
        ),
    ] {
        let (read, report) = sensors(text);
        assert_eq!(read, [], "{text}");
        let found = find(&report, why);
        assert_eq!(
            (found.severity == Severity::Warning, found.disposition),
            (is_warning, Disposition::Ignored)
        );
    }
    let many = "<sensor type='imu'><parent link='arm'/></sensor>".repeat(70);
    let (read, report) = sensors(&many);
    assert_eq!(read.len(), 64);
    assert_eq!(find(&report, "more than 64 sensors").severity, Severity::Warning);
}
