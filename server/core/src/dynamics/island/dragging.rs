//! Constraints by which a client drags links, and links that do not follow.
//!
//! Velocities that close an error move the held links and whatever those push. If other constraints or joint
//! limits keep the error from closing, these velocities are a motor without end. A constraint that does not
//! come as near as its velocities promise is therefore held at its present place. It is corrected [in
//! positions alone](super::split_velocities), which adds no energy.

use glamx::DVec3;

use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::link_rows::LinkState;

/// Part of the aimed correction that a constraint may miss and still count as reaching its target.
pub(super) const UNREACHED: f64 = 0.2;

/// Departure from the tangent, as a part of the displacement, beyond which a constraint does not move towards
/// its target.
const BENT: f64 = 0.5;

/// Smallest displacement that counts, m or rad.
const NO_WAY: f64 = 1e-6;

/// Maximum number of rounds. In the last one, all dragged constraints are released if any does not follow.
const ROUNDS: usize = 2;

impl Island {
    /// Holds constraints that do not follow at their present place, and solves again. Returns false if
    /// interrupted.
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
