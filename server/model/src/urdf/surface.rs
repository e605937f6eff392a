//! What links' surfaces are like: `<contact>` of the link, as PyBullet reads it,
//! and `<gazebo reference="link">`, as Gazebo does.

use std::collections::{HashMap, HashSet};

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::mend::Mended;
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown::nearest;
use crate::report::Disposition::{Ignored, Repaired};
use crate::robot::Material;

/// Words of Gazebo's `<surface>` for friction: `mu1` along the first direction.
const FRICTION: [&str; 2] = ["mu1", "mu"];

/// The surfaces that `<gazebo>` elements give, by link.
pub(super) struct Surfaces {
    frictions: HashMap<String, f64>,
}

impl Surfaces {
    /// Reads every `<gazebo>` of the robot, and names what is left aside in it.
    pub(super) fn of(mended: &Mended, findings: &mut Findings) -> Self {
        let links: HashSet<&str> = mended.robot.links.iter().map(|link| link.name.as_str()).collect();
        let joints: HashSet<&str> = mended.robot.joints.iter().map(|joint| joint.name.as_str()).collect();
        let mut frictions = HashMap::new();
        for node in mended.root.children().filter(|node| is(*node, "gazebo")) {
            let Some(reference) = node.attribute("reference") else {
                findings.info(node, Ignored, "not read by simd: it is for Gazebo and its plugins");
                continue;
            };
            if !links.contains(reference) {
                unknown_reference(node, reference, &links, &joints, findings);
                continue;
            }
            let own = friction_of(node, findings);
            let mut others: Vec<&str> = Vec::new();
            for child in node.children().filter(Node::is_element).filter(|child| Some(*child) != own.0) {
                let tag = child.tag_name().name();
                if !others.contains(&tag) && others.len() < 8 {
                    others.push(tag);
                }
            }
            if !others.is_empty() {
                let message = format!("not read by simd: {}", others.join(", "));
                findings.info(node, Ignored, message);
            }
            if let (Some(child), Some(friction)) = own {
                frictions.insert(reference.to_owned(), friction);
                findings.used(child, || format!("friction {friction} of link {}", quoted(reference)));
            }
        }
        Self { frictions }
    }

    /// The surface of a link: its own `<contact>` first.
    pub(super) fn material<'a, 'i>(
        &self,
        mended: &Mended<'a, 'i>,
        link: &urdf_rs::Link,
        node: Node<'a, 'i>,
        findings: &mut Findings,
    ) -> Material {
        let mut material = Material::default();
        if let Some(contact) = mended.child(node, "contact") {
            let value = |tag: &'static str| {
                let node = mended.child(contact, tag)?;
                numbers::of(node, "value", Shape::Exactly(1)).map(|[value]| (node, value))
            };
            let mut friction =
                |tag| value(tag).and_then(|(node, value)| checked_friction(node, value, findings));
            material.friction = friction("lateral_friction");
            material.rolling_friction = friction("rolling_friction");
            material.spinning_friction = friction("spinning_friction");
            material.restitution =
                value("restitution").map(|(node, value)| checked_restitution(node, value, findings));
        }
        material.friction = material.friction.or_else(|| self.frictions.get(&link.name).copied());
        material
    }
}

/// The child that gives a friction, and the friction.
fn friction_of<'a, 'i>(node: Node<'a, 'i>, findings: &mut Findings) -> (Option<Node<'a, 'i>>, Option<f64>) {
    let find = |tag: &&str| node.children().find(|child| is(*child, tag));
    let Some(child) = FRICTION.iter().find_map(find) else { return (None, None) };
    let text = child.attribute("value").or_else(|| child.text()).unwrap_or_default();
    let read = numbers::read(text, Shape::Exactly(1));
    let friction = match read.as_ref().map(|read| read.values.as_slice()) {
        Ok([value]) => checked_friction(child, *value, findings),
        _ => {
            findings.warn(child, Ignored, format!("{} is not a number", quoted(text.trim())));
            None
        }
    };
    (Some(child), friction)
}

fn unknown_reference(
    node: Node,
    reference: &str,
    links: &HashSet<&str>,
    joints: &HashSet<&str>,
    findings: &mut Findings,
) {
    if joints.contains(reference) {
        let message = format!("not read by simd: it is for Gazebo, of joint {}", quoted(reference));
        return findings.info(node, Ignored, message);
    }
    let mut links: Vec<&str> = links.iter().copied().collect();
    links.sort_unstable();
    let meant = match nearest(reference, links.into_iter()) {
        Some(meant) => format!("; did you mean {}?", quoted(meant)),
        None => String::new(),
    };
    let message = format!("{} is not a link or joint of this robot{meant}", quoted(reference));
    findings.warn(node, Ignored, message);
}

fn checked_friction(node: Node, value: f64, findings: &mut Findings) -> Option<f64> {
    if value < 0.0 {
        findings.warn(node, Ignored, format!("a friction of {value} is negative: the world's is used"));
        return None;
    }
    Some(value)
}

fn checked_restitution(node: Node, value: f64, findings: &mut Findings) -> f64 {
    let within = value.clamp(0.0, 1.0);
    if within != value {
        let message = format!("a restitution of {value} is none: it is from 0 to 1; {within} is taken");
        findings.warn(node, Repaired, message);
    }
    within
}
