//! Positions that satisfy the constraints between links, in addition to the velocities.
//!
//! A row is the tangent of a curve. A body that turns by a tenth of a radian in a step leaves its tangent far
//! behind. The positions that the velocities lead to show this departure. It is corrected in advance, and the
//! velocities are computed again. The positions at the end of the step then satisfy the constraints with
//! forces along the rows at its start. This is SHAKE (Ryckaert, Ciccotti and Berendsen (1977)), which is
//! symplectic (Leimkuhler and Skeel, "Symplectic numerical integrators in constrained Hamiltonian systems"
//! (1994)). The rows of contacts, limits and friction are in the same equations. Each round uses the matrix
//! of the first solution (a simplified Newton's method).

use glamx::{DPose3, DVec3};

use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::link_rows::LinkState;
use crate::dynamics::constraint::three_rows::weigh;
use crate::dynamics::direct::System;

/// Maximum number of rounds, each of which costs as much as a refinement of the solution.
const MAX_ROUNDS: usize = 20;

/// Largest change at which iteration ends, m or rad.
const ENOUGH: f64 = 1e-10;

/// Largest departure from the tangent in a step that is corrected, m or rad.
const MAX_DEPARTURE: f64 = 0.1;

/// Largest change of a departure from step to step that is corrected, m or rad; larger ones are damped. For
/// robots with joints, which are not stiffened as [single bodies](super::stiffening) are.
const MAX_DEPARTURE_CHANGE: f64 = 1e-5;

impl Island {
    /// Makes positions after a step of `h` satisfy the constraints. Does nothing if rows were not solved
    /// directly, since it needs exact solutions, or if velocities belong to the start of the step.
    ///
    /// It ends when a round does not reduce the change of the departures. If the change then exceeds the
    /// first round's, the initial assumption is restored. Returns false if interrupted.
    pub(super) fn project<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        if self.links.is_empty() || robots.iter_mut().any(|robot| robot.as_mut().may_halve_its_kick()) {
            return true;
        }
        let (mut first, mut last) = (f64::INFINITY, f64::INFINITY);
        for round in 0..MAX_ROUNDS {
            if !self.was_least {
                return true;
            }
            let Some(change) = self.find_bending(robots, constraints, h, interrupt) else { return false };
            if round == 0 {
                first = change;
            }
            let comes_nearer = change < last;
            if change <= ENOUGH || !comes_nearer && change <= first {
                return true;
            }
            if interrupt() {
                return false;
            }
            for link in &mut self.links {
                let ahead = if comes_nearer { link.bending } else { link.first_ahead };
                link.set_drift_targets(ahead);
            }
            let Self { members, rows, links, blocks, velocities, free, direct, .. } = self;
            let system = System { robots: &mut *robots, members, rows, links, blocks, free, velocities };
            if !direct.solve_again(system) && !self.find_impulses(robots, interrupt) {
                return false;
            }
            if !comes_nearer {
                return true;
            }
            last = change;
        }
        true
    }

    /// Computes the departure of each constraint from its tangent with these velocities. Returns the largest
    /// difference from the assumed departure; `None` if interrupted.
    fn find_bending<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> Option<f64> {
        if !self.find_errors_after(robots, constraints, h, interrupt) {
            return None;
        }
        let Self { links, blocks, velocities, .. } = self;
        let mut largest = 0.0f64;
        for link in links {
            link.bending = link.ahead;
            if link.gear.is_some()
                || link.state != LinkState::Holds
                || !link.acts()
                || link.is_far()
                || link.is_brake
            {
                continue;
            }
            let speeds = link.rows.velocities(blocks, velocities);
            let bending = [0, 1, 2].map(|k| link.errors_after[k] - link.errors[k] - h * speeds[k]);
            let is_single = link
                .ends
                .iter()
                .all(|(member, body)| body.is_none() || robots[*member].as_mut().free_moment().is_some());
            let sudden = DVec3::from_array(bending).distance(DVec3::from_array(link.first_ahead));
            let is_followed = DVec3::from_array(bending).length() <= MAX_DEPARTURE
                && (is_single || sudden <= MAX_DEPARTURE_CHANGE);
            if is_followed {
                link.bending = bending;
                let change = weigh(link.directions, [0, 1, 2].map(|k| bending[k] - link.ahead[k]));
                largest = change.into_iter().fold(largest, |largest, change| largest.max(change.abs()));
            }
        }
        Some(largest)
    }

    /// Computes the errors of each constraint after a step of `h` with the present velocities. Returns false
    /// if interrupted. It calls `interrupt` before each constraint: the pose of an end takes a walk to its
    /// robot's root, which may be long.
    pub(super) fn find_errors_after<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        h: f64,
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        let Self { members, links, blocks, velocities, .. } = self;
        let mut last: Option<(usize, [DPose3; 2])> = None;
        for link in links {
            if link.gear.is_some() {
                let speeds = link.rows.velocities(blocks, velocities);
                link.errors_after = [0, 1, 2].map(|k| link.errors[k] + h * speeds[k]);
                continue;
            }
            if link.is_brake {
                link.errors_after = [0.0; 3];
                continue;
            }
            let ActiveConstraint { constraint, fixed, .. } = &constraints[link.rows.contact];
            // Forces and torques of a constraint are adjacent.
            let frames = match last {
                Some((index, frames)) if index == link.rows.contact => frames,
                _ if interrupt() => return false,
                _ => [0, 1].map(|i| {
                    let ((member, body), end) = (link.ends[i], &constraint.definition.ends[i]);
                    let (Some(body), Some((_, index))) = (body, end.link) else { return fixed[i] };
                    let robot = robots[member].as_mut();
                    let own = &velocities[members[member].velocities()];
                    let world_from_body = robot.pose_after(body, own, h);
                    world_from_body * robot.tree().links[index].body_from_link * end.frame
                }),
            };
            last = Some((link.rows.contact, frames));
            link.errors_after = constraint.aims(frames)[usize::from(link.turns)].errors;
        }
        true
    }
}
