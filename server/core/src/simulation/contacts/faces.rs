//! Load sharing between the points of one face.
//!
//! The motion of rigid bodies does not determine how four points of a face share a load. Rounding of depths,
//! and sweeps, may leave all of it on one corner, and friction at one point resists no turning about it. A
//! gripper would not keep its object from turning. An elastic surface has the distribution that is linear
//! over the face. It has the least sum of squares of all with the same force and moment.

use glamx::{DVec2, DVec3};

use crate::dynamics::constraint::contact::Contact;

/// Difference of normals below which points belong to one face: 1 minus a cosine.
const SAME_NORMAL: f64 = 1e-9;

/// Part of its bound below which friction holds a point.
const HELD: f64 = 0.999;

/// Relative squared spread across a line below which points lie on it.
const LINE: f64 = 1e-9;

/// Difference of distances below which points of a face are level, metres.
const LEVEL: f64 = 1e-6;

/// Makes the points of each face of two colliders' contacts share their load. Impulses are spread for
/// contacts that the step solves.
pub(super) fn share_loads(contacts: &mut [Contact], are_solved: bool) {
    if contacts.len() < 2 {
        return;
    }
    let is_same = |a: &Contact, b: &Contact| a.point.normal.dot(b.point.normal) > 1.0 - SAME_NORMAL;
    for face in contacts.chunk_by_mut(is_same) {
        level(face);
        if are_solved {
            spread(face);
        }
    }
}

/// Sets points at nearly equal distances to their mean distance. Otherwise the one that is nearer by rounding
/// carries all.
fn level(face: &mut [Contact]) {
    let [first, others @ ..] = &*face else { return };
    let (mut least, mut most, mut sum) = (first.point.distance, first.point.distance, first.point.distance);
    for contact in others {
        let distance = contact.point.distance;
        (least, most, sum) = (least.min(distance), most.max(distance), sum + distance);
    }
    if !others.is_empty() && most - least < LEVEL {
        let mean = sum / face.len() as f64;
        face.iter_mut().for_each(|contact| contact.point.distance = mean);
    }
}

