//! Accepted requests, and the field names in refusals.

mod judged;

use std::time::Duration;

use glamx::{DQuat, DVec3};
use simd_core::Command;
use simd_core::simulation::command::{Target, WholeTarget, WrenchDuration};
use simd_proto::v1;

use super::{entity, geometry, joint, simulation, state};
use crate::convert::field::{BadField, Path};
use crate::convert::test_world;
use simd_world::handle::{Pace, RunState, Source};

/// Returns the path of the refused field.
fn blamed<T: std::fmt::Debug>(refused: Result<T, BadField>) -> String {
    refused.unwrap_err().field
}

fn position_target(joint: &str, position: f64) -> v1::JointTarget {
    let target = v1::PositionTarget { position, ..Default::default() };
    v1::JointTarget { joint: joint.into(), axis: 0, target: Some(v1::joint_target::Target::Position(target)) }
}

fn for_arm(joints: Vec<v1::JointTarget>) -> Vec<v1::RobotTargets> {
    vec![v1::RobotTargets { robot: "arm".into(), joints, ..Default::default() }]
}

fn whole(mode: v1::JointMode, values: Vec<f64>) -> Vec<v1::RobotTargets> {
    let whole = Some(v1::WholeRobotTarget { mode: mode.into(), values });
    vec![v1::RobotTargets { robot: "arm".into(), whole, ..Default::default() }]
}

#[test]
fn targets_keep_their_numbers_and_absent_gains_stay_absent() {
    let targets = joint::set_targets(for_arm(vec![position_target("elbow", 0.5)]), 0).unwrap();
    assert!(!targets.refuse_beyond_limits);
    assert_eq!(targets.robots[0].robot, "arm");
    assert_eq!(targets.robots[0].joints[0].target, Target::position(0.5));
    let targets = joint::set_targets(whole(v1::JointMode::Effort, vec![1.0, 2.0]), 2).unwrap();
    assert!(targets.refuse_beyond_limits);
    assert_eq!(targets.robots[0].whole, Some(WholeTarget::Effort(vec![1.0, 2.0])));
}

#[test]
fn a_target_that_cannot_be_is_refused_by_its_path() {
    let refused = |joints| blamed(joint::set_targets(for_arm(joints), 0));
    let fine = || position_target("elbow", 0.0);
    assert_eq!(refused(vec![position_target("", 0.0)]), "robots[0].joints[0].joint");
    assert_eq!(refused(vec![v1::JointTarget { target: None, ..fine() }]), "robots[0].joints[0].target");
    assert_eq!(refused(vec![fine(), fine()]), "robots[0].joints[1]");
}

#[test]
fn the_axes_of_a_planar_joint_are_not_the_same_joint_twice() {
    let axis = |axis| v1::JointTarget { axis, ..position_target("puck", 0.0) };
    assert!(joint::set_targets(for_arm(vec![axis(0), axis(1), axis(2)]), 0).is_ok());
    assert!(joint::set_targets(for_arm(vec![axis(1), axis(1)]), 0).is_err());
}

#[test]
fn a_whole_target_has_a_mode_that_can_be_asked_for_and_the_values_it_needs() {
    let refused = |robots| blamed(joint::set_targets(robots, 0));
    assert_eq!(refused(whole(v1::JointMode::Unspecified, vec![])), "robots[0].whole.mode");
    assert_eq!(refused(whole(v1::JointMode::None, vec![])), "robots[0].whole.mode");
    assert_eq!(refused(whole(v1::JointMode::Hold, vec![0.0])), "robots[0].whole.values");
    let robots = vec![v1::RobotTargets {
        robot: "arm".into(),
        whole: Some(v1::WholeRobotTarget { mode: 99, values: vec![] }),
        ..Default::default()
    }];
    assert_eq!(refused(robots), "robots[0].whole.mode");
    assert_eq!(blamed(joint::set_targets(vec![], 9)), "limit_policy");
    assert_eq!(blamed(joint::set_joint_targets(v1::SetJointTargetsRequest::default())), "robots");
}

#[test]
fn a_reset_without_joints_is_of_the_whole_robot() {
    let robots = vec![v1::RobotReset { robot: "arm".into(), joints: vec![] }];
    let request = v1::ResetJointsRequest { robots, ..Default::default() };
    let Command::ResetJoints { robots } = joint::reset_joints(request).unwrap() else { panic!() };
    assert!(robots[0].joints.is_empty());
}

