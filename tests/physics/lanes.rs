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
        for (integrator, self_collision) in
            [(Integrator::Leapfrog, false), (Integrator::Leapfrog, true), (Integrator::Euler, false)]
        {
            let world = world_of(urdf, integrator, self_collision);
            for mode in [ControlMode::Position, ControlMode::Velocity, ControlMode::Effort] {
                let rollout = || Rollout::new(world.snapshot(), request(&world, mode), u64::MAX).unwrap();
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

// TEMP
#[test]
#[ignore = "prints figures"]
fn figures_of_lanes() {
    for urdf in ["seven_arm/urdf/seven_arm.urdf", "branching/urdf/branching.urdf"] {
        let world = world_of(urdf, Integrator::Leapfrog, false);
        for (mode, costs, cubic) in [
            (ControlMode::Position, false, false),
            (ControlMode::Position, true, false),
            (ControlMode::Effort, false, false),
            (ControlMode::Position, false, true),
        ] {
            let make = || {
                let mut asked = request(&world, mode);
                asked.steps = 1000;
                asked.quantities.clear();
                asked.controls[0].values.iter_mut().for_each(|value| *value /= 6.0);
                if cubic {
                    asked.controls[0].interpolation = Interpolation::Cubic;
                }
                if costs {
                    asked.costs = vec![simd_core::rollout::request::CostTerm {
                        weight: 1.0,
                        final_weight: 0.0,
                        of: simd_core::rollout::request::Cost::JointPositions {
                            joints: Named { robot: "robot".into(), names: Vec::new() },
                            targets: Vec::new(),
                            wrapped: false,
                        },
                    }];
                }
                Rollout::new(world.snapshot(), asked, u64::MAX).unwrap()
            };
            let mut best = [f64::INFINITY; 2];
            for _ in 0..9 {
                for (best, rollout) in best.iter_mut().zip([make().without_lanes(), make()]) {
                    let mut worker = rollout.worker();
                    let begun = std::time::Instant::now();
                    std::hint::black_box(rollout.advance(&mut worker, 0, &|| false));
                    *best = best.min(begun.elapsed().as_secs_f64() / 8e3 * 1e6);
                }
            }
            println!("{urdf} {mode:?} costs {costs} cubic {cubic}: us an arm-step {best:.3?}");
        }
    }
}
