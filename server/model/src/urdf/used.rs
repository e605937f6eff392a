//! Reports the used parts of each link and joint, for complete reports.

use super::findings::{Findings, quoted};
use super::tree::Tree;
use crate::report::{counted, short};
use crate::robot::{Geometry, Joint, JointKind, Link, RobotModel};

/// Adds a finding for each link and each joint.
pub(super) fn report(model: &RobotModel, tree: &Tree, findings: &mut Findings) {
    for (link, node) in model.links.iter().zip(&tree.link_nodes) {
        findings.used(*node, || of_link(link));
    }
    for (index, (joint, node)) in model.joints.iter().zip(&tree.joint_nodes).enumerate() {
        findings.used(*node, || of_joint(index, joint, model));
    }
}

fn of_link(link: &Link) -> String {
    let collisions = link.collisions.iter().filter(|collision| touches(&collision.geometry)).count();
    let mut said = vec![
        format!("{} kg", short(link.inertial.mass)),
        counted(link.visuals.len(), "visual"),
        counted(collisions, "collision shape"),
    ];
    if let Some(material) = link.collisions.first().map(|collision| collision.material) {
        said.extend(material.friction.map(|friction| format!("friction {}", short(friction))));
        said.extend(material.restitution.map(|restitution| format!("restitution {}", short(restitution))));
        said.extend(material.rolling_friction.map(|arm| format!("rolling friction {} m", short(arm))));
        said.extend(material.spinning_friction.map(|arm| format!("spinning friction {} m", short(arm))));
    }
    said.join(", ")
}

fn touches(geometry: &Geometry) -> bool {
    !matches!(geometry, Geometry::Mesh { asset: None, .. })
}

fn of_joint(index: usize, joint: &Joint, model: &RobotModel) -> String {
    let name = |index: usize| model.links.get(index).map(|link| quoted(&link.name)).unwrap_or_default();
    let (kind, length, force) = match joint.kind {
        JointKind::Revolute => ("revolute", "rad", "N m"),
        JointKind::Continuous => ("continuous", "rad", "N m"),
        JointKind::Prismatic => ("prismatic", "m", "N"),
        JointKind::Fixed => ("fixed", "", ""),
        JointKind::Floating => ("floating", "", ""),
        JointKind::Planar => ("planar", "m", "N"),
        JointKind::Spherical => ("spherical", "rad", "N m"),
    };
    let mut said = vec![format!("{kind}, {} to {}", name(joint.parent), name(joint.child))];
    if matches!(
        joint.kind,
        JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic | JointKind::Planar
    ) {
        let axis = joint.axis.to_array().map(short);
        said.push(format!("axis {}", axis.join(" ")));
    }
    match (joint.limits.lower, joint.limits.upper) {
        (Some(lower), Some(upper)) => said.push(format!("{} to {} {length}", short(lower), short(upper))),
        (Some(lower), None) => said.push(format!("from {} {length}", short(lower))),
        (None, Some(upper)) => said.push(format!("up to {} {length}", short(upper))),
        (None, None) => {}
    }
    said.extend(joint.limits.effort.map(|effort| format!("at most {} {force}", short(effort))));
    said.extend(joint.limits.velocity.map(|velocity| format!("at most {} {length}/s", short(velocity))));
    if joint.damping != 0.0 {
        said.push(format!("damping {}", short(joint.damping)));
    }
    if joint.friction != 0.0 {
        said.push(format!("friction {}", short(joint.friction)));
    }
    if let Some(mimic) = joint.mimic {
        let leader = model.joints.get(mimic.joint).map(|joint| quoted(&joint.name)).unwrap_or_default();
        said.push(format!("follows {leader} times {} plus {}", short(mimic.multiplier), short(mimic.offset)));
    }
    if let Some(tendon) = model.setup.tendon(index) {
        let term = |(joint, factor): &(usize, f64)| {
            let name = model.joints.get(*joint).map(|joint| quoted(&joint.name)).unwrap_or_default();
            format!("{} {name}", short(*factor))
        };
        let terms: Vec<String> = tendon.terms.iter().map(term).collect();
        said.push(format!("a tendon: {} + {}", terms.join(" + "), short(tendon.offset)));
    }
    said.join(", ")
}
