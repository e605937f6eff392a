//! Sentences about the world, told with the tutorial's arm: one continuous joint
//! about y, 0.19992 kg, whose closed forms are known.

use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, Limits, Link};

use super::command::*;
use super::snapshot::Mode;
use super::*;

fn link(name: &str, inertial: Inertial) -> Link {
    Link { name: name.into(), inertial, visuals: Vec::new(), collisions: Vec::new() }
}

fn arm_joint() -> Joint {
    Joint {
        name: "shoulder".into(),
        kind: JointKind::Continuous,
        parent: 0,
        child: 1,
        parent_from_joint: DPose3::from_parts(
            DVec3::new(0.0, -0.022595, 0.19765),
            DQuat::from_rotation_y(-0.039919),
        ),
        axis: DVec3::Y,
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    }
}

/// The tutorial's arm.
fn arm_with(change: impl FnOnce(&mut Joint)) -> Arc<RobotModel> {
    let mut joint = arm_joint();
    change(&mut joint);
    let arm = Inertial {
        mass: 0.19992,
        center_of_mass: DVec3::new(0.16597, 0.053505, -1.9429e-16),
        inertia: DMat3::from_cols(
            DVec3::new(4.6655e-05, -0.00013781, 4.4037e-18),
            DVec3::new(-0.00013781, 0.0032199, 1.9297e-19),
            DVec3::new(4.4037e-18, 1.9297e-19, 0.0032364),
        ),
    };
    Arc::new(RobotModel {
        name: "arm".into(),
        links: vec![link("base_link", Inertial::ZERO), link("arm", arm)],
        joints: vec![joint],
    })
}

fn arm() -> Arc<RobotModel> {
    arm_with(|_| {})
}

fn spawn(name: &str, model: Arc<RobotModel>) -> Spawn {
    Spawn {
        name: name.into(),
        allow_renaming: false,
        model,
        pose: DPose3::IDENTITY,
        fixed_base: Some(true),
        passive: false,
        joint_positions: Vec::new(),
        shapes: Default::default(),
        loaded_at_start: false,
    }
}

fn world(time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

fn world_with(time_step: f64, spawn: Spawn) -> Simulation {
    let mut world = world(time_step);
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
    world
}

fn set(world: &mut Simulation, target: Target) -> Result<Applied, Error> {
    world.apply(&Command::SetTargets(SetTargets {
        robots: vec![RobotTargets {
            robot: "arm".into(),
            joints: vec![JointTarget { joint: "shoulder".into(), axis: 0, target }],
            ..RobotTargets::default()
        }],
        ..SetTargets::default()
    }))
}

fn position(position: f64) -> Target {
    Target::Position { position, velocity: 0.0, stiffness: None, damping: None, feed_forward: 0.0 }
}

fn velocity(velocity: f64) -> Target {
    Target::Velocity { velocity, damping: None, feed_forward: 0.0 }
}

fn look(world: &Simulation) -> Snapshot {
    let mut snapshot = Snapshot::default();
    world.observe(&mut snapshot);
    snapshot
}

fn run(world: &mut Simulation, seconds: f64) -> Snapshot {
    let steps = (seconds / world.settings().time_step).round() as u64;
    (0..steps).for_each(|_| world.step());
    look(world)
}

/// Effort that holds the arm at q against gravity, from its mass and centre of mass.
fn hold_effort(q: f64) -> f64 {
    -0.19992 * 9.81 * 0.16597 * (q - 0.039919).cos()
}

/// The pendulum equation has q(1 s) = 0.704120 from 0.3 rad at rest (Runge-Kutta of
/// order 8 to 1e-12). Semi-implicit Euler is of first order: the error falls with the
/// time step, and is below 4 h here.
#[test]
fn a_passive_arm_swings_as_the_pendulum_equation_says() {
    for time_step in [1e-3, 1e-4, 1e-5] {
        let start =
            Spawn { passive: true, joint_positions: vec![("shoulder".into(), 0.3)], ..spawn("arm", arm()) };
        let q = run(&mut world_with(time_step, start), 1.0).positions[0];
        assert!((q - 0.704120).abs() < 4.0 * time_step + 1e-6, "{time_step}: {q}");
    }
}

/// At rest the actuator's effort is gravity's, to rounding; 1e-6 N m is what was asked.
#[test]
fn a_held_arm_applies_the_effort_of_the_closed_form() {
    for time_step in [1e-3, 1e-4] {
        let mut world = world_with(time_step, spawn("arm", arm()));
        set(&mut world, position(0.5)).unwrap();
        let seen = run(&mut world, 2.0);
        assert!((seen.positions[0] - 0.5).abs() < 1e-3);
        assert!((seen.efforts[0] - hold_effort(seen.positions[0])).abs() < 1e-9, "{}", seen.efforts[0]);
        // A spring: the error is the effort over the stiffness.
        let gains = match world.query(&Query::Joints { robot: "arm".into() }).unwrap() {
            Answer::Joints { joints, .. } => joints[0].gains,
            Answer::Snapshots(_) => unreachable!(),
        };
        let error = 0.5 - seen.positions[0];
        assert!((error - seen.efforts[0] / gains.0).abs() < 1e-9);
    }
}

#[test]
fn a_velocity_target_holds_within_a_percent_under_gravity() {
    for time_step in [1e-3, 1e-4] {
        let mut world = world_with(time_step, spawn("arm", arm()));
        set(&mut world, velocity(1.0)).unwrap();
        run(&mut world, 0.5);
        for _ in 0..1000 {
            world.step();
            let rate = look(&world).velocities[0];
            assert!((rate - 1.0).abs() < 0.01, "{rate}");
        }
    }
}

/// Smooth: the position never moves by more in a step than the fastest mode's rate
/// allows, and the arm stays where it is when it is told to hold.
#[test]
fn switching_modes_while_moving_does_not_jump() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let targets =
        [velocity(1.0), position(1.0), Target::Effort(0.0), Target::Hold, velocity(-2.0), Target::Passive];
    let mut before = look(&world).positions[0];
    for target in targets {
        set(&mut world, target).unwrap();
        for _ in 0..300 {
            world.step();
            let now = look(&world).positions[0];
            // 300 rad/s over e is the peak rate of a critically damped step of one radian.
            assert!((now - before).abs() < 0.12, "{target:?} moved from {before} to {now}");
            before = now;
        }
    }
}

