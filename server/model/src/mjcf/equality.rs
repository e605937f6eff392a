//! `<equality>`: joints that follow one another, and connected bodies, which become constraints.

use glamx::{DPose3, DQuat, DVec3};

use super::Reader;
use super::body::Body;
use super::coupling::Linear;
use super::joint::{Joints, Kind};
use super::{tendon, value};
use crate::report::Disposition::{Ignored, Repaired, Used};
use crate::translation::draft::{At, DraftConstraintKind};
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::urdf::findings::quoted;

/// A constraint between bodies, by their indices; for a gear, the bodies of the joints.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub(super) name: String,
    pub(super) at: At,
    pub(super) kind: DraftConstraintKind,
    pub(super) ends: [End; 2],
}

#[derive(Clone, Debug)]
pub(super) struct End {
    pub(super) body: usize,
    /// `body_from_frame`.
    pub(super) pose: DPose3,
    /// Present for a gear.
    pub(super) joint: Option<String>,
}

/// Maximum number of constraints in a file.
const MAX_EQUALITIES: usize = 1024;

pub(super) fn read<'a>(
    elements: &[Element<'a>],
    reader: &mut Reader<'a>,
    joints: &mut Joints,
    held: &mut Vec<Held>,
) -> Result<(), Stop> {
    for element in elements.iter().copied() {
        let equality = reader.scope.classes.of(element, None, ["equality", "equality"]);
        if equality.word("active") == Some("false") {
            reader.notes.info(element, Ignored, "it is not active; left out");
            continue;
        }
        if held.len() >= MAX_EQUALITIES {
            reader.notes.warn(
                element,
                Ignored,
                format!("there are more than {MAX_EQUALITIES} equalities: left out"),
            );
            break;
        }
        match element.tag() {
            "joint" => follow(element, reader, joints, held)?,
            "tendon" => couple_tendons(element, reader, joints, held)?,
            "weld" | "connect" => hold(element, reader, held)?,
            _ => {
                let message = "not read by simd: left out";
                reader.notes.warn(element, Ignored, message);
            }
        }
    }
    Ok(())
}

fn name_of(element: Element, held: &[Held]) -> String {
    let name = element.word("name").map(str::to_owned);
    name.unwrap_or_else(|| format!("{}_{}", element.tag(), held.len() + 1))
}

/// Reads a weld or a point connection of two bodies, or of a body and the world.
fn hold<'a>(element: Element<'a>, reader: &mut Reader<'a>, held: &mut Vec<Held>) -> Result<(), Stop> {
    let sites = [element.word("site1"), element.word("site2")];
    let kind = match element.tag() {
        "weld" => DraftConstraintKind::Weld,
        _ => DraftConstraintKind::PointToPoint,
    };
    if sites.iter().any(Option::is_some) && sites.iter().any(Option::is_none) {
        reader.notes.warn(element, Ignored, "it names only one site: site1 and site2 are not read");
    }
    let mut ends = if let [Some(one), Some(other)] = sites {
        let found = [one, other].map(|site| reader.sites.get(site).copied());
        let [Some(one), Some(other)] = found else {
            reader.notes.warn(element, Ignored, "it names a site that does not exist: left out");
            return Ok(());
        };
        [one, other].map(|(body, pose)| End { body, pose, joint: None })
    } else {
        let named = [element.word("body1"), element.word("body2")];
        let found = named.map(|name| match name {
            None | Some("world") => Some(0),
            Some(name) => reader.bodies.iter().position(|body| body.name == name),
        });
        let ([Some(one), Some(other)], [Some(_), _]) = (found, named) else {
            reader.notes.warn(element, Ignored, "it names a body that does not exist: left out");
            return Ok(());
        };
        let [from_one, from_other] = [one, other].map(|body| world_from_body(&reader.bodies, body));
        let equality = reader.scope.classes.of(element, None, ["equality", "equality"]);
        let anchor = equality.numbers("anchor", &mut reader.notes)?.map_or(DVec3::ZERO, DVec3::from_array);
        let point = DPose3::from_translation(anchor);
        let [first, second] = if kind == DraftConstraintKind::PointToPoint {
            [point, from_other.inverse() * from_one * point]
        } else {
            let relative = equality.numbers::<7>("relpose", &mut reader.notes)?;
            let relative = relative.and_then(|[x, y, z, w, i, j, k]| {
                let turn = DQuat::from_xyzw(i, j, k, w);
                (turn.length() > 1e-9).then(|| DPose3::from_parts(DVec3::new(x, y, z), turn.normalize()))
            });
            let one_from_other = relative.unwrap_or(from_one.inverse() * from_other);
            [one_from_other * point, point]
        };
        [(one, first), (other, second)].map(|(body, pose)| End { body, pose, joint: None })
    };
    if ends[0].body == ends[1].body {
        reader.notes.warn(element, Ignored, "its two ends are one body: left out");
        return Ok(());
    }
    if kind == DraftConstraintKind::PointToPoint {
        // The orientation of a point does not matter.
        ends.iter_mut().for_each(|end| end.pose.rotation = DQuat::IDENTITY);
    }
    let name = name_of(element, held);
    held.push(Held { name, at: (element.file, element.line()), kind, ends });
    Ok(())
}