#[test]
fn a_claim_names_joints_a_holder_and_a_lease() {
    let claim = |robot: &str, holder: &str, lease| {
        joint::claim_joints(v1::ClaimJointsRequest {
            selections: vec![v1::JointSelection { robot: robot.into(), joints: vec![] }],
            holder: holder.into(),
            lease,
            ..Default::default()
        })
    };
    let nothing = v1::ClaimJointsRequest { holder: "me".into(), ..Default::default() };
    assert_eq!(blamed(joint::claim_joints(nothing.clone())), "selections");
    joint::claim_joints(v1::ClaimJointsRequest { world: true, ..nothing }).unwrap();
    assert_eq!(claim("arm", "me", 0.0).unwrap().1, Duration::from_secs(10));
    assert_eq!(blamed(claim("", "me", 0.0)), "selections[0].robot");
    assert_eq!(blamed(claim("arm", "", 0.0)), "holder");
    for lease in [-1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(blamed(claim("arm", "me", lease)), "lease");
    }
}

#[test]
fn selections_name_each_robot_and_joint_once() {
    let select = |robot: &str, joints: &[&str]| v1::JointSelection {
        robot: robot.into(),
        joints: joints.iter().map(|name| (*name).into()).collect(),
    };
    assert_eq!(state::selections(vec![select("a", &["x", "y"]), select("b", &[])]).unwrap().len(), 2);
    assert_eq!(blamed(state::selections(vec![select("a", &[]), select("a", &["x"])])), "selections[1]");
    assert_eq!(blamed(state::selections(vec![select("a", &["x", "x"])])), "selections[0].joints[1]");
    assert_eq!(blamed(state::selections(vec![select("a", &[""])])), "selections[0].joints[0]");
}

#[test]
fn times_and_rates_have_defaults_and_bounds() {
    assert_eq!(state::control_timeout(0.0).unwrap(), None);
    assert_eq!(state::control_timeout(0.5).unwrap(), Some(Duration::from_millis(500)));
    assert_eq!(blamed(state::control_timeout(-1.0)), "timeout");
    assert_eq!(state::next_timeout(0.0).unwrap(), Duration::from_secs(1));
    assert_eq!(blamed(state::next_timeout(61.0)), "timeout");
    assert_eq!(state::period(0.0).unwrap(), Duration::from_secs_f64(1.0 / 30.0));
    assert_eq!(state::period(1000.0).unwrap(), Duration::from_millis(1));
    assert_eq!(blamed(state::period(1001.0)), "rate");
    assert_eq!(blamed(state::wait(3)), "wait");
}

#[test]
fn a_quaternion_of_any_length_is_a_rotation_and_of_none_is_none() {
    let at = Path::ROOT.field("pose");
    let rotation = |x, y, z, w| geometry::rotation(&at, v1::Quaternion { x, y, z, w });
    assert_eq!(rotation(0.0, 0.0, 0.0, 0.0), Ok(DQuat::IDENTITY));
    for length in [1e-300, 1.0, 3.0, 1e300] {
        let turned = rotation(0.0, 0.0, length, length).unwrap();
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        assert!(turned.angle_between(quarter) < 1e-7, "{length}");
        assert!((turned.length() - 1.0).abs() < 1e-15);
    }
    assert_eq!(blamed(rotation(0.0, f64::NAN, 0.0, 1.0)), "pose.y");
}

#[test]
fn a_spawn_request_is_read_with_its_defaults() {
    let source = v1::description_source::Source::Urdf(b"<robot/>".to_vec());
    let source = v1::DescriptionSource { source: Some(source), ..Default::default() };
    let request = v1::SpawnEntityRequest { source: Some(source), ..Default::default() };
    let spawn = entity::spawn(request.clone()).unwrap();
    assert!(matches!(spawn.source, Source::Inline { .. }));
    assert_eq!((spawn.fixed_base, spawn.passive, spawn.scale), (None, false, 1.0));
    assert_eq!(spawn.pose, glamx::DPose3::IDENTITY);

    let refused = |request| blamed(entity::spawn(request));
    assert_eq!(refused(v1::SpawnEntityRequest::default()), "source");
    let empty = Some(v1::DescriptionSource::default());
    assert_eq!(refused(v1::SpawnEntityRequest { source: empty, ..Default::default() }), "source.source");
    assert_eq!(refused(v1::SpawnEntityRequest { base: 3, ..request.clone() }), "base");
    assert_eq!(refused(v1::SpawnEntityRequest { initial_mode: -1, ..request.clone() }), "initial_mode");
}

