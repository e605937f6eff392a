//! Commands: whole or not at all, and the effects of each.

use std::time::Duration;

use super::super::target_sources::TargetSource;
use super::*;

#[test]
fn several_robots_get_their_targets_together_or_not_at_all() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let targets = |robot: &str, value: f64| RobotTargets {
        robot: robot.into(),
        joints: vec![JointTarget { joint: "shoulder".into(), axis: 0, target: position(value) }],
        ..RobotTargets::default()
    };
    for (second, bad) in [("other", f64::NAN), ("missing", 0.1)] {
        let robots = vec![targets("arm", 0.4), targets(second, bad)];
        let request = SetTargets { robots, ..SetTargets::default() };
        world.apply(&Command::SetTargets(request)).unwrap_err();
        assert_eq!(look(&world).targets, [0.0, 0.0]);
    }
    let robots = vec![targets("arm", 0.4), targets("other", 0.6)];
    world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).unwrap();
    assert_eq!(look(&world).targets, [0.4, 0.6]);
}

#[test]
fn refusals_name_the_element_and_what_there_is() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let said = |result: Result<Applied, Error>| result.unwrap_err().to_string();
    assert_eq!(
        said(set(&mut world, position(f64::NAN))),
        "robots[0].joints[0].position.position (joint \"shoulder\") is NaN; it must be a number \
         between -1e12 and 1e12"
    );
    let stiff = |stiffness| {
        let mut target = position(0.0);
        if let Target::Position { stiffness: slot, .. } = &mut target {
            *slot = Some(stiffness);
        }
        target
    };
    for stiffness in [-1.0, 1e13, f64::INFINITY, f64::NAN] {
        let refused = said(set(&mut world, stiff(stiffness)));
        assert!(
            refused.starts_with("robots[0].joints[0].position.stiffness (joint \"shoulder\")")
                && refused.ends_with("it must be between 0 and 1e12"),
            "{refused}"
        );
    }
    set(&mut world, stiff(1e12)).unwrap();
    let whole = Some(WholeTarget::Effort(vec![1e13]));
    let robots = vec![RobotTargets { robot: "arm".into(), whole, ..RobotTargets::default() }];
    assert_eq!(
        said(world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() }))),
        "robots[0].whole.values[0] is 10000000000000; it must be a number between -1e12 and 1e12"
    );
    assert_eq!(
        said(world.apply(&Command::Delete { robot: "leg".into() })),
        "there is no robot \"leg\" in this world; robots are \"arm\""
    );
    assert_eq!(
        said(world.apply(&Command::Spawn(Box::new(spawn("arm", arm()))))),
        "there is a robot \"arm\" already; choose another name, delete it, or reload it"
    );
    let robots = vec![RobotReset {
        robot: "arm".into(),
        joints: vec![JointReset {
            joint: "elbow".into(),
            axis: 0,
            position: 0.0,
            velocity: 0.0,
            ..Default::default()
        }],
    }];
    assert_eq!(
        said(world.apply(&Command::ResetJoints { robots })),
        "robot \"arm\" has no joint \"elbow\"; its joints are \"shoulder\""
    );
}

#[test]
fn a_reload_keeps_pose_positions_and_targets_of_joints_that_still_exist() {
    let at = DPose3::from_translation(DVec3::new(1.0, 2.0, 3.0));
    let mut world = world_with(1e-3, Spawn { pose: at, ..spawn("arm", arm()) });
    set(&mut world, position(0.5)).unwrap();
    let before = run(&mut world, 1.0);
    let mut longer = (*arm()).clone();
    longer.links.push(link("hand", Inertial { mass: 0.01, ..Inertial::ZERO }));
    let wrist = Joint { name: "wrist".into(), parent: 1, child: 2, ..arm_joint() };
    longer.joints.push(wrist);
    let model = Arc::new(longer);
    let reply = world
        .apply(&Command::Reload(Box::new(Reload { robot: "arm".into(), model, shapes: Default::default() })))
        .unwrap()
        .reply;
    assert_eq!(reply, Reply::Reloaded { added: vec!["wrist".into()], removed: Vec::new() });
    let after = look(&world);
    assert_eq!(after.roots[0].pose, at);
    assert_eq!(after.positions, [before.positions[0], 0.0]);
    assert_eq!(after.targets[0], 0.5);
    assert_ne!(after.world.entities[0].version, before.world.entities[0].version);
}

#[test]
fn resets_put_back_what_their_scope_says() {
    let mut world = world_with(1e-3, Spawn { loaded_at_start: true, ..spawn("arm", arm()) });
    world.apply(&Command::Spawn(Box::new(spawn("guest", arm())))).unwrap();
    set(&mut world, position(0.5)).unwrap();
    run(&mut world, 0.5);

    let time = ResetScope { time: true, ..ResetScope::default() };
    world.apply(&Command::Reset(time)).unwrap();
    assert_eq!(world.now(), Moment { epoch: 1, step: 0, sim_time: 0.0 });
    assert!(look(&world).positions[0] > 0.4);

    let state = ResetScope { state: true, ..ResetScope::default() };
    world.apply(&Command::Reset(state)).unwrap();
    assert_eq!(look(&world).positions[0], 0.0);
    assert_eq!(look(&world).targets[0], 0.0);

    let spawned = ResetScope { spawned: true, ..ResetScope::default() };
    let reply = world.apply(&Command::Reset(spawned)).unwrap().reply;
    assert_eq!(reply, Reply::Reset { deleted: vec!["guest".into()] });
    assert_eq!(world.layout().entities.len(), 1);
}

