//! Splits a model into robots: links that joints connect are one, whose root is free or on the world.
//!
//! Massless links express joints that URDF lacks: joints whose frame is not the child's, and joints of two
//! axes. A link with two parents keeps the first: constraints close loops.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;

use super::joint::{Joint, WORLD};
use super::model::Model;
use super::places::{Place, Places};
use crate::report::Disposition::Ignored;
use crate::translation::draft::{
    At, Draft, DraftConstraint, DraftConstraintKind, DraftEnd, DraftFrame, DraftJoint, DraftLink,
    DraftSensor, Names,
};
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Returns the robots of a model in the world.
pub(super) fn robots(model: Model, world_from_model: DPose3, notes: &mut Notes) -> Vec<Draft> {
    if model.links.is_empty() {
        let message = format!("the model {:?} has no links; left out", model.name);
        notes.warn_at_line(Ignored, model.at, message);
        return Vec::new();
    }
    let named = named_frames(&model, notes);
    let Model { name, at, is_static, self_collide, stays_awake, links, mut joints, .. } = model;
    if is_static {
        return vec![Draft { frames: named, ..of_static(name, at, links, world_from_model) }];
    }
    let index: BTreeMap<String, usize> =
        links.iter().enumerate().map(|(index, (link, _))| (link.name.clone(), index)).collect();
    let closing = keep_trees(&mut joints, &index);

    // Root of each link: the world, numbered after all links, for links on it.
    let world = links.len();
    let mut above: Vec<Option<usize>> = vec![None; links.len()];
    for joint in &joints {
        let parent = joint.parent.as_ref().map_or(Some(world), |parent| index.get(parent).copied());
        if let (Some(parent), Some(child)) = (parent, index.get(&joint.child)) {
            above[*child] = Some(parent);
        }
    }
    let root_of = |link: usize| {
        let mut at = link;
        // Trees have no loops, and no path is longer than the number of links.
        for _ in 0..=above.len() {
            match above.get(at).copied().flatten() {
                Some(up) => at = up,
                None => break,
            }
        }
        at
    };
    let roots: Vec<usize> = (0..links.len()).map(root_of).collect();
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (link, root) in roots.iter().enumerate() {
        groups.entry(*root).or_default().push(link);
    }
    let mut joints_of: BTreeMap<usize, Vec<&Joint>> = BTreeMap::new();
    for joint in &joints {
        if let Some(root) = index.get(&joint.child).and_then(|link| roots.get(*link)) {
            joints_of.entry(*root).or_default().push(joint);
        }
    }
    let mut frames_of: BTreeMap<usize, Vec<DraftFrame>> = BTreeMap::new();
    for frame in named {
        if let Some(root) = index.get(&frame.link).and_then(|link| roots.get(*link)) {
            frames_of.entry(*root).or_default().push(frame);
        }
    }
    let count = groups.len();
    // The robot of the first link has the model's name.
    let first = roots.first().copied().unwrap_or(0);
    let mut drafts = Vec::with_capacity(count);
    for (root, members) in groups {
        let root_name = links.get(root).map_or(WORLD, |(link, _)| link.name.as_str());
        let draft_name = if root == first { name.clone() } else { format!("{name}_{root_name}") };
        let model_from_root = links.get(root).map_or(DPose3::IDENTITY, |(_, pose)| *pose);
        let mut draft = Draft {
            name: draft_name,
            at,
            pose: world_from_model * model_from_root,
            fixed: root == world || root_name == WORLD,
            self_collision: self_collide,
            stays_awake,
            frames: frames_of.remove(&root).unwrap_or_default(),
            ..Draft::default()
        };
        let mut taken = Names::default();
        for (link, _) in members.iter().filter_map(|link| links.get(*link)) {
            taken.take(&link.name);
        }
        let mut world_name = WORLD.to_owned();
        if root == world {
            world_name = taken.unique(WORLD);
            draft.links.push(DraftLink::bare(world_name.clone(), at));
        }
        for member in &members {
            draft.links.extend(links.get(*member).map(|(link, _)| link.clone()));
        }
        // The root comes first.
        if let Some(first) = members.iter().position(|member| *member == root) {
            draft.links.swap(0, first);
        }
        for joint in joints_of.get(&root).into_iter().flatten() {
            let pose_of =
                |name: &str| index.get(name).and_then(|link| links.get(*link)).map(|(_, pose)| *pose);
            let model_from_parent = joint.parent.as_deref().and_then(pose_of).unwrap_or(DPose3::IDENTITY);
            let model_from_child = pose_of(&joint.child).unwrap_or(DPose3::IDENTITY);
            let parent = joint.parent.clone().unwrap_or_else(|| world_name.clone());
            add_joint(&mut draft, joint, parent, [model_from_parent, model_from_child], &mut taken);
        }
        drafts.push(draft);
    }
    let mut places = Places::new();
    for (robot, draft) in drafts.iter().enumerate() {
        let own = draft.links.iter().filter_map(|link| index.get(&link.name)).filter_map(|at| links.get(*at));
        let place = |link: &DraftLink, pose: &DPose3| Place { robot, link: link.name.clone(), pose: *pose };
        places.extend(own.map(|(link, pose)| (link.name.clone(), place(link, pose))));
    }
    for joint in &closing {
        constrain(joint, &mut drafts, (&places, world_from_model), Why::Loop, notes);
    }
    drafts
}

