//! Constraints that a robot cannot meet: places that it does not reach, and two of them for one link. `CONSTRAINED_WORLDS` of the
//! environment gives another number of seeds.

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation};

use crate::constraints::{energy, held, kind, tree, vector};

const G: f64 = 9.81;

/// A robot without dampers, and two or three constraints that want its links a metre away from where they are.
fn world(rng: &mut Rng) -> Simulation {
    let settings = PhysicsSettings {
        time_step: 1e-3,
        integrator: Integrator::Leapfrog,
        gravity: DVec3::new(0.0, 0.0, -G),
        ..PhysicsSettings::default()
    };
    let mut world = Simulation::new(settings, WorldLimits::default());
    let model = tree(rng);
    let links = model.links.len();
    let pose = |rng: &mut Rng, size| {
        DPose3::from_parts(vector(rng, size), DQuat::from_scaled_axis(vector(rng, 3.0)))
    };
    let spawn = Spawn {
        name: "robot".into(),
        allow_renaming: false,
        model,
        pose: pose(rng, 0.5),
        fixed_base: Some(rng.bool()),
        passive: true,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        shapes: Default::default(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        loaded_at_start: false,
    };
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
    for _ in 0..rng.usize(2..=3) {
        let link = format!("link-{}", rng.usize(0..links));
        let parent = RequestedEnd { pose: Some(pose(rng, 1.0)), ..RequestedEnd::default() };
        let pose = Some(pose(rng, 0.1));
        let child = RequestedEnd { robot: "robot".into(), link, pose, ..RequestedEnd::default() };
        // A link that cannot move: refused.
        let _ = world.apply(&Command::CreateConstraint(Box::new(held(kind(rng), parent, child))));
    }
    world
}

/// What pulls them together at 10 m/s leaves them in motion, as nothing damps them; but no world bursts, and what does not hold is
/// reported.
#[test]
fn what_a_robot_cannot_meet_does_not_tear_it_apart() {
    let seeds = std::env::var("CONSTRAINED_WORLDS").ok().and_then(|count| count.parse().ok()).unwrap_or(60);
    let (mut reported, mut fast) = (0, 0);
    for seed in 0..seeds {
        let mut world = world(&mut Rng::with_seed(seed));
        let mut state = PublishedState::default();
        for _ in 0..1_500 {
            world.step();
            world.observe(&mut state);
            assert!(state.roots[0].disabled.is_none(), "{seed}: {:?}", state.roots[0].disabled);
        }
        let (kinetic, _) = energy(&state);
        fast += u64::from(kinetic > 1e4);
        for of in &state.constraint_states {
            if of.position_error > 0.01 {
                reported += usize::from(of.velocity_residual > 1e-3);
            }
        }
    }
    assert!(reported > seeds as usize / 4, "{reported}");
    assert!(fast <= seeds / 20, "{fast} worlds have links at hundreds of metres a second");
}
