//! Robots that touch, solved together: the rows of their joints and of their contacts, by
//! projected Gauss-Seidel on all their velocities.

use glamx::DVec3;

use super::articulation::{Articulation, MAX_ROUNDS};
use super::constraint::contact::{Contact, ContactRows, Side};
use super::constraint::direct::{Direct, Outcome, System};
use super::spatial::Spatial;

/// Sweeps at the most.
pub const MAX_SWEEPS: usize = 50;

/// Sweeping ends when no impulse changes its own velocity by more than this, m/s or rad/s.
pub const SETTLED: f64 = 1e-6;

/// The same where the impulses are the least ones of the step before: then there is nothing to solve.
const UNCHANGED: f64 = 1e-13;

/// Sweeps of position correction; the rest is left to the next step.
const CORRECTION_SWEEPS: usize = 5;

/// Position correction changes no velocity by more than this, m/s or rad/s.
const MAX_SPLIT_VELOCITY: f64 = 3.0;

/// After so many sweeps a direct solution is tried, in so many rounds: at once, and when sweeps take long.
const DIRECT_AT: [(usize, usize); 2] = [(0, 8), (10, 12)];

/// The same where sweeps have settled.
const SETTLED_ROUNDS: usize = 4;

/// With so many points, the responses of a body are summed from those of the six wrenches.
const MANY: usize = 3;

/// The memory that solving needs, kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct Island {
    members: Vec<Member>,
    rows: Vec<ContactRows>,
    /// Of all sides of all contacts.
    blocks: Vec<f64>,
    /// Of all members, one after the other.
    velocities: Vec<f64>,
    /// The velocities before the step.
    before: Vec<f64>,
    /// The velocities without impulses.
    free: Vec<f64>,
    /// A row and its response, before they are filed.
    scratch: Vec<f64>,
    /// Bodies with many contacts, in order.
    bases: Vec<Basis>,
    /// Of each basis the responses to six wrenches.
    basis_responses: Vec<f64>,
    /// Robot and body of each side of each contact.
    touched: Vec<(usize, usize)>,
    direct: Direct,
    /// All impulses that it starts from are the least of the step before, and it is so with those that it ends with.
    was_least: bool,
}

/// Where the responses to a body's six wrenches are.
#[derive(Clone, Copy, Debug)]
struct Basis {
    robot: usize,
    body: usize,
    at: usize,
}

/// A robot of an island.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Its index in the world.
    pub robot: usize,
    /// Where its velocities begin among those of the island.
    pub first: usize,
    /// How many it has.
    pub len: usize,
}

impl Island {
    /// Solves and moves on the robots at `members`, which have been
    /// [started](Articulation::start) and touch at those of `contacts` that `which` names.
    ///
    /// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005), chapter
    /// 5, with the tangents of a contact as a block. Position correction uses
    /// split impulses: velocities of its own, which are dropped after integration and so add no energy
    /// (as in Guendelman, Bridson and Fedkiw, "Nonconvex rigid bodies with stacking" (2003)).
    ///
    /// False where `interrupt`, which is asked before each sweep, ended it: then the robots are in the midst
    /// of a step.
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        members: &[usize],
        (contacts, which): (&mut [Contact], &[usize]),
        gravity: DVec3,
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        self.list(robots, members);
        self.make_rows(contacts, which);
        for round in 0..MAX_ROUNDS {
            self.gather(robots);
            self.measure(robots, contacts);
            if round == 0 {
                self.aim(robots, contacts, gravity, h);
            } else {
                for rows in &mut self.rows {
                    rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
                }
            }
            self.direct.begin();
            self.start(robots);
            if !self.find_impulses(robots, interrupt) {
                return false;
            }
            let mut changed = false;
            for member in &self.members {
                let body = robots[member.robot].as_mut();
                body.new_velocities_mut()
                    .copy_from_slice(&self.velocities[member.first..member.first + member.len]);
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
            let contact = &mut contacts[rows.contact];
            (contact.impulse, contact.is_least) = (rows.world_impulse(), self.was_least);
            if rows.impulse != [0.0; 3] {
                contact.robots.iter().for_each(|&robot| robots[robot].as_mut().note_contact());
            }
        }
        for member in &self.members {
            robots[member.robot].as_mut().keep_rows();
        }
        let is_corrected = self.correct_positions();
        for &Member { robot, first, len } in &self.members {
            let body = robots[robot].as_mut();
            if is_corrected {
                body.finish_corrected(&self.velocities[first..first + len], gravity, h);
            } else {
                body.finish(gravity, h);
            }
        }
        true
    }