/// Spreads the impulses of one face if friction holds all of its points, and no point would pull.
///
/// Force and moment are conserved. With r from the centre of the points, the normal impulses become F/n + r'
/// C^-1 M. C is the sum of r r', and M the sum of r times the impulse. The tangent impulses become T/n + a n
/// x r, where a conserves the moment about the normal.
fn spread(face: &mut [Contact]) {
    if face.len() < 3 || face.iter().any(|contact| contact.is_least) {
        return;
    }
    let (n, normal) = (face.len() as f64, face[0].point.normal);
    let (t, u) = normal.any_orthonormal_pair();
    let middle = face.iter().map(|contact| contact.point.position).sum::<DVec3>() / n;
    let place = |contact: &Contact| {
        let arm = contact.point.position - middle;
        DVec2::new(arm.dot(t), arm.dot(u))
    };
    let (mut force, mut moment, mut turn, mut shear) = (0.0, DVec2::ZERO, 0.0, DVec2::ZERO);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for contact in &*face {
        let (r, impulse) = (place(contact), contact.impulse);
        let (pressure, side) = (impulse.dot(normal), DVec2::new(impulse.dot(t), impulse.dot(u)));
        let bound = HELD * contact.point.surface.friction * pressure;
        if side.length_squared() > bound * bound {
            return;
        }
        force += pressure;
        moment += r * pressure;
        shear += side;
        turn += r.perp_dot(side);
        (xx, xy, yy) = (xx + r.x * r.x, xy + r.x * r.y, yy + r.y * r.y);
    }
    let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
    if force <= 0.0 || trace <= 0.0 {
        return;
    }
    // On a line the pseudo-inverse: C is l e e', with its trace l.
    let slope = if determinant > LINE * trace * trace {
        DVec2::new(yy * moment.x - xy * moment.y, xx * moment.y - xy * moment.x) / determinant
    } else {
        moment / trace
    };
    let share = |contact: &Contact| {
        let r = place(contact);
        let side = shear / n + r.perp() * (turn / trace);
        (force / n + slope.dot(r), side)
    };
    let holds = |contact: &Contact| {
        let (pressure, side) = share(contact);
        pressure >= 0.0 && side.length() <= HELD * contact.point.surface.friction * pressure
    };
    if face.iter().all(holds) {
        for contact in face {
            let (pressure, side) = share(contact);
            contact.impulse = normal * pressure + t * side.x + u * side.y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::contact_point::{ContactPoint, Surface};

    fn contact(x: f64, y: f64, impulse: DVec3) -> Contact {
        let point = ContactPoint {
            colliders: [0; 2],
            links: [0; 2],
            bodies: [None, Some(0)],
            on: [DVec3::ZERO; 2],
            position: DVec3::new(x, y, 0.0),
            normal: DVec3::Z,
            distance: 0.0,
            surface: Surface { friction: 0.5, ..Surface::default() },
        };
        Contact { impulse, ..Contact::new([0, 1], point) }
    }

    fn wrench(contacts: &[Contact]) -> [DVec3; 2] {
        let force = contacts.iter().map(|contact| contact.impulse).sum();
        let moment = contacts.iter().map(|contact| contact.point.position.cross(contact.impulse)).sum();
        [force, moment]
    }

    #[test]
    fn a_load_on_two_corners_is_spread_over_four_with_the_same_force_and_moment() {
        for round in 0..100 {
            // Numbers from -0.5 to 0.5 with a long period.
            let mut count = 7.0 * f64::from(round);
            let mut number = || {
                count += 1.0;
                (count * 0.618_033_988_75).fract() - 0.5
            };
            let mut face: Vec<Contact> = [(1.0, 1.0), (-1.0, 1.1), (-1.2, -1.0), (1.0, -0.8)]
                .map(|(x, y)| {
                    let impulse = DVec3::new(0.1 * number(), 0.1 * number(), 1.0 + number());
                    contact(x, y, impulse)
                })
                .to_vec();
            let before = wrench(&face);
            spread(&mut face);
            let after = wrench(&face);
            for (before, after) in before.into_iter().zip(after) {
                assert!(before.distance(after) < 1e-12, "{before} {after}");
            }
            let once: Vec<DVec3> = face.iter().map(|contact| contact.impulse).collect();
            spread(&mut face);
            assert!(face.iter().zip(once).all(|(again, once)| again.impulse.distance(once) < 1e-12));
        }
        let mut face = [(1.0, 1.0, 2.0), (-1.0, 1.0, 0.0), (-1.0, -1.0, 2.0), (1.0, -1.0, 0.0)]
            .map(|(x, y, load)| contact(x, y, DVec3::Z * load));
        spread(&mut face);
        assert!(face.iter().all(|contact| contact.impulse == DVec3::Z), "{face:?}");
    }

    #[test]
    fn points_that_are_level_but_for_rounding_have_one_distance() {
        let distances = |given: [f64; 3]| {
            let mut face = given.map(|distance| {
                let mut contact = contact(0.0, 0.0, DVec3::ZERO);
                contact.point.distance = distance;
                contact
            });
            share_loads(&mut face, false);
            face.map(|contact| contact.point.distance)
        };
        assert_eq!(distances([-1.0e-5, -1.2e-5, -1.05e-5]), [-1.0e-5, -1.2e-5, -1.05e-5]);
        let level = distances([-1.0e-5, -1.02e-5, -1.01e-5]);
        assert!(level.iter().all(|distance| (distance + 1.01e-5).abs() < 1e-18), "{level:?}");
    }

    #[test]
    fn a_line_is_spread_along_it_and_what_slips_or_would_pull_is_left() {
        let line = |loads: [f64; 3]| {
            [(-1.0, loads[0]), (0.0, loads[1]), (1.0, loads[2])]
                .map(|(x, load)| contact(x, 2.0 * x, DVec3::Z * load))
        };
        let loads = |face: &[Contact]| -> Vec<f64> { face.iter().map(|contact| contact.impulse.z).collect() };
        let mut even = line([1.5, 0.0, 1.5]);
        spread(&mut even);
        assert!(loads(&even).iter().all(|load| (load - 1.0).abs() < 1e-12), "{even:?}");
        // A load that is entirely at an end must stay there.
        let mut end = line([3.0, 0.0, 0.0]);
        spread(&mut end);
        assert_eq!(loads(&end), [3.0, 0.0, 0.0]);
        let mut slips = line([1.5, 0.0, 1.5]);
        slips[0].impulse.x = 0.75;
        spread(&mut slips);
        assert_eq!(loads(&slips), [1.5, 0.0, 1.5]);
    }
}
