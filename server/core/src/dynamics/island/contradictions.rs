//! Constraints that cannot all hold: two welds that want one box at two places, or a chain that is too short for where its ends are to be.
//!
//! Such rows never reach what they aim at. A target that asks for more all the same is a motor: where the links can move across
//! it, each step puts energy in, without end. So what is found to contradict goes on as all of it together allows, and
//! slowly: it settles where the sum of R p^2 is the least, and presses with what loads ask for.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::link_rows::{LinkState, MAX_CORRECTION};

/// What reaches less than 1 - this of what it aims at does not reach it.
pub(super) const UNREACHED: f64 = 0.2;

/// How fast it goes on at the most, m/s and rad/s.
const SLOW: [f64; 2] = [0.2, 0.6];

impl Island {
    /// Finds what contradicts, and solves again with what it can reach. False where it was interrupted.
    pub(super) fn settle_contradictions<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        if self.can_be_met(robots) {
            return true;
        }
        let Self { links, blocks, velocities, .. } = self;
        let mut is_any = false;
        for link in links.iter_mut().filter(|link| link.acts() && link.state == LinkState::Holds) {
            if link.unreached.is_some() || !link.is_far() || link.most.is_finite() {
                continue;
            }
            let targets = DVec3::from_array(link.targets);
            let speeds = DVec3::from_array(link.rows.velocities(blocks, velocities));
            let left = targets - speeds;
            let kind = usize::from(link.turns);
            let (most, left) = if left.length() > UNREACHED * targets.length() {
                (SLOW[kind], left)
            } else {
                (MAX_CORRECTION[kind], DVec3::ZERO)
            };
            link.go_on_at(speeds.clamp_length_max(most).to_array(), left.to_array());
            is_any = true;
        }
        if !is_any {
            return true;
        }
        self.direct.begin();
        self.find_impulses(robots, interrupt)
    }

    /// Whether there is no more than one constraint, of a robot that is free to go where it asks.
    fn can_be_met<R: AsMut<Articulation>>(&self, robots: &mut [R]) -> bool {
        let Some(first) = self.links.first() else { return true };
        self.links.iter().all(|link| link.rows.contact == first.rows.contact)
            && first
                .ends
                .iter()
                .any(|(member, body)| body.is_some() && !robots[*member].as_mut().tree().fixed_base)
    }
}
