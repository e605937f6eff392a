//! Mimic joints.

use std::collections::HashMap;

use super::findings::{Findings, quoted};
use super::repair::RepairedUrdf;
use super::tree::Tree;
use crate::report::Disposition::Ignored;
use crate::robot::{Joint, JointKind, Mimic};

/// Sets `mimic` of the joints; they are in the tree's order.
pub(super) fn resolve(repaired: &RepairedUrdf, tree: &Tree, joints: &mut [Joint], findings: &mut Findings) {
    let kinds: HashMap<String, (usize, JointKind)> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.clone(), (index, joint.kind))).collect();
    let mut nodes = Vec::with_capacity(joints.len());
    for ((joint, tree_joint), node) in joints.iter_mut().zip(&tree.joints).zip(&tree.joint_nodes) {
        let mimic = repaired.robot.joints.get(tree_joint.in_file).and_then(|joint| joint.mimic.as_ref());
        let node = repaired.child(*node, "mimic").unwrap_or(*node);
        nodes.push(node);
        let Some(mimic) = mimic else { continue };
        let name = quoted(&mimic.joint);
        let Some((leader, kind)) = kinds.get(&mimic.joint) else {
            findings.warn(node, Ignored, format!("it follows joint {name}, which is not defined"));
            continue;
        };
        let has_position =
            |kind| matches!(kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
        if !has_position(joint.kind) || !has_position(*kind) {
            let message =
                format!("it follows joint {name}; only joints that turn or slide follow one another");
            findings.warn(node, Ignored, message);
            continue;
        }
        joint.mimic = Some(Mimic {
            joint: *leader,
            multiplier: mimic.multiplier.unwrap_or(1.0),
            offset: mimic.offset.unwrap_or(0.0),
        });
    }
    break_loops(joints, &nodes, findings);
}

/// Frees joints that follow one another in a cycle: they have no position to follow.
fn break_loops(joints: &mut [Joint], nodes: &[roxmltree::Node], findings: &mut Findings) {
    let leaders: Vec<Option<usize>> = joints.iter().map(|joint| Some(joint.mimic?.joint)).collect();
    let leader = |index: usize| leaders.get(index).copied().flatten();
    // The walk in which a joint was first met; a walk that meets itself is a cycle.
    let mut walks: Vec<Option<usize>> = vec![None; joints.len()];
    for start in 0..leaders.len() {
        let mut at = start;
        while let Some(slot) = walks.get_mut(at).filter(|slot| slot.is_none()) {
            *slot = Some(start);
            let Some(next) = leader(at) else { break };
            at = next;
        }
        let met_itself = walks.get(at) == Some(&Some(start)) && leader(at).is_some();
        if met_itself {
            break_loop(at, leader, joints, nodes, findings);
        }
    }
}

/// Frees the joints of the cycle that contains `first`.
fn break_loop(
    first: usize,
    leader: impl Fn(usize) -> Option<usize>,
    joints: &mut [Joint],
    nodes: &[roxmltree::Node],
    findings: &mut Findings,
) {
    let mut members = vec![first];
    members.extend(std::iter::successors(leader(first), |at| leader(*at)).take_while(|at| *at != first));
    let named = members.iter().take(8).filter_map(|index| joints.get(*index));
    let mut names = named.map(|joint| quoted(&joint.name)).collect::<Vec<_>>().join(", ");
    if members.len() > 8 {
        names += ", ...";
    }
    let message = format!("joints follow one another in a loop: {names}; each moves independently");
    if let Some(node) = nodes.get(first) {
        findings.warn(*node, Ignored, message);
    }
    for index in members {
        if let Some(joint) = joints.get_mut(index) {
            joint.mimic = None;
        }
    }
}
