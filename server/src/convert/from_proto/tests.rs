//! What a request may say, and how what it may not is named.

use std::time::Duration;

use glamx::{DQuat, DVec3};
use simd_core::Command;
use simd_core::simulation::command::{Target, WholeTarget, WrenchDuration};
use simd_proto::v1;

use super::{entity, geometry, joint, simulation, state};
use crate::convert::field::{BadField, Path};
use crate::convert::test_world;
use crate::handle::{Pace, RunState, Source};

/// The path of the field that is to blame.
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
fn a_push_needs_a_wrench_and_acts_at_the_links_origin_where_nothing_else_is_said() {
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
    assert_eq!(pace(&nothing), present);

    let factor = v1::SetPhysicsRequest { real_time_factor: Some(0.5), ..nothing.clone() };
    assert_eq!(pace(&factor), Pace::AsFastAsPossible { factor: 0.5 });
    let real_time = v1::SetPhysicsRequest { pace: v1::PaceMode::RealTime.into(), ..nothing.clone() };
    assert_eq!(pace(&real_time), Pace::RealTime { factor: 2.0 });

    assert_eq!(blamed(change(&v1::SetPhysicsRequest { pace: 9, ..nothing })), "pace");
}

/// The path that a world blames for what convert let through: one judge for each number.
fn judged(command: Command) -> String {
    match test_world::simulation().apply(&command) {
        Err(simd_core::Error::InvalidValue { element, .. }) => element,
        other => panic!("{other:?}"),
    }
}

fn for_left(joints: Vec<v1::JointTarget>, whole: Option<v1::WholeRobotTarget>) -> Command {
    let robots = vec![
        v1::RobotTargets { robot: "right".into(), ..Default::default() },
        v1::RobotTargets { robot: "left".into(), joints, whole, ..Default::default() },
    ];
    Command::SetTargets(joint::set_targets(robots, 0).unwrap())
}

#[test]
fn numbers_of_targets_are_refused_by_the_world_under_the_path_of_their_field() {
    use v1::joint_target::Target as Wire;
    let of = |target| v1::JointTarget { joint: "slide".into(), axis: 0, target: Some(target) };
    let fine = || position_target("shoulder", 0.0);
    let with = |target| judged(for_left(vec![fine(), of(target)], None));
    let position = |target| with(Wire::Position(target));
    let velocity = |target| with(Wire::Velocity(target));
    type Position = v1::PositionTarget;
    for (target, field) in [
        (Position { position: f64::NAN, ..Default::default() }, "position"),
        (Position { velocity: f64::INFINITY, ..Default::default() }, "velocity"),
        (Position { stiffness: Some(-1.0), ..Default::default() }, "stiffness"),
        (Position { damping: Some(f64::NAN), ..Default::default() }, "damping"),
        (Position { feed_forward_effort: f64::NAN, ..Default::default() }, "feed_forward_effort"),
        (Position { max_effort: Some(-1.0), ..Default::default() }, "max_effort"),
        (Position { max_velocity: Some(f64::INFINITY), ..Default::default() }, "max_velocity"),
    ] {
        assert_eq!(position(target), format!("robots[1].joints[1].position.{field}"));
    }
    type Velocity = v1::VelocityTarget;
    for (target, field) in [
        (Velocity { velocity: f64::NAN, ..Default::default() }, "velocity"),
        (Velocity { damping: Some(-1.0), ..Default::default() }, "damping"),
        (Velocity { feed_forward_effort: f64::INFINITY, ..Default::default() }, "feed_forward_effort"),
        (Velocity { max_effort: Some(-1.0), ..Default::default() }, "max_effort"),
    ] {
        assert_eq!(velocity(target), format!("robots[1].joints[1].velocity.{field}"));
    }
    let effort = v1::EffortTarget { effort: f64::NAN };
    assert_eq!(with(Wire::Effort(effort)), "robots[1].joints[1].effort.effort");
    let axis = v1::JointTarget { axis: 3, ..position_target("puck", 0.0) };
    assert_eq!(judged(for_left(vec![fine(), axis], None)), "robots[1].joints[1].axis");

    let whole = |values: Vec<f64>| {
        judged(for_left(
            Vec::new(),
            Some(v1::WholeRobotTarget { mode: v1::JointMode::Position.into(), values }),
        ))
    };
    assert_eq!(whole(vec![0.0, 0.0, f64::NAN, 0.0, 0.0]), "robots[1].whole.values[2]");
    assert_eq!(whole(vec![0.0]), "robots[1].whole.values");
}

