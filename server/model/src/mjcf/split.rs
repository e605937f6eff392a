//! Splits bodies into robots: all bodies that do not move are one, and each other child of the world is one
//! with its descendants.

use std::collections::BTreeMap;

use glamx::{DPose3, DVec3};

use super::body::Body;
use super::equality::{End, Held, world_from_body};
use super::joint::{BodyJoint, Joints, Kind};
use super::tendon::Independent;
use crate::report::Disposition::Ignored;
use crate::report::counted;
use crate::robot::Inertial;
use crate::translation::draft::{
    At, Draft, DraftConstraint, DraftDrive, DraftEnd, DraftJoint, DraftLink, DraftState, Names,
};
use crate::translation::element::Element;
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Name of the fixed root.
const WORLD: &str = "world";

/// Settings of bodies outside of them.
pub(super) struct Said<'s> {
    pub(super) joints: &'s Joints,
    pub(super) keys: &'s [DraftState],
    /// Pairs of bodies that do not collide.
    pub(super) excluded: &'s [([String; 2], At)],
    /// Connected bodies.
    pub(super) held: &'s [Held],
}

pub(super) fn robots(
    root: Element,
    name: &str,
    bodies: &[Body],
    said: &Said,
    notes: &mut Notes,
) -> Vec<Draft> {
    let Said { joints, keys, excluded, held } = *said;
    let moves = moving(bodies);
    // Child of the world that each body descends from; the world itself for fixed bodies.
    let mut tops: Vec<usize> = Vec::with_capacity(bodies.len());
    for (index, body) in bodies.iter().enumerate() {
        let top = match tops.get(body.parent).copied() {
            Some(0) | None if moves.get(index) == Some(&true) && body.parent == 0 => index,
            Some(top) => top,
            None => 0,
        };
        tops.push(top);
    }
    let has_groups = bodies
        .iter()
        .flat_map(|body| &body.geoms)
        .any(|geom| geom.is_collision && (geom.contype, geom.conaffinity) != (1, 1));
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, top) in tops.iter().enumerate() {
        members.entry(*top).or_default().push(index);
    }
    let still = members.remove(&0).unwrap_or_default();
    let mut drafts: Vec<Draft> = Vec::new();
    let mut names = Names::default();
    let mut robot_of_top: BTreeMap<usize, usize> = BTreeMap::new();
    for (top, members_of) in &members {
        let Some(body) = bodies.get(*top) else { continue };
        robot_of_top.insert(*top, drafts.len());
        let own = if members.len() == 1 && !name.is_empty() { name } else { &body.name };
        let draft = robot(own, *top, members_of, bodies, joints, has_groups);
        drafts.push(Draft { name: names.unique(&draft.name), ..draft });
    }
    give_states(keys, &mut drafts);
    let robot_of = |body: usize| tops.get(body).and_then(|top| robot_of_top.get(top)).copied();
    for held in held {
        hold(held, bodies, &robot_of, &mut drafts, notes);
    }
    let has_content =
        |index: &usize| bodies.get(*index).is_some_and(|body| *index > 0 || !body.geoms.is_empty());
    if still.iter().any(has_content) {
        let own = match (drafts.is_empty(), name) {
            (true, "") => "mujoco".to_owned(),
            (true, name) => name.to_owned(),
            (false, "") => "ground".to_owned(),
            (false, name) => format!("{name}_ground"),
        };
        let mut draft = robot(&own, 0, &still, bodies, joints, has_groups);
        draft.fixed = true;
        draft.name = names.unique(&draft.name);
        drafts.push(draft);
    } else if let Some(count) = bodies.first().map(|world| world.sites.len()).filter(|count| *count > 0) {
        let message = format!("{} of the world left out: no robot stands still", counted(count, "site"));
        notes.info(root, Ignored, message);
    }
    exclude(excluded, &mut drafts, root, notes);
    drafts
}

/// Gives a constraint to the robot of its first moving end. Fixed bodies belong to the world.
fn hold(
    held: &Held,
    bodies: &[Body],
    robot_of: &dyn Fn(usize) -> Option<usize>,
    drafts: &mut [Draft],
    notes: &mut Notes,
) {
    let robots = held.ends.each_ref().map(|end| robot_of(end.body));
    let Some(own) = robots[0].or(robots[1]) else {
        let message = format!("both ends of {} stand still: left out", quoted(&held.name));
        return notes.warn_at_line(Ignored, held.at, message);
    };
    let root_from_world = drafts.get(own).map_or(DPose3::IDENTITY, |draft| draft.pose.inverse());
    let end = |end: &End| {
        let Some(at) = robot_of(end.body) else {
            let pose = root_from_world * world_from_body(bodies, end.body) * end.pose;
            return DraftEnd { robot: None, name: None, pose };
        };
        let robot = drafts.get(at).filter(|_| at != own).map(|draft| draft.name.clone());
        let body = bodies.get(end.body).map(|body| body.name.clone());
        DraftEnd { robot, name: end.joint.clone().or(body), pose: end.pose }
    };
    let ends = held.ends.each_ref().map(end);
    if let Some(draft) = drafts.get_mut(own) {
        let Held { name, at, kind, .. } = held;
        // As in MuJoCo, where connected bodies collide.
        draft.constraints.push(DraftConstraint {
            name: name.clone(),
            at: *at,
            kind: *kind,
            ends,
            collisions: true,
        });
    }
}

