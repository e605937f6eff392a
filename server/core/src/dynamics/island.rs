//! Robots that touch, solved together: the rows of their joints and of their contacts, by
//! projected Gauss-Seidel on all their rates.

use glamx::DVec3;

use super::articulation::{Articulation, MAX_ROUNDS};
use super::constraint::contact::{Contact, ContactRows, Side};

/// Sweeps at the most.
pub const MAX_SWEEPS: usize = 50;

/// Sweeping ends when no impulse changes its own rate by more than this, m/s or rad/s.
pub const SETTLED: f64 = 1e-6;

/// Sweeps of what pushes apart; what is left, the next step does.
const PUSH_SWEEPS: usize = 5;

/// The memory that solving needs, kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct Island {
    members: Vec<Member>,
    rows: Vec<ContactRows>,
    /// Of all sides of all contacts.
    blocks: Vec<f64>,
    /// Of all members, one after the other.
    rates: Vec<f64>,
    /// The rates before the step.
    before: Vec<f64>,
    /// A row and its response, before they are filed.
    scratch: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    robot: usize,
    first: usize,
    len: usize,
}

impl Island {
    /// Solves and moves on the robots at `members`, which have been
    /// [started](Articulation::start) and touch at those of `contacts` that `which` names.
    ///
    /// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005), chapter
    /// 5, with the tangents of a contact as a block. What pushes overlapping shapes apart moves
    /// positions alone, by rates of its own that are then forgotten, so that it gives nothing speed
    /// (Guendelman, Bridson and Fedkiw, "Nonconvex rigid bodies with stacking" (2003), have the
    /// two apart alike).
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[usize],
        (contacts, which): (&mut [Contact], &[usize]),
        gravity: DVec3,
        h: f64,
    ) {
        self.list(robots, members);
        self.make_rows(contacts, which);
        for round in 0..MAX_ROUNDS {
            self.gather(robots);
            self.measure(robots, contacts);
            if round == 0 {
                self.aim(robots, contacts, gravity, h);
            }
            self.start(robots);
            self.sweep(robots);
            let mut changed = false;
            for member in &self.members {
                let body = robots[member.robot].as_mut();
                body.new_rates_mut().copy_from_slice(&self.rates[member.first..member.first + member.len]);
                if body.saturate(h, round == 0) {
                    changed = true;
                }
            }
            if !changed || round + 1 == MAX_ROUNDS {
                break;
            }
            for member in &self.members {
                robots[member.robot].as_mut().predict(gravity, h);
            }
        }
        for rows in &self.rows {
            contacts[rows.contact].impulse = rows.world_impulse();
        }
        for member in &self.members {
            robots[member.robot].as_mut().keep_rows();
        }
        let apart = self.part();
        for &Member { robot, first, len } in &self.members {
            let body = robots[robot].as_mut();
            if apart {
                body.finish_apart(&self.rates[first..first + len], h);
            } else {
                body.finish(h);
            }
        }
    }

    /// Makes the rates those that positions follow: with what pushes apart. False where nothing
    /// does.
    fn part(&mut self) -> bool {
        if self.rows.iter().all(|rows| rows.apart == 0.0 || !rows.acts()) {
            return false;
        }
        let Self { rows, blocks, rates, before: moving, .. } = self;
        moving.clear();
        moving.resize(rates.len(), 0.0);
        for _ in 0..PUSH_SWEEPS {
            for rows in rows.iter_mut().filter(|rows| rows.acts()) {
                rows.part(blocks, moving);
            }
        }
        rates.iter_mut().zip(moving).for_each(|(rate, push)| *rate += *push);
        true
    }

    fn list<R: AsMut<Articulation>>(&mut self, robots: &mut [R], members: &[usize]) {
        self.members.clear();
        let mut first = 0;
        for &robot in members {
            let len = robots[robot].as_mut().rates().len();
            self.members.push(Member { robot, first, len });
            first += len;
        }
    }

    /// One for each contact, with its sides laid out.
    fn make_rows(&mut self, contacts: &[Contact], which: &[usize]) {
        self.rows.clear();
        let mut at = 0;
        for &place in which {
            let contact = &contacts[place];
            let mut sides = [Side::default(); 2];
            let mut count = 0;
            let own = contact.robots[0] == contact.robots[1];
            for (robot, body) in contact.robots.into_iter().zip(contact.touch.bodies) {
                // Two links of one robot are one side.
                if body.is_none() || (own && count == 1) {
                    continue;
                }
                let Ok(member) = self.members.binary_search_by_key(&robot, |member| member.robot) else {
                    continue;
                };
                let Member { first, len, .. } = self.members[member];
                sides[count] = Side { first, len, at };
                at += Side::size(len);
                count += 1;
            }
            let (t, u) = contact.touch.normal.any_orthonormal_pair();
            let axes = [contact.touch.normal, t, u];
            let kept = axes.map(|axis| contact.impulse.dot(axis));
            let impulse = if kept[0] > 0.0 { kept } else { [0.0; 3] };
            self.rows.push(ContactRows {
                contact: place,
                sides,
                axes,
                friction: contact.touch.surface.friction,
                impulse,
                ..ContactRows::default()
            });
        }
        if self.blocks.len() < at {
            self.blocks.resize(at, 0.0);
        }
        let longest = self.members.iter().map(|member| member.len).max().unwrap_or(0);
        if self.scratch.len() < 2 * longest {
            self.scratch.resize(2 * longest, 0.0);
        }
    }

    fn gather<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        self.rates.clear();
        for member in &self.members {
            self.rates.extend_from_slice(robots[member.robot].as_mut().new_rates_mut());
        }
    }

    /// J and M^-1 J' of all contacts.
    fn measure<R: AsMut<Articulation>>(&mut self, robots: &mut [R], contacts: &[Contact]) {
        for rows in &mut self.rows {
            let contact = &contacts[rows.contact];
            let mut used = 0;
            for (i, (robot, body)) in contact.robots.into_iter().zip(contact.touch.bodies).enumerate() {
                let Some(body) = body else { continue };
                let sign = if i == 0 { -1.0 } else { 1.0 };
                let again = i == 1 && used == 1 && contact.robots[0] == contact.robots[1];
                let side = rows.sides[if again { 0 } else { used }];
                used += 1;
                let (jacobian, response) = self.scratch.split_at_mut(side.len);
                let response = &mut response[..side.len];
                let block = &mut self.blocks[side.at..side.at + Side::size(side.len)];
                for (k, axis) in rows.axes.iter().enumerate() {
                    let push = (contact.touch.point, axis * sign);
                    robots[robot].as_mut().point_row(body, push, jacobian, response);
                    let (columns, responses) = block.split_at_mut(4 * side.len);
                    let kept = &mut responses[k * side.len..(k + 1) * side.len];
                    for i in 0..side.len {
                        if again {
                            columns[4 * i + k] += jacobian[i];
                            kept[i] += response[i];
                        } else {
                            columns[4 * i + k] = jacobian[i];
                            columns[4 * i + 3] = 0.0;
                            kept[i] = response[i];
                        }
                    }
                }
            }
            rows.measure(&self.blocks);
        }
    }

    /// Sets the targets of the normal rates.
    fn aim<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contacts: &[Contact],
        gravity: DVec3,
        h: f64,
    ) {
        self.before.clear();
        for member in &self.members {
            self.before.extend_from_slice(robots[member.robot].as_mut().rates());
        }
        for rows in &mut self.rows {
            let before = rows.rates(&self.blocks, &self.before)[0];
            let predicted = rows.rates(&self.blocks, &self.rates)[0];
            rows.aim(&contacts[rows.contact], before, predicted, gravity.length(), h);
        }
    }

    /// Gives the rates the impulses that are started from.
    fn start<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        for rows in &mut self.rows {
            if rows.acts() {
                let impulse = rows.impulse;
                rows.push(&self.blocks, impulse, &mut self.rates);
            }
        }
        for &Member { robot, first, len } in &self.members {
            robots[robot].as_mut().prepare_rows(&mut self.rates[first..first + len]);
        }
    }

    fn sweep<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        for _ in 0..MAX_SWEEPS {
            let mut largest = 0.0f64;
            for &Member { robot, first, len } in &self.members {
                let body = robots[robot].as_mut();
                largest = largest.max(body.sweep_rows(&mut self.rates[first..first + len]));
            }
            for rows in self.rows.iter_mut().filter(|rows| rows.acts()) {
                largest = largest.max(rows.solve(&self.blocks, &mut self.rates));
            }
            if largest <= SETTLED {
                break;
            }
        }
    }
}
