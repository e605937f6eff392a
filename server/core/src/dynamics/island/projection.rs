//! Positions that meet the constraints between links, and not only velocities that do.
//!
//! A row is the tangent of a curve, and what turns by a tenth of a radian in a step is far from its tangent then. What the
//! velocities that were found would leave the tangent by is seen in the positions that they lead to, is put right beforehand, and the
//! velocities are found again: the positions at the end of the step then keep the constraints with forces that act
//! along the rows at its beginning. That is SHAKE (Ryckaert, Ciccotti and Berendsen (1977)), which is symplectic (Leimkuhler and
//! Skeel, "Symplectic numerical integrators in constrained Hamiltonian systems" (1994)), with the rows of contacts, limits and
//! friction in the same equations, and with the matrix of the first solution in each round (a simplified Newton's method).

use glamx::{DPose3, DVec3};

use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::direct::System;
use crate::dynamics::constraint::link_rows::LinkState;
use crate::dynamics::constraint::three_rows::weigh;

/// Rounds at the most, each of which costs what a refinement of the solution does.
const MAX_ROUNDS: usize = 20;

/// It is near enough where nothing changes by more than this, m or rad.
const ENOUGH: f64 = 1e-10;

/// What leaves its tangent farther than this in a step is not followed, m or rad.
const MOST_BENT: f64 = 0.1;

/// For robots with joints, which are not stiffened as [single bodies](super::stiffening) are: a departure from the tangent that changes by
/// more than this from step to step is not followed, and is damped, m or rad.
const MOST_SUDDEN: f64 = 1e-5;

impl Island {
    /// Has positions after a step of `h` meet the constraints. Nothing where the rows were not solved directly, since it takes exact
    /// solutions, or where velocities belong to the beginning of the step. It ends where rounds come no nearer; where they lead farther
    /// off than the first one was, all is as it was. False where it was interrupted.
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
                link.aim_ahead(ahead);
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

    /// What each constraint leaves its tangent by with these velocities. By how much that is not what was taken for it, at
    /// the most; `None` where it was interrupted.
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
            let is_followed =
                DVec3::from_array(bending).length() <= MOST_BENT && (is_single || sudden <= MOST_SUDDEN);
            if is_followed {
                link.bending = bending;
                let change = weigh(link.directions, [0, 1, 2].map(|k| bending[k] - link.ahead[k]));
                largest = change.into_iter().fold(largest, |largest, change| largest.max(change.abs()));
            }
        }
        Some(largest)
    }

    /// The errors of each constraint after a step of `h` with the velocities that there are. False where it was interrupted, which is asked
    /// before each: where an end is takes a walk to its robot's root, which may be far.
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
            // Forces and torques of a constraint follow each other.
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
