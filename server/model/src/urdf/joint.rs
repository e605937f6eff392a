//! Joints: kinds, axes, limits, damping and friction.

use glamx::DVec3;
use roxmltree::Node;

use super::findings::{Findings, Refusal};
use super::geometry::{ROUNDING, pose};
use super::mimic;
use super::numbers::{self, Shape};
use super::repair::{RepairedUrdf, given};
use super::tree::Tree;
use crate::report::Disposition::{Defaulted, Ignored, Repaired, Used};
use crate::robot::{Joint, JointKind, JointLimits};

/// Returns all joints, in the tree's order.
pub(super) fn read_all<'a, 'i>(
    repaired: &RepairedUrdf<'a, 'i>,
    tree: &Tree<'a, 'i>,
    findings: &mut Findings,
) -> Result<Vec<Joint>, Refusal> {
    let mut joints = Vec::with_capacity(tree.joints.len());
    for (index, (tree_joint, node)) in tree.joints.iter().zip(&tree.joint_nodes).enumerate() {
        let Some(joint) = repaired.robot.joints.get(tree_joint.in_file) else { continue };
        let kind = kind(&joint.joint_type);
        let dynamics = repaired.child(*node, "dynamics");
        let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |it| (it.damping, it.friction));
        joints.push(Joint {
            name: joint.name.clone(),
            kind,
            parent: tree_joint.parent,
            child: index + 1,
            parent_from_joint: pose(&joint.origin, repaired.child(*node, "origin"), findings),
            axis: axis(joint, kind, *node, repaired.child(*node, "axis"), findings),
            limits: limits(kind, *node, repaired.child(*node, "limit"), findings),
            damping: not_negative("damping", damping, dynamics, findings),
            friction: not_negative("friction", friction, dynamics, findings),
            mimic: None,
        });
    }
    mimic::resolve(repaired, tree, &mut joints, findings);
    Ok(joints)
}

fn kind(kind: &urdf_rs::JointType) -> JointKind {
    match kind {
        urdf_rs::JointType::Revolute => JointKind::Revolute,
        urdf_rs::JointType::Continuous => JointKind::Continuous,
        urdf_rs::JointType::Prismatic => JointKind::Prismatic,
        urdf_rs::JointType::Fixed => JointKind::Fixed,
        urdf_rs::JointType::Floating => JointKind::Floating,
        urdf_rs::JointType::Planar => JointKind::Planar,
        urdf_rs::JointType::Spherical => JointKind::Spherical,
    }
}

fn axis(
    joint: &urdf_rs::Joint,
    kind: JointKind,
    node: Node,
    axis_node: Option<Node>,
    findings: &mut Findings,
) -> DVec3 {
    let axis = DVec3::from_array(joint.axis.xyz.0);
    // Exporters write a meaningless axis of 0 on fixed joints.
    let has_axis = !matches!(kind, JointKind::Fixed | JointKind::Floating | JointKind::Spherical);
    let length = axis.length();
    if !has_axis {
        return axis.try_normalize().unwrap_or(DVec3::X);
    }
    let Some(axis_node) = axis_node else {
        findings.info(node, Defaulted, "it has no axis; 1 0 0 is used, as URDF says");
        return DVec3::X;
    };
    if length < 1e-9 {
        findings.warn(axis_node, Repaired, "the axis is 0; 1 0 0 is used");
        return DVec3::X;
    }
    let message = || format!("the axis has length {length:.6} and was normalized");
    let off = (length - 1.0).abs();
    if off > ROUNDING {
        findings.warn(axis_node, Repaired, message());
    } else if off > 1e-6 {
        findings.used(axis_node, message);
    }
    axis / length
}

