//! Pulls of links to points of the world.

use glamx::DVec3;

use crate::simulation::command::LinkPull;
use crate::simulation::error::Error;
use crate::simulation::pull::{
    ActivePull, DEFAULT_PULL_ACCELERATION, DEFAULT_PULL_DURATION, DEFAULT_PULL_STIFFNESS, MAX_PULL,
    MAX_PULL_DURATION, MAX_PULLS, spring,
};
use crate::simulation::settings::PhysicsSettings;
use crate::simulation::{Reply, Simulation, check};

impl Simulation {
    pub(in crate::simulation) fn pull_link(&mut self, pull: &LinkPull) -> Result<Reply, Error> {
        let PhysicsSettings { time_step, substeps, integrator, .. } = self.settings;
        let h = time_step / f64::from(substeps);
        let entity = self.entity_mut(&pull.robot)?;
        let link = entity.link(&pull.link)?;
        let LinkPull { point, target, stiffness, max_force, duration, .. } = *pull;
        check_point("point", point)?;
        if let Some(target) = target {
            check_point("target", target)?;
        }
        for (field, value) in [("stiffness", stiffness), ("max_force", max_force)] {
            if let Some(value) = value {
                check::within(field, value, 0.0..=MAX_PULL)?;
            }
        }
        if let Some(duration) = duration {
            check::within("duration", duration, 0.0..=MAX_PULL_DURATION)?;
        }
        let found = match target {
            Some(target) => entity.point_mobility(link, point, (h, integrator)).and_then(|(at, mobility)| {
                let mass = entity.carried_mass(link);
                let stiffness = stiffness.unwrap_or(DEFAULT_PULL_STIFFNESS * mass);
                let (stiffness, damping) = spring(stiffness, target - at, &mobility, h)?;
                Some(ActivePull {
                    link,
                    point,
                    target,
                    stiffness,
                    damping,
                    max_force: max_force.unwrap_or(DEFAULT_PULL_ACCELERATION * mass),
                    remaining: duration.unwrap_or(DEFAULT_PULL_DURATION),
                    force: DVec3::ZERO,
                })
            }),
            None => None,
        };
        match found {
            Some(_) if !entity.has_room_for_pull(link) => {
                let (what, limit) = (format!("pulls on links of robot {:?}", pull.robot), MAX_PULLS as u64);
                return Err(Error::LimitExceeded { what, value: limit + 1, limit });
            }
            Some(pull) => {
                entity.set_pull(pull);
                if entity.state.pulls.len() > 1 {
                    entity.soften_pulls((h, integrator));
                }
            }
            // A robot that cannot move is not pulled.
            None => entity.end_pull(link),
        }
        entity.update_external_forces();
        let robot_index = self.robot_index(&pull.robot)?;
        self.wake_around(robot_index);
        Ok(Reply::Done)
    }
}

/// Checks a point from which forces are computed.
fn check_point(field: &str, point: DVec3) -> Result<(), Error> {
    for (axis, value) in ["x", "y", "z"].into_iter().zip(point.to_array()) {
        check::moderate(&format!("{field}.{axis}"), value)?;
    }
    Ok(())
}
