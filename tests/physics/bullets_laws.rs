//! Bullet's laws, by their formulas: an overlap becomes a velocity, limits act beyond, speeds are bounded, and
//! links are damped explicitly.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{BulletContacts, Command, Integrator, PhysicsSettings, Simulation};
use simd_model::robot::{JointKind, JointLimits};
use simd_tests::scenes::{ball, cuboid, plane, robot, spawn, surface, throw};
use simd_tests::world::{apply, at, look};

use crate::chains::{chain, rod};

const SLOP: f64 = 1e-5;

fn bullet(time_step: f64, gravity: f64) -> Simulation {
    let settings = PhysicsSettings {
        time_step,
        gravity: DVec3::new(0.0, 0.0, gravity),
        integrator: Integrator::Bullet(BulletContacts::default()),
        ..PhysicsSettings::default()
    };
    Simulation::new(settings, WorldLimits::default())
}

/// A ball or a box in the ground leaves with 0.08 of its depth per step, however deep
/// it is. Then it flies.
#[test]
fn an_overlap_is_a_velocity_without_a_bound() {
    for seed in 0..60 {
        let mut rng = Rng::with_seed(seed);
        let (h, gravity) = (1e-3 + 9e-3 * rng.f64(), if rng.bool() { -9.81 } else { 0.0 });
        let depth = [1e-3, 0.02, 0.2][rng.usize(0..3)] * (0.5 + rng.f64());
        let mut world = bullet(h, gravity);
        spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        let mass = 0.1 + 9.0 * rng.f64();
        let thing = if rng.bool() { ball(0.5, mass) } else { cuboid(DVec3::ONE, mass) };
        spawn(&mut world, robot("thing", &thing, at(0.0, 0.0, 0.5 - depth), false));
        world.step();
        let velocity = 0.08 * (depth - SLOP) / h;
        let root = look(&world).roots[1].clone();
        assert!(
            (root.linear.z - velocity).abs() < 1e-9 * velocity,
            "seed {seed}: {} {velocity}",
            root.linear.z
        );
        let moved = root.pose.translation.z - (0.5 - depth);
        assert!((moved - h * velocity).abs() < 1e-9 * depth, "seed {seed}: {moved}");
        world.step();
        // Gravity slows it down by less than what is left of the overlap asks for.
        let next = (velocity + gravity * h).max(0.08 * (depth - moved - SLOP) / h);
        let found = look(&world).roots[1].linear.z;
        assert!((found - next).abs() < 1e-9 * velocity, "seed {seed}: {found} {next}");
    }
}

/// Both bodies get a velocity, as their masses say.
#[test]
fn two_bodies_in_each_other_fly_apart_and_keep_their_momentum() {
    let mut world = bullet(1.0 / 240.0, 0.0);
    for (name, mass, height) in [("light", 1.0, 0.0), ("heavy", 3.0, 0.8)] {
        spawn(&mut world, robot(name, &cuboid(DVec3::ONE, mass), at(0.0, 0.0, height), false));
    }
    world.step();
    let seen = look(&world);
    let [light, heavy] = [0, 1].map(|i| seen.roots[i].linear.z);
    assert!((light + 3.0 * heavy).abs() < 1e-9, "{light} {heavy}");
    assert!((heavy - light - 0.08 * (0.2 - SLOP) * 240.0).abs() < 1e-6, "{light} {heavy}");
}

/// A rebound has the part of the approach speed at the end of the step, gravity included; slow hits have none.
#[test]
fn hits_bounce_from_the_threshold_on() {
    let h = 1.0 / 240.0;
    for (speed, restitution, bounces) in [(3.0, 0.5, true), (0.3, 0.9, true), (0.1, 0.9, false)] {
        let mut world = bullet(h, -9.81);
        let contact_settings = || surface(1.0, restitution);
        let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
        spawn(&mut world, Spawn { contact_settings: contact_settings(), ..ground });
        let thing = robot("ball", &ball(0.1, 1.0), at(0.0, 0.0, 0.1 - SLOP), false);
        spawn(&mut world, Spawn { contact_settings: contact_settings(), ..thing });
        throw(&mut world, "ball", DVec3::NEG_Z * speed, DVec3::ZERO);
        world.step();
        let expected = if bounces { restitution * (speed + 9.81 * h) } else { 0.0 };
        let found = look(&world).roots[1].linear.z;
        assert!((found - expected).abs() < 1e-9, "{speed}: {found} {expected}");
    }
}

fn arm(world: &mut Simulation, kind: JointKind, limits: JointLimits, state: (f64, f64)) {
    let mut model = chain(1);
    model.links[1].inertial = rod(1.0);
    model.joints[0].kind = kind;
    model.joints[0].limits = limits;
    let spawned = Spawn { passive: true, ..robot("robot", &Arc::new(model), DPose3::IDENTITY, true) };
    spawn(world, spawned);
    let (position, velocity) = state;
    let joint = JointReset { joint: "joint-1".into(), position, velocity, ..JointReset::default() };
    let robots = vec![RobotReset { robot: "robot".into(), joints: vec![joint] }];
    apply(world, Command::ResetJoints { robots });
}

