//! Backlash: where an encoder is that sits behind a gear with play.

use serde::{Deserialize, Serialize};

/// Where an encoder is, and whether its joint takes it along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EncoderShaft {
    /// In the joint's unit, rad or m.
    pub position: f64,
    /// The last step moved it.
    pub is_driven: bool,
}

impl EncoderShaft {
    /// One in the middle of its backlash, with its joint at this position.
    pub(super) fn amid(joint: f64) -> Self {
        // Of a robot that is disabled the position may be no number, and a state has none of those.
        Self { position: if joint.is_finite() { joint } else { 0.0 }, is_driven: false }
    }

    /// Goes along as far as its joint takes it: the play operator (Krasnosel'skii and Pokrovskii, "Systems with hysteresis",
    /// 1989, section 2). `backlash` is the way from one flank to the other.
    pub(super) fn follow(&mut self, joint: f64, backlash: f64) {
        let half = 0.5 * backlash;
        // Of a joint whose position is no number it stays where it is.
        let position = self.position.max(joint - half).min(joint + half);
        self.is_driven = position != self.position;
        self.position = position;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To one side, back and again to the first: the loop of the play operator, whose flanks are half the backlash beside the joint.
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
