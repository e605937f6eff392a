//! Initial state of the robot: combines `<gazebo>`, `<ros2_control>`, `<group_state>`, `<constraint>`,
//! `<sensor>` and `<disable_collisions>`.

use super::constraints;
use super::control;
use super::findings::Findings;
use super::gazebo::Gazebo;
use super::numbers::{self, Shape};
use super::repair::RepairedUrdf;
use super::sensors;
use super::srdf;
use super::states;
use super::transmission;
use super::tree::Tree;
use crate::report::Disposition::Ignored;
use crate::robot::{Joint, JointKind, Link};
use crate::setup::{DriveMode, LinkGroups, LinkPair, Setup, Spring, Tendon};

/// Reads the setup. Limits, damping and friction are set on the joints themselves, and colours on the
/// visuals.
pub(super) fn read(
    repaired: &RepairedUrdf,
    tree: &Tree,
    gazebo: &Gazebo,
    (links, joints, tendons): (&mut [Link], &mut [Joint], Vec<Tendon>),
    findings: &mut Findings,
) -> Setup {
    let mut setup = Setup { tendons, ..Setup::default() };
    for joint in setup.tendons.iter().map(|tendon| tendon.joint).collect::<Vec<_>>() {
        // It does not hold its position unless the description has a drive.
        setup.joint(joint).mode = Some(DriveMode::Passive);
    }
    for link in links.iter_mut() {
        let Some(color) = gazebo.colors.get(&link.name) else { continue };
        link.visuals.iter_mut().for_each(|visual| visual.color = visual.color.or(Some(*color)));
    }
    of_joints(repaired, tree, gazebo, joints, &mut setup, findings);
    control::read(repaired.root, joints, &mut setup, findings);
    transmission::read(repaired.root, joints, &mut setup, findings);
    couple(joints, &mut setup);
    setup.states = states::read(repaired.root, joints, findings);
    self_collisions(gazebo, links, &mut setup, repaired, findings);
    setup.stays_awake = gazebo.stays_awake;
    setup.pairs.extend(srdf::of_robot(repaired.root, links, findings));
    groups(repaired, tree, &mut setup, findings);
    setup.constraints = constraints::read(repaired.root, (links, joints), findings);
    setup.sensors = sensors::read(repaired.root, (links, joints), findings);
    setup.joints.retain(|joint| !joint.is_silent());
    setup
}

/// Sets damping, friction and springs from `<gazebo>`, and the armature from `<dynamics>`.
fn of_joints(
    repaired: &RepairedUrdf,
    tree: &Tree,
    gazebo: &Gazebo,
    joints: &mut [Joint],
    setup: &mut Setup,
    findings: &mut Findings,
) {
    for (index, (joint, node)) in joints.iter_mut().zip(&tree.joint_nodes).enumerate() {
        let dynamics = repaired.child(*node, "dynamics");
        let armature = dynamics.and_then(|node| numbers::of::<1>(node, "armature", Shape::Exactly(1)));
        if let (Some([armature]), Some(node)) = (armature, dynamics) {
            if armature < 0.0 {
                findings.warn(node, Ignored, format!("armature {armature} is negative: left out"));
            } else if armature > 0.0 {
                setup.joint(index).armature = armature;
            }
        }
        let Some(of) = gazebo.joints.get(&joint.name) else { continue };
        // `<dynamics>` takes precedence.
        if joint.damping == 0.0 {
            joint.damping = of.damping.unwrap_or(0.0);
        }
        if joint.friction == 0.0 {
            joint.friction = of.friction.unwrap_or(0.0);
        }
        let Some(stiffness) = of.stiffness.filter(|stiffness| *stiffness > 0.0) else { continue };
        let rest = match joint.kind {
            JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => of.reference.unwrap_or(0.0),
            JointKind::Spherical => 0.0,
            _ => {
                let message = "only joints of one axis and spherical joints have a spring in simd: left out";
                findings.warn(*node, Ignored, message);
                continue;
            }
        };
        let of_joint = setup.joint(index);
        of_joint.spring = Some(Spring { stiffness, rest });
        // The spring should move the joint, so no other drive acts unless the description has one.
        of_joint.mode = Some(DriveMode::Passive);
    }
}

