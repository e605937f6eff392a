//! The seven-joint arm, driven by velocity motors around a post that its links hold between them. Its last
//! link has almost no inertia: its motor's maximum effort accelerates it by 700 rad/s in a step of 10 ms.

use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::rollout::RolloutRequest;
use simd_core::rollout::request::{Control, ControlMode, Interpolation, Named, Quantity, Start};
use simd_core::simulation::command::*;
use simd_core::{Command, PublishedState, Simulation};
use simd_model::robot::Geometry;
use simd_tests::robots;
use simd_tests::scenes::{plane, robot, solid, spawn, world};

use crate::energy::energy;
use crate::lanes::{has_vectors, part_in_equal_lanes};
use crate::seeds::seeds;
use simd_tests::world::{apply, look};

const JOINTS: usize = 7;

/// N m, from its description.
const LIMITS: [f64; JOINTS] = [300.0, 300.0, 180.0, 180.0, 110.0, 40.0, 40.0];

/// A state of a rollout near a post: rad, rad/s, and its drive. The post is on one side of link_5 and on the
/// other side of link_7.
const HOOKED: [[f64; JOINTS]; 3] = [
    [-0.296487333, 0.656315711, 0.263506146, -1.53374111, -0.129183971, -0.22535573, -0.197375796],
    [-0.64585684, -0.619226386, 1.598497316, -1.600271083, 1.217886628, 0.638086740, -1.142871852],
    [-0.644078051, -0.619341161, 1.6, -1.6, 1.216768504, 0.637289519, -1.142784702],
];

fn arm_and_post(time_step: f64) -> Simulation {
    let mut world = world(time_step);
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    spawn(&mut world, Spawn { passive: false, ..robot("arm", &model, DPose3::IDENTITY, true) });
    let post = solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: 0.03, length: 0.5 })], 1.0);
    spawn(&mut world, robot("post", &post, DPose3::from_translation(DVec3::new(0.55, 0.0, 0.25)), true));
    world
}

fn reset(world: &mut Simulation, positions: [f64; JOINTS], velocities: [f64; JOINTS]) {
    let joints = (0..JOINTS).map(|i| JointReset {
        joint: format!("joint_{}", i + 1),
        position: positions[i],
        velocity: velocities[i],
        ..JointReset::default()
    });
    let robots = vec![RobotReset { robot: "arm".into(), joints: joints.collect() }];
    apply(world, Command::ResetJoints { robots });
}

