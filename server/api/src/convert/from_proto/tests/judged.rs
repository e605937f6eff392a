//! Numbers that conversion accepts and the world refuses, under the path of their field.

use super::*;

/// Returns the path that a world names for a number that conversion accepted: each number is checked in one
/// place only.
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
    assert_eq!(twist(None, vector(0.0, 1e200, 0.0)), "twist.angular.y");
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
