//! Copies of a rollout in vector lanes have the bits of copies that step alone: every robot of the test
//! assets, over a second.

use std::sync::Arc;

use glamx::DPose3;
use simd_core::collision::Shapes;
use simd_core::rollout::request::{
    Control, ControlMode, Interpolation, Named, Quantity, Start, Values, Variation, Varied,
};
use simd_core::rollout::{Rollout, RolloutRequest};
use simd_core::simulation::command::{ContactSettings, Spawn};
use simd_core::{Command, Integrator, Simulation};
use simd_tests::robots;

use crate::truth;
use simd_tests::world::{apply, euler, leapfrog, passive};

const COPIES: usize = 9;

fn numbers(count: usize, size: f64, seed: u64) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..count).map(|_| size * (2.0 * random.f64() - 1.0)).collect()
}

fn world_of(urdf: &str, integrator: Integrator, self_collision: bool) -> Simulation {
    let (model, _) = robots::read(urdf);
    let mut world = match integrator {
        Integrator::Leapfrog => leapfrog(1e-3),
        Integrator::Euler | Integrator::Bullet(_) => euler(1e-3),
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

/// Returns the number of joints of one axis that follow no other.
fn joints(world: &Simulation) -> usize {
    let entity = &world.layout().entities[0];
    let is_driven =
        |joint: &usize| entity.tree.has_one_axis(*joint) && entity.model.joints[*joint].mimic.is_none();
    (0..entity.model.joints.len()).filter(is_driven).count()
}

/// Joints are driven to their limits and beyond, from any pose, so that efforts saturate and bodies come near
/// each other.
fn request(world: &Simulation, mode: ControlMode) -> RolloutRequest {
    let joints = joints(world);
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

/// Returns the bits of all states, and the part of the steps that were done in lanes.
pub(crate) fn computed(rollout: &Rollout) -> (Vec<u64>, f64) {
    let mut worker = rollout.worker();
    let batches = (0..rollout.batches()).filter_map(|batch| rollout.advance(&mut worker, batch, &|| false));
    let (mut bits, mut in_lanes, mut steps) = (Vec::new(), 0, 0);
    for batch in batches {
        bits.extend(batch.states.iter().map(|number| number.to_bits()));
        in_lanes += batch.lane_steps;
        steps += batch.steps_done.iter().sum::<u64>();
    }
    (bits, in_lanes as f64 / steps.max(1) as f64)
}

/// Checks that copies of a rollout have the same bits in lanes and alone. Returns the part of their steps
/// that was done in lanes.
pub(crate) fn part_in_equal_lanes(world: &Simulation, request: &RolloutRequest, what: &str) -> f64 {
    let rollout = || Rollout::new(world.to_saved(), request.clone(), u64::MAX).unwrap();
    let ((alone, none), (beside, part)) = (computed(&rollout().without_lanes()), computed(&rollout()));
    assert_eq!(none, 0.0);
    let first = alone.iter().zip(&beside).position(|(a, b)| a != b);
    assert_eq!((first, alone.len()), (None, beside.len()), "{what}");
    part
}

/// Returns whether this processor has vectors in which copies step at once.
pub(crate) fn has_vectors() -> bool {
    #[cfg(target_arch = "x86_64")]
    let has = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    let has = false;
    has
}

#[test]
fn every_robot_has_the_same_bits_in_lanes_and_alone() {
    let (mut in_lanes, mut most) = (Vec::new(), 0.0);
    for urdf in [
        "seven_arm/urdf/seven_arm.urdf",
        "branching/urdf/branching.urdf",
        "humanoid/urdf/humanoid.urdf",
        "planar/urdf/planar.urdf",
        "Two Link.v2/urdf/Two Link.v2.urdf",
        "Bench_Arm-1.2 rev B/urdf/Bench_Arm-1.2 rev B.urdf",
        "../reference/robots/double_pendulum.urdf",
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
                let (alone, none) = computed(&rollout().without_lanes());
                let (beside, part) = computed(&rollout());
                assert_eq!(none, 0.0);
                if urdf.starts_with("seven_arm") {
                    most = f64::max(most, part);
                }
                let first = alone.iter().zip(&beside).position(|(a, b)| a != b);
                assert_eq!(first, None, "{urdf} {integrator:?} {self_collision} {mode:?}");
            }
        }
    }
    in_lanes.dedup();
    assert!(in_lanes.len() >= 3 && in_lanes.contains(&"seven_arm/urdf/seven_arm.urdf"), "{in_lanes:?}");
    assert!(!has_vectors() || most > 0.5, "{most} of the steps of the arm were done in lanes");
}

/// The robots of `make truth`, with their initial states except for the velocities: undriven for a second,
/// and driven by each kind of targets.
#[test]
fn every_case_of_the_truth_table_has_the_same_bits_in_lanes_and_alone() {
    let (mut in_lanes, mut really) = (Vec::new(), Vec::new());
    for case in truth::cases().into_iter().filter(|case| !case.urdf.starts_with("pybullet_data")) {
        let world = case.world(Integrator::Leapfrog, 1e-3);
        let modes: &[Option<ControlMode>] = match joints(&world) {
            0 => &[None],
            _ => &[None, Some(ControlMode::Position), Some(ControlMode::Velocity), Some(ControlMode::Effort)],
        };
        for &mode in modes {
            let mut request = request(&world, mode.unwrap_or_default());
            if mode.is_none() {
                request.controls.clear();
            }
            request.starts.clear();
            request.variations = vec![Variation {
                of: Varied::JointVelocities(Named { robot: "robot".into(), names: Vec::new() }),
                values: Values::Uniform { low: -1.0, high: 1.0 },
            }];
            request.quantities.push(Quantity::RootPose("robot".into()));
            if Rollout::new(world.to_saved(), request.clone(), u64::MAX).unwrap().steps_in_lanes() {
                in_lanes.push(case.name.clone());
            }
            if part_in_equal_lanes(&world, &request, &format!("{} {mode:?}", case.name)) > 0.25 {
                really.push(case.name.clone());
            }
        }
    }
    in_lanes.dedup();
    for name in ["seven_arm", "branching in flight", "heavy top, nutating"] {
        assert!(in_lanes.iter().any(|case| case == name), "{name} of {in_lanes:?}");
        let is_really = really.iter().any(|case| case == name);
        assert!(!has_vectors() || is_really, "{name} of {really:?}: a quarter of the steps in lanes");
    }
}
