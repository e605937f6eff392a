//! Tendons: joints whose positions are sums of the positions of others.

use std::collections::{BTreeMap, BTreeSet};

use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::repair::RepairedUrdf;
use super::tree::Tree;
use crate::report::Disposition::Ignored;
use crate::robot::{Inertial, Joint, JointKind, Link};
use crate::setup::Tendon;

/// Maximum number of joints of a tendon.
const MAX_JOINTS: usize = 100;

/// Reads the `<tendon>` of joints, which are in the tree's order.
pub(super) fn read(
    repaired: &RepairedUrdf,
    tree: &Tree,
    joints: &[Joint],
    links: &[Link],
    findings: &mut Findings,
) -> Vec<Tendon> {
    let nodes: Vec<_> = tree.joint_nodes.iter().map(|node| repaired.child(*node, "tendon")).collect();
    if nodes.iter().all(Option::is_none) {
        return Vec::new();
    }
    let indices: BTreeMap<&str, usize> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
    let carry: BTreeSet<usize> = joints.iter().map(|joint| joint.parent).collect();
    let has_axis = |kind| matches!(kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
    let mut tendons = Vec::new();
    for (index, (joint, node)) in joints.iter().zip(&nodes).enumerate() {
        let Some(node) = *node else { continue };
        let is_bare = |link: &Link| link.inertial == Inertial::ZERO && link.collisions.is_empty();
        let is_free = !carry.contains(&joint.child) && links.get(joint.child).is_some_and(is_bare);
        let fault = match joint {
            Joint { kind, .. } if !has_axis(*kind) => Some("only joints that turn or slide are tendons"),
            Joint { mimic: Some(_), .. } => Some("the joint follows another one"),
            _ if !is_free => Some("its link has mass, a collision shape or a joint"),
            _ => None,
        };
        if let Some(fault) = fault {
            findings.warn(node, Ignored, format!("{fault}: the joint moves by itself"));
            continue;
        }
        let mut terms: BTreeMap<usize, f64> = BTreeMap::new();
        for child in repaired.children(node, "joint") {
            let name = child.attribute("joint").unwrap_or_default();
            let Some(other) = indices.get(name).copied() else {
                findings.warn(child, Ignored, format!("the robot has no joint {}: left out", quoted(name)));
                continue;
            };
            let is_tendon = nodes.get(other).is_some_and(Option::is_some);
            if is_tendon || !joints.get(other).is_some_and(|joint| has_axis(joint.kind)) {
                let message = "a tendon is a sum of joints that turn or slide, and of no tendon: left out";
                findings.warn(child, Ignored, message);
                continue;
            }
            if terms.len() >= MAX_JOINTS {
                findings.warn(child, Ignored, format!("a tendon has at most {MAX_JOINTS} joints: left out"));
                break;
            }
            let [factor] = numbers::of(child, "coef", Shape::Exactly(1)).unwrap_or([0.0]);
            *terms.entry(other).or_default() += factor;
        }
        terms.retain(|_, factor| *factor != 0.0);
        if terms.is_empty() {
            findings.warn(node, Ignored, "it has no joint: the joint moves by itself");
            continue;
        }
        let [offset] = numbers::of(node, "offset", Shape::Exactly(1)).unwrap_or([0.0]);
        tendons.push(Tendon { joint: index, terms: terms.into_iter().collect(), offset });
    }
    tendons
}
