//! What a user asks of the contacts of a robot.

use serde::{Deserialize, Serialize};
use simd_model::robot::Material;

use crate::plain::bounded_list;

/// Contact settings of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactSettings {
    /// Links of the robot collide with each other, unless a joint connects them.
    pub self_collision: bool,
    /// Surfaces of links, which replace those of the description. A file has at most [`MAX_LINK_PROPERTIES`].
    #[serde(deserialize_with = "bounded_list::deserialize::<MAX_LINK_PROPERTIES, _, _>")]
    pub links: Vec<LinkProperties>,
}

/// Entries of [`ContactSettings::links`] that are read from a file for one robot. In memory one takes twenty times the
/// bytes that it may have in a file.
pub const MAX_LINK_PROPERTIES: usize = 65_536;

/// New settings of a link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkProperties {
    /// Its name; none means all links of the robot.
    pub link: String,
    /// Of the link's colliders; `None` leaves a number as it is.
    pub material: Material,
    /// The groups that the link is in, a bit each; `None` leaves them.
    pub collision_group: Option<u32>,
    /// The groups that it touches, a bit each; `None` leaves them.
    pub collision_mask: Option<u32>,
}

/// Pairs that one robot has of its own links, and that a world has of links of different robots.
pub const MAX_COLLISION_PAIRS: usize = 65_536;
