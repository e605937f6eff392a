//! `<ros2_control>`: initial state and drive of joints.
//!
//! A joint with a position interface holds its position. One with only a velocity interface has the velocity
//! target 0, and one with only an effort interface the effort target 0. One without a command interface is
//! passive. `initial_value` of its position is the initial position; `min` and `max` are limits if `<limit>`
//! gives none. Gains are those of `gz_ros2_control`'s and `gazebo_ros2_control`'s position and velocity
//! controllers.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown;
use crate::report::Disposition::{Defaulted, Ignored};
use crate::report::short;
use crate::robot::{Joint, JointKind, Mimic};
use crate::setup::{DriveMode, Setup};

/// Reads every `<ros2_control>` of the robot. Limits are set on the joints themselves.
pub(super) fn read(root: Node, joints: &mut [Joint], setup: &mut Setup, findings: &mut Findings) {
    let indices: BTreeMap<String, usize> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.clone(), index)).collect();
    for system in systems(root) {
        let mut others: Vec<&str> = Vec::new();
        for node in system.children().filter(Node::is_element) {
            if is(node, "joint") {
                let name = node.attribute("name").unwrap_or_default().trim();
                match indices.get(name).copied() {
                    Some(index) => of_joint(node, index, joints, setup, findings),
                    None => unknown_joint(node, name, &indices, findings),
                }
            } else if !others.contains(&node.tag_name().name()) && others.len() < 8 {
                others.push(node.tag_name().name());
            }
        }
        if !system.children().any(|node| node.is_element()) {
            findings.info(system, Ignored, "not read by simd: it holds no joint");
        }
        if !others.is_empty() {
            let message = format!("not read by simd: {}", others.join(", "));
            findings.info(system, Ignored, message);
        }
    }
}

/// Returns each `<ros2_control>` of the robot: its own, and those in a `<gazebo>`, where a plugin of Gazebo
/// also finds them.
pub(super) fn systems<'a, 'i>(root: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    root.children().flat_map(|node| {
        let inner = is(node, "gazebo").then(|| node.children().filter(|child| is(*child, "ros2_control")));
        let own = is(node, "ros2_control").then_some(node);
        own.into_iter().chain(inner.into_iter().flatten())
    })
}

fn unknown_joint(node: Node, name: &str, indices: &BTreeMap<String, usize>, findings: &mut Findings) {
    let meant = unknown::nearest(name, indices.keys().map(String::as_str));
    let meant = meant.map_or_else(String::new, |meant| format!("; did you mean {}?", quoted(meant)));
    findings.warn(node, Ignored, format!("the robot has no joint {}{meant}", quoted(name)));
}

