//! Newton's method on the soft problem: each round determines the active rows again.

use super::{Direct, State, System};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact_law::{SLIP_TOLERANCE, TOLERANCE};
use crate::dynamics::constraint::contact_law::{first_guess, given, is_in_cone, judge, soft};
use crate::dynamics::constraint::link_rows::LinkState;

/// Slope at which a line search ends, as a part of the initial slope.
pub(in crate::dynamics) const FLAT: f64 = 1e-3;

/// Maximum number of halvings of a line search.
pub(in crate::dynamics) const HALVINGS: usize = 30;

/// Progress of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// Rows have changed.
    Goes,
    /// Velocities and impulses solve the soft problem.
    Settled,
}

impl Direct {
    /// Starts with the present velocities and impulses.
    pub(super) fn begin_rounds<R: AsMut<Articulation>>(&mut self, system: &System<'_, R>) {
        if self.hardness.is_empty() {
            self.measure(system);
        }
        self.momentum.clear();
        self.momentum.resize(system.velocities.len(), 0.0);
        self.bounds.clear();
        self.states.clear();
        self.anderson.begin(true);
        self.slipped.clear();
        self.slipped.resize(system.rows.len(), false);
        for rows in &*system.rows {
            let (mut bound, mut state) = (0.0, State::Open);
            if rows.acts() {
                rows.add_momentum(system.blocks, rows.impulse, &mut self.momentum);
                let normal = rows.velocities(system.blocks, system.velocities)[0];
                let resistance = rows.effect[0] + rows.compliance;
                let (presses, sticks);
                (bound, presses, sticks) =
                    first_guess((rows.target, rows.friction), resistance, rows.impulse, normal);
                state = State::of(presses, sticks);
            }
            self.bounds.push(bound);
            self.states.push(state);
        }
        for link in system.links.iter().filter(|link| link.acts()) {
            link.rows.add_momentum(system.blocks, link.rows.impulse, &mut self.momentum);
        }
        for joint in &mut self.joints {
            for &(velocity, factor) in joint.joints(&self.terms) {
                self.momentum[velocity] += factor * joint.impulse;
            }
            let velocity = || joint.velocity(&self.terms, system.velocities);
            joint.is_active = joint.least < joint.impulse && joint.impulse < joint.most
                || joint.impulse == 0.0 && joint.least == 0.0 && velocity() < 0.0;
        }
    }

    /// Makes a Newton step, as far as it lowers the function. The first one is a whole step for the
    /// previously active rows. Returns `None` if there is no step.
    pub(super) fn advance<R: AsMut<Articulation>>(
        &mut self,
        system: &mut System<'_, R>,
        is_first: bool,
    ) -> Option<Progress> {
        self.force.clear();
        self.force.extend(self.momentum.iter().map(|momentum| -momentum));
        self.speeds.clear();
        self.weights.clear();
        self.used.clear();
        for (i, rows) in system.rows.iter().enumerate() {
            let (mut speeds, mut impulse, mut weights) = ([0.0; 3], [0.0; 3], [0.0; 4]);
            if rows.acts() {
                speeds = rows.slip(system.blocks, system.velocities);
                (impulse, weights) = if is_first {
                    let state = (self.states[i] != State::Open, self.states[i] == State::Sticks);
                    given(rows.target, self.hardness[i], state, rows.impulse, speeds)
                } else {
                    soft(rows.target, self.hardness[i], self.bounds[i], speeds)
                };
                rows.add_momentum(system.blocks, impulse, &mut self.force);
            }
            self.speeds.push(speeds);
            self.weights.push(weights);
            self.used.push(impulse);
        }
        for link in &mut *system.links {
            (link.speeds, link.used, link.weights) = ([0.0; 3], [0.0; 3], [0.0; 6]);
            if link.acts() {
                link.speeds = link.rows.velocities(system.blocks, system.velocities);
                if is_first {
                    (link.used, link.weights) = link.given(link.speeds);
                } else {
                    (link.used, link.weights, link.state) = link.soft(link.speeds);
                }
                link.rows.add_momentum(system.blocks, link.used, &mut self.force);
            }
        }
        for joint in &mut self.joints {
            joint.speed = joint.velocity(&self.terms, system.velocities);
            let mut impulse = joint.soft(joint.speed);
            if is_first {
                impulse = if joint.is_active { -joint.speed * joint.hardness } else { joint.impulse };
            } else {
                joint.is_active = joint.least < impulse && impulse < joint.most;
            }
            for &(velocity, factor) in joint.joints(&self.terms) {
                self.force[velocity] += factor * impulse;
            }
        }
        self.assemble(system);
        if !self.matrix.factorise() {
            return None;
        }
        self.change.clear();
        self.change.extend_from_slice(&self.force);
        self.matrix.solve(&mut self.change);
        if !self.change.iter().all(|change| change.is_finite()) {
            return None;
        }
        let slope: f64 = self.change.iter().zip(&self.force).map(|(change, force)| -change * force).sum();
        self.find_ways(system);
        let length = if is_first { 1.0 } else { self.find_length(system, slope) };
        for (velocity, change) in system.velocities.iter_mut().zip(&self.change) {
            *velocity += length * change;
        }
        for (momentum, force) in self.momentum.iter_mut().zip(&self.force) {
            *momentum += length * force;
        }
        let changed = self.project(system) || length < 1.0;
        Some(if changed { Progress::Goes } else { Progress::Settled })
    }

