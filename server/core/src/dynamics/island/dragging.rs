//! What a client drags along by a constraint, and where that does not follow.
//!
//! Velocities that close an error take along what is held, and what that pushes. But where other constraints, or the way that is left
//! to joints, do not let the error close, they are a motor without end. So what does not come as near as its velocities
//! promise is held where it is, and put right [in positions alone](super::split_velocities), which moves no energy.

use glamx::DVec3;

use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::link_rows::LinkState;

/// What reaches less than 1 - this of what it aims at does not reach it.
pub(super) const UNREACHED: f64 = 0.2;

/// What leaves its tangent by more than this part of its way does not go where it aims at.
const BENT: f64 = 0.5;

/// Less than this is no way, m or rad.
const NO_WAY: f64 = 1e-6;

/// Rounds at the most: in the last one all that is pulled is let go where any does not follow.
const ROUNDS: usize = 2;

impl Island {
    /// Has what does not follow held where it is, and solves again. False where it was interrupted.
    pub(super) fn stop_idle_pulls<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        let is_pulled = |link: &&mut super::LinkRows| link.is_pulled && link.acts() && !link.is_slack();
        for round in 1..=ROUNDS {
            if !self.links.iter_mut().any(|link| is_pulled(&link)) {
                return true;
            }
            if !self.find_errors_after(robots, constraints, h, interrupt) {
                return false;
            }
            let Self { links, blocks, velocities, .. } = self;
            let mut is_any = false;
            for link in links.iter_mut().filter(is_pulled) {
                let (targets, speeds) = (
                    DVec3::from_array(link.targets),
                    DVec3::from_array(link.rows.velocities(blocks, velocities)),
                );
                let is_reached = link.state == LinkState::Saturated
                    || targets.distance(speeds) <= UNREACHED * targets.length();
                let linear = DVec3::from_array(link.errors) + h * speeds;
                let bending = DVec3::from_array(link.errors_after).distance(linear);
                if !is_reached || bending > BENT * h * speeds.length() + NO_WAY {
                    link.stop_pulling();
                    is_any = true;
                }
            }
            if !is_any {
                return true;
            }
            if round == ROUNDS {
                links.iter_mut().filter(is_pulled).for_each(|link| link.stop_pulling());
            }
            self.direct.begin();
            self.was_least = false;
            if !self.find_impulses(robots, interrupt) {
                return false;
            }
        }
        true
    }
}
