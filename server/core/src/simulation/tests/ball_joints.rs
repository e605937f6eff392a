//! Commands for ball joints, and their effects.

use simd_model::setup::{DriveMode, JointSetup, Spring};

use super::*;
use crate::dynamics::spherical::{rotation_vector, turn};

fn ball() -> Arc<RobotModel> {
    arm_with(|joint| {
        joint.kind = JointKind::Spherical;
        joint.damping = 0.01;
        joint.parent_from_joint = DPose3::IDENTITY;
    })
}

fn reset(world: &mut Simulation, reset: JointReset) -> Result<Applied, Error> {
    let robots = vec![RobotReset { robot: "arm".into(), joints: vec![reset] }];
    world.apply(&Command::ResetJoints { robots })
}

fn at(orientation: DQuat, angular_velocity: DVec3) -> JointReset {
    let spherical = Some(SphericalReset { orientation, angular_velocity });
    JointReset { joint: "shoulder".into(), spherical, ..JointReset::default() }
}

fn orientation(seen: &PublishedState) -> DQuat {
    DQuat::from_slice(&seen.positions)
}

#[test]
fn a_ball_joint_has_a_quaternion_and_three_velocities() {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", ball()) });
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let seen = look(&world);
    assert_eq!(seen.positions, [0.0, 0.0, 0.0, 1.0, 0.0]);
    let layout = &seen.world.entities[0];
    assert_eq!((layout.joint_positions[0].clone(), layout.joint_velocities[0].clone()), (0..4, 0..3));
    assert_eq!(seen.world.entities[1].positions, 4..5);
    assert_eq!((seen.velocities.len(), seen.modes.len(), seen.flags.len()), (4, 4, 4));
    let there = turn(DVec3::new(0.4, -1.0, 2.0));
    reset(&mut world, at(there, DVec3::new(1.0, 2.0, 3.0))).unwrap();
    let seen = look(&world);
    assert!(orientation(&seen).angle_between(there) < 1e-14);
    assert_eq!(seen.velocities[..3], [1.0, 2.0, 3.0]);
    let pose = seen.link_poses(0).unwrap()[1];
    assert!(pose.rotation.angle_between(there) < 1e-7 && pose.translation == DVec3::ZERO);
}

#[test]
fn a_joint_that_holds_stays_where_it_was_put() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let there = turn(DVec3::new(1.4, -1.0, 0.7));
    reset(&mut world, at(there, DVec3::ZERO)).unwrap();
    let seen = run(&mut world, 2.0);
    assert!(orientation(&seen).angle_between(there) < 2e-3);
    assert!(seen.modes.iter().all(|mode| *mode == Mode::Hold));
    let held = DVec3::from_slice(&seen.targets);
    assert!((held - rotation_vector(there)).length() < 1e-12);
    world
        .apply(&Command::ResetJoints { robots: vec![RobotReset { robot: "arm".into(), joints: vec![] }] })
        .unwrap();
    let seen = run(&mut world, 1.0);
    assert!(orientation(&seen).angle_between(DQuat::IDENTITY) < 2e-3, "back to where it was spawned");
}

#[test]
fn an_orientation_is_reached_and_published_as_a_rotation_vector() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let target = turn(DVec3::new(-0.3, 2.0, 1.0));
    set(&mut world, Target::orientation(target)).unwrap();
    let seen = run(&mut world, 1.0);
    assert!(orientation(&seen).angle_between(target) < 2e-3);
    assert_eq!(seen.modes, [Mode::Position; 3]);
    assert!((DVec3::from_slice(&seen.targets) - rotation_vector(target)).length() < 1e-15);
    set(&mut world, Target::Hold).unwrap();
    assert_eq!(look(&world).modes, [Mode::Hold; 3], "all of it holds");
    let velocity = DVec3::new(0.0, 0.5, 1.0);
    let turning =
        Target::AngularVelocity { velocity, damping: None, feed_forward: DVec3::ZERO, max_effort: None };
    set(&mut world, turning).unwrap();
    let seen = run(&mut world, 0.5);
    assert!((DVec3::from_slice(&seen.velocities) - velocity).length() < 1e-2, "{:?}", seen.velocities);
    let torque = DVec3::new(1e-4, 0.0, -2e-4);
    set(&mut world, Target::Torque(torque)).unwrap();
    let seen = run(&mut world, 0.01);
    assert_eq!((&seen.efforts[..], &seen.targets[..]), (&torque.to_array()[..], &torque.to_array()[..]));
    set(&mut world, Target::Passive).unwrap();
    assert_eq!(look(&world).modes, [Mode::Passive; 3]);
}

