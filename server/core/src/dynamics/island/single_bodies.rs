//! Sweeps over the contacts of single bodies: what a sweep needs of each contact, in few bytes and side by side.
//!
//! A heap has thousands of contacts, and each sweep goes through all of them: with J and M^-1 J' of both sides it waits for memory. Of a
//! body whose centre of mass is its origin, and whose axes are those of its moments of inertia, M^-1 J' is J times numbers of the
//! body; and the linear part of J is the same on both sides, but for its sign. That leaves 27 numbers of 72. The bits are those of
//! [`ContactRows::solve`], which is what all other islands have, but for the signs of zeros.

use glamx::{DMat3, DVec3};
use pulp::{Arch, Simd, WithSimd};

use super::Member;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::contact_law::ContactLaw;

/// Along the normal and the two tangents; the fourth is for the processor's vectors.
type Along = [f64; 4];

/// The body of a side that cannot move.
const NONE: u32 = u32::MAX;

/// The contacts of an island as sweeps go through them.
#[derive(Debug, Default)]
pub(super) struct SingleBodies {
    bodies: Vec<Body>,
    contacts: Vec<SweptContact>,
}

/// What makes M^-1 J' of J.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// 1/kg.
    inverse_mass: f64,
    /// 1/(kg m²), about its own axes.
    inverse_moment: DVec3,
}

/// Of one contact.
#[derive(Clone, Copy, Debug)]
struct SweptContact {
    /// The linear part of J by component: of the second body; of the first it is the negative.
    linear: [Along; 3],
    /// The angular part for each body, by component.
    angular: [[Along; 3]; 2],
    /// Indices of the bodies. Where one moves it is the second.
    bodies: [u32; 2],
    law: ContactLaw,
}

impl SingleBodies {
    /// Forgets what was taken, and has room for so much: sweeps may begin in a step in which nothing else is new.
    pub(super) fn begin(&mut self, members: &[Member], contacts: usize) {
        self.bodies.clear();
        self.contacts.clear();
        if members.iter().all(|member| member.len == 6) {
            self.bodies.reserve(members.len());
            self.contacts.reserve(contacts);
        }
    }

    /// How many contacts were taken.
    pub(super) fn len(&self) -> usize {
        self.contacts.len()
    }

    /// Takes the contacts of an island, if all of its members are single bodies of that kind. None where that is false.
    pub(super) fn take<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[Member],
        (rows, blocks): (&[ContactRows], &[f64]),
    ) -> bool {
        self.bodies.clear();
        self.contacts.clear();
        for (robot, member) in robots.iter_mut().zip(members) {
            let robot = robot.as_mut();
            let has_rows = !robot.constraints_mut().rows.is_empty();
            match body(robot).filter(|_| member.len == 6 && !has_rows) {
                Some(body) => self.bodies.push(body),
                None => return false,
            }
        }
        for rows in rows.iter().filter(|rows| rows.acts()) {
            match self.contact(rows, blocks) {
                Some(contact) => self.contacts.push(contact),
                None => {
                    self.contacts.clear();
                    return false;
                }
            }
        }
        true
    }

    /// A contact, if J and M^-1 J' are what its bodies make of them, to the bit.
    fn contact(&self, rows: &ContactRows, blocks: &[f64]) -> Option<SweptContact> {
        let mut contact = SweptContact {
            linear: [Along::default(); 3],
            angular: [[Along::default(); 3]; 2],
            bodies: [NONE; 2],
            law: rows.law(),
        };
        let count = rows.sides.iter().filter(|side| side.len > 0).count();
        for (index, side) in rows.sides[..count].iter().enumerate().rev() {
            let (jacobian, responses) = side.single(blocks)?;
            let Body { inverse_mass, inverse_moment } = self.bodies[side.member];
            let slot = 2 - count + index;
            contact.bodies[slot] = u32::try_from(side.member).ok()?;
            for i in 0..3 {
                for k in 0..3 {
                    let of = |velocity: usize| jacobian[6 * (velocity / 2) + 2 * k + velocity % 2];
                    let (linear, angular) = (of(i), of(i + 3));
                    if slot == 1 {
                        contact.linear[i][k] = linear;
                    }
                    let shared = if slot == 1 { contact.linear[i][k] } else { -contact.linear[i][k] };
                    let is_product = linear == shared
                        && responses[k][i] == linear * inverse_mass
                        && responses[k][i + 3] == angular * inverse_moment[i];
                    if !is_product {
                        return None;
                    }
                    contact.angular[slot][i][k] = angular;
                }
            }
        }
        Some(contact)
    }

    /// Once through all contacts, with the velocities of all bodies. The largest change of a velocity of a contact, m/s.
    pub(super) fn sweep(&mut self, velocities: &mut [f64]) -> f64 {
        let Self { bodies, contacts } = self;
        Arch::new().dispatch(Sweep { bodies, contacts, velocities: velocities.as_chunks_mut().0 })
    }

    /// Gives the rows that were taken the impulses that were found.
    pub(super) fn give_back(&self, rows: &mut [ContactRows]) {
        for (rows, contact) in rows.iter_mut().filter(|rows| rows.acts()).zip(&self.contacts) {
            rows.impulse = contact.law.impulse;
        }
    }
}

