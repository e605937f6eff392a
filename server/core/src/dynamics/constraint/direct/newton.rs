//! Newton's method on the soft problem: which rows are equations, judged in each round anew.

use super::{Direct, SLIP_TOLERANCE, State, System, TOLERANCE};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::link_rows::LinkState;

/// A step is short enough where what is left of the slope is at most this part of that at its begin.
pub(in crate::dynamics) const FLAT: f64 = 1e-3;

/// Halvings at the most in which a step's length is found.
pub(in crate::dynamics) const HALVINGS: usize = 30;

/// Whether rows have changed in a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// They have.
    Goes,
    /// Velocities and impulses are those of the soft problem.
    Settled,
}

/// The impulses of a contact's soft rows at these velocities, with this bound of friction, and the weights of their derivative: of the
/// normal, and tt, tu, uu of the tangents.
fn soft(
    rows: &ContactRows,
    [normal_hardness, hardness]: [f64; 2],
    bound: f64,
    [n, t, u]: [f64; 3],
) -> ([f64; 3], [f64; 4]) {
    let normal = (rows.target - n) * normal_hardness;
    let (normal, weight) = if normal > 0.0 { (normal, normal_hardness) } else { (0.0, 0.0) };
    let speed = length(t, u);
    if bound <= 0.0 {
        ([normal, 0.0, 0.0], [weight, 0.0, 0.0, 0.0])
    } else if speed * hardness <= bound {
        ([normal, -t * hardness, -u * hardness], [weight, hardness, 0.0, hardness])
    } else {
        let (part, t, u) = (bound / speed, t / speed, u / speed);
        ([normal, -t * bound, -u * bound], [weight, part * u * u, -part * t * u, part * t * t])
    }
}

/// Without the care of `hypot` for squares that are too small or too large for a number, which takes longer than all else here.
fn length(t: f64, u: f64) -> f64 {
    (t * t + u * u).sqrt()
}

/// The same where it is known which rows are equations, and what slips has the friction that it had.
fn given(
    rows: &ContactRows,
    [normal_hardness, hardness]: [f64; 2],
    state: State,
    [n, t, u]: [f64; 3],
) -> ([f64; 3], [f64; 4]) {
    let normal = (rows.target - n) * normal_hardness;
    match state {
        State::Open => ([0.0; 3], [0.0; 4]),
        State::Slips => ([normal, rows.impulse[1], rows.impulse[2]], [normal_hardness, 0.0, 0.0, 0.0]),
        State::Sticks => ([normal, -t * hardness, -u * hardness], [normal_hardness, hardness, 0.0, hardness]),
    }
}

impl Direct {
    /// Takes velocities and impulses as they are.
    pub(super) fn begin_rounds<R: AsMut<Articulation>>(&mut self, system: &System<'_, R>) {
        if self.hardness.is_empty() {
            self.measure(system);
        }
        self.momentum.clear();
        self.momentum.resize(system.velocities.len(), 0.0);
        self.bounds.clear();
        self.states.clear();
        self.anderson.begin();
        self.slipped.clear();
        self.slipped.resize(system.rows.len(), false);
        for rows in &*system.rows {
            let (mut bound, mut state) = (0.0, State::Open);
            if rows.acts() {
                rows.add_momentum(system.blocks, rows.impulse, &mut self.momentum);
                let normal = rows.velocities(system.blocks, system.velocities)[0];
                // What has just met has no impulse yet: that which it would have alone.
                let alone = (rows.target - normal) / (rows.effect[0] + rows.compliance);
                bound = rows.friction * if rows.impulse[0] > 0.0 { rows.impulse[0] } else { alone.max(0.0) };
                let [n, t, u] = rows.impulse;
                if n > 0.0 || normal < rows.target {
                    let slips = bound <= 0.0 || t * t + u * u >= bound * bound * (1.0 - TOLERANCE);
                    state = if slips { State::Slips } else { State::Sticks };
                }
            }
            self.bounds.push(bound);
            self.states.push(state);
        }
        for link in system.links.iter().filter(|link| link.acts()) {
            link.rows.add_momentum(system.blocks, link.rows.impulse, &mut self.momentum);
        }
        for joint in &mut self.joints {
            for (velocity, factor) in joint.entries {
                self.momentum[velocity] += factor * joint.impulse;
            }
            joint.is_active = joint.least < joint.impulse && joint.impulse < joint.most
                || joint.impulse == 0.0 && joint.velocity(system.velocities) < 0.0 && joint.least == 0.0;
        }
    }