fn drive(world: &mut Simulation, velocities: [f64; JOINTS]) {
    let whole = Some(WholeTarget::Velocity(velocities.to_vec()));
    let robots = vec![RobotTargets { robot: "arm".into(), whole, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// Returns the largest of the joints' velocities, infinite if one is NaN.
fn speed(seen: &PublishedState) -> f64 {
    let size = |velocity: &f64| if velocity.is_finite() { velocity.abs() } else { f64::INFINITY };
    seen.velocities[..JOINTS].iter().map(size).fold(0.0, f64::max)
}

/// In the tenth step five motors reach their limits at once, of which two are enough. All five were held at
/// their limits. Then link_6, and in the next step link_7, were driven away from their targets with full
/// effort, to 703 rad/s. Eight steps later the state was not finite. Now link_6 yields at no more than 7.6
/// rad/s to stronger joints.
#[test]
fn an_arm_that_hooks_around_a_post_gains_no_speed() {
    let mut world = arm_and_post(0.01);
    reset(&mut world, HOOKED[0], HOOKED[1]);
    drive(&mut world, HOOKED[2]);
    let (mut fastest, mut most) = (0.0f64, 0);
    for step in 0..200 {
        world.step();
        let seen = look(&world);
        most = most.max(seen.contacts.len());
        fastest = fastest.max(speed(&seen));
        assert!(fastest < 10.0, "{fastest} rad/s in step {step}");
        let over = seen.efforts.iter().zip(LIMITS).map(|(effort, limit)| effort.abs() / limit);
        assert!(over.fold(0.0, f64::max) <= 1.01, "{:?}", seen.efforts);
    }
    assert!(fastest > 3.0 && most >= 3, "it is pinched: {fastest} rad/s, {most} contacts");
}

/// Starts from states near that one, with other targets each tenth of a second. Motors held at their limits
/// on the wrong side drove links to more than 30 rad/s in 230 of 300 such worlds. The worst had 873 rad/s.
/// Now none is faster than 15 rad/s in 2,000 worlds.
///
/// A motor applies at most its limit except in few steps, in which the set of saturated motors is not found
/// exactly.
#[test]
fn arms_that_are_pinched_around_a_post_are_not_thrown() {
    let count = seeds("PINCHED_ARMS", 100);
    let (mut fastest, mut largest, mut gained, mut over, mut steps) = (0.0f64, 0.0f64, 0.0f64, 0, 0);
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    for seed in 0..count {
        let rng = &mut Rng::with_seed(seed);
        let (time_step, wide) = ([0.01, 0.01, 0.002][seed as usize % 3], [0.05, 0.3][seed as usize % 2]);
        let mut near = |of: [f64; JOINTS], by: f64| of.map(|at| at + by * (2.0 * rng.f64() - 1.0));
        let mut world = arm_and_post(time_step);
        reset(&mut world, near(HOOKED[0], wide), near(HOOKED[1], 0.1));
        let mut targets = near(HOOKED[2], 0.5);
        let mut before = look(&world);
        for _ in 0..8 {
            targets = near(targets, 0.3).map(|target| target.clamp(-1.6, 1.6));
            drive(&mut world, targets);
            for _ in 0..(0.1 / time_step).round() as usize {
                world.step();
                let seen = look(&world);
                fastest = fastest.max(speed(&seen));
                assert!(fastest < 40.0, "seed {seed}: {fastest} rad/s");
                let part = |i: usize| seen.efforts[i].abs() / LIMITS[i];
                let hardest = (0..JOINTS).map(part).fold(0.0, f64::max);
                (largest, over, steps) = (largest.max(hardest), over + u32::from(hardest > 1.01), steps + 1);
                let work: f64 = (0..JOINTS)
                    .map(|i| seen.efforts[i] * 0.5 * (seen.velocities[i] + before.velocities[i]) * time_step)
                    .sum();
                gained = gained.max(energy(&model, &seen) - energy(&model, &before) - work);
                before = seen;
            }
        }
    }
    let over = f64::from(over) / f64::from(steps);
    println!("{fastest} rad/s; {largest} of the limit, beyond it in {over} of the steps; {gained} J");
    assert!(over < 2e-3 && largest < 1.5, "{over} of the steps, {largest} of the limit");
    // Measured: 0.3 J here, and 6.9 J in the worst of 2,000 worlds, in which contacts wrongly do work on the
    // arm. The reason is not known yet. A motor that was held on the wrong side gave 140 J to link_7 in a
    // step.
    let most = if count > 100 { 15.0 } else { 2.0 };
    assert!(gained < most, "{gained} J more than the motors gave");
}

/// Copies of an arm that is driven against the ground. (Those at the post are too near to it for lanes.)
#[test]
fn arms_whose_motors_saturate_have_the_same_bits_in_lanes_and_alone() {
    let copies = 64;
    let mut world = world(0.01);
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    spawn(&mut world, Spawn { passive: false, ..robot("arm", &model, DPose3::IDENTITY, true) });
    let at = DPose3::from_translation(DVec3::new(0.0, 0.0, -0.02));
    spawn(&mut world, robot("ground", &plane(DVec3::Z), at, true));
    let begin = [0.3, 1.6, 0.2, -1.2, 0.3, 0.4, 0.2];
    reset(&mut world, begin, HOOKED[1]);
    let rng = &mut Rng::with_seed(1);
    let mut near = |of: &[f64; JOINTS], by: f64, times: usize| {
        let all = of.iter().copied().cycle().take(JOINTS * times);
        all.map(|at| at + by * (2.0 * rng.f64() - 1.0)).collect::<Vec<_>>()
    };
    let of = || Named { robot: "arm".into(), names: Vec::new() };
    let request = RolloutRequest {
        copies,
        steps: 80,
        controls: vec![Control {
            robot: "arm".into(),
            joints: Vec::new(),
            mode: ControlMode::Velocity,
            values: near(&HOOKED[2], 0.5, 5 * copies),
            knots: 5,
            knot_steps: 20,
            interpolation: Interpolation::Hold,
            stiffness: Vec::new(),
            damping: Vec::new(),
            feedback: None,
        }],
        starts: vec![Start {
            robot: "arm".into(),
            positions: near(&begin, 0.5, copies),
            velocities: near(&HOOKED[1], 0.1, copies),
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
    let part = part_in_equal_lanes(&world, &request, "driven against the ground");
    assert!(!has_vectors() || part > 0.1, "{part} of the steps were done in lanes");
}