/// The setpoint turns no faster than the velocity limit about any axis, and the effort limit holds about
/// each.
#[test]
fn limits_of_velocity_and_effort_hold_about_each_axis() {
    let model = arm_with(|joint| {
        joint.kind = JointKind::Spherical;
        joint.limits =
            JointLimits { lower: Some(-0.1), upper: Some(0.1), effort: Some(3.0), velocity: Some(1.0) };
    });
    let mut world = world_with(1e-3, spawn("arm", model));
    let settings = world.layout().entities[0].model.joints[0].limits;
    assert_eq!(settings.lower, Some(-0.1), "the model's own, of which the joint takes two");
    // The turn about its longest axis takes a second and a half.
    let target = turn(DVec3::new(0.5, -1.0, 1.5));
    set(&mut world, Target::orientation(target)).unwrap();
    for step in 1..=3_000 {
        world.step();
        let seen = look(&world);
        assert!(seen.efforts.iter().all(|effort| effort.abs() <= 3.0));
        if step == 1_200 {
            let left = orientation(&seen).angle_between(target);
            assert!((0.2..0.5).contains(&left), "{left}");
        }
    }
    assert!(orientation(&look(&world)).angle_between(target) < 2e-3);
}

#[test]
fn commands_that_do_not_fit_a_ball_joint_are_refused_and_change_nothing() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let before = world.fingerprint();
    let said = |result: Result<Applied, Error>| result.unwrap_err().to_string();
    let refusal = said(set(&mut world, position(0.5)));
    assert!(refusal.contains("it takes an orientation"), "{refusal}");
    let refusal = said(set(&mut world, Target::Effort(0.5)));
    assert!(refusal.contains("it takes a torque"), "{refusal}");
    let refusal = said(set(&mut world, Target::orientation(DQuat::from_xyzw(0.0, 0.0, 2.0, 0.0))));
    assert!(refusal.contains("unit length"), "{refusal}");
    let plain = JointReset { joint: "shoulder".into(), position: 0.5, ..JointReset::default() };
    let refusal = said(reset(&mut world, plain));
    assert!(refusal.contains("set to an orientation"), "{refusal}");
    let refusal = said(reset(&mut world, JointReset { axis: 1, ..at(DQuat::IDENTITY, DVec3::ZERO) }));
    assert!(refusal.contains("as a whole"), "{refusal}");
    let refusal = said(reset(&mut world, at(DQuat::IDENTITY, DVec3::splat(1e13))));
    assert!(refusal.contains("angular_velocity.x"), "{refusal}");
    let limits = Some(JointLimits { lower: Some(-1.0), upper: Some(1.0), ..JointLimits::default() });
    let joints = vec![JointProperties { joint: "shoulder".into(), limits, ..JointProperties::default() }];
    let refusal = said(world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }));
    assert!(refusal.contains("no limits of its position"), "{refusal}");
    let follow = FollowTrajectory {
        robot: "arm".into(),
        joints: vec!["shoulder".into()],
        points: Arc::new(vec![TrajectoryPoint {
            time: 1.0,
            positions: vec![0.0],
            ..TrajectoryPoint::default()
        }]),
        ..FollowTrajectory::default()
    };
    let refusal = said(world.apply(&Command::FollowTrajectory(follow)));
    assert!(refusal.contains("one axis"), "{refusal}");
    assert_eq!(world.fingerprint(), before);

    let mut world = world_with(1e-3, spawn("arm", arm()));
    let refusal = said(set(&mut world, Target::orientation(DQuat::IDENTITY)));
    assert!(refusal.contains("the joint is not spherical"), "{refusal}");
    let refusal = said(set(&mut world, Target::Torque(DVec3::X)));
    assert!(refusal.contains("the joint is not spherical"), "{refusal}");
    let refusal = said(reset(&mut world, at(DQuat::IDENTITY, DVec3::ZERO)));
    assert!(refusal.contains("the joint is not spherical"), "{refusal}");
    let start = vec![("shoulder".to_owned(), 0.3)];
    let refusal =
        world.apply(&Command::Spawn(Box::new(Spawn { joint_positions: start, ..spawn("ball", ball()) })));
    assert!(said(refusal).contains("name it in `joint_orientations`"));
}

