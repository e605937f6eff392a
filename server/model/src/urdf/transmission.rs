//! `<transmission>`: drives of joints in ROS 1, for joints without a `<ros2_control>`.
//!
//! The interface of a simple transmission is its joint's mode, as in `control`, except for efforts. Most
//! robots of ROS 1 name that interface for a controller that holds their position. An arm without a
//! controller would fall when it is loaded. So such a joint holds its position until it gets an effort. A
//! reduction is between the actuator and the joint. Interfaces of joints are on the joint's side of it, so
//! that it changes nothing here.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use super::control::systems;
use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown::nearest;
use crate::report::Disposition::Ignored;
use crate::report::short;
use crate::robot::{Joint, JointKind};
use crate::setup::{DriveMode, Setup};

/// Interface by which a transmission drives its joint.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Interface {
    Effort,
    Velocity,
    Position,
}

/// Reads every `<transmission>` of the robot, after its `<ros2_control>`.
pub(super) fn read(root: Node, joints: &[Joint], setup: &mut Setup, findings: &mut Findings) {
    let elements: Vec<Node> = root.children().filter(|node| is(*node, "transmission")).collect();
    if elements.is_empty() {
        return;
    }
    let name_of = |node: &Node| node.attribute("name").unwrap_or_default().trim().to_owned();
    let named = systems(root).flat_map(|system| system.children().filter(|node| is(*node, "joint")));
    let controlled: BTreeSet<String> = named.map(|node| name_of(&node)).collect();
    let indices: BTreeMap<&str, usize> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
    let mut driven: BTreeMap<usize, Interface> = BTreeMap::new();
    for node in elements {
        let kind = node.children().find(|child| is(*child, "type")).and_then(|kind| kind.text());
        let kind = kind.or(node.attribute("type")).unwrap_or_default().trim();
        let mut of_node = node.children().filter(|child| is(*child, "joint"));
        let (Some(joint), None) = (of_node.next(), of_node.next()) else {
            findings.info(node, Ignored, "not read by simd: it is not of one joint");
            continue;
        };
        let name = name_of(&joint);
        if !kind.is_empty() && !kind.ends_with("SimpleTransmission") {
            let message = format!("not read by simd: {} is not a simple transmission", quoted(kind));
            findings.info(node, Ignored, message);
            continue;
        }
        let Some(index) = indices.get(name.as_str()).copied() else {
            let meant = nearest(&name, indices.keys().copied());
            let meant = meant.map_or_else(String::new, |meant| format!("; did you mean {}?", quoted(meant)));
            findings.warn(node, Ignored, format!("the robot has no joint {}{meant}", quoted(&name)));
            continue;
        };
        if controlled.contains(&name) {
            findings.info(node, Ignored, "not read by simd: <ros2_control> says how the joint is driven");
            continue;
        }
        let Some(of_joint) = joints.get(index) else { continue };
        let has_axis =
            matches!(of_joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
        if !has_axis || of_joint.mimic.is_some() {
            findings.info(node, Ignored, "not read by simd: the joint is not driven by itself");
            continue;
        }
        let actuators = node.children().filter(|child| is(*child, "actuator"));
        // Old files have it at the actuator.
        let Some(interface) = std::iter::once(joint).chain(actuators).filter_map(interface).max() else {
            findings.info(node, Ignored, "not read by simd: it has no hardware interface that simd knows");
            continue;
        };
        let interface = interface.max(driven.get(&index).copied().unwrap_or(interface));
        driven.insert(index, interface);
        setup.joint(index).mode = match interface {
            Interface::Position | Interface::Effort => None,
            Interface::Velocity => Some(DriveMode::Velocity),
        };
        findings.used(node, || {
            let driven = match interface {
                Interface::Position => "holds its position",
                Interface::Velocity => "keeps its velocity",
                Interface::Effort => "holds its position until it is given an effort",
            };
            let reduction = reduction(node).map_or_else(String::new, |by| {
                format!("; the reduction of {} is on the actuator's side", short(by))
            });
            format!("joint {}: {driven}{reduction}", quoted(&name))
        });
    }
}

/// Returns the strongest interface that an element names.
fn interface(node: Node) -> Option<Interface> {
    let named = node.children().filter(|child| is(*child, "hardwareInterface"));
    named
        .filter_map(|node| {
            let word = node.text()?.trim().rsplit(['/', ':']).next()?.to_owned();
            match word.as_str() {
                "PositionJointInterface" => Some(Interface::Position),
                "VelocityJointInterface" => Some(Interface::Velocity),
                "EffortJointInterface" => Some(Interface::Effort),
                _ => None,
            }
        })
        .max()
}

/// Returns the turns of the actuator per turn of the joint, unless it is 1.
fn reduction(node: Node) -> Option<f64> {
    let found = node.descendants().find(|child| is(*child, "mechanicalReduction"))?;
    let read = numbers::read(found.text()?.trim(), Shape::Exactly(1)).ok()?;
    read.values.first().copied().filter(|by| *by != 1.0)
}
