//! The content of an untrusted saved state file: hash and header are right, the rest need not be.

use std::collections::BTreeMap;
use std::sync::Arc;

use simd_core::collision::Shapes;
use simd_core::simulation::{RobotParts, Saved, WorldLimits};
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, ReadOptions};
use simd_world::loading::saved_state_file::{Content, RobotSource, open, seal, seal_encoded};

/// Robots that the world takes.
const ROBOTS: usize = 20;
/// Steps of a world that was accepted.
const STEPS: usize = 20;

/// A file is refused with a sentence, or gives a world that can be restored, stepped and written again. Its
/// positions and velocities stay finite. Returns true if it was stepped.
pub fn saved_states(bytes: &[u8]) -> bool {
    // As a file it is either not a saved state, or a whole one.
    drop(open(bytes, ROBOTS));
    let file = match open(&seal_encoded(bytes), ROBOTS) {
        Ok(opened) => opened.content,
        Err(refused) => {
            assert!(!refused.to_string().is_empty(), "a refusal says why");
            return false;
        }
    };
    let sources: Vec<RobotSource> = file.robots.iter().map(|robot| robot.source.clone()).collect();
    let Some(made) = made(&file, &sources) else { return false };
    let saved = match file.into_saved(made) {
        Ok(saved) => saved,
        Err(refused) => {
            assert!(!refused.to_string().is_empty(), "a refusal says why");
            return false;
        }
    };
    check_again(&saved, &sources);
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

/// An accepted state is written and accepted once more.
fn check_again(saved: &Saved, sources: &[RobotSource]) {
    let file = seal(&Content::new("it", saved, sources.to_vec(), Vec::new()));
    let content = open(&file, ROBOTS).map(|opened| opened.content);
    let again = content.ok().and_then(|content| content.into_saved(saved.parts()).ok());
    assert!(again.is_some(), "what is written is accepted");
}

/// Returns the robots of a file, if they can be read.
fn made(file: &Content, sources: &[RobotSource]) -> Option<Vec<RobotParts>> {
    let files: BTreeMap<Sha256, Arc<[u8]>> =
        file.files.iter().map(|bytes| (Sha256::of(bytes), Arc::clone(bytes))).collect();
    sources.iter().map(|source| make(source, &files)).collect()
}

fn make(source: &RobotSource, files: &BTreeMap<Sha256, Arc<[u8]>>) -> Option<RobotParts> {
    let find = |(uri, sha256): (&String, &Sha256)| {
        Some((uri.clone(), Asset { sha256: *sha256, bytes: files.get(sha256)?.clone() }))
    };
    let sent = Sent(source.assets.iter().filter_map(find).collect());
    let options = ReadOptions { scale: f64::from_bits(source.scale), ..ReadOptions::default() };
    let (model, _) = simd_model::read(files.get(&source.description)?, &sent, &options).ok()?;
    let shapes = Shapes::reusing(&model, source.fixed_base, source.mesh_shapes, &[]);
    Some((Arc::new(model), Arc::new(shapes)))
}

struct Sent(BTreeMap<String, Asset>);

impl Assets for Sent {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.0.get(uri).cloned().ok_or_else(Vec::new)
    }
}