/// The velocity after a step by the formula: 0.2 of the way beyond per step, up to 0.04; then it is only stopped.
#[test]
fn a_joint_meets_its_limit_only_beyond_it() {
    for seed in 0..100 {
        let mut rng = Rng::with_seed(seed);
        let h = 1e-3 + 9e-3 * rng.f64();
        let mut world = bullet(h, 0.0);
        let (upper, beyond) = (0.5 + rng.f64(), [-0.01, 0.01, 0.035, 0.05, 0.5][rng.usize(0..5)]);
        let velocity = 10.0 * (rng.f64() - 0.5);
        let (sign, kind) = (
            if rng.bool() { 1.0 } else { -1.0 },
            [JointKind::Revolute, JointKind::Prismatic][rng.usize(0..2)],
        );
        let limits = JointLimits { lower: Some(-upper), upper: Some(upper), ..JointLimits::default() };
        arm(&mut world, kind, limits, (sign * (upper + beyond), sign * velocity));
        world.step();
        let back = if (0.0..0.04).contains(&beyond) { 0.2 * beyond / h } else { 0.0 };
        let expected = sign * if beyond < 0.0 { velocity } else { velocity.min(-back) };
        let found = look(&world).velocities[0];
        assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "seed {seed}: {found} {expected}");
    }
}

#[test]
fn no_joint_is_faster_than_a_hundred_or_its_own_limit() {
    for (velocity, own, expected) in
        [(150.0, None, 100.0), (-150.0, Some(30.0), -30.0), (150.0, Some(200.0), 150.0)]
    {
        let mut world = bullet(1e-3, 0.0);
        let limits = JointLimits { velocity: own, ..JointLimits::default() };
        arm(&mut world, JointKind::Continuous, limits, (0.0, velocity));
        world.step();
        let seen = look(&world);
        assert!((seen.velocities[0] - expected).abs() < 1e-9, "{}", seen.velocities[0]);
        assert!((seen.positions[0] - 1e-3 * expected).abs() < 1e-12, "{}", seen.positions[0]);
    }
}

#[test]
fn each_component_of_a_bodys_velocity_is_at_most_a_hundred() {
    let mut world = bullet(1e-3, 0.0);
    spawn(&mut world, robot("ball", &ball(0.1, 1.0), DPose3::IDENTITY, false));
    throw(&mut world, "ball", DVec3::new(150.0, -30.0, -101.0), DVec3::new(0.0, 120.0, 20.0));
    world.step();
    let root = look(&world).roots[0].clone();
    assert!(root.linear.distance(DVec3::new(100.0, -30.0, -100.0)) < 1e-9, "{}", root.linear);
    assert!(root.angular.distance(DVec3::new(0.0, 100.0, 20.0)) < 1e-9, "{}", root.angular);
}

/// v - h k v (1 + |v|), without a divisor.
#[test]
fn links_are_damped_explicitly() {
    for (k, speed) in [(0.04, 30.0), (3.0, 5.0)] {
        let h = 0.01;
        let mut world = bullet(h, 0.0);
        spawn(&mut world, robot("ball", &ball(0.1, 1.0), DPose3::IDENTITY, false));
        let link =
            LinkProperties { linear_damping: Some(k), angular_damping: Some(k), ..LinkProperties::default() };
        apply(
            &mut world,
            Command::SetLinkProperties { robot: "ball".into(), links: vec![link], stays_awake: None },
        );
        throw(&mut world, "ball", DVec3::X * speed, DVec3::Z * speed);
        world.step();
        let root = look(&world).roots[0].clone();
        let expected = speed * (1.0 - h * k * (1.0 + speed));
        assert!((root.linear.x - expected).abs() < 1e-9, "{}", root.linear);
        assert!((root.angular.z - expected).abs() < 1e-9, "{}", root.angular);
    }
}

/// The effort of the velocity at the start of the step, however much that is: (M + h d) would divide it.
#[test]
fn joints_are_damped_explicitly() {
    let h = 0.01;
    for (damping, inertia) in [(0.5, 1.0 / 3.0), (100.0, 1.0 / 3.0)] {
        let mut world = bullet(h, 0.0);
        arm(&mut world, JointKind::Continuous, JointLimits::default(), (0.0, 2.0));
        let joint = "joint-1".into();
        let joints = vec![JointProperties { joint, damping: Some(damping), ..JointProperties::default() }];
        apply(&mut world, Command::SetJointProperties { robot: "robot".into(), joints });
        world.step();
        let expected = 2.0 * (1.0 - h * damping / inertia);
        let found = look(&world).velocities[0];
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn contacts_that_cannot_be_are_refused_by_name() {
    let mut world = bullet(1e-3, 0.0);
    for (contacts, field) in [
        (BulletContacts { error_reduction: 1.5, ..BulletContacts::default() }, "error_reduction"),
        (BulletContacts { slop: f64::NAN, ..BulletContacts::default() }, "slop"),
        (BulletContacts { bounce_speed: -1.0, ..BulletContacts::default() }, "bounce_speed"),
    ] {
        let integrator = Some(Integrator::Bullet(contacts));
        let change = PhysicsChange { integrator, ..PhysicsChange::default() };
        let error = world.apply(&Command::SetPhysics(change)).unwrap_err();
        assert!(error.to_string().contains(&format!("bullet_contacts.{field}")), "{error}");
    }
}
