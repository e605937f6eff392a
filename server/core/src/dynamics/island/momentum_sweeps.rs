//! Sweeps of an island of single bodies that only contacts hold: a heap.

use super::{Island, SETTLED};
use crate::dynamics::constraint::momentum::carried;

/// Sweeps at the most. With momentum they come as near as without in twice as many.
const MOST_SWEEPS: usize = 25;

impl Island {
    /// Sweeps with [`Momentum`](crate::dynamics::constraint::momentum::Momentum), several contacts at once where that is worth it, to the
    /// same bits. False where it was interrupted.
    ///
    /// Sweeps alone lower f(p) of [`Island::start`], and momentum may not: where f(p) is above 0, impulses are scaled to where it is
    /// least, as those are that it starts from.
    pub(super) fn sweep_with_momentum(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        let Self { placed, rows, blocks, velocities, single_bodies, momentum, impulses_before, .. } = self;
        momentum.begin(velocities);
        impulses_before.clear();
        // Whichever way sweeps go: a step takes no memory where they go the other way for the first time.
        impulses_before.extend(rows.iter().map(|rows| rows.impulse));
        let bodies = placed.iter().map(|placed| placed.map(|placed| placed.body));
        let until = (MOST_SWEEPS, SETTLED);
        let at_once = if single_bodies.take(bodies) {
            single_bodies.sweep((rows, blocks), (velocities, momentum), until, interrupt)
        } else {
            None
        };
        let is_whole = at_once.unwrap_or_else(|| self.sweep_one_by_one(interrupt));
        self.limit_contact_energy();
        is_whole
    }

    fn sweep_one_by_one(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        let Self { rows, blocks, velocities, momentum, impulses_before, .. } = self;
        for sweep in 0..MOST_SWEEPS {
            if interrupt() {
                return false;
            }
            let part = momentum.carry(velocities, sweep + 1 == MOST_SWEEPS);
            let mut change = 0.0f64;
            for (rows, before) in rows.iter_mut().zip(&mut *impulses_before).filter(|(rows, _)| rows.acts()) {
                let now = rows.impulse;
                rows.impulse = [0, 1, 2].map(|k| carried(now[k], before[k], part));
                *before = now;
                change = change.max(rows.solve(blocks, velocities));
            }
            if change <= SETTLED {
                break;
            }
            momentum.note(change);
        }
        true
    }

    /// Makes the impulses of contacts smaller where they would add energy.
    fn limit_contact_energy(&mut self) {
        let (linear, square) = self.contact_energy();
        if linear < 0.5 * square {
            let part = (linear / square).max(0.0);
            for rows in &mut self.rows {
                rows.impulse = rows.impulse.map(|impulse| impulse * part);
            }
            for (velocity, free) in self.velocities.iter_mut().zip(&self.free) {
                *velocity = *free + part * (*velocity - *free);
            }
        }
    }
}