/// Returns the first two coefficients of a polynomial. Warns if others are not 0.
fn linear<'a>(element: Element<'a>, reader: &mut Reader<'a>) -> Result<[f64; 2], Stop> {
    let equality = reader.scope.classes.of(element, None, ["equality", "equality"]);
    let polynomial = match equality.get("polycoef") {
        Some((at, text)) => value::list(at, "polycoef", text, 5)?,
        None => vec![0.0, 1.0],
    };
    let of = |index: usize| polynomial.get(index).copied().unwrap_or(0.0);
    if (2..5).any(|index| of(index) != 0.0) {
        let message = "joints follow one another by a factor in simd: the first two coefficients are taken";
        reader.notes.warn(element, Repaired, message);
    }
    Ok([of(0), of(1)])
}

/// q1 - ref1 = c0 + c1 (q2 - ref2) + ...
fn follow<'a>(
    element: Element<'a>,
    reader: &mut Reader<'a>,
    joints: &mut Joints,
    held: &mut Vec<Held>,
) -> Result<(), Stop> {
    let Some(follower) = element.word("joint1") else {
        reader.notes.warn(element, Ignored, "it names no joint: left out");
        return Ok(());
    };
    let [offset, factor] = linear(element, reader)?;
    let known = |name: &str| joints.known.get(name).copied().filter(|joint| joint.kind != Kind::Ball);
    let Some(first) = known(follower) else {
        reader.notes.warn(element, Ignored, "it names a joint that does not exist or is a ball: left out");
        return Ok(());
    };
    let Some(leader) = element.word("joint2") else {
        return keep(element, follower, offset, reader, held);
    };
    let Some(second) = known(leader) else {
        reader.notes.warn(element, Ignored, "it names a joint that does not exist or is a ball: left out");
        return Ok(());
    };
    if follower == leader {
        reader.notes.warn(element, Ignored, "a joint does not follow itself: left out");
        return Ok(());
    }
    let offset = first.reference + offset - factor * second.reference;
    couple(element, follower, Linear { joint: leader.to_owned(), factor, offset }, reader, joints, held);
    Ok(())
}

/// Couples two tendons, or keeps the length of one: L1 - L1(0) = c0 + c1 (L2 - L2(0)) + ...
///
/// This holds one joint in place, or lets one follow another, if the lengths are those of at most two joints that
/// follow none.
fn couple_tendons<'a>(
    element: Element<'a>,
    reader: &mut Reader<'a>,
    joints: &mut Joints,
    held: &mut Vec<Held>,
) -> Result<(), Stop> {
    let named = [element.word("tendon1"), element.word("tendon2")];
    let found = named.map(|name| name.and_then(|name| joints.tendons.get(name)).cloned());
    let [Some(first), second] = found else {
        reader.notes.warn(element, Ignored, "it names no fixed tendon: left out");
        return Ok(());
    };
    if second.is_none() && named[1].is_some() {
        reader.notes.warn(element, Ignored, "it names a tendon that is not there or not fixed: left out");
        return Ok(());
    }
    let [offset, factor] = linear(element, reader)?;
    let mut terms = first.terms;
    let mut constant = first.reference + offset;
    if let Some(second) = second {
        constant -= factor * second.reference;
        terms.extend(second.terms.into_iter().map(|(name, by)| (name, -factor * by)));
    }
    let sum = joints.couplings.sum(&terms);
    let constant = constant - sum.offset;
    let mut leaders = sum.factors.into_iter();
    match (leaders.next(), leaders.next(), leaders.next()) {
        (Some((joint, by)), None, None) => {
            let reference = joints.known.get(&joint).map_or(0.0, |known| known.reference);
            keep(element, &joint, constant / by - reference, reader, held)?;
        }
        (Some((leader, by)), Some((follower, of_follower)), None) => {
            let (factor, offset) = (-by / of_follower, constant / of_follower);
            couple(element, &follower, Linear { joint: leader, factor, offset }, reader, joints, held);
        }
        _ => {
            let message = format!(
                "its joints ({}) are not one or two that move by themselves: they are not coupled",
                tendon::names(&terms)
            );
            reader.notes.warn(element, Ignored, message);
        }
    }
    Ok(())
}

