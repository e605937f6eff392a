//! Surfaces of links: `<contact>` of the link, as in PyBullet, and `<gazebo reference="link">`, as in Gazebo.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::findings::Findings;
use super::gazebo::{Gazebo, checked_friction};
use super::numbers::{self, Shape};
use super::repair::RepairedUrdf;
use crate::report::Disposition::Repaired;
use crate::robot::Material;

/// Surfaces from `<gazebo>` elements, by link.
pub(super) struct Surfaces<'g> {
    frictions: &'g BTreeMap<String, f64>,
}

impl<'g> Surfaces<'g> {
    /// Makes it from the frictions in `<gazebo>`.
    pub(super) fn of(gazebo: &'g Gazebo) -> Self {
        Self { frictions: &gazebo.frictions }
    }

    /// Returns the surface of a link: its own `<contact>` first.
    pub(super) fn material<'a, 'i>(
        &self,
        repaired: &RepairedUrdf<'a, 'i>,
        link: &urdf_rs::Link,
        node: Node<'a, 'i>,
        findings: &mut Findings,
    ) -> Material {
        let mut material = Material::default();
        if let Some(contact) = repaired.child(node, "contact") {
            let value = |tag: &'static str| {
                let node = repaired.child(contact, tag)?;
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

fn checked_restitution(node: Node, value: f64, findings: &mut Findings) -> f64 {
    let within = value.clamp(0.0, 1.0);
    if within != value {
        let message = format!("a restitution of {value} is not between 0 and 1: {within} is used");
        findings.warn(node, Repaired, message);
    }
    within
}
