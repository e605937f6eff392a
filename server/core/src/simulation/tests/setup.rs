//! Initial setup of robots from their descriptions, and simultaneous spawning.

use simd_model::setup::{
    ConstraintEnd, ConstraintOn, DriveMode, JointSetup, LinkConstraint, LinkConstraintKind, Setup, Spring,
};

use super::*;

/// Returns the arm with this setup of its joint.
fn arm_that(setup: JointSetup) -> Arc<RobotModel> {
    let mut model = RobotModel::clone(&arm());
    model.setup = Setup { joints: vec![setup], ..Setup::default() };
    Arc::new(model)
}

fn axis(world: &Simulation) -> &crate::dynamics::Axis {
    let body = &world.entities[0].body;
    let index = body.tree().joints[0].clone().next().unwrap();
    &body.axes()[body.tree().bodies[index].velocity]
}

#[test]
fn a_joint_starts_where_and_as_its_description_says() {
    let setup = JointSetup {
        armature: 0.01,
        position: Some(0.5),
        stiffness: Some(40.0),
        damping: Some(2.0),
        ..JointSetup::default()
    };
    let world = world_with(1e-3, spawn("arm", arm_that(setup)));
    let seen = look(&world);
    assert_eq!(seen.positions, [0.5]);
    let axis = axis(&world);
    assert_eq!(axis.actuator.mode, crate::dynamics::Mode::Hold);
    assert_eq!(axis.actuator.target, 0.5);
    let settings = &axis.settings;
    assert_eq!((settings.armature, settings.default_stiffness, settings.default_damping), (0.01, 40.0, 2.0));
}

#[test]
fn requested_settings_override_the_description() {
    let setup = JointSetup { position: Some(0.5), ..JointSetup::default() };
    let asked = Spawn { joint_positions: vec![("shoulder".into(), 0.2)], ..spawn("arm", arm_that(setup)) };
    assert_eq!(look(&world_with(1e-3, asked)).positions, [0.2]);
}

#[test]
fn modes_are_the_descriptions_unless_nothing_is_to_be_driven() {
    use crate::dynamics::Mode;
    for (said, driven, passive) in [
        (DriveMode::Passive, Mode::Passive, Mode::Passive),
        (DriveMode::Velocity, Mode::Velocity, Mode::Passive),
        (DriveMode::Effort, Mode::Effort, Mode::Passive),
    ] {
        let setup = JointSetup { mode: Some(said), stiffness: Some(5.0), ..JointSetup::default() };
        for (asked, expected) in [(false, driven), (true, passive)] {
            let world = world_with(1e-3, Spawn { passive: asked, ..spawn("arm", arm_that(setup)) });
            assert_eq!(axis(&world).actuator.mode, expected, "{said:?}, passive: {asked}");
        }
    }
}

/// Returns the shoulder with a spring that is far stronger than its actuator.
fn sprung(mode: DriveMode) -> Simulation {
    let spring = Some(Spring { stiffness: 50.0, rest: 0.3 });
    let mut model =
        RobotModel::clone(&arm_that(JointSetup { spring, mode: Some(mode), ..JointSetup::default() }));
    model.joints[0].limits.effort = Some(1e-3);
    model.joints[0].limits.velocity = Some(1e-3);
    world_with(1e-3, spawn("arm", Arc::new(model)))
}

#[test]
fn a_spring_swings_about_its_rest_whatever_the_limits_of_the_actuator() {
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let mut world = sprung(DriveMode::Passive);
        let physics = PhysicsChange {
            integrator: Some(integrator),
            gravity: Some(DVec3::ZERO),
            ..PhysicsChange::default()
        };
        world.apply(&Command::SetPhysics(physics)).unwrap();
        let inertia = axis(&world).settings.composite_inertia;
        let omega = (50.0 / inertia).sqrt();
        assert!(omega < 100.0, "resolved by the step: {omega}");
        let quarter = (std::f64::consts::FRAC_PI_2 / omega / 1e-3).round();
        run(&mut world, quarter * 1e-3);
        let closed = 0.3 - 0.3 * (omega * quarter * 1e-3).cos();
        let there = look(&world).positions[0];
        assert!((there - closed).abs() < 0.05, "{integrator:?}: {there} for {closed}");
    }
}

#[test]
fn a_target_leaves_the_spring_as_it_is() {
    let mut world = sprung(DriveMode::Effort);
    let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target: Target::Effort(0.0) }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).unwrap();
    let settings = &axis(&world).settings;
    assert_eq!((settings.spring_stiffness, settings.spring_rest), (50.0, 0.3));
    run(&mut world, 1e-3);
    assert!(look(&world).positions[0] > 0.0, "it pulls towards its rest");
}

