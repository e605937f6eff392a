//! Mass and inertia: from the file if they are physical, otherwise from the shapes.
//!
//! Groups of links connected by fixed joints are judged together. A massless link is a mere frame if its
//! group has mass. If the group has none, physics cannot move it.

use glamx::{DMat3, DPose3};
use roxmltree::Node;

use super::findings::Findings;
use super::geometry::pose;
use super::repair::{RepairedUrdf, given};
use super::tree::Tree;
use crate::inertia;
use crate::report::Disposition::{Defaulted, Ignored, Repaired, Used};
use crate::report::short;
use crate::robot::{Geometry, Inertial, Joint, JointKind, Link};

/// Kilograms above which the report asks about a link.
const SUSPICIOUS: f64 = 1e6;

/// Sets `inertial` of the links.
pub(super) fn resolve<'a, 'i>(
    repaired: &RepairedUrdf<'a, 'i>,
    tree: &Tree<'a, 'i>,
    joints: &[Joint],
    links: &mut [Link],
    findings: &mut Findings,
) {
    let mut massless = Vec::new();
    let read_links = tree.links.iter().zip(&tree.link_nodes);
    for (index, (link, (in_file, node))) in links.iter_mut().zip(read_links).enumerate() {
        let Some(read) = repaired.robot.links.get(*in_file) else { continue };
        let said = Said::of(repaired, &read.inertial, *node, findings);
        link.inertial = said.as_ref().map_or(Inertial::ZERO, |said| said.judged(link, findings));
        if link.inertial == Inertial::ZERO {
            massless.push((index, said.is_none()));
        }
    }
    let groups = Groups::of(joints, links);
    for (index, silent) in massless {
        let (Some(link), Some(node)) = (links.get_mut(index), tree.link_nodes.get(index)) else { continue };
        groups.settle(index, silent, link, *node, findings);
    }
    groups.warn_of_nothing(links, (repaired, tree), findings);
}

/// Mass and inertia of a link in the file.
struct Said<'a, 'i> {
    node: Node<'a, 'i>,
    mass: Option<f64>,
    link_from_mass: DPose3,
    /// In the axes of `link_from_mass`.
    tensor: Option<DMat3>,
}

impl<'a, 'i> Said<'a, 'i> {
    fn of(
        repaired: &RepairedUrdf<'a, 'i>,
        read: &urdf_rs::Inertial,
        link: Node<'a, 'i>,
        findings: &mut Findings,
    ) -> Option<Self> {
        let node = repaired.child(link, "inertial")?;
        let mass = repaired.child(node, "mass").map(|_| read.mass.value);
        let i = &read.inertia;
        let tensor = DMat3::from_cols_array(&[i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz]);
        let inertia = repaired.child(node, "inertia");
        let diagonal = ["ixx", "iyy", "izz"].iter().all(|moment| given(inertia, moment));
        let tensor = (diagonal && tensor != DMat3::ZERO).then_some(tensor);
        let link_from_mass = pose(&read.origin, repaired.child(node, "origin"), findings);
        (mass.is_some() || tensor.is_some()).then_some(Self { node, mass, link_from_mass, tensor })
    }

    /// Returns the file's values if they are physical, otherwise those of the shapes.
    fn judged(&self, link: &Link, findings: &mut Findings) -> Inertial {
        let node = self.node;
        let mass = match self.mass {
            Some(mass) if mass >= 0.0 => mass.abs(),
            wrong => {
                let what =
                    wrong.map_or("no mass is given".to_owned(), |mass| format!("mass {mass} is negative"));
                let Some(found) = of_link(link) else {
                    findings.warn(node, Repaired, format!("{what}, and no shape to take one from: no mass"));
                    return Inertial::ZERO;
                };
                let (mass, density) = (short(found.mass), inertia::DENSITY);
                let message = format!("{what}: {mass} kg, from its shapes at {density} kg/m^3");
                findings.warn(node, Repaired, message);
                return found;
            }
        };
        if mass > SUSPICIOUS {
            let message = format!("a mass of {mass} kg is very large: perhaps it is not in kilograms");
            findings.warn(node, Used, message);
        }
        let center_of_mass = self.link_from_mass.translation;
        let tensor = self.tensor.map(inertia::checked);
        if mass == 0.0 {
            match tensor {
                Some(Err(why)) => {
                    findings.warn(node, Repaired, format!("{why}; with a mass of 0 it is read as 0"));
                }
                // As MuJoCo and PyBullet read it: frames of robots are often written so.
                Some(Ok(_)) => {
                    findings.info(node, Ignored, "its mass is 0, so its inertia is read as 0");
                }
                None => {}
            }
            return Inertial::ZERO;
        }
        let why = match tensor {
            Some(Ok(tensor)) => {
                if let Some(message) = implausible(mass, tensor, link) {
                    findings.warn(node, Used, message);
                }
                let inertia = inertia::rotated(tensor, self.link_from_mass.rotation);
                return Inertial { mass, center_of_mass, inertia };
            }
            Some(Err(why)) => why,
            None => "no inertia is given".to_owned(),
        };
        // Moments of tiny shapes cannot be scaled.
        let scaled = of_link(link).map(|found| found.inertia * (mass / found.mass));
        let inertia = match scaled.filter(|inertia| inertia.is_finite()) {
            Some(inertia) => {
                findings.warn(node, Repaired, format!("{why}: taken from its shapes, with the file's mass"));
                inertia
            }
            None => {
                findings.warn(
                    node,
                    Repaired,
                    format!("{why}, and no shape to take one from: read as a point"),
                );
                DMat3::ZERO
            }
        };
        Inertial { mass, center_of_mass, inertia }
    }
}