    /// Adds position correction to the velocities that positions are integrated with. False if there is none.
    fn correct_positions(&mut self) -> bool {
        if self.rows.iter().all(|rows| rows.correction_velocity == 0.0 || !rows.acts()) {
            return false;
        }
        let Self { rows, blocks, velocities, before: split_velocities, .. } = self;
        split_velocities.clear();
        split_velocities.resize(velocities.len(), 0.0);
        for _ in 0..CORRECTION_SWEEPS {
            for rows in rows.iter_mut().filter(|rows| rows.acts()) {
                rows.correct_position(blocks, split_velocities);
            }
        }
        // A correction near an axis would turn a joint the faster, the shorter its arm is.
        let largest = split_velocities.iter().fold(0.0f64, |largest, velocity| largest.max(velocity.abs()));
        let scale = if largest > MAX_SPLIT_VELOCITY { MAX_SPLIT_VELOCITY / largest } else { 1.0 };
        velocities.iter_mut().zip(split_velocities).for_each(|(velocity, split)| *velocity += scale * *split);
        true
    }

    fn list<R: AsMut<Articulation>>(&mut self, robots: &mut [R], members: &[usize]) {
        self.members.clear();
        let mut first = 0;
        for &robot in members {
            let len = robots[robot].as_mut().velocities().len();
            self.members.push(Member { robot, first, len });
            first += len;
        }
    }

