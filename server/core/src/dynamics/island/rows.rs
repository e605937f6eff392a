//! Rows of contacts: their sides, J and M^-1 J', and their targets.

use glamx::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::{Basis, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::bullet::BulletContacts;
use crate::dynamics::constraint::contact::{Contact, ContactRows};
use crate::dynamics::constraint::side::Side;
use crate::dynamics::constraint::turning::TurningRows;
use crate::dynamics::constraint::{PlacedBody, Turning, single_body_rows};
use crate::dynamics::contact_point::Surface;
use crate::dynamics::member::Member;
use crate::dynamics::scratch::MultiRhs;
use crate::dynamics::tree::{Body, Tree};

/// Number of points from which a body's responses are summed from those of the six wrenches.
pub(in crate::dynamics) const MANY: usize = 3;

impl Island {
    /// Makes the rows of each contact, and lays out its sides. Returns the end of their numbers.
    pub(super) fn make_rows<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contacts: &[&mut Contact],
    ) -> usize {
        self.rows.clear();
        self.turning.clear();
        self.was_least = contacts.iter().all(|contact| contact.is_least);
        let mut at = 0;
        for (index, contact) in contacts.iter().enumerate() {
            let mut sides = [Side::default(); 2];
            let mut count = 0;
            let own = contact.robots[0] == contact.robots[1];
            for (robot, body) in contact.robots.into_iter().zip(contact.point.bodies) {
                // Two links of one robot are one side.
                if body.is_none() || (own && count == 1) {
                    continue;
                }
                let Some(member) = self.member(robot) else { continue };
                let Member { first, len, is_one_body, .. } = self.members[member];
                let side = Side { member, first, len, at, ..Side::default() };
                let bodies = if own { contact.point.bodies } else { [body, None] };
                sides[count] = if is_one_body {
                    side.with_all()
                } else {
                    find_spans(side, robots[member].as_mut().tree(), bodies)
                };
                at += sides[count].size();
                count += 1;
            }
            let (t, u) = contact.point.normal.any_orthonormal_pair();
            let axes = [contact.point.normal, t, u];
            let kept = axes.map(|axis| contact.impulse.dot(axis));
            let pressed = kept[0] > 0.0;
            let impulse = if pressed { kept } else { [0.0; 3] };
            let Surface { friction, rolling_friction, spinning_friction, .. } = contact.point.surface;
            let rows = ContactRows { contact: index, sides, axes, ..ContactRows::default() };
            if rolling_friction > 0.0 || spinning_friction > 0.0 {
                let kept = axes.map(|axis| contact.turning_impulse.dot(axis));
                let mut rows = ContactRows { impulse: if pressed { kept } else { [0.0; 3] }, ..rows };
                for side in &mut rows.sides[..count] {
                    side.at = at;
                    at += side.size();
                }
                let of = self.rows.len();
                let (spinning, rolling) = (spinning_friction, rolling_friction);
                self.turning.push(TurningRows { rows, of, spinning, rolling });
            }
            self.rows.push(ContactRows { friction, impulse, ..rows });
        }
        if self.blocks.len() < at {
            self.blocks.resize(at, 0.0);
        }
        let longest = self.members.iter().map(|member| member.len).max().unwrap_or(0);
        if self.scratch.len() < longest {
            self.scratch.resize(longest, 0.0);
        }
        at
    }

    /// Computes J and M^-1 J' of all contacts. Returns false if interrupted.
    pub(super) fn measure<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contacts: &[&mut Contact],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        self.find_bases(robots, contacts);
        let Self { rows, turning, placed, blocks, scratch, rhs, bases, basis_responses, .. } = self;
        let measure = Measure { placed, blocks, scratch, rhs, bases, basis_responses };
        Arch::new().dispatch(MeasureContacts { measure, robots, contacts, rows, turning, interrupt })
    }

    /// Computes M^-1 J' of the six unit wrenches, for each body with many contacts.
    pub(super) fn find_bases<R: AsMut<Articulation>>(&mut self, robots: &mut [R], contacts: &[&mut Contact]) {
        let Self { members, rows, bases, basis_responses, touched, .. } = self;
        touched.clear();
        bases.clear();
        if members.iter().all(|member| member.is_one_body) {
            return;
        }
        for rows in rows {
            for (member, body) in ends(rows, contacts[rows.contact]) {
                let Some(body) = body else { continue };
                touched.extend((!members[member].is_one_body).then_some((member, body)));
            }
        }
        touched.sort_unstable();
        let mut end = 0;
        for points in touched.chunk_by(|a, b| a == b).filter(|points| points.len() >= MANY) {
            let (member, body) = points[0];
            let articulation = robots[member].as_mut();
            let n = articulation.velocities().len();
            bases.push(Basis { member, body, at: end });
            if basis_responses.len() < end + 6 * n {
                basis_responses.resize(end + 6 * n, 0.0);
            }
            articulation.unit_wrench_responses(body, &mut basis_responses[end..end + 6 * n]);
            end += 6 * n;
        }
    }

    /// Sets the targets of the normal velocities.
    pub(super) fn set_targets<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contacts: &[&mut Contact],
        gravity: DVec3,
        h: f64,
    ) {
        self.before.clear();
        for robot in &mut *robots {
            let (robot, first) = (robot.as_mut(), self.before.len());
            self.before.extend_from_slice(robot.half_velocities());
            let swing = robot.swing_of_origin(h).to_array();
            self.before[first..].iter_mut().zip(swing).for_each(|(velocity, swing)| *velocity += swing);
        }
        let turn_of = |(placed, member): (&Option<PlacedBody>, &Member)| {
            placed
                .as_ref()
                .map_or_else(Turning::default, |placed| placed.turning(&self.before[member.velocities()]))
        };
        self.turns.clear();
        self.turns.extend(self.placed.iter().zip(&self.members).map(turn_of));
        self.bounces = false;
        for rows in &mut self.rows {
            let before = rows.velocities(&self.blocks, &self.before);
            rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
            let contact = &*contacts[rows.contact];
            self.bounces |= contact.point.surface.restitution > 0.0;
            let turning = match turning(robots, rows, contact, h) {
                Some(turning) => rows.axes.map(|axis| axis.dot(turning)),
                None => {
                    let [a, b] = [0, 1].map(|side| {
                        let (member, body) = ends(rows, contact)[side];
                        let Some(body) = body else { return DVec3::ZERO };
                        if self.placed[member].is_some() {
                            self.turns[member].arc(contact.point.position)
                        } else {
                            robots[member].as_mut().arc(body, contact.point.position)
                        }
                    });
                    let [_, t, u] = rows.axes.map(|axis| axis.dot(b - a) * (-0.5 * h));
                    [0.0, t, u]
                }
            };
            rows.set_targets(contact, before, turning, (gravity.length(), h));
        }
        self.set_unloaded();
    }

    /// Sets the targets of Bullet's law.
    pub(super) fn set_bullets_targets(&mut self, contacts: &[&mut Contact], law: BulletContacts, h: f64) {
        // Bullet lets all hits of a step happen at once.
        self.bounces = false;
        for rows in &mut self.rows {
            rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
            rows.set_bullets_targets(&*contacts[rows.contact], law, h);
        }
        self.set_unloaded();
    }

    /// Stores the velocities without impulses of the other rows.
    fn set_unloaded(&mut self) {
        let links = self.links.iter_mut().map(|link| &mut link.rows);
        for rows in self.turning.iter_mut().map(|turning| &mut turning.rows).chain(links) {
            rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
        }
    }
}

