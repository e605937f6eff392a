//! URDFs that an SDF includes.

use super::*;
use crate::robot::{Geometry, JointKind};
use crate::setup::DriveMode;

const GRIP: &str = "<robot name='grip'><link name='palm'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>\
    <visual><origin xyz='0 0 1'/><geometry><mesh filename='meshes/palm.stl'/></geometry></visual>\
    <collision><geometry><box size='1 2 3'/></geometry></collision></link><link name='finger'/><link name='other'/>\
    <joint name='f' type='revolute'><origin xyz='0.05 0 0'/><parent link='palm'/><child link='finger'/><axis xyz='0 1 0'/>\
    <limit lower='-1' upper='1' effort='50' velocity='5'/><dynamics damping='0.5' friction='0.25' armature='0.1'/></joint>\
    <joint name='g' type='continuous'><origin xyz='-0.05 0 0' rpy='0 0 1.5707963267948966'/><parent link='palm'/><child link='other'/><axis xyz='0 0 1'/>\
    <mimic joint='f' multiplier='-2' offset='0.1'/></joint>\
    <ros2_control name='c' type='system'><joint name='f'><command_interface name='velocity'/><param name='vel_kp'>3</param></joint></ros2_control>\
    <gazebo><sensor name='s' type='imu'/></gazebo></robot>";

fn world(pose: &str, uri: &str) -> String {
    format!("<sdf version='1.9'><world name='w'><include><uri>{uri}</uri>{pose}</include></world></sdf>")
}

#[test]
fn an_included_urdf_is_the_robot_that_its_reader_reads() {
    let files = Files::default().with("grippers/grip.urdf", GRIP);
    let text = world("<name>hand</name><pose>0 0 3 0 0 0</pose>", "grippers/grip.urdf");
    let translation = translated_with(&text, &files);
    let [hand] = &translation.models[..] else { panic!("{:?}", translation.models) };
    assert_eq!((hand.name.as_str(), hand.fixed, hand.pose.translation.z), ("hand", false, 3.0));
    let (alone, _) = read(GRIP.as_bytes(), &files, &ReadOptions::default()).unwrap();
    let (model, _) = read(hand.urdf.as_bytes(), &files, &ReadOptions::default()).unwrap();
    for (one, other) in model.joints.iter().zip(&alone.joints) {
        assert_eq!(
            (&one.name, one.kind, one.limits, one.mimic),
            (&other.name, other.kind, other.limits, other.mimic)
        );
        assert_eq!((one.damping, one.friction, one.axis), (other.damping, other.friction, other.axis));
        let off = one.parent_from_joint.inverse() * other.parent_from_joint;
        assert!(off.translation.length() < 1e-12 && off.rotation.to_scaled_axis().length() < 1e-12);
    }
    assert_eq!(joint(&model, "g").kind, JointKind::Continuous);
    assert_eq!(link(&model, "palm").inertial, link(&alone, "palm").inertial);
    assert_eq!(link(&model, "palm").collisions, link(&alone, "palm").collisions);
    let Geometry::Mesh { uri, .. } = &link(&model, "palm").visuals[0].geometry else { panic!() };
    assert_eq!(uri, "grippers/meshes/palm.stl", "relative to the URDF's own folder");
    let setup = model.setup.joints[0];
    assert_eq!((setup.mode, setup.damping, setup.armature), (Some(DriveMode::Velocity), Some(3.0), 0.1));
}

#[test]
fn parts_of_an_included_urdf_beyond_sdf_are_named() {
    let robot = "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='planar'><parent link='a'/><child link='b'/></joint>\
                 <gazebo reference='a'><sensor name='s' type='imu'/></gazebo><group_state name='home' group='all'/></robot>";
    let files = Files::default().with("r.urdf", robot);
    let translation = translated_with(&world("", "r.urdf"), &files);
    for words in ["the planar joint \"j\"", "sensors of an included URDF", "named states of an included URDF"]
    {
        find(&translation.report, words);
    }
}

#[test]
fn a_broken_urdf_refuses_the_sdf_in_a_sentence_that_names_it() {
    let files = Files::default().with("r.urdf", "<robot name='r'/>");
    let refused = translate(world("", "r.urdf").as_bytes(), &files, &LoadLimits::default()).unwrap_err();
    assert!(refused.message.contains("\"r.urdf\""), "{}", refused.message);
}

/// Frames of an included URDF are there for poses of others.
#[test]
fn poses_may_be_relative_to_links_of_an_included_urdf() {
    let files = Files::default().with("grip.urdf", GRIP);
    let text = "<sdf version='1.9'><world name='w'><include><uri>grip.urdf</uri><name>hand</name></include>\
                <model name='box'><pose relative_to='hand::finger'>0 0 1 0 0 0</pose><link name='l'/></model></world></sdf>";
    let translation = translated_with(text, &files);
    let pose = translation.model("box").unwrap().pose;
    assert!(near(pose.translation, [0.05, 0.0, 1.0]), "{pose:?}");
}