/// What makes M^-1 J' of J, of a body whose axes are those of its moments, with its centre of mass in their origin.
fn body(robot: &Articulation) -> Option<Body> {
    let single = robot.tree().single.as_ref()?;
    let inverse_moment = DVec3::new(
        single.inverse_moment.x_axis.x,
        single.inverse_moment.y_axis.y,
        single.inverse_moment.z_axis.z,
    );
    let is_plain =
        single.center == DVec3::ZERO && single.inverse_moment == DMat3::from_diagonal(inverse_moment);
    is_plain.then_some(Body { inverse_mass: single.inverse_mass, inverse_moment })
}

/// [`SingleBodies::sweep`], compiled for the vectors of the processor.
struct Sweep<'a> {
    bodies: &'a [Body],
    contacts: &'a mut [SweptContact],
    velocities: &'a mut [[f64; 6]],
}

impl WithSimd for Sweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { bodies, contacts, velocities } = self;
        let mut largest = 0.0f64;
        for contact in contacts {
            let change = contact.law.solve(contact.velocities(velocities));
            if change != [0.0; 3] {
                contact.apply_impulse(change, bodies, velocities);
                largest = largest.max(contact.law.largest_change(change));
            }
        }
        largest
    }
}

impl SweptContact {
    /// J qd: sums of even columns and of odd ones, as [`ContactRows::velocities`] has them.
    #[inline(always)]
    fn velocities(&self, velocities: &[[f64; 6]]) -> [f64; 3] {
        let Self { linear: [x, y, z], angular, bodies, .. } = self;
        let (mut even, mut odd) = (Along::default(), Along::default());
        for (side, [roll, pitch, yaw]) in angular.iter().enumerate() {
            let Some(own) = velocities.get(bodies[side] as usize) else { continue };
            let sign = if side == 0 { -1.0 } else { 1.0 };
            add(&mut even, x, sign * own[0]);
            add(&mut odd, y, sign * own[1]);
            add(&mut even, z, sign * own[2]);
            add(&mut odd, roll, own[3]);
            add(&mut even, pitch, own[4]);
            add(&mut odd, yaw, own[5]);
        }
        [even[0] + odd[0], even[1] + odd[1], even[2] + odd[2]]
    }

    /// qd += M^-1 J' impulse.
    #[inline(always)]
    fn apply_impulse(&self, impulse: [f64; 3], bodies: &[Body], velocities: &mut [[f64; 6]]) {
        for (side, angular) in self.angular.iter().enumerate() {
            let index = self.bodies[side] as usize;
            let (Some(own), Some(body)) = (velocities.get_mut(index), bodies.get(index)) else { continue };
            let inverse_mass = if side == 0 { -body.inverse_mass } else { body.inverse_mass };
            let moment = body.inverse_moment.to_array();
            for i in 0..3 {
                own[i] += sum(&self.linear[i], inverse_mass, impulse);
                own[i + 3] += sum(&angular[i], moment[i], impulse);
            }
        }
    }
}

/// Adds a column of J times its velocity.
#[inline(always)]
fn add(sums: &mut Along, column: &Along, velocity: f64) {
    for k in 0..4 {
        sums[k] += column[k] * velocity;
    }
}

/// What an impulse does to a velocity: M^-1 J' of it is its column of J times a factor.
#[inline(always)]
fn sum(column: &Along, factor: f64, impulse: [f64; 3]) -> f64 {
    column[0] * factor * impulse[0] + column[1] * factor * impulse[1] + column[2] * factor * impulse[2]
}
