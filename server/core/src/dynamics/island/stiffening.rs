//! Bodies that are pulled so hard that they would swing faster than steps resolve.
//!
//! A link of a rope that is pulled at both ends with a force F swings about the line of the pull: as it turns by an angle, F has
//! arms, and torque by angle is K = (r . F) 1 - sym(r F') summed over where it is pulled, its geometric stiffness. Constraint
//! forces are those of the beginning of a step: like each spring that is taken so, K is stable for h^2 K / I < 4 alone, and a
//! light rope that snaps tight with a weight is far beyond that.
//!
//! So a single free body resists impulses as if its moment were at least h^2 K: what swings faster than one radian a step swings at one
//! radian a step, as in Newmark's method, where K acts at q + h^2 b a (Tournier, Nesme, Gilles and Faure, "Stable
//! constrained dynamics" (2015), has it for all of a matrix; Andrews, Teichmann and Kovecses, "Geometric stiffness for real-time
//! constrained multibody dynamics" (2017), for its diagonal). What swings so is no motion that a step knows anything of, and is damped: two
//! such bodies that are held together exchange torque by how they turn against each other. What swings slower is as it is.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::three_rows::eigen;
use crate::dynamics::inertia::around;
use crate::dynamics::symmetric::Symmetric;

/// The square of the fastest swing, rad^2 in a step.
const FASTEST: f64 = 1.0;

/// Where forces ask for more than this times the moment that they were found with, they are found again.
const GROWTH: f64 = 1.4;

/// The part of the smaller additional moment by which relative turning is braked in a step.
const BRAKE: f64 = 0.2;

impl Island {
    /// Finds the moments that the constraints' present impulses ask for in steps of `h`. Whether any is much above that
    /// which they were found with.
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
                // What is not a number is no moment.
                if wanted > own {
                    *stiffening = stiffening.without(axis, own - wanted);
                    is_much |= wanted > GROWTH * (own + along(&used));
                }
            }
        }
        is_much
    }

    /// Has bodies resist with the moments that were found.
    pub(super) fn stiffen<R: AsMut<Articulation>>(&self, robots: &mut [R]) {
        for (robot, stiffening) in robots.iter_mut().zip(&self.stiffening) {
            if *stiffening != Symmetric::ZERO {
                robot.as_mut().stiffen(*stiffening);
            }
        }
    }

    /// Brakes the swinging against each other of bodies that resist so.
    pub(super) fn brake<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
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
