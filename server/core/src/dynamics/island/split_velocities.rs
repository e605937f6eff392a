//! Position correction by constraints between links, without velocities.
//!
//! Velocities satisfy the rows, which are homogeneous except for the deflection by R and for the curvature of
//! the motion. They can always do so, even for contradictory constraints, and do no work. Positions may still
//! have errors: after a step that was too long for the motion, after a teleport, or because constraints
//! contradict each other.
//!
//! Velocities that move positions in this step and are then dropped correct these errors. They are split
//! impulses, as contacts have them (Guendelman, Bridson and Fedkiw, "Nonconvex rigid bodies with stacking"
//! (2003)). Gauss and Newton's method computes them for the least sum of the squared errors, each over its
//! mean J M^-1 J'. It is damped as by Levenberg and Marquardt, with contacts and limits as inequalities. A
//! step goes only as far as this sum falls, so contradictory constraints settle.

use glamx::DVec3;

use super::impulses::SETTLED;
use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::link_rows::{LinkRows, LinkState, MAX_CORRECTION};
use crate::dynamics::constraint::{Constraints, ERROR_REDUCTION, Row, RowKey};
use crate::dynamics::direct::{Outcome, System};

/// R as a part of the mean J M^-1 J'; each is used if the previous one made no progress.
const DAMPINGS: [f64; 3] = [1e-5, 1e-2, 1.0];

/// Maximum number of Gauss-Newton steps.
const STEPS: usize = 5;

/// Number of step lengths that are tried, each half of the previous one.
const HALVINGS: usize = 5;

/// Relative decrease of the sum below which it counts as minimal.
const FALLS: f64 = 0.1;

/// Relative decrease of the sum below which it is rounding.
const ROUNDING: f64 = 1e-9;

/// Displacement below which a step makes no progress, m and rad: contradictory constraints have settled.
const NO_WAY: f64 = 1e-11;

/// Largest displacement in a step that counts as linear, rad and m.
const MAX_LINEAR_DISPLACEMENT: f64 = 0.1;

/// Rounds of the direct solver, and sweeps if it finds no solution.
const ROUNDS: usize = 12;
const SWEEPS: usize = 20;

/// Memory of the correction, reused from step to step.
#[derive(Debug, Default)]
pub(super) struct Split {
    /// Velocities to be added to those that move positions.
    pub(super) velocities: Vec<f64>,
    /// Velocities that move positions without the correction.
    drift: Vec<f64>,
    /// Gauss-Newton step.
    step: Vec<f64>,
    /// Remaining part of the step if it went too far.
    length: f64,
    /// Velocities that are tried.
    trial: Vec<f64>,
    /// Rows as the step of the world left them.
    rows: Vec<ContactRows>,
    links: Vec<LinkRows>,
    joints: Vec<Row>,
}

impl Island {
    /// Computes the velocities to be added to those that move positions in a step of `h`. Returns whether
    /// there are any; `None` if interrupted.
    pub(super) fn update_split_velocities<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<bool> {
        if self.links.is_empty() {
            return Some(false);
        }
        // If a step takes half of its kick, its velocities are not yet known.
        let is_known = !robots.iter_mut().any(|robot| robot.as_mut().may_halve_its_kick());
        let Self { velocities, split, .. } = self;
        split.drift.clear();
        split.drift.extend(velocities.iter().map(|velocity| if is_known { *velocity } else { 0.0 }));
        split.velocities.clear();
        split.velocities.resize(velocities.len(), 0.0);
        std::mem::swap(velocities, &mut split.drift);
        let is_whole = self.find_errors_after(robots, constraints, h, interrupt);
        std::mem::swap(&mut self.velocities, &mut self.split.drift);
        if !is_whole {
            return None;
        }
        self.links.iter_mut().for_each(|link| link.within = link.near());
        if !self.links.iter().any(is_off) {
            return Some(false);
        }
        self.set_rows_aside(robots);
        let is_found = self.find_split_velocities(robots, constraints, h, interrupt);
        self.put_rows_back(robots, h);
        self.direct.begin();
        is_found
    }