fn start(orientation: DQuat) -> Vec<JointOrientation> {
    vec![JointOrientation { joint: "shoulder".into(), orientation }]
}

#[test]
fn a_ball_joint_starts_at_an_orientation_and_holds_it() {
    let there = turn(DVec3::new(0.4, -1.0, 0.7));
    let mut world = world_with(1e-3, Spawn { joint_orientations: start(there), ..spawn("arm", ball()) });
    let seen = look(&world);
    assert!(orientation(&seen).angle_between(there) < 1e-14);
    assert!((DVec3::from_slice(&seen.targets) - rotation_vector(there)).length() < 1e-14);
    assert!(orientation(&run(&mut world, 1.0)).angle_between(there) < 2e-3);
    // A reset of all joints returns there.
    reset(&mut world, at(DQuat::IDENTITY, DVec3::ZERO)).unwrap();
    world
        .apply(&Command::ResetJoints { robots: vec![RobotReset { robot: "arm".into(), joints: vec![] }] })
        .unwrap();
    assert!(orientation(&look(&world)).angle_between(there) < 1e-14);
}

#[test]
fn an_orientation_that_no_joint_can_start_at_is_refused() {
    let mut world = world_with(1e-3, spawn("first", ball()));
    let before = world.fingerprint();
    let mut said = |model, joint_orientations| {
        let spawn = Spawn { joint_orientations, ..spawn("second", model) };
        world.apply(&Command::Spawn(Box::new(spawn))).unwrap_err().to_string()
    };
    let refusal = said(arm(), start(DQuat::IDENTITY));
    assert!(refusal.contains("the joint is not spherical: name it in `joint_positions`"), "{refusal}");
    for wrong in [DQuat::from_xyzw(0.0, 0.0, 2.0, 0.0), DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)] {
        let refusal = said(ball(), start(wrong));
        assert!(refusal.contains("joint_orientations[\"shoulder\"]"), "{refusal}");
        assert!(refusal.contains("unit length"), "{refusal}");
    }
    let unknown = vec![JointOrientation { joint: "elbow".into(), orientation: DQuat::IDENTITY }];
    let refusal = said(ball(), unknown);
    assert!(refusal.contains("elbow"), "{refusal}");
    assert_eq!(world.fingerprint(), before);
}

/// Springs, gears and trajectories require joints of one axis: a ball joint is refused in one sentence.
#[test]
fn a_gear_of_a_ball_joint_is_refused() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let before = world.fingerprint();
    let joint = |robot: &str| RequestedEnd {
        robot: robot.into(),
        joint: "shoulder".into(),
        ..RequestedEnd::default()
    };
    for (parent, child, field) in
        [("arm", "other", "parent.joint"), ("other", "arm", "child.joint"), ("arm", "arm", "parent.joint")]
    {
        let create = CreateConstraint {
            name: String::new(),
            kind: RequestedConstraint::Gear { ratio: 2.0, offset: None },
            parent: joint(parent),
            child: joint(child),
            max_force: None,
            max_torque: None,
            breaks: false,
            disable_collisions: false,
        };
        let refusal = world.apply(&Command::CreateConstraint(Box::new(create))).unwrap_err().to_string();
        assert!(refusal.contains(field), "{refusal}");
        assert!(refusal.contains("a gear is of joints that turn or slide about one axis"), "{refusal}");
    }
    assert_eq!(world.fingerprint(), before);
}

#[test]
fn a_reload_keeps_the_orientation_and_its_target() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let target = turn(DVec3::new(0.3, 0.2, -1.0));
    set(&mut world, Target::orientation(target)).unwrap();
    let before = run(&mut world, 1.0);
    let reload =
        |model| Command::Reload(Box::new(Reload { robot: "arm".into(), model, shapes: Default::default() }));
    world.apply(&reload(ball())).unwrap();
    let seen = look(&world);
    assert_eq!((&seen.positions, &seen.targets), (&before.positions, &before.targets));
    // A joint of another type restarts.
    world.apply(&reload(arm())).unwrap();
    let seen = look(&world);
    assert_eq!((&seen.positions[..], seen.modes[0]), (&[0.0][..], Mode::Hold));
    world.apply(&reload(ball())).unwrap();
    assert_eq!(look(&world).positions, [0.0, 0.0, 0.0, 1.0]);
    assert!(run(&mut world, 1.0).positions.iter().all(|value| value.is_finite()));
}