#[test]
fn holding_stays_where_the_joint_was() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    set(&mut world, velocity(1.0)).unwrap();
    let at = run(&mut world, 0.7).positions[0];
    set(&mut world, Target::Hold).unwrap();
    let seen = run(&mut world, 1.0);
    assert!((seen.positions[0] - at).abs() < 1e-3);
    assert_eq!(seen.modes, [Mode::Hold]);
}

/// Free of damping and gravity a constant effort gives a constant acceleration; the
/// limit is that effort however fast the target. Discrete: q_n = a h^2 n (n + 1) / 2.
#[test]
fn a_saturated_actuator_moves_the_joint_as_its_limit_would() {
    let limited = arm_with(|joint| joint.limits.effort = Some(0.01));
    let mut world = world_with(1e-3, spawn("arm", limited));
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    set(&mut world, velocity(1e3)).unwrap();
    let seen = run(&mut world, 0.5);
    let inertia = 0.0032199 + 0.19992 * 0.16597f64.powi(2);
    let expected = 0.01 / inertia * 1e-6 * 500.0 * 501.0 / 2.0;
    assert!((seen.positions[0] - expected).abs() < 1e-12, "{} {expected}", seen.positions[0]);
    assert!(seen.flags[0].saturated);
    assert_eq!(seen.efforts, [0.01]);
}

/// A saturated arm that arrives is released: 0.4 N m holds the arm, whose weight asks for 0.33.
#[test]
fn a_saturated_actuator_arrives_and_is_released() {
    let limited = arm_with(|joint| joint.limits.effort = Some(0.4));
    let mut world = world_with(1e-3, spawn("arm", limited));
    set(&mut world, position(0.5)).unwrap();
    let seen = run(&mut world, 5.0);
    assert!((seen.positions[0] - 0.5).abs() < 1e-3, "{}", seen.positions[0]);
    assert!(!seen.flags[0].saturated);
}

#[test]
fn a_joint_rests_at_its_limit_without_chatter() {
    let stopped = arm_with(|joint| {
        joint.kind = JointKind::Revolute;
        joint.limits = Limits { lower: Some(-0.5), upper: Some(0.8), ..Limits::default() };
    });
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", stopped) });
    let seen = run(&mut world, 4.0);
    assert!((seen.positions[0] - 0.8).abs() < 1e-9, "{}", seen.positions[0]);
    assert!(seen.flags[0].at_upper && !seen.flags[0].at_lower);
    for _ in 0..1000 {
        world.step();
        let seen = look(&world);
        assert!(seen.velocities[0].abs() < 1e-9 && (seen.positions[0] - 0.8).abs() < 1e-9);
    }
}