/// Returns the velocity of a body at its contact at the start of a step, world. With this velocity, the point
/// that is touched in the middle of the step is at rest.
///
/// If the point wanders on the body, J u = 0 holds with the J of that moment. u are the velocities in the
/// middle of the step. With the initial J, `J u = -h/2 J' u`, where `J' u = w x (p' - v)`. The body turns
/// with w about an origin that moves with v, and the point moves with p'. A target of 0 would stop a body
/// that rolls on an edge as it comes down in each step. Nothing would lift it again.
///
/// Only for single bodies on immovable ones; `None` for others, and if the point does not wander.
fn turning<R: AsMut<Articulation>>(
    robots: &mut [R],
    rows: &ContactRows,
    contact: &Contact,
    h: f64,
) -> Option<DVec3> {
    // One of the two moves.
    let sign = match contact.point.bodies {
        [None, Some(_)] => 1.0,
        [Some(_), None] => -1.0,
        _ => return None,
    };
    if contact.wanders == DVec3::ZERO {
        return None;
    }
    let robot = robots[rows.sides[0].member].as_mut();
    if robot.tree().bodies.len() != 1 {
        return None;
    }
    let (linear, angular) = robot.root_twist();
    Some(angular.cross(contact.wanders / h - linear) * (-0.5 * h * sign))
}

/// Returns members and bodies of a contact; no body if it cannot move.
#[inline(always)]
fn ends(rows: &ContactRows, contact: &Contact) -> [(usize, Option<usize>); 2] {
    let [a, b] = contact.point.bodies;
    let second = rows.sides[usize::from(a.is_some() && rows.sides[1].len > 0)];
    [(rows.sides[0].member, a), (second.member, b)]
}

/// Adds the spans of the velocities that move a body to a side. For a contact of two bodies of one robot,
/// they are the velocities that move either.
pub(in crate::dynamics) fn find_spans(mut side: Side, tree: &Tree, bodies: [Option<usize>; 2]) -> Side {
    if tree.bodies.len() == 1 {
        return side.with_all();
    }
    side.is_pair = bodies[0].is_some() && bodies[1].is_some();
    let mut left = bodies;
    // Children come after their parents.
    while let Some(next) = left.into_iter().max().flatten() {
        let Body { velocity, joint_type, parent, .. } = tree.bodies[next];
        side.add_span(velocity..velocity + joint_type.velocities());
        for body in left.iter_mut().filter(|body| **body == Some(next)) {
            *body = parent;
        }
    }
    side
}