    /// One for each contact, with its sides laid out.
    fn make_rows(&mut self, contacts: &[Contact], which: &[usize]) {
        self.rows.clear();
        self.was_least = which.iter().all(|&index| contacts[index].is_least);
        let mut at = 0;
        for &index in which {
            let contact = &contacts[index];
            let mut sides = [Side::default(); 2];
            let mut count = 0;
            let own = contact.robots[0] == contact.robots[1];
            for (robot, body) in contact.robots.into_iter().zip(contact.point.bodies) {
                // Two links of one robot are one side.
                if body.is_none() || (own && count == 1) {
                    continue;
                }
                let Ok(member) = self.members.binary_search_by_key(&robot, |member| member.robot) else {
                    continue;
                };
                let Member { first, len, .. } = self.members[member];
                sides[count] = Side { member, first, len, at };
                at += Side::size(len);
                count += 1;
            }
            let (t, u) = contact.point.normal.any_orthonormal_pair();
            let axes = [contact.point.normal, t, u];
            let kept = axes.map(|axis| contact.impulse.dot(axis));
            let impulse = if kept[0] > 0.0 { kept } else { [0.0; 3] };
            self.rows.push(ContactRows {
                contact: index,
                sides,
                axes,
                friction: contact.point.surface.friction,
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
        self.velocities.clear();
        for member in &self.members {
            self.velocities.extend_from_slice(robots[member.robot].as_mut().new_velocities_mut());
        }
    }

    /// J and M^-1 J' of all contacts.
    ///
    /// Both are linear in the wrench. J is a walk to the root. M^-1 J' is a trip through the whole robot: a body
    /// with many points has it found once for each of the six unit wrenches, and each response is a sum of those.
    fn measure<R: AsMut<Articulation>>(&mut self, robots: &mut [R], contacts: &[Contact]) {
        self.find_bases(robots, contacts);
        for rows in &mut self.rows {
            let contact = &contacts[rows.contact];
            let mut used = 0;
            for (i, (robot, body)) in contact.robots.into_iter().zip(contact.point.bodies).enumerate() {
                let Some(body) = body else { continue };
                let sign = if i == 0 { -1.0 } else { 1.0 };
                let again = i == 1 && used == 1 && contact.robots[0] == contact.robots[1];
                let side = rows.sides[if again { 0 } else { used }];
                used += 1;
                let n = side.len;
                if n == 6 && !again {
                    let block = &mut self.blocks[side.at..side.at + Side::size(n)];
                    let (columns, responses) = block.split_at_mut(4 * n);
                    let at = (contact.point.position, rows.axes.map(|axis| axis * sign));
                    if robots[robot].as_mut().single_body_rows(at, columns, responses) {
                        continue;
                    }
                }
                let (jacobian, response) = self.scratch.split_at_mut(n);
                let response = &mut response[..n];
                let block = &mut self.blocks[side.at..side.at + Side::size(n)];
                let (columns, responses) = block.split_at_mut(4 * n);
                if !again {
                    columns.fill(0.0);
                    responses.fill(0.0);
                }
                let basis =
                    self.bases.binary_search_by_key(&(robot, body), |basis| (basis.robot, basis.body));
                for (k, axis) in rows.axes.iter().enumerate() {
                    let articulation = robots[robot].as_mut();
                    let wrench = articulation.wrench(body, contact.point.position, axis * sign);
                    let kept = &mut responses[k * n..(k + 1) * n];
                    articulation.wrench_row(body, wrench, jacobian);
                    columns[k..].iter_mut().step_by(4).zip(&*jacobian).for_each(|(sum, j)| *sum += j);
                    match basis.ok().map(|basis| self.bases[basis].at) {
                        Some(at) => {
                            let (a, l) = (wrench.angular, wrench.linear);
                            add_sum([a.x, a.y, a.z, l.x, l.y, l.z], &self.basis_responses[at..], kept);
                        }
                        None => {
                            articulation.wrench_response(body, wrench, response);
                            kept.iter_mut().zip(&*response).for_each(|(sum, response)| *sum += response);
                        }
                    }
                }
            }
            rows.measure(&self.blocks);
        }
    }

    /// M^-1 J' of the six unit wrenches, for each body that has many contacts.
    fn find_bases<R: AsMut<Articulation>>(&mut self, robots: &mut [R], contacts: &[Contact]) {
        let Self { rows, bases, basis_responses, touched, .. } = self;
        touched.clear();
        for rows in rows {
            let contact = &contacts[rows.contact];
            for (robot, body) in contact.robots.into_iter().zip(contact.point.bodies) {
                let is_single = robots[robot].as_mut().tree().bodies.len() == 1;
                touched.extend(body.filter(|_| !is_single).map(|body| (robot, body)));
            }
        }
        touched.sort_unstable();
        bases.clear();
        let mut end = 0;
        for points in touched.chunk_by(|a, b| a == b).filter(|points| points.len() >= MANY) {
            let (robot, body) = points[0];
            let articulation = robots[robot].as_mut();
            let n = articulation.velocities().len();
            bases.push(Basis { robot, body, at: end });
            if basis_responses.len() < end + 6 * n {
                basis_responses.resize(end + 6 * n, 0.0);
            }
            let axes = [DVec3::X, DVec3::Y, DVec3::Z];
            let turns = axes.map(|axis| Spatial::new(axis, DVec3::ZERO));
            let forces = axes.map(|axis| Spatial::new(DVec3::ZERO, axis));
            for wrench in turns.into_iter().chain(forces) {
                articulation.wrench_response(body, wrench, &mut basis_responses[end..end + n]);
                end += n;
            }
        }
    }

    /// Sets the targets of the normal velocities.
    fn aim<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        contacts: &[Contact],
        gravity: DVec3,
        h: f64,
    ) {
        self.before.clear();
        for member in &self.members {
            self.before.extend_from_slice(robots[member.robot].as_mut().half_velocities());
        }
        for rows in &mut self.rows {
            let before = rows.velocities(&self.blocks, &self.before)[0];
            rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
            rows.aim(&contacts[rows.contact], before, gravity.length(), h);
        }
    }

    /// Gives the velocities the impulses that are started from.
    ///
    /// Those of the last step, p, unless they are worse than none. Sweeps lower the energy
    /// f(p) = p' (J v0 - target) + p' J M^-1 J' p / 2, in which the kinetic energy changes by f(p) + p' target, and targets
    /// are not positive but for rebounds: from f(p) <= 0 on, however few sweeps there are, contacts without
    /// friction add no energy. After a hit the impulses of the hit would; then they are scaled by the factor that f is least with.
    fn start<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        self.free.clear();
        self.free.extend_from_slice(&self.velocities);
        for rows in &mut self.rows {
            if rows.acts() {
                let impulse = rows.impulse;
                rows.apply_impulse(&self.blocks, impulse, &mut self.velocities);
            }
        }
        for &Member { robot, first, len } in &self.members {
            robots[robot].as_mut().prepare_rows(&mut self.velocities[first..first + len]);
        }
        let Self { members, rows, blocks, velocities, free, .. } = self;
        // -p' (J v0 - target), and p' J M^-1 J' p.
        let (mut linear, mut square) = (0.0, 0.0);
        for rows in rows.iter().filter(|rows| rows.acts() && rows.impulse[0] > 0.0) {
            let (before, after) = (rows.unloaded, rows.velocities(blocks, velocities));
            linear += rows.impulse[0] * rows.target;
            for ((before, after), impulse) in before.into_iter().zip(after).zip(rows.impulse) {
                linear -= impulse * before;
                square += impulse * (after - before);
            }
        }
        for &Member { robot, first, len } in &*members {
            let own = first..first + len;
            for row in &robots[robot].as_mut().constraints_mut().rows {
                let (before, after) =
                    (row.velocity(&free[own.clone()]), row.velocity(&velocities[own.clone()]));
                linear -= row.impulse * (before + row.bias);
                square += row.impulse * (after - before);
            }
        }
        if linear < 0.5 * square {
            let part = (linear / square).max(0.0);
            for rows in rows {
                rows.impulse = rows.impulse.map(|impulse| impulse * part);
            }
            for member in members {
                for row in &mut robots[member.robot].as_mut().constraints_mut().rows {
                    row.impulse *= part;
                }
            }
            velocities
                .iter_mut()
                .zip(free)
                .for_each(|(velocity, free)| *velocity = *free + part * (*velocity - *free));
        }
    }

    /// Finds the impulses: where the least ones of the last step still hold, those; else directly where that may be, at
    /// once or after some sweeps, which then know better what presses and slips; else by sweeps. False where it
    /// was interrupted.
    fn find_impulses<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        if self.was_least && self.sweep(robots) <= UNCHANGED {
            return true;
        }
        self.was_least = false;
        let is_direct = self.direct.plan(robots, &self.members, &self.rows);
        let mut settled = false;
        for sweep in 0..MAX_SWEEPS {
            let rounds = DIRECT_AT.iter().find(|(at, _)| *at == sweep).map(|(_, rounds)| *rounds);
            if let Some(rounds) = rounds.or(settled.then_some(SETTLED_ROUNDS)).filter(|_| is_direct) {
                let Self { members, rows, blocks, velocities, free, direct, .. } = self;
                let system = System { robots, members, rows, blocks, free, velocities };
                match direct.solve(system, rounds, interrupt) {
                    Outcome::Solved => {
                        self.was_least = true;
                        return true;
                    }
                    Outcome::Interrupted => return false,
                    Outcome::Unsolved => {}
                }
            }
            if settled {
                break;
            }
            if interrupt() {
                return false;
            }
            settled = self.sweep(robots) <= SETTLED;
            if settled && !is_direct {
                break;
            }
        }
        true
    }

    /// Once through all rows. The largest change of a row's own velocity.
    fn sweep<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) -> f64 {
        let mut largest = 0.0f64;
        for &Member { robot, first, len } in &self.members {
            let body = robots[robot].as_mut();
            largest = largest.max(body.sweep_rows(&mut self.velocities[first..first + len]));
        }
        let Self { rows, blocks, velocities, .. } = self;
        for rows in rows.iter_mut().filter(|rows| rows.acts()) {
            largest = largest.max(rows.solve(blocks, velocities));
        }
        largest
    }
}

/// Adds six responses, which lie one after the other, each times its factor.
fn add_sum(factors: [f64; 6], responses: &[f64], sums: &mut [f64]) {
    let n = sums.len();
    let [a, b, c, d, e, f] = factors;
    let [r, s, t, u, v, w] = [0, 1, 2, 3, 4, 5].map(|at| &responses[at * n..][..n]);
    for (i, sum) in sums.iter_mut().enumerate() {
        *sum += a * r[i] + b * s[i] + c * t[i] + d * u[i] + e * v[i] + f * w[i];
    }
}
