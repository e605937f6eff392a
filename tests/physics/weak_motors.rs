//! Position targets that require far more than their motors' efforts: they are reached with the available
//! effort and come to rest.

use fastrand::Rng;
use glamx::DVec3;
use simd_core::rollout::RolloutRequest;
use simd_core::rollout::request::{Named, Quantity, Start};
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, Simulation};
use simd_model::robot::JointLimits;
use simd_tests::robots;
use simd_tests::scenes::{robot, spawn};

use crate::chains::chain;
use crate::lanes::{has_vectors, part_in_equal_lanes};
use simd_tests::world::{apply, leapfrog, look};

/// N m of each joint.
const EFFORT: f64 = 1.0;

/// rad.
const TARGET: f64 = 1.5;

/// Joints about vertical axes, which gravity does not turn.
fn arm(joints: usize, time_step: f64, integrator: Integrator) -> Simulation {
    let mut model = chain(joints);
    for joint in &mut model.joints {
        joint.axis = DVec3::Z;
        joint.limits =
            JointLimits { lower: Some(-2.0), upper: Some(2.0), effort: Some(EFFORT), velocity: Some(5.0) };
    }
    let mut world = leapfrog(time_step);
    let physics = PhysicsChange { integrator: Some(integrator), ..PhysicsChange::default() };
    apply(&mut world, Command::SetPhysics(physics));
    spawn(
        &mut world,
        Spawn { passive: false, ..robot("robot", &model.into(), glamx::DPose3::IDENTITY, true) },
    );
    world
}

fn go(world: &mut Simulation, joints: usize, [stiffness, damping]: [f64; 2], feed_forward: f64) {
    let joints = (0..joints).map(|joint| {
        let mut target = Target::position(if joint % 2 == 0 { TARGET } else { -TARGET });
        if let Target::Position { stiffness: k, damping: c, feed_forward: f, .. } = &mut target {
            (*k, *c, *f) = (Some(stiffness), Some(damping), feed_forward);
        }
        JointTarget { joint: format!("joint-{}", joint + 1), axis: 0, target }
    });
    let robots =
        vec![RobotTargets { robot: "robot".into(), joints: joints.collect(), ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// A joint whose stiff spring is far beyond its motor moved its setpoint along when the motor saturated. The
/// effort of the law was computed as for another joint, since springs act earlier in a step if they are not
/// stiff. So the joint moved with full effort through its target to its stop, and back, for minutes.
#[test]
fn a_stiff_target_of_a_weak_motor_is_reached_and_held() {
    let mut worst = (0.0f64, String::new());
    for joints in [1, 2, 3] {
        for integrator in [Integrator::Leapfrog, Integrator::Euler] {
            for time_step in [2e-4, 1e-3, 5e-3] {
                for gains in
                    [[1e5, 10.0], [1e5, 3.0], [1e5, 1e3], [1e6, 10.0], [1e6, 1e4], [1e4, 1.0], [1e9, 1e3]]
                {
                    let mut world = arm(joints, time_step, integrator);
                    go(&mut world, joints, gains, 0.0);
                    let mut far = 0.0f64;
                    for _ in 0..(if joints < 3 { 8.0 } else { 40.0 } / time_step) as usize {
                        world.step();
                    }
                    for _ in 0..(1.0 / time_step) as usize {
                        world.step();
                        let seen = look(&world);
                        let off = |(joint, q): (usize, &f64)| {
                            (q - if joint % 2 == 0 { TARGET } else { -TARGET }).abs()
                        };
                        far = seen.positions.iter().enumerate().map(off).fold(far, f64::max);
                    }
                    if far > worst.0 {
                        worst = (far, format!("{joints} joints, {integrator:?}, {time_step} s, {gains:?}"));
                    }
                    println!("{joints} joints, {integrator:?}, {time_step} s, {gains:?}: {far:.2e} rad");
                }
            }
        }
    }
    assert!(worst.0 < 1e-3, "{} rad from the target: {}", worst.0, worst.1);
}

/// Whatever is added to a law, the motor applies its limit.
#[test]
fn a_feed_forward_beyond_all_limits_gives_no_more_than_the_limit() {
    let inertia = 1.0 / 3.0;
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        for feed_forward in [1e3, 1e7, 1e8, -1e8, 1e9, 1e12] {
            let mut world = arm(1, 1e-3, integrator);
            go(&mut world, 1, [3e4, 200.0], feed_forward);
            for step in 1..=100 {
                world.step();
                let seen = look(&world);
                let most = EFFORT / inertia * 1e-3 * f64::from(step);
                let (velocity, effort) = (seen.velocities[0], seen.efforts[0]);
                assert!(
                    velocity.abs() <= most * (1.0 + 1e-9),
                    "{integrator:?}, {feed_forward} N m: {velocity} rad/s after {step} steps, where {most} can be"
                );
                assert!(effort.abs() <= EFFORT, "{effort} N m");
            }
        }
    }
}

/// The limit also holds for an arm whose joints move each other.
#[test]
fn no_feed_forward_throws_an_arm() {
    for feed_forward in [1e6, 1e9, 1e12, -1e12] {
        let mut world = leapfrog(1e-3);
        let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
        spawn(&mut world, Spawn { passive: false, ..robot("arm", &model, glamx::DPose3::IDENTITY, true) });
        let mut target = Target::position(0.5);
        if let Target::Position { feed_forward: f, .. } = &mut target {
            *f = feed_forward;
        }
        let joints = vec![JointTarget { joint: "joint_2".into(), axis: 0, target }];
        let robots = vec![RobotTargets { robot: "arm".into(), joints, ..RobotTargets::default() }];
        apply(&mut world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
        for step in 0..100 {
            world.step();
            let seen = look(&world);
            assert!(seen.roots[0].disabled.is_none());
            let fastest = seen.velocities.iter().fold(0.0f64, |most, velocity| most.max(velocity.abs()));
            assert!(fastest < 30.0, "{feed_forward} N m: {fastest} rad/s in step {step}");
        }
    }
}

/// Copies of such arms, from any start, have the same bits in vector lanes and alone.
#[test]
fn weak_motors_have_the_same_bits_in_lanes_and_alone() {
    let (copies, joints) = (32, 3);
    for (gains, feed_forward) in [([1e5, 10.0], 0.0), ([1e9, 1e3], 0.0), ([3e4, 200.0], 1e9)] {
        let mut world = arm(joints, 1e-3, Integrator::Leapfrog);
        go(&mut world, joints, gains, feed_forward);
        let rng = &mut Rng::with_seed(1);
        let mut random =
            |most: f64| (0..copies * joints).map(|_| most * (2.0 * rng.f64() - 1.0)).collect::<Vec<_>>();
        let of = || Named { robot: "robot".into(), names: Vec::new() };
        let request = RolloutRequest {
            copies,
            steps: 500,
            starts: vec![Start {
                robot: "robot".into(),
                positions: random(1.9),
                velocities: random(3.0),
                ..Start::default()
            }],
            quantities: vec![
                Quantity::JointPositions(of()),
                Quantity::JointVelocities(of()),
                Quantity::JointEfforts(of()),
            ],
            record_every: 1,
            ..RolloutRequest::default()
        };
        let part = part_in_equal_lanes(&world, &request, &format!("{gains:?}, {feed_forward} N m"));
        assert!(!has_vectors() || part > 0.5, "{part} of the steps were done in lanes");
    }
}