    /// A step of Newton, as far as it lowers the function; the first one is a whole step for the rows that were equations
    /// before. `None` where there is none.
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
                    given(rows, self.hardness[i], self.states[i], speeds)
                } else {
                    soft(rows, self.hardness[i], self.bounds[i], speeds)
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
            joint.speed = joint.velocity(system.velocities);
            let mut impulse = joint.soft(joint.speed);
            if is_first {
                impulse = if joint.is_active { -joint.speed * joint.hardness } else { joint.impulse };
            } else {
                joint.is_active = joint.least < impulse && impulse < joint.most;
            }
            for (velocity, factor) in joint.entries {
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

    /// What the solution changes the rows' velocities by, and `force` into what it changes `momentum` by: M change, which is the
    /// right side without what the rows take of it.
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
            joint.way = joint.entries.iter().map(|&(at, factor)| factor * self.change[at]).sum();
            if joint.is_active {
                for (velocity, factor) in joint.entries {
                    self.force[velocity] -= factor * joint.hardness * joint.way;
                }
            }
        }
    }

    /// How far along the solution the function falls, 1 at the most. `slope` is that at the begin.
    fn find_length<R>(&self, system: &System<'_, R>, slope: f64) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (constant, square) = (dot(&self.change, &self.momentum), dot(&self.change, &self.force));
        let slope_at = |length: f64| {
            let mut sum = constant + length * square;
            for (i, rows) in system.rows.iter().enumerate() {
                if rows.acts() {
                    let ([a, b, c], way) = (self.speeds[i], self.ways[i]);
                    let at = [a + length * way[0], b + length * way[1], c + length * way[2]];
                    let (impulse, _) = soft(rows, self.hardness[i], self.bounds[i], at);
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

    /// Takes impulses from the soft rows' velocities, and the bounds of friction from these. Whether any row changed.
    fn project<R>(&mut self, system: &mut System<'_, R>) -> bool {
        let (mut changed, mut is_same, mut slips) = (false, true, false);
        self.bound_residuals.clear();
        self.bound_residuals.resize(system.rows.len(), 0.0);
        for (i, rows) in system.rows.iter_mut().enumerate() {
            if !rows.acts() {
                continue;
            }
            let (both, before) = (self.hardness[i], self.bounds[i]);
            let [_, hardness] = both;
            let speeds = rows.slip(system.blocks, system.velocities);
            let (old, weights) = soft(rows, both, before, speeds);
            let bound = rows.friction * old[0];
            let (new, _) = soft(rows, both, bound, speeds);
            let holds = bound > 0.0 && length(speeds[1], speeds[2]) * hardness <= bound;
            let state = match (new[0] > 0.0, holds) {
                (false, _) => State::Open,
                (true, true) => State::Sticks,
                (true, false) => State::Slips,
            };
            let moved = length(new[1] - old[1], new[2] - old[2]);
            let was = self.weights[i];
            let alike = (was[0] > 0.0) == (weights[0] > 0.0)
                && (was[1] == hardness && was[2] == 0.0) == (weights[1] == hardness && weights[2] == 0.0);
            let turned = match state {
                // Across the slip the derivative is not constant: the step was not exact.
                State::Slips => length(old[1] - self.used[i][1], old[2] - self.used[i][2]),
                State::Open | State::Sticks => 0.0,
            };
            changed |= !alike || moved > SLIP_TOLERANCE * new[0] || turned > SLIP_TOLERANCE * new[0];
            let is_slipping = state == State::Slips && bound > 0.0;
            (rows.impulse, self.states[i]) = (new, state);
            is_same &= is_slipping == self.slipped[i];
            self.slipped[i] = is_slipping;
            if is_slipping {
                self.bound_residuals[i] = bound - before;
                slips = true;
            } else {
                self.bounds[i] = bound;
            }
            if state == State::Open {
                rows.impulse = [0.0; 3];
            }
        }
        if !is_same {
            self.anderson.begin();
        }
        if slips {
            let slipped = self.slipped.iter().zip(&self.bounds);
            self.slip_bounds.clear();
            self.slip_bounds.extend(slipped.map(|(slips, bound)| if *slips { *bound } else { 0.0 }));
            self.anderson.advance(&mut self.slip_bounds, &self.bound_residuals);
            for (i, bound) in self.bounds.iter_mut().enumerate().filter(|(i, _)| self.slipped[*i]) {
                *bound = self.slip_bounds[i].max(0.0);
            }
        }
        for link in system.links.iter_mut().filter(|link| link.acts()) {
            let (impulse, weights, state) = link.soft(link.rows.velocities(system.blocks, system.velocities));
            let moved = (0..3).map(|k| (impulse[k] - link.used[k]).powi(2)).sum::<f64>().sqrt();
            // Its derivative is not constant there: the step was not exact.
            let turned = state == LinkState::Saturated && moved > SLIP_TOLERANCE * link.most;
            changed |= turned || (state == LinkState::Holds && link.weights != weights);
            changed |= state == LinkState::Open && link.weights != [0.0; 6];
            (link.rows.impulse, link.state) = (impulse, state);
        }
        for joint in &mut self.joints {
            let impulse = joint.soft(joint.velocity(system.velocities));
            let is_active = joint.least < impulse && impulse < joint.most;
            changed |= is_active != joint.is_active;
            (joint.impulse, joint.is_active) = (impulse, is_active);
        }
        changed
    }

    /// Whether the impulses keep to their bounds, and what is not active to its side.
    pub(super) fn holds<R>(&self, system: &System<'_, R>) -> bool {
        let contacts = system.rows.iter().zip(&self.states).all(|(rows, state)| {
            let [n, t, u] = rows.impulse;
            match state {
                State::Open => {
                    !rows.acts()
                        || rows.velocities(system.blocks, system.velocities)[0] >= rows.target - TOLERANCE
                }
                State::Slips | State::Sticks => {
                    n >= 0.0 && length(t, u) <= rows.friction * n * (1.0 + 1e-6) + f64::MIN_POSITIVE
                }
            }
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