fn of_joint(node: Node, index: usize, joints: &mut [Joint], setup: &mut Setup, findings: &mut Findings) {
    unread(node, findings);
    follow(node, index, joints, findings);
    let Some(joint) = joints.get_mut(index) else { return };
    let is_ball = joint.kind == JointKind::Spherical;
    if !is_ball && !matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic) {
        return findings.info(node, Ignored, "not read by simd: the joint has not one axis");
    }
    if joint.mimic.is_some() {
        return findings.info(node, Ignored, "not read by simd: the joint follows another one");
    }
    let interfaces = |tag: &'static str, name: &'static str| {
        node.children()
            .find(move |child| is(*child, tag) && child.attribute("name").map(str::trim) == Some(name))
    };
    let command = |name| interfaces("command_interface", name);
    let mut said = Vec::new();
    let mode = match (command("position"), command("velocity"), command("effort")) {
        (Some(_), _, _) => None,
        (None, Some(_), _) => Some(DriveMode::Velocity),
        (None, None, Some(_)) => Some(DriveMode::Effort),
        (None, None, None) => Some(DriveMode::Passive),
    };
    said.extend(mode.map(|mode| match mode {
        DriveMode::Velocity => "keeps its velocity".to_owned(),
        DriveMode::Effort => "applies an effort".to_owned(),
        DriveMode::Passive => "has no command interface and is not driven".to_owned(),
    }));
    let bounds = |interface: Option<Node>, findings: &mut Findings| {
        interface.map_or((None, None), |it| (param(it, &["min"], findings), param(it, &["max"], findings)))
    };
    let (lower, upper) = bounds(command("position"), findings);
    let limits = &mut joint.limits;
    if joint.kind != JointKind::Continuous
        && !is_ball
        && (limits.lower, limits.upper) == (None, None)
        && lower.unwrap_or(f64::NEG_INFINITY) < upper.unwrap_or(f64::INFINITY)
        && (lower.is_some() || upper.is_some())
    {
        (limits.lower, limits.upper) = (lower, upper);
        said.push("limits of its position".to_owned());
    }
    for (name, slot) in [("velocity", &mut limits.velocity), ("effort", &mut limits.effort)] {
        let (_, upper) = bounds(command(name), findings);
        if let (None, Some(upper)) = (*slot, upper.filter(|upper| *upper > 0.0)) {
            *slot = Some(upper);
            said.push(format!("at most {} of {name}", short(upper)));
        }
    }
    let position = interfaces("state_interface", "position")
        .and_then(|it| param(it, &["initial_value", "initial_position"], findings))
        .or_else(|| param(node, &["initial_position"], findings))
        .filter(|_| !is_ball);
    let velocity_alone = mode == Some(DriveMode::Velocity);
    let names: [&[&str]; 2] = if velocity_alone {
        [&[], &["vel_kp", "velocity_proportional_gain", "kp"]]
    } else {
        [&["pos_kp", "position_proportional_gain", "kp"], &["pos_kd", "kd"]]
    };
    let [stiffness, damping] = names.map(|names| {
        let gain = param(node, names, findings).or_else(|| param(command("position")?, names, findings));
        gain.filter(|gain| *gain >= 0.0)
    });
    let armature = param(node, &["armature"], findings).filter(|armature| *armature >= 0.0);
    let is_compensated = says(node, "gravity_compensation");
    let of_joint = setup.joint(index);
    if is_compensated {
        of_joint.gravity_compensation = true;
        said.push("its weight is compensated".to_owned());
    }
    if let Some(position) = position {
        let nearest = joint.limits.nearest(position);
        if nearest != position {
            let message = format!(
                "it starts at {}, which is outside of its limits: {} is used",
                short(position),
                short(nearest)
            );
            findings.info(node, Defaulted, message);
        }
        of_joint.position = Some(nearest);
        said.push(format!("starts at {}", short(nearest)));
    }
    // A joint that takes position targets holds its position, even if a spring would leave it free.
    of_joint.mode = if command("position").is_some() { None } else { mode.or(of_joint.mode) };
    of_joint.stiffness = stiffness.or(of_joint.stiffness);
    of_joint.damping = damping.or(of_joint.damping);
    of_joint.armature = armature.unwrap_or(of_joint.armature);
    said.extend(stiffness.map(|gain| format!("stiffness {}", short(gain))));
    said.extend(damping.map(|gain| format!("damping {} of targets", short(gain))));
    if said.is_empty() {
        said.push("it holds its position".to_owned());
    }
    findings.used(node, || format!("joint {}: {}", quoted(&joint.name), said.join(", ")));
}

