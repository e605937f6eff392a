//! `<constraint>`, and `<joint>` in `<gazebo>`: constraints of links in addition to the tree of joints.
//!
//! `<constraint name type>` is simd's own. Its `<parent>` and `<child>` name a link (for a gear a joint;
//! without one, the world) and may have an `<origin>`. It may have an `<axis>`. `<gazebo><joint>` is a joint
//! of SDF that Gazebo adds to the model: this is how a URDF closes a loop there.

use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};
use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::geometry::rotation;
use super::numbers::{self, Shape};
use super::prescan::is;
use super::unknown::nearest;
use crate::number::LARGEST_GIVEN;
use crate::report::Disposition::{Ignored, Repaired};
use crate::report::counted;
use crate::robot::{Joint, JointKind, Link};
use crate::setup::{ConstraintEnd, ConstraintOn, LinkConstraint, LinkConstraintKind};

/// Maximum number of constraints of a robot.
const MAX_CONSTRAINTS: usize = 1024;
const TYPES: [&str; 7] = ["weld", "point_to_point", "hinge", "slide", "gear", "distance", "rope"];

/// Links and joints by name.
struct Robot<'m> {
    links: &'m [Link],
    joints: &'m [Joint],
    link_indices: BTreeMap<&'m str, usize>,
    joint_indices: BTreeMap<&'m str, usize>,
}

/// Reads all constraints, in the order of the file.
pub(super) fn read(
    root: Node,
    (links, joints): (&[Link], &[Joint]),
    findings: &mut Findings,
) -> Vec<LinkConstraint> {
    let of_gazebo = |node: &Node| is(*node, "gazebo") && node.attribute("reference").is_none();
    let is_one = |node: &Node| is(*node, "constraint");
    let elements = root.children().filter(|node| is_one(node) || of_gazebo(node)).flat_map(|node| {
        let own = is_one(&node).then_some(node);
        let inner = node.children().filter(move |child| own.is_none() && is(*child, "joint"));
        own.into_iter().chain(inner)
    });
    let mut elements = elements.peekable();
    if elements.peek().is_none() {
        return Vec::new();
    }
    let robot = Robot {
        links,
        joints,
        link_indices: links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index)).collect(),
        joint_indices: joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect(),
    };
    let mut read = Vec::new();
    let mut poses = None;
    for node in elements {
        if read.len() >= MAX_CONSTRAINTS {
            findings.warn(
                node,
                Ignored,
                format!("there are more than {MAX_CONSTRAINTS} constraints: left out"),
            );
            break;
        }
        let made = if is_one(&node) {
            constraint(node, &robot, findings)
        } else {
            let poses = poses.get_or_insert_with(|| root_from_links(joints));
            gazebo_joint(node, &robot, poses, findings)
        };
        match made.and_then(near) {
            Ok(constraint) => {
                findings.used(node, || said(&constraint, &robot));
                read.push(constraint);
            }
            Err(why) => findings.warn(node, Ignored, format!("{why}: left out")),
        }
    }
    read
}

/// Returns the constraint if its numbers can be computed with, or a fault.
fn near(constraint: LinkConstraint) -> Result<LinkConstraint, String> {
    let is_far = |end: &ConstraintEnd| {
        end.pose.is_some_and(|pose| pose.translation.abs().max_element() > LARGEST_GIVEN)
    };
    if constraint.ends.iter().any(is_far) {
        return Err(format!("the origin of an end is farther away than {LARGEST_GIVEN:e} m"));
    }
    Ok(constraint)
}

