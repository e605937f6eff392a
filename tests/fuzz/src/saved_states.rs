//! What is in a saved state's file, as an untrusted client may write it: hash and header are right, the rest is not.

use std::collections::BTreeMap;
use std::sync::Arc;

use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::{Saved, world_state::WorldState};
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, ReadOptions};
use simd_proto::v1;
use simd_server::convert::from_proto::saved_state_file::{Made, recipes, world_state};
use simd_server::convert::to_proto::saved_state_file::{Recipe, saved_state_file};
use simd_server::loading::saved_state_file::{open, seal, seal_encoded};

/// Robots that the world takes.
const ROBOTS: usize = 20;
/// Steps of a world that was accepted.
const STEPS: usize = 20;

/// A file is refused in a sentence, or gives a world that can be gone to, stepped and written again,
/// and whose positions and velocities stay numbers. Says whether it was stepped.
pub fn saved_states(bytes: &[u8]) -> bool {
    // As a file it is no saved state, or a whole one.
    drop(open(bytes, ROBOTS));
    let file = match open(&seal_encoded(bytes), ROBOTS) {
        Ok(opened) => opened.content,
        Err(refused) => {
            assert!(!refused.to_string().is_empty(), "a refusal says why");
            return false;
        }
    };
    let Ok(recipes) = recipes(&file) else { return false };
    let Some(state) = state(file, &recipes) else { return false };
    let saved = match Saved::new(state) {
        Ok(saved) => saved,
        Err(invalid) => {
            assert!(!invalid.to_string().is_empty(), "a refusal says why");
            return false;
        }
    };
    check_again(&saved, &recipes);
    let mut world =
        Simulation::new(PhysicsSettings::default(), WorldLimits { robots: ROBOTS, saved_states: 2 });
    for command in
        [Command::ImportSavedState { name: "it".into(), saved }, Command::RestoreState { name: "it".into() }]
    {
        let applied = world.apply(&command);
        assert!(applied.is_ok(), "what was accepted is gone to: {applied:?}");
    }
    for _ in 0..STEPS {
        world.step();
        let mut seen = PublishedState::default();
        world.observe(&mut seen);
        let numbers = seen.positions.iter().chain(&seen.velocities);
        assert!(numbers.into_iter().all(|value| value.is_finite()), "positions and velocities are numbers");
        assert!(seen.roots.iter().all(|root| root.pose.is_finite()), "and so are places");
    }
    true
}

/// What is accepted is written and accepted once more.
fn check_again(saved: &Saved, recipes: &[Recipe]) {
    let file = seal(&saved_state_file("it", &saved.world_state(), recipes, Vec::new()));
    let content = open(&file, ROBOTS).map(|opened| opened.content);
    let states = saved.world_state().robots.into_iter();
    let made = states.map(|robot| (robot.model, robot.shapes)).collect();
    let again = content.ok().and_then(|content| world_state(content, made).ok());
    assert!(again.is_some_and(|state| Saved::new(state).is_ok()), "what is written is accepted");
}

/// The state in a file whose robots can be read.
fn state(mut file: v1::SavedStateFile, recipes: &[Recipe]) -> Option<WorldState> {
    let files: BTreeMap<Sha256, Arc<[u8]>> =
        file.files.drain(..).map(|bytes| (Sha256::of(&bytes), Arc::from(bytes))).collect();
    let made: Option<Vec<Made>> = recipes.iter().map(|recipe| make(recipe, &files)).collect();
    world_state(file, made?).ok()
}

fn make(recipe: &Recipe, files: &BTreeMap<Sha256, Arc<[u8]>>) -> Option<Made> {
    let find = |(uri, sha256): (&String, &Sha256)| {
        Some((uri.clone(), Asset { sha256: *sha256, bytes: files.get(sha256)?.clone() }))
    };
    let sent = Sent(recipe.assets.iter().filter_map(find).collect());
    let options = ReadOptions { scale: f64::from_bits(recipe.scale), ..ReadOptions::default() };
    let (model, _) = simd_model::read(files.get(&recipe.description)?, &sent, &options).ok()?;
    let shapes = Shapes::reusing(&model, recipe.mesh_shapes, &[]);
    Some((Arc::new(model), Arc::new(shapes)))
}

struct Sent(BTreeMap<String, Asset>);

impl Assets for Sent {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.0.get(uri).cloned().ok_or_else(Vec::new)
    }
}
