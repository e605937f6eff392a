//! Constraints that cannot all hold: two welds that want one box at two places, or a chain that is too short for where its ends are to be.
//!
//! Such rows never reach what they aim at. A target that asks for more all the same is a motor: where the links can move across
//! it, each step puts energy in, without end. So what is found to contradict goes on no faster than it does now, and no
//! faster than an error of [`FAR`] is put right: it settles where all are equally far off, by the sum of R p^2, and presses
//! with what loads ask for. What an error of less than that is put right by is slow enough to do no harm.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::ERROR_REDUCTION;
use crate::dynamics::constraint::link_rows::{FAR, LinkState};

/// What reaches less than 1 - this of what it aims at does not reach it.
const UNREACHED: f64 = 0.2;

impl Island {
    /// Finds what contradicts in a step of `h`, and solves again with what it can reach. False where it was interrupted.
    pub(super) fn settle_contradictions<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        let Self { links, blocks, velocities, .. } = self;
        let mut is_any = false;
        for link in links.iter_mut().filter(|link| link.acts() && link.state == LinkState::Holds) {
            if link.unreached.is_some() || !link.is_far() {
                continue;
            }
            let targets = DVec3::from_array(link.targets);
            let speeds = DVec3::from_array(link.rows.velocities(blocks, velocities));
            let left = targets - speeds;
            if left.length() > UNREACHED * targets.length() {
                link.go_on_at(
                    speeds.clamp_length_max(ERROR_REDUCTION * FAR[usize::from(link.turns)] / h).to_array(),
                    left.to_array(),
                );
                is_any = true;
            }
        }
        if !is_any {
            return true;
        }
        self.direct.begin();
        self.find_impulses(robots, interrupt)
    }
}