/// Returns the report's sentence about a used constraint.
fn said(constraint: &LinkConstraint, robot: &Robot) -> String {
    let is_gear = matches!(constraint.kind, LinkConstraintKind::Gear { .. });
    let what = match constraint.kind {
        LinkConstraintKind::Weld => "a weld",
        LinkConstraintKind::PointToPoint => "a point to point constraint",
        LinkConstraintKind::Hinge(_) => "a hinge",
        LinkConstraintKind::Slide(_) => "a slide",
        LinkConstraintKind::Gear { .. } => "a gear",
        LinkConstraintKind::Distance { is_rope: false, .. } => "a distance",
        LinkConstraintKind::Distance { is_rope: true, .. } => "a rope",
    };
    let [parent, child] = constraint.ends.each_ref().map(|end| match &end.on {
        ConstraintOn::World => "the world".to_owned(),
        ConstraintOn::Own(index) if is_gear => {
            robot.joints.get(*index).map_or_else(String::new, |joint| quoted(&joint.name))
        }
        ConstraintOn::Own(index) => {
            robot.links.get(*index).map_or_else(String::new, |link| quoted(&link.name))
        }
        ConstraintOn::Other { robot, name } => format!("{} of {}", quoted(name), quoted(robot)),
    });
    format!("{what} between {parent} and {child}")
}

/// Reads a `<constraint>`, or returns its fault.
fn constraint(node: Node, robot: &Robot, findings: &mut Findings) -> Result<LinkConstraint, String> {
    let word = node.attribute("type").unwrap_or_default().trim();
    let number = |name: &str| number(node, name);
    let one_axis = || {
        let said = child(node, "axis").and_then(|axis| axis.attribute("xyz")).unwrap_or("1 0 0");
        direction(said, "xyz")
    };
    let kind = match word {
        "weld" => LinkConstraintKind::Weld,
        "point_to_point" => LinkConstraintKind::PointToPoint,
        "hinge" => LinkConstraintKind::Hinge(one_axis()?),
        "slide" => LinkConstraintKind::Slide(one_axis()?),
        "gear" => {
            LinkConstraintKind::Gear { ratio: number("ratio")?.unwrap_or(1.0), offset: number("offset")? }
        }
        "distance" | "rope" => {
            let length = number("length")?;
            if length.is_some_and(|length| length < 0.0) {
                return Err("its length is negative".to_owned());
            }
            LinkConstraintKind::Distance { length, is_rope: word == "rope" }
        }
        other => {
            let meant = nearest(other, TYPES.into_iter());
            let meant = meant.map(|meant| format!("; did you mean {meant}?")).unwrap_or_default();
            return Err(format!("type={} is not one of: {}{meant}", quoted(other), TYPES.join(", ")));
        }
    };
    let is_gear = matches!(kind, LinkConstraintKind::Gear { .. });
    let mut end = |tag: &'static str| -> Result<ConstraintEnd, String> {
        let found = child(node, tag).ok_or_else(|| format!("it has no {tag}"))?;
        let on = robot.on(found, is_gear, tag)?;
        let pose = child(found, "origin").map(|origin| pose(origin, findings)).transpose()?;
        Ok(ConstraintEnd { on, pose })
    };
    let ends = [end("parent")?, end("child")?];
    if !ends.iter().any(|end| matches!(end.on, ConstraintOn::Own(_))) {
        return Err("neither of its ends is of this robot".to_owned());
    }
    if ends[0].on == ends[1].on {
        return Err("its two ends are the same".to_owned());
    }
    let most = |name: &str| number(name).map(|most| most.filter(|most| *most >= 0.0));
    let collisions = match node.attribute("collide").map(str::trim) {
        Some(said) => said == "1" || said.eq_ignore_ascii_case("true"),
        // Links at a joint mostly overlap there.
        None => matches!(kind, LinkConstraintKind::Gear { .. } | LinkConstraintKind::Distance { .. }),
    };
    let (max_force, max_torque) = (most("max_force")?, most("max_torque")?);
    Ok(LinkConstraint { name: name(node), kind, ends, max_force, max_torque, collisions })
}

