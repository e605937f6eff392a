//! Colours that programs give links, in place of those of their descriptions.

use std::collections::BTreeMap;
use std::sync::Arc;

use simd_core::Error;
use tokio::time::Instant;

use super::super::{CallError, SimHandle};

/// Maximum number of links with a given colour.
const LINKS: usize = 65_536;

/// The colour of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkColor {
    /// Name of the robot.
    pub robot: Arc<str>,
    /// Name of the link.
    pub link: Arc<str>,
    /// Red, green, blue and alpha from 0 to 1; `None` restores the description's colour.
    pub color: Option<[f64; 4]>,
}

/// A given colour of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenColor {
    /// Red, green, blue and alpha from 0 to 1.
    pub color: [f64; 4],
    /// Version of the robot's layout when the colour was given.
    pub layout_version: u64,
}

/// Given colours by robot and link.
pub(in crate::handle) type Given = BTreeMap<(Arc<str>, Arc<str>), GivenColor>;

/// Given colours of all robots.
#[derive(Debug, Default)]
pub(super) struct Colors {
    given: Arc<Given>,
    /// Version of the view at their last change.
    version: u64,
}

impl Colors {
    /// Returns all colours, if they have changed since a version.
    pub(super) fn since(&self, version: Option<u64>) -> Option<Arc<Given>> {
        let is_new = version.is_none_or(|version| self.version > version);
        (is_new && self.version > 0).then(|| Arc::clone(&self.given))
    }
}

impl SimHandle {
    /// Sets colours of links, all of them or none.
    ///
    /// # Errors
    /// Returns an error if a robot or link does not exist, or too many links have a colour.
    pub fn set_link_colors(&self, colors: Vec<LinkColor>) -> Result<(), CallError> {
        let robots: Vec<&str> = colors.iter().map(|color| &*color.robot).collect();
        self.note_robots(robots.iter().copied());
        self.check_robots(Some(&robots))?;
        let newest = self.newest();
        let entities = &newest.state.world.entities;
        let indices: BTreeMap<&str, usize> =
            entities.iter().enumerate().map(|(index, entity)| (entity.name.as_str(), index)).collect();
        let found = |robot: &str| indices.get(robot).and_then(|index| entities.get(*index));
        let mut changes = Vec::with_capacity(colors.len());
        for LinkColor { robot, link, color } in colors {
            let Some(entity) = found(&robot) else {
                let known = entities.iter().map(|entity| entity.name.clone()).collect();
                return Err(CallError::World(Error::RobotNotFound { robot: robot.to_string(), known }));
            };
            if !entity.model.links.iter().any(|each| each.name == *link) {
                let known = entity.model.links.iter().map(|each| each.name.clone()).collect();
                let (robot, link) = (robot.to_string(), link.to_string());
                return Err(CallError::World(Error::LinkNotFound { robot, link, known }));
            }
            let given = color.map(|color| GivenColor { color, layout_version: entity.version });
            changes.push(((robot, link), given));
        }
        self.inner.view.change(Instant::now(), |state, version| {
            let mut given = Given::clone(&state.colors.given);
            // Colours of deleted or reloaded robots are dropped.
            given.retain(|(robot, _), color| {
                found(robot).is_some_and(|entity| entity.version == color.layout_version)
            });
            for (link, color) in changes {
                match color {
                    Some(color) => given.insert(link, color),
                    None => given.remove(&link),
                };
            }
            if given.len() > LINKS {
                return Err(CallError::World(Error::LimitExceeded {
                    what: "the number of links with a colour of their own".into(),
                    value: given.len() as u64,
                    limit: LINKS as u64,
                }));
            }
            let is_other = given != *state.colors.given;
            if is_other {
                state.colors = Colors { given: Arc::new(given), version };
            }
            Ok(((), is_other))
        })
    }
}
