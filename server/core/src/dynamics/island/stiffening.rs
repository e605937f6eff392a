//! Stiffening of bodies that are pulled so hard that they would swing faster than steps resolve.
//!
//! A link of a rope that is pulled at both ends with a force F swings about the line of the pull. As it turns
//! by an angle, F gets lever arms. Torque per angle is its geometric stiffness, `K = (r . F) 1 - sym(r F')`
//! summed over the points of attack. Constraint forces are those at the start of a step. Like each explicit
//! spring, K is stable only for h^2 K / I < 4. A light rope that a weight snaps tight is far beyond that.
//!
//! A single free body therefore resists impulses as if its moment were at least h^2 K. Swings faster than one
//! radian a step are slowed to one radian a step. This is as in Newmark's method, where K acts at q + h^2 b
//! a. Tournier, Nesme, Gilles and Faure, "Stable constrained dynamics" (2015), use the whole matrix. Andrews,
//! Teichmann and Kovecses, "Geometric stiffness for real-time constrained multibody dynamics" (2017), use its
//! diagonal. A step cannot resolve such a swing, so it is damped: two such bodies that are held together
//! exchange torque against their relative turning. Slower swings are unchanged.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::three_rows::eigen;
use crate::dynamics::inertia::around;
use crate::dynamics::symmetric::Symmetric;

/// Square of the fastest swing, rad^2 in a step.
const FASTEST: f64 = 1.0;

/// Growth of a moment, relative to the one that forces were computed with, from which they are computed
/// again.
const GROWTH: f64 = 1.4;

/// Part of the smaller additional moment by which relative turning is braked in a step.
const BRAKE: f64 = 0.2;

impl Island {
    /// Computes the moments that the constraints' present impulses require in steps of `h`. Returns whether
    /// any far exceeds the one that impulses were computed with.
    pub(super) fn find_stiffening<R: AsMut<Articulation>>(&mut self, robots: &mut [R], h: f64) -> bool {
        let Self { members, links, stiffening, stiffness, .. } = self;
        stiffening.resize(members.len(), Symmetric::ZERO);
        if links.is_empty() {
            return false;
        }
        stiffness.clear();
        stiffness.resize(members.len(), Symmetric::ZERO);
        for link in links.iter().filter(|link| !link.turns && link.gear.is_none() && !link.is_brake) {
            let impulse = link.rows.world_impulse();
            for ((member, body), sign) in link.ends.into_iter().zip([-1.0, 1.0]) {
                if body.is_none() {
                    continue;
                }
                if let Some((center, _)) = robots[member].as_mut().free_moment() {
                    stiffness[member] += around(link.point - center, impulse * (sign * h));
                }
            }
        }
        let mut is_much = false;
        for ((robot, stiffness), stiffening) in robots.iter_mut().zip(&*stiffness).zip(stiffening) {
            let used = std::mem::take(stiffening);
            if *stiffness == Symmetric::ZERO {
                continue;
            }
            let Some((_, moment)) = robot.as_mut().free_moment() else { continue };
            let Symmetric { xx, xy, xz, yy, yz, zz } = *stiffness;
            let (values, vectors) = eigen([xx, xy, xz, yy, yz, zz]);
            for (value, vector) in values.into_iter().zip(vectors) {
                let axis = DVec3::from_array(vector);
                let along = |matrix: &Symmetric| axis.dot(matrix.times(axis));
                let (wanted, own) = (value / FASTEST, along(&moment));
                // NaN is not a moment.
                if wanted > own {
                    *stiffening = stiffening.without(axis, own - wanted);
                    is_much |= wanted > GROWTH * (own + along(&used));
                }
            }
        }
        is_much
    }

    /// Applies the computed moments to the bodies' resistance.
    pub(super) fn apply_stiffening<R: AsMut<Articulation>>(&self, robots: &mut [R]) {
        for (robot, stiffening) in robots.iter_mut().zip(&self.stiffening) {
            if *stiffening != Symmetric::ZERO {
                robot.as_mut().add_turning_resistance(*stiffening);
            }
        }
    }

    /// Brakes the relative swinging of stiffened bodies.
    pub(super) fn brake_swinging<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        let Self { members, links, stiffening, velocities, scratch, .. } = self;
        for link in links.iter().filter(|link| !link.turns && link.gear.is_none() && !link.is_brake) {
            let [(a, Some(_)), (b, Some(_))] = link.ends else { continue };
            let size = |member: usize| stiffening.get(member).map_or(0.0, Symmetric::largest);
            let moment = BRAKE * size(a).min(size(b));
            if moment <= 0.0 || a == b {
                continue;
            }
            let angular = [a, b].map(|member| {
                let own = &velocities[members[member].velocities()];
                let turn = robots[member].as_mut().body_motion(0).pose.rotation;
                turn * DVec3::new(own[3], own[4], own[5])
            });
            let way = link.rows.world_impulse().normalize_or_zero();
            let relative = angular[1] - angular[0];
            let torque = (relative - way * relative.dot(way)) * moment;
            for (member, torque) in [(a, torque), (b, -torque)] {
                let robot = robots[member].as_mut();
                let response = &mut scratch[..members[member].len];
                let wrench = robot.torque(torque);
                robot.wrench_response(0, wrench, response);
                let own = &mut velocities[members[member].velocities()];
                own.iter_mut().zip(&*response).for_each(|(own, response)| *own += response);
            }
        }
    }
}
