//! Sweeps of an island of single bodies that only contacts hold: a heap.

use super::{Island, SETTLED};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::momentum::sweep_carried;

/// Maximum number of sweeps. With momentum they come as near as twice as many without.
const MAX_SWEEPS: usize = 25;

impl Island {
    /// Sweeps with [`Momentum`](crate::dynamics::constraint::momentum::Momentum), several contacts at once if
    /// that pays off, with the same bits. Returns false if interrupted.
    ///
    /// Sweeps alone lower the energy f(p) of [`Island::start`]. Momentum may not, so the energy is limited
    /// again at the end.
    pub(super) fn sweep_with_momentum<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        let Self { placed, rows, blocks, velocities, single_bodies, momentum, impulses_before, .. } = self;
        momentum.begin(velocities);
        impulses_before.clear();
        // In both kinds of sweeps, so that a step allocates nothing when the kind changes.
        impulses_before.extend(rows.iter().map(|rows| rows.impulse));
        let bodies = placed.iter().map(|placed| placed.map(|placed| placed.body));
        let until = (MAX_SWEEPS, SETTLED);
        let at_once = if single_bodies.take(bodies) {
            single_bodies.sweep((rows, blocks), (velocities, momentum), until, interrupt)
        } else {
            None
        };
        let is_whole = at_once.unwrap_or_else(|| self.sweep_one_by_one(interrupt));
        self.limit_energy(robots);
        is_whole
    }

    fn sweep_one_by_one(&mut self, interrupt: &dyn Fn() -> bool) -> bool {
        let Self { rows, blocks, velocities, momentum, impulses_before, .. } = self;
        for sweep in 0..MAX_SWEEPS {
            if interrupt() {
                return false;
            }
            let part = momentum.carry(velocities, sweep + 1 == MAX_SWEEPS);
            let change = sweep_carried((rows, impulses_before), part, blocks, velocities);
            if change <= SETTLED {
                break;
            }
            momentum.note(change);
        }
        true
    }
}
