//! Links: what their surfaces are like, and what they touch.

use std::sync::Arc;

use simd_model::robot::Material;

use super::check;
use super::command::LinkProperties;
use super::entity::Entity;
use super::error::Error;
use super::{Reply, Simulation};
use crate::collision::{RobotColliders, Shapes, Surface};
use crate::dynamics::Articulation;

/// Coulomb's coefficient at the most.
const MOST_FRICTION: f64 = 1e6;

impl Simulation {
    pub(super) fn set_link_properties(
        &mut self,
        robot: &str,
        links: &[LinkProperties],
    ) -> Result<Reply, Error> {
        let robot_index = self.robot_index(robot)?;
        let entity = &mut self.entities[robot_index];
        let found = entity.check_links(links, "links")?;
        for (link, properties) in found.into_iter().zip(links) {
            entity.colliders.set_material(link, &properties.material);
        }
        entity.state.surfaces = entity.colliders.surfaces().collect();
        self.settings_changed(robot_index);
        self.wake_around(robot_index);
        Ok(Reply::Done)
    }
}

/// Whether a surface can be; or what is wrong with it, as a fragment of a sentence.
pub(super) fn check_surface(surface: &Surface) -> Result<(), String> {
    let Surface { friction, restitution } = *surface;
    // A description may say more than a request may.
    if friction >= 0.0 && friction.is_finite() && (0.0..=1.0).contains(&restitution) {
        return Ok(());
    }
    Err(format!("a surface of friction {friction} and restitution {restitution}"))
}

impl Entity {
    /// Makes the colliders anew, as the robot was asked to touch.
    pub(super) fn make_colliders(&mut self, shapes: &Arc<Shapes>) -> Result<(), Error> {
        let found = self.check_links(&self.state.contact_settings.links, "link_properties")?;
        let tree = self.body.tree();
        self.colliders =
            RobotColliders::new(tree, shapes, Surface::default(), self.state.contact_settings.self_collision);
        for (link, properties) in found.into_iter().zip(&self.state.contact_settings.links) {
            self.colliders.set_material(link, &properties.material);
        }
        self.state.surfaces = self.colliders.surfaces().collect();
        // A step allocates nothing, also not where a robot falls asleep.
        self.state.rest_poses.reserve(self.colliders.len());
        Ok(())
    }

    /// Whether it can have these contact settings.
    pub(super) fn check_contact_settings(&self) -> Result<(), Error> {
        self.check_links(&self.state.contact_settings.links, "link_properties").map(|_links| ())
    }

    /// Indices of the links, which the field `list` has; `None` for all of them.
    fn check_links(&self, links: &[LinkProperties], list: &str) -> Result<Vec<Option<usize>>, Error> {
        let check = |(index, properties): (usize, &LinkProperties)| {
            let LinkProperties { link, material: Material { friction, restitution } } = properties;
            for (field, value, most) in
                [("friction", friction, MOST_FRICTION), ("restitution", restitution, 1.0)]
            {
                let Some(value) = *value else { continue };
                let whose = || if link.is_empty() { "all links".into() } else { format!("link {link:?}") };
                check::within(field, value, 0.0..=most)
                    .map_err(|error| error.within(|| format!("{list}[{index}]")).of(whose))?;
            }
            if link.is_empty() { Ok(None) } else { self.link(link).map(Some) }
        };
        links.iter().enumerate().map(check).collect()
    }

    /// Its colliders where it is now.
    pub(super) fn placed_colliders(&self) -> RobotColliders {
        let tree = self.body.tree();
        let self_collision = self.state.contact_settings.self_collision;
        let shapes = self.colliders.shapes();
        let mut colliders = RobotColliders::new(tree, shapes, Surface::default(), self_collision);
        let mut body = Articulation::with_state(Arc::clone(tree), self.body.state().clone());
        body.update_kinematics();
        colliders.update_poses(body.base(), 0.0, 0.0, |body_index| body.body_motion(body_index));
        colliders
    }
}