#[test]
fn a_renamed_robot_gets_the_smallest_number_that_is_free() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    for name in ["arm_1", "arm_3", "arm_02", "arm_4x", "arm_", "army_2", "arm_99999999999999999999"] {
        world.apply(&Command::Spawn(Box::new(spawn(name, arm())))).unwrap();
    }
    let renamed = || Spawn { allow_renaming: true, ..spawn("arm", arm()) };
    for expected in ["arm_2", "arm_4", "arm_5"] {
        let applied = world.apply(&Command::Spawn(Box::new(renamed()))).unwrap();
        assert_eq!(applied.reply, Reply::Spawned { name: expected.into() });
    }
    let applied = world.apply(&Command::SpawnAll(vec![renamed(), renamed()])).unwrap();
    assert_eq!(applied.reply, Reply::SpawnedAll { names: vec!["arm_6".into(), "arm_7".into()] });
}

#[test]
fn several_robots_come_at_one_moment_or_none_of_them() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let before = world.fingerprint();
    let both = |names: [&str; 2]| Command::SpawnAll(names.map(|name| spawn(name, arm())).into());
    for refused in [["a", "arm"], ["a", "a"], ["a", "no name"]] {
        world.apply(&both(refused)).unwrap_err();
        assert_eq!((world.fingerprint(), world.entities.len()), (before, 1), "{refused:?}");
    }
    let applied = world.apply(&both(["a", "b"])).unwrap();
    assert_eq!(applied.reply, Reply::SpawnedAll { names: vec!["a".into(), "b".into()] });
    let versions: Vec<u64> = world.entities.iter().map(|entity| entity.version).collect();
    assert!(versions.windows(2).all(|pair| pair[0] < pair[1]), "{versions:?}");
    let renamed = [spawn("a", arm()), spawn("a", arm())];
    let renamed = renamed.map(|spawn| Spawn { allow_renaming: true, ..spawn }).into();
    let applied = world.apply(&Command::SpawnAll(renamed)).unwrap();
    assert_eq!(applied.reply, Reply::SpawnedAll { names: vec!["a_1".into(), "a_2".into()] });
}

/// Returns a single box with a constraint to each of `others`.
fn held_to(name: &str, others: impl IntoIterator<Item = ConstraintOn>) -> Arc<RobotModel> {
    let inertia = DMat3::from_diagonal(DVec3::splat(0.1));
    let inertial = Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia };
    let held = |on: ConstraintOn| LinkConstraint {
        name: "held".into(),
        kind: LinkConstraintKind::Weld,
        ends: [on, ConstraintOn::Own(0)].map(|on| ConstraintEnd { on, pose: Some(DPose3::IDENTITY) }),
        max_force: None,
        max_torque: None,
        collisions: false,
    };
    let setup = Setup { constraints: others.into_iter().map(held).collect(), ..Setup::default() };
    let links = vec![link("box", inertial)];
    Arc::new(RobotModel { name: name.into(), links, setup, ..RobotModel::default() })
}

fn free(name: &str, model: Arc<RobotModel>, z: f64) -> Spawn {
    let pose = DPose3::from_translation(DVec3::Z * z);
    Spawn { fixed_base: Some(false), pose, ..spawn(name, model) }
}

fn constraint_names(world: &Simulation) -> Vec<String> {
    world.constraints.list.iter().map(|of| of.definition.name.clone()).collect()
}

fn height(world: &Simulation, robot: usize) -> f64 {
    world.entities[robot].body.root_pose().translation.z
}

#[test]
fn constraints_of_a_description_hold_from_the_first_step_on() {
    let mut world = world_with(1e-3, free("hung", held_to("a", [ConstraintOn::World]), 2.0));
    assert_eq!(constraint_names(&world), ["hung_held"]);
    world.apply(&Command::Spawn(Box::new(free("falls", held_to("b", []), 5.0)))).unwrap();
    run(&mut world, 0.2);
    assert!((height(&world, 0) - 2.0).abs() < 1e-9, "{}", height(&world, 0));
    assert!(height(&world, 1) < 4.9, "one without it falls");
}

#[test]
fn robots_of_one_command_are_held_together_and_others_are_not() {
    let on = |robot: &str| ConstraintOn::Other { robot: robot.into(), name: "box".into() };
    let mut world = world(1e-3);
    let both = |prefix: &str| {
        let own = free(&format!("{prefix}_a"), held_to("a", []), 0.0);
        Command::SpawnAll(vec![own, free(&format!("{prefix}_b"), held_to("b", [on("a"), on("gone")]), 0.0)])
    };
    world.apply(&both("x")).unwrap();
    world.apply(&both("y")).unwrap();
    assert_eq!(constraint_names(&world), ["x_b_held", "y_b_held"]);
    let robots: Vec<usize> = world.constraints.list[1].definition.robots().collect();
    assert_eq!(robots, [2, 3], "the second pair and not the first");
    world.apply(&Command::Spawn(Box::new(free("alone", held_to("b", [on("a")]), 0.0)))).unwrap();
    assert_eq!(constraint_names(&world).len(), 2);
}

#[test]
fn robots_with_too_many_constraints_do_not_come_at_all() {
    let mut world = world(1e-3);
    let before = world.fingerprint();
    let many = held_to("a", vec![ConstraintOn::World; 4097]);
    world.apply(&Command::Spawn(Box::new(free("a", many, 0.0)))).unwrap_err();
    assert_eq!((world.fingerprint(), world.entities.len()), (before, 0));
    let some = held_to("a", vec![ConstraintOn::World; 3]);
    world.apply(&Command::Spawn(Box::new(free("a", some, 0.0)))).unwrap();
    assert_eq!(constraint_names(&world), ["a_held", "a_held_1", "a_held_2"]);
}

