//! Motions with a formula: each test gives the formula, its source, its tolerance and the reason for it.

mod elliptic;
mod oscillators;
mod slides_and_turns;
mod stops;
mod tops;

use glamx::DVec3;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PublishedState, Simulation};
use simd_model::RobotModel;

use simd_tests::world::{apply, leapfrog, look, passive};

/// Compares a figure with its formula. Prints both on a line that `make truth` puts into its table, and fails
/// if they differ by more than the tolerance.
pub(crate) fn met(form: &str, time_step: f64, expected: f64, found: f64, tolerance: f64) {
    let line = serde_json::json!({
        "form": form, "time_step": time_step, "expected": expected, "found": found, "tolerance": tolerance,
    });
    println!("closed form {line}");
    let apart = (found - expected).abs();
    assert!(apart <= tolerance, "{form} at {time_step} s: {found} is {apart:e} from {expected}");
}

/// Combines two runs: terms in h cancel, and those in h^2 remain (Richardson 1911).
fn extrapolated(coarse: f64, half: f64) -> f64 {
    2.0 * half - coarse
}

/// Returns a world with one passive robot called "robot", by default without gravity.
fn with(model: RobotModel, free: bool, gravity: f64, time_step: f64) -> Simulation {
    let mut world = leapfrog(time_step);
    apply(&mut world, Command::Spawn(Box::new(passive(&model.into(), free, &[]))));
    let gravity = Some(DVec3::new(0.0, 0.0, -gravity));
    apply(&mut world, Command::SetPhysics(PhysicsChange { gravity, ..PhysicsChange::default() }));
    world
}

/// Returns the same world with another integrator.
fn by(integrator: Integrator, mut world: Simulation) -> Simulation {
    let integrator = Some(integrator);
    apply(&mut world, Command::SetPhysics(PhysicsChange { integrator, ..PhysicsChange::default() }));
    world
}

fn put(world: &mut Simulation, joint: &str, position: f64, velocity: f64) {
    let joints = vec![JointReset { joint: joint.into(), axis: 0, position, velocity, ..Default::default() }];
    apply(world, Command::ResetJoints { robots: vec![RobotReset { robot: "robot".into(), joints }] });
}

fn tell(world: &mut Simulation, joint: &str, target: Target) {
    let joints = vec![JointTarget { joint: joint.into(), axis: 0, target }];
    let robots = vec![RobotTargets { robot: "robot".into(), joints, ..RobotTargets::default() }];
    apply(world, Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
}

/// Returns a spring to zero with a damper, and a force.
fn spring(stiffness: f64, damping: f64, feed_forward: f64) -> Target {
    let mut target = Target::position(0.0);
    if let Target::Position { stiffness: k, damping: c, feed_forward: f, .. } = &mut target {
        (*k, *c, *f) = (Some(stiffness), Some(damping), feed_forward);
    }
    target
}

/// Returns the published state after each of this many steps.
fn steps(world: &mut Simulation, count: usize) -> impl Iterator<Item = PublishedState> {
    (0..count).map(|_| {
        world.step();
        look(world)
    })
}