/// Gives each robot the positions of its joints.
fn give_states(keys: &[DraftState], drafts: &mut [Draft]) {
    let mut robots: BTreeMap<String, usize> = BTreeMap::new();
    for (robot, draft) in drafts.iter().enumerate() {
        robots.extend(draft.joints.iter().map(|joint| (joint.name.clone(), robot)));
    }
    for key in keys {
        let mut of: BTreeMap<usize, Vec<(String, f64)>> = BTreeMap::new();
        for position in &key.positions {
            if let Some(robot) = robots.get(&position.0) {
                of.entry(*robot).or_default().push(position.clone());
            }
        }
        for (robot, positions) in of {
            if let Some(draft) = drafts.get_mut(robot) {
                draft.states.push(DraftState { name: key.name.clone(), at: key.at, positions });
            }
        }
    }
}

/// Returns for each body whether it or a descendant moves.
fn moving(bodies: &[Body]) -> Vec<bool> {
    let mut moves = vec![false; bodies.len()];
    for (index, body) in bodies.iter().enumerate().rev() {
        let own = body.is_free || !body.joints.is_empty() || moves.get(index) == Some(&true);
        for moved in [index, body.parent] {
            if let Some(slot) = moves.get_mut(moved).filter(|_| own && moved > 0) {
                *slot = true;
            }
        }
    }
    moves
}

/// Returns a robot of these bodies, whose first one is the root.
fn robot(
    name: &str,
    top: usize,
    members: &[usize],
    bodies: &[Body],
    joints: &Joints,
    has_groups: bool,
) -> Draft {
    let mut draft = Draft { name: name.to_owned(), self_collision: true, ..Draft::default() };
    let (mut taken, mut names) = (Names::default(), Names::default());
    for body in members.iter().filter_map(|index| bodies.get(*index)) {
        taken.take(&body.name);
        for joint in &body.joints {
            names.take(&joint.name);
        }
    }
    let mut world = WORLD.to_owned();
    for index in members {
        let Some(body) = bodies.get(*index) else { continue };
        draft.frames.extend(body.sites.iter().cloned());
        if *index == top {
            draft.at = body.at;
            if top != 0 {
                draft.pose = body.parent_from_body;
                draft.fixed = !body.is_free;
            }
            // A joint to the world needs a link that is the world.
            if !body.joints.is_empty() {
                draft.pose = DPose3::IDENTITY;
                world = taken.unique(WORLD);
                draft.links.push(DraftLink::bare(world.clone(), body.at));
            } else {
                draft.links.push(link(body, has_groups));
                continue;
            }
        } else {
            draft.links.push(link(body, has_groups));
        }
        if *index == top {
            draft.links.push(link(body, has_groups));
        }
        let parent = match bodies.get(body.parent) {
            Some(_) if *index == top => world.clone(),
            Some(parent) => parent.name.clone(),
            None => continue,
        };
        hang(&mut draft, body, parent, joints, &mut taken, &mut names);
    }
    for tendon in joints.independent.iter().filter(|tendon| tendon.top == top) {
        hang_tendon(&mut draft, tendon, joints, &mut taken);
    }
    let touching = draft.links.iter().filter(|link| !link.collisions.is_empty()).count();
    draft.self_collision = touching > 1;
    draft.stays_awake = members.iter().filter_map(|index| bodies.get(*index)).any(|body| body.stays_awake);
    draft
}

fn link(body: &Body, has_groups: bool) -> DraftLink {
    let mut link = DraftLink::bare(body.name.clone(), body.at);
    link.inertial = Some(body.inertial);
    let mut bits = [0, 0];
    for geom in &body.geoms {
        if geom.is_visual {
            link.visuals.push(geom.shape.clone());
        }
        if geom.is_collision {
            if link.collisions.is_empty() {
                link.material = geom.material;
            }
            link.collisions.push(geom.shape.clone());
            bits = [bits[0] | geom.contype, bits[1] | geom.conaffinity];
        }
    }
    if has_groups && !link.collisions.is_empty() {
        link.groups = Some(bits);
    }
    link
}

