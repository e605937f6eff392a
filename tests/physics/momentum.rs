//! Internal forces of a floating robot do not move its centre of mass, whatever its actuators do.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link};
use simd_tests::world::{apply, look, passive};

use crate::seeds::{held, seeds};

/// Kind of drive of the joints.
#[derive(Clone, Copy, Debug)]
enum Drive {
    /// Position targets with these parts of the default stiffness, or the defaults.
    Positions(Option<f64>),
    /// Efforts.
    Efforts,
}

/// A robot and its drive.
#[derive(Clone, Debug)]
struct Scene {
    model: Arc<RobotModel>,
    drive: Drive,
    /// Seconds between targets.
    every: f64,
    /// Targets jump randomly instead of following sines.
    jumps: bool,
    seed: u64,
}

fn direction(rng: &mut Rng) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5).try_normalize().unwrap_or(DVec3::X)
}

/// Returns a tree of 3 to 10 links from 0.1 to 5 kg whose joints turn or slide, some of them with limits.
fn tree(rng: &mut Rng, limited: bool) -> RobotModel {
    let count = rng.usize(3..=10);
    let link = |rng: &mut Rng, index: usize| {
        let mass = 0.1 * 50f64.powf(rng.f64());
        let size = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 0.2 + 0.1;
        let squares = size * size;
        let moments = DVec3::new(squares.y + squares.z, squares.z + squares.x, squares.x + squares.y);
        let inertial = Inertial {
            mass,
            center_of_mass: direction(rng) * (0.15 * rng.f64()),
            inertia: DMat3::from_diagonal(moments * (mass / 12.0)),
        };
        Link { name: format!("link-{index}"), inertial, visuals: Vec::new(), collisions: Vec::new() }
    };
    let links: Vec<Link> = (0..count).map(|index| link(rng, index)).collect();
    let joint = |rng: &mut Rng, child: usize| {
        let slides = rng.u8(0..6) == 0;
        let kind = match (slides, limited) {
            (true, _) => JointKind::Prismatic,
            (false, true) => JointKind::Revolute,
            (false, false) => JointKind::Continuous,
        };
        let limit = (limited || slides).then_some(if slides { 0.2 } else { 0.3 });
        Joint {
            name: format!("joint-{child}"),
            kind,
            parent: if rng.u8(0..3) == 0 { rng.usize(0..child) } else { child - 1 },
            child,
            parent_from_joint: DPose3::from_parts(
                direction(rng) * 0.3,
                DQuat::from_scaled_axis(direction(rng) * rng.f64()),
            ),
            axis: direction(rng),
            limits: JointLimits {
                lower: limit.map(|limit| -limit),
                upper: limit,
                effort: limited.then(|| 5.0 + 100.0 * rng.f64()),
                velocity: None,
            },
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        }
    };
    let joints = (1..count).map(|child| joint(rng, child)).collect();
    RobotModel { name: "tree".into(), links, joints, ..RobotModel::default() }
}

fn scene(seed: u64) -> Scene {
    let mut rng = Rng::with_seed(seed);
    let limited = rng.u8(0..3) == 0;
    let model = Arc::new(tree(&mut rng, limited));
    let drive = match rng.u8(0..4) {
        0 => Drive::Efforts,
        1 => Drive::Positions(None),
        _ => Drive::Positions(Some(10f64.powf(6.0 * rng.f64()))),
    };
    let every = [1e-3, 3e-3, 1e-2, 1e-1][rng.usize(0..4)];
    Scene { model, drive, every, jumps: rng.bool(), seed }
}

/// Returns the place of the centre of mass, and the mass.
fn centre(world: &Simulation, model: &RobotModel) -> (DVec3, f64) {
    let poses = look(world).link_poses(0).unwrap();
    let mut sum = (DVec3::ZERO, 0.0);
    for (link, pose) in model.links.iter().zip(poses) {
        let mass = link.inertial.mass;
        sum = (sum.0 + pose.transform_point(link.inertial.center_of_mass) * mass, sum.1 + mass);
    }
    (sum.0 / sum.1, sum.1)
}

/// Returns the drift of the centre of mass in a second, metres.
fn drift(scene: &Scene, integrator: Integrator, time_step: f64) -> f64 {
    let settings =
        PhysicsSettings { time_step, integrator, gravity: DVec3::ZERO, ..PhysicsSettings::default() };
    let mut world = Simulation::new(settings, WorldLimits::default());
    let Scene { model, drive, every, jumps, seed } = scene;
    let mut rng = Rng::with_seed(seed + 1_000_000);
    apply(&mut world, Command::Spawn(Box::new(Spawn { passive: false, ..passive(model, true, &[]) })));
    let (start, _) = centre(&world, model);
    for turn in 0..(1.0 / every).round() as u64 {
        let joints = model.joints.iter().enumerate().map(|(index, joint)| {
            let (rate, phase) = (1.0 + (index % 3) as f64, index as f64);
            let time = turn as f64 * every;
            let size = if joint.kind == JointKind::Prismatic { 0.1 } else { 0.5 };
            let value = if *jumps {
                size * (rng.f64() - 0.5)
            } else {
                size * ((rate * time + phase).sin() - phase.sin())
            };
            let target = match drive {
                Drive::Efforts => Target::Effort(4.0 * value),
                Drive::Positions(gain) => Target::Position {
                    position: value,
                    velocity: 0.0,
                    stiffness: gain.map(|gain| gain * 0.05),
                    damping: None,
                    feed_forward: 0.0,
                    max_effort: None,
                    max_velocity: None,
                },
            };
            JointTarget { joint: joint.name.clone(), axis: 0, target }
        });
        let robots =
            vec![RobotTargets { robot: "robot".into(), joints: joints.collect(), ..Default::default() }];
        apply(
            &mut world,
            Command::SetTargets(SetTargets { robots, refuse_beyond_limits: false, source: None }),
        );
        for _ in 0..(every / time_step).round() as u64 {
            world.step();
        }
    }
    (centre(&world, model).0 - start).length()
}

/// At most the drift of Euler, in every case, except for 0.1 mm in a second, the error of smooth steps.
#[test]
fn the_centre_of_mass_of_a_floating_robot_drifts_no_more_than_with_euler() {
    let count = seeds("FLOATING_TREES", 24);
    let (mut largest, mut failed) = (0.0f64, Vec::new());
    for seed in 0..count {
        let scene = scene(seed);
        let [leapfrog, euler] =
            [Integrator::Leapfrog, Integrator::Euler].map(|integrator| drift(&scene, integrator, 1e-3));
        let part = leapfrog / (euler + 1e-4);
        largest = largest.max(part);
        if part.is_nan() || part > 1.0 {
            let Scene { drive, every, jumps, .. } = &scene;
            println!(
                "seed {seed}: {drive:?} each {every} s, jumps {jumps}: {leapfrog:e} m, Euler {euler:e} m"
            );
            failed.push(seed);
        }
    }
    held("a floating robot's centre of mass drifts at most as with Euler", count, largest, &failed);
}
