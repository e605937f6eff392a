//! Building, stepping and reading a world.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;

/// Returns an empty world with this time step.
pub fn world(time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

/// Returns an empty world with the leapfrog integrator.
pub fn leapfrog(time_step: f64) -> Simulation {
    let settings =
        PhysicsSettings { time_step, integrator: Integrator::Leapfrog, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

/// Returns an empty world with MuJoCo's Euler.
pub fn euler(time_step: f64) -> Simulation {
    let settings = PhysicsSettings { time_step, integrator: Integrator::Euler, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

/// Returns a passive robot called "robot", fixed or free, at the origin.
pub fn passive(model: &Arc<RobotModel>, free: bool, positions: &[f64]) -> Spawn {
    let moving = model.joints.iter().filter(|joint| joint.kind != simd_model::robot::JointKind::Fixed);
    Spawn {
        name: "robot".into(),
        allow_renaming: false,
        model: Arc::clone(model),
        pose: DPose3::IDENTITY,
        fixed_base: Some(!free),
        passive: true,
        joint_positions: moving.map(|joint| joint.name.clone()).zip(positions.iter().copied()).collect(),
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    }
}

/// Applies a command.
///
/// # Panics
/// Panics if the world refuses it.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn apply(world: &mut Simulation, command: Command) {
    if let Err(error) = world.apply(&command) {
        panic!("{error}");
    }
}

/// Returns the published state of the world.
pub fn look(world: &Simulation) -> PublishedState {
    let mut state = PublishedState::default();
    world.observe(&mut state);
    state
}

/// Steps for this many simulated seconds, and returns the published state.
pub fn run(world: &mut Simulation, seconds: f64) -> PublishedState {
    for _ in 0..(seconds / world.settings().time_step).round() as u64 {
        world.step();
    }
    look(world)
}

/// Returns a pose without a turn, m.
pub fn at(x: f64, y: f64, z: f64) -> DPose3 {
    DPose3::from_translation(DVec3::new(x, y, z))
}