/// To the bit: the whole run after a restore equals the run after the save.
#[test]
fn a_restored_state_runs_on_as_the_saved_one_did() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    set(&mut world, velocity(2.0)).unwrap();
    run(&mut world, 0.3);
    world.apply(&Command::SaveState { name: "mark".into() }).unwrap();
    let first = run(&mut world, 0.5);
    set(&mut world, Target::Passive).unwrap();
    run(&mut world, 0.5);
    world.apply(&Command::RestoreState { name: "mark".into() }).unwrap();
    let second = run(&mut world, 0.5);
    assert_eq!(first.positions[0].to_bits(), second.positions[0].to_bits());
    assert_eq!(first.velocities[0].to_bits(), second.velocities[0].to_bits());
    assert_eq!((first.at.step, second.at.epoch), (second.at.step, first.at.epoch + 1));
}

#[test]
fn sim_time_is_exact_after_a_million_steps() {
    let mut world = world(1e-3);
    for _ in 0..1_000_000 {
        world.step();
    }
    assert_eq!(world.now().sim_time, 1000.0);
}

#[test]
fn a_robot_whose_state_is_not_finite_is_put_back_and_the_others_continue() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    run(&mut world, 0.1);
    let limit = |world: &mut Simulation, lower: Option<f64>| {
        let limits = Some(JointLimits { lower, ..JointLimits::default() });
        let joints = vec![JointProperties { joint: "shoulder".into(), limits, ..JointProperties::default() }];
        world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    };
    limit(&mut world, Some(1e300));
    run(&mut world, 0.1);
    let seen = look(&world);
    assert!(seen.positions.iter().all(|q| q.is_finite()));
    assert!(seen.roots[0].disabled.is_some() && seen.roots[1].disabled.is_none());
    let actuator = &world.entities[0].body.axes()[0].actuator;
    assert_eq!(actuator.setpoint, seen.positions[0], "nothing of that step is left");
    let disabled = |event: &Event| matches!(&event.kind, EventKind::EntityDisabled { .. });
    assert_eq!(world.take_events().iter().filter(|event| disabled(event)).count(), 1);
    limit(&mut world, None);
    let state = ResetScope { state: true, ..ResetScope::default() };
    world.apply(&Command::Reset(state)).unwrap();
    run(&mut world, 0.1);
    assert!(look(&world).roots[0].disabled.is_none());
}

/// A free box falls by g t^2 / 2, and by Euler's discrete formula: z_n = -g h^2 n (n + 1) / 2.
#[test]
fn a_free_root_falls_as_the_formula_says() {
    let body = Inertial { mass: 2.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(DVec3::ONE) };
    let model = RobotModel {
        name: "box".into(),
        links: vec![link("box", body)],
        joints: Vec::new(),
        ..RobotModel::default()
    };
    let start = Spawn { fixed_base: None, ..spawn("box", Arc::new(model)) };
    for (integrator, early) in [(Integrator::Leapfrog, 0.0), (Integrator::Euler, 1.0)] {
        let mut world = world_with(1e-3, start.clone());
        let physics = PhysicsChange { integrator: Some(integrator), ..PhysicsChange::default() };
        world.apply(&Command::SetPhysics(physics)).unwrap();
        let z = run(&mut world, 1.0).roots[0].pose.translation.z;
        assert!((z + 9.81 * 1e-6 * 1000.0 * (1000.0 + early) / 2.0).abs() < 1e-12, "{z}");
    }
}

#[test]
fn a_joint_is_not_put_where_its_follower_could_not_be_computed() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    for position in [1e308, f64::NAN, f64::INFINITY] {
        let joint =
            JointReset { joint: "shoulder".into(), axis: 0, position, velocity: 0.0, ..Default::default() };
        let robots = vec![RobotReset { robot: "arm".into(), joints: vec![joint] }];
        assert!(matches!(world.apply(&Command::ResetJoints { robots }), Err(Error::InvalidValue { .. })));
    }
    assert_eq!(look(&world).positions, [0.0]);
}