/// Returns the fault of an inertia that no body with the link's shapes and mass comes near to.
fn implausible(mass: f64, tensor: DMat3, link: &Link) -> Option<String> {
    /// Factor on the largest moment of the shapes: real parts differ from their shapes, but not this much.
    const LARGEST: f64 = 20.0;
    const SMALLEST: f64 = 1.0 / 200.0;
    /// Maximum radius of gyration of a link without shapes, m.
    const FARTHEST: f64 = 10.0;
    let most = |tensor: DMat3| glamx::DSymmetricEigen3::new(tensor).eigenvalues.max_element();
    let said = most(tensor);
    let Some(found) = of_link(link).filter(|found| found.mass > 0.0) else {
        return (said > mass * FARTHEST * FARTHEST).then(|| {
            let radius = short((said / mass).sqrt());
            let (mass, said) = (short(mass), short(said));
            format!(
                "its mass of {mass} kg has a moment of inertia of {said} kg m^2, as if it were {radius} m away: \
                 perhaps one of them has another unit"
            )
        });
    };
    let usual = most(found.inertia) * (mass / found.mass);
    let is_strange = usual.is_finite() && usual > 0.0 && !(SMALLEST..=LARGEST).contains(&(said / usual));
    is_strange.then(|| {
        let (mass, said, usual) = (short(mass), short(said), short(usual));
        format!(
            "its largest moment of inertia is {said} kg m^2; a body of its shapes and of {mass} kg has {usual} kg m^2: \
             perhaps the inertia or the mass has another unit"
        )
    })
}

/// Returns mass and inertia of a link's collision shapes, or of its visual ones.
fn of_link(link: &Link) -> Option<Inertial> {
    let collisions = link.collisions.iter().map(|shape| (&shape.link_from_shape, &shape.geometry));
    let visuals = link.visuals.iter().map(|shape| (&shape.link_from_shape, &shape.geometry));
    let sized = |shape: &(&DPose3, &Geometry)| !matches!(shape.1, Geometry::Mesh { asset: None, .. });
    inertia::of_shapes(collisions.filter(sized)).or_else(|| inertia::of_shapes(visuals.filter(sized)))
}

/// Groups of links that fixed joints connect.
struct Groups {
    /// First link of each link's group.
    first: Vec<usize>,
    /// Whether a group has mass; by its first link.
    has_mass: Vec<bool>,
    /// Whether a group carries a moving joint; by its first link.
    carries: Vec<bool>,
}

impl Groups {
    fn of(joints: &[Joint], links: &[Link]) -> Self {
        let mut first = vec![0; links.len()];
        let mut carries = vec![false; links.len()];
        for joint in joints {
            let parent = first.get(joint.parent).copied().unwrap_or(0);
            let own = if joint.kind == JointKind::Fixed { parent } else { joint.child };
            if let Some(slot) = first.get_mut(joint.child) {
                *slot = own;
            }
            if let (true, Some(slot)) = (joint.kind.moves(), carries.get_mut(parent)) {
                *slot = true;
            }
        }
        let has_mass = with_mass(&first, links);
        Self { first, has_mass, carries }
    }

    /// Sets mass and inertia of a link for which the file gives no mass (`silent`), or 0.
    fn settle(&self, index: usize, silent: bool, link: &mut Link, node: Node, findings: &mut Findings) {
        let group = self.first.get(index).copied().unwrap_or(0);
        let is = |flags: &[bool]| flags.get(group) == Some(&true);
        let is_root = group == 0;
        // An explicit mass of 0 is intended, if something else can move instead.
        let needed = !is(&self.has_mass) && (silent || (!is_root && !is(&self.carries)));
        let found = if needed { of_link(link) } else { None };
        match found {
            Some(found) => {
                let (mass, density) = (short(found.mass), inertia::DENSITY);
                let message = format!("it has no mass: {mass} kg, from its shapes at {density} kg/m^3");
                link.inertial = found;
                if is_root {
                    let message = format!("{message}; it has no effect if the base is fixed");
                    findings.info(node, Defaulted, message);
                } else {
                    findings.warn(node, Repaired, message);
                }
            }
            None if silent => findings.info(node, Defaulted, "it has no inertial: no mass"),
            None => {}
        }
    }

    /// Warns of leaf links that would move but have no mass.
    fn warn_of_nothing<'a, 'i>(
        &self,
        links: &[Link],
        (repaired, tree): (&RepairedUrdf<'a, 'i>, &Tree<'a, 'i>),
        findings: &mut Findings,
    ) {
        let has_mass = with_mass(&self.first, links);
        // The link of a tendon has none.
        let is_tendon = |link: usize| {
            let joint = link.checked_sub(1).and_then(|joint| tree.joint_nodes.get(joint));
            joint.is_some_and(|joint| repaired.child(*joint, "tendon").is_some())
        };
        for (index, node) in tree.link_nodes.iter().enumerate().skip(1) {
            let is = |flags: &[bool]| flags.get(index) == Some(&true);
            let hangs = self.first.get(index) == Some(&index) && !is_tendon(index);
            if hangs && !is(&has_mass) && !is(&self.carries) {
                findings.warn(*node, Used, "it hangs on a moving joint, but nothing on it has mass");
            }
        }
    }
}

fn with_mass(first: &[usize], links: &[Link]) -> Vec<bool> {
    let mut has_mass = vec![false; links.len()];
    for (link, group) in links.iter().zip(first) {
        let heavy = link.inertial.mass > 0.0 || link.inertial.inertia != DMat3::ZERO;
        if let (true, Some(slot)) = (heavy, has_mass.get_mut(*group)) {
            *slot = true;
        }
    }
    has_mass
}
