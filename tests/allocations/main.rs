//! A step allocates nothing once the world has run for a while.

use std::sync::Arc;

use allocation_counter::measure;
use glamx::DPose3;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, PhysicsSettings, Simulation, Snapshot};
use simd_model::RobotModel;
use simd_model::robot::{JointKind, Limits};
use simd_tests::robots;

/// Steps before counting: constraints reach their largest size in them.
const WARM_UP: usize = 500;
/// Steps that are counted.
const COUNTED: usize = 1_000;

fn apply(world: &mut Simulation, command: Command) {
    if let Err(error) = world.apply(&command) {
        panic!("{error}");
    }
}

fn spawn(world: &mut Simulation, name: &str, model: &Arc<RobotModel>, fixed: bool, passive: bool) {
    let spawn = Spawn {
        name: name.into(),
        allow_renaming: false,
        model: Arc::clone(model),
        pose: DPose3::IDENTITY,
        fixed_base: Some(fixed),
        passive,
        joint_positions: Vec::new(),
        loaded_at_start: false,
    };
    apply(world, Command::Spawn(Box::new(spawn)));
}

/// Gives each joint that moves dry friction and narrow limits, and the effort that these leave it.
fn hinder(world: &mut Simulation, robot: &str, model: &RobotModel) {
    let axes = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let joints = axes.map(|joint| JointProperties {
        joint: joint.name.clone(),
        friction: Some(0.2),
        limits: Some(Limits { lower: Some(-0.05), upper: Some(0.05), ..joint.limits }),
        ..JointProperties::default()
    });
    apply(world, Command::SetJointProperties { robot: robot.into(), joints: joints.collect() });
}

/// An arm and a branching tree, fixed and free, driven and hanging into their limits, with dry friction.
fn busy_world() -> Simulation {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    for urdf in ["seven_arm/urdf/seven_arm.urdf", "branching/urdf/branching.urdf"] {
        let (model, _) = robots::read(urdf);
        for (passive, fixed) in [(false, true), (true, true), (false, false), (true, false)] {
            let name = format!("{}-{passive}-{fixed}", model.name);
            spawn(&mut world, &name, &model, fixed, passive);
            hinder(&mut world, &name, &model);
        }
    }
    world
}

/// Zero is exact: nothing else runs on this thread, and the counter is the thread's own.
#[test]
fn a_step_allocates_nothing() {
    let mut world = busy_world();
    (0..WARM_UP).for_each(|_| world.step());
    let seen = measure(|| (0..COUNTED).for_each(|_| world.step()));
    assert_eq!(seen.count_total, 0, "{seen:?}");
}

#[test]
fn observing_into_a_used_snapshot_allocates_nothing() {
    let mut world = busy_world();
    let mut snapshot = Snapshot::default();
    world.observe(&mut snapshot);
    let seen = measure(|| {
        for _ in 0..COUNTED {
            world.step();
            world.observe(&mut snapshot);
        }
    });
    // The world is young: its constraints may still grow, so that steps are not counted apart here.
    let steps = measure(|| world.observe(&mut snapshot));
    assert_eq!(steps.count_total, 0, "{steps:?} after {seen:?}");
}