impl Robot<'_> {
    /// Returns the object of a `<constraint>`'s end.
    fn on(&self, end: Node, is_gear: bool, tag: &str) -> Result<ConstraintOn, String> {
        let of = |attribute: &str| end.attribute(attribute).map(str::trim).filter(|name| !name.is_empty());
        let attribute = if is_gear { "joint" } else { "link" };
        let Some(named) = of(attribute) else {
            return match is_gear {
                true => Err(format!("its {tag} names no joint")),
                false => Ok(ConstraintOn::World),
            };
        };
        if let Some(other) = of("robot") {
            return Ok(ConstraintOn::Other { robot: other.to_owned(), name: named.to_owned() });
        }
        if is_gear { self.axis(named, tag) } else { self.link(named, tag) }.map(ConstraintOn::Own)
    }

    fn link(&self, name: &str, tag: &str) -> Result<usize, String> {
        self.link_indices.get(name).copied().ok_or_else(|| {
            let meant = nearest(name, self.link_indices.keys().copied());
            let meant = meant.map(|meant| format!("; did you mean {}?", quoted(meant))).unwrap_or_default();
            format!("its {tag} {} is not a link of the robot{meant}", quoted(name))
        })
    }

    fn axis(&self, name: &str, tag: &str) -> Result<usize, String> {
        let index = self.joint_indices.get(name).copied();
        let index = index.ok_or_else(|| format!("its {tag} {} is not a joint of the robot", quoted(name)))?;
        let kind = self.joints.get(index).map(|joint| joint.kind);
        match kind {
            Some(JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic) => Ok(index),
            _ => Err(format!("its {tag} {} has not one axis", quoted(name))),
        }
    }
}

/// Reads a `<joint>` in `<gazebo>`, or returns the reason why it closes no loop.
fn gazebo_joint(
    node: Node,
    robot: &Robot,
    root_from_link: &[DPose3],
    findings: &mut Findings,
) -> Result<LinkConstraint, String> {
    let end = |tag: &'static str| -> Result<Option<usize>, String> {
        let found = child(node, tag).ok_or_else(|| format!("it has no {tag}"))?;
        // URDF uses an attribute instead of text.
        let named = found.text().map(str::trim).filter(|text| !text.is_empty());
        let named = named.or_else(|| found.attribute("link")).unwrap_or_default();
        if named == "world" && !robot.link_indices.contains_key(named) {
            return Ok(None);
        }
        robot.link(named, tag).map(Some)
    };
    let (parent, of_child) = (end("parent")?, end("child")?);
    let Some(of_child) = of_child else { return Err("its child is the world".to_owned()) };
    if parent == Some(of_child) {
        return Err("its two ends are the same".to_owned());
    }
    let mut child_from_joint = DPose3::IDENTITY;
    if let Some(said) = child(node, "pose") {
        let named = said.attribute("relative_to").map(str::trim).filter(|name| !name.is_empty());
        let text = said.text().unwrap_or_default();
        if !text.trim().is_empty() {
            let [x, y, z, roll, pitch, yaw] = values(text, "its pose")?;
            child_from_joint = DPose3::from_parts(DVec3::new(x, y, z), rotation([roll, pitch, yaw]));
        }
        if let Some(frame) = named {
            let frame = robot.link(frame, "pose relative to")?;
            child_from_joint = pose_of(root_from_link, Some(of_child)).inverse()
                * pose_of(root_from_link, Some(frame))
                * child_from_joint;
        }
    }
    let root_from_joint = pose_of(root_from_link, Some(of_child)) * child_from_joint;
    let mut axis = || -> Result<DVec3, String> {
        let Some(said) = child(node, "axis") else {
            findings.warn(node, Repaired, "it has no axis: 0 0 1 is used");
            return Ok(DVec3::Z);
        };
        let axis = child(said, "xyz").and_then(|xyz| xyz.text()).unwrap_or("0 0 1");
        let axis = direction(axis, "its axis")?;
        let in_model = child(said, "use_parent_model_frame").and_then(|it| it.text());
        let in_model = in_model.is_some_and(|text| ["1", "true"].contains(&text.trim()));
        for (tag, range) in [("limit", ["lower", "upper"]), ("dynamics", ["damping", "friction"])] {
            let Some(found) = child(said, tag) else { continue };
            let says = |name: &&str| {
                let value = child(found, name).and_then(|it| it.text()).and_then(|it| it.trim().parse().ok());
                value.is_some_and(|value: f64| value != 0.0 && value.abs() < 1e15)
            };
            if range.iter().any(says) {
                findings.warn(
                    found,
                    Ignored,
                    "a constraint that closes a loop has no limits, damping or friction",
                );
            }
        }
        Ok(if in_model { root_from_joint.rotation.inverse() * axis } else { axis })
    };
    let kind = match node.attribute("type").unwrap_or_default().trim() {
        "fixed" => LinkConstraintKind::Weld,
        "ball" => LinkConstraintKind::PointToPoint,
        "revolute" | "continuous" | "hinge" => LinkConstraintKind::Hinge(axis()?),
        "prismatic" => LinkConstraintKind::Slide(axis()?),
        other => return Err(format!("a constraint cannot be a joint of type {}", quoted(other))),
    };
    let parent_from_joint = pose_of(root_from_link, parent).inverse() * root_from_joint;
    let ends = [
        ConstraintEnd {
            on: parent.map_or(ConstraintOn::World, ConstraintOn::Own),
            pose: Some(parent_from_joint),
        },
        ConstraintEnd { on: ConstraintOn::Own(of_child), pose: Some(child_from_joint) },
    ];
    Ok(LinkConstraint { name: name(node), kind, ends, max_force: None, max_torque: None, collisions: false })
}

