//! Copies of a rollout in vector lanes have the bits of copies that step alone: every robot of the test assets, over a second.

use std::sync::Arc;

use glamx::DPose3;
use simd_core::collision::Shapes;
use simd_core::rollout::request::{Control, ControlMode, Interpolation, Named, Quantity, Start};
use simd_core::rollout::{Rollout, RolloutRequest};
use simd_core::simulation::command::{ContactSettings, Spawn};
use simd_core::{Command, Integrator, Simulation};
use simd_tests::robots;

use crate::world::{apply, euler, leapfrog, passive};

const COPIES: usize = 9;

fn numbers(count: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..count).map(|_| size * (2.0 * random.f64() - 1.0)).collect()
}

fn world_of(urdf: &str, integrator: Integrator, self_collision: bool) -> Simulation {
    let (model, _) = robots::read(urdf);
    let mut world = match integrator {
        Integrator::Leapfrog => leapfrog(1e-3),
        Integrator::Euler => euler(1e-3),
    };
    let spawn = Spawn {
        shapes: Arc::new(Shapes::new(&model)),
        pose: DPose3::IDENTITY,
        passive: false,
        contact_settings: ContactSettings { self_collision, ..ContactSettings::default() },
        ..passive(&model, false, &[])
    };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    world
}

/// Joints are driven to their limits and beyond, from any pose, so that efforts saturate and bodies come near each other.
fn request(world: &Simulation, mode: ControlMode) -> RolloutRequest {
    let entity = &world.layout().entities[0];
    let joints = (0..entity.model.joints.len()).filter(|joint| entity.tree.has_one_axis(*joint)).count();
    let of = || Named { robot: "robot".into(), names: Vec::new() };
    let size = if mode == ControlMode::Effort { 60.0 } else { 3.0 };
    RolloutRequest {
        copies: COPIES,
        steps: 1000,
        controls: vec![Control {
            robot: "robot".into(),
            joints: Vec::new(),
            mode,
            values: numbers(COPIES * 5 * joints, size, 1),
            knots: 5,
            knot_steps: 250,
            interpolation: Interpolation::Hold,
            stiffness: Vec::new(),
            damping: Vec::new(),
            feedback: None,
        }],
        starts: vec![Start {
            robot: "robot".into(),
            positions: numbers(COPIES * joints, 0.5, 2),
            velocities: numbers(COPIES * joints, 1.0, 3),
            ..Start::default()
        }],
        quantities: vec![
            Quantity::JointPositions(of()),
            Quantity::JointVelocities(of()),
            Quantity::JointEfforts(of()),
            Quantity::ContactCount("robot".into()),
        ],
        record_every: 10,
        ..RolloutRequest::default()
    }
}

fn bits(rollout: &Rollout) -> Vec<u64> {
    let mut worker = rollout.worker();
    let batches = (0..rollout.batches()).filter_map(|batch| rollout.advance(&mut worker, batch, &|| false));
    batches.flat_map(|batch| batch.states).map(f64::to_bits).collect()
}

#[test]
fn every_robot_has_the_same_bits_in_lanes_and_alone() {
    let mut in_lanes = Vec::new();
    for urdf in [
        "seven_arm/urdf/seven_arm.urdf",
        "branching/urdf/branching.urdf",
        "humanoid/urdf/humanoid.urdf",
        "planar/urdf/planar.urdf",
        "Two Link.v2/urdf/Two Link.v2.urdf",
        "Bench_Arm-1.2 rev B/urdf/Bench_Arm-1.2 rev B.urdf",
    ] {
        for (integrator, self_collision, modes) in [
            (
                Integrator::Leapfrog,
                false,
                &[ControlMode::Position, ControlMode::Velocity, ControlMode::Effort][..],
            ),
            (Integrator::Leapfrog, true, &[ControlMode::Position][..]),
            (Integrator::Euler, false, &[ControlMode::Effort][..]),
        ] {
            let world = world_of(urdf, integrator, self_collision);
            for &mode in modes {
                let rollout = || Rollout::new(world.to_saved(), request(&world, mode), u64::MAX).unwrap();
                if rollout().steps_in_lanes() {
                    in_lanes.push(urdf);
                }
                let alone = bits(&rollout().without_lanes());
                let beside = bits(&rollout());
                let first = alone.iter().zip(&beside).position(|(a, b)| a != b);
                assert_eq!(first, None, "{urdf} {integrator:?} {self_collision} {mode:?}");
            }
        }
    }
    in_lanes.dedup();
    assert!(in_lanes.len() >= 3 && in_lanes.contains(&"seven_arm/urdf/seven_arm.urdf"), "{in_lanes:?}");
}