fn limits(kind: JointKind, joint: Node, node: Option<Node>, findings: &mut Findings) -> JointLimits {
    let slides_or_turns = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
    let Some(node) = node else {
        if slides_or_turns {
            findings.info(joint, Defaulted, "it has no limit: it moves without limits");
        }
        return JointLimits::default();
    };
    if !slides_or_turns && !matches!(kind, JointKind::Continuous | JointKind::Spherical) {
        if kind.moves() {
            findings.info(node, Ignored, "floating and planar joints have no limits in simd");
        }
        return JointLimits::default();
    }
    let limit = Said::of(node);
    let mut unset = Vec::new();
    let without_position_limits = match kind {
        JointKind::Continuous => Some("a continuous joint has no position limits"),
        JointKind::Spherical => Some("a spherical joint has no position limits in simd"),
        _ => None,
    };
    let (lower, upper) = if let Some(message) = without_position_limits {
        if limit.lower.unwrap_or(0.0) != 0.0 || limit.upper.unwrap_or(0.0) != 0.0 {
            findings.info(node, Ignored, message);
        }
        (None, None)
    } else {
        position_limits(&limit, node, &mut unset, findings)
    };
    let mut positive = |name: &'static str, value: Option<f64>| {
        let value = value.unwrap_or(0.0);
        if value == 0.0 || !value.is_finite() {
            unset.push((name, value));
            return None;
        }
        if value < 0.0 {
            let message = format!("{name} {value} is negative: read as {}", -value);
            findings.warn(node, Repaired, message);
        }
        Some(value.abs())
    };
    let (effort, velocity) = (positive("effort", limit.effort), positive("velocity", limit.velocity));
    for (what, infinite) in [("0 or left out", false), ("infinite", true)] {
        let named = unset.iter().filter(|(_, value)| value.is_infinite() == infinite).map(|(name, _)| *name);
        let named: Vec<&str> = named.collect();
        if !named.is_empty() {
            findings.info(node, Defaulted, format!("{}: {what}, read as no limit", named.join(", ")));
        }
    }
    JointLimits { lower, upper, effort, velocity }
}

/// Numbers of a `<limit>`; urdf-rs does not distinguish 0 from none.
struct Said {
    lower: Option<f64>,
    upper: Option<f64>,
    effort: Option<f64>,
    velocity: Option<f64>,
}

impl Said {
    fn of(node: Node) -> Self {
        let bound = |name| {
            let value = given(Some(node), name).then(|| numbers::of(node, name, Shape::Bound));
            value.flatten().map(|[value]: [f64; 1]| value)
        };
        Self {
            lower: bound("lower"),
            upper: bound("upper"),
            effort: bound("effort"),
            velocity: bound("velocity"),
        }
    }

    /// Returns whether all are 0: SolidWorks writes lower, upper, effort and velocity 0 for "not given".
    fn is_all_zero(&self) -> bool {
        [self.lower, self.upper, self.effort, self.velocity].iter().all(|said| said.unwrap_or(0.0) == 0.0)
    }

    /// Returns whether PyBullet treats it as no limit: its models write a lower of 1 or 0 and an upper of -1.
    fn is_bullets_none(&self) -> bool {
        self.upper == Some(-1.0) && matches!(self.lower, Some(0.0 | 1.0))
    }
}

fn position_limits(
    limit: &Said,
    node: Node,
    unset: &mut Vec<(&'static str, f64)>,
    findings: &mut Findings,
) -> (Option<f64>, Option<f64>) {
    if limit.is_all_zero() || (limit.lower.is_none() && limit.upper.is_none()) {
        unset.extend([("lower", 0.0), ("upper", 0.0)]);
        return (None, None);
    }
    for (name, bound) in [("lower", limit.lower), ("upper", limit.upper)] {
        if bound.is_none() {
            findings.info(node, Defaulted, format!("{name} is not given: 0, as URDF says"));
        }
    }
    let (lower, upper) = (limit.lower.unwrap_or(0.0), limit.upper.unwrap_or(0.0));
    if lower > upper && limit.is_bullets_none() {
        let message =
            format!("lower {lower} above upper {upper} is PyBullet's way to say no limit: read as no limit");
        findings.warn(node, Repaired, message);
        return (None, None);
    }
    let (lower, upper) = if lower > upper {
        findings.warn(node, Repaired, format!("lower {lower} is above upper {upper}: they were swapped"));
        (upper, lower)
    } else {
        (lower, upper)
    };
    if lower == upper && lower.is_finite() {
        let message = format!("lower and upper are both {lower}: the joint is locked there");
        findings.warn(node, Used, message);
    } else if lower > 0.0 || upper < 0.0 {
        let nearest = if lower > 0.0 { lower } else { upper };
        let message =
            || format!("0 lies outside of its limits, {lower} to {upper}: the joint starts at {nearest}");
        findings.used(node, message);
    }
    let mut bound = |name, value: f64| {
        if !value.is_finite() {
            unset.push((name, value));
        }
        Some(value).filter(|value| value.is_finite())
    };
    (bound("lower", lower), bound("upper", upper))
}

fn not_negative(name: &str, value: f64, node: Option<Node>, findings: &mut Findings) -> f64 {
    if value >= 0.0 {
        return value.abs();
    }
    if let Some(node) = node {
        findings.warn(node, Repaired, format!("{name} {value} is negative: read as 0"));
    }
    0.0
}