/// Moves rotor inertias and springs of mimic joints to the joints that they follow, since they belong to the
/// coupled motion. For a follower at `m q + b`, the leader gets m^2 times their values, and a rest position
/// of (r - b) / m.
fn couple(joints: &[Joint], setup: &mut Setup) {
    for follower in 0..joints.len() {
        // Through all joints that it follows, without loops.
        let (mut leader, mut factor, mut offset) = (follower, 1.0, 0.0);
        for _ in 0..joints.len() {
            let Some(mimic) = joints.get(leader).and_then(|joint| joint.mimic) else { break };
            (leader, offset) = (mimic.joint, offset + factor * mimic.offset);
            factor *= mimic.multiplier;
        }
        if leader == follower {
            continue;
        }
        let own = setup.joint(follower);
        let (armature, spring) = (std::mem::take(&mut own.armature), own.spring.take());
        if armature == 0.0 && spring.is_none() {
            continue;
        }
        let of_leader = setup.joint(leader);
        of_leader.armature += factor * factor * armature;
        if let Some(Spring { stiffness, rest }) = spring {
            let known = of_leader.spring.unwrap_or_default();
            // The products k q_rest sum up; a spring without stiffness has no rest position.
            let total = known.stiffness + factor * factor * stiffness;
            let pull = known.stiffness * known.rest + factor * stiffness * (rest - offset);
            of_leader.spring = (total > 0.0).then(|| Spring { stiffness: total, rest: pull / total });
        }
    }
}

/// Applies self-collision as Gazebo does: two links collide if both have it.
fn self_collisions(
    gazebo: &Gazebo,
    links: &[Link],
    setup: &mut Setup,
    repaired: &RepairedUrdf,
    findings: &mut Findings,
) {
    let says = |link: &Link| gazebo.self_collide.contains(&link.name);
    let count = links.iter().filter(|link| says(link)).count();
    setup.self_collision = gazebo.all_collide || count > 1;
    if gazebo.all_collide || count < 2 || count == links.len() {
        return;
    }
    for (index, link) in links.iter().enumerate() {
        for (before, other) in links.iter().enumerate().take(index) {
            if says(link) && says(other) {
                continue;
            }
            if setup.pairs.len() >= srdf::MAX_PAIRS {
                let message = "too many links touch each other or not: all of them do";
                findings.warn(repaired.root, Ignored, message);
                setup.pairs.clear();
                return;
            }
            setup.pairs.push(LinkPair { links: [before, index], enabled: false });
        }
    }
    findings.used(repaired.root, || super::gazebo::colliding(count));
}

/// Reads the bits of `<contact>`: MuJoCo's attributes, where a common bit lets two links collide.
fn groups(repaired: &RepairedUrdf, tree: &Tree, setup: &mut Setup, findings: &mut Findings) {
    for (index, node) in tree.link_nodes.iter().enumerate() {
        let Some(contact) = repaired.child(*node, "contact") else { continue };
        let mut bits = |tag: &'static str| {
            let node = repaired.child(contact, tag)?;
            let [value] = numbers::of::<1>(node, "value", Shape::Exactly(1))?;
            let is_fit = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
            if !is_fit {
                findings.warn(node, Ignored, format!("{value} is not a 32-bit mask: left out"));
            }
            is_fit.then_some(value as u32)
        };
        let (group, mask) = (bits("contype"), bits("conaffinity"));
        if group.is_some() || mask.is_some() {
            let (group, mask) = (group.unwrap_or(1), mask.unwrap_or(1));
            setup.groups.push(LinkGroups { link: index, group, mask });
        }
    }
}