#[test]
fn a_whole_target_has_three_numbers_for_a_ball_joint() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let mut whole = |whole| {
        let robots =
            vec![RobotTargets { robot: "arm".into(), whole: Some(whole), ..RobotTargets::default() }];
        world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() }))
    };
    assert!(whole(WholeTarget::Position(vec![0.0, 0.0, 0.0, 1.0])).is_err());
    assert!(whole(WholeTarget::Position(vec![1e300, 0.0, 0.0])).is_err());
    whole(WholeTarget::Position(vec![0.3, 0.4, 1.2])).unwrap();
    let seen = run(&mut world, 1.0);
    assert!(orientation(&seen).angle_between(turn(DVec3::new(0.3, 0.4, 1.2))) < 2e-3);
}

/// The weight of the link is held exactly, at any orientation and without a spring's sag.
#[test]
fn gravity_compensation_holds_a_ball_joint() {
    let mut world = world_with(1e-3, spawn("arm", ball()));
    let gravity_compensation = Some(true);
    let joints = vec![JointProperties {
        joint: "shoulder".into(),
        gravity_compensation,
        ..JointProperties::default()
    }];
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    let there = turn(DVec3::new(1.4, -1.0, 0.7));
    reset(&mut world, at(there, DVec3::ZERO)).unwrap();
    let seen = run(&mut world, 1.0);
    assert!(orientation(&seen).angle_between(there) < 1e-7);
}

fn sprung(stiffness: f64, rest: f64) -> Command {
    let joint = JointProperties {
        joint: "shoulder".into(),
        spring: Some((stiffness, rest)),
        ..JointProperties::default()
    };
    Command::SetJointProperties { robot: "arm".into(), joints: vec![joint] }
}

/// The link turns about one of its principal axes: I theta'' = -k theta.
#[test]
fn a_spring_turns_a_ball_joint_to_and_fro_as_it_would_a_hinge() {
    let sphere = arm_with(|joint| {
        joint.kind = JointKind::Spherical;
        joint.parent_from_joint = DPose3::IDENTITY;
    });
    let mut sphere = RobotModel::clone(&sphere);
    let inertial = &mut sphere.links[1].inertial;
    (inertial.mass, inertial.center_of_mass) = (2.0, DVec3::ZERO);
    inertial.inertia = DMat3::from_diagonal(DVec3::splat(0.1));
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", Arc::new(sphere)) });
    world.apply(&sprung(10.0, 0.0)).unwrap();
    let axis = DVec3::new(0.6, -0.48, 0.64);
    reset(&mut world, at(turn(axis * 0.5), DVec3::ZERO)).unwrap();
    let seen = run(&mut world, 1.0);
    // The frequency is 10 rad/s.
    let expected = axis * (0.5 * 10.0_f64.cos());
    let vector = rotation_vector(orientation(&seen));
    assert!((vector - expected).length() < 2e-4, "{vector}, not {expected}");
    let velocity = DVec3::from_slice(&seen.velocities);
    assert!((velocity + axis * (5.0 * 10.0_f64.sin())).length() < 2e-3, "{velocity}");
}

#[test]
fn a_spring_of_a_ball_joint_is_at_rest_at_no_turn_alone() {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", ball()) });
    let refused = world.apply(&sprung(3.0, 0.1)).unwrap_err().to_string();
    assert!(refused.contains("spring.rest") && refused.contains("0 0 0 1"), "{refused}");
    world.apply(&sprung(3.0, 0.0)).unwrap();
}

#[test]
fn a_description_gives_a_ball_joint_a_spring_and_a_rotor() {
    let mut model = RobotModel::clone(&ball());
    let setup = JointSetup {
        armature: 0.2,
        spring: Some(Spring { stiffness: 4.0, rest: 0.0 }),
        mode: Some(DriveMode::Passive),
        ..JointSetup::default()
    };
    model.setup.joints.push(setup);
    let world = world_with(1e-3, spawn("arm", Arc::new(model)));
    assert_eq!(look(&world).modes, [Mode::Passive; 3]);
    for axis in world.entities[0].body.axes() {
        assert_eq!((axis.settings.armature, axis.settings.spring_stiffness), (0.2, 4.0));
    }
}
