//! Surfaces and damping of links.

use crate::simulation::command::LinkProperties;
use crate::simulation::error::Error;
use crate::simulation::{Reply, Simulation};

impl Simulation {
    pub(in crate::simulation) fn set_link_properties(
        &mut self,
        robot: &str,
        links: &[LinkProperties],
        stays_awake: Option<bool>,
    ) -> Result<Reply, Error> {
        let robot_index = self.robot_index(robot)?;
        let entity = &mut self.entities[robot_index];
        let found = entity.check_links(links, "links")?;
        let before = entity.state.groups.clone();
        let settings = &mut entity.state.contact_settings;
        settings.stays_awake = stays_awake.unwrap_or(settings.stays_awake);
        for (link, properties) in found.into_iter().zip(links) {
            entity.colliders.set_material(link, &properties.material);
            entity.set_groups(link, properties);
            entity.set_damping(link, properties);
        }
        if links.iter().any(|link| link.linear_damping.is_some() || link.angular_damping.is_some()) {
            entity.body.begin_external_change();
            entity.update_external_forces();
        }
        entity.state.surfaces = entity.colliders.surfaces().collect();
        if entity.state.groups != before {
            self.filter_changed(&[robot_index]);
        }
        self.settings_changed(robot_index);
        self.wake_around(robot_index);
        Ok(Reply::Done)
    }
}
