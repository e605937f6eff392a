//! `<group_state>`: named positions of joints, as in MoveIt's SRDF; in an SRDF or in the URDF itself.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::prescan::is;
use crate::report::Disposition::Ignored;
use crate::report::counted;
use crate::robot::{Joint, JointKind};
use crate::setup::NamedState;

/// Maximum number of states in a file.
const MAX_STATES: usize = 256;
/// Maximum number of joints in all states.
const MAX_POSITIONS: usize = 65_536;

/// Returns the states of a `<robot>`, in the order of the file.
pub(super) fn read(root: Node, joints: &[Joint], findings: &mut Findings) -> Vec<NamedState> {
    let indices: BTreeMap<&str, usize> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
    let mut states: Vec<NamedState> = Vec::new();
    let mut left = MAX_POSITIONS;
    for node in root.children().filter(|node| is(*node, "group_state")) {
        let name = node.attribute("name").unwrap_or_default().trim();
        let group = node.attribute("group").unwrap_or_default().trim();
        if name.is_empty() || name.chars().any(char::is_control) || name.len() + group.len() > 1024 {
            findings.warn(node, Ignored, "it has no name that could be used; left out");
            continue;
        }
        if states.iter().any(|known| known.name == name && known.group == group) {
            findings.warn(node, Ignored, format!("the state {} is defined twice; left out", quoted(name)));
            continue;
        }
        if states.len() >= MAX_STATES || left == 0 {
            findings.warn(node, Ignored, "there are too many states; left out");
            continue;
        }
        let mut positions: Vec<(usize, f64)> = Vec::new();
        for child in node.children().filter(|child| is(*child, "joint")).take(left) {
            positions.extend(position(child, joints, &indices, findings));
        }
        left = left.saturating_sub(positions.len());
        findings.used(node, || format!("state {} of {}", quoted(name), counted(positions.len(), "joint")));
        states.push(NamedState { name: name.to_owned(), group: group.to_owned(), positions });
    }
    states
}

fn position(
    node: Node,
    joints: &[Joint],
    indices: &BTreeMap<&str, usize>,
    findings: &mut Findings,
) -> Option<(usize, f64)> {
    let name = node.attribute("name").unwrap_or_default().trim();
    let Some(index) = indices.get(name).copied() else {
        findings.warn(node, Ignored, format!("the robot has no joint {}; left out", quoted(name)));
        return None;
    };
    let joint = joints.get(index)?;
    if !matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic) {
        findings.info(node, Ignored, "only joints of one axis have a position in a state; left out");
        return None;
    }
    if joint.mimic.is_some() {
        findings.info(node, Ignored, "the joint follows another one; left out");
        return None;
    }
    match numbers::read(node.attribute("value").unwrap_or_default(), Shape::Exactly(1)) {
        Ok(read) => read.values.first().map(|value| (index, *value)),
        Err(why) => {
            let value = quoted(node.attribute("value").unwrap_or_default());
            findings.warn(node, Ignored, format!("value={value} {why}; left out"));
            None
        }
    }
}
