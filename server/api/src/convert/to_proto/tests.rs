//! Answers, compared with the world they describe.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::published_state::{Flags, Mode};
use simd_model::robot::Sha256;
use simd_model::{Disposition, Finding, LoadReport, Severity};
use simd_proto::v1;

use super::{entity, geometry, joint, scene, simulation, stamp};
use crate::convert::field::Path;
use crate::convert::from_proto;
use crate::convert::test_world::{model, publish, simulation as world};
use simd_world::handle::{Pace, ValidatedRobot};

#[test]
fn a_pose_comes_back_as_it_went() {
    let pose = DPose3::from_parts(DVec3::new(1.0, -2.0, 3.0), DQuat::from_rotation_y(0.7));
    let back = from_proto::geometry::pose(&Path::ROOT, geometry::pose(pose)).unwrap();
    assert_eq!(back.translation, pose.translation);
    assert!(back.rotation.angle_between(pose.rotation) < 1e-7);
}

#[test]
fn a_stamp_carries_all_clocks() {
    let mut world = world();
    world.step();
    let stamp = stamp::published(&publish(&world, 9));
    assert_eq!((stamp.epoch, stamp.step, stamp.sequence), (0, 1, 9));
    assert_eq!(stamp.sim_time, 1e-3);
    let wall_time = stamp.wall_time.unwrap();
    assert_eq!((wall_time.seconds, wall_time.nanos), (1, 500_000_000));
}

#[test]
fn a_layout_says_where_each_joints_values_are() {
    let world = world();
    let state = publish(&world, 1);
    let (index, right) = state.state.entity("right").unwrap();
    let joints = state.state.joint_status(index).unwrap();
    let layout = joint::layout(&state.state, index, right, &joints);
    assert_eq!((layout.robot.as_str(), layout.layout_version), ("right", right.version));
    assert_eq!((layout.position_count, layout.velocity_count), (5, 5));
    let values: Vec<_> =
        layout.joints.iter().map(|j| (j.name.as_str(), j.position_index, j.position_count)).collect();
    assert_eq!(values, [("shoulder", 0, 1), ("tool", 1, 0), ("puck", 1, 3), ("slide", 4, 1)]);

    let shoulder = &layout.joints[0];
    assert_eq!(shoulder.r#type(), v1::JointType::Revolute);
    assert_eq!(shoulder.axis, Some(v1::Vector3 { x: 0.0, y: 0.0, z: 1.0 }));
    assert_eq!((shoulder.parent_link.as_str(), shoulder.child_link.as_str()), ("link_0", "link_1"));
    assert_eq!(shoulder.mode(), v1::JointMode::Hold);
    let limits = shoulder.limits.unwrap();
    assert_eq!((limits.lower, limits.upper, limits.effort), (Some(-1.0), Some(1.0), None));
    assert_eq!(shoulder.world_from_joint.unwrap().position.unwrap().z, 0.5);
    assert_eq!(layout.joints[1].axis, None);
    assert_eq!(layout.joints[1].mode(), v1::JointMode::None);
}

#[test]
fn an_entity_is_described_link_by_link() {
    let state = publish(&world(), 1);
    let (index, left) = state.state.entity("left").unwrap();
    let info = entity::entity_info(left, state.state.roots.get(index), Some(Sha256::of(b"urdf")));
    assert_eq!((info.name.as_str(), info.model.as_str()), ("left", "test arm"));
    assert_eq!(info.base(), v1::Base::Fixed);
    assert_eq!((info.joints, info.moving_joints, info.mass), (4, 3, 5.0));
    assert_eq!(info.description, Sha256::of(b"urdf").to_string());
    assert_eq!(info.disabled_reason, "");
    let parents: Vec<_> = info.links.iter().map(|link| link.parent.as_str()).collect();
    assert_eq!(parents, ["", "link_0", "link_1", "link_2", "link_3"]);
    assert_eq!(info.links[0].inertia, [0.01, 0.0, 0.0, 0.02, 0.0, 0.03]);
}

#[test]
fn a_model_that_is_not_spawned_has_a_name_fit_for_the_wire_and_no_layout() {
    let model = Arc::new(model());
    let info = entity::described(&ValidatedRobot { model, fixed: false, description: Sha256::of(b"") });
    assert_eq!((info.name.as_str(), info.model.as_str()), ("test_arm", "test arm"));
    assert_eq!((info.layout_version, info.base()), (0, v1::Base::Free));
}

#[test]
fn link_poses_are_seven_numbers_a_link() {
    let state = publish(&world(), 1);
    let (index, left) = state.state.entity("left").unwrap();
    let poses = entity::link_poses(&state.state, index, left).poses;
    assert_eq!(poses.len(), 5 * 7);
    assert_eq!(poses[..7], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(poses[7 + 2], 0.5);
}

#[test]
fn a_scene_lists_each_shape_with_its_link() {
    let state = publish(&world(), 1);
    let scene = scene::robot_scene(state.state.entity("left").unwrap().1);
    let links: Vec<_> = scene.visuals.iter().map(|shape| shape.link).collect();
    assert_eq!(links, [0, 1, 2, 3, 4]);
    assert!(scene.collisions.is_empty());
    let sphere = v1::shape::Geometry::Sphere(v1::SphereGeometry { radius: 0.1 });
    assert_eq!(scene.visuals[0].geometry, Some(sphere));
    assert_eq!(scene.visuals[0].color.unwrap().green, 0.5);
}

#[test]
fn flags_are_bits() {
    assert_eq!(joint::flags(Flags::default()), 0);
    assert_eq!(joint::flags(Flags { saturated: true, at_lower: false, at_upper: true }), 1 | 4);
    assert_eq!(joint::flags(Flags { saturated: false, at_lower: true, at_upper: false }), 2);
    assert_eq!(joint::mode(Mode::None), v1::JointMode::None);
}

#[test]
fn statistics_count_joints_that_can_move() {
    let state = publish(&world(), 1);
    let mut now = state.statistics;
    now.pace = Pace::AsFastAsPossible { factor: 1.0 };
    let statistics = simulation::statistics(&state, &now);
    assert_eq!((statistics.robots, statistics.joints), (2, 6));
    assert_eq!(statistics.target_real_time_factor, f64::INFINITY);
    assert_eq!(statistics.state(), v1::SimulationState::Paused);
}

#[test]
fn a_finding_without_a_line_has_line_zero() {
    let finding = Finding {
        file: Some("m.stl".into()),
        severity: Severity::Warning,
        disposition: Disposition::Repaired,
        element: "link \"a\"".into(),
        line: None,
        message: "m".into(),
    };
    let report = entity::report(LoadReport { findings: vec![finding] }, "one line".into());
    assert_eq!(report.summary, "one line");
    assert_eq!((report.findings[0].line, report.findings[0].file.as_str()), (0, "m.stl"));
    assert_eq!(report.findings[0].severity(), v1::Severity::Warning);
    assert_eq!(report.findings[0].disposition(), v1::Disposition::Repaired);
}