/// Friction above gravity's effort sticks without creep; coasting under friction alone
/// stops after I qd / friction seconds.
#[test]
fn dry_friction_sticks_and_stops() {
    let inertia = 0.0032199 + 0.19992 * 0.16597f64.powi(2);
    let rough = arm_with(|joint| joint.friction = 0.5);
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", rough) });
    assert!(run(&mut world, 10.0).positions[0].abs() < 1e-12);

    let rough = arm_with(|joint| joint.friction = 0.01);
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", rough) });
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    let reset = JointReset { joint: "shoulder".into(), axis: 0, position: 0.0, velocity: 0.5 };
    let robots = vec![RobotReset { robot: "arm".into(), joints: vec![reset] }];
    world.apply(&Command::ResetJoints { robots }).unwrap();
    let stop = (inertia * 0.5 / 0.01 / 1e-3).ceil() as u64;
    (0..stop - 1).for_each(|_| world.step());
    assert!(look(&world).velocities[0] > 0.0);
    world.step();
    assert_eq!(look(&world).velocities[0], 0.0);
}

#[test]
fn a_target_beyond_a_limit_is_clamped_or_refused_as_asked() {
    let stopped = arm_with(|joint| {
        joint.kind = JointKind::Revolute;
        joint.limits = Limits { lower: Some(-0.5), upper: Some(0.8), ..Limits::default() };
    });
    let mut world = world_with(1e-3, spawn("arm", stopped));
    let reply = set(&mut world, position(2.0)).unwrap().reply;
    let Reply::Targets { clamped } = reply else { panic!("{reply:?}") };
    assert_eq!((clamped[0].requested, clamped[0].applied), (2.0, 0.8));

    let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target: position(-2.0) }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    let refused = SetTargets { robots, refuse_beyond_limits: true, claim: None };
    let error = world.apply(&Command::SetTargets(refused)).unwrap_err();
    assert_eq!(error.to_string(), "target -2 of joint \"shoulder\" lies beyond its limits, -0.5 to 0.8");
    assert_eq!(look(&world).targets, [0.8]);
}

#[test]
fn a_position_target_moves_no_faster_than_the_velocity_limit() {
    let slow = arm_with(|joint| joint.limits.velocity = Some(0.5));
    let mut world = world_with(1e-3, spawn("arm", slow));
    run(&mut world, 0.2);
    set(&mut world, position(1.0)).unwrap();
    for _ in 0..2000 {
        world.step();
        assert!(look(&world).velocities[0] < 0.5 * 1.01);
    }
    assert!((run(&mut world, 0.5).positions[0] - 1.0).abs() < 1e-3);
}

/// A heavy joint with little effort: a spring that saturated all the way would be a relay
/// and swing around the target for seconds. The profile speeds up and brakes with half the
/// effort, so the way takes 2 sqrt(distance / acceleration) and ends without overshoot.
#[test]
fn a_weak_actuator_goes_to_its_target_without_swinging_around_it() {
    let inertia = 0.0032199 + 0.19992 * 0.16597f64.powi(2);
    let weak = arm_with(|joint| joint.limits.effort = Some(0.05));
    let mut world = world_with(1e-3, spawn("arm", weak));
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    set(&mut world, position(1.0)).unwrap();
    let time = 2.0 * (inertia / (0.5 * 0.05)).sqrt();
    assert!(run(&mut world, 0.9 * time).positions[0] < 1.0);
    let mut farthest = 0.0f64;
    for _ in 0..((0.1 * time + 0.05) / 1e-3) as u64 {
        world.step();
        farthest = farthest.max(look(&world).positions[0]);
    }
    assert!((look(&world).positions[0] - 1.0).abs() < 1e-3 && farthest < 1.0 + 1e-3, "{farthest}");
}

#[test]
fn several_robots_get_their_targets_together_or_not_at_all() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    let targets = |robot: &str, value: f64| RobotTargets {
        robot: robot.into(),
        joints: vec![JointTarget { joint: "shoulder".into(), axis: 0, target: position(value) }],
        ..RobotTargets::default()
    };
    for (second, bad) in [("other", f64::NAN), ("nobody", 0.1)] {
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
        "the position target of joint \"shoulder\" is NaN; it must be a finite number"
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
        joints: vec![JointReset { joint: "elbow".into(), axis: 0, position: 0.0, velocity: 0.0 }],
    }];
    assert_eq!(
        said(world.apply(&Command::ResetJoints { robots })),
        "robot \"arm\" has no joint \"elbow\"; its joints are \"shoulder\""
    );
}