/// A state has the settings of its robots, and shares them with other states until a command changes them.
#[test]
fn settings_are_shared_from_state_to_state_and_replaced_where_a_command_changes_them() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let before = look(&world);
    world.step();
    set(&mut world, position(0.5)).unwrap();
    assert!(Arc::ptr_eq(&before.settings, &look(&world).settings));

    let joints =
        vec![JointProperties { joint: "shoulder".into(), damping: Some(0.25), ..Default::default() }];
    world.apply(&Command::SetJointProperties { robot: "arm".into(), joints }).unwrap();
    let after = look(&world);
    assert_eq!(after.joint_status(0).unwrap()[0].settings.damping, 0.25);
    assert_eq!(
        before.joint_status(0).unwrap()[0].settings.damping,
        0.0,
        "a state that is read never changes"
    );
    assert!(Arc::ptr_eq(&before.settings[1], &after.settings[1]));

    let joints = vec![JointSelection { robot: "other".into(), joints: Vec::new() }];
    let request = ClaimRequest { claim: ClaimId(7), holder: "me".into(), joints, ..ClaimRequest::default() };
    world.apply(&Command::Claim(request)).unwrap();
    let holder = |world: &Simulation| look(world).joint_status(1).unwrap()[0].settings.claimed_by.clone();
    assert_eq!(holder(&world).as_deref(), Some("me"));
    world.apply(&Command::Release { claim: ClaimId(7), cause: ReleaseCause::Released }).unwrap();
    assert_eq!(holder(&world), None);

    world.apply(&Command::Delete { robot: "arm".into() }).unwrap();
    let last = look(&world);
    assert_eq!((last.settings.len(), last.world.entities.len()), (1, 1));
    assert_eq!(last.joint_status(0).unwrap()[0].settings.damping, 0.0, "those of the other");
}

/// A source is shown with the target that it set, and no longer than that target holds.
#[test]
fn the_source_of_a_target_is_known_while_the_target_holds() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let source = |client: &str| {
        Some(Arc::new(TargetSource { client: client.into(), at: Duration::from_secs(client.len() as u64) }))
    };
    let set_by = |world: &mut Simulation, robot: &str, client: &str, target| {
        let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target }];
        let robots = vec![RobotTargets { robot: robot.into(), joints, ..RobotTargets::default() }];
        let targets = SetTargets { robots, source: source(client), ..SetTargets::default() };
        world.apply(&Command::SetTargets(targets))
    };
    let sources = |world: &Simulation| -> Vec<Option<String>> {
        let robots = look(world).target_sources.iter().cloned().collect::<Vec<_>>();
        let of = |robot: Arc<Vec<Option<Arc<TargetSource>>>>| {
            robot.first().cloned().flatten().map(|source| source.client.to_string())
        };
        robots.into_iter().map(of).collect()
    };
    let some = |client: &str| Some(client.to_owned());
    assert_eq!(sources(&world), [None, None]);
    world.apply(&Command::SaveState { name: "before".into() }).unwrap();
    set_by(&mut world, "arm", "one", position(0.1)).unwrap();
    set_by(&mut world, "other", "two", position(0.1)).unwrap();
    set_by(&mut world, "arm", "three", position(f64::NAN)).unwrap_err();
    world.step();
    assert_eq!(sources(&world), [some("one"), some("two")]);
    let fingerprint = world.fingerprint();
    set_by(&mut world, "arm", "two", position(0.1)).unwrap();
    assert_eq!(sources(&world), [some("two"), some("two")]);
    assert_eq!(world.fingerprint(), fingerprint, "it is not a state");
    let whole =
        RobotTargets { robot: "arm".into(), whole: Some(WholeTarget::Hold), ..RobotTargets::default() };
    let whole = SetTargets { robots: vec![whole], source: source("whole"), ..SetTargets::default() };
    world.apply(&Command::SetTargets(whole)).unwrap();
    assert_eq!(sources(&world), [some("whole"), some("two")]);

    // It is deleted with its robot, and another robot of that name has no source.
    world.apply(&Command::Delete { robot: "arm".into() }).unwrap();
    assert_eq!(sources(&world), [some("two")]);
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm())))).unwrap();
    assert_eq!(sources(&world), [some("two"), None]);
    world.apply(&Command::Reset(ResetScope { time: true, ..ResetScope::default() })).unwrap();
    assert_eq!(sources(&world), [some("two"), None], "targets stay at a reset of time");
    world.apply(&Command::Reset(ResetScope::default())).unwrap();
    assert_eq!(sources(&world), [None, None]);
    set_by(&mut world, "other", "two", position(0.1)).unwrap();
    world.apply(&Command::SaveState { name: "after".into() }).unwrap();
    for name in ["before", "after"] {
        set_by(&mut world, "other", "two", position(0.1)).unwrap();
        world.apply(&Command::RestoreState { name: name.into() }).unwrap();
        assert_eq!(sources(&world), [None, None], "{name}");
    }
}

#[test]
fn robots_of_one_model_have_one_tree() {
    let model = arm();
    let mut world = world_with(1e-3, spawn("arm", Arc::clone(&model)));
    for (name, fixed) in [("other", true), ("free", false)] {
        let robot = Spawn { fixed_base: Some(fixed), ..spawn(name, Arc::clone(&model)) };
        world.apply(&Command::Spawn(Box::new(robot))).unwrap();
    }
    world.apply(&Command::Spawn(Box::new(spawn("copy", arm())))).unwrap();
    let tree = |robot: usize| world.entities[robot].body.tree();
    assert!(Arc::ptr_eq(tree(0), tree(1)));
    assert!((2..4).all(|robot| !Arc::ptr_eq(tree(0), tree(robot))));
}