/// Returns the frames of a model in the frames of the links that they are attached to.
fn named_frames(model: &Model, notes: &mut Notes) -> Vec<DraftFrame> {
    let poses: BTreeMap<&str, &DPose3> =
        model.links.iter().map(|(link, pose)| (link.name.as_str(), pose)).collect();
    let mut frames = Vec::new();
    for (name, at) in &model.named {
        let link = model.attached.get(name).and_then(|link| Some((link, poses.get(link.as_str())?)));
        let (Some((link, model_from_link)), Some(model_from_frame)) = (link, model.frames.get(name)) else {
            let message = format!("the frame {} is attached to no link: left out", quoted(name));
            notes.warn_at_line(Ignored, *at, message);
            continue;
        };
        let link_from_frame = model_from_link.inverse() * *model_from_frame;
        frames.push(DraftFrame { name: name.clone(), link: link.clone(), link_from_frame });
    }
    frames
}

/// Reason why a joint is a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// It closes a loop of its model.
    Loop,
    /// It connects models of the world.
    Models,
}

impl Why {
    fn word(self) -> &'static str {
        match self {
            Self::Loop => "closes a loop",
            Self::Models => "connects models",
        }
    }

    fn remedy(self) -> &'static str {
        match self {
            Self::Loop => "",
            Self::Models => "; a model that includes both has all of the joint",
        }
    }
}

/// Replaces a joint outside of the trees by a constraint, which belongs to the robot of its child.
/// `world_from_model` is the frame of the places.
pub(super) fn constrain(
    joint: &Joint,
    drafts: &mut [Draft],
    (places, world_from_model): (&Places, DPose3),
    why: Why,
    notes: &mut Notes,
) {
    let (word, remedy) = (why.word(), why.remedy());
    let kind = match (&joint.axes[..], joint.is_ball) {
        (_, true) => DraftConstraintKind::PointToPoint,
        ([], false) => DraftConstraintKind::Weld,
        ([axis], false) if axis.kind == "prismatic" => DraftConstraintKind::Slide(axis.direction),
        ([axis], false) => DraftConstraintKind::Hinge(axis.direction),
        _ => {
            let message = format!("the joint {:?} {word}, and has two axes: left out{remedy}", joint.name);
            return notes.warn_at_line(Ignored, joint.at, message);
        }
    };
    let has_more = |axis: &super::joint::Axis| {
        let limits = axis.limits;
        axis.damping > 0.0
            || axis.friction > 0.0
            || axis.spring.is_some()
            || limits.lower.is_some()
            || limits.upper.is_some()
    };
    if joint.axes.iter().any(has_more) || joint.mimic.is_some() {
        let message = format!(
            "the joint {:?} {word}: the constraint in its place has no limits, damping or friction{remedy}",
            joint.name
        );
        notes.warn_at_line(Ignored, joint.at, message);
    }
    let end_at = |place: &Place, robot: Option<String>| DraftEnd {
        robot,
        name: Some(place.link.clone()),
        pose: place.pose.inverse() * joint.model_from_joint,
    };
    let Some(of_child) = places.get(&joint.child) else { return };
    let (own, child) = (of_child.robot, end_at(of_child, None));
    let parent = match joint.parent.as_ref() {
        Some(name) => {
            let Some(place) = places.get(name) else { return };
            let other = drafts.get(place.robot).filter(|_| place.robot != own);
            end_at(place, other.map(|draft| draft.name.clone()))
        }
        None => {
            let root = drafts.get(own).map_or(DPose3::IDENTITY, |draft| draft.pose);
            let pose = root.inverse() * world_from_model * joint.model_from_joint;
            DraftEnd { robot: None, name: None, pose }
        }
    };
    if let Some(draft) = drafts.get_mut(own) {
        let (name, at) = (joint.name.clone(), joint.at);
        draft.constraints.push(DraftConstraint { name, at, kind, ends: [parent, child], collisions: false });
    }
}

