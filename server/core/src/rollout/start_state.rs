//! The state that copies start from as a whole: a number that tells it from others, and about how much memory a world takes that
//! is in it.

use super::draw::mixed_into;
use crate::simulation::Saved;
use crate::simulation::world_state::{RobotState, encoded};

/// What a step computes anew and where shapes are take about so many times the bytes of the state itself, which is a part of them.
const WORLD_BYTES: usize = 4;

/// What is known of a state that copies start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct StartFacts {
    /// Equal where copies begin alike: the settings of physics are, and of each robot its name, the names and masses of its links,
    /// the surfaces of its shapes, where it is, how it moves and what drives it. All builds whose states have the same form find
    /// the same.
    pub(super) fingerprint: u64,
    /// Bytes of a world in it, about.
    pub(super) world_bytes: usize,
}

/// A number that depends on all bytes.
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
