//! Backlash: position of an encoder behind a gear with play.

use serde::{Deserialize, Serialize};

/// Position of an encoder, and whether its joint drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EncoderShaft {
    /// Position in the joint's unit, rad or m.
    pub position: f64,
    /// Whether the last step moved it.
    pub is_driven: bool,
}

impl EncoderShaft {
    /// Creates a shaft in the middle of its backlash, with its joint at this position.
    pub(super) fn amid(joint: f64) -> Self {
        // The position of a disabled robot may be NaN, which no state may contain.
        Self { position: if joint.is_finite() { joint } else { 0.0 }, is_driven: false }
    }

    /// Moves with its joint: the play operator (Krasnosel'skii and Pokrovskii, "Systems with hysteresis",
    /// 1989, section 2). `backlash` is the distance between both flanks.
    pub(super) fn follow(&mut self, joint: f64, backlash: f64) {
        let half = 0.5 * backlash;
        // If the joint's position is NaN, it stays.
        let position = self.position.max(joint - half).min(joint + half);
        self.is_driven = position != self.position;
        self.position = position;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To one side, back and to the first side: the loop of the play operator, whose flanks are half the
    /// backlash from the joint.
    #[test]
    fn an_encoder_goes_along_once_the_play_is_taken_up() {
        let mut shaft = EncoderShaft::amid(1.0);
        for (joint, position, is_driven) in [
            (1.25, 1.0, false),
            (1.5, 1.25, true),
            (2.0, 1.75, true),
            (1.75, 1.75, false),
            (1.5, 1.75, false),
            (1.0, 1.25, true),
            (1.0, 1.25, false),
            (1.5, 1.25, false),
            (1.75, 1.5, true),
            (f64::NAN, 1.5, false),
            (9.0, 8.75, true),
        ] {
            shaft.follow(joint, 0.5);
            assert_eq!(shaft, EncoderShaft { position, is_driven }, "{joint}");
        }
        shaft.follow(3.0, 0.0);
        assert_eq!(shaft.position, 3.0, "without backlash it is at its joint");
    }
}
