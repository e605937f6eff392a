//! Joints: kinds, axes, limits, damping and friction.

use glamx::DVec3;
use roxmltree::Node;

use super::findings::{Findings, Refusal};
use super::geometry::pose;
use super::mend::{Mended, given};
use super::mimic;
use super::tree::Tree;
use crate::report::Disposition::{Defaulted, Ignored, Repaired};
use crate::robot::{Joint, JointKind, Limits};

/// All joints, in the tree's order.
pub(super) fn read_all<'a, 'i>(
    mended: &Mended<'a, 'i>,
    tree: &Tree<'a, 'i>,
    findings: &mut Findings,
) -> Result<Vec<Joint>, Refusal> {
    let mut joints = Vec::with_capacity(tree.joints.len());
    for (index, (place, node)) in tree.joints.iter().zip(&tree.joint_nodes).enumerate() {
        let Some(joint) = mended.robot.joints.get(place.in_file) else { continue };
        let Some(kind) = kind(&joint.joint_type) else {
            return Err(findings.refuse(*node, "simd knows no joint of this type"));
        };
        let dynamics = mended.child(*node, "dynamics");
        let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |it| (it.damping, it.friction));
        joints.push(Joint {
            name: joint.name.clone(),
            kind,
            parent: place.parent,
            child: index + 1,
            parent_from_joint: pose(&joint.origin, mended.child(*node, "origin"), findings),
            axis: axis(joint, kind, *node, mended.child(*node, "axis"), findings),
            limits: limits(&joint.limit, kind, *node, mended.child(*node, "limit"), findings),
            damping: not_negative("damping", damping, dynamics, findings),
            friction: not_negative("friction", friction, dynamics, findings),
            mimic: None,
        });
    }
    mimic::resolve(mended, tree, &mut joints, findings)?;
    Ok(joints)
}

fn kind(kind: &urdf_rs::JointType) -> Option<JointKind> {
    Some(match kind {
        urdf_rs::JointType::Revolute => JointKind::Revolute,
        urdf_rs::JointType::Continuous => JointKind::Continuous,
        urdf_rs::JointType::Prismatic => JointKind::Prismatic,
        urdf_rs::JointType::Fixed => JointKind::Fixed,
        urdf_rs::JointType::Floating => JointKind::Floating,
        urdf_rs::JointType::Planar => JointKind::Planar,
        urdf_rs::JointType::Spherical => return None,
    })
}

fn axis(
    joint: &urdf_rs::Joint,
    kind: JointKind,
    node: Node,
    axis_node: Option<Node>,
    findings: &mut Findings,
) -> DVec3 {
    let axis = DVec3::from_array(joint.axis.xyz.0);
    // Exporters write an axis of 0 on fixed joints, where none is meant.
    let has_axis = !matches!(kind, JointKind::Fixed | JointKind::Floating);
    let length = axis.length();
    if !has_axis {
        return axis.try_normalize().unwrap_or(DVec3::X);
    }
    let Some(axis_node) = axis_node else {
        findings.info(node, Defaulted, "it has no axis; 1 0 0 is taken, as URDF says");
        return DVec3::X;
    };
    if length < 1e-9 {
        findings.warn(axis_node, Repaired, "the axis is 0; 1 0 0 is taken");
        return DVec3::X;
    }
    let off = (length - 1.0).abs();
    if off > 0.01 {
        findings.warn(axis_node, Repaired, format!("the axis has length {length:.6} and was made 1 long"));
    } else if off > 1e-6 {
        findings.info(axis_node, Repaired, format!("the axis has length {length:.6} and was made 1 long"));
    }
    axis / length
}

fn limits(
    limit: &urdf_rs::JointLimit,
    kind: JointKind,
    joint: Node,
    node: Option<Node>,
    findings: &mut Findings,
) -> Limits {
    let slides_or_turns = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
    let Some(node) = node else {
        if slides_or_turns {
            findings.info(joint, Defaulted, "it has no limit: it moves without limits");
        }
        return Limits::default();
    };
    if !slides_or_turns && kind != JointKind::Continuous {
        if kind.moves() {
            findings.info(node, Ignored, "floating and planar joints have no limits in simd");
        }
        return Limits::default();
    }
    let mut unset = Vec::new();
    let (lower, upper) = if kind == JointKind::Continuous {
        if limit.lower != 0.0 || limit.upper != 0.0 {
            findings.info(node, Ignored, "a continuous joint has no position limits");
        }
        (None, None)
    } else {
        position_limits(limit, node, &mut unset, findings)
    };
    let mut positive = |name: &'static str, value: f64| {
        if value == 0.0 {
            if given(Some(node), name) {
                unset.push(name);
            }
            return None;
        }
        if value < 0.0 {
            let message = format!("{name} {value} is negative: read as {}", -value);
            findings.warn(node, Repaired, message);
        }
        Some(value.abs())
    };
    let (effort, velocity) = (positive("effort", limit.effort), positive("velocity", limit.velocity));
    if !unset.is_empty() {
        findings.info(node, Defaulted, format!("{}: 0 or left out, read as no limit", unset.join(", ")));
    }
    Limits { lower, upper, effort, velocity }
}

/// SolidWorks writes lower, upper, effort and velocity 0 for "not given".
fn position_limits(
    limit: &urdf_rs::JointLimit,
    node: Node,
    unset: &mut Vec<&'static str>,
    findings: &mut Findings,
) -> (Option<f64>, Option<f64>) {
    let (lower, upper) = (limit.lower, limit.upper);
    match (given(Some(node), "lower"), given(Some(node), "upper")) {
        (false, false) => {
            unset.extend(["lower", "upper"]);
            return (None, None);
        }
        (true, true) => {}
        (false, true) => findings.info(node, Defaulted, "lower is not given: 0, as URDF says"),
        (true, false) => findings.info(node, Defaulted, "upper is not given: 0, as URDF says"),
    }
    if lower == 0.0 && upper == 0.0 && limit.effort == 0.0 && limit.velocity == 0.0 {
        unset.extend(["lower", "upper"]);
        return (None, None);
    }
    if lower > upper {
        findings.warn(node, Repaired, format!("lower {lower} is above upper {upper}: they were swapped"));
        return (Some(upper), Some(lower));
    }
    if lower == upper {
        let message = format!("lower and upper are both {lower}: the joint is locked there");
        findings.warn(node, crate::report::Disposition::Used, message);
    }
    (Some(lower), Some(upper))
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
