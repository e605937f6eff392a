//! Which rows are equations: judged from impulses and velocities, in each round anew.

use super::{Direct, State, System, TOLERANCE};

impl Direct {
    /// From impulses and velocities as they are.
    pub(super) fn choose_states<R>(&mut self, system: &System<'_, R>) {
        if self.hardness.is_empty() {
            self.measure(system);
        }
        self.states.clear();
        for rows in &*system.rows {
            let [n, t, u] = rows.impulse;
            let most = rows.friction * n;
            let state = if !rows.acts() {
                State::Open
            } else if n > 0.0 {
                let slips = t * t + u * u >= most * most * (1.0 - TOLERANCE);
                if slips { State::Slips } else { State::Sticks }
            } else if rows.velocities(system.blocks, system.velocities)[0] < rows.target {
                if rows.friction > 0.0 { State::Sticks } else { State::Slips }
            } else {
                State::Open
            };
            self.states.push(state);
        }
        for joint in &mut self.joints {
            joint.is_active = joint.least < joint.impulse && joint.impulse < joint.most
                || joint.impulse == 0.0 && joint.velocity(system.velocities) < 0.0 && joint.least == 0.0;
        }
    }

    /// Takes impulses from the soft rows' velocities and judges anew which rows are active. Whether any changed.
    pub(super) fn project<R>(&mut self, system: &mut System<'_, R>) -> bool {
        let mut changed = false;
        for ((rows, state), &hardness) in system.rows.iter_mut().zip(&mut self.states).zip(&self.hardness) {
            if !rows.acts() {
                continue;
            }
            let [n, t, u] = rows.velocities(system.blocks, system.velocities);
            let normal = (rows.target - n) * hardness;
            let (t, u) = (-t * hardness, -u * hardness);
            let next = if normal <= 0.0 {
                rows.impulse = [0.0; 3];
                State::Open
            } else {
                let (most, size) = (rows.friction * normal, (t * t + u * u).sqrt());
                if size <= most && rows.friction > 0.0 {
                    rows.impulse = [normal, t, u];
                    State::Sticks
                } else {
                    let part = if size > 0.0 { most / size } else { 0.0 };
                    let slips = [normal, t * part, u * part];
                    let moved = (slips[1] - rows.impulse[1]).hypot(slips[2] - rows.impulse[2]);
                    changed |= *state == State::Slips && moved > TOLERANCE * normal;
                    rows.impulse = slips;
                    State::Slips
                }
            };
            changed |= next != *state;
            *state = next;
        }
        for joint in &mut self.joints {
            let impulse = -joint.velocity(system.velocities) * joint.hardness;
            joint.impulse = impulse.clamp(joint.least, joint.most);
            let is_active = joint.impulse == impulse;
            changed |= is_active != joint.is_active;
            joint.is_active = is_active;
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
                    n >= 0.0 && t.hypot(u) <= rows.friction * n * (1.0 + 1e-6) + f64::MIN_POSITIVE
                }
            }
        });
        contacts
            && self.joints.iter().all(|joint| {
                let slack = TOLERANCE * joint.impulse.abs();
                joint.least - slack <= joint.impulse && joint.impulse <= joint.most + slack
            })
    }
}