#[test]
fn digests_are_64_hexadecimal_digits() {
    let source = v1::description_source::Source::Description("12".into());
    let source = v1::DescriptionSource { source: Some(source), ..Default::default() };
    assert_eq!(blamed(entity::source(&Path::ROOT.field("source"), Some(source))), "source.description");
    let assets = [("package://a/b.stl".to_owned(), "zz".to_owned())].into();
    assert_eq!(blamed(entity::assets(&Path::ROOT, assets)), "assets[\"package://a/b.stl\"]");
}

#[test]
fn a_wrench_must_not_be_empty_and_acts_at_the_links_origin_by_default() {
    let force = Some(v1::Vector3 { x: 1.0, y: 2.0, z: 3.0 });
    let request = v1::ApplyLinkWrenchRequest {
        robot: "arm".into(),
        link: "hand".into(),
        wrench: Some(v1::Wrench { force, torque: None }),
        frame: v1::WrenchFrame::Link.into(),
        ..Default::default()
    };
    let Command::ApplyWrench(wrench) = entity::link_wrench(request.clone()).unwrap() else { panic!() };
    assert_eq!(wrench.force, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!((wrench.torque, wrench.point, wrench.in_link_axes), (DVec3::ZERO, DVec3::ZERO, true));
    assert_eq!(wrench.duration, WrenchDuration::NextStep);
    let parsed = |duration, persistent| {
        let request = v1::ApplyLinkWrenchRequest { duration, persistent, ..request.clone() };
        entity::link_wrench(request).map(|command| match command {
            Command::ApplyWrench(wrench) => wrench.duration,
            _ => panic!(),
        })
    };
    assert_eq!(parsed(0.0, true), Ok(WrenchDuration::UntilCleared));
    assert_eq!(parsed(0.2, false), Ok(WrenchDuration::For(0.2)));
    assert_eq!(blamed(parsed(0.2, true)), "duration");
    let without = v1::ApplyLinkWrenchRequest { wrench: None, ..request.clone() };
    assert_eq!(blamed(entity::link_wrench(without)), "wrench");
    assert_eq!(
        blamed(entity::link_wrench(v1::ApplyLinkWrenchRequest { link: String::new(), ..request })),
        "link"
    );
}

#[test]
fn a_state_is_one_of_three() {
    let state = |state| simulation::run_state(&v1::SetSimulationStateRequest { state, ..Default::default() });
    assert_eq!(state(v1::SimulationState::Playing.into()), Ok(RunState::Playing));
    assert_eq!(blamed(state(0)), "state");
    assert_eq!(blamed(state(17)), "state");
}

#[test]
fn physics_that_are_not_given_stay() {
    let present = Pace::AsFastAsPossible { factor: 2.0 };
    let change = |request: &v1::SetPhysicsRequest| simulation::physics_change(request);
    let pace = |request| change(request).unwrap().1.of(present);
    let nothing = v1::SetPhysicsRequest::default();
    let (physics, _) = change(&nothing).unwrap();
    assert_eq!((physics.gravity, physics.time_step, physics.substeps), (None, None, None));
    assert_eq!(physics.integrator, None);
    let euler = v1::SetPhysicsRequest { integrator: v1::Integrator::Euler.into(), ..nothing.clone() };
    assert_eq!(change(&euler).unwrap().0.integrator, Some(simd_core::Integrator::Euler));
    let contacts = v1::BulletContacts { slop: Some(0.001), ..Default::default() };
    let bullet = v1::SetPhysicsRequest {
        integrator: v1::Integrator::Bullet.into(),
        bullet_contacts: Some(contacts),
        ..nothing.clone()
    };
    let law = simd_core::BulletContacts { slop: 0.001, ..Default::default() };
    assert_eq!(change(&bullet).unwrap().0.integrator, Some(simd_core::Integrator::Bullet(law)));
    let alone = v1::SetPhysicsRequest { bullet_contacts: Some(contacts), ..nothing.clone() };
    assert_eq!(blamed(change(&alone)), "bullet_contacts");
    assert_eq!(pace(&nothing), present);

    let factor = v1::SetPhysicsRequest { real_time_factor: Some(0.5), ..nothing.clone() };
    assert_eq!(pace(&factor), Pace::AsFastAsPossible { factor: 0.5 });
    let real_time = v1::SetPhysicsRequest { pace: v1::PaceMode::RealTime.into(), ..nothing.clone() };
    assert_eq!(pace(&real_time), Pace::RealTime { factor: 2.0 });

    assert_eq!(blamed(change(&v1::SetPhysicsRequest { pace: 9, ..nothing })), "pace");
}