/// Takes out joints whose child already has a parent, and joints that close a loop.
fn keep_trees(joints: &mut Vec<Joint>, index: &BTreeMap<String, usize>) -> Vec<Joint> {
    let mut closing = Vec::new();
    let mut above: Vec<Option<usize>> = vec![None; index.len()];
    let mut held: BTreeSet<usize> = BTreeSet::new();
    joints.retain(|joint| {
        let Some(child) = index.get(&joint.child).copied() else { return false };
        let parent = joint.parent.as_ref().and_then(|parent| index.get(parent).copied());
        let mut is_circle = false;
        let mut at = parent;
        for _ in 0..=above.len() {
            is_circle |= at == Some(child);
            at = at.and_then(|at| above.get(at).copied().flatten());
            if at.is_none() {
                break;
            }
        }
        if is_circle || !held.insert(child) {
            closing.push(joint.clone());
            return false;
        }
        if let Some(slot) = above.get_mut(child) {
            *slot = parent;
        }
        true
    });
    closing
}

/// Returns the robot of a static model: none of its links moves, whatever its joints say.
fn of_static(name: String, at: At, links: Vec<(DraftLink, DPose3)>, world_from_model: DPose3) -> Draft {
    let root_pose = links.first().map_or(DPose3::IDENTITY, |(_, pose)| *pose);
    let root_name = links.first().map(|(link, _)| link.name.clone()).unwrap_or_default();
    let mut draft = Draft { name, at, pose: world_from_model * root_pose, fixed: true, ..Draft::default() };
    for (link, pose) in links {
        if !draft.links.is_empty() {
            let ends = [root_name.clone(), link.name.clone()];
            let joint =
                DraftJoint::fixed(format!("{}_fixed", link.name), link.at, ends, root_pose.inverse() * pose);
            draft.joints.push(joint);
        }
        draft.links.push(link);
    }
    draft
}

/// Returns whether two frames are equal, except for rounding.
fn is_identity(pose: &DPose3) -> bool {
    pose.translation.length() < 1e-12 && pose.rotation.to_scaled_axis().length() < 1e-12
}

fn add_joint(
    draft: &mut Draft,
    joint: &Joint,
    parent: String,
    [model_from_parent, model_from_child]: [DPose3; 2],
    taken: &mut Names,
) {
    let parent_from_joint = model_from_parent.inverse() * joint.model_from_joint;
    let joint_from_child = joint.model_from_joint.inverse() * model_from_child;
    let child = joint.child.clone();
    if joint.axes.is_empty() && !joint.is_ball {
        let parent_from_child = parent_from_joint * joint_from_child;
        let mut written = DraftJoint::fixed(joint.name.clone(), joint.at, [parent, child], parent_from_child);
        let child_from_joint = joint_from_child.inverse();
        let in_child =
            |sensor: &DraftSensor| DraftSensor { pose: child_from_joint * sensor.pose, ..sensor.clone() };
        written.sensors = joint.sensors.iter().map(in_child).collect();
        draft.joints.push(written);
        return;
    }
    // Massless links: after each axis but the last one, and after that one if the child's frame differs.
    let is_apart = !is_identity(&joint_from_child);
    let moving = joint.axes.len().max(1);
    let mut between = |what: &str| {
        let name = taken.unique(&format!("{}_{what}", joint.name));
        draft.links.push(DraftLink::bare(name.clone(), joint.at));
        name
    };
    let mut ends: Vec<String> = vec![parent];
    for _ in 1..moving {
        ends.push(between("cross"));
    }
    ends.push(if is_apart { between("frame") } else { child.clone() });
    let mut poses = std::iter::once(parent_from_joint).chain(std::iter::repeat(DPose3::IDENTITY));
    for (index, pair) in ends.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        let name = if index == 0 { joint.name.clone() } else { format!("{}_axis2", joint.name) };
        let pose = poses.next().unwrap_or(DPose3::IDENTITY);
        let mut written = DraftJoint::fixed(name, joint.at, [from.clone(), to.clone()], pose);
        written.kind = "spherical";
        if let Some(axis) = joint.axes.get(index) {
            written.kind = axis.kind;
            written.axis = axis.direction;
            written.limits = axis.limits;
            (written.damping, written.friction, written.spring) = (axis.damping, axis.friction, axis.spring);
            (written.armature, written.position) = (axis.armature, axis.position);
            written.drive.clone_from(&axis.drive);
        }
        if index == 0 {
            written.mimic.clone_from(&joint.mimic);
            // The child of the first joint has the joint's frame.
            written.sensors.clone_from(&joint.sensors);
        }
        draft.joints.push(written);
    }
    if let (true, Some(frame)) = (is_apart, ends.pop()) {
        let name = format!("{}_frame", joint.name);
        draft.joints.push(DraftJoint::fixed(name, joint.at, [frame, child], joint_from_child));
    }
}