    /// Computes the changes of the rows' velocities by the solution. Changes `force` to the change of
    /// `momentum`: M change, which is the right side without the rows' share.
    fn find_ways<R>(&mut self, system: &mut System<'_, R>) {
        self.ways.clear();
        for (rows, weights) in system.rows.iter().zip(&self.weights) {
            let [n, t, u] = rows.velocities(system.blocks, &self.change);
            let [normal, tt, tu, uu] = *weights;
            let taken = [-normal * n, -tt * t - tu * u, -tu * t - uu * u];
            if *weights != [0.0; 4] {
                rows.add_momentum(system.blocks, taken, &mut self.force);
            }
            self.ways.push([n, t, u]);
        }
        for link in &mut *system.links {
            link.ways = link.rows.velocities(system.blocks, &self.change);
            let taken = link.weighted(link.ways).map(|taken| -taken);
            if link.weights != [0.0; 6] {
                link.rows.add_momentum(system.blocks, taken, &mut self.force);
            }
        }
        for joint in &mut self.joints {
            joint.way = joint.joints(&self.terms).iter().map(|&(at, factor)| factor * self.change[at]).sum();
            if joint.is_active {
                for &(velocity, factor) in joint.joints(&self.terms) {
                    self.force[velocity] -= factor * joint.hardness * joint.way;
                }
            }
        }
    }