#[test]
fn numbers_of_joints_are_refused_by_the_world_under_the_path_of_their_field() {
    let properties = |given| {
        let fine = v1::JointProperties { joint: "shoulder".into(), ..Default::default() };
        let joints = vec![fine, v1::JointProperties { joint: "slide".into(), ..given }];
        let request = v1::SetJointPropertiesRequest { robot: "left".into(), joints, ..Default::default() };
        judged(joint::set_joint_properties(request).unwrap())
    };
    let gains = |stiffness, damping| Some(v1::JointGains { stiffness, damping });
    let limits = |lower, upper, effort, velocity| {
        let limits = Some(v1::JointLimits { lower, upper, effort, velocity });
        v1::JointProperties { limits, ..Default::default() }
    };
    for (given, field) in [
        (v1::JointProperties { damping: Some(-1.0), ..Default::default() }, "damping"),
        (v1::JointProperties { friction: Some(f64::NAN), ..Default::default() }, "friction"),
        (v1::JointProperties { armature: Some(f64::INFINITY), ..Default::default() }, "armature"),
        (
            v1::JointProperties { default_gains: gains(-1.0, 1.0), ..Default::default() },
            "default_gains.stiffness",
        ),
        (
            v1::JointProperties { default_gains: gains(1.0, f64::NAN), ..Default::default() },
            "default_gains.damping",
        ),
        (limits(Some(1.0), Some(0.0), None, None), "limits.lower"),
        (limits(None, Some(f64::NAN), None, None), "limits.upper"),
        (limits(None, None, Some(-1.0), None), "limits.effort"),
        (limits(None, None, None, Some(f64::NAN)), "limits.velocity"),
    ] {
        assert_eq!(properties(given), format!("joints[1].{field}"));
    }
    let reset = |axis, position, velocity| {
        let put = v1::JointReset { joint: "slide".into(), axis, position, velocity, spherical: None };
        let robots = vec![v1::RobotReset { robot: "left".into(), joints: vec![put] }];
        judged(joint::reset_joints(v1::ResetJointsRequest { robots, ..Default::default() }).unwrap())
    };
    assert_eq!(reset(0, f64::NAN, 0.0), "robots[0].joints[0].position");
    assert_eq!(reset(0, 1e300, 0.0), "robots[0].joints[0].position");
    assert_eq!(reset(0, 0.0, f64::INFINITY), "robots[0].joints[0].velocity");
    assert_eq!(reset(7, 0.0, 0.0), "robots[0].joints[0].axis");
}

#[test]
fn numbers_of_robots_and_physics_are_refused_by_the_world_under_the_path_of_their_field() {
    let vector = |x, y, z| Some(v1::Vector3 { x, y, z });
    let state = |pose, twist| {
        let request = v1::SetEntityStateRequest { robot: "left".into(), pose, twist, ..Default::default() };
        judged(entity::set_entity_state(request).unwrap())
    };
    let pose = v1::Pose { position: vector(0.0, 0.0, f64::INFINITY), orientation: None };
    assert_eq!(state(Some(pose), None), "pose.position.z");
    let twist = |linear, angular| state(None, Some(v1::Twist { linear, angular }));
    assert_eq!(twist(vector(f64::NAN, 0.0, 0.0), None), "twist.linear.x");
    assert_eq!(twist(None, vector(0.0, 1e200, 0.0)), "twist.angular");
    assert_eq!(twist(vector(1.0, 0.0, 0.0), None), "twist");

    let wrench = |force, torque, point, duration| {
        let request = v1::ApplyLinkWrenchRequest {
            robot: "left".into(),
            link: "link_1".into(),
            wrench: Some(v1::Wrench { force, torque }),
            point,
            duration,
            ..Default::default()
        };
        judged(entity::link_wrench(request).unwrap())
    };
    assert_eq!(wrench(vector(0.0, f64::NAN, 0.0), None, None, 0.0), "wrench.force.y");
    assert_eq!(wrench(None, vector(0.0, 0.0, f64::INFINITY), None, 0.0), "wrench.torque.z");
    assert_eq!(wrench(None, None, vector(f64::NAN, 0.0, 0.0), 0.0), "point.x");
    for duration in [-1.0, f64::NAN, 3601.0] {
        assert_eq!(wrench(None, None, None, duration), "duration");
    }

    let surface = |friction, restitution| {
        let links = vec![v1::LinkProperties { friction, restitution, ..Default::default() }];
        let request = v1::SetLinkPropertiesRequest { robot: "left".into(), links, ..Default::default() };
        judged(entity::set_link_properties(request).unwrap())
    };
    assert_eq!(surface(Some(-1.0), None), "links[0].friction");
    assert_eq!(surface(None, Some(1.5)), "links[0].restitution");
    for (bad, rolls) in [(-0.1, true), (f64::NAN, true), (f64::INFINITY, false)] {
        let links = vec![v1::LinkProperties {
            rolling_friction: rolls.then_some(bad),
            spinning_friction: (!rolls).then_some(bad),
            ..Default::default()
        }];
        let request = v1::SetLinkPropertiesRequest { robot: "left".into(), links, ..Default::default() };
        let field = if rolls { "links[0].rolling_friction" } else { "links[0].spinning_friction" };
        assert_eq!(judged(entity::set_link_properties(request).unwrap()), field);
    }

    for (stiffness, damping) in [(-1.0, 0.0), (1e-9, 0.0), (f64::INFINITY, 0.0), (1e3, -1.0), (1e3, f64::NAN)]
    {
        let links = vec![v1::LinkProperties {
            contact_stiffness: Some(stiffness),
            contact_damping: Some(damping),
            ..Default::default()
        }];
        let request = v1::SetLinkPropertiesRequest { robot: "left".into(), links, ..Default::default() };
        let field = if stiffness == 1e3 { "links[0].contact_damping" } else { "links[0].contact_stiffness" };
        assert_eq!(judged(entity::set_link_properties(request).unwrap()), field);
    }

    let physics = |request: &v1::SetPhysicsRequest| {
        judged(Command::SetPhysics(simulation::physics_change(request).unwrap().0))
    };
    let nothing = v1::SetPhysicsRequest::default();
    let gravity = vector(f64::NAN, 0.0, 0.0);
    assert_eq!(physics(&v1::SetPhysicsRequest { gravity, ..nothing.clone() }), "gravity.x");
    assert_eq!(physics(&v1::SetPhysicsRequest { time_step: Some(0.0), ..nothing.clone() }), "time_step");
    assert_eq!(physics(&v1::SetPhysicsRequest { substeps: Some(0), ..nothing }), "substeps");
}
