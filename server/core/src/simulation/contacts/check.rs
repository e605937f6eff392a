//! Validation of contacts, overlaps and pairs from elsewhere against the present robots.

use super::key;
use crate::collision::{ContactPoint, MAX_PAIR_POINTS, RobotLinkPair, Side};
use crate::dynamics::constraint::contact::Contact;
use crate::simulation::entity::Entity;
use crate::simulation::world_state::Pair;
use crate::valid::finite;

/// Checks contacts from elsewhere, and completes them with data of their robots. The error is a sentence.
pub(in crate::simulation) fn complete(robots: &[Entity], contacts: &mut [Contact]) -> Result<(), String> {
    let mut before: Option<(Pair, usize)> = None;
    for contact in contacts {
        let pair = key(contact);
        let sides = sides(robots, pair)?;
        if sides.iter().all(|side| side.body.is_none()) {
            return Err("a contact is between two immovable bodies".into());
        }
        let Contact {
            robots: _,
            index,
            point,
            impulse,
            turning_impulse,
            is_least: _,
            total,
            moved,
            wanders: _,
        } = contact;
        (point.links, point.bodies) = (sides.map(|side| side.link), sides.map(|side| side.body));
        let ContactPoint { colliders: _, links: _, bodies: _, on, position, normal, distance, surface } =
            point;
        let vectors = [on[0], on[1], *position, *normal, *impulse, *turning_impulse, *total, *moved];
        let values = vectors.into_iter().flat_map(|vector| vector.to_array()).chain([*distance]);
        finite("the contacts have numbers", values)?;
        if (normal.length_squared() - 1.0).abs() > 1e-6 {
            return Err("a contact's normal is not of unit length".into());
        }
        surface.check()?;
        *index = match before {
            Some((known, _)) if known > pair => {
                return Err("the contacts are not in the order of their robots and colliders".into());
            }
            Some((known, index)) if known == pair => index + 1,
            _ => 0,
        };
        if *index >= MAX_PAIR_POINTS {
            return Err(format!("there are more than {MAX_PAIR_POINTS} contacts between two colliders"));
        }
        before = Some((pair, *index));
    }
    Ok(())
}

/// Checks that ignored overlaps are ordered pairs of colliders of these robots.
pub(in crate::simulation) fn check_ignored_overlaps(
    robots: &[Entity],
    ignored_overlaps: &[Pair],
) -> Result<(), String> {
    if !ignored_overlaps.is_sorted_by(|a, b| a < b) {
        return Err("the initial overlaps that are ignored are not in order".into());
    }
    ignored_overlaps.iter().try_for_each(|pair| sides(robots, *pair).map(|_sides| ()))
}

/// Checks that enabled and disabled pairs are unique ordered links of these robots.
pub(in crate::simulation) fn check_pairs(robots: &[Entity], pairs: &[RobotLinkPair]) -> Result<(), String> {
    let key = |of: &RobotLinkPair| (of.robots, of.pair.links);
    if !pairs.is_sorted_by(|a, b| key(a) < key(b)) {
        return Err("the collision pairs are not in order".into());
    }
    let is_there =
        |robot: usize, link: usize| robots.get(robot).is_some_and(|robot| link < robot.model.links.len());
    let sound = |of: &RobotLinkPair| {
        let ([a, b], [i, j]) = key(of);
        a < b && is_there(a, i) && is_there(b, j)
    };
    match pairs.iter().find(|of| !sound(of)) {
        Some(of) => {
            Err(format!("there is no pair of links {:?} of the robots at {:?}", of.pair.links, of.robots))
        }
        None => Ok(()),
    }
}

/// Returns the link and body of the two sides of a pair.
fn sides(robots: &[Entity], (indices, colliders): Pair) -> Result<[Side; 2], String> {
    let side = |i: usize| {
        let robot = robots.get(indices[i]).filter(|robot| robot.is_active());
        robot.and_then(|robot| robot.colliders.side(colliders[i]))
    };
    let ordered = indices[0] < indices[1] || (indices[0] == indices[1] && colliders[0] < colliders[1]);
    match (side(0), side(1)) {
        (Some(a), Some(b)) if ordered => Ok([a, b]),
        _ => Err(format!("there is no pair of colliders {colliders:?} of the robots at {indices:?}")),
    }
}
