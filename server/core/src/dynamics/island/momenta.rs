//! Energy and momenta after position correction.
//!
//! A correction in only positions also transports the velocities so that they keep their kinetic energy.
//! This holds for short displacements; after longer ones the velocities are scaled down until it holds.
//!
//! The correction keeps linear momentum, too, but r x p then has another r. A ring of bodies that is free in
//! space would turn slower with each corrected error. Bodies that drift apart keep their angular momentum on
//! the way out, as the integrator does. They must also keep it on the way back. If nothing holds an island in
//! the world, it therefore gets a rigid-body motion, which all its constraints allow. It then has the momenta
//! that it would have without the correction.
//!
//! This does not apply if a client moves links over a large distance. Two bodies that are moved together from
//! metres apart would turn a thousand times as fast.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::articulation::momenta::Momenta;
use crate::dynamics::inertia::Articulated;
use crate::dynamics::ldlt::Ldlt6;

impl Island {
    /// Integrates positions of robots with velocities and with position correction.
    pub(super) fn finish_with_split_velocities<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        gravity: DVec3,
        h: f64,
    ) {
        let is_far = self.links.iter().any(|link| link.is_far());
        let is_free = !is_far && self.is_free(robots);
        let Some(first) = robots.first_mut() else { return };
        let point = first.as_mut().body_motion(0).pose.translation;
        let (mut before, mut after) = (Momenta::default(), Momenta::default());
        for (robot, member) in robots.iter_mut().zip(&self.members) {
            let robot = robot.as_mut();
            robot.begin_position_update(is_far, gravity, h);
            robot.add_momenta_ahead(point, h, &mut before);
            robot.update_positions(&self.split.velocities[member.velocities()], h);
            robot.add_momenta(point, &mut after);
        }
        let part = if after.energy > before.energy { (before.energy / after.energy).sqrt() } else { 1.0 };
        for robot in robots.iter_mut().filter(|_| part < 1.0) {
            robot.as_mut().scale_motion(part);
        }
        robots.iter_mut().for_each(|robot| robot.as_mut().finish_velocities(gravity, h));
        if is_free {
            let inertia = Ldlt6::new(&Articulated::of(&after.inertia));
            let motion = inertia.solve(before.momentum - after.momentum * part);
            robots.iter_mut().for_each(|robot| robot.as_mut().add_motion(point, motion));
        }
    }

    /// Returns whether nothing holds the island in the world.
    fn is_free<R: AsMut<Articulation>>(&self, robots: &mut [R]) -> bool {
        // Two sides, or one of two links of one robot.
        let is_within = self.rows.iter().all(|rows| rows.sides[0].is_pair || rows.sides[1].len > 0);
        let is_held = self.links.iter().any(|link| link.ends.iter().any(|(_, body)| body.is_none()));
        is_within && !is_held && robots.iter_mut().all(|robot| robot.as_mut().has_free_root())
    }
}
