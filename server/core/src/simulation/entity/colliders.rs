//! Colliders of a robot, as its contact settings request.

use std::sync::Arc;

use simd_model::robot::Material;

use super::Entity;
use crate::collision::{MAX_OWN_PAIRS, RobotColliders, Shapes, Surface};
use crate::dynamics::contact_point::{MAX_DAMPING, STIFFNESS};
use crate::dynamics::link_damping::LinkDamping;
use crate::dynamics::{Articulation, Tree};
use crate::simulation::check;
use crate::simulation::contact_settings::LinkProperties;
use crate::simulation::error::Error;

/// Maximum of Coulomb's coefficient, and of friction against rolling and spinning in metres.
const MAX_FRICTION: f64 = 1e6;

impl Entity {
    /// Rebuilds the colliders from the requested contact settings.
    pub(in crate::simulation) fn make_colliders(&mut self, shapes: &Arc<Shapes>) -> Result<(), Error> {
        let found = self.check_links(&self.state.contact_settings.links, "link_properties")?;
        let tree = self.body.tree();
        self.colliders = RobotColliders::new(tree, shapes, Surface::default());
        let settings = std::mem::take(&mut self.state.contact_settings);
        for (link, properties) in found.into_iter().zip(&settings.links) {
            self.colliders.set_material(link, &properties.material);
            self.set_groups(link, properties);
            self.set_damping(link, properties);
        }
        self.state.contact_settings = settings;
        self.check_self_collision(self.state.contact_settings.self_collision)?;
        self.filter_colliders();
        self.state.surfaces = self.colliders.surfaces().collect();
        // So that a step allocates nothing when a robot falls asleep.
        self.state.rest_poses.reserve(self.colliders.len());
        Ok(())
    }

    /// Sets the groups of all links, or of one of them.
    pub(in crate::simulation) fn set_groups(&mut self, link: Option<usize>, properties: &LinkProperties) {
        let all = 0..self.state.groups.len();
        for groups in &mut self.state.groups[link.map_or(all, |link| link..link + 1)] {
            groups.group = properties.collision_group.unwrap_or(groups.group);
            groups.mask = properties.collision_mask.unwrap_or(groups.mask);
        }
    }

    /// Updates the collision filter of its colliders from its state.
    pub(in crate::simulation) fn filter_colliders(&mut self) {
        let Self { state, body, colliders, .. } = self;
        let self_collision = state.contact_settings.self_collision;
        colliders.set_filter(body.tree(), self_collision, &state.groups, &state.collision_pairs);
    }

    /// Checks that it can have self-collision, if requested, before pairs of its colliders are listed.
    pub(in crate::simulation) fn check_self_collision(&self, self_collision: bool) -> Result<(), Error> {
        if self_collision { check_own_pairs(&self.state.name, &self.colliders) } else { Ok(()) }
    }

    /// Checks that it can have self-collision after a reload with other shapes, if enabled.
    pub(in crate::simulation) fn check_reloaded(
        &self,
        tree: &Tree,
        shapes: &Arc<Shapes>,
    ) -> Result<(), Error> {
        if !self.state.contact_settings.self_collision {
            return Ok(());
        }
        check_own_pairs(&self.state.name, &RobotColliders::new(tree, shapes, Surface::default()))
    }

    /// Checks that it can have these contact settings.
    pub(in crate::simulation) fn check_contact_settings(&self) -> Result<(), Error> {
        self.check_links(&self.state.contact_settings.links, "link_properties").map(|_links| ())
    }

    /// Returns the indices of the links in the field `list`; `None` means all of them.
    pub(in crate::simulation) fn check_links(
        &self,
        links: &[LinkProperties],
        list: &str,
    ) -> Result<Vec<Option<usize>>, Error> {
        let check = |(index, properties): (usize, &LinkProperties)| {
            let LinkProperties { link, material, linear_damping, angular_damping, .. } = properties;
            let Material {
                friction,
                restitution,
                rolling_friction,
                spinning_friction,
                contact_stiffness,
                contact_damping,
            } = material;
            let whose = || if link.is_empty() { "all links".into() } else { format!("link {link:?}") };
            let named = |error: Error| error.within(|| format!("{list}[{index}]")).of(whose);
            for (field, value, most) in [
                ("friction", friction, MAX_FRICTION),
                ("restitution", restitution, 1.0),
                ("rolling_friction", rolling_friction, MAX_FRICTION),
                ("spinning_friction", spinning_friction, MAX_FRICTION),
                ("contact_damping", contact_damping, MAX_DAMPING),
                ("linear_damping", linear_damping, LinkDamping::MAX),
                ("angular_damping", angular_damping, LinkDamping::MAX),
            ] {
                let Some(value) = *value else { continue };
                check::within(field, value, 0.0..=most).map_err(named)?;
            }
            if let Some(stiffness) = *contact_stiffness {
                check::zero_or_within("contact_stiffness", stiffness, STIFFNESS).map_err(named)?;
            }
            if link.is_empty() { Ok(None) } else { self.link(link).map(Some) }
        };
        links.iter().enumerate().map(check).collect()
    }

    /// Returns its colliders at its present pose.
    pub(in crate::simulation) fn placed_colliders(&self) -> RobotColliders {
        let tree = self.body.tree();
        let shapes = self.colliders.shapes();
        let mut colliders = RobotColliders::new(tree, shapes, Surface::default());
        let mut body = Articulation::with_state(Arc::clone(tree), self.body.state().clone());
        body.update_kinematics();
        colliders.update_poses(body.base(), 0.0, 0.0, |body_index| body.body_motion(body_index));
        colliders
    }
}

/// Checks that a robot with these colliders can have self-collision.
pub(in crate::simulation) fn check_own_pairs(robot: &str, colliders: &RobotColliders) -> Result<(), Error> {
    let pairs = colliders.most_own_pairs();
    if pairs <= MAX_OWN_PAIRS {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        what: format!(
            "the number of pairs of shapes of robot {robot:?} that self-collision looks at (there are fewer with convex hulls for \
             meshes, `collision` hull, and with fewer shapes a link; without self-collision there are none)"
        ),
        value: pairs,
        limit: MAX_OWN_PAIRS,
    })
}
