//! State that copies start from as a whole: its fingerprint, and the approximate memory of a world in it.

use super::draw::mixed_into;
use crate::simulation::Saved;
use crate::simulation::world_state::{RobotState, encoded};

/// Memory of a world, scratch and shapes included, as a multiple of its state's bytes.
const WORLD_BYTES: usize = 4;

/// Facts about a state that copies start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct StartFacts {
    /// Fingerprint, equal if copies begin alike. It covers the settings of physics, and of each robot its
    /// name, names and masses of its links, its surfaces, state and actuators. All builds with the same form
    /// of states compute the same one.
    pub(super) fingerprint: u64,
    /// Approximate memory of a world in this state, bytes.
    pub(super) world_bytes: usize,
}

/// Hash of all bytes.
struct Fingerprint(u64);

impl Fingerprint {
    fn add(&mut self, bytes: &[u8]) {
        let words = bytes.chunks(8).map(|chunk| {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            u64::from_le_bytes(word)
        });
        // With the length, so that no two sequences of parts are the same words.
        self.0 = words.fold(mixed_into(self.0, bytes.len() as u64), mixed_into);
    }
}

impl StartFacts {
    pub(super) fn of(start: &Saved) -> Self {
        let state = start.world_state();
        let mut fingerprint = Fingerprint(0);
        fingerprint.add(&encoded(&state.settings));
        let mut bytes = 0;
        for (RobotState { entity, body }, model) in state.robots.iter().zip(start.models()) {
            let body = encoded(body);
            bytes += body.len() + encoded(entity).len();
            fingerprint.add(entity.name.as_bytes());
            fingerprint.add(&[u8::from(entity.fixed_base)]);
            fingerprint.add(&encoded(&entity.surfaces));
            fingerprint.add(&body);
            for link in &model.links {
                fingerprint.add(link.name.as_bytes());
                fingerprint.add(&link.inertial.mass.to_bits().to_le_bytes());
            }
        }
        Self { fingerprint: fingerprint.0, world_bytes: bytes.saturating_mul(WORLD_BYTES) }
    }
}
