//! Tests of the world, with the tutorial's arm: one continuous joint about y, 0.19992 kg, with known closed
//! forms.

mod ball_joints;
mod claims;
mod commands;
mod constraints;
mod diverging;
mod gravity_compensation;
mod pulls;
mod sensors;
mod setup;
mod trajectories;
mod wrenches;

use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link};

use super::command::*;
use super::published_state::Mode;
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
        limits: JointLimits::default(),
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    }
}

/// Returns the tutorial's arm, with changes to its joint.
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
        ..RobotModel::default()
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
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }
}

fn world(time_step: f64) -> Simulation {
    let settings =
        PhysicsSettings { time_step, integrator: Integrator::Leapfrog, ..PhysicsSettings::default() };
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
    Target::position(position)
}

fn velocity(velocity: f64) -> Target {
    Target::velocity(velocity)
}

fn look(world: &Simulation) -> PublishedState {
    let mut state = PublishedState::default();
    world.observe(&mut state);
    state
}

fn run(world: &mut Simulation, seconds: f64) -> PublishedState {
    let steps = (seconds / world.settings().time_step).round() as u64;
    (0..steps).for_each(|_| world.step());
    look(world)
}

/// Returns the effort that holds the arm at q against gravity, from its mass and centre of mass.
fn hold_effort(q: f64) -> f64 {
    -0.19992 * 9.81 * 0.16597 * (q - 0.039919).cos()
}

/// The pendulum equation has q(1 s) = 0.704120 from 0.3 rad at rest (Runge-Kutta of order 8 to 1e-12).
/// Semi-implicit Euler is of first order: the error falls with the time step, and is below 4 h here.
#[test]
fn a_passive_arm_swings_as_the_pendulum_equation_says() {
    for time_step in [1e-3, 1e-4, 1e-5] {
        let start =
            Spawn { passive: true, joint_positions: vec![("shoulder".into(), 0.3)], ..spawn("arm", arm()) };
        let q = run(&mut world_with(time_step, start), 1.0).positions[0];
        assert!((q - 0.704120).abs() < 4.0 * time_step + 1e-6, "{time_step}: {q}");
    }
}

/// At rest the actuator's effort balances gravity to rounding; the requirement is 1e-6 N m.
#[test]
fn a_held_arm_applies_the_effort_of_the_closed_form() {
    for time_step in [1e-3, 1e-4] {
        let mut world = world_with(time_step, spawn("arm", arm()));
        set(&mut world, position(0.5)).unwrap();
        let seen = run(&mut world, 2.0);
        assert!((seen.positions[0] - 0.5).abs() < 1e-3);
        assert!((seen.efforts[0] - hold_effort(seen.positions[0])).abs() < 1e-9, "{}", seen.efforts[0]);
        // A spring: the error is the effort over the stiffness.
        let gains = seen.joint_status(0).unwrap()[0].gains;
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
            let velocity = look(&world).velocities[0];
            assert!((velocity - 1.0).abs() < 0.01, "{velocity}");
        }
    }
}

/// Smooth: the position never moves by more in a step than the fastest mode's velocity allows. The arm stays
/// in place when it is commanded to hold.
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
            // 300 rad/s over e is the peak velocity of a critically damped step of one radian.
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

/// Without damping and gravity a constant effort gives a constant acceleration. The limit is that effort
/// however fast the target: q = a t^2 / 2. Only the first step, which finds the limit, may be a whole kick.
#[test]
fn a_saturated_actuator_moves_the_joint_as_its_limit_would() {
    let limited = arm_with(|joint| joint.limits.effort = Some(0.01));
    let mut world = world_with(1e-3, spawn("arm", limited));
    let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    world.apply(&Command::SetPhysics(physics)).unwrap();
    set(&mut world, velocity(1e3)).unwrap();
    let seen = run(&mut world, 0.5);
    let inertia = 0.0032199 + 0.19992 * 0.16597f64.powi(2);
    let expected = 0.01 / inertia * 0.5 * 0.5 * 0.5;
    assert!((seen.positions[0] - expected).abs() < 1e-12, "{} {expected}", seen.positions[0]);
    assert!(seen.flags[0].saturated);
    assert_eq!(seen.efforts, [0.01]);
}

/// As the joint's own limit would; the smaller of the two counts.
#[test]
fn a_target_brings_its_own_limits_of_effort_and_velocity() {
    let limited = arm_with(|joint| joint.limits.effort = Some(0.02));
    for (max_effort, applied) in [(0.01, 0.01), (0.05, 0.02), (0.0, 0.0)] {
        let mut world = world_with(1e-3, spawn("arm", Arc::clone(&limited)));
        let physics = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
        world.apply(&Command::SetPhysics(physics)).unwrap();
        let fast = Target::Velocity {
            velocity: 1e3,
            damping: None,
            feed_forward: 0.0,
            max_effort: Some(max_effort),
        };
        set(&mut world, fast).unwrap();
        assert_eq!(run(&mut world, 0.1).efforts, [applied]);
    }
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let Target::Position { position, velocity, stiffness, damping, feed_forward, max_effort, .. } =
        position(1.0)
    else {
        unreachable!()
    };
    let max_velocity = Some(0.5);
    let slow =
        Target::Position { position, velocity, stiffness, damping, feed_forward, max_effort, max_velocity };
    set(&mut world, slow).unwrap();
    for _ in 0..1000 {
        world.step();
        assert!(look(&world).velocities[0] < 0.5 * 1.01);
    }
    assert!((look(&world).positions[0] - 0.5).abs() < 0.02);
}

/// A saturated arm that arrives is released: 0.4 N m holds the arm, whose weight requires 0.33.
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
        joint.limits = JointLimits { lower: Some(-0.5), upper: Some(0.8), ..JointLimits::default() };
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

/// Friction above gravity's effort sticks without creep; coasting under friction only stops after I qd /
/// friction seconds.
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
    let reset =
        JointReset { joint: "shoulder".into(), axis: 0, position: 0.0, velocity: 0.5, ..Default::default() };
    let robots = vec![RobotReset { robot: "arm".into(), joints: vec![reset] }];
    world.apply(&Command::ResetJoints { robots }).unwrap();
    let stop = (inertia * 0.5 / 0.01 / 1e-3).ceil() as u64;
    (0..stop - 1).for_each(|_| world.step());
    assert!(look(&world).velocities[0] > 0.0);
    world.step();
    assert!(look(&world).velocities[0].abs() < 1e-15);
}

#[test]
fn a_target_beyond_a_limit_is_clamped_or_refused_as_asked() {
    let stopped = arm_with(|joint| {
        joint.kind = JointKind::Revolute;
        joint.limits = JointLimits { lower: Some(-0.5), upper: Some(0.8), ..JointLimits::default() };
    });
    let mut world = world_with(1e-3, spawn("arm", stopped));
    let reply = set(&mut world, position(2.0)).unwrap().reply;
    let Reply::Targets { clamped, .. } = reply else { panic!("{reply:?}") };
    assert_eq!((clamped[0].requested, clamped[0].applied), (2.0, 0.8));

    let joints = vec![JointTarget { joint: "shoulder".into(), axis: 0, target: position(-2.0) }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
    let refused = SetTargets { robots, refuse_beyond_limits: true, ..SetTargets::default() };
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

/// A heavy joint with little effort: a spring that saturated all the way would be a relay and swing around
/// the target for seconds. The profile accelerates and brakes with half the effort, so the motion takes 2
/// sqrt(distance / acceleration) and ends without overshoot.
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
