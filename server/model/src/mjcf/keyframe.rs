//! `<key>`: named positions of all joints.

use super::body::Body;
use super::joint::Kind;
use super::value;
use crate::report::Disposition::Ignored;
use crate::translation::draft::DraftState;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};

/// Maximum number of keyframes in a file.
const MAX_KEYFRAMES: usize = 256;
/// Maximum numbers of a keyframe.
const MAX_NUMBERS: usize = 70_000;
/// Maximum positions of all keyframes.
const MAX_POSITIONS: usize = 65_536;

/// Reads positions of joints with one axis; leaves out poses of free bodies and orientations of balls.
pub(super) fn read(
    elements: &[Element],
    bodies: &[Body],
    notes: &mut Notes,
) -> Result<Vec<DraftState>, Stop> {
    let mut states = Vec::new();
    let mut left = MAX_POSITIONS;
    for (index, element) in elements.iter().copied().enumerate() {
        if element.tag() != "key" {
            continue;
        }
        if index >= MAX_KEYFRAMES {
            notes.warn(element, Ignored, format!("there are more than {MAX_KEYFRAMES} keyframes: left out"));
            break;
        }
        let name = element.word("name").map_or_else(|| format!("key_{index}"), str::to_owned);
        let Some(text) = element.word("qpos") else {
            notes.info(element, Ignored, "it has no qpos: left out");
            continue;
        };
        let values = value::list(element, "qpos", text, MAX_NUMBERS)?;
        let mut positions = Vec::new();
        let mut at = 0;
        for body in bodies {
            at += if body.is_free { 7 } else { 0 };
            for joint in &body.joints {
                if joint.kind == Kind::Ball {
                    at += 4;
                    continue;
                }
                positions.extend(values.get(at).map(|value| (joint.name.clone(), *value)));
                at += 1;
            }
        }
        if at != values.len() {
            let message = format!("qpos has {} numbers, but the joints have {at}: left out", values.len());
            notes.warn(element, Ignored, message);
            continue;
        }
        left = left.saturating_sub(positions.len());
        if left == 0 {
            notes.warn(
                element,
                Ignored,
                format!("keyframes have more than {MAX_POSITIONS} positions: left out"),
            );
            break;
        }
        states.push(DraftState { name, at: (element.file, element.line()), positions });
    }
    Ok(states)
}