/// [`Island::measure`], compiled for the vectors of the processor.
struct MeasureContacts<'a, 'b, R> {
    measure: Measure<'a>,
    robots: &'a mut [R],
    contacts: &'a [&'b mut Contact],
    rows: &'a mut [ContactRows],
    turning: &'a mut [TurningRows],
    interrupt: &'a dyn Fn() -> bool,
}

impl<R: AsMut<Articulation>> WithSimd for MeasureContacts<'_, '_, R> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { mut measure, robots, contacts, rows, turning, interrupt } = self;
        for rows in rows {
            if interrupt() {
                return false;
            }
            measure.rows(robots, contacts[rows.contact], rows, false);
        }
        for TurningRows { rows, .. } in turning {
            if interrupt() {
                return false;
            }
            measure.rows(robots, contacts[rows.contact], rows, true);
        }
        true
    }
}

/// Memory and output for measuring.
pub(super) struct Measure<'a> {
    pub(super) placed: &'a [Option<PlacedBody>],
    pub(super) blocks: &'a mut [f64],
    pub(super) scratch: &'a mut [f64],
    pub(super) rhs: &'a mut [MultiRhs<4>],
    pub(super) bases: &'a [Basis],
    pub(super) basis_responses: &'a [f64],
}

impl Measure<'_> {
    /// Computes J and M^-1 J' of a contact's forces, or of the torques against its turning.
    #[inline(always)]
    fn rows<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contact: &Contact,
        rows: &mut ContactRows,
        turns: bool,
    ) {
        self.wrenches(robots, ends(rows, contact), contact.point.position, rows, turns);
        rows.measure(self.blocks);
    }

    /// Computes J and M^-1 J' of forces at a point along the axes of rows, or of torques about them, between
    /// bodies of two members.
    ///
    /// Both are linear in the wrench. J is a walk to the root. M^-1 J' is a backward and a forward pass over
    /// the whole robot, for all three together. For a body with many points it is computed once for the six
    /// unit wrenches, and each response is a sum of those.
    #[inline(always)]
    pub(super) fn wrenches<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        ends: [(usize, Option<usize>); 2],
        point: DVec3,
        rows: &mut ContactRows,
        turns: bool,
    ) {
        let mut used = 0;
        for (i, (member, body)) in ends.into_iter().enumerate() {
            let Some(body) = body else { continue };
            let sign = if i == 0 { -1.0 } else { 1.0 };
            let again = i == 1 && used == 1 && ends[0].0 == ends[1].0;
            let side = rows.sides[if again { 0 } else { used }];
            used += 1;
            let n = side.len;
            let block = &mut self.blocks[side.at..side.at + side.size()];
            if let (Some(placed), true) = (&self.placed[member], side.moves_six() && !again && !turns) {
                let at = (point, rows.axes.map(|axis| axis * sign));
                if single_body_rows(placed, at, block) {
                    continue;
                }
            }
            let articulation = robots[member].as_mut();
            let (jacobian, responses) = block.split_at_mut(3 * side.columns());
            if !again {
                jacobian.fill(0.0);
                responses.fill(0.0);
            }
            let axes = rows.axes.map(|axis| axis * sign);
            let wrenches =
                if turns { articulation.torques(axes) } else { articulation.wrenches(body, point, axes) };
            articulation.add_wrench_rows(body, &wrenches, &side, jacobian);
            let basis = self.bases.binary_search_by_key(&(member, body), |basis| (basis.member, basis.body));
            let Ok(basis) = basis else {
                articulation.add_wrench_responses(body, &wrenches, self.rhs, responses);
                continue;
            };
            for (k, kept) in responses.chunks_exact_mut(n).enumerate() {
                let wrench = wrenches.get(k);
                let (a, l) = (wrench.angular, wrench.linear);
                let six = &self.basis_responses[self.bases[basis].at..];
                add_sum([a.x, a.y, a.z, l.x, l.y, l.z], six, kept);
            }
        }
    }
}

/// Adds six consecutive responses, each times its factor.
#[inline(always)]
fn add_sum(factors: [f64; 6], responses: &[f64], sums: &mut [f64]) {
    let n = sums.len();
    let [a, b, c, d, e, f] = factors;
    let [r, s, t, u, v, w] = [0, 1, 2, 3, 4, 5].map(|at| &responses[at * n..][..n]);
    for (i, sum) in sums.iter_mut().enumerate() {
        *sum += a * r[i] + b * s[i] + c * t[i] + d * u[i] + e * v[i] + f * w[i];
    }
}