#[test]
fn a_claimed_joint_takes_targets_of_its_holder_only_and_holds_when_released() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let joints = vec![JointSelection { robot: "arm".into(), joints: Vec::new() }];
    let claim = Command::Claim { claim: "secret".into(), holder: "planner".into(), joints };
    world.apply(&claim).unwrap();
    assert_eq!(
        set(&mut world, position(0.1)).unwrap_err().to_string(),
        "joint \"shoulder\" of robot \"arm\" is claimed by \"planner\""
    );
    let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target: velocity(1.0) }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    let own = SetTargets { robots, claim: Some("secret".into()), ..SetTargets::default() };
    world.apply(&Command::SetTargets(own)).unwrap();
    run(&mut world, 0.1);
    world.apply(&Command::Release { claim: "secret".into(), lapsed: true }).unwrap();
    assert_eq!(look(&world).modes, [Mode::Hold]);
    set(&mut world, position(0.1)).unwrap();
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

/// To the bit: the whole run after a restore is the run after the save.
#[test]
fn a_restored_state_runs_on_as_the_saved_one_did() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    set(&mut world, velocity(2.0)).unwrap();
    run(&mut world, 0.3);
    world.apply(&Command::SaveSnapshot { name: "mark".into() }).unwrap();
    let first = run(&mut world, 0.5);
    set(&mut world, Target::Passive).unwrap();
    run(&mut world, 0.5);
    world.apply(&Command::RestoreSnapshot { name: "mark".into() }).unwrap();
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
fn a_robot_whose_state_is_not_finite_is_put_back_and_the_others_go_on() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    run(&mut world, 0.1);
    set(&mut world, Target::Effort(1e308)).unwrap();
    run(&mut world, 0.1);
    let seen = look(&world);
    assert!(seen.positions.iter().all(|q| q.is_finite()));
    assert!(seen.roots[0].disabled.is_some() && seen.roots[1].disabled.is_none());
    let disabled = |event: &Event| matches!(&event.kind, EventKind::EntityDisabled { .. });
    assert_eq!(world.take_events().iter().filter(|event| disabled(event)).count(), 1);
    let state = ResetScope { state: true, ..ResetScope::default() };
    world.apply(&Command::Reset(state)).unwrap();
    run(&mut world, 0.1);
    assert!(look(&world).roots[0].disabled.is_none());
}

/// A free box falls by the discrete formula: z_n = -g h^2 n (n + 1) / 2.
#[test]
fn a_free_root_falls_as_the_discrete_formula_says() {
    let body = Inertial { mass: 2.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(DVec3::ONE) };
    let model = RobotModel { name: "box".into(), links: vec![link("box", body)], joints: Vec::new() };
    let start = Spawn { fixed_base: None, ..spawn("box", Arc::new(model)) };
    let z = run(&mut world_with(1e-3, start), 1.0).roots[0].pose.translation.z;
    assert!((z + 9.81 * 1e-6 * 1000.0 * 1001.0 / 2.0).abs() < 1e-12, "{z}");
}

/// 1 N along world x at the tip of the resting arm turns it by the lever's moment.
#[test]
fn a_wrench_acts_for_one_step_or_until_it_is_cleared() {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", arm()) });
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    let wrench = |torque: f64, persistent| {
        Command::ApplyWrench(LinkWrench {
            robot: "arm".into(),
            link: "arm".into(),
            force: DVec3::ZERO,
            torque: DVec3::new(0.0, torque, 0.0),
            in_link_axes: false,
            point: DVec3::ZERO,
            persistent,
        })
    };
    let gain = 1e-3 / (0.0032199 + 0.19992 * 0.16597f64.powi(2));
    world.apply(&wrench(0.5, false)).unwrap();
    let seen = run(&mut world, 0.01);
    assert!((seen.velocities[0] - 0.5 * gain).abs() < 1e-12);
    world.apply(&wrench(0.5, true)).unwrap();
    let seen = run(&mut world, 0.01);
    assert!((seen.velocities[0] - 11.0 * 0.5 * gain).abs() < 1e-9);
    world.apply(&wrench(0.0, true)).unwrap();
    let before = seen.velocities[0];
    assert_eq!(run(&mut world, 0.01).velocities[0], before);
}
