//! Sensors of links and joints. Their contents are copied, except for their poses, since URDF for Gazebo uses
//! SDF's elements.

use glamx::DPose3;

use super::frames::{self, Frames};
use crate::report::Disposition::Ignored;
use crate::translation::draft::DraftSensor;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::translation::write::escaped;

/// Maximum number of elements of a sensor.
const MAX_ELEMENTS: usize = 300;

/// Nesting depth of elements.
const MAX_DEPTH: usize = 12;

/// Reads the sensors in a link or a joint, whose frame is `model_from_holder`.
pub(super) fn read(
    holder: Element,
    model_from_holder: &DPose3,
    frames: &mut Frames,
    notes: &mut Notes,
) -> Vec<DraftSensor> {
    let mut sensors = Vec::new();
    for element in holder.children("sensor") {
        // Faults of a sensor do not refuse the robot.
        let Ok(pose) = pose(element, model_from_holder, frames, notes) else {
            notes.warn(
                element,
                Ignored,
                "its pose cannot be read, or is relative to no frame of the model: left out",
            );
            continue;
        };
        let mut lines = Vec::new();
        for child in element.elements().filter(|child| !["pose", "plugin"].contains(&child.tag())) {
            write(child, 0, &mut lines);
        }
        sensors.push(DraftSensor {
            name: element.word("name").unwrap_or_default().to_owned(),
            at: (element.file, element.line()),
            kind: element.word("type").unwrap_or_default().to_owned(),
            pose,
            lines,
        });
    }
    sensors
}

/// Returns the pose in the frame of the holder.
fn pose(
    element: Element,
    model_from_holder: &DPose3,
    frames: &mut Frames,
    notes: &mut Notes,
) -> Result<DPose3, Stop> {
    let (pose, relative_to) = frames::pose(element, notes)?;
    let Some(frame) = relative_to else { return Ok(pose) };
    Ok(model_from_holder.inverse() * frames.resolve(frame, element)? * pose)
}

/// Writes an element and its children, within the limits.
fn write(element: Element, depth: usize, lines: &mut Vec<((usize, u32), usize, String)>) {
    if depth > MAX_DEPTH || lines.len() >= MAX_ELEMENTS {
        return;
    }
    let at = (element.file, element.line());
    let tag = element.tag();
    element.is_read();
    let attributes: String = element
        .node
        .attributes()
        .filter(|attribute| attribute.namespace().is_none())
        .map(|attribute| format!(" {}=\"{}\"", attribute.name(), escaped(attribute.value())))
        .collect();
    if element.elements().next().is_none() {
        lines.push((at, depth, format!("<{tag}{attributes}>{}</{tag}>", escaped(element.text()))));
        return;
    }
    lines.push((at, depth, format!("<{tag}{attributes}>")));
    for child in element.elements() {
        write(child, depth + 1, lines);
    }
    lines.push((at, depth, format!("</{tag}>")));
}
