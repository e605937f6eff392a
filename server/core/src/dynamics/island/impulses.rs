//! Impulses of an island: their initial values, and the choice of the solver.

use super::{Island, SolverChoice};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact::Contact;
use crate::dynamics::constraint::{Constraints, PlacedBody};
use crate::dynamics::direct::{Outcome, System};
use crate::dynamics::member::Member;

/// Maximum number of sweeps.
pub(in crate::dynamics) const MAX_SWEEPS: usize = 50;

/// Largest change of a row's velocity by its own impulse at which sweeping ends, m/s or rad/s.
pub(in crate::dynamics) const SETTLED: f64 = 1e-6;

/// Like [`SETTLED`], if the initial impulses are the least ones of the previous step: then nothing is left to
/// solve.
pub(in crate::dynamics) const UNCHANGED: f64 = 1e-13;

/// Numbers of sweeps after which a direct solution is tried, each with its maximum of rounds: at once, and
/// when sweeps converge slowly.
pub(in crate::dynamics) const DIRECT_AT: [(usize, usize); 2] = [(0, 8), (10, 12)];

/// Maximum number of rounds of the direct solution after sweeps have converged.
pub(in crate::dynamics) const SETTLED_ROUNDS: usize = 4;

impl Island {
    /// Applies the initial impulses to the velocities.
    ///
    /// These are the last step's impulses p, unless they are worse than none. Sweeps lower the energy
    /// `f(p) = p' (J v0 - target) + p' J M^-1 J' p / 2`. The kinetic energy changes by f(p) + p' target, and
    /// targets are not positive except for rebounds. From f(p) <= 0 on, contacts without friction therefore
    /// add no energy, however few sweeps there are. After a hit, the impulses of the hit would add energy;
    /// they are then scaled by the factor that minimises f.
    pub(super) fn start<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        self.free.clear();
        self.free.extend_from_slice(&self.velocities);
        for rows in &mut self.rows {
            if rows.acts() {
                let impulse = rows.impulse;
                rows.apply_impulse(&self.blocks, impulse, &mut self.velocities);
            }
        }
        for turning in self.turning.iter().filter(|turning| turning.acts()) {
            turning.rows.apply_impulse(&self.blocks, turning.rows.impulse, &mut self.velocities);
        }
        for link in &mut self.links {
            if link.acts() {
                link.rows.apply_impulse(&self.blocks, link.rows.impulse, &mut self.velocities);
            } else {
                link.rows.impulse = [0.0; 3];
            }
        }
        for (robot, member) in jointed(robots, &self.members, &self.placed) {
            robot.prepare_rows(&mut self.velocities[member.velocities()]);
        }
        self.limit_energy(robots);
    }

    /// Scales all impulses p by the factor that minimises the f(p) of [`Island::start`], if f(p) is above 0.
    pub(super) fn limit_energy<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        let Self { members, placed, rows, turning, links, blocks, velocities, free, .. } = self;
        // -p' (J v0 - target), and p' J M^-1 J' p.
        let (mut linear, mut square) = (0.0, 0.0);
        let turns = turning.iter().filter(|turning| turning.acts()).map(|turning| &turning.rows);
        for rows in rows.iter().filter(|rows| rows.acts() && rows.impulse[0] > 0.0).chain(turns) {
            let (before, after) = (rows.unloaded, rows.velocities(blocks, velocities));
            linear += rows.impulse[0] * rows.target;
            square += rows.compliance * rows.impulse[0] * rows.impulse[0];
            for ((before, after), impulse) in before.into_iter().zip(after).zip(rows.impulse) {
                linear -= impulse * before;
                square += impulse * (after - before);
            }
        }
        for link in links.iter().filter(|link| link.acts()) {
            let (before, after) = (link.rows.unloaded, link.rows.velocities(blocks, velocities));
            for (k, impulse) in link.rows.impulse.into_iter().enumerate() {
                linear += impulse * (link.targets[k] - before[k]);
                square += impulse * (after[k] - before[k] + link.compliance * impulse);
            }
        }
        for (robot, member) in jointed(robots, members, placed) {
            let own = member.velocities();
            let Constraints { rows, sums, .. } = robot.constraints_mut();
            for row in &*rows {
                let before = row.velocity(sums, &free[own.clone()]);
                let after = row.velocity(sums, &velocities[own.clone()]);
                linear -= row.impulse * (before + row.bias);
                square += row.impulse * (after - before);
                if let Some(sum) = row.sum {
                    square += row.impulse * row.impulse * sums.compliance(sum);
                }
            }
        }
        if linear < 0.5 * square {
            let part = (linear / square).max(0.0);
            let turning = turning.iter_mut().map(|turning| &mut turning.rows);
            for rows in rows.iter_mut().chain(turning).chain(links.iter_mut().map(|link| &mut link.rows)) {
                rows.impulse = rows.impulse.map(|impulse| impulse * part);
            }
            for (robot, _) in jointed(robots, members, placed) {
                for row in &mut robot.constraints_mut().rows {
                    row.impulse *= part;
                }
            }
            velocities
                .iter_mut()
                .zip(free)
                .for_each(|(velocity, free)| *velocity = *free + part * (*velocity - *free));
        }
    }

    /// Finds the impulses. If the least ones of the last step still hold, it keeps them. Otherwise it uses
    /// the direct solver if allowed, at once or after some sweeps, which improve the guess of which rows
    /// press and slip. Otherwise it sweeps. Friction against rolling and spinning is solved by sweeps only.
    /// Returns false if interrupted.
    pub(super) fn find_impulses<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        if self.was_least && self.sweep(robots) <= UNCHANGED {
            return true;
        }
        self.was_least = false;
        let is_direct = self.choice != SolverChoice::Sweeps
            && self.turning.is_empty()
            && self.direct.plan(robots, &self.members, &self.rows, &self.links);
        if !is_direct && self.choice != SolverChoice::Sweeps && self.has_single_bodies_alone() {
            return self.sweep_with_momentum(robots, interrupt);
        }
        let mut settled = false;
        for sweep in 0..MAX_SWEEPS {
            let rounds = DIRECT_AT.iter().find(|(at, _)| *at == sweep).map(|(_, rounds)| *rounds);
            if let Some(rounds) = rounds.or(settled.then_some(SETTLED_ROUNDS)).filter(|_| is_direct) {
                let Self { members, rows, links, blocks, velocities, free, direct, .. } = self;
                let system = System { robots, members, rows, links, blocks, free, velocities };
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

    /// Returns whether all robots are single bodies that are held only by contacts without friction against
    /// turning.
    fn has_single_bodies_alone(&self) -> bool {
        self.turning.is_empty() && self.links.is_empty() && self.placed.iter().all(Option::is_some)
    }

    /// Postpones hits that were caused by other hits in this step to the next one. Returns whether there are
    /// any.
    pub(super) fn postpone_hits(&mut self, contacts: &[&mut Contact], gravity: f64, h: f64) -> bool {
        if !self.bounces {
            return false;
        }
        let Self { rows, blocks, velocities, .. } = self;
        let mut any = false;
        for rows in rows.iter_mut().filter(|rows| rows.acts()) {
            any |= rows.postpone_hit(contacts[rows.contact], (gravity, h), blocks, velocities);
        }
        self.was_least &= !any;
        any
    }

    /// Sweeps once through all rows. Returns the largest change of a row's own velocity.
    pub(super) fn sweep<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) -> f64 {
        let mut largest = 0.0f64;
        for (robot, member) in jointed(robots, &self.members, &self.placed) {
            largest = largest.max(robot.sweep_rows(&mut self.velocities[member.velocities()]));
        }
        let Self { rows, turning, links, blocks, velocities, .. } = self;
        for rows in rows.iter_mut().filter(|rows| rows.acts()) {
            largest = largest.max(rows.solve(blocks, velocities));
        }
        for turning in turning.iter_mut().filter(|turning| turning.acts()) {
            let normal = rows[turning.of].impulse[0];
            largest = largest.max(turning.solve(normal, blocks, velocities));
        }
        for link in links.iter_mut().filter(|link| link.acts()) {
            largest = largest.max(link.solve(blocks, velocities));
        }
        largest
    }
}

/// Returns the robots that may have rows of joints. A free body has none, and checking would fetch each body
/// of a heap from distant memory.
fn jointed<'a, R: AsMut<Articulation>>(
    robots: &'a mut [R],
    members: &'a [Member],
    placed: &'a [Option<PlacedBody>],
) -> impl Iterator<Item = (&'a mut Articulation, &'a Member)> {
    let all = robots.iter_mut().zip(members).zip(placed);
    all.filter(|(_, placed)| placed.is_none()).map(|((robot, member), _)| (robot.as_mut(), member))
}
