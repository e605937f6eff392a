//! Microseconds per step of the seven-joint arm.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use glamx::DPose3;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_tests::robots;
use simd_tests::statistics::Spread;

const BATCHES: usize = 40;
const STEPS: usize = 2_000;

/// Prints the table.
pub(crate) fn print() {
    let (model, _) = robots::read("seven_arm/urdf/seven_arm.urdf");
    println!("seven-joint arm, 1 ms, one thread: microseconds a step (median of {BATCHES} batches)");
    // Passive arms swing into their limits, whose rows are solved in each step near a limit; arms that hold
    // their pose are near none.
    for (name, arms, driven, observed) in [
        ("passive, swinging into limits", 1, false, false),
        ("actuators and limits", 1, true, false),
        ("actuators, limits, published state", 1, true, true),
        ("the same, 10 arms", 10, true, true),
        ("the same, 100 arms", 100, true, true),
    ] {
        let mut world = world(&model, arms, driven);
        let mut state = PublishedState::default();
        let steps = STEPS / arms.min(20);
        let batches = (0..BATCHES).map(|_| {
            let start = Instant::now();
            for _ in 0..steps {
                world.step();
                if observed {
                    world.observe(black_box(&mut state));
                }
            }
            start.elapsed().as_secs_f64() * 1e6 / steps as f64
        });
        println!("  {name:30} {}", Spread::of(batches.collect()));
    }
}

/// Returns a world of this many arms, driven or passive.
pub(crate) fn world(model: &Arc<RobotModel>, arms: usize, driven: bool) -> Simulation {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    for i in 0..arms {
        let bent = [0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4];
        let moving = model.joints.iter().filter(|j| j.kind != simd_model::robot::JointKind::Fixed);
        let spawn = Spawn {
            name: format!("arm-{i}"),
            allow_renaming: false,
            model: Arc::clone(model),
            pose: DPose3::IDENTITY,
            fixed_base: Some(true),
            passive: !driven,
            joint_positions: moving.map(|j| j.name.clone()).zip(bent).collect(),
            joint_orientations: Vec::new(),
            shapes: Default::default(),
            contact_settings: Default::default(),
            collision_pairs: Vec::new(),
            free_place: Default::default(),
            loaded_at_start: false,
        };
        assert!(world.apply(&Command::Spawn(Box::new(spawn))).is_ok());
    }
    world
}