    /// Saves the rows, and removes what does not apply to positions: friction, and limits of forces.
    fn set_rows_aside<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        let Self { rows, links, split, .. } = self;
        split.rows.clone_from(rows);
        split.links.clone_from(links);
        split.joints.clear();
        for robot in robots.iter_mut() {
            split.joints.extend_from_slice(&robot.as_mut().constraints_mut().rows);
        }
        rows.iter_mut().for_each(|rows| rows.friction = 0.0);
        for link in links.iter_mut() {
            if link.is_brake || !has_split(link) && (link.state == LinkState::Saturated || link.most == 0.0) {
                // It yields as far as the others move.
                link.compliance = 0.0;
            }
            link.most = f64::INFINITY;
        }
    }

    /// Restores the rows, and stores how far split velocities leave links from their targets.
    fn put_rows_back<R: AsMut<Articulation>>(&mut self, robots: &mut [R], h: f64) {
        let Self { rows, links, blocks, split, .. } = self;
        for (kept, link) in split.links.iter_mut().zip(&*links).filter(|(kept, _)| has_split(kept)) {
            let most = MAX_CORRECTION[usize::from(kept.turns)];
            let aim = (DVec3::from_array(kept.errors) * (-ERROR_REDUCTION / h)).clamp_length_max(most);
            let found = DVec3::from_array(link.rows.velocities(blocks, &split.velocities));
            let found = found.clamp_length_max(aim.length());
            kept.split_residual = (!kept.is_slack()).then_some((aim - found).to_array());
        }
        std::mem::swap(rows, &mut split.rows);
        std::mem::swap(links, &mut split.links);
        let mut kept = split.joints.iter();
        for robot in robots {
            for (row, kept) in robot.as_mut().constraints_mut().rows.iter_mut().zip(&mut kept) {
                row.clone_from(kept);
            }
        }
    }

    fn find_split_velocities<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<bool> {
        let mut sum = self.error_sum();
        let (mut level, mut is_any) = (0, false);
        let is_direct = self.direct.plan(robots, &self.members, &self.rows, &self.links);
        for _ in 0..STEPS {
            self.links.iter_mut().for_each(|link| link.errors_kept = link.errors_after);
            let mut fallen = None;
            while level < DAMPINGS.len() {
                self.links.iter_mut().for_each(|link| link.errors_after = link.errors_kept);
                if !self.find_step(robots, (level, h), is_direct, interrupt) {
                    return None;
                }
                if self.split.step.iter().all(|step| step.abs() * h < NO_WAY) {
                    return Some(is_any);
                }
                fallen = self.go_where_it_is_least(robots, constraints, (h, sum), interrupt)?;
                if fallen.is_some() {
                    break;
                }
                level += 1;
            }
            let Some((length, next)) = fallen else { break };
            is_any = true;
            let has_fallen = next < (1.0 - FALLS) * sum;
            sum = next;
            if !self.links.iter().any(is_off) || !has_fallen || length < 1.0 {
                break;
            }
        }
        Some(is_any)
    }

    /// Makes one Gauss-Newton step. Returns false if interrupted.
    fn find_step<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        (level, h): (usize, f64),
        is_direct: bool,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        self.aim_at_positions(robots, (level, h));
        let Self { members, rows, links, blocks, split, direct, .. } = self;
        let Split { step, trial: zero, .. } = split;
        for list in [&mut *step, &mut *zero] {
            list.clear();
            list.resize(split.velocities.len(), 0.0);
        }
        direct.begin();
        let mut is_solved = false;
        if is_direct {
            let system =
                System { robots: &mut *robots, members, rows, links, blocks, free: zero, velocities: step };
            match direct.solve(system, ROUNDS, interrupt) {
                Outcome::Solved => is_solved = true,
                Outcome::Interrupted => return false,
                Outcome::Unsolved => {}
            }
        }
        if !is_solved {
            for _ in 0..SWEEPS {
                if interrupt() {
                    return false;
                }
                let mut largest = 0.0f64;
                for (robot, member) in robots.iter_mut().zip(&*members) {
                    largest = largest.max(robot.as_mut().sweep_rows(&mut step[member.velocities()]));
                }
                for rows in rows.iter_mut().filter(|rows| rows.acts()) {
                    largest = largest.max(rows.solve(blocks, step));
                }
                for link in links.iter_mut().filter(|link| link.acts()) {
                    largest = largest.max(link.solve(blocks, step));
                }
                if largest <= SETTLED {
                    break;
                }
            }
        }
        self.shorten_step(robots, h);
        true
    }

    /// Sets the targets of rows in a Gauss-Newton step: constraints hold, and contacts and limits are not
    /// violated.
    fn aim_at_positions<R: AsMut<Articulation>>(&mut self, robots: &mut [R], (level, h): (usize, f64)) {
        let Self { members, rows, links, blocks, split, .. } = self;
        for (rows, kept) in rows.iter_mut().zip(&split.rows) {
            rows.impulse = [0.0; 3];
            let [goes, ..] = kept.velocities(blocks, &split.drift);
            let [is_split, ..] = kept.velocities(blocks, &split.velocities);
            let least = if kept.correction_velocity > 0.0 {
                kept.correction_velocity
            } else {
                (kept.target - goes).min(0.0)
            };
            rows.target = least - is_split;
        }
        for link in links.iter_mut() {
            link.rows.impulse = [0.0; 3];
            link.state = if link.is_one_sided { LinkState::Open } else { LinkState::Holds };
            let is_slack = link.is_one_sided && link.errors_after[0] > 0.0;
            let errors = if is_off(link) || is_slack { link.errors_after } else { [0.0; 3] };
            link.aimed = errors.map(|error| -error / h);
            link.set_drift_targets([0.0; 3]);
            if link.compliance > 0.0 {
                link.soften(DAMPINGS[level]);
            }
        }
        let mut kept = split.joints.iter();
        for (robot, member) in robots.iter_mut().zip(&*members) {
            let own = member.velocities();
            let (goes, is_split) = (&split.drift[own.clone()], &split.velocities[own]);
            let Constraints { rows, sums, .. } = robot.as_mut().constraints_mut();
            for (row, kept) in rows.iter_mut().zip(&mut kept) {
                row.impulse = 0.0;
                match row.key {
                    RowKey::Friction(_) | RowKey::Tendon(..) => row.effect = 0.0,
                    RowKey::Mimic(_) => row.bias = 0.0,
                    RowKey::Lower(_) | RowKey::Upper(_) => {
                        let bias = (kept.velocity(sums, goes) + kept.bias).max(0.0);
                        row.bias = bias + kept.velocity(sums, is_split);
                    }
                }
            }
        }
    }

    /// Shortens a step to the linear range, to the maximum correction of constraints, and to the limits,
    /// which have rows in the world's next step.
    fn shorten_step<R: AsMut<Articulation>>(&mut self, robots: &mut [R], h: f64) {
        let Self { members, links, blocks, split, .. } = self;
        let Split { velocities, drift, step, trial: goes, .. } = split;
        let mut part = 1.0f64;
        let largest = step.iter().fold(0.0f64, |largest, step| largest.max(step.abs()));
        if !step.iter().all(|step| step.is_finite()) {
            step.fill(0.0);
        } else if largest * h > MAX_LINEAR_DISPLACEMENT {
            part = MAX_LINEAR_DISPLACEMENT / (largest * h);
        }
        for link in links.iter() {
            let speed = DVec3::from_array(link.rows.velocities(blocks, step)).length();
            let most = MAX_CORRECTION[usize::from(link.turns)];
            if speed * part > most {
                part = most / speed;
            }
        }
        step.iter_mut().for_each(|step| *step *= part);
        goes.iter_mut()
            .zip(&*drift)
            .zip(&*velocities)
            .for_each(|((goes, drift), split)| *goes = drift + split);
        let mut within = 1.0f64;
        for (robot, member) in robots.iter_mut().zip(&*members) {
            let own = member.velocities();
            within = within.min(robot.as_mut().part_within_limits(&goes[own.clone()], &step[own], h));
        }
        step.iter_mut().for_each(|step| *step *= within);
        split.length = part * within;
    }

    /// Adds the step with the length at which the sum of errors falls most. A whole step could oscillate
    /// about the minimum in successive steps of the world. Returns the length and the sum there, if it falls
    /// anywhere; `None` if interrupted.
    fn go_where_it_is_least<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        (h, before): (f64, f64),
        interrupt: &dyn Fn() -> bool,
    ) -> Option<Option<(f64, f64)>> {
        let (mut length, mut best) = (1.0, None);
        for _ in 0..HALVINGS {
            let sum = self.sum_after(robots, constraints, (h, length), interrupt)?;
            match best {
                Some((_, least)) if sum >= least => break,
                _ if sum < before * (1.0 - ROUNDING) => best = Some((length, sum)),
                _ => {}
            }
            length *= 0.5;
        }
        let Some((length, sum)) = best else { return Some(None) };
        // The next step begins with the errors at that point.
        self.sum_after(robots, constraints, (h, length), interrupt)?;
        let Split { velocities, step, .. } = &mut self.split;
        velocities.iter_mut().zip(&*step).for_each(|(split, step)| *split += length * step);
        Some(Some((length * self.split.length, sum)))
    }

    /// Returns the sum of errors after a part of the step; `None` if interrupted.
    fn sum_after<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        (h, length): (f64, f64),
        interrupt: &dyn Fn() -> bool,
    ) -> Option<f64> {
        let Split { velocities, drift, step, trial, .. } = &mut self.split;
        trial.clear();
        trial.extend((0..drift.len()).map(|i| drift[i] + velocities[i] + length * step[i]));
        std::mem::swap(&mut self.velocities, trial);
        let is_whole = self.find_errors_after(robots, constraints, h, interrupt);
        std::mem::swap(&mut self.velocities, &mut self.split.trial);
        is_whole.then(|| self.error_sum())
    }

    /// Returns half of the sum of the squared errors, each over its mean J M^-1 J'.
    fn error_sum(&self) -> f64 {
        let of = |link: &LinkRows| 0.5 * link.error_after().powi(2) / link.mean_effect();
        self.links.iter().filter(|link| has_split(link)).map(of).sum()
    }
}

/// Returns whether split velocities correct its errors: no client drags at it, and it is not saturated.
fn has_split(link: &LinkRows) -> bool {
    !link.is_brake && !link.is_pulled && link.acts() && link.state != LinkState::Saturated && link.most > 0.0
}

/// Returns whether its error is larger than is left to velocities.
fn is_off(link: &LinkRows) -> bool {
    has_split(link) && link.error_after() > link.within
}