    /// Returns the step length up to which the function falls, at most 1. `slope` is the initial slope.
    fn find_length<R>(&self, system: &System<'_, R>, slope: f64) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (constant, square) = (dot(&self.change, &self.momentum), dot(&self.change, &self.force));
        let slope_at = |length: f64| {
            let mut sum = constant + length * square;
            for (i, rows) in system.rows.iter().enumerate() {
                if rows.acts() {
                    let ([a, b, c], way) = (self.speeds[i], self.ways[i]);
                    let at = [a + length * way[0], b + length * way[1], c + length * way[2]];
                    let (impulse, _) = soft(rows.target, self.hardness[i], self.bounds[i], at);
                    sum -= way[0] * impulse[0] + way[1] * impulse[1] + way[2] * impulse[2];
                }
            }
            for link in system.links.iter().filter(|link| link.acts()) {
                let at = [0, 1, 2].map(|k| link.speeds[k] + length * link.ways[k]);
                let (impulse, ..) = link.soft(at);
                sum -= (0..3).map(|k| link.ways[k] * impulse[k]).sum::<f64>();
            }
            for joint in &self.joints {
                sum -= joint.way * joint.soft(joint.speed + length * joint.way);
            }
            sum
        };
        let flat = FLAT * slope.abs();
        if slope >= 0.0 || slope_at(1.0) <= flat {
            return 1.0;
        }
        let (mut below, mut above) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (below + above);
            let slope = slope_at(middle);
            if slope.abs() <= flat {
                return middle;
            }
            if slope < 0.0 { below = middle } else { above = middle }
        }
        below
    }

    /// Computes impulses from the soft rows' velocities, and the friction bounds from these impulses. Returns
    /// whether any row changed.
    fn project<R>(&mut self, system: &mut System<'_, R>) -> bool {
        let (mut changed, mut is_same, mut slips) = (false, true, false);
        self.bound_residuals.clear();
        self.bound_residuals.resize(system.rows.len(), 0.0);
        for (i, rows) in system.rows.iter_mut().enumerate() {
            if !rows.acts() {
                continue;
            }
            let before = self.bounds[i];
            let speeds = rows.slip(system.blocks, system.velocities);
            let began_with = (self.used[i], self.weights[i]);
            let law = (rows.target, rows.friction);
            let judged = judge(law, self.hardness[i], before, speeds, began_with);
            changed |= judged.changed;
            (rows.impulse, self.states[i]) = (judged.impulse, State::of(judged.presses, judged.sticks));
            is_same &= judged.slips == self.slipped[i];
            self.slipped[i] = judged.slips;
            if judged.slips {
                self.bound_residuals[i] = judged.bound - before;
                slips = true;
            } else {
                self.bounds[i] = judged.bound;
            }
        }
        if !is_same {
            self.anderson.begin(true);
        }
        if slips {
            let slipped = self.slipped.iter().zip(&self.bounds);
            self.slip_bounds.clear();
            self.slip_bounds.extend(slipped.map(|(slips, bound)| if *slips { *bound } else { 0.0 }));
            self.anderson.advance(true, &mut self.slip_bounds, &self.bound_residuals);
            for (i, bound) in self.bounds.iter_mut().enumerate().filter(|(i, _)| self.slipped[*i]) {
                *bound = self.slip_bounds[i].max(0.0);
            }
        }
        for link in system.links.iter_mut().filter(|link| link.acts()) {
            let (impulse, weights, state) = link.soft(link.rows.velocities(system.blocks, system.velocities));
            let moved = (0..3).map(|k| (impulse[k] - link.used[k]).powi(2)).sum::<f64>().sqrt();
            // The derivative is not constant there, so the step was not exact.
            let turned = state == LinkState::Saturated && moved > SLIP_TOLERANCE * link.most;
            changed |= turned || (state == LinkState::Holds && link.weights != weights);
            changed |= state == LinkState::Open && link.weights != [0.0; 6];
            (link.rows.impulse, link.state) = (impulse, state);
        }
        for joint in &mut self.joints {
            let impulse = joint.soft(joint.velocity(&self.terms, system.velocities));
            let is_active = joint.least < impulse && impulse < joint.most;
            changed |= is_active != joint.is_active;
            (joint.impulse, joint.is_active) = (impulse, is_active);
        }
        changed
    }

    /// Returns whether the impulses are within their bounds, and inactive rows on their side.
    pub(super) fn holds<R>(&self, system: &System<'_, R>) -> bool {
        let contacts = system.rows.iter().zip(&self.states).all(|(rows, state)| match state {
            State::Open => {
                !rows.acts()
                    || rows.velocities(system.blocks, system.velocities)[0] >= rows.target - TOLERANCE
            }
            State::Slips | State::Sticks => is_in_cone(rows.impulse, rows.friction),
        });
        let links = system.links.iter().filter(|link| link.acts()).all(|link| {
            let [n, t, u] = link.rows.impulse;
            match link.state {
                LinkState::Open => {
                    link.rows.velocities(system.blocks, system.velocities)[0] >= link.targets[0] - TOLERANCE
                }
                LinkState::Holds | LinkState::Saturated => {
                    let size = (n * n + t * t + u * u).sqrt();
                    size <= link.most * (1.0 + 1e-6) && !(link.is_one_sided && n < -TOLERANCE * size)
                }
            }
        });
        contacts
            && links
            && self.joints.iter().all(|joint| {
                let slack = TOLERANCE * joint.impulse.abs();
                joint.least - slack <= joint.impulse && joint.impulse <= joint.most + slack
            })
    }
}