/// Adds the body's joints in series, with massless links between them.
fn hang(draft: &mut Draft, body: &Body, parent: String, said: &Joints, taken: &mut Names, names: &mut Names) {
    let mut between = |draft: &mut Draft, joint: &BodyJoint| {
        let name = taken.unique(&format!("{}_{}", body.name, joint.name));
        draft
            .links
            .push(DraftLink { inertial: Some(Inertial::ZERO), ..DraftLink::bare(name.clone(), joint.at) });
        name
    };
    let top_parent = parent.clone();
    let mut parent = parent;
    // Frame of the next joint in the frame of the last link, without the anchors.
    let mut pose = body.parent_from_body;
    let mut anchor = DVec3::ZERO;
    let is_chain = body.joints.len() > 1 || body.joints.iter().any(|joint| joint.anchor != DVec3::ZERO);
    for (index, joint) in body.joints.iter().enumerate() {
        let is_last = index + 1 == body.joints.len();
        let child =
            if is_last && joint.anchor == DVec3::ZERO { body.name.clone() } else { between(draft, joint) };
        // At the reference position, the body has its pose from the file.
        let back = match joint.kind {
            Kind::Hinge => DPose3::from_rotation(glamx::DQuat::from_axis_angle(joint.axis, -joint.reference)),
            Kind::Slide => DPose3::from_translation(joint.axis * -joint.reference),
            Kind::Ball => DPose3::IDENTITY,
        };
        let back = if joint.reference == 0.0 { DPose3::IDENTITY } else { back };
        let parent_from_joint = pose * DPose3::from_translation(joint.anchor - anchor) * back;
        let ends = [std::mem::replace(&mut parent, child.clone()), child];
        let mut written = DraftJoint::fixed(joint.name.clone(), joint.at, ends, parent_from_joint);
        written.kind = match joint.kind {
            Kind::Hinge if joint.limits.lower.is_none() && joint.limits.upper.is_none() => "continuous",
            Kind::Hinge => "revolute",
            Kind::Slide => "prismatic",
            Kind::Ball => "spherical",
        };
        written.axis = joint.axis;
        written.limits = joint.limits;
        if let Some(effort) = said.efforts.get(&joint.name) {
            written.limits.effort = Some(written.limits.effort.map_or(*effort, |most| most.min(*effort)));
        }
        (written.damping, written.friction, written.armature) =
            (joint.damping, joint.friction, joint.armature);
        written.mimic = said.mimics.get(&joint.name).cloned();
        let is_ball = joint.kind == Kind::Ball;
        // The rest position of MuJoCo's ball joints is the body's pose in the file.
        written.spring = joint.spring.map(|[stiffness, rest]| [stiffness, if is_ball { 0.0 } else { rest }]);
        if written.mimic.is_none() {
            written.position = (joint.reference != 0.0 && !is_ball).then_some(joint.reference);
            // A joint without an actuator is passive.
            let drive = said.drives.get(&joint.name).cloned().unwrap_or_default();
            written.drive = Some(DraftDrive { gravity_compensation: body.compensates, ..drive });
        }
        draft.joints.push(written);
        (pose, anchor) = (DPose3::IDENTITY, joint.anchor);
    }
    if body.joints.is_empty() || anchor != DVec3::ZERO {
        let name = names.unique(&format!("{}_fixed", body.name));
        let pose = pose * DPose3::from_translation(-anchor);
        draft.joints.push(DraftJoint::fixed(name, body.at, [parent, body.name.clone()], pose));
    }
    // As in MuJoCo, a body and its parent do not collide, even with links between them.
    if is_chain {
        draft.excluded.push(([top_parent, body.name.clone()], body.at));
    }
}

/// Adds the joint of a tendon, at the root, with a link that has nothing.
fn hang_tendon(draft: &mut Draft, tendon: &Independent, said: &Joints, taken: &mut Names) {
    let Some(root) = draft.links.first().map(|link| link.name.clone()) else { return };
    let Independent { joint, terms, offset, .. } = tendon;
    let link = taken.unique(&joint.name);
    draft.links.push(DraftLink::bare(link.clone(), joint.at));
    let mut written = DraftJoint::fixed(joint.name.clone(), joint.at, [root, link], DPose3::IDENTITY);
    written.kind = "prismatic";
    (written.damping, written.friction, written.armature) = (joint.damping, joint.friction, joint.armature);
    written.limits = joint.limits;
    if let Some(effort) = said.efforts.get(&joint.name) {
        written.limits.effort = Some(written.limits.effort.map_or(*effort, |most| most.min(*effort)));
    }
    written.spring = joint.spring;
    written.tendon = Some((terms.clone(), *offset));
    written.drive = Some(said.drives.get(&joint.name).cloned().unwrap_or_default());
    draft.joints.push(written);
}

/// Gives pairs of bodies to their robots.
fn exclude(excluded: &[([String; 2], At)], drafts: &mut [Draft], root: Element, notes: &mut Notes) {
    if excluded.is_empty() {
        return;
    }
    // Names of bodies are unique, and links between joints have no names in the file.
    let mut robots: BTreeMap<String, usize> = BTreeMap::new();
    for (robot, draft) in drafts.iter().enumerate() {
        robots.extend(draft.links.iter().map(|link| (link.name.clone(), robot)));
    }
    for (pair, at) in excluded {
        let [one, other] = pair.each_ref().map(|name| robots.get(name).copied());
        let draft =
            one.filter(|_| one == other && pair[0] != pair[1]).and_then(|robot| drafts.get_mut(robot));
        match draft {
            Some(draft) => draft.excluded.push((pair.clone(), *at)),
            None => {
                let [one, other] = pair;
                let message = format!(
                    "{} and {} are not two bodies of one robot: they collide nevertheless",
                    quoted(one),
                    quoted(other)
                );
                notes.warn(root, Ignored, message);
            }
        }
    }
}
