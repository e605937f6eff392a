//! Facts about a state that copies start from.

use super::super::start_state::StartFacts;
use super::*;
use crate::simulation::command::{JointReset, RobotReset};

fn facts(world: &Simulation) -> StartFacts {
    StartFacts::of(&world.to_saved())
}

/// Returns a world with only the arm, at its start.
fn lone(masses: [f64; 2]) -> Simulation {
    lone_with(PhysicsSettings::default(), masses)
}

fn lone_with(settings: PhysicsSettings, masses: [f64; 2]) -> Simulation {
    let mut world = Simulation::new(settings, WorldLimits::default());
    world.apply(&spawn("arm", arm(masses), true, DVec3::ZERO)).unwrap();
    world
}

#[test]
fn states_of_one_moment_that_differ_have_other_fingerprints() {
    let one = facts(&lone([1.0, 0.5]));
    assert_eq!(facts(&lone([1.0, 0.5])), one, "of equal states it is equal");
    let mut turned = lone([1.0, 0.5]);
    let joint = JointReset { joint: "elbow".into(), position: 0.3, ..JointReset::default() };
    let robots = vec![RobotReset { robot: "arm".into(), joints: vec![joint] }];
    turned.apply(&Command::ResetJoints { robots }).unwrap();
    let slower = PhysicsSettings { time_step: 2e-3, ..PhysicsSettings::default() };
    let slower = lone_with(slower, [1.0, 0.5]);
    let heavier = lone([1.0, 0.6]);
    let others = [facts(&turned), facts(&slower), facts(&heavier)].map(|facts| facts.fingerprint);
    assert!(!others.contains(&one.fingerprint), "{others:?}, {one:?}");
}

#[test]
fn a_world_of_more_robots_takes_more_memory() {
    let [small, large] = [facts(&lone([1.0, 0.5])), facts(&world())].map(|facts| facts.world_bytes);
    assert!(small > 500 && large > small, "{small}, {large}");
}