#[test]
fn a_reload_holds_what_the_new_description_says() {
    let mut world = world_with(1e-3, free("a", held_to("a", [ConstraintOn::World]), 2.0));
    let reload = |world: &mut Simulation, model: Arc<RobotModel>| {
        let reload = Reload { robot: "a".into(), model, shapes: Default::default() };
        world.apply(&Command::Reload(Box::new(reload))).unwrap();
    };
    reload(&mut world, held_to("a", [ConstraintOn::World]));
    assert_eq!(constraint_names(&world), ["a_held"]);
    run(&mut world, 0.1);
    assert!((height(&world, 0) - 2.0).abs() < 1e-9);
    for _ in 0..2 {
        reload(&mut world, held_to("a", [ConstraintOn::World, ConstraintOn::World]));
        assert_eq!(constraint_names(&world), ["a_held", "a_held_1"], "those of one name are replaced too");
    }
    reload(&mut world, held_to("a", []));
    assert_eq!(constraint_names(&world), [""; 0]);
}

/// Gains of a description hold for all modes, until a client gives others.
#[test]
fn described_gains_hold_for_targets_of_position_and_velocity() {
    let gains = |world: &Simulation| axis(world).gains(1e-3);
    let drive = |world: &mut Simulation, target: Target| {
        let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target }];
        let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
        world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).unwrap();
    };
    let setup = JointSetup { stiffness: Some(40.0), damping: Some(2.0), ..JointSetup::default() };
    let mut world = world_with(1e-3, spawn("arm", arm_that(setup)));
    drive(&mut world, Target::velocity(0.5));
    assert_eq!(gains(&world), (0.0, 2.0));
    drive(&mut world, Target::position(0.5));
    assert_eq!(gains(&world), (40.0, 2.0));
    let other = Target::Velocity { velocity: 1.0, damping: Some(7.0), feed_forward: 0.0, max_effort: None };
    drive(&mut world, other);
    assert_eq!(gains(&world), (0.0, 7.0), "the target's own gains come first");
    drive(&mut world, Target::Hold);
    assert_eq!(gains(&world), (40.0, 2.0));
    let joints = vec![JointProperties {
        joint: "shoulder".into(),
        default_gains: Some((10.0, 3.0)),
        ..JointProperties::default()
    }];
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    drive(&mut world, Target::velocity(0.5));
    assert_eq!(gains(&world), (0.0, 3.0), "default gains of a client replace those of the description");

    let setup = JointSetup { mode: Some(DriveMode::Velocity), damping: Some(2.0), ..JointSetup::default() };
    let mut world = world_with(1e-3, spawn("arm", arm_that(setup)));
    assert_eq!(gains(&world), (0.0, 2.0));
    drive(&mut world, Target::velocity(0.5));
    assert_eq!(gains(&world), (0.0, 2.0), "after the first target too");
    drive(&mut world, Target::position(0.5));
    let inertia = axis(&world).settings.composite_inertia;
    assert_eq!(gains(&world), (4.0 / (4.0 * inertia), 2.0), "its damping is critical");
}

/// The joint has a limit of effort, which bounds the acceleration of a profile.
#[test]
fn position_targets_of_described_servos_act_at_once_and_others_follow_a_profile() {
    use crate::simulation::SetpointProfiles::{self, All, Undescribed};
    let described = JointSetup { stiffness: Some(40.0), damping: Some(2.0), ..JointSetup::default() };
    let plain = JointSetup::default();
    // Returns where the setpoint is after a step towards 0.5 rad.
    let setpoint = |profiles: SetpointProfiles, setup: JointSetup, profile: Option<bool>| {
        let mut model = RobotModel::clone(&arm_that(setup));
        model.joints[0].limits.effort = Some(5.0);
        let settings = PhysicsSettings { setpoint_profiles: profiles, ..PhysicsSettings::default() };
        let mut world = Simulation::new(settings, WorldLimits::default());
        world.apply(&Command::Spawn(Box::new(spawn("arm", Arc::new(model))))).unwrap();
        let joints =
            vec![JointProperties { joint: "shoulder".into(), profile, ..JointProperties::default() }];
        world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
        let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target: Target::position(0.5) }];
        let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
        world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).unwrap();
        let mut axis = axis(&world).clone();
        axis.advance_setpoint(1e-3);
        axis.actuator.setpoint
    };
    for (profiles, setup, profile, at_once) in [
        (Undescribed, described, None, true),
        (Undescribed, plain, None, false),
        (All, described, None, false),
        (SetpointProfiles::None, plain, None, true),
        (Undescribed, described, Some(true), false),
        (Undescribed, plain, Some(false), true),
    ] {
        let seen = setpoint(profiles, setup, profile);
        assert_eq!(seen == 0.5, at_once, "{profiles:?}, {profile:?}: {seen}");
        assert!(seen > 0.0);
    }
}