/// Returns the poses of links in the root's frame with all joints at zero. Joint `i` ends at link `i + 1`.
fn root_from_links(joints: &[Joint]) -> Vec<DPose3> {
    let mut poses = vec![DPose3::IDENTITY];
    for joint in joints {
        let parent = pose_of(&poses, Some(joint.parent));
        poses.push(parent * joint.parent_from_joint);
    }
    poses
}

/// Returns the pose of a link, or of the world, which is the root's initial frame.
fn pose_of(root_from_link: &[DPose3], link: Option<usize>) -> DPose3 {
    link.and_then(|link| root_from_link.get(link)).copied().unwrap_or(DPose3::IDENTITY)
}

fn child<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| is(*child, tag))
}

/// Returns a name that fits into the constraint's name in the world.
fn name(node: Node) -> String {
    const LONGEST: usize = 100;
    node.attribute("name").unwrap_or_default().trim().chars().take(LONGEST).collect()
}

fn number(node: Node, name: &str) -> Result<Option<f64>, String> {
    let Some(text) = node.attribute(name).filter(|text| !text.trim().is_empty()) else { return Ok(None) };
    let [value] = values(text, name)?;
    if value.abs() > LARGEST_GIVEN {
        return Err(format!("{name}={} is larger than {LARGEST_GIVEN:e}", quoted(text)));
    }
    Ok(Some(value))
}

fn values<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let read = numbers::read(text, Shape::Exactly(N)).map_err(|why| format!("{what} {why}"))?;
    read.values.try_into().map_err(|_count| format!("{what} is not {}", counted(N, "number")))
}

fn direction(text: &str, what: &str) -> Result<DVec3, String> {
    let axis = DVec3::from_array(values(text, what)?);
    axis.try_normalize().filter(|unit| unit.is_finite()).ok_or_else(|| "its axis is 0".to_owned())
}

/// Returns the pose of an `<origin>`.
fn pose(origin: Node, findings: &mut Findings) -> Result<DPose3, String> {
    let of = |name: &str| origin.attribute(name).filter(|text| !text.trim().is_empty());
    let translation = match of("xyz") {
        Some(text) => DVec3::from_array(values(text, "xyz")?),
        None => DVec3::ZERO,
    };
    let turned = match (of("quat_xyzw"), of("rpy")) {
        (Some(text), said) => {
            if said.is_some() {
                findings.warn(origin, Ignored, "rpy and quat_xyzw are both given: quat_xyzw is used");
            }
            let quaternion = DQuat::from_array(values(text, "quat_xyzw")?);
            if quaternion.length().is_nan() || quaternion.length() < 1e-6 {
                return Err("its quat_xyzw is 0".to_owned());
            }
            quaternion.normalize()
        }
        (None, Some(text)) => rotation(values(text, "rpy")?),
        (None, None) => DQuat::IDENTITY,
    };
    Ok(DPose3::from_parts(translation, turned))
}