/// Lets a joint follow another one: as a mimic within a robot, otherwise by a gear.
fn couple<'a>(
    element: Element<'a>,
    follower: &str,
    of: Linear,
    reader: &mut Reader<'a>,
    joints: &mut Joints,
    held: &mut Vec<Held>,
) {
    let leader = of.joint.as_str();
    let [Some(one), Some(other)] = [leader, follower].map(|joint| body_of(&reader.bodies, joint)) else {
        return;
    };
    joints.couplings.add(follower, of.clone());
    let is_of_one = top_of(&reader.bodies, one) == top_of(&reader.bodies, other);
    if is_of_one && !joints.mimics.contains_key(follower) && !follows(joints, leader, follower) {
        joints.mimics.insert(follower.to_owned(), (leader.to_owned(), of.factor, of.offset));
        return;
    }
    let end = |body: usize, joint: &str| End { body, pose: DPose3::IDENTITY, joint: Some(joint.to_owned()) };
    let ends = [end(one, leader), end(other, follower)];
    let message = format!("a gear between {} and {}", quoted(leader), quoted(follower));
    reader.notes.info(element, Used, message);
    let (name, at) = (name_of(element, held), (element.file, element.line()));
    held.push(Held { name, at, kind: DraftConstraintKind::Gear(of.factor, of.offset), ends });
}

/// Reads a joint that stays where it is: its body is welded to the parent. One of several joints of a body is locked by
/// its limits.
fn keep<'a>(
    element: Element<'a>,
    joint: &str,
    offset: f64,
    reader: &mut Reader<'a>,
    held: &mut Vec<Held>,
) -> Result<(), Stop> {
    let index = body_of(&reader.bodies, joint);
    let found = index.and_then(|index| Some((index, reader.bodies.get(index)?)));
    let Some((index, Body { parent, parent_from_body, joints, .. })) = found else { return Ok(()) };
    let [only] = &joints[..] else {
        let own = reader.bodies.get_mut(index).map(|body| &mut body.joints);
        let own = own.into_iter().flatten().find(|own| own.name == joint && own.kind != Kind::Ball);
        if let Some(own) = own {
            let place = Some(own.reference + offset);
            (own.limits.lower, own.limits.upper) = (place, place);
            reader.notes.info(element, Used, format!("the joint {} is locked by its limits", quoted(joint)));
        }
        return Ok(());
    };
    let moved = match only.kind {
        Kind::Slide => DPose3::from_translation(only.axis * offset),
        Kind::Hinge | Kind::Ball => {
            let to_anchor = DPose3::from_translation(only.anchor);
            to_anchor
                * DPose3::from_rotation(DQuat::from_axis_angle(only.axis, offset))
                * DPose3::from_translation(-only.anchor)
        }
    };
    let ends = [(*parent, *parent_from_body * moved), (index, DPose3::IDENTITY)].map(|(body, pose)| End {
        body,
        pose,
        joint: None,
    });
    let (name, at) = (name_of(element, held), (element.file, element.line()));
    held.push(Held { name, at, kind: DraftConstraintKind::Weld, ends });
    Ok(())
}

/// Returns whether a joint follows another one, directly or through others.
fn follows(joints: &Joints, joint: &str, other: &str) -> bool {
    let mut at = joint;
    // No joint follows itself, so no chain is longer than the number of followers.
    for _ in 0..=joints.mimics.len() {
        if at == other {
            return true;
        }
        let Some((leader, _, _)) = joints.mimics.get(at) else { return false };
        at = leader;
    }
    true
}

pub(super) fn body_of(bodies: &[Body], joint: &str) -> Option<usize> {
    bodies.iter().position(|body| body.joints.iter().any(|own| own.name == joint))
}

/// Returns the child of the world that a body descends from.
pub(super) fn top_of(bodies: &[Body], body: usize) -> usize {
    let mut at = body;
    while let Some(up) = bodies.get(at).map(|body| body.parent).filter(|up| *up != 0) {
        at = up;
    }
    at
}

/// Returns the pose of a body in the file.
pub(super) fn world_from_body(bodies: &[Body], body: usize) -> DPose3 {
    let mut pose = DPose3::IDENTITY;
    let mut at = body;
    while let Some(body) = bodies.get(at).filter(|_| at != 0) {
        pose = body.parent_from_body * pose;
        at = body.parent;
    }
    pose
}