/// Reads whether the joint follows another one: from the parameters `mimic`, `multiplier` and `offset`, or an
/// element `<mimic>`. With `mimic="false"` it does not, even if it has a `<mimic>`.
fn follow(node: Node, index: usize, joints: &mut [Joint], findings: &mut Findings) {
    let name = joints.get(index).map(|joint| quoted(&joint.name)).unwrap_or_default();
    if node.attribute("mimic").is_some_and(|word| word.trim().eq_ignore_ascii_case("false")) {
        if let Some(joint) = joints.get_mut(index).filter(|joint| joint.mimic.is_some()) {
            joint.mimic = None;
            findings.used(node, || format!("joint {name} follows no other joint: mimic is false"));
        }
        return;
    }
    let element = node.children().find(|child| is(*child, "mimic"));
    let text = node.children().find(|child| is(*child, "param") && child.attribute("name") == Some("mimic"));
    let leader = match (element, text) {
        (Some(element), _) => element.attribute("joint"),
        (None, Some(param)) => param.text(),
        (None, None) => return,
    };
    let leader = leader.unwrap_or_default().trim();
    let number = |name: &'static str, default: f64, findings: &mut Findings| match element {
        Some(element) => numbers::of::<1>(element, name, Shape::Exactly(1)).map_or(default, |[value]| value),
        None => param(node, &[name], findings).unwrap_or(default),
    };
    let (multiplier, offset) = (number("multiplier", 1.0, findings), number("offset", 0.0, findings));
    let Some(other) = joints.iter().position(|joint| joint.name == leader) else {
        let meant = unknown::nearest(leader, joints.iter().map(|joint| joint.name.as_str()));
        let meant = meant.map_or_else(String::new, |meant| format!("; did you mean {}?", quoted(meant)));
        let message = format!("it follows joint {}, which is not defined{meant}", quoted(leader));
        return findings.warn(node, Ignored, message);
    };
    let has_axis = |index: usize| {
        joints.get(index).is_some_and(|joint| {
            matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic)
        })
    };
    if !has_axis(index) || !has_axis(other) {
        let message =
            format!("it follows joint {}; only joints that turn or slide follow one another", quoted(leader));
        return findings.warn(node, Ignored, message);
    }
    // No joint follows itself, so no chain is longer than the number of joints.
    let mut at = Some(other);
    for _ in 0..=joints.len() {
        if at == Some(index) {
            let message = format!("joint {name} would follow itself over {}: left out", quoted(leader));
            return findings.warn(node, Ignored, message);
        }
        at = at.and_then(|at| Some(joints.get(at)?.mimic?.joint));
    }
    let mimic = Mimic { joint: other, multiplier, offset };
    let Some(joint) = joints.get_mut(index) else { return };
    if let Some(known) = joint.mimic.filter(|known| *known != mimic) {
        let message = format!(
            "joint {name} follows another one by its <mimic>, with a multiplier of {}: that is kept",
            short(known.multiplier)
        );
        return findings.warn(node, Ignored, message);
    }
    joint.mimic = Some(mimic);
    findings.used(node, || {
        format!(
            "joint {name} follows {}, {} times, plus {}",
            quoted(leader),
            short(multiplier),
            short(offset)
        )
    });
}

/// Reports the parts of a joint that are not read.
fn unread(node: Node, findings: &mut Findings) {
    const TAGS: [&str; 4] = ["command_interface", "state_interface", "param", "mimic"];
    const PARAMS: [&str; 15] = [
        "mimic",
        "multiplier",
        "offset",
        "initial_position",
        "armature",
        "gravity_compensation",
        "pos_kp",
        "position_proportional_gain",
        "kp",
        "pos_kd",
        "kd",
        "vel_kp",
        "velocity_proportional_gain",
        "min",
        "max",
    ];
    const MAX: usize = 8;
    let mut others: Vec<String> = Vec::new();
    for child in node.children().filter(Node::is_element) {
        let tag = child.tag_name().name();
        let param = child.attribute("name").unwrap_or_default().trim();
        let other = match tag {
            "param" if !PARAMS.contains(&param) => format!("the parameter {}", quoted(param)),
            tag if !TAGS.contains(&tag) => format!("<{tag:.40}>"),
            _ => continue,
        };
        if others.len() < MAX && !others.contains(&other) {
            others.push(other);
        }
    }
    if !others.is_empty() {
        findings.info(node, Ignored, format!("not read by simd: {}", others.join(", ")));
    }
}

/// Returns whether a parameter is true.
fn says(node: Node, name: &str) -> bool {
    let has_name = |child: &Node| is(*child, "param") && child.attribute("name").map(str::trim) == Some(name);
    let text = node.children().find(has_name).and_then(|param| param.text()).unwrap_or_default();
    text.trim() == "1" || text.trim().eq_ignore_ascii_case("true")
}

/// Returns the number of the first parameter that has one of these names.
fn param(node: Node, names: &[&str], findings: &mut Findings) -> Option<f64> {
    let has_name = |child: &Node| child.attribute("name").is_some_and(|name| names.contains(&name.trim()));
    let param = node.children().filter(|child| is(*child, "param")).find(has_name)?;
    let text = param.text().unwrap_or_default().trim();
    match numbers::read(text, Shape::Exactly(1)) {
        Ok(read) => read.values.first().copied(),
        Err(why) => {
            findings.warn(param, Ignored, format!("{} {why}", quoted(text)));
            None
        }
    }
}
