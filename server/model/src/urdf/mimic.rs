//! Joints that follow others.

use std::collections::HashMap;

use super::findings::{Findings, Refusal, quoted};
use super::mend::Mended;
use super::tree::Tree;
use crate::report::Disposition::Ignored;
use crate::robot::{Joint, JointKind, Mimic};

/// Sets `mimic` of the joints; they are in the tree's order.
pub(super) fn resolve(
    mended: &Mended,
    tree: &Tree,
    joints: &mut [Joint],
    findings: &mut Findings,
) -> Result<(), Refusal> {
    let kinds: HashMap<String, (usize, JointKind)> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.clone(), (index, joint.kind))).collect();
    let mut nodes = Vec::with_capacity(joints.len());
    for ((joint, place), node) in joints.iter_mut().zip(&tree.joints).zip(&tree.joint_nodes) {
        let mimic = mended.robot.joints.get(place.in_file).and_then(|joint| joint.mimic.as_ref());
        let node = mended.child(*node, "mimic").unwrap_or(*node);
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
    refuse_loops(joints, &nodes, findings)
}

fn refuse_loops(joints: &[Joint], nodes: &[roxmltree::Node], findings: &Findings) -> Result<(), Refusal> {
    let leader = |index: usize| joints.get(index).and_then(|joint| joint.mimic).map(|mimic| mimic.joint);
    // A joint known to lead to one that follows nothing need not be followed again.
    let mut free = vec![false; joints.len()];
    for (start, node) in nodes.iter().enumerate() {
        let mut path = vec![start];
        while let Some(next) = path.last().and_then(|last| leader(*last)) {
            if free.get(next) == Some(&true) {
                break;
            }
            if path.contains(&next) {
                let names: Vec<_> =
                    path.iter().take(8).filter_map(|i| joints.get(*i)).map(|j| quoted(&j.name)).collect();
                let message = format!("joints follow one another in a loop: {}", names.join(", "));
                return Err(findings.refuse(*node, message));
            }
            path.push(next);
        }
        for index in path {
            if let Some(free) = free.get_mut(index) {
                *free = true;
            }
        }
    }
    Ok(())
}
